//! Exponential, logarithm, ln Γ and the integral of erfc from +, ×, / and bit moves only.
//!
//! The same bits on every platform, no branches, no calls: the compiler runs them several at a time. Coefficients are
//! interpolations at Chebyshev nodes, worked out in 50 digits; the relative errors stand beside them.

use std::f64::consts::{LN_2, LOG2_E};

/// High and low part of ln 2: the high part has 32 bits, so that multiples by an exponent are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// eˣ to 4e-16 relative for −708 ≤ x ≤ 709; below, 0.
///
/// x = k ln 2 + r with |r| ≤ ½ ln 2; eʳ by a polynomial of degree 11 (4e-18).
#[inline(always)]
#[must_use]
pub fn exp(x: f64) -> f64 {
    let clamped = x.clamp(-708.0, 709.0);
    let k = (clamped * LOG2_E).round();
    let r = (clamped - k * LN_2_HIGH) - k * LN_2_LOW;
    let series = polynomial!(
        r,
        [
            0.5,
            0.166_666_666_666_666_8,
            0.041_666_666_666_488_1,
            0.008_333_333_333_319_601,
            0.001_388_888_895_231_474_5,
            1.984_126_989_004_711_3e-4,
            2.480_148_548_233_249_2e-5,
            2.755_724_091_857_897_e-6,
            2.763_263_963_904_103e-7,
            2.511_003_760_596_377_7e-8
        ]
    );
    let power = 1.0 + (r + r * r * series);
    // 1.5·2⁵² + k holds k in its low bits; shifted to the exponent they multiply by 2ᵏ.
    let bits = (k + 6_755_399_441_055_744.0).to_bits() << 52;
    let scaled = f64::from_bits(power.to_bits().wrapping_add(bits));
    if x < -708.0 { 0.0 } else { scaled }
}

/// ln x to 3e-16 relative or 1e-16 absolute, for normal x > 0.
///
/// x = 2ᵏ m with √½ ≤ m < √2; ln m = 2 artanh((m − 1)/(m + 1)) by a polynomial in its square (1e-18).
#[inline(always)]
#[must_use]
pub fn ln(x: f64) -> f64 {
    // Adding the distance from √½ to 1 to the bits carries into the exponent exactly where m would reach √2.
    const ONE: u64 = 0x3FF0_0000_0000_0000;
    const SQRT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
    let shifted = x.to_bits().wrapping_add(ONE - SQRT_HALF);
    let m = f64::from_bits((shifted & 0x000F_FFFF_FFFF_FFFF) + SQRT_HALF);
    // The biased exponent as the low bits of 2⁵², an integer-to-float conversion that every instruction set has.
    let k = f64::from_bits((shifted >> 52) | 0x4330_0000_0000_0000) - (4_503_599_627_370_496.0 + 1023.0);
    let s = (m - 1.0) / (m + 1.0);
    let t = s * s;
    let series = polynomial!(
        t,
        [
            0.333_333_333_333_338_26,
            0.199_999_999_996_511_7,
            0.142_857_143_803_208_4,
            0.111_110_985_283_630_24,
            0.090_918_158_401_146_64,
            0.076_562_640_741_820_95,
            0.074_048_551_803_276_38
        ]
    );
    2.0 * s + (2.0 * s * t * series + k * LN_2)
}

/// ln Γ(x) for x > 0: absolute error below 1e-13 up to x = 100, relative error below 1e-15 beyond.
///
/// Stirling's series to y⁻¹³ for y ≥ 8; below, Γ(x) = Γ(x + 8)/(x (x + 1) … (x + 7)). DLMF 5.11.1.
#[inline(always)]
#[must_use]
pub fn ln_gamma(x: f64) -> f64 {
    let (y, below) = raised(x);
    stirling(y, 1.0 / y) - ln(below)
}

/// From here on Stirling's series does by itself.
pub const LARGE: f64 = 8.0;

/// [`ln_gamma`] of a number that is not below [`LARGE`], to the same bits in little more than half the time.
#[inline(always)]
#[must_use]
pub fn ln_gamma_of_large(x: f64) -> f64 {
    stirling(x, 1.0 / x)
}

