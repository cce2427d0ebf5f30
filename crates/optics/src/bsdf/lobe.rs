//! Lobes about the specular direction that depend on the distance |β − β₀| in direction cosines alone: `ABg`, Harvey and
//! Shack, Gaussian.
//!
//! Part of such a lobe would leave the unit circle of direction cosines, where there are no directions: more of it, the more
//! the light grazes. Either it is absorbed, or f is scaled so that the share is that at normal incidence.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::more_numbers::MoreNumbers;

use super::albedo::Albedo;
use super::contract::{Bsdf, Facts, Media, Parameters, by_cosine};
use super::gauss::{gauss, integral};
use super::profile::Profile;
use super::shares::Shares;

/// A lobe about the mirrored or the straight direction, from both sides alike.
#[derive(Clone, Debug)]
pub struct Lobe {
    profile: Profile,
    /// How much wider it is across the axis than along it.
    aspect: f64,
    transmitted: bool,
    /// Whether f is scaled so that the share is that at normal incidence.
    renormalised: bool,
    /// Distances from β₀, and ∫ f r dr from 0 to each.
    radial: Vec<f64>,
    cumulative: Vec<f64>,
    /// Sines of incidence and the share of the flux there, f being as it is; linear in between.
    sines: Vec<f64>,
    shares: Vec<f64>,
    /// The shares of a lobe that is not round.
    turning: Option<Albedo<1>>,
    facts: Facts,
}

/// Farthest |β − β₀|.
const END: f64 = 2.0;

/// The most that a lobe is wider across the axis than along it, and the least.
const ASPECT: f64 = 1e3;

/// What interpolated shares may be off.
const TOLERANCE: f64 = 2e-7;

/// The smallest step of the sine of incidence for which shares are tabled.
const SMALLEST_STEP: f64 = 1e-6;

impl Lobe {
    /// # Errors
    /// If a parameter is out of its range, or more light leaves than arrives.
    pub fn new(profile: Profile, transmitted: bool, renormalised: bool) -> Result<Self, String> {
        Self::elliptical(profile, 1.0, transmitted, renormalised)
    }

    /// That is `aspect` times as wide across the axis as along it: |β − β₀| is taken with its part across divided by it.
    ///
    /// # Errors
    /// As [`Lobe::new`].
    pub fn elliptical(profile: Profile, aspect: f64, transmitted: bool, renormalised: bool) -> Result<Self, String> {
        profile.check()?;
        if !(1.0 / ASPECT..=ASPECT).contains(&aspect) {
            return Err(format!(
                "aspect is {aspect}; it must be from {} to {ASPECT}",
                1.0 / ASPECT
            ));
        }
        let end = END * f64::max(1.0, aspect.recip());
        let first = (1e-3 * profile.width()).clamp(1e-12, 1e-2);
        let mut radial = vec![0.0];
        let mut r = first;
        while r < end {
            radial.push(r);
            r *= 1.2;
        }
        radial.push(end);
        let mut cumulative = vec![0.0];
        for pair in radial.windows(2) {
            let more = gauss(pair[0], pair[1], |r| profile.at(r) * r);
            cumulative.push(cumulative[cumulative.len() - 1] + more);
        }
        let mut lobe = Self {
            profile,
            aspect,
            transmitted,
            renormalised,
            radial,
            cumulative,
            sines: Vec::new(),
            shares: Vec::new(),
            turning: None,
            facts: Facts {
                specular: [false; 2],
                diffuse: [!transmitted, transmitted],
                lambertian: false,
                // Luminance over n² is what both sides would have to share.
                reciprocal: !renormalised && !transmitted,
                constant: None,
                fresnel: false,
            },
        };
        let most = if aspect == 1.0 {
            lobe.fill();
            lobe.shares.iter().copied().fold(0.0, f64::max)
        } else {
            let table = Albedo::new(true, |d| [lobe.exact_of(d)]);
            let most = -table.least(|share| -share[0]);
            lobe.turning = Some(table);
            most
        };
        if most > 1.0 + 1e-6 {
            return Err(format!(
                "{most:.6} of the light is scattered at some angle, more than arrives"
            ));
        }
        lobe.facts.diffuse = if most > 0.0 { lobe.facts.diffuse } else { [false; 2] };
        Ok(lobe)
    }

