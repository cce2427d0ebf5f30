//! All zeros of a smooth function on an interval, with certainty: interval bisection and Newton's method.
//!
//! Moore, Kearfott, Cloud, "Introduction to Interval Analysis" (2009), chapter 8, `[Moore2009]`.

use etendue_math::Interval;

/// Halvings before an interval is given up: more than a double has binary digits.
const DEPTH: u32 = 60;

/// A function of one variable that can be bounded.
pub trait Bounded {
    /// Value and slope at t.
    fn at(&self, t: f64) -> [f64; 2];
    /// Bounds of value and slope over an interval.
    fn over(&self, t: Interval) -> [Interval; 2];
}

/// Calls `visit` for each zero of `f` from `lo` to `hi` at which it changes its sign, from the lowest to the highest.
///
/// `known`: t = `lo` is a zero that is not wanted. Zeros at which the function turns without changing its sign (a line that
/// touches a surface) are none.
pub fn zeros(f: &impl Bounded, lo: f64, hi: f64, known: bool, visit: &mut impl FnMut(f64)) {
    if lo < hi {
        search(f, Interval::new(lo, hi), known, DEPTH, visit);
    }
}

fn search(f: &impl Bounded, range: Interval, known: bool, depth: u32, visit: &mut impl FnMut(f64)) {
    let [value, slope] = f.over(range);
    let middle = 0.5 * (range.lo + range.hi);
    if !slope.has_zero() {
        // The function is monotonic here: one zero at most, and none besides a known one.
        if !known {
            bisect(f, range, visit);
        }
        return;
    }
    // The mean value form is the tighter the shorter the range.
    let centred = Interval::point(f.at(middle)[0]) + slope * Interval::new(range.lo - middle, range.hi - middle);
    let found = value.intersection(centred);
    if !known && !found.has_zero() {
        return;
    }
    if depth == 0 || middle <= range.lo || middle >= range.hi {
        return;
    }
    search(f, Interval::new(range.lo, middle), known, depth - 1, visit);
    search(f, Interval::new(middle, range.hi), false, depth - 1, visit);
}

/// The zero of a monotonic function, if it changes its sign: Newton's method, with bisection where it leaves the bracket.
fn bisect(f: &impl Bounded, range: Interval, visit: &mut impl FnMut(f64)) {
    let (mut lo, mut hi) = (range.lo, range.hi);
    let (below, above) = (f.at(lo)[0], f.at(hi)[0]);
    // A zero at an end belongs to the range that begins there.
    if (below > 0.0) == (above > 0.0) || above == 0.0 && below < 0.0 {
        return;
    }
    let rising = above > below;
    let mut t = 0.5 * (lo + hi);
    for _ in 0..2 * DEPTH {
        let [value, slope] = f.at(t);
        if value == 0.0 {
            break;
        }
        if (value > 0.0) == rising {
            hi = t;
        } else {
            lo = t;
        }
        let newton = t - value / slope;
        let next = if newton > lo && newton < hi {
            newton
        } else {
            0.5 * (lo + hi)
        };
        if next == t {
            break;
        }
        t = next;
    }
    visit(t);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Π (t − rᵢ), expanded.
    struct Polynomial(Vec<f64>);

    impl Polynomial {
        fn with_zeros(zeros: &[f64]) -> Self {
            let mut c = vec![1.0];
            for r in zeros {
                let mut next = vec![0.0; c.len() + 1];
                for (i, a) in c.iter().enumerate() {
                    next[i] -= a * r;
                    next[i + 1] += a;
                }
                c = next;
            }
            Self(c)
        }
    }

    impl Bounded for Polynomial {
        fn at(&self, t: f64) -> [f64; 2] {
            let (mut value, mut slope) = (0.0, 0.0);
            for c in self.0.iter().rev() {
                slope = slope * t + value;
                value = value * t + c;
            }
            [value, slope]
        }
        fn over(&self, t: Interval) -> [Interval; 2] {
            let (mut value, mut slope) = (Interval::point(0.0), Interval::point(0.0));
            for c in self.0.iter().rev() {
                slope = slope * t + value;
                value = value * t + Interval::point(*c);
            }
            [value, slope]
        }
    }

    #[test]
    fn every_zero_is_found_once_and_touching_is_none() {
        let f = Polynomial::with_zeros(&[-0.7, 0.2, 0.2 + 1e-6, 0.9, 3.0]);
        let mut found = Vec::new();
        zeros(&f, -1.0, 2.0, false, &mut |t| found.push(t));
        assert_eq!(found.len(), 4, "{found:?}");
        for (t, r) in found.iter().zip([-0.7, 0.2, 0.2 + 1e-6, 0.9]) {
            assert!((t - r).abs() < 1e-9);
        }
        let touching = Polynomial::with_zeros(&[0.5, 0.5]);
        // By rounding the function may change its sign there and back.
        let mut found = Vec::new();
        zeros(&touching, 0.0, 1.0, false, &mut |t| found.push(t));
        assert!(found.len() % 2 == 0 && found.iter().all(|t| (t - 0.5).abs() < 1e-7));
    }

    #[test]
    fn a_known_zero_at_the_start_is_left_out_and_the_next_one_is_not() {
        for gap in [1.0, 1e-3, 1e-6, 1e-9] {
            let f = Polynomial::with_zeros(&[0.0, gap]);
            let mut found = Vec::new();
            zeros(&f, 0.0, 2.0, true, &mut |t| found.push(t));
            assert_eq!(found.len(), 1, "{gap} {found:?}");
            assert!((found[0] / gap - 1.0).abs() < 1e-12);
        }
    }
}