/// ln Γ(a) + ln Γ(b) for positive numbers, not both of which are very small, in two thirds of the time. The errors are those of
/// [`ln_gamma`]. If none is `SMALL`, both are at least [`LARGE`]: the same bits sooner.
#[inline(always)]
#[must_use]
pub fn ln_gamma_of_both<const SMALL: bool>(a: f64, b: f64) -> f64 {
    let [(ya, below_a), (yb, below_b)] = if SMALL {
        [raised(a), raised(b)]
    } else {
        [(a, 1.0), (b, 1.0)]
    };
    let inverse = 1.0 / (ya * yb);
    let both = stirling(ya, yb * inverse) + stirling(yb, ya * inverse);
    if SMALL { both - ln(below_a * below_b) } else { both }
}

/// The number itself or eight more, and by how many times Γ grows to there.
#[inline(always)]
fn raised(x: f64) -> (f64, f64) {
    let small = x < LARGE;
    // (x)₈ = x (x + 7) · (x + 1)(x + 6) · …, each pair from the same product.
    let pair = x * (x + 7.0);
    let rising = pair * (pair + 6.0) * ((pair + 10.0) * (pair + 12.0));
    (if small { x + 8.0 } else { x }, if small { rising } else { 1.0 })
}

/// Stirling's series for ln Γ(y), y ≥ 8, told 1/y.
#[inline(always)]
fn stirling(y: f64, z: f64) -> f64 {
    const HALF_LN_TAU: f64 = 0.918_938_533_204_672_8;
    let z2 = z * z;
    let series = z * polynomial!(
        z2,
        [
            1.0 / 12.0,
            -1.0 / 360.0,
            1.0 / 1_260.0,
            -1.0 / 1_680.0,
            1.0 / 1_188.0,
            -691.0 / 360_360.0,
            1.0 / 156.0
        ]
    );
    (y - 0.5) * ln(y) - y + HALF_LN_TAU + series
}

/// ∫ erfc from x ≥ 0 on: ierfc(x) = e^(−x²)/√π − x erfc(x), to 1e-14 relative where x² is below 30, and absolute beyond.
/// DLMF 7.18.2.
///
/// e^(−x²)/√π over 1 + 2x² is its limit for large x; what it is multiplied by is a polynomial in (x − 5/2)/(x + 5/2) of degree 24
/// (2e-15).
#[inline(always)]
#[must_use]
pub fn ierfc(x: f64) -> f64 {
    let y = 1.0 - 5.0 / (x + 2.5);
    let factor = polynomial!(
        y,
        [
            0.889_496_377_574_711_1,
            0.310_833_222_571_701,
            -0.265_251_681_702_149_4,
            -0.057_568_009_459_022_03,
            0.294_323_026_069_542_25,
            -0.262_768_026_173_147,
            0.097_741_492_996_561_07,
            0.008_568_780_827_534_869,
            -0.019_344_106_319_074_58,
            0.001_174_634_114_802_097_4,
            0.003_678_968_311_033_283_7,
            -2.337_737_788_261_498_7e-4,
            -7.881_156_197_743_264e-4,
            -3.420_374_467_563_125e-5,
            1.726_797_820_285_696_3e-4,
            4.122_714_759_180_235e-5,
            -3.213_893_907_388_405e-5,
            -1.839_721_375_503_452_7e-5,
            3.120_217_618_992_746_3e-6,
            5.532_247_458_786_54e-6,
            6.778_631_238_701_292e-7,
            -1.095_204_027_181_771_6e-6,
            -3.516_845_774_819_2e-7,
            1.086_643_652_947_482_6e-7,
            5.145_003_154_390_034_4e-8
        ]
    );
    let square = x * x;
    FRAC_1_SQRT_PI * exp(-square) * (factor / (1.0 + 2.0 * square))
}

/// 1/√π.
const FRAC_1_SQRT_PI: f64 = 0.564_189_583_547_756_3;

