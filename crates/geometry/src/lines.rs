//! A block of rays, and what they start on.

use etendue_math::Vec3;

/// No face.
pub const NONE: u32 = u32::MAX;

/// Faces that a ray can start on at once: more surfaces than that never coincide in one point but in corners.
pub const MOST_LEFT: usize = 4;

/// What a ray starts on: faces, and the parts of them, filled up with [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaving {
    /// Faces.
    pub face: [u32; MOST_LEFT],
    /// Part of each face.
    pub part: [u32; MOST_LEFT],
}

impl Default for Leaving {
    fn default() -> Self {
        Self {
            face: [NONE; MOST_LEFT],
            part: [NONE; MOST_LEFT],
        }
    }
}

impl Leaving {
    /// One face more; a ray that starts on more than [`MOST_LEFT`] forgets the rest.
    pub fn add(&mut self, face: u32, part: u32) {
        if let Some(slot) = self.face.iter().position(|f| *f == NONE) {
            (self.face[slot], self.part[slot]) = (face, part);
        }
    }

    /// The parts of `face` that are left, each in its slot; [`NONE`] in the others.
    #[inline(always)]
    #[must_use]
    pub fn parts_of(&self, face: u32) -> [u32; MOST_LEFT] {
        std::array::from_fn(|slot| if self.face[slot] == face { self.part[slot] } else { NONE })
    }

    /// The parts of `face` that are left, in `room`.
    #[inline]
    pub fn parts<'a>(&self, face: u32, room: &'a mut [u32; MOST_LEFT]) -> &'a [u32] {
        let mut n = 0;
        for slot in 0..MOST_LEFT {
            if self.face[slot] == face {
                room[n] = self.part[slot];
                n += 1;
            }
        }
        &room[..n]
    }
}

/// A block of rays: where they start, where they go, what they start on. Structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// Start points, one array per axis \[mm\].
    pub origin: [Vec<f64>; 3],
    /// Unit directions, one array per axis.
    pub direction: [Vec<f64>; 3],
    /// Faces that each ray starts on.
    left: [Vec<u32>; MOST_LEFT],
    /// The parts of them.
    parts: Vec<[u32; MOST_LEFT]>,
    /// Whether a ray starts on more than one face.
    deep: bool,
}

impl Lines {
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
    pub fn leaving(&self, i: usize) -> Leaving {
        Leaving {
            face: std::array::from_fn(|slot| self.left[slot][i]),
            part: self.parts[i],
        }
    }

    /// Faces that each ray starts on. Where none starts on more than one, the list of that one comes in place of the others:
    /// they need not be read.
    #[inline(always)]
    #[must_use]
    pub fn left(&self) -> [&[u32]; MOST_LEFT] {
        std::array::from_fn(|slot| &self.left[if self.deep { slot } else { 0 }][..])
    }

    /// One ray more.
    #[inline(always)]
    pub fn push(&mut self, o: Vec3, d: Vec3, leaving: Leaving) {
        for (axis, (o, d)) in [(o.x, d.x), (o.y, d.y), (o.z, d.z)].into_iter().enumerate() {
            self.origin[axis].push(o);
            self.direction[axis].push(d);
        }
        for (slot, face) in self.left.iter_mut().zip(leaving.face) {
            slot.push(face);
        }
        self.parts.push(leaving.part);
        self.deep |= leaving.face[1] != NONE;
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
        for (mine, more) in self
            .origin
            .iter_mut()
            .chain(&mut self.direction)
            .zip(origin.into_iter().chain(direction))
        {
            mine.extend_from_slice(more);
        }
        let [first, others @ ..] = &mut self.left;
        first.resize(n, face);
        for slot in others {
            slot.resize(n, NONE);
        }
        self.parts.extend(parts.map(|part| [part, NONE, NONE, NONE]));
    }

    /// None any more.
    pub fn clear(&mut self) {
        self.origin.iter_mut().chain(&mut self.direction).for_each(Vec::clear);
        self.left.iter_mut().for_each(Vec::clear);
        self.parts.clear();
        self.deep = false;
    }
}
