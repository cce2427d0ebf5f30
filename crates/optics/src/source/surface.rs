//! Surfaces that emit.

use etendue_geometry::shape::sample::AreaSampler;
use etendue_geometry::shape::{Outline, Shape};
use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use etendue_sampling::warp::square_to_annulus;
use multiversion::multiversion;

use super::intensity_table::IntensityTable;
use super::numbers::Numbers;

/// In which directions each element of a surface emits.
#[derive(Clone, Debug)]
pub enum Pattern {
    /// With intensity ∝ cosⁿθ about its normal.
    CosinePower(f64),
    /// By a table without light beyond γ = 90°, on flat surfaces: γ from the normal on the emitting side, C0 along local x.
    Table(Box<IntensityTable>),
}

/// A surface of any shape; each element of its area emits the same flux in the same pattern.
#[derive(Clone, Debug)]
pub struct SurfaceSource {
    shape: Shape,
    flipped: bool,
    sampler: AreaSampler,
    pattern: Pattern,
}

impl SurfaceSource {
    /// None if the shape has no finite area, or the exponent is negative or not finite, or a table belongs to a shape that is
    /// not flat or has light beyond 90°.
    #[must_use]
    pub fn new(shape: Shape, flipped: bool, pattern: Pattern) -> Option<Self> {
        let sampler = AreaSampler::new(&shape)?;
        let sound = match &pattern {
            Pattern::CosinePower(exponent) => *exponent >= 0.0 && exponent.is_finite(),
            Pattern::Table(table) => matches!(shape, Shape::Flat(_)) && table.is_in_front(),
        };
        sound.then_some(Self {
            shape,
            flipped,
            sampler,
            pattern,
        })
    }

    /// The shape, and whether it emits against its normal.
    #[must_use]
    pub const fn shape(&self) -> (&Shape, bool) {
        (&self.shape, self.flipped)
    }

