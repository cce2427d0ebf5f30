//! What is known of the errors of a field beside those of its cells: within the cells, and of averages over pixels.

use super::factor::Factor;

/// Errors within cells, and how errors average out.
#[derive(Clone, Debug)]
pub struct FineErrors {
    /// Relative standard deviation of `B_s` against its mean over a cell.
    pub space: Factor,
    /// The same of `B_d`.
    pub direction: Factor,
    /// Of cells.
    pub cells: Averaging,
    /// Of `space`, in its own cells.
    pub within: Averaging,
}

impl FineErrors {
    /// Nothing but the errors of cells, which go together.
    #[must_use]
    pub fn none() -> Self {
        Self {
            space: Factor::constant(0.0),
            direction: Factor::constant(0.0),
            cells: Averaging::none(),
            within: Averaging::none(),
        }
    }
}

/// What is left of standard deviations where errors are averaged over squares of 1, 2, 4, … cells along either side.
#[derive(Clone, Debug)]
pub struct Averaging(Vec<f64>);

impl Averaging {
    /// From the shares that are left; None if there are none, or one that is not between 0 and 1.
    #[must_use]
    pub fn new(left: Vec<f64>) -> Option<Self> {
        let sound = !left.is_empty() && left.iter().all(|f| (0.0..=1.0).contains(f));
        sound.then_some(Self(left))
    }

    /// All of them.
    #[must_use]
    pub fn none() -> Self {
        Self(vec![1.0])
    }

    /// For an area of so many cells: linear in the logarithm of the side, and constant beyond both ends.
    #[must_use]
    pub fn left(&self, area: f64) -> f64 {
        if area.is_nan() || area <= 1.0 || self.0.len() == 1 {
            return self.0[0];
        }
        let doublings = 0.5 * area.log2();
        let last = self.0.len() - 1;
        if doublings >= last as f64 {
            return self.0[last];
        }
        let lower = doublings.floor();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below the length"
        )]
        let index = lower as usize;
        self.0[index] + (doublings - lower) * (self.0[index + 1] - self.0[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_interpolated_by_the_side() {
        let averaging = Averaging::new(vec![1.0, 0.8, 0.4]).expect("sound");
        for (area, left) in [
            (0.0, 1.0),
            (1.0, 1.0),
            (2.0, 0.9),
            (4.0, 0.8),
            (8.0, 0.6),
            (16.0, 0.4),
            (1e9, 0.4),
        ] {
            assert!((averaging.left(area) - left).abs() < 1e-12, "{area}");
        }
        assert!(averaging.left(f64::NAN) <= 1.0);
        for wrong in [vec![], vec![f64::NAN], vec![1.0, 1.5], vec![-0.1]] {
            assert!(Averaging::new(wrong).is_none());
        }
    }
}
