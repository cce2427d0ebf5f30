//! Intervals of real numbers: what a function can be at most and at least.

use std::ops::{Add, Mul, Sub};

/// The numbers from `lo` to `hi`. Every operation returns an interval that holds all results, rounding included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

/// Rounding outward: an operation of IEEE 754 is off by at most half a unit in the last place.
fn outward(lo: f64, hi: f64) -> Interval {
    Interval {
        lo: lo.next_down(),
        hi: hi.next_up(),
    }
}

impl Interval {
    /// From `lo` to `hi`.
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// A single number.
    #[must_use]
    pub const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// Whether 0 is one of the numbers.
    #[must_use]
    pub fn has_zero(self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0
    }

    /// The squares.
    #[must_use]
    pub fn squared(self) -> Self {
        let (a, b) = (self.lo.abs(), self.hi.abs());
        let least = if self.has_zero() { 0.0 } else { a.min(b) };
        let most = a.max(b);
        Self {
            lo: (least * least).next_down().max(0.0),
            hi: (most * most).next_up(),
        }
    }

    /// The square roots; what lies below 0 counts as 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let (lo, hi) = (self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt());
        Self {
            lo: lo.next_down().max(0.0),
            hi: hi.next_up(),
        }
    }

    /// The reciprocals of positive numbers; everything if 0 is among them.
    #[must_use]
    pub fn reciprocal(self) -> Self {
        if self.lo > 0.0 {
            outward(1.0 / self.hi, 1.0 / self.lo)
        } else {
            Self::new(f64::NEG_INFINITY, f64::INFINITY)
        }
    }

    /// The smallest interval that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self::new(self.lo.min(other.lo), self.hi.max(other.hi))
    }

    /// What both have in common; of two that miss each other, an interval without numbers.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self::new(self.lo.max(other.lo), self.hi.min(other.hi))
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        outward(self.lo + o.lo, self.hi + o.hi)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        outward(self.lo - o.hi, self.hi - o.lo)
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = [self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi];
        // 0 · ∞ is NaN, which min and max pass over; the other products bound the result.
        let lo = p.into_iter().fold(f64::INFINITY, f64::min);
        let hi = p.into_iter().fold(f64::NEG_INFINITY, f64::max);
        outward(lo, hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_hold_every_value() {
        let pairs = [(-2.0, 3.0), (0.5, 0.75), (-1.0, -0.25), (0.0, 0.1)];
        for (a, b) in pairs {
            for (c, d) in pairs {
                let (x, y) = (Interval::new(a, b), Interval::new(c, d));
                for i in 0..=8 {
                    for j in 0..=8 {
                        let u = a + (b - a) * f64::from(i) / 8.0;
                        let v = c + (d - c) * f64::from(j) / 8.0;
                        let holds = |z: Interval, w: f64| assert!(z.lo <= w && w <= z.hi, "{z:?} {w}");
                        holds(x + y, u + v);
                        holds(x - y, u - v);
                        holds(x * y, u * v);
                        holds(x.squared(), u * u);
                        holds(x.sqrt(), u.max(0.0).sqrt());
                        if a > 0.0 {
                            holds(x.reciprocal(), 1.0 / u);
                        }
                    }
                }
            }
        }
    }
}