    /// From named parameters: those of the profile, `transmitted` and `renormalised` (0 or 1).
    ///
    /// # Errors
    /// As [`Lobe::new`].
    pub fn described(kind: &str, by: &dyn Parameters) -> Result<Arc<dyn Bsdf>, String> {
        let profile = match kind {
            "abg" => Profile::ABg {
                a: by.number("a")?,
                b: by.number("b")?,
                g: by.number("g")?,
            },
            "harvey-shack" => Profile::HarveyShack {
                b0: by.number("b0")?,
                l: by.number("l")?,
                s: by.number("s")?,
            },
            _ => Profile::Gaussian {
                peak: by.number("peak")?,
                sigma: by.number("sigma")?,
            },
        };
        let flag = |key: &str| by.number(key).map(|value| value != 0.0);
        Ok(Arc::new(Self::elliptical(
            profile,
            by.number("aspect")?,
            flag("transmitted")?,
            flag("renormalised")?,
        )?))
    }

    /// ∫ f r dr from 0 to `r`.
    fn up_to(&self, r: f64) -> f64 {
        let i = self.radial.partition_point(|x| *x <= r).max(1) - 1;
        self.cumulative[i] + gauss(self.radial[i], r, |r| self.profile.at(r) * r)
    }

    /// The distance up to which ∫ f r dr is this.
    fn distance(&self, wanted: f64) -> f64 {
        if let Some(r) = self.profile.distance(wanted) {
            return r;
        }
        let last = self.radial.len() - 2;
        let i = (self.cumulative.partition_point(|sum| *sum <= wanted).max(1) - 1).min(last);
        let (start, mut low, mut high) = (self.radial[i], self.radial[i], self.radial[i + 1]);
        let mut r = 0.5 * (low + high);
        for _ in 0..60 {
            let off = self.cumulative[i] + gauss(start, r, |r| self.profile.at(r) * r) - wanted;
            if off > 0.0 {
                high = r;
            } else {
                low = r;
            }
            let next = r - off / (self.profile.at(r) * r);
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - r).abs() <= 1e-13 * next {
                return next;
            }
            r = next;
        }
        r
    }

    /// The share of the flux at a sine of incidence by quadrature, f being as it is.
    ///
    /// Of the circle of radius r about β₀ the part from the azimuth where it meets the unit circle lies within.
    fn exact(&self, sine: f64) -> f64 {
        let near = 1.0 - sine;
        let mut sum = TAU * self.up_to(near.min(END));
        if sine > 0.0 {
            // With r = 1 − sine cos t the root at both ends is a smooth function of t.
            let of = |t: f64| {
                let r = near + sine * 2.0 * (0.5 * t).sin().powi(2);
                let cosine = ((r * r + sine * sine - 1.0) / (2.0 * r * sine)).clamp(-1.0, 1.0);
                if r > 0.0 {
                    2.0 * cosine.acos() * self.profile.at(r) * r * sine * t.sin()
                } else {
                    0.0
                }
            };
            // Parts that get the finer the nearer they are to the specular direction.
            let mut to = PI;
            for _ in 0..40 {
                let from = 0.5 * to;
                sum += integral(from, to, gauss(from, to, of), 12, &of);
                to = from;
            }
            sum += gauss(0.0, to, of);
        }
        sum
    }

    /// The share of the flux at a direction of incidence by quadrature, f being as it is, of any lobe: in polar coordinates in
    /// which it is round, to where each line from β₀ meets the unit circle.
    fn exact_of(&self, incident: Vec3) -> f64 {
        let (x0, y0) = (-incident.x, -incident.y);
        let outside = (incident.z * incident.z).max(0.0);
        let of = |t: f64| {
            let (s, c) = t.sin_cos();
            let (x, y) = (c, self.aspect * s);
            // |β₀ + r (x, y)| = 1, from inside.
            let (a, b) = (x * x + y * y, x * x0 + y * y0);
            let root = (b * b + a * outside).sqrt();
            let r = if b > 0.0 { outside / (b + root) } else { (root - b) / a };
            self.up_to(r.min(self.radial[self.radial.len() - 1]))
        };
        let parts = 16;
        let each = (0..parts).map(|k| {
            let (from, to) = (
                TAU * f64::from(k) / f64::from(parts),
                TAU * f64::from(k + 1) / f64::from(parts),
            );
            integral(from, to, gauss(from, to, of), 12, &of)
        });
        each.sum::<f64>() * self.aspect
    }

    fn fill(&mut self) {
        let at = |lobe: &Self, sine: f64| (sine, lobe.exact(sine));
        let mut last = at(self, 0.0);
        let (mut sines, mut shares) = (vec![last.0], vec![last.1]);
        let mut left: Vec<(f64, f64)> = (1..=16).rev().map(|i| at(self, f64::from(i) / 16.0)).collect();
        while let Some(next) = left.pop() {
            let middle = at(self, 0.5 * (last.0 + next.0));
            if (middle.1 - 0.5 * (last.1 + next.1)).abs() <= TOLERANCE || next.0 - last.0 < SMALLEST_STEP {
                sines.extend([middle.0, next.0]);
                shares.extend([middle.1, next.1]);
                last = next;
            } else {
                left.push(next);
                left.push(middle);
            }
        }
        (self.sines, self.shares) = (sines, shares);
    }

    /// The share of light from a direction, f being as it is.
    fn share_of(&self, incident: Vec3) -> f64 {
        match &self.turning {
            Some(table) => table.at(incident)[0],
            None => self.share(sine(incident)),
        }
    }

    /// The same of a round lobe.
    fn share(&self, sine: f64) -> f64 {
        let above = self
            .sines
            .partition_point(|node| *node <= sine)
            .clamp(1, self.sines.len() - 1);
        let [x0, x1] = [self.sines[above - 1], self.sines[above]];
        let [y0, y1] = [self.shares[above - 1], self.shares[above]];
        y0 + (y1 - y0) * ((sine - x0) / (x1 - x0)).clamp(0.0, 1.0)
    }

    /// What leaves at normal incidence.
    fn share_of_normal(&self) -> f64 {
        match &self.turning {
            Some(table) => table.at(Vec3::new(0.0, 0.0, 1.0))[0],
            None => self.shares[0],
        }
    }
}