/// The cube root of a positive number, to 2·10⁻¹⁴ of it, with the same bits on every platform: Halley's method from a third of
/// the exponent, in a third of the time of a root that is exact to the last bit.
#[inline]
#[must_use]
pub fn cube_root(x: f64) -> f64 {
    /// Two thirds of the exponent's bias, and what makes the largest error least.
    const START: u64 = 0x2a9f_7893_0000_0000;
    let mut y = f64::from_bits(x.to_bits() / 3 + START);
    for _ in 0..2 {
        let cube = y * y * y;
        y *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_agrees_with_the_library() {
        for i in -70_790..=70_890 {
            let x = f64::from(i) * 0.01 + 0.001_234;
            assert!((exp(x) / x.exp() - 1.0).abs() < 6e-16, "{x}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(-800.0), 0.0);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
    }

    #[test]
    fn ln_agrees_with_the_library() {
        for i in 1..200_000 {
            let x = (f64::from(i) * 0.003_7 - 300.0).exp();
            let expected = x.ln();
            assert!((ln(x) - expected).abs() <= 4e-16 * expected.abs().max(0.5), "{x}");
        }
        assert_eq!(ln(1.0), 0.0);
        assert_eq!(ln(2.0), LN_2);
    }

    #[test]
    fn ln_gamma_knows_factorials_halves_and_its_recurrence() {
        let mut factorial = 1.0_f64;
        for n in 1..=20 {
            assert!((ln_gamma(f64::from(n)) - factorial.ln()).abs() < 1e-13, "{n}");
            factorial *= f64::from(n);
        }
        assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-14);
        for i in 1..4000 {
            let x = (f64::from(i) * 0.01 - 15.0).exp();
            let (a, b) = (ln_gamma(x + 1.0), ln_gamma(x) + x.ln());
            assert!((a - b).abs() < 1e-13 + 2e-15 * a.abs(), "{x}: {a} {b}");
        }
    }

    #[test]
    fn ln_gamma_of_large_numbers_and_of_two() {
        for i in 0..4000 {
            let x = LARGE + (f64::from(i) * 0.01 - 5.0).exp();
            assert_eq!(ln_gamma_of_large(x).to_bits(), ln_gamma(x).to_bits());
            let [large, less] = [LARGE + 3.0 * x, (f64::from(i) * -0.02).exp()];
            let (both, again) = (ln_gamma_of_both::<true>(x, large), ln_gamma_of_both::<false>(x, large));
            assert_eq!(both.to_bits(), again.to_bits());
            for other in [large, less] {
                let sum = ln_gamma(x) + ln_gamma(other);
                for both in [ln_gamma_of_both::<true>(x, other), ln_gamma_of_both::<true>(other, x)] {
                    assert!((both - sum).abs() < 2e-13 + 4e-15 * sum.abs(), "{x} {other}");
                }
            }
        }
    }

    #[test]
    fn ierfc_is_the_integral_of_erfc() {
        // In 50 digits, and by the definition where that subtracts little.
        for (x, known) in [
            (0.0, 0.564_189_583_547_756_3),
            (0.5, 0.199_641_228_374_245_67),
            (1.0, 0.050_254_541_660_012_22),
            (2.0, 9.780_227_149_514_952e-4),
            (3.5, 9.886_908_549_744_665e-8),
            (5.0, 1.481_342_933_684_934e-13),
        ] {
            assert!((ierfc(x) / known - 1.0).abs() < 1e-14, "{x}: {} {known}", ierfc(x));
        }
        for i in 0..1000 {
            let x = f64::from(i) * 1e-3;
            let by_definition = (-x * x).exp() / std::f64::consts::PI.sqrt() - x * libm::erfc(x);
            assert!((ierfc(x) - by_definition).abs() < 5e-16, "{x}");
        }
        assert_eq!(ierfc(f64::INFINITY), 0.0);
    }

    #[test]
    fn cube_roots() {
        for k in 0..60_000 {
            let x = 10_f64.powf(f64::from(k) / 2000.0 - 15.0);
            assert!((cube_root(x) / x.cbrt() - 1.0).abs() < 2e-14, "{x}");
        }
    }
}
