//! What the tree is fitted to.

use std::sync::atomic::AtomicBool;

use super::grid::Grid;

/// Factors of a base measure: the mass of each cell of a grid over the next axes, and how many axes these are.
pub type Masses<'a> = (usize, &'a [f64]);

/// Weighted points on the cells of a grid, and the measure they are compared with.
#[derive(Clone, Copy, Debug)]
pub struct Data<'a> {
    /// Σ w of each cell; without `squared` the number of points.
    pub weight: &'a [f64],
    /// Σ w² of each cell: it turns unequal weights into effective counts, box by box. None: all weights are one.
    pub squared: Option<&'a [f64]>,
    /// The factors of the base measure, which together take all axes; none of them: equal mass in all cells. Cells without base
    /// mass hold no mass and must hold no points.
    pub factors: &'a [Masses<'a>],
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

    /// Whether there is one weight per cell, and one mass per cell of each factor.
    #[must_use]
    pub fn fits(&self, grid: &Grid) -> bool {
        let mut rest = grid.depths();
        let fits = |(axes, mass): &Masses<'_>| {
            rest.split_at_checked(*axes).is_some_and(|(own, others)| {
                rest = others;
                mass.len() == 1 << own.iter().sum::<u32>()
            })
        };
        self.weight.len() == grid.cells()
            && self.squared.is_none_or(|s| s.len() == grid.cells())
            && (self.factors.is_empty() || (self.factors.iter().all(fits) && rest.is_empty()))
    }
}
