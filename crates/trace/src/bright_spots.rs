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
    spots: Vec<Spot>,
}

/// Spots as they are seen from a point of a surface: cones of directions.
#[derive(Clone, Copy, Debug)]
pub struct Towards {
    axes: [[f64; GROUPS]; 3],
    /// 1 − the cosine of the half angle.
    width: [f64; GROUPS],
    /// Density of the directions drawn in a cone \[1/sr\].
    each: [f64; GROUPS],
    /// The chance of a cone and those before it.
    below: [f64; GROUPS],
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
        let found = Self { spots: groups };
        let above = |spot: &Spot| spot.centre + spot.normal * spot.radius;
        let needs = |spot: &&Spot| {
            found
                .seen(above(spot), |_| 1.0, VERY_BRIGHT)
                .is_some_and(|seen| seen.part * seen.part >= LEAST.0)
        };
        (found.spots.iter().filter(needs).count() >= LEAST.1).then_some(found)
    }

    /// The spots of a point of a surface with this normal, on its side or `through` it as well; None if there are none.
    #[must_use]
    pub fn towards(&self, point: Vec3, normal: Vec3, through: bool) -> Option<Towards> {
        let counts = |axis: Vec3| {
            let cosine = axis.dot(normal);
            if through { cosine.abs() } else { cosine.max(0.0) }
        };
        self.seen(point, counts, BRIGHT)
    }

    /// The spots of a point at which light from a direction counts by a cosine, and which are so bright at least.
    fn seen(&self, point: Vec3, cosine: impl Fn(Vec3) -> f64, bright: f64) -> Option<Towards> {
        let (mut all_axes, mut sines, mut weights) = ([[0.0; GROUPS]; 3], [0.0; GROUPS], [0.0; GROUPS]);
        let mut all = 0.0;
        for (k, spot) in self.spots.iter().enumerate() {
            let to = spot.centre - point;
            let inverse = 1.0 / to.dot(to).max(spot.radius * spot.radius).sqrt();
            let axis = to * inverse;
            for (list, x) in all_axes.iter_mut().zip([axis.x, axis.y, axis.z]) {
                list[k] = x;
            }
            sines[k] = (spot.radius * inverse).max(NARROWEST);
            // All groups have the same flux, and send it out by the cosine law, through a sheet as well.
            weights[k] = cosine(axis) * axis.dot(spot.normal).abs() * inverse * inverse;
            all += weights[k];
        }
        let mut found = Towards {
            axes: [[0.0; GROUPS]; 3],
            width: [0.0; GROUPS],
            each: [0.0; GROUPS],
            below: [0.0; GROUPS],
            count: 0,
            part: 0.0,
        };
        let mut total = 0.0;
        for k in 0..self.spots.len() {
            let (sine, axis) = (sines[k], Vec3::from(all_axes.map(|list| list[k])));
            // Of an even luminance L, a cone of half angle a would send π L cos sin² a, all directions π L.
            // What does not lie above the surface is not seen; on the surface itself, it is rounding that says so.
            let above = cosine(axis) > sine;
            if sine >= WIDEST || !above || weights[k] <= bright * all * cosine(axis) * sine * sine {
                continue;
            }
            let n = found.count;
            for (list, x) in found.axes.iter_mut().zip([axis.x, axis.y, axis.z]) {
                list[n] = x;
            }
            // 1 − √(1 − s²), as s is small.
            let width = sine * sine * (0.5 + 0.125 * sine * sine);
            total += weights[k];
            found.width[n] = width;
            found.each[n] = weights[k] / width;
            found.below[n] = total;
            found.count += 1;
        }
        for n in 0..found.count {
            found.each[n] /= 2.0 * PI * total;
            found.below[n] /= total;
        }
        found.part = (total / all).sqrt();
        (found.count > 0).then_some(found)
    }
}

impl Towards {
    /// Density of a direction \[1/sr\].
    #[must_use]
    pub fn density(&self, d: Vec3) -> f64 {
        let [x, y, z] = &self.axes;
        let mut sum = 0.0;
        for k in 0..self.count {
            // 1 − cos from the difference of unit vectors, which does not cancel.
            let (u, v, w) = (d.x - x[k], d.y - y[k], d.z - z[k]);
            let off = 0.5 * (u * u + v * v + w * w);
            sum += if off <= self.width[k] { self.each[k] } else { 0.0 };
        }
        sum
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
