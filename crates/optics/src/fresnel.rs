//! Reflection and refraction at a smooth interface of two transparent media, and at a metal.

use etendue_math::Vec3;

/// What becomes of unpolarised light at an interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fresnel {
    /// Reflected share of the flux, 1 beyond the critical angle.
    pub reflectance: f64,
    /// Cosine of the angle of refraction, 0 beyond the critical angle.
    pub cosine: f64,
}

/// Fresnel's equations for unpolarised light that arrives in a medium of index `n1` at an angle with this `cosine` on the
/// interface to a medium of index `n2`. `[BornWolf1999]`, section 1.5.2.
#[inline(always)]
#[must_use]
pub fn fresnel(cosine: f64, n1: f64, n2: f64) -> Fresnel {
    let ratio = n1 / n2;
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    let across = (if square > 0.0 { square } else { 0.0 }).sqrt();
    let s = (n1 * cosine - n2 * across) / (n1 * cosine + n2 * across);
    let p = (n1 * across - n2 * cosine) / (n1 * across + n2 * cosine);
    // Beyond the critical angle the quotients are ±1, but for 0/0 at grazing incidence.
    let total = square <= 0.0;
    Fresnel {
        reflectance: if total { 1.0 } else { 0.5 * (s * s + p * p) },
        cosine: across,
    }
}

/// Fresnel's reflectance of a metal for unpolarised light that arrives at an angle with this `cosine`, its n and k being those
/// against the medium in which the light arrives. `[BornWolf1999]`, section 14.2.
#[must_use]
pub fn fresnel_of_metal(cosine: f64, n: f64, k: f64) -> f64 {
    if cosine <= 0.0 {
        return 1.0;
    }
    let square = 1.0 - cosine * cosine;
    // a + ib = √((n + ik)² − sin²θ)
    let (real, size) = (n * n - k * k - square, (n * n - k * k - square).hypot(2.0 * n * k));
    let a = (0.5 * (size + real)).max(0.0).sqrt();
    let across = |c: f64| {
        let (sum, mixed) = (size + c * c, 2.0 * a * c);
        (sum - mixed) / (sum + mixed)
    };
    let s = across(cosine);
    let p = s * across(square / cosine);
    0.5 * (s + p)
}

/// The direction after reflection. `normal` faces the light: d·n = −`cosine`.
#[inline(always)]
#[must_use]
pub fn reflect(d: Vec3, normal: Vec3, cosine: f64) -> Vec3 {
    renormalized(d + normal * (2.0 * cosine))
}

/// The direction after refraction by Snell's law, `across` being the cosine of the angle of refraction.
#[inline(always)]
#[must_use]
pub fn refract(d: Vec3, normal: Vec3, cosine: f64, ratio: f64, across: f64) -> Vec3 {
    renormalized(d * ratio + normal * (ratio * cosine - across))
}

/// One step of Newton's method towards length 1: exact to rounding for a vector whose length is 1 but for rounding, and
/// without it a long chain of reflections would drift.
#[inline(always)]
fn renormalized(d: Vec3) -> Vec3 {
    d * (1.5 - 0.5 * d.dot(d))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metal_by_the_complex_amplitudes() {
        // r_s = (cos − w)/(cos + w), r_p = (m² cos − w)/(m² cos + w), w² = m² − sin², m = n + ik, with complex numbers by hand.
        let divided = |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a * a + b * b) / (c * c + d * d);
        for (n, k) in [(0.96, 6.69), (1.2, 2.0), (0.05, 3.0), (1.5, 0.0), (3.0, 1e-9)] {
            for cosine in [1.0_f64, 0.7, 0.2, 1e-3] {
                let m2 = [n * n - k * k, 2.0 * n * k];
                let under = [m2[0] - 1.0 + cosine * cosine, m2[1]];
                let (size, half) = (under[0].hypot(under[1]).sqrt(), 0.5 * under[1].atan2(under[0]));
                let w = [size * half.cos(), size * half.sin()];
                let s = divided([cosine - w[0], -w[1]], [cosine + w[0], w[1]]);
                let c = m2.map(|x| x * cosine);
                let p = divided([c[0] - w[0], c[1] - w[1]], [c[0] + w[0], c[1] + w[1]]);
                let found = fresnel_of_metal(cosine, n, k);
                assert!((found - 0.5 * (s + p)).abs() < 1e-12, "{n} {k} {cosine}: {found}");
            }
        }
        assert!((fresnel_of_metal(0.6, 1.5, 0.0) - fresnel(0.6, 1.0, 1.5).reflectance).abs() < 1e-14);
        assert!((fresnel_of_metal(0.0, 1.2, 2.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn known_values_and_symmetry() {
        // Normal incidence on glass of 1.5: 4 %. Brewster's angle: the s part alone, ½ ((n² − 1)/(n² + 1))².
        assert!((fresnel(1.0, 1.0, 1.5).reflectance - 0.04).abs() < 1e-15);
        let brewster = (1.5_f64).atan().cos();
        assert!((fresnel(brewster, 1.0, 1.5).reflectance - 0.5 * (1.25_f64 / 3.25).powi(2)).abs() < 1e-15);
        assert_eq!(fresnel(0.5, 1.5, 1.0).reflectance, 1.0);
        assert!((fresnel(1e-9, 1.0, 1.5).reflectance - 1.0).abs() < 1e-7);
        for i in 1..100 {
            // Light that comes back along the refracted ray is reflected by the same share.
            let cosine = f64::from(i) / 100.0;
            let there = fresnel(cosine, 1.0, 1.7);
            let back = fresnel(there.cosine, 1.7, 1.0);
            assert!((there.reflectance - back.reflectance).abs() < 1e-13);
            assert!((back.cosine - cosine).abs() < 1e-13);
        }
    }

    #[test]
    fn directions_obey_the_laws_of_reflection_and_refraction() {
        let n = Vec3::new(0.36, 0.48, 0.8);
        for i in 1..200 {
            let f = |g: f64| (0.5 + f64::from(i) * g).fract() - 0.5;
            let d = Vec3::new(f(0.754_877), f(0.569_840), f(0.618_034)).normalized();
            let normal = if d.dot(n) < 0.0 { n } else { -n };
            let cosine = -d.dot(normal);
            let r = reflect(d, normal, cosine);
            assert!((r.dot(normal) - cosine).abs() < 1e-15 && (r.length() - 1.0).abs() < 1e-15);
            assert!((r.cross(normal) - d.cross(normal)).length() < 1e-15);
            let f = fresnel(cosine, 1.0, 1.5);
            let t = refract(d, normal, cosine, 1.0 / 1.5, f.cosine);
            // n₁ sin θ₁ = n₂ sin θ₂, in one plane with the normal.
            assert!((t.cross(normal) * 1.5 - d.cross(normal)).length() < 1e-15 && (t.length() - 1.0).abs() < 1e-15);
        }
    }
}
