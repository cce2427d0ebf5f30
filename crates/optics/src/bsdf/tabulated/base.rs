//! How the base of a table leaves: with one distribution, whatever the direction that its light came from.
//!
//! f of the base is a(incident) l(scattered)/π. What a matt surface or the paint under a clear coat sends out is of this form, and it
//! stays where it is when the incidence changes, while a lobe moves with the specular direction.

use etendue_math::Vec3;
use etendue_sampling::guide::Guide;

use crate::bsdf::contract::by_cosine;

/// l, the luminance over that of Lambertian light of the same flux, on one side of a surface. Between cosines of the angle from
/// the normal that fall evenly from 1 to 0 it is linear in the square of the sine, by which projected solid angle is even.
#[derive(Clone, Debug, Default)]
pub(super) struct Base {
    /// From the normal to the horizon; none: l is 1 throughout.
    steps: Vec<Step>,
    /// The part of the flux before each step.
    before: Vec<f64>,
    guide: Guide,
}

/// Between two cosines.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Square of the sine where it begins, and how much it grows.
    from: f64,
    width: f64,
    /// l at both ends.
    ends: [f64; 2],
    /// One over its part of the flux; 0 if that is 0.
    per_flux: f64,
}

impl Step {
    /// Its part of the flux.
    fn flux(&self) -> f64 {
        0.5 * self.width * (self.ends[0] + self.ends[1])
    }
}

/// A step, and the part of its flux that is nearer to the normal than what is drawn.
pub(super) struct Within {
    pub from: f64,
    pub width: f64,
    pub near: f64,
    pub far: f64,
    pub part: f64,
}

impl Within {
    /// The square of the sine.
    #[inline(always)]
    pub fn square(&self) -> f64 {
        let Self { near, far, part, .. } = *self;
        // Where l changes linearly, the flux grows as a parabola does.
        let grown = near * near + part * (far * far - near * near);
        let below = near + if grown > 0.0 { grown } else { 0.0 }.sqrt();
        let along = if below > 0.0 { part * (near + far) / below } else { 0.0 };
        let square = self.from + self.width * along;
        if square < 1.0 { square } else { 1.0 }
    }
}

impl Base {
    /// From luminances of any scale at cosines evenly from 1 to 0; none: Lambertian.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn new(luminances: &[f64]) -> Result<Self, String> {
        if luminances.is_empty() {
            return Ok(Self::default());
        }
        if luminances.len() == 1 || luminances.len() > usize::from(u16::MAX) {
            return Err("a base has from 2 to 65535 luminances".into());
        }
        let count = (luminances.len() - 1) as f64;
        let square = |k: usize| (k as f64 / count) * (2.0 - k as f64 / count);
        let step = |(k, ends): (usize, &[f64])| Step {
            from: square(k),
            width: square(k + 1) - square(k),
            ends: [ends[0], ends[1]],
            per_flux: 0.0,
        };
        let mut steps: Vec<Step> = luminances.windows(2).enumerate().map(step).collect();
        let mean: f64 = steps.iter().map(Step::flux).sum();
        if !(luminances.iter().all(|l| *l >= 0.0) && mean > 0.0 && mean.is_finite()) {
            return Err("luminances of a base are not from 0 on, or all of them are 0".into());
        }
        for step in &mut steps {
            step.ends = step.ends.map(|l| l / mean);
            let flux = step.flux();
            step.per_flux = if flux > 0.0 { 1.0 / flux } else { 0.0 };
        }
        let sum = |sum: &mut f64, step: &Step| {
            let before = *sum;
            *sum += step.flux();
            Some(before)
        };
        let before: Vec<f64> = steps.iter().scan(0.0, sum).collect();
        Ok(Self {
            guide: Guide::new(&before),
            before,
            steps,
        })
    }

    /// Whether l is 1 in all directions.
    #[inline]
    pub const fn is_even(&self) -> bool {
        self.steps.is_empty()
    }

    /// l by the cosine of the angle from the normal.
    #[inline]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "fewer than 2^16 steps, and cosines are not above 1 but by rounding, which the cast cuts off"
    )]
    pub fn luminance(&self, cosine: f64) -> f64 {
        let place = (1.0 - cosine) * self.steps.len() as f64;
        let Some(step) = self.steps.get((place as usize).min(self.steps.len().wrapping_sub(1))) else {
            return 1.0;
        };
        let part = ((1.0 - cosine) * (1.0 + cosine) - step.from) / step.width;
        step.ends[0] + part.clamp(0.0, 1.0) * (step.ends[1] - step.ends[0])
    }

    /// The square of the sine that a number from 0 to 1 draws: light within it is that part of the flux.
    #[inline]
    pub fn square(&self, number: f64) -> f64 {
        if self.is_even() {
            number
        } else {
            self.within(number).square()
        }
    }

    /// The step that a number from 0 to 1 draws from; not of one that is even.
    #[inline(always)]
    pub fn within(&self, number: f64) -> Within {
        let k = self.guide.not_above(&self.before, number, |before| *before).max(1) - 1;
        let step = &self.steps[k];
        Within {
            from: step.from,
            width: step.width,
            near: step.ends[0],
            far: step.ends[1],
            part: (number - self.before[k]) * step.per_flux,
        }
    }

    /// A direction on the front or on the back, from two numbers.
    #[inline]
    pub fn direction(&self, front: bool, [height, turn]: [f64; 2]) -> Vec3 {
        by_cosine(front, [self.square(height), turn])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_are_drawn_by_what_leaves_within_them() {
        // From 0 on, with a hole, at both ends of the number.
        let base = Base::new(&[0.0, 2.0, 5.0, 0.0, 0.0, 1.0, 0.5]).expect("sound");
        let cosine = |square: f64| (1.0 - square).sqrt();
        let (mut flux, mut at) = (0.0, 0.0);
        for k in 0..=1000 {
            let number = f64::from(k) / 1000.0;
            let square = base.square(number);
            // The flux between both by the rule of midpoints.
            let width = (square - at) / 400.0;
            for i in 0..400 {
                flux += width * base.luminance(cosine(at + (f64::from(i) + 0.5) * width));
            }
            at = square;
            assert!((flux - number).abs() < 1e-6, "{number}: {flux}");
        }
        assert!(at > 1.0 - 1e-9);
        let even = Base::new(&[]).expect("sound");
        assert!(even.is_even() && even.square(0.3) == 0.3 && even.luminance(0.2) == 1.0);
    }

    #[test]
    fn what_cannot_be_a_luminance_is_refused() {
        for wrong in [
            &[1.0][..],
            &[0.0, 0.0],
            &[1.0, -1.0, 1.0],
            &[1.0, f64::NAN],
            &[f64::INFINITY, 1.0],
        ] {
            assert!(Base::new(wrong).is_err(), "{wrong:?}");
        }
    }
}
