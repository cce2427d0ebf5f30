//! How light that is scattered about the specular direction falls off: `ABg`, Harvey and Shack, Gaussian.

use etendue_math::special::{exp, ln};

/// f \[1/sr\] over |β − β₀|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A/(B + r^g).
    ABg {
        /// A \[1/sr\].
        a: f64,
        /// B > 0; any if g is 0.
        b: f64,
        /// g ≥ 0; 0 is a Lambertian surface.
        g: f64,
    },
    /// b₀ (1 + (r/L)²)^(S/2), of three parameters `[Harvey1976]`.
    HarveyShack {
        /// b₀ \[1/sr\].
        b0: f64,
        /// L > 0.
        l: f64,
        /// S ≤ 0.
        s: f64,
    },
    /// peak · exp(−r²/(2 σ²)).
    Gaussian {
        /// At the specular direction \[1/sr\].
        peak: f64,
        /// In direction cosines.
        sigma: f64,
    },
}

impl Profile {
    /// # Errors
    /// The parameter that is out of its range.
    pub(super) fn check(&self) -> Result<(), String> {
        let finite = |name: &str, value: f64, least: f64, above: bool| {
            if value.is_finite() && (value > least || (!above && value == least)) {
                Ok(())
            } else {
                let than = if above { "more than" } else { "at least" };
                Err(format!("{name} is {value}; it must be {than} {least}"))
            }
        };
        match *self {
            Self::ABg { a, b, g } => {
                finite("a", a, 0.0, false)?;
                finite("g", g, 0.0, false)?;
                finite("b", b, 0.0, g > 0.0)
            }
            Self::HarveyShack { b0, l, s } => {
                finite("b0", b0, 0.0, false)?;
                finite("l", l, 0.0, true)?;
                finite("-s", -s, 0.0, false)
            }
            Self::Gaussian { peak, sigma } => {
                finite("peak", peak, 0.0, false)?;
                finite("sigma", sigma, 0.0, true)
            }
        }
    }

    #[inline]
    pub(super) fn at(&self, r: f64) -> f64 {
        match *self {
            Self::ABg { a, b, g } => {
                if g == 0.0 {
                    a / (b + 1.0)
                } else if r <= 0.0 {
                    a / b
                } else if g == 2.0 {
                    a / (b + r * r)
                } else {
                    a / (b + exp(g * ln(r)))
                }
            }
            Self::HarveyShack { b0, l, s } => {
                let q = r / l;
                b0 * exp(0.5 * s * ln(1.0 + q * q))
            }
            Self::Gaussian { peak, sigma } => {
                let q = r / sigma;
                peak * exp(-0.5 * q * q)
            }
        }
    }

    /// The distance up to which ∫ f r dr is `wanted`, where that has a closed form.
    pub(super) fn distance(&self, wanted: f64) -> Option<f64> {
        match *self {
            Self::ABg { a, b, g: 2.0 } => {
                // a/2 ln(1 + r²/b).
                Some((b * (exp(2.0 * wanted / a) - 1.0)).max(0.0).sqrt())
            }
            Self::ABg { a, b, g: 0.0 } => Some((2.0 * wanted * (b + 1.0) / a).sqrt()),
            Self::ABg { .. } => None,
            Self::HarveyShack { b0, l, s } => {
                // b₀ L²/(S + 2) ((1 + q²)^(S/2 + 1) − 1), and its limit b₀ L²/2 ln(1 + q²).
                let (unit, power) = (wanted / (b0 * l * l), 0.5 * s + 1.0);
                let square = if power.abs() < 1e-6 {
                    exp(2.0 * unit)
                } else {
                    exp(ln((1.0 + 2.0 * power * unit).max(f64::MIN_POSITIVE)) / power)
                };
                Some(l * (square - 1.0).max(0.0).sqrt())
            }
            Self::Gaussian { peak, sigma } => {
                let left = 1.0 - wanted / (peak * sigma * sigma);
                Some(sigma * (-2.0 * ln(left.max(1e-14))).max(0.0).sqrt())
            }
        }
    }

    /// A distance at which it begins to fall.
    pub(super) fn width(&self) -> f64 {
        match *self {
            Self::ABg { b, g, .. } if g > 0.0 => exp(ln(b) / g),
            Self::ABg { .. } => 1.0,
            Self::HarveyShack { l, .. } => l,
            Self::Gaussian { sigma, .. } => sigma,
        }
    }
}
