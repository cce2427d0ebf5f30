//! The faces that a ray starts on: it does not meet them again at its start.

/// No face.
pub const NONE: u32 = u32::MAX;

/// Faces that a ray can start on at once: more surfaces than that never coincide in one point but in corners.
pub const MOST_ORIGIN_FACES: usize = 4;

/// What a ray starts on: faces, and the parts of them, filled up with [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OriginFaces {
    /// Faces.
    pub face: [u32; MOST_ORIGIN_FACES],
    /// Part of each face.
    pub part: [u32; MOST_ORIGIN_FACES],
}

impl Default for OriginFaces {
    fn default() -> Self {
        Self {
            face: [NONE; MOST_ORIGIN_FACES],
            part: [NONE; MOST_ORIGIN_FACES],
        }
    }
}

impl OriginFaces {
    /// One face more; a ray that starts on more than [`MOST_ORIGIN_FACES`] forgets the rest.
    pub fn add(&mut self, face: u32, part: u32) {
        if let Some(slot) = self.face.iter().position(|f| *f == NONE) {
            (self.face[slot], self.part[slot]) = (face, part);
        }
    }

    /// The parts of `face` that the ray starts on, each in its slot; [`NONE`] in the others.
    #[inline(always)]
    #[must_use]
    pub fn parts_of(&self, face: u32) -> [u32; MOST_ORIGIN_FACES] {
        std::array::from_fn(|slot| if self.face[slot] == face { self.part[slot] } else { NONE })
    }

    /// The parts of `face` that the ray starts on, in `room`.
    #[inline]
    pub fn parts<'a>(&self, face: u32, room: &'a mut [u32; MOST_ORIGIN_FACES]) -> &'a [u32] {
        let mut n = 0;
        for slot in 0..MOST_ORIGIN_FACES {
            if self.face[slot] == face {
                room[n] = self.part[slot];
                n += 1;
            }
        }
        &room[..n]
    }
}