/// |β₀|.
fn sine(incident: Vec3) -> f64 {
    (incident.x * incident.x + incident.y * incident.y).sqrt().min(1.0)
}

/// How often is tried again for a point within the unit circle.
const TRIES: u32 = 10_000;

impl Bsdf for Lobe {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        false
    }

    fn shares(&self, incident: Vec3, _media: &Media) -> Shares {
        let share = if self.renormalised {
            self.share_of_normal()
        } else {
            self.share_of(incident)
        };
        let mut diffuse = [0.0; 2];
        diffuse[usize::from(self.transmitted)] = share.min(1.0);
        Shares {
            specular: [0.0; 2],
            diffuse,
            refraction: incident.z.abs(),
        }
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, _media: &Media) -> f64 {
        if ((incident.z > 0.0) != (scattered.z > 0.0)) != self.transmitted {
            return 0.0;
        }
        let (x, y) = (scattered.x + incident.x, (scattered.y + incident.y) / self.aspect);
        let scale = if self.renormalised {
            self.share_of_normal() / self.share_of(incident).max(f64::MIN_POSITIVE)
        } else {
            1.0
        };
        self.profile.at((x * x + y * y).sqrt()) * scale
    }

    fn draw(&self, incident: Vec3, transmitted: bool, _media: &Media, numbers: [f64; 2]) -> Vec3 {
        let up = (incident.z > 0.0) != transmitted;
        let farthest = (1.0 + sine(incident)) * f64::max(1.0, self.aspect.recip());
        let all = self.up_to(farthest.min(self.radial[self.radial.len() - 1]));
        let mut more = MoreNumbers::new(numbers);
        let mut pair = numbers;
        for _ in 0..TRIES {
            let r = self.distance(pair[0] * all);
            let (s, c) = sin_cos_turns(pair[1]);
            let (x, y) = (r * c - incident.x, r * s * self.aspect - incident.y);
            let square = 1.0 - x * x - y * y;
            if square > 0.0 {
                return Vec3::new(x, y, if up { square.sqrt() } else { -square.sqrt() });
            }
            pair = more.pair();
        }
        by_cosine(up, numbers)
    }
}

