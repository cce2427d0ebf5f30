//! Sine and cosine of a fraction of a turn, and the angle of a slope.
//!
//! The C library's `sin` differs between platforms in the last bit, and does not vectorise. These polynomials use only
//! +, × and rounding, so that they give the same bits everywhere and the compiler can run them eight at a time.

/// 1.5 · 2⁵²: what lies between it and its neighbours are whole numbers.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// `(sin 2πu, cos 2πu)` for `u` in \[0, 1\], to within 3e-16 of the true value.
///
/// The turn is folded to a quarter `q` and a remainder `r` with |2πr| ≤ π/4, where the Taylor series of sine and cosine
/// (to x¹⁵ and x¹⁶; first term left out < 3e-17) hold to rounding.
#[inline(always)] // into loops that are compiled for several instruction sets
#[must_use]
pub fn sin_cos_turns(u: f64) -> (f64, f64) {
    // Rounds to a whole number as an addition does; `round` is a call where the instruction set has no such thing.
    let q = (4.0 * u + WHOLE) - WHOLE;
    let x = (u - 0.25 * q) * std::f64::consts::TAU;
    let x2 = x * x;
    let s = x * polynomial!(
        x2,
        [
            1.0,
            -1.0 / 6.0,
            1.0 / 120.0,
            -1.0 / 5_040.0,
            1.0 / 362_880.0,
            -1.0 / 39_916_800.0,
            1.0 / 6_227_020_800.0,
            -1.0 / 1_307_674_368_000.0
        ]
    );
    let c = polynomial!(
        x2,
        [
            1.0,
            -0.5,
            1.0 / 24.0,
            -1.0 / 720.0,
            1.0 / 40_320.0,
            -1.0 / 3_628_800.0,
            1.0 / 479_001_600.0,
            -1.0 / 87_178_291_200.0,
            1.0 / 20_922_789_888_000.0
        ]
    );
    // q is 0, 1, 2, 3 or 4 quarter turns; selecting by comparison keeps the loop free of branches.
    let odd = (q == 1.0) | (q == 3.0);
    let (a, b) = if odd { (c, s) } else { (s, c) };
    let sine = if (q == 2.0) | (q == 3.0) { -a } else { a };
    let cosine = if (q == 1.0) | (q == 2.0) { -b } else { b };
    (sine, cosine)
}

/// atan t in units of a quarter right angle (π/4), for −1 ≤ t ≤ 1; exact at −1, 0 and 1, else to 4e-16.
#[inline(always)]
#[must_use]
pub fn atan_eighths(t: f64) -> f64 {
    let angle = octant(t.abs(), 1.0);
    if t < 0.0 { -angle } else { angle }
}

/// The angle of a point that is not the origin from the first axis, as a fraction of a turn from 0 to 1, to 1e-16.
#[inline(always)]
#[must_use]
pub fn turns_of(x: f64, y: f64) -> f64 {
    // By comparisons and not by branches: nobody foresees where points lie.
    let [along, across] = [x.abs(), y.abs()];
    let steep = across > along;
    let angle = octant(along.min(across), along.max(across));
    let angle = if steep { 2.0 - angle } else { angle };
    let angle = if x < 0.0 { 4.0 - angle } else { angle };
    let angle = if y < 0.0 { 8.0 - angle } else { angle };
    let turn = 0.125 * angle;
    if turn >= 1.0 { 0.0 } else { turn }
}

/// atan low/high in units of a quarter right angle (π/4), for 0 ≤ low ≤ high.
///
/// Above tan π/8 by atan t = π/4 + atan((t − 1)/(t + 1)); an odd polynomial of degree 21 (3e-17), interpolated at
/// Chebyshev nodes in 50 digits.
#[inline(always)]
fn octant(low: f64, high: f64) -> f64 {
    const QUARTER: f64 = 4.0 / std::f64::consts::PI;
    let steep = low > 0.414_213_562_373_095_03 * high;
    let x = if steep { low - high } else { low } / if steep { low + high } else { high };
    let x2 = x * x;
    let series = polynomial!(
        x2,
        [
            1.0,
            -0.333_333_333_333_284_4,
            0.199_999_999_988_551_1,
            -0.142_857_141_809_764_67,
            0.111_111_061_804_559_46,
            -0.090_907_730_748_084_14,
            0.076_899_534_963_068_57,
            -0.066_402_339_304_294_08,
            0.056_883_492_268_090_106,
            -0.043_480_522_157_164_62,
            0.021_135_373_157_693_246
        ]
    );
    let small = QUARTER * (x * series);
    if steep { 1.0 + small } else { small }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_points_are_those_of_the_library() {
        for k in 0..4000 {
            let angle = f64::from(k) * std::f64::consts::TAU / 4000.0;
            let (x, y) = (1e-3 * angle.cos(), 1e-3 * angle.sin());
            let expected = (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0);
            let off = (turns_of(x, y) - expected).abs();
            assert!(off.min(1.0 - off) < 3e-16, "{k}: {off}");
            // Both sides of the first axis alike.
            assert!((turns_of(x, -y) + turns_of(x, y) - 1.0).abs() < 3e-16 || y == 0.0);
        }
        for (k, [x, y]) in [
            [1.0, 0.0],
            [2.0, 2.0],
            [0.0, 0.5],
            [-1.0, 1.0],
            [-1.0, 0.0],
            [-3.0, -3.0],
            [0.0, -1.0],
            [1.0, -1.0],
        ]
        .into_iter()
        .enumerate()
        {
            assert_eq!(turns_of(x, y), k as f64 / 8.0);
        }
    }

    #[test]
    fn agrees_with_the_c_library_over_the_whole_turn() {
        for i in 0..=100_000 {
            let u = f64::from(i) / 100_000.0;
            let (s, c) = sin_cos_turns(u);
            let (rs, rc) = (u * std::f64::consts::TAU).sin_cos();
            // The reference itself rounds 2πu: allow that half ulp of the angle (≤ 4.4e-16) and ours.
            assert!(
                (s - rs).abs() < 8e-16 && (c - rc).abs() < 8e-16,
                "u = {u}: {s} {rs} {c} {rc}"
            );
        }
    }

    #[test]
    fn is_exact_at_the_quarters() {
        for (u, expected) in [
            (0.0, (0.0, 1.0)),
            (0.25, (1.0, 0.0)),
            (0.5, (0.0, -1.0)),
            (0.75, (-1.0, 0.0)),
            (1.0, (0.0, 1.0)),
        ] {
            assert_eq!(sin_cos_turns(u), expected);
        }
    }

    #[test]
    fn the_angle_of_a_slope_agrees_with_the_c_library() {
        for i in -100_000..=100_000 {
            let t = f64::from(i) / 100_000.0;
            let expected = t.atan() / std::f64::consts::FRAC_PI_4;
            assert!((atan_eighths(t) - expected).abs() < 5e-16, "t = {t}");
        }
        assert_eq!([-1.0, 0.0, 1.0].map(atan_eighths), [-1.0, 0.0, 1.0]);
    }
}
