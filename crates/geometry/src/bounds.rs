//! Axis-aligned boxes.

use etendue_math::Vec3;
use etendue_math::heads::heads;
use multiversion::multiversion;

/// An axis-aligned box in f64 \[mm\]. A box with a `lo` above its `hi` is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The smallest coordinates.
    pub lo: Vec3,
    /// The largest coordinates.
    pub hi: Vec3,
}

impl Bounds {
    /// The box that holds nothing: the neutral element of [`Bounds::union`].
    pub const EMPTY: Self = Self {
        lo: Vec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        hi: Vec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around some points; [`Bounds::EMPTY`] around none.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::grow)
    }

    /// Whether the box holds no point.
    #[must_use]
    pub fn is_empty(self) -> bool {
        !(self.lo.x <= self.hi.x && self.lo.y <= self.hi.y && self.lo.z <= self.hi.z)
    }

    /// Whether all six coordinates are finite; an empty box may be.
    #[must_use]
    pub fn is_finite(self) -> bool {
        [self.lo, self.hi]
            .iter()
            .all(|p| p.x.is_finite() && p.y.is_finite() && p.z.is_finite())
    }

    /// The smallest box that holds this one and a point.
    #[inline]
    #[must_use]
    pub fn grow(self, p: Vec3) -> Self {
        self.union(Self { lo: p, hi: p })
    }

    /// The smallest box that holds both. A NaN coordinate counts as nothing.
    #[inline]
    #[must_use]
    pub fn union(self, o: Self) -> Self {
        Self {
            lo: Vec3::new(self.lo.x.min(o.lo.x), self.lo.y.min(o.lo.y), self.lo.z.min(o.lo.z)),
            hi: Vec3::new(self.hi.x.max(o.hi.x), self.hi.y.max(o.hi.y), self.hi.z.max(o.hi.z)),
        }
    }

    /// The box moved outward by `margin` on every side.
    #[must_use]
    pub fn widened(self, margin: f64) -> Self {
        let m = Vec3::new(margin, margin, margin);
        Self {
            lo: self.lo - m,
            hi: self.hi + m,
        }
    }

    /// Its eight corners.
    pub fn corners(self) -> impl Iterator<Item = Vec3> {
        (0..8).map(move |k| {
            let side = |bit: usize, lo: f64, hi: f64| if k >> bit & 1 == 0 { lo } else { hi };
            Vec3::new(
                side(0, self.lo.x, self.hi.x),
                side(1, self.lo.y, self.hi.y),
                side(2, self.lo.z, self.hi.z),
            )
        })
    }

    /// Whether a point lies in the box or on its faces.
    #[must_use]
    pub fn contains(self, p: Vec3) -> bool {
        let inside = |lo: f64, p: f64, hi: f64| lo <= p && p <= hi;
        inside(self.lo.x, p.x, self.hi.x) && inside(self.lo.y, p.y, self.hi.y) && inside(self.lo.z, p.z, self.hi.z)
    }

    /// Whether the two boxes have a point in common.
    #[must_use]
    pub fn touches(self, o: Self) -> bool {
        let overlap = |lo: f64, hi: f64, from: f64, to: f64| lo <= to && from <= hi;
        overlap(self.lo.x, self.hi.x, o.lo.x, o.hi.x)
            && overlap(self.lo.y, self.hi.y, o.lo.y, o.hi.y)
            && overlap(self.lo.z, self.hi.z, o.lo.z, o.hi.z)
    }

    /// Lengths of the sides; not above 0 somewhere if the box is empty or flat.
    #[must_use]
    pub fn sides(self) -> Vec3 {
        self.hi - self.lo
    }

    /// Area of the surface; 0 if the box is empty.
    #[inline]
    #[must_use]
    pub fn area(self) -> f64 {
        let s = self.sides();
        if self.is_empty() {
            0.0
        } else {
            2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
        }
    }

    /// The box in f32, rounded outward: `lo` and `hi` per axis.
    #[must_use]
    pub fn outward(self) -> [[f32; 3]; 2] {
        [
            [self.lo.x, self.lo.y, self.lo.z].map(round_down),
            [self.hi.x, self.hi.y, self.hi.z].map(round_up),
        ]
    }
}

/// A ball that holds something, a little larger than need be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    centre: Vec3,
    /// Square of the radius \[mm²\].
    square: f64,
}

impl Ball {
    /// Share by which its radius is larger than the one that is stated.
    const SLACK: f64 = 1e-6;

    /// What roundings may make of the square of a distance, as a share of that to the start of the ray: a hundred times
    /// what a sum of six products and the unit direction are off by.
    const ROUNDING: f64 = 1e-12;

    /// The ball of a centre and a radius \[mm\]; None if they are not finite.
    #[must_use]
    pub fn new(centre: Vec3, radius: f64) -> Option<Self> {
        let radius = radius * (1.0 + Self::SLACK);
        let square = radius * radius;
        (square + centre.dot(centre))
            .is_finite()
            .then_some(Self { centre, square })
    }

