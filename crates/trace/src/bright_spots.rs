//! Small places of diffuse surfaces that much light comes from, as of a wall close to a lamp.
//!
//! A line of sight that is scattered diffusely meets such a place by chance only. Rays traced forwards tell where they are:
//! their scatters are cut into groups of like flux. Seen from a surface, a group is a spot if it is small and much brighter
//! than what is seen from there on average: a part of the directions is drawn towards spots, as to sources `[Jensen1995]`. All
//! others are drawn as before, so that no light is lost, and none weighs more than twice of what it would. In even light,
//! which the cosine law finds well, there are no spots.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_optics::source::surface::about;
use multiversion::multiversion;

/// Groups that scatters are cut into: a power of two.
const GROUPS: usize = 64;

/// Scatters of a group, at least: its place is known then.
const FEWEST: usize = 16;

/// Luminance of a spot over the mean of what is seen, at least: less bright places, the cosine law finds.
const BRIGHT: f64 = 4.0;

/// The same where spots are needed.
const VERY_BRIGHT: f64 = 16.0;

/// Sine of the half angle of a spot, at most.
const WIDEST: f64 = 0.2;

/// Share of the light that comes from very bright spots where they are needed, and groups near to which that is so, for any
/// to be looked for.
const LEAST: (f64, usize) = (0.05, GROUPS / 10);

/// Sine of the least half angle: a third of a minute of arc.
const NARROWEST: f64 = 1e-4;

/// Radius of a spot over the root of the mean square of its scatters' distances from its centre: √2 for an even disk.
const RADIUS: f64 = 1.5;

/// A small place that light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    centre: Vec3,
    radius: f64,
    /// Mean of the normals of the surfaces there.
    normal: Vec3,
}

/// Where light was scattered: a point, the normal of the surface, flux.
pub type Scatter = (Vec3, Vec3, f64);

/// Spots of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct BrightSpots {
    centre: [Numbers; 3],
    radius: Numbers,
    normal: [Numbers; 3],
}

/// A number of each group.
type Numbers = [f64; GROUPS];

/// Spots as they are seen from a point of a surface: cones of directions.
#[derive(Clone, Copy, Debug)]
pub struct Towards {
    axes: [Numbers; 3],
    /// 1 − the cosine of the half angle.
    width: Numbers,
    /// Density of the directions drawn in a cone \[1/sr\].
    each: Numbers,
    /// The chance of a cone and those before it.
    below: Numbers,
    count: usize,
    /// The part of the directions that are drawn so, of those that could be: the root of the share of the spots in what all
    /// groups send here.
    pub part: f64,
}

impl BrightSpots {
    /// From where light was scattered; None if it has no such places.
    #[must_use]
    pub fn of(mut scatters: Vec<Scatter>) -> Option<Self> {
        scatters.retain(|(_, _, flux)| *flux > 0.0);
        if scatters.len() < GROUPS * FEWEST {
            return None;
        }
        let mut groups = Vec::with_capacity(GROUPS);
        cut(&mut scatters, GROUPS, &mut groups);
        let number = |of: fn(&Spot) -> f64| std::array::from_fn(|k| of(&groups[k]));
        let found = Self {
            centre: [number(|s| s.centre.x), number(|s| s.centre.y), number(|s| s.centre.z)],
            radius: number(|s| s.radius),
            normal: [number(|s| s.normal.x), number(|s| s.normal.y), number(|s| s.normal.z)],
        };
        let needs = |spot: &&Spot| {
            let seen = found.seen(spot.centre + spot.normal * spot.radius, None, VERY_BRIGHT);
            seen.is_some_and(|seen| seen.part * seen.part >= LEAST.0)
        };
        (groups.iter().filter(needs).count() >= LEAST.1).then_some(found)
    }

    /// The spots of a point of a surface with this normal, on its side or `through` it as well; None if there are none.
    #[must_use]
    pub fn towards(&self, point: Vec3, normal: Vec3, through: bool) -> Option<Towards> {
        self.seen(point, Some((normal, through)), BRIGHT)
    }