    /// \[mm²\].
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.sampler.area()
    }

    /// Luminance per unit of flux of the light that leaves along a unit vector, at an angle to the normal with this cosine
    /// \[1/(mm² sr)\]: I(γ, C)/(A cos θ), which is (n + 1)/(2π A) cosⁿ⁻¹θ for a power of the cosine.
    #[inline]
    #[must_use]
    pub fn luminance(&self, direction: Vec3, cosine: f64) -> f64 {
        match &self.pattern {
            Pattern::CosinePower(exponent) => {
                let scale = (exponent + 1.0) / (2.0 * std::f64::consts::PI * self.sampler.area());
                if *exponent == 1.0 {
                    scale
                } else {
                    scale * cosine.powf(exponent - 1.0)
                }
            }
            Pattern::Table(table) => table.intensity(self.turned(direction)) / (self.sampler.area() * cosine),
        }
    }

    /// Between local coordinates and those of the emitting side: half a turn about x for the back.
    #[inline]
    fn turned(&self, d: Vec3) -> Vec3 {
        if self.flipped { Vec3::new(d.x, -d.y, -d.z) } else { d }
    }

    /// Whether no point of the surface can send light to `p`, as far as that is easy to tell.
    #[inline]
    #[must_use]
    pub fn turns_away_from(&self, p: Vec3) -> bool {
        matches!(self.shape, Shape::Flat(_)) && (if self.flipped { -p.z } else { p.z }) <= 0.0
    }

    /// A point spread evenly over the area, and the normal on the emitting side.
    #[must_use]
    pub fn draw_point(&self, numbers: &mut Numbers) -> (Vec3, Vec3) {
        let (point, part) = self.sampler.draw(&mut || numbers.draw());
        let (point, normal) = self.shape.settle(point, part);
        (point, if self.flipped { -normal } else { normal })
    }

    /// A block of rays of a Lambertian disk, annulus or rectangle, from four numbers each, several at a time: what
    /// [`SurfaceSource::draw`] draws. False, and nothing is done, for other surfaces.
    pub fn draw_block(
        &self,
        numbers: &[Vec<f64>; 4],
        position: &mut [Vec<f64>; 3],
        direction: &mut [Vec<f64>; 3],
    ) -> bool {
        let Shape::Flat(flat) = &self.shape else { return false };
        let sign = if self.flipped { -1.0 } else { 1.0 };
        match flat.outline {
            _ if !matches!(self.pattern, Pattern::CosinePower(1.0)) => return false,
            Outline::Annulus { inner, outer } => draw_annulus([inner, outer], sign, numbers, position, direction),
            Outline::Rectangle { width, height } => draw_rectangle([width, height], sign, numbers, position, direction),
            Outline::Whole | Outline::Polygon { .. } => return false,
        }
        true
    }

    /// A ray with the density of the intensity.
    #[must_use]
    pub fn draw(&self, numbers: &mut Numbers) -> (Vec3, Vec3) {
        let (point, normal) = self.draw_point(numbers);
        let exponent = match &self.pattern {
            Pattern::CosinePower(exponent) => *exponent,
            Pattern::Table(table) => return (point, self.turned(table.draw(numbers))),
        };
        // ∫ cosⁿθ sin θ dθ from 0: 1 − cosⁿ⁺¹θ is uniform.
        let (u, turn) = (numbers.draw(), numbers.draw());
        let cosine = if exponent == 1.0 {
            (1.0 - u).sqrt()
        } else {
            (1.0 - u).powf(1.0 / (exponent + 1.0))
        };
        (point, about(normal, cosine, turn))
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn draw_annulus(
    radii: [f64; 2],
    sign: f64,
    numbers: &[Vec<f64>; 4],
    position: &mut [Vec<f64>; 3],
    direction: &mut [Vec<f64>; 3],
) {
    draw_flat(sign, numbers, position, direction, |u, v| {
        square_to_annulus(u, v, radii[0], radii[1])
    });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn draw_rectangle(
    sides: [f64; 2],
    sign: f64,
    numbers: &[Vec<f64>; 4],
    position: &mut [Vec<f64>; 3],
    direction: &mut [Vec<f64>; 3],
) {
    draw_flat(sign, numbers, position, direction, |u, v| {
        ((u - 0.5) * sides[0], (v - 0.5) * sides[1])
    });
}

#[inline(always)]
fn draw_flat(
    sign: f64,
    numbers: &[Vec<f64>; 4],
    position: &mut [Vec<f64>; 3],
    direction: &mut [Vec<f64>; 3],
    place: impl Fn(f64, f64) -> (f64, f64),
) {
    let n = numbers[0].len();
    let [a, b, c, d] = numbers.each_ref().map(|v| &v[..n]);
    let [px, py, pz] = position.each_mut().map(|v| &mut v[..n]);
    let [kx, ky, kz] = direction.each_mut().map(|v| &mut v[..n]);
    for i in 0..n {
        (px[i], py[i]) = place(a[i], b[i]);
        pz[i] = 0.0;
        let k = about(Vec3::new(0.0, 0.0, sign), (1.0 - c[i]).sqrt(), d[i]);
        (kx[i], ky[i], kz[i]) = (k.x, k.y, k.z);
    }
}

/// The unit vector at an angle with this cosine from the unit vector `axis`, at an azimuth in turns.
#[inline(always)]
#[must_use]
pub fn about(axis: Vec3, cosine: f64, turn: f64) -> Vec3 {
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    let (s, c) = sin_cos_turns(turn);
    let [x, y] = across(axis);
    x * (sine * c) + y * (sine * s) + axis * cosine
}

/// Two unit vectors at right angles to a unit vector and to each other.
///
/// Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin, "Building an orthonormal basis, revisited" (2017),
/// `[Duff2017]`.
#[inline(always)]
#[must_use]
pub fn across(n: Vec3) -> [Vec3; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_geometry::shape::Quadric;
    use etendue_sampling::philox::Stream;

    #[test]
    fn cosines_have_the_moments_of_their_power_and_azimuths_of_none() {
        let sphere = Shape::Quadric(Quadric {
            r2: 1.0,
            z2: 1.0,
            z1: 0.0,
            z0: -4.0,
            z: [-1.0, 2.0],
            r: [0.0, f64::INFINITY],
        });
        let rays = 200_000;
        for (exponent, flipped) in [(0.0, false), (1.0, true), (3.5, false)] {
            let source = SurfaceSource::new(sphere.clone(), flipped, Pattern::CosinePower(exponent)).expect("sound");
            let (mut first, mut second, mut side) = (0.0, 0.0, [0.0; 2]);
            for i in 0..rays {
                let mut numbers = Numbers::new(Stream::new(5, 6), i, 0);
                let (p, d) = source.draw(&mut numbers);
                let n = p * (if flipped { -0.5 } else { 0.5 });
                let cosine = d.dot(n);
                assert!(cosine >= 0.0 && (d.length() - 1.0).abs() < 1e-14);
                first += cosine;
                second += cosine * cosine;
                let [x, y] = across(n);
                side = [side[0] + d.dot(x), side[1] + d.dot(y)];
            }
            // E cosᵏθ = (n + 1)/(n + k + 1).
            let moment = |k: f64| (exponent + 1.0) / (exponent + k + 1.0);
            let m = rays as f64;
            let z = |sum: f64, mean: f64, square: f64| (sum / m - mean) / ((square - mean * mean) / m).sqrt();
            assert!(z(first, moment(1.0), moment(2.0)).abs() < 4.0);
            assert!(z(second, moment(2.0), moment(4.0)).abs() < 4.0);
            for s in side {
                assert!(z(s, 0.0, 0.5 * (1.0 - moment(2.0))).abs() < 4.0);
            }
            // Flux 1 over the area and the half space: ∫ L cos θ dω = 1/A.
            let n = 20_000;
            let sum: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) / f64::from(n))
                .map(|c| source.luminance(Vec3::default(), c) * c * 2.0 * std::f64::consts::PI / f64::from(n))
                .sum();
            assert!((sum * source.area() - 1.0).abs() < 1e-6);
        }
    }
}