#[cfg(test)]
impl super::examples::Examples for Lobe {
    // Lobes have a cusp at the specular direction, and part of them is far narrower than the steps elsewhere.
    const QUADRATURE: f64 = 1e-5;

    fn examples() -> Vec<Self> {
        let abg = |a, b, g| Profile::ABg { a, b, g };
        [
            (abg(0.1, 0.1, 1.5), false, false),
            (abg(0.05, 0.3, 3.0), false, true),
            (abg(0.2, 0.5, 0.0), true, false),
            (
                Profile::HarveyShack {
                    b0: 0.5,
                    l: 0.3,
                    s: -2.5,
                },
                false,
                false,
            ),
            (Profile::Gaussian { peak: 1.2, sigma: 0.3 }, true, false),
            (Profile::Gaussian { peak: 1.2, sigma: 0.25 }, false, true),
        ]
        .map(|(profile, transmitted, renormalised)| Self::new(profile, transmitted, renormalised).expect("sound"))
        .into_iter()
        .chain([
            Self::elliptical(Profile::Gaussian { peak: 0.8, sigma: 0.5 }, 0.6, false, false).expect("sound"),
            Self::elliptical(abg(0.05, 0.3, 2.0), 1.8, true, true).expect("sound"),
        ])
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tis(profile: Profile, degrees: f64) -> f64 {
        let lobe = Lobe::new(profile, false, false).expect("sound");
        lobe.share(degrees.to_radians().sin())
    }

    #[test]
    fn total_scatter_is_that_of_published_closed_forms_and_quadratures() {
        let abg = |a, b, g| Profile::ABg { a, b, g };
        for (found, expected) in [
            (tis(abg(0.0025, 0.001, 1.8), 0.0), 0.041_344),
            (tis(abg(0.1, 0.01, 1.5), 0.0), 0.935_524),
            (tis(abg(0.1, 0.01, 1.5), 30.0), 0.872_527),
            (tis(abg(0.1, 0.01, 1.5), 60.0), 0.690_449),
        ] {
            assert!((found - expected).abs() < 1e-6, "{found}, {expected}");
        }
        // g = 2: πA ln(1 + 1/B); g = 0: πA/(B + 1).
        let closed = PI * 0.0025 * (1.0 + 1.0 / 0.001_f64).ln();
        assert!((tis(abg(0.0025, 0.001, 2.0), 0.0) - closed).abs() < 1e-7);
        assert!((tis(abg(0.3, 0.5, 0.0), 70.0) - PI * 0.3 / 1.5).abs() < 1e-6);
        // Harvey and Shack: 2π b₀ L²/(S + 2) ((1 + 1/L²)^((S + 2)/2) − 1), and π b₀ L² ln(1 + 1/L²) for S = −2.
        let (b0, l) = (2.0, 0.05_f64);
        let q = 1.0 + 1.0 / (l * l);
        for s in [-1.5, -3.0] {
            let closed = 2.0 * PI * b0 * l * l / (s + 2.0) * (q.powf(0.5 * s + 1.0) - 1.0);
            assert!((tis(Profile::HarveyShack { b0, l, s }, 0.0) - closed).abs() < 1e-6);
        }
        let closed = PI * b0 * l * l * q.ln();
        assert!((tis(Profile::HarveyShack { b0, l, s: -2.0 }, 0.0) - closed).abs() < 1e-6);
        // Gaussian: 2π σ² peak (1 − exp(−1/(2σ²))).
        let closed = TAU * 0.09 * 1.2 * (1.0 - (-0.5_f64 / 0.09).exp());
        assert!((tis(Profile::Gaussian { peak: 1.2, sigma: 0.3 }, 0.0) - closed).abs() < 1e-6);
    }

    #[test]
    fn distances_are_those_of_the_quadrature() {
        let (b0, l) = (2.0, 0.05_f64);
        for profile in [
            Profile::ABg { a: 0.1, b: 0.1, g: 2.0 },
            Profile::ABg { a: 0.1, b: 0.1, g: 0.0 },
            Profile::ABg { a: 0.1, b: 0.1, g: 1.7 },
            Profile::HarveyShack { b0, l, s: -1.5 },
            Profile::HarveyShack { b0, l, s: -2.0 },
            Profile::HarveyShack { b0, l, s: -4.0 },
            Profile::Gaussian { peak: 1.2, sigma: 0.3 },
        ] {
            let lobe = Lobe::new(profile, false, false).expect("sound");
            for r in [1e-3, 0.02, 0.3, 0.9] {
                let back = lobe.distance(lobe.up_to(r));
                assert!((back / r - 1.0).abs() < 2e-5, "{profile:?}: {r} {back}");
            }
        }
    }

    #[test]
    fn narrow_lobes_keep_half_of_their_light_at_grazing_incidence() {
        let (peak, sigma) = (0.9 / (TAU * 1e-6), 1e-3);
        let lobe = Lobe::new(Profile::Gaussian { peak, sigma }, false, false).expect("sound");
        assert!((lobe.share(0.9) - 0.9).abs() < 1e-6);
        // The unit circle is nearly straight over the lobe.
        assert!((lobe.share(1.0) - 0.45).abs() < 1e-3);
    }

    #[test]
    fn elliptical_lobes_have_the_shares_of_round_ones_and_of_stretched_planes() {
        let gaussian = |sigma| Profile::Gaussian { peak: 0.9, sigma };
        // The same lobe, from another axis: turned by 90°.
        let [along, across] = [(0.3, 0.5), (0.15, 2.0)]
            .map(|(sigma, aspect)| Lobe::elliptical(gaussian(sigma), aspect, false, false).expect("sound"));
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.48, 0.36, 0.8), (0.0, 0.8, 0.6), (0.96, -0.28, 0.0)] {
            let [a, b] = [along.share_of(Vec3::new(x, y, z)), across.share_of(Vec3::new(y, x, z))];
            assert!((a - b).abs() < 2e-6, "{a} {b}");
        }
        // Nearly round.
        let round = Lobe::new(gaussian(0.3), false, false).expect("sound");
        let nearly = Lobe::elliptical(gaussian(0.3), 1.0 + 1e-9, false, false).expect("sound");
        for z in [1.0_f64, 0.7, 0.2, 0.01] {
            let d = Vec3::new(0.6 * (1.0 - z * z).sqrt(), 0.8 * (1.0 - z * z).sqrt(), z);
            assert!((round.share_of(d) - nearly.share_of(d)).abs() < 2e-6);
        }
        // Far from the unit circle: 2π σ₁ σ₂ peak.
        let narrow = Lobe::elliptical(gaussian(0.05), 0.2, false, false).expect("sound");
        let share = narrow.share_of(Vec3::new(0.3, 0.2, (1.0_f64 - 0.13).sqrt()));
        assert!((share / (TAU * 0.05 * 0.01 * 0.9) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn impossible_parameters_are_refused() {
        let of = |profile| Lobe::new(profile, false, false);
        assert!(of(Profile::ABg { a: 0.1, b: 0.0, g: 2.0 }).is_err());
        assert!(
            of(Profile::ABg {
                a: f64::NAN,
                b: 0.1,
                g: 2.0
            })
            .is_err()
        );
        assert!(of(Profile::Gaussian { peak: 1.0, sigma: 0.0 }).is_err());
        assert!(of(Profile::Gaussian { peak: 10.0, sigma: 0.5 }).is_err_and(|e| e.contains("more than arrives")));
    }
}