    /// The spots of a point, of a surface or in space, which are so bright at least.
    fn seen(&self, point: Vec3, surface: Option<(Vec3, bool)>, bright: f64) -> Option<Towards> {
        let mut all = Sighted {
            axes: [[0.0; GROUPS]; 3],
            sine: [0.0; GROUPS],
            cosine: [1.0; GROUPS],
            weight: [0.0; GROUPS],
        };
        look(self, point, &mut all);
        if let Some((normal, through)) = surface {
            count_by_cosine(&mut all, normal, through);
        }
        let mut found = Towards {
            axes: [[0.0; GROUPS]; 3],
            width: [0.0; GROUPS],
            each: [0.0; GROUPS],
            below: [0.0; GROUPS],
            count: 0,
            part: 0.0,
        };
        let (whole, mut total) = (all.weight.iter().sum::<f64>(), 0.0);
        for k in 0..GROUPS {
            let (sine, cosine, weight) = (all.sine[k], all.cosine[k], all.weight[k]);
            // Of an even luminance L, a cone of half angle a would send π L cos sin² a, all directions π L. What does not lie
            // above the surface is not seen; on the surface itself, it is rounding that says so.
            if sine >= WIDEST || cosine <= sine || weight <= bright * whole * cosine * sine * sine {
                continue;
            }
            let n = found.count;
            for (list, from) in found.axes.iter_mut().zip(&all.axes) {
                list[n] = from[k];
            }
            // 1 − √(1 − s²), as s is small.
            let width = sine * sine * (0.5 + 0.125 * sine * sine);
            total += weight;
            found.width[n] = width;
            found.each[n] = weight / width;
            found.below[n] = total;
            found.count += 1;
        }
        for n in 0..found.count {
            found.each[n] /= 2.0 * PI * total;
            found.below[n] /= total;
        }
        found.part = (total / whole).sqrt();
        (found.count > 0).then_some(found)
    }
}

