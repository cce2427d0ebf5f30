//! Which solids a ray is in.

/// Up to four solids that a ray is in at once, by their numbers 1 to 65 535: the largest number first, 0 where there is none.
///
/// A scene lists its solids in the order of their priority: where solids overlap or touch, the space belongs to the one
/// listed last, which is the one at the [`top`](SolidStack::top).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolidStack(u64);

impl SolidStack {
    /// As one number, for storage.
    #[must_use]
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// From a number that [`SolidStack::bits`] gave.
    #[must_use]
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The solid that the space belongs to; 0 outside of all.
    #[inline(always)]
    #[must_use]
    pub const fn top(self) -> u16 {
        (self.0 >> 48) as u16
    }

    /// The numbers, the largest first.
    #[inline(always)]
    #[must_use]
    pub const fn solids(self) -> [u16; 4] {
        [
            (self.0 >> 48) as u16,
            (self.0 >> 32 & 0xFFFF) as u16,
            (self.0 >> 16 & 0xFFFF) as u16,
            (self.0 & 0xFFFF) as u16,
        ]
    }

    /// Whether the ray is in a solid.
    #[inline(always)]
    #[must_use]
    pub fn contains(self, solid: u16) -> bool {
        self.solids().contains(&solid)
    }

    /// After entering a solid it was not in, or leaving one it was in; None if it would be in five at once.
    #[inline]
    #[must_use]
    pub fn crossed(self, solid: u16) -> Option<Self> {
        // The numbers are sorted: where it is, or where it belongs.
        let at = (0_u32..).zip(self.solids()).find(|(_, s)| *s <= solid)?.0;
        let shift = 48 - 16 * at;
        let (mine, below) = (0xFFFF << shift, self.0 & ((1 << shift) - 1));
        let above = self.0 & !(mine | ((1 << shift) - 1));
        if self.0 & mine == u64::from(solid) << shift {
            return Some(Self(above | below << 16));
        }
        let rest = self.0 & (mine | ((1 << shift) - 1));
        (self.solids()[3] == 0).then_some(Self(above | u64::from(solid) << shift | rest >> 16))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_listed_last_owns_the_space() {
        let cross = |stack: SolidStack, solid| stack.crossed(solid).expect("room");
        let one = cross(SolidStack::default(), 7);
        let both = cross(cross(one, 9), 3);
        assert_eq!(both.solids(), [9, 7, 3, 0]);
        assert_eq!(cross(both, 9).top(), 7);
        assert_eq!(cross(cross(cross(both, 7), 9), 3), SolidStack::default());
        let full = cross(both, 65_535);
        assert_eq!(full.crossed(12), None);
        assert_eq!(cross(full, 3).solids(), [65_535, 9, 7, 0]);
        assert_eq!(full.crossed(1), None);
        assert_eq!(cross(full, 65_535), both);
    }
}