    /// The ball about a box; None if that has no end.
    #[must_use]
    pub fn about(bounds: Bounds) -> Option<Self> {
        Self::new((bounds.lo + bounds.hi) * 0.5, 0.5 * bounds.sides().length())
    }

    /// Square of its radius \[mm²\].
    #[must_use]
    pub const fn square(&self) -> f64 {
        self.square
    }

    /// Whether the ray from o \[mm\] into the unit direction d has points in it; now and then true of one that passes close by,
    /// false of one that is not finite.
    #[inline(always)]
    #[must_use]
    pub fn meets(&self, o: Vec3, d: Vec3) -> bool {
        let to = self.centre - o;
        let (along, away) = (to.dot(d), to.dot(to));
        let beside = away - along * along;
        ((along >= 0.0) | (away <= self.square)) & (beside <= self.square + Self::ROUNDING * away)
    }

    /// The same in single precision; None if it is too far away for that.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "what is lost is in the roundings")]
    pub fn single(&self) -> Option<SingleBall> {
        let Vec3 { x, y, z } = self.centre;
        let size = round_up(x.abs() + y.abs() + z.abs());
        let radius = round_up(self.square.sqrt());
        (size + radius < SingleBall::MOST).then_some(SingleBall {
            centre: [x as f32, y as f32, z as f32],
            radius,
            size,
        })
    }

    /// Marks those of some rays that meet it, several at a time; others keep their marks.
    pub fn mark(&self, origin: [&[f64]; 3], direction: [&[f64]; 3], marks: &mut [bool]) {
        mark(*self, origin, direction, marks);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark(ball: Ball, origin: [&[f64]; 3], direction: [&[f64]; 3], marks: &mut [bool]) {
    let n = marks.len();
    let [ox, oy, oz] = heads(&origin, n);
    let [dx, dy, dz] = heads(&direction, n);
    for i in 0..n {
        marks[i] |= ball.meets(Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]));
    }
}

/// A ball in single precision, for rays in single precision: it may be met by a ray that passes close by, and is met by every one
/// that meets the ball it was made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SingleBall {
    centre: [f32; 3],
    radius: f32,
    /// Sum of the amounts of the centre's coordinates.
    size: f32,
}

/// What is to be known of a ball for rays whose start points have coordinates up to some sum.
#[derive(Clone, Copy, Debug)]
pub struct BallOfRays {
    centre: [f32; 3],
    radius: f32,
    square: f32,
}

impl SingleBall {
    /// Coordinates up to which numbers of single precision do not overflow \[mm\].
    pub const MOST: f32 = 1e15;

    /// What roundings make of a distance, as a share of all coordinates together: those of start point and centre, and that of
    /// their difference.
    const ROUNDING: f32 = 1e-6;

    /// The ball for rays whose start points have coordinates that add up to so much at most.
    #[must_use]
    pub fn of_rays(&self, size: f32) -> BallOfRays {
        let radius = self.radius + Self::ROUNDING * (self.size + size);
        BallOfRays {
            centre: self.centre,
            radius,
            square: radius * radius * 1.000_01,
        }
    }
}

impl BallOfRays {
    /// What roundings of the unit direction, of products and of sums make of the square of a distance, as a share of that to the
    /// start point: four times what they come to.
    const ROUNDING: f32 = 4e-6;

    /// Whether the ray from o into the unit direction d may meet the ball before `reach`.
    #[inline(always)]
    #[must_use]
    pub fn meets(&self, o: [f32; 3], d: [f32; 3], reach: f32) -> bool {
        let to = [self.centre[0] - o[0], self.centre[1] - o[1], self.centre[2] - o[2]];
        let along = to[0] * d[0] + to[1] * d[1] + to[2] * d[2];
        let away = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
        let beside = away - along * along;
        // Who is outside and meets the ball has it before itself by more than roundings come to.
        ((along >= 0.0) | (away <= self.square))
            & (beside <= self.square + Self::ROUNDING * away)
            & (along - 2.0 * self.radius <= reach * 1.000_002)
    }
}

/// The largest f32 that is not above `v`; NaN stays NaN.
#[inline(always)]
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "rounded, then corrected downward")]
pub fn round_down(v: f64) -> f32 {
    let near = v as f32;
    if f64::from(near) > v { near.next_down() } else { near }
}