/// All groups, seen from a point.
struct Sighted {
    axes: [Numbers; 3],
    /// Of the half angle.
    sine: Numbers,
    /// By which light counts at the point.
    cosine: Numbers,
    /// What a group sends there. All have the same flux, and send it out by the cosine law, through a sheet as well.
    weight: Numbers,
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn look(spots: &BrightSpots, point: Vec3, all: &mut Sighted) {
    let ([x, y, z], [u, v, w]) = (&spots.centre, &spots.normal);
    for k in 0..GROUPS {
        let (a, b, c) = (x[k] - point.x, y[k] - point.y, z[k] - point.z);
        let radius = spots.radius[k];
        let inverse = 1.0 / (a * a + b * b + c * c).max(radius * radius).sqrt();
        let (a, b, c) = (a * inverse, b * inverse, c * inverse);
        all.axes[0][k] = a;
        all.axes[1][k] = b;
        all.axes[2][k] = c;
        all.sine[k] = (radius * inverse).max(NARROWEST);
        all.weight[k] = (a * u[k] + b * v[k] + c * w[k]).abs() * inverse * inverse;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn count_by_cosine(all: &mut Sighted, normal: Vec3, through: bool) {
    for k in 0..GROUPS {
        let cosine = all.axes[0][k] * normal.x + all.axes[1][k] * normal.y + all.axes[2][k] * normal.z;
        let cosine = if through { cosine.abs() } else { cosine.max(0.0) };
        all.cosine[k] = cosine;
        all.weight[k] *= cosine;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn density(towards: &Towards, d: Vec3) -> f64 {
    let [x, y, z] = &towards.axes;
    let mut within = [0.0; GROUPS];
    for k in 0..GROUPS {
        // 1 − cos from the difference of unit vectors, which does not cancel.
        let (u, v, w) = (d.x - x[k], d.y - y[k], d.z - z[k]);
        let off = 0.5 * (u * u + v * v + w * w);
        within[k] = if off <= towards.width[k] { towards.each[k] } else { 0.0 };
    }
    within.iter().sum()
}

impl Towards {
    /// Density of a direction \[1/sr\].
    #[must_use]
    pub fn density(&self, d: Vec3) -> f64 {
        density(self, d)
    }

    /// A direction from three numbers.
    #[must_use]
    pub fn draw(&self, [which, height, turn]: [f64; 3]) -> Vec3 {
        let k = self.below[..self.count]
            .partition_point(|below| *below <= which)
            .min(self.count - 1);
        let axis = Vec3::new(self.axes[0][k], self.axes[1][k], self.axes[2][k]);
        about(axis, 1.0 - height * self.width[k], turn)
    }
}

/// Cuts scatters into groups of like flux, by halves along the longest side of their box, and adds what each is.
fn cut(scatters: &mut [Scatter], groups: usize, found: &mut Vec<Spot>) {
    let coordinates = |p: Vec3| [p.x, p.y, p.z];
    if groups == 1 || scatters.len() < 2 {
        let flux: f64 = scatters.iter().map(|(_, _, flux)| flux).sum();
        let zero = Vec3::new(0.0, 0.0, 0.0);
        let mean = |of: fn(&Scatter) -> Vec3| scatters.iter().fold(zero, |sum, each| sum + of(each) * (each.2 / flux));
        let (centre, normal) = (mean(|each| each.0), mean(|each| each.1));
        let off = |p: Vec3| (p - centre).dot(p - centre);
        let square: f64 = scatters.iter().map(|(p, _, w)| w * off(*p)).sum();
        found.push(Spot {
            centre,
            radius: RADIUS * (square / flux).sqrt(),
            normal,
        });
        return;
    }
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (p, ..) in scatters.iter() {
        for (axis, x) in coordinates(*p).into_iter().enumerate() {
            lo[axis] = lo[axis].min(x);
            hi[axis] = hi[axis].max(x);
        }
    }
    let longest = |best: usize, axis: usize| {
        if hi[axis] - lo[axis] > hi[best] - lo[best] {
            axis
        } else {
            best
        }
    };
    let axis = (0..3).fold(0, longest);
    scatters.sort_by(|a, b| coordinates(a.0)[axis].total_cmp(&coordinates(b.0)[axis]));
    let half = 0.5 * scatters.iter().map(|(_, _, flux)| flux).sum::<f64>();
    let mut below = 0.0;
    let middle = scatters.iter().position(|(_, _, flux)| {
        below += flux;
        below > half
    });
    let middle = middle.unwrap_or(1).clamp(1, scatters.len() - 1);
    let (first, second) = scatters.split_at_mut(middle);
    cut(first, groups / 2, found);
    cut(second, groups / 2, found);
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    const UP: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    /// Scatters on the wall x = 0 by a lamp of all directions at this distance from it, and on a floor.
    fn scatters(distance: f64) -> Vec<Scatter> {
        let stream = Stream::new(3, 4);
        (0..20_000)
            .map(|i| {
                let [a, b, c, _] = stream.uniforms(i, 0);
                if c < 0.4 {
                    return (Vec3::new(500.0 * a, 1000.0 * b - 500.0, 0.0), UP, 1.0);
                }
                // A share a of the light is within r = h √(1/(1 − a)² − 1).
                let r = (distance * (1.0 / ((1.0 - a) * (1.0 - a)) - 1.0).sqrt()).min(500.0);
                let (sine, cosine) = (2.0 * PI * b).sin_cos();
                (
                    Vec3::new(0.0, r * cosine, 300.0 + r * sine),
                    Vec3::new(1.0, 0.0, 0.0),
                    1.0,
                )
            })
            .collect()
    }

    #[test]
    fn a_wall_close_to_a_lamp_has_spots_and_an_even_one_has_none() {
        let near = BrightSpots::of(scatters(1.0)).expect("spots");
        let seen = near
            .towards(Vec3::new(200.0, 30.0, 0.0), Vec3::new(0.0, 0.0, 1.0), false)
            .expect("seen");
        assert!(seen.count > 20, "{}", seen.count);
        assert_eq!(BrightSpots::of(scatters(300.0)), None);
        assert_eq!(BrightSpots::of(scatters(1.0)[..900].to_vec()), None);
        let one = vec![(Vec3::new(1.0, 2.0, 3.0), UP, 1.0); 5000];
        assert_eq!(BrightSpots::of(one), None);
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        let spots = BrightSpots::of(scatters(1.0)).expect("spots");
        let point = Vec3::new(200.0, 30.0, 0.0);
        assert!(spots.towards(point - UP * 400.0, -UP, false).is_none());
        let towards = spots.towards(point, UP, false).expect("seen");
        // Its integral over all directions is 1; that over half of them, the share of the directions drawn there. By a lattice
        // in azimuth and in the root of the angle from where the narrowest spots are.
        let n = 400_000_u32;
        let stream = Stream::new(5, 6);
        let middle = (Vec3::new(0.0, 0.0, 300.0) - point).normalized();
        let side = middle.cross(UP).normalized();
        let mut drawn = 0.0;
        for i in 0..n {
            let [a, b, c, _] = stream.uniforms(u64::from(i), 0);
            let d = towards.draw([a, b, c]);
            assert!((d.length() - 1.0).abs() < 1e-12 && towards.density(d) > 0.0);
            drawn += f64::from(u8::from(d.dot(side) > 0.0));
        }
        let steps = 2500_u32;
        let other = side.cross(middle);
        let (mut whole, mut part) = (0.0, 0.0);
        for i in 0..steps {
            let s = (f64::from(i) + 0.5) / f64::from(steps);
            let (off, cosine) = (PI * s * s).sin_cos();
            for k in 0..steps {
                let (up, across) = (2.0 * PI * (f64::from(k) + 0.5) / f64::from(steps)).sin_cos();
                let d = middle * cosine + (side * across + other * up) * off;
                let p = towards.density(d) * off * s;
                whole += p;
                part += if across > 0.0 { p } else { 0.0 };
            }
        }
        whole *= 4.0 * PI * PI / f64::from(steps).powi(2);
        part *= 4.0 * PI * PI / f64::from(steps).powi(2);
        assert!((whole - 1.0).abs() < 2e-3, "{whole}");
        let (share, n) = (part / whole, f64::from(n));
        let error = (share * (1.0 - share) / n).sqrt() + 1e-3;
        assert!((drawn / n - share).abs() < 4.0 * error, "{} {share}", drawn / n);
    }
}
