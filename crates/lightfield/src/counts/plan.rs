//! What is to be counted: the parts, their grids, and the rays that are held out.

use crate::carrier::CarrierPart;

/// Chances are counted in these parts of one.
pub const CHANCES: u32 = 1 << 16;

/// Halvings of the coordinates of one part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartGrids {
    /// Of each of the four, in the grid over all of them.
    pub depths: [u32; 4],
    /// In the fine grids: over the place, over the direction.
    pub fine: [u32; 2],
}

impl PartGrids {
    /// Halvings of each of the three grids together.
    fn bits(&self) -> [u32; 3] {
        [self.depths.iter().sum(), 2 * self.fine[0], 2 * self.fine[1]]
    }
}

/// What to count.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The charts, in the order in which rays are offered to them.
    pub parts: Vec<CarrierPart>,
    /// The grids of each.
    pub grids: Vec<PartGrids>,
    /// Rays held out, in parts of [`CHANCES`].
    pub held_out: u32,
    /// Rays kept with their coordinates, in parts of [`CHANCES`]; at most `held_out`: they are among those.
    pub kept: u32,
    /// Seed of the choice.
    pub seed: u64,
}

/// Halvings of each coordinate by which a cell is found; those of a coarser grid are among them.
pub(super) const FINEST: u32 = 16;

/// Where the cells of each part begin in each of the three grids, and how many cells there are.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    /// In the first fold.
    pub parts: Vec<[u32; 3]>,
    /// Of one fold.
    pub total: [u32; 3],
}

impl Plan {
    /// None if there is no part, one has no grids, or a cell has no number of 32 bits.
    pub(super) fn starts(&self) -> Option<Starts> {
        if self.grids.len() != self.parts.len() || self.parts.is_empty() {
            return None;
        }
        let (mut parts, mut total) = (Vec::with_capacity(self.parts.len()), [0_u32; 3]);
        for grids in &self.grids {
            if grids.depths.iter().chain(&grids.fine).any(|d| *d > FINEST) {
                return None;
            }
            parts.push(total);
            for (sum, bits) in total.iter_mut().zip(grids.bits()) {
                *sum = sum.checked_add(1_u32.checked_shl(bits)?)?;
            }
        }
        // Both folds have them.
        total
            .iter()
            .all(|n| n.checked_mul(2).is_some())
            .then_some(Starts { parts, total })
    }
}