/// The smallest f32 that is not below `v`; NaN stays NaN.
#[inline(always)]
#[must_use]
pub fn round_up(v: f64) -> f32 {
    -round_down(-v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    #[test]
    fn rays_that_meet_a_ball_meet_it_in_single_precision_too() {
        let stream = Stream::new(11, 3);
        let (mut met, mut near, mut passed) = (0, 0, [0, 0]);
        for i in 0..200_000 {
            let [a, b, c, d] = stream.uniforms(i, 0);
            let direction = |u: f64, v: f64| {
                let (height, turn) = (2.0 * u - 1.0, std::f64::consts::TAU * v);
                let wide = (1.0 - height * height).sqrt();
                Vec3::new(wide * turn.cos(), wide * turn.sin(), height)
            };
            // Radii and distances of all sizes, from a source beside the ball to one in another town.
            let [e, f, g, h] = stream.uniforms(i, 1);
            let radius = 10.0_f64.powf(8.0 * e - 5.0);
            let centre = direction(a, b) * 10.0_f64.powf(9.0 * f - 3.0);
            let away = radius * 10.0_f64.powf(6.0 * g);
            let o = centre + direction(c, d) * if i % 3 == 0 { radius * g } else { away };
            let to = direction(h, c);
            let d = (centre + to * (radius * (0.9 + 0.2 * f)) - o).normalized();
            let ball = Ball::new(centre, radius).expect("finite");
            // By the exact equation, roundings aside: the ray passes the centre at `beside`.
            let (along, line) = ((centre - o).dot(d), centre - o);
            let beside = (line - d * along).length();
            let inside = line.length() <= radius;
            let hits = beside <= radius && (inside || along > 0.0);
            let enters = if inside {
                0.0
            } else {
                along - (radius * radius - beside * beside).max(0.0).sqrt()
            };
            let single = ball.single().expect("near enough");
            let size = round_up(o.x.abs() + o.y.abs() + o.z.abs());
            #[allow(clippy::cast_possible_truncation)]
            let in_single = |v: Vec3| [v.x as f32, v.y as f32, v.z as f32];
            let found = |reach: f64| single.of_rays(size).meets(in_single(o), in_single(d), round_up(reach));
            if hits {
                met += 1;
                assert!(found(f64::INFINITY) && found(enters * (1.0 + 1e-9)), "{i}");
            } else if found(f64::INFINITY) {
                near += 1;
            }
            // What lies far behind the reach is left out.
            if hits && enters > 3.0 * radius && away < 1e4 * radius && size < 1e4 * round_up(radius) {
                passed[usize::from(found(0.2 * (enters - 2.5 * radius)))] += 1;
            }
        }
        assert!(met > 50_000 && near < 80_000, "{met} {near}");
        assert!(passed[0] > 10_000 && passed[1] == 0, "{passed:?}");
    }

    #[test]
    fn the_ball_about_a_box_holds_its_corners_and_a_box_without_end_has_none() {
        let bounds = Bounds::of([Vec3::new(-1.0, 2.0, 30.0), Vec3::new(4.0, 2.5, 31.0)]);
        let ball = Ball::about(bounds).expect("finite");
        for corner in bounds.corners() {
            let to = (corner - ball.centre).length();
            assert!(to * to <= ball.square && ball.square < 1.001 * to * to);
        }
        let whole = [f64::NEG_INFINITY, f64::INFINITY].map(|v| Vec3::new(v, v, v));
        assert_eq!(Ball::about(Bounds::of(whole)), None);
        assert_eq!(Ball::about(Bounds::EMPTY), None);
    }

    #[test]
    fn unions_hold_both_and_areas_are_those_of_cuboids() {
        let a = Bounds::of([Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(a.area(), 22.0);
        assert_eq!(a.sides(), Vec3::new(1.0, 2.0, 3.0));
        let b = a.grow(Vec3::new(-1.0, 5.0, 1.0));
        assert_eq!(
            b,
            Bounds {
                lo: Vec3::new(-1.0, 0.0, 0.0),
                hi: Vec3::new(1.0, 5.0, 3.0)
            }
        );
        assert!(b.contains(Vec3::new(-1.0, 0.0, 3.0)) && !b.contains(Vec3::new(-1.0, 0.0, 3.1)));
        assert!(!b.contains(Vec3::new(f64::NAN, 1.0, 1.0)));
        assert_eq!(b.union(Bounds::EMPTY), b);
        assert!(b.is_finite() && !b.is_empty() && Bounds::EMPTY.is_empty() && !Bounds::EMPTY.is_finite());
        assert_eq!(Bounds::EMPTY.area(), 0.0);
        assert_eq!(b.widened(1.0).hi, Vec3::new(2.0, 6.0, 4.0));
    }

    #[test]
    fn f32_boxes_hold_the_f64_box_and_are_one_step_away_at_most() {
        let stream = Stream::new(1, 2);
        let sign = |u: f64| if u < 0.5 { -1.0 } else { 1.0 };
        let mut values: Vec<f64> = (0..100_000)
            .map(|i| stream.uniforms(i, 0))
            .map(|[u, v, w, _]| sign(w) * u * (v * 180.0 - 100.0).exp())
            .collect();
        values.extend([
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.1,
            1e-300,
            -1e-300,
            1e39,
            -1e39,
            f64::MAX,
            f64::INFINITY,
            f64::from(f32::MAX),
        ]);
        for v in values {
            let p = Vec3::new(v, v, v);
            let [[lo, ..], [hi, ..]] = Bounds { lo: p, hi: p }.outward();
            assert!(f64::from(lo) <= v && v <= f64::from(hi), "{v}");
            assert!(lo == hi || lo.next_up() == hi, "{v}: {lo} {hi}");
        }
    }
}
