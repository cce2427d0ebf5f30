//! A block of rays, and the faces that they start on.

use etendue_math::Vec3;

use crate::origin_faces::{MOST_ORIGIN_FACES, NONE, OriginFaces};

/// A block of rays: where they start, where they go, what they start on. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct RayBlock {
    /// Start points, one array per axis \[mm\].
    pub origin: [Vec<f64>; 3],
    /// Unit directions, one array per axis.
    pub direction: [Vec<f64>; 3],
    /// Faces that each ray starts on.
    faces: [Vec<u32>; MOST_ORIGIN_FACES],
    /// The parts of them.
    parts: Vec<[u32; MOST_ORIGIN_FACES]>,
    /// Whether a ray starts on more than one face.
    deep: bool,
}

impl RayBlock {
    /// Number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Start point of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn origin(&self, i: usize) -> Vec3 {
        Vec3::new(self.origin[0][i], self.origin[1][i], self.origin[2][i])
    }

    /// Direction of ray `i`.
    #[inline(always)]
    #[must_use]
    pub fn direction(&self, i: usize) -> Vec3 {
        Vec3::new(self.direction[0][i], self.direction[1][i], self.direction[2][i])
    }

    /// What ray `i` starts on.
    #[inline(always)]
    #[must_use]
    pub fn origin_faces(&self, i: usize) -> OriginFaces {
        OriginFaces {
            face: std::array::from_fn(|slot| self.faces[slot][i]),
            part: self.parts[i],
        }
    }

    /// Faces that each ray starts on. Where none starts on more than one, the list of that one comes in place of the others:
    /// they need not be read.
    #[inline(always)]
    #[must_use]
    pub fn faces(&self) -> [&[u32]; MOST_ORIGIN_FACES] {
        std::array::from_fn(|slot| &self.faces[if self.deep { slot } else { 0 }][..])
    }

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, o: Vec3, d: Vec3, origin_faces: OriginFaces) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis].push(o);
            self.direction[axis].push(d);
        }
        for (slot, face) in self.faces.iter_mut().zip(origin_faces.face) {
            slot.push(face);
        }
        self.parts.push(origin_faces.part);
        self.deep |= origin_faces.face[1] != NONE;
    }

    /// Rays more that all start at one point, and on the same faces.
    pub fn extend_from(&mut self, o: Vec3, direction: &[Vec<f64>; 3], origin_faces: OriginFaces) {
        let n = self.len() + direction[0].len();
        for (mine, x) in self.origin.iter_mut().zip([o.x, o.y, o.z]) {
            mine.resize(n, x);
        }
        for (mine, more) in self.direction.iter_mut().zip(direction) {
            mine.extend_from_slice(more);
        }
        for (slot, face) in self.faces.iter_mut().zip(origin_faces.face) {
            slot.resize(n, face);
        }
        self.parts.resize(n, origin_faces.part);
        self.deep |= origin_faces.face[1] != NONE;
    }

    /// Rays more that all start on one face, or on nothing if that is [`NONE`].
    pub fn extend(
        &mut self,
        origin: [&[f64]; 3],
        direction: [&[f64]; 3],
        face: u32,
        parts: impl ExactSizeIterator<Item = u32>,
    ) {
        let n = self.len() + parts.len();
        self.faces[0].resize(n, face);
        self.extend_lines(origin, direction, parts);
    }

    /// Rays more, each of which starts on a part of a face.
    pub fn extend_each(&mut self, origin: [&[f64]; 3], direction: [&[f64]; 3], (faces, parts): (&[u32], &[u32])) {
        self.faces[0].extend_from_slice(faces);
        self.extend_lines(origin, direction, parts.iter().copied());
    }

    /// Rays more whose first faces are there already.
    fn extend_lines(&mut self, origin: [&[f64]; 3], direction: [&[f64]; 3], parts: impl ExactSizeIterator<Item = u32>) {
        for (mine, more) in self
            .origin
            .iter_mut()
            .chain(&mut self.direction)
            .zip(origin.into_iter().chain(direction))
        {
            mine.extend_from_slice(more);
        }
        let [first, others @ ..] = &mut self.faces;
        for slot in others {
            slot.resize(first.len(), NONE);
        }
        self.parts.extend(parts.map(|part| [part, NONE, NONE, NONE]));
    }

    /// None any more.
    pub fn clear(&mut self) {
        self.origin.iter_mut().chain(&mut self.direction).for_each(Vec::clear);
        self.faces.iter_mut().for_each(Vec::clear);
        self.parts.clear();
        self.deep = false;
    }
}
