//! What the tree is fitted to.

use std::sync::atomic::AtomicBool;

use super::base::Base;
use super::grid::Grid;

/// Boxes in one unit of work: a power of two whose scratch arrays fit the first caches.
pub(super) const CHUNK: usize = 256;

/// Weighted points on the cells of a grid, and the measure they are compared with.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    /// Σ w of each cell; without `squared` the number of points.
    pub weight: &'a [f64],
    /// Σ w² of each cell: it turns unequal weights into effective counts, box by box. None: all weights are one.
    pub squared: Option<&'a [f64]>,
    /// The base measure. Cells without base mass hold no mass and must hold no points.
    pub base: &'a Base,
    /// Set by somebody else: then the rest is left out, and the result means nothing.
    pub stop: Option<&'a AtomicBool>,
}

impl Data<'_> {
    /// The same data in the form that costs least: weights whose squares are themselves are counts.
    pub(super) fn simplified(&self) -> Self {
        let counts = self.squared.is_some_and(|squared| squared == self.weight);
        Self {
            squared: if counts { None } else { self.squared },
            ..*self
        }
    }

    /// Whether halves of any box are equal under the base measure and points are counted: then ln Γ is needed per box and
    /// not per split.
    pub(super) fn has_equal_halves(&self) -> bool {
        self.squared.is_none() && self.base.is_uniform()
    }

    pub(super) fn fits(&self, grid: &Grid) -> bool {
        self.weight.len() == grid.cells() && self.squared.is_none_or(|s| s.len() == grid.cells())
    }
}
