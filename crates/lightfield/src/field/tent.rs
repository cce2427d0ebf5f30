//! Tents: the hat functions of linear interpolation between cell centres.

/// The two cells between whose centres a coordinate lies, and the weight of the second.
#[derive(Clone, Copy, Debug)]
pub struct Tent {
    /// Lower and upper cell.
    pub cells: [usize; 2],
    /// Weights of the two: they add up to one.
    pub weights: [f64; 2],
}

impl Tent {
    /// The tents over `x` in \[0, 1\] on an axis of `n` cells.
    ///
    /// Before the first centre and after the last the value stays that of the cell, or, if the axis `wraps`, runs over to
    /// the cell at the other end. Either way the tent of every cell has the area of one cell.
    #[inline(always)]
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to n by construction"
    )]
    pub fn at(x: f64, n: usize, wraps: bool) -> Self {
        let t = x * n as f64 + 0.5; // in cells, from half a cell before the first centre
        // Cut off, not `floor`: that is a call where the processor is not known to round.
        let upper = t as usize; // 0 ..= n: the cell after the interval
        let upper_weight = t - upper as f64;
        let cells = if wraps {
            [
                if upper == 0 { n - 1 } else { upper - 1 },
                if upper >= n { 0 } else { upper },
            ]
        } else {
            [upper.saturating_sub(1).min(n - 1), upper.min(n - 1)]
        };
        Self {
            cells,
            weights: [1.0 - upper_weight, upper_weight],
        }
    }
}

/// A point under the tent of cell `cell`, from a uniform number: density n · tent.
#[inline]
#[must_use]
pub fn under_tent(cell: usize, u: f64, n: usize, wraps: bool) -> f64 {
    let offset = if u < 0.5 {
        (2.0 * u).sqrt() - 1.0
    } else {
        1.0 - (2.0 - 2.0 * u).sqrt()
    };
    inside((cell as f64 + 0.5 + offset) / n as f64, wraps)
}

/// Brings a coordinate back that has left \[0, 1\] by less than one: on the other side, or reflected.
#[inline]
#[must_use]
pub fn inside(x: f64, wraps: bool) -> f64 {
    match (wraps, x) {
        (true, x) if x < 0.0 => x + 1.0,
        (true, x) if x > 1.0 => x - 1.0,
        (false, x) if x < 0.0 => -x,
        (false, x) if x > 1.0 => 2.0 - x,
        _ => x,
    }
}

/// The cell of a coordinate from 0 to 1, both included, on an axis of `n` cells.
#[inline(always)]
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to n")]
pub fn cell_of(x: f64, n: usize) -> usize {
    ((x * n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tents_add_up_to_one_and_each_has_the_area_of_a_cell() {
        for (n, wraps) in [(1, false), (2, true), (8, false), (8, true)] {
            let mut area = vec![0.0; n];
            let steps = 8000;
            for i in 0..steps {
                let tent = Tent::at((f64::from(i) + 0.5) / f64::from(steps), n, wraps);
                for (cell, weight) in tent.cells.iter().zip(tent.weights) {
                    assert!((0.0..=1.0).contains(&weight));
                    area[*cell] += weight * n as f64 / f64::from(steps);
                }
            }
            assert!(area.iter().all(|a| (a - 1.0).abs() < 1e-9), "{n} {area:?}");
        }
        assert_eq!(Tent::at(1.0, 4, false).cells, [3, 3]);
        assert_eq!(Tent::at(0.0, 4, true).cells, [3, 0]);
    }

    #[test]
    fn points_under_a_tent_have_its_distribution() {
        // The share of quantiles below each bin edge is the integral of the tent up to it.
        for (n, wraps) in [(4, false), (4, true)] {
            for cell in 0..n {
                let steps = 40_000;
                let mut bins = vec![0.0; 16];
                let mut expected = vec![0.0; 16];
                for i in 0..steps {
                    let u = (f64::from(i) + 0.5) / f64::from(steps);
                    let x = under_tent(cell, u, n, wraps);
                    bins[cell_of(x, 16)] += 1.0 / f64::from(steps);
                    let tent = Tent::at(u, n, wraps);
                    for (c, w) in tent.cells.iter().zip(tent.weights) {
                        if *c == cell {
                            expected[cell_of(u, 16)] += w * n as f64 / f64::from(steps);
                        }
                    }
                }
                for (a, b) in bins.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-3, "{n} {wraps} {cell} {bins:?} {expected:?}");
                }
            }
        }
    }
}
