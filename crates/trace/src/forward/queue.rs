//! Rays on their way.

use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::ray_block::RayBlock;
use etendue_math::Vec3;

use crate::solid_stack::SolidStack;

/// Rays on their way. Structure of arrays.
#[derive(Default)]
pub struct RayQueue {
    pub lines: RayBlock,
    /// The state of each, by its place in the block.
    pub who: Vec<u32>,
    pub stack: Vec<SolidStack>,
}

impl RayQueue {
    pub fn len(&self) -> usize {
        self.who.len()
    }

    pub fn is_empty(&self) -> bool {
        self.who.is_empty()
    }

    pub fn clear(&mut self) {
        self.lines.clear();
        self.who.clear();
        self.stack.clear();
    }

    /// Rays more that start on one face, or on none, outside of all solids.
    pub fn extend(
        &mut self,
        o: [&[f64]; 3],
        d: [&[f64]; 3],
        who: impl Iterator<Item = u32>,
        face: u32,
        parts: impl ExactSizeIterator<Item = u32>,
    ) {
        self.lines.extend(o, d, face, parts);
        self.who.extend(who);
        self.stack.resize(self.who.len(), SolidStack::default());
    }

    /// Rays more, each of which starts on a part of a face.
    pub fn extend_each(
        &mut self,
        o: [&[f64]; 3],
        d: [&[f64]; 3],
        who: &[u32],
        starts: (&[u32], &[u32]),
        stacks: impl Iterator<Item = SolidStack>,
    ) {
        self.lines.extend_each(o, d, starts);
        self.who.extend_from_slice(who);
        self.stack.extend(stacks);
    }

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, who: u32, (o, d, origin_faces): (Vec3, Vec3, OriginFaces), stack: SolidStack) {
        self.lines.push(o, d, origin_faces);
        self.who.push(who);
        self.stack.push(stack);
    }
}
