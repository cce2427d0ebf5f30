//! Carrier surfaces: equal-area charts, and the étendue coordinates of a ray on them.
//!
//! A light field lives on a surface Σ in four coordinates, each from 0 to 1: (s₁, s₂) is the place on a part of Σ, by an
//! equal-area chart, and (a, b) the direction, by the concentric map of its local direction cosines (p, q). Equal volumes
//! in these coordinates are equal étendues: dU = dA dp dq = π A ds₁ ds₂ da db. Theory eq. 37.

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::{Frame, Vec3};
use etendue_sampling::warp::{disk_to_square, square_to_disk};
use multiversion::multiversion;

/// The depth at which light of each inclination is sharp: a cubic in 1 − cos θ, from its constant term on \[mm\].
///
/// It moves places by a function of the direction only, so that étendue stays what it is. Theory eq. 41.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Focus(pub [f64; 4]);

impl Focus {
    /// The height at which lines of this direction cosine along z have their places.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, cosine: f64) -> f64 {
        let [a, b, c, d] = self.0;
        let lean = 1.0 - cosine;
        a + lean * (b + lean * (c + lean * d))
    }

    /// What takes the place of the cosine of a line in cosine · area / distance², the solid angle under which an area of
    /// places is seen from `height` above the plane, the distance being that to the plane.
    ///
    /// With the slope m of the line, x' = x - (h - ζ) m; ζ changes with m, so that the determinant of dx'/dm is
    /// (h - ζ)² (1 + ζ' c (1 - c²)/(h - ζ)), and dm = dΩ/c³: theory eq. 42.
    #[inline(always)]
    #[must_use]
    pub fn seen(&self, cosine: f64, height: f64) -> f64 {
        let above = height - self.at(cosine);
        let nearer = if above == 0.0 { 1.0 } else { height / above };
        cosine * nearer * nearer / self.stretch(cosine, above)
    }

    /// The second factor of that determinant.
    #[inline(always)]
    fn stretch(&self, cosine: f64, above: f64) -> f64 {
        let [_, b, c, d] = self.0;
        let lean = 1.0 - cosine;
        let slope = -(b + lean * (2.0 * c + lean * 3.0 * d));
        // On the surface itself nothing is seen of it.
        if above == 0.0 {
            1.0
        } else {
            1.0 + slope * cosine * (1.0 - cosine * cosine) / above
        }
    }

    /// The cosine of the line from a place to a point `across` beside it and `height` above the plane; None if there is none.
    fn aim(&self, across: f64, height: f64) -> Option<f64> {
        let cosine_of = |slope: f64| 1.0 / (1.0 + slope * slope).sqrt();
        let mut slope = across / (height - self.at(1.0));
        for _ in 0..AIM_STEPS {
            let cosine = cosine_of(slope);
            let above = height - self.at(cosine);
            let step = (across - above * slope) / (above * self.stretch(cosine, above));
            slope += step;
            if !(slope >= 0.0 && above > 0.0) {
                return None;
            }
            if step.abs() <= 1e-14 * (1.0 + slope) {
                return Some(cosine_of(slope));
            }
        }
        None
    }

    /// The lowest and the highest of the heights, over all directions.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let [_, b, c, d] = self.0;
        // Where the slope b + 2 c l + 3 d l² over the lean l is zero, without cancellation.
        let root = (c * c - 3.0 * b * d).max(0.0).sqrt();
        let sum = -(c + root.copysign(c));
        [1.0, 0.0, 1.0 - sum / (3.0 * d), 1.0 - b / sum]
            .into_iter()
            .filter(|cosine| (0.0..=1.0).contains(cosine))
            .map(|cosine| self.at(cosine))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
                [low.min(z), high.max(z)]
            })
    }

    /// The largest height of a place above or below the plane.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.0.iter().map(|f| f.abs()).sum()
    }
}

/// Newton steps towards the direction in which a place is seen: a handful suffice where the depth changes little.
const AIM_STEPS: usize = 32;

/// The shape of a part in its frame; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// About the plane z = 0, centred, emitting towards +z.
    Rectangle {
        /// Along x.
        width: f64,
        /// Along y.
        height: f64,
        /// Height above the plane at which the place of a line is taken, by its direction.
        focus: Focus,
    },
    /// In the plane z = 0, centred, emitting towards +z.
    Disk {
        /// Radius of the disk.
        radius: f64,
    },
    /// The half z ≥ 0 of a sphere about the origin, emitting outwards.
    Hemisphere {
        /// Radius of the sphere.
        radius: f64,
    },
    /// The side of a cylinder about the z axis, centred, emitting outwards.
    Tube {
        /// Radius of the cylinder.
        radius: f64,
        /// Along z.
        height: f64,
    },
}

/// One chart of a carrier surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarrierPart {
    /// Where the part stands.
    pub frame: Frame,
    /// What it is.
    pub shape: Shape,
}

/// Where a line leaves a part: place and direction, each coordinate from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Departure {
    /// Whether the line leaves the part at all; the rest means nothing if not.
    pub met: bool,
    /// Chart coordinates (s₁, s₂).
    pub place: [f64; 2],
    /// Concentric coordinates (a, b) of the local direction cosines.
    pub direction: [f64; 2],
}

/// A line crosses the part outwards at local point `n` of normal direction; p and q are its local direction cosines.
#[inline(always)]
fn departure(inside: bool, place: (f64, f64), p: f64, q: f64) -> Departure {
    let (s1, s2) = place;
    let (a, b) = disk_to_square(p, q);
    let met = inside & (0.0..=1.0).contains(&s1) & (0.0..=1.0).contains(&s2);
    // Rounding may carry a grazing direction out of the square by some 1e-16.
    Departure {
        met,
        place: [s1, s2],
        direction: [a.clamp(0.0, 1.0), b.clamp(0.0, 1.0)],
    }
}

#[inline(always)]
fn cross_rectangle(width: f64, height: f64, focus: Focus, o: Vec3, d: Vec3) -> Departure {
    let t = (focus.at(d.z) - o.z) / d.z;
    let place = ((o.x + t * d.x) / width + 0.5, (o.y + t * d.y) / height + 0.5);
    departure(d.z > 0.0, place, d.x, d.y)
}

#[inline(always)]
fn cross_disk(radius: f64, o: Vec3, d: Vec3) -> Departure {
    let t = -o.z / d.z;
    let (x, y) = ((o.x + t * d.x) / radius, (o.y + t * d.y) / radius);
    departure(
        (d.z > 0.0) & (x * x + y * y <= 1.0),
        clamped(disk_to_square(x, y)),
        d.x,
        d.y,
    )
}

/// Points on the rim of a disk may come out of its square by rounding.
#[inline(always)]
fn clamped((u, v): (f64, f64)) -> (f64, f64) {
    (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}

#[inline(always)]
fn cross_hemisphere(radius: f64, o: Vec3, d: Vec3) -> Departure {
    // From the point nearest the centre, so that a start point far away costs no digits.
    let near = o + d * -o.dot(d);
    let half_chord = radius * radius - near.dot(near);
    let n = (near + d * half_chord.max(0.0).sqrt()) * (1.0 / radius);
    let lift = 1.0 / (1.0 + n.z.max(0.0));
    let azimuthal = lift.sqrt();
    // Local axes: x and y turned by the shortest rotation that takes +z to the normal.
    let shear = (d.x * n.x + d.y * n.y) * lift + d.z;
    let inside = (half_chord > 0.0) & (n.z >= 0.0);
    let place = clamped(disk_to_square(n.x * azimuthal, n.y * azimuthal));
    departure(inside, place, d.x - n.x * shear, d.y - n.y * shear)
}

#[inline(always)]
fn cross_tube(radius: f64, height: f64, o: Vec3, d: Vec3) -> Departure {
    let across = d.x * d.x + d.y * d.y;
    let t = -(o.x * d.x + o.y * d.y) / across;
    let (x, y) = (o.x + t * d.x, o.y + t * d.y);
    let half_chord = (radius * radius - (x * x + y * y)) / across;
    let t_out = t + half_chord.max(0.0).sqrt();
    let (x, y) = ((o.x + t_out * d.x) / radius, (o.y + t_out * d.y) / radius);
    let z = o.z + t_out * d.z;
    let inside = (across > 0.0) & (half_chord > 0.0);
    departure(inside, (turns(x, y), z / height + 0.5), d.y * x - d.x * y, d.z)
}

/// Azimuth of (x, y) as a fraction of a turn from −x over −y, +x and +y: the seam lies at −x.
#[inline(always)]
fn turns(x: f64, y: f64) -> f64 {
    let wide = x.abs() > y.abs();
    let (along, across) = if wide { (x, y) } else { (y, x) };
    let slope = if along == 0.0 { 0.0 } else { across / along };
    let eighth = 0.125 * etendue_math::trig::atan_eighths(slope);
    let from_x = if wide {
        let back = if y < 0.0 { -0.5 } else { 0.5 };
        eighth + if x < 0.0 { back } else { 0.0 }
    } else {
        let quarter = if y < 0.0 { -0.25 } else { 0.25 };
        quarter - eighth
    };
    (from_x + 0.5).clamp(0.0, 1.0)
}

impl CarrierPart {
    /// Area \[mm²\].
    #[must_use]
    pub fn area(&self) -> f64 {
        use std::f64::consts::PI;
        match self.shape {
            Shape::Rectangle { width, height, .. } => width * height,
            Shape::Disk { radius } => PI * radius * radius,
            Shape::Hemisphere { radius } => 2.0 * PI * radius * radius,
            Shape::Tube { radius, height } => 2.0 * PI * radius * height,
        }
    }

    /// Largest distance of a place of the part from the origin of its frame \[mm\]. Where the depth of places changes with
    /// direction, lines near the horizon may cross the plane farther out.
    #[must_use]
    pub fn reach(&self) -> f64 {
        match self.shape {
            Shape::Rectangle { width, height, focus } => (0.5 * width.hypot(height)).hypot(focus.reach()),
            Shape::Disk { radius } | Shape::Hemisphere { radius } => radius,
            Shape::Tube { radius, height } => radius.hypot(0.5 * height),
        }
    }

    /// The corners of a box along the axes of the part's frame that holds all its places: those of low x first, as
    /// [`Bounds::corners`](etendue_geometry::bounds::Bounds::corners) has them.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        let (x, y, [low, high]) = match self.shape {
            Shape::Rectangle { width, height, focus } => (0.5 * width, 0.5 * height, focus.range()),
            Shape::Disk { radius } => (radius, radius, [0.0; 2]),
            Shape::Hemisphere { radius } => (radius, radius, [0.0, radius]),
            Shape::Tube { radius, height } => (radius, radius, [-0.5 * height, 0.5 * height]),
        };
        std::array::from_fn(|i| {
            let side = |bit: usize, length: f64| if i & bit == 0 { -length } else { length };
            let z = if i & 1 == 0 { low } else { high };
            self.frame.point_to_world(Vec3::new(side(4, x), side(2, y), z))
        })
    }

    /// Étendue \[mm² sr\] of all light that can leave the part: π times its area.
    #[must_use]
    pub fn etendue(&self) -> f64 {
        std::f64::consts::PI * self.area()
    }

    /// Whether the first coordinate closes upon itself.
    #[must_use]
    pub const fn wraps(&self) -> bool {
        matches!(self.shape, Shape::Tube { .. })
    }

    /// A point of the line that leaves the part at the place of this point and normal under this cosine.
    #[must_use]
    pub fn leaving(&self, point: Vec3, normal: Vec3, cosine: f64) -> Vec3 {
        match self.shape {
            Shape::Rectangle { focus, .. } => point + normal * focus.at(cosine),
            _ => point,
        }
    }

    /// Where the line that leaves at a place and goes to `p` leaves the part, and the cosine by which the area of its place is
    /// seen from `p`; None if there is no such line.
    ///
    /// The cosine holds the change of depth with direction, so that cosine · area / distance² is the solid angle.
    #[must_use]
    pub fn seen_from(&self, place: [f64; 2], p: Vec3) -> Option<(Vec3, f64)> {
        let (point, normal) = self.ray(place, [0.5, 0.5]);
        let away = p - point;
        match self.shape {
            Shape::Rectangle { focus, .. } if focus != Focus::default() => {
                let height = away.dot(normal);
                let across = away - normal * away.dot(normal);
                let cosine = focus.aim(across.length(), height)?;
                let seen = focus.seen(cosine, height);
                let sharp = point + normal * focus.at(cosine);
                let k = (p - sharp).normalized();
                (seen > 0.0 && height > 0.0).then_some((p - k * (height / cosine), seen))
            }
            _ => {
                let cosine = away.dot(normal) / away.length();
                (cosine > 0.0).then_some((point, cosine))
            }
        }
    }

    /// Where the line through `position` along `direction` leaves the part.
    #[inline]
    #[must_use]
    pub fn cross(&self, position: Vec3, direction: Vec3) -> Departure {
        let (o, d) = self.localise(position, direction);
        match self.shape {
            Shape::Rectangle { width, height, focus } => cross_rectangle(width, height, focus, o, d),
            Shape::Disk { radius } => cross_disk(radius, o, d),
            Shape::Hemisphere { radius } => cross_hemisphere(radius, o, d),
            Shape::Tube { radius, height } => cross_tube(radius, height, o, d),
        }
    }

    /// A line in the coordinates of the part.
    #[inline(always)]
    pub(crate) fn localise(&self, position: Vec3, direction: Vec3) -> (Vec3, Vec3) {
        (
            self.frame.point_to_local(position),
            self.frame.direction_to_local(direction),
        )
    }

    /// The point at chart coordinates (s₁, s₂), and the direction at (a, b) there: the inverse of [`Self::cross`].
    #[must_use]
    pub fn ray(&self, place: [f64; 2], direction: [f64; 2]) -> (Vec3, Vec3) {
        let [s1, s2] = place;
        let (p, q) = square_to_disk(direction[0], direction[1]);
        let up = (1.0 - p * p - q * q).max(0.0).sqrt();
        let (point, k) = match self.shape {
            Shape::Rectangle { width, height, focus } => {
                let k = Vec3::new(p, q, up);
                let sharp = Vec3::new((s1 - 0.5) * width, (s2 - 0.5) * height, focus.at(up));
                // Along the horizon nothing meets the plane.
                let back = if up > 0.0 { sharp.z / up } else { 0.0 };
                (sharp - k * back, k)
            }
            Shape::Disk { radius } => {
                let (x, y) = square_to_disk(s1, s2);
                (Vec3::new(x * radius, y * radius, 0.0), Vec3::new(p, q, up))
            }
            Shape::Hemisphere { radius } => {
                let (x, y) = square_to_disk(s1, s2);
                let r2 = x * x + y * y;
                let scale = (2.0 - r2).max(0.0).sqrt();
                let n = Vec3::new(x * scale, y * scale, (1.0 - r2).max(0.0));
                // The shortest rotation from +z to n, applied to (p, q, up).
                let lean = (n.x * p + n.y * q) / (1.0 + n.z);
                let k = Vec3::new(p - n.x * lean, q - n.y * lean, -(n.x * p + n.y * q)) + n * up;
                (n * radius, k)
            }
            Shape::Tube { radius, height } => {
                let (sine, cosine) = etendue_math::trig::sin_cos_turns(s1);
                // The seam lies at −x: azimuth is s₁ turns from there.
                let (nx, ny) = (-cosine, -sine);
                let k = Vec3::new(nx * up - ny * p, ny * up + nx * p, q);
                (Vec3::new(nx * radius, ny * radius, (s2 - 0.5) * height), k)
            }
        };
        (self.frame.point_to_world(point), self.frame.direction_to_world(k))
    }
}

/// The étendue coordinates of a block of rays: a structure of arrays of length [`BLOCK`].
#[derive(Clone, Debug)]
pub struct Coordinates {
    /// The part each ray belongs to, or [`Coordinates::NONE`].
    pub part: Vec<u32>,
    /// s₁, s₂, a, b.
    pub values: [Vec<f64>; 4],
}

impl Coordinates {
    /// The part of a ray that no part meets.
    pub const NONE: u32 = u32::MAX;
}

impl Default for Coordinates {
    fn default() -> Self {
        Self {
            part: vec![Self::NONE; BLOCK],
            values: std::array::from_fn(|_| vec![0.0; BLOCK]),
        }
    }
}

/// Finds for each ray of the block the first part that its line leaves, with the coordinates there.
pub fn carry(parts: &[CarrierPart], batch: &RayBatch, out: &mut Coordinates) {
    let n = batch.len;
    out.part[..n].fill(Coordinates::NONE);
    for (index, part) in (0_u32..).zip(parts) {
        match part.shape {
            Shape::Rectangle { width, height, focus } => {
                carry_rectangle(part, (width, height), focus, index, batch, out);
            }
            Shape::Disk { radius } => carry_disk(part, radius, index, batch, out),
            Shape::Hemisphere { radius } => carry_hemisphere(part, radius, index, batch, out),
            Shape::Tube { radius, height } => carry_tube(part, (radius, height), index, batch, out),
        }
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn carry_rectangle(
    part: &CarrierPart,
    size: (f64, f64),
    focus: Focus,
    index: u32,
    batch: &RayBatch,
    out: &mut Coordinates,
) {
    carry_part(
        part,
        |o, d| cross_rectangle(size.0, size.1, focus, o, d),
        index,
        batch,
        out,
    );
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn carry_disk(part: &CarrierPart, radius: f64, index: u32, batch: &RayBatch, out: &mut Coordinates) {
    carry_part(part, |o, d| cross_disk(radius, o, d), index, batch, out);
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn carry_hemisphere(part: &CarrierPart, radius: f64, index: u32, batch: &RayBatch, out: &mut Coordinates) {
    carry_part(part, |o, d| cross_hemisphere(radius, o, d), index, batch, out);
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn carry_tube(part: &CarrierPart, size: (f64, f64), index: u32, batch: &RayBatch, out: &mut Coordinates) {
    carry_part(part, |o, d| cross_tube(size.0, size.1, o, d), index, batch, out);
}

/// The loop that is compiled once per shape and instruction set. A ray that has its part already keeps it.
#[inline(always)]
fn carry_part(
    part: &CarrierPart,
    cross: impl Fn(Vec3, Vec3) -> Departure,
    index: u32,
    batch: &RayBatch,
    out: &mut Coordinates,
) {
    let n = batch.len;
    let [px, py, pz] = batch.position.each_ref().map(|v| &v[..n]);
    let [kx, ky, kz] = batch.direction.each_ref().map(|v| &v[..n]);
    let owner = &mut out.part[..n];
    let [s1, s2, a, b] = out.values.each_mut().map(|v| &mut v[..n]);
    for i in 0..n {
        let (o, d) = part.localise(Vec3::new(px[i], py[i], pz[i]), Vec3::new(kx[i], ky[i], kz[i]));
        let found = cross(o, d);
        let take = found.met & (owner[i] == Coordinates::NONE);
        owner[i] = if take { index } else { owner[i] };
        s1[i] = if take { found.place[0] } else { s1[i] };
        s2[i] = if take { found.place[1] } else { s2[i] };
        a[i] = if take { found.direction[0] } else { a[i] };
        b[i] = if take { found.direction[1] } else { b[i] };
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// One part of each shape, moved and turned, none in a special position.
    pub(crate) fn zoo() -> Vec<CarrierPart> {
        let frame = Frame {
            origin: Vec3::new(0.3, -0.2, 0.7),
            x: Vec3::new(0.36, 0.48, -0.8),
            y: Vec3::new(-0.8, 0.6, 0.0),
            z: Vec3::new(0.48, 0.64, 0.6),
        };
        [
            Shape::Rectangle {
                width: 2.5,
                height: 1.5,
                focus: Focus::default(),
            },
            Shape::Disk { radius: 1.3 },
            Shape::Hemisphere { radius: 1.7 },
            Shape::Tube {
                radius: 0.8,
                height: 2.2,
            },
            Shape::Rectangle {
                width: 2.5,
                height: 1.5,
                focus: Focus([-0.1, 0.3, -0.2, 0.15]),
            },
        ]
        .map(|shape| CarrierPart { frame, shape })
        .to_vec()
    }

    /// Coordinates that fill the cube evenly.
    pub(crate) fn lattice(n: u32) -> impl Iterator<Item = [f64; 4]> {
        (0..n).map(|i| [0.856_675, 0.733_892, 0.628_707, 0.538_597].map(|g: f64| (0.5 + f64::from(i) * g).fract()))
    }

    #[test]
    fn coordinates_and_rays_are_inverse_wherever_the_ray_starts() {
        for part in zoo() {
            for [s1, s2, a, b] in lattice(5000) {
                let (x, k) = part.ray([s1, s2], [a, b]);
                assert!((k.length() - 1.0).abs() < 1e-14);
                for along in [0.0, 3.0, -700.0] {
                    let c = part.cross(x + k * along, k);
                    let tolerance = 1e-13 * (1.0 + along.abs());
                    // Near the horizon the crossing of a curved part is a square root away from the line.
                    let grazing = 1.0 / (1e-6 + (1.0 - (2.0 * a - 1.0).abs().max((2.0 * b - 1.0).abs())));
                    assert!(c.met, "{part:?} {s1} {s2} {a} {b}");
                    for (found, given) in c.place.iter().chain(&c.direction).zip([s1, s2, a, b]) {
                        assert!(
                            (found - given).abs() < tolerance * grazing.min(1e4),
                            "{part:?} {found} {given}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn places_are_seen_where_their_lines_leave_and_under_their_solid_angle() {
        // The solid angle of a small square of places, by the directions to its corners, against cosine · area / distance².
        for part in zoo() {
            let mut seen = 0;
            for [s1, s2, a, b] in lattice(500) {
                let place = [0.05 + 0.9 * s1, 0.05 + 0.9 * s2];
                if ((2.0 * place[0] - 1.0).abs() - (2.0 * place[1] - 1.0).abs()).abs() < 1e-3 {
                    continue; // a kink of the concentric map
                }
                let (middle, normal) = part.ray(place, [0.5, 0.5]);
                let (x, k) = part.ray([0.5, 0.5], [a, b]);
                let p = x + k * 7.0;
                let Some((point, cosine)) = part.seen_from(place, p) else {
                    continue;
                };
                let away = p - point;
                let distance = away.length();
                let k = away * (1.0 / distance); // whose length the solid angle counts from the plane
                let crossing = part.cross(p, k);
                if !crossing.met || k.dot(normal) < 0.05 {
                    continue; // another side of a curved part, or seen edge-on
                }
                seen += 1;
                let left = part.leaving(middle, normal, k.dot(normal));
                let beside = (left - point) - k * (left - point).dot(k);
                assert!(beside.length() < 1e-12);
                for (found, given) in crossing.place.iter().zip(place) {
                    assert!((found - given).abs() < 1e-9, "{part:?} {found} {given}");
                }
                let step = 1e-5;
                let towards = |u: f64, v: f64| {
                    let point = part
                        .seen_from([place[0] + u * step, place[1] + v * step], p)
                        .expect("near")
                        .0;
                    (p - point).normalized()
                };
                let (du, dv) = (
                    towards(1.0, 0.0) - towards(-1.0, 0.0),
                    towards(0.0, 1.0) - towards(0.0, -1.0),
                );
                let angle = du.cross(dv).length() / (4.0 * step * step);
                let expected = cosine * part.area() / (distance * distance);
                assert!((angle / expected - 1.0).abs() < 1e-4, "{part:?} {angle} {expected}");
            }
            assert!(seen > 100, "{part:?} {seen}");
        }
    }

    #[test]
    fn a_line_leaves_where_it_crosses() {
        for part in zoo() {
            let mut missed = 0;
            for [s1, s2, a, b] in lattice(5000) {
                let (x, k) = part.ray([s1, s2], [a, b]);
                let normal = part.ray([s1, s2], [0.5, 0.5]).1;
                for along in [0.0, 3.0, -700.0] {
                    let (t, cosine) = part.leaves(x + k * along, k).expect("it was made to");
                    // The same square root as above.
                    let error = 1e-12 * (1.0 + along.abs()) / cosine.max(1e-6);
                    assert!((t + along).abs() < error, "{part:?} {t} {along}");
                    let focused = matches!(part.shape, Shape::Rectangle { focus, .. } if focus != Focus::default());
                    let expected = match focused {
                        false => normal.dot(k),
                        true if along > 0.0 && normal.dot(k) > 0.3 => {
                            part.seen_from([s1, s2], x + k * along).expect("far enough").1
                        }
                        true => cosine, // nothing is seen from behind, or a place in several directions
                    };
                    assert!((cosine - expected).abs() < error, "{part:?} {cosine}");
                }
                // Lines beside it: the two agree on which are met.
                let aside = x + Vec3::new(s1 - 0.4, b - 0.5, a - 0.3) * 60.0;
                assert_eq!(part.leaves(aside, k).is_some(), part.cross(aside, k).met);
                missed += usize::from(!part.cross(aside, k).met);
            }
            assert!(missed > 500, "{part:?} {missed}");
        }
    }

    #[test]
    fn equal_volumes_are_equal_etendues() {
        // |∂(x, y)/∂(s₁, s₂)| on the surface is its area everywhere; central differences.
        let h = 1e-6;
        for part in zoo() {
            for [s1, s2, a, b] in lattice(300) {
                let near_kink = |u: f64, v: f64| ((2.0 * u - 1.0).abs() - (2.0 * v - 1.0).abs()).abs() < 1e-4;
                let margin = |u: f64| u.min(1.0 - u) < 1e-4;
                if near_kink(s1, s2) || near_kink(a, b) || [s1, s2, a, b].into_iter().any(margin) {
                    continue;
                }
                let point = |u, v| part.ray([u, v], [a, b]).0;
                let d1 = (point(s1 + h, s2) - point(s1 - h, s2)) * (0.5 / h);
                let d2 = (point(s1, s2 + h) - point(s1, s2 - h)) * (0.5 / h);
                assert!((d1.cross(d2).length() / part.area() - 1.0).abs() < 1e-5, "{part:?}");
                // Solid angle times cosine: |∂k/∂a × ∂k/∂b| cos = π.
                let k = |u, v| part.ray([s1, s2], [u, v]).1;
                let normal = part.ray([s1, s2], [0.5, 0.5]).1;
                let (e1, e2) = (k(a + h, b) - k(a - h, b), k(a, b + h) - k(a, b - h));
                let projected = (e1.cross(e2) * (0.25 / (h * h))).dot(normal).abs();
                assert!((projected / std::f64::consts::PI - 1.0).abs() < 1e-5, "{part:?}");
            }
        }
    }

    #[test]
    fn a_ray_belongs_to_the_first_part_it_leaves_and_never_to_one_it_enters() {
        let flat = Frame {
            origin: Vec3::default(),
            x: Vec3::new(1.0, 0.0, 0.0),
            y: Vec3::new(0.0, 1.0, 0.0),
            z: Vec3::new(0.0, 0.0, 1.0),
        };
        let dome = [Shape::Disk { radius: 1.0 }, Shape::Hemisphere { radius: 1.0 }]
            .map(|shape| CarrierPart { frame: flat, shape });
        let rays = [
            ([0.2, 0.1, 5.0], [0.0, 0.0, 1.0], 0),
            ([-2.0, 0.0, 0.5], [1.0, 0.0, 0.0], 1),
            ([0.0, 0.0, 0.5], [0.0, 0.6, -0.8], Coordinates::NONE),
            ([3.0, 0.0, 0.0], [0.0, 0.0, 1.0], Coordinates::NONE),
        ];
        let mut batch = RayBatch {
            len: rays.len(),
            ..RayBatch::default()
        };
        for (i, (x, k, _)) in rays.iter().enumerate() {
            for axis in 0..3 {
                batch.position[axis][i] = x[axis];
                batch.direction[axis][i] = k[axis];
            }
        }
        let mut out = Coordinates::default();
        carry(&dome, &batch, &mut out);
        for (i, (_, _, part)) in rays.iter().enumerate() {
            assert_eq!(out.part[i], *part, "ray {i}");
        }
    }

    #[test]
    fn blocks_have_the_bits_of_single_rays() {
        for part in zoo() {
            let mut batch = RayBatch {
                len: 999,
                ..RayBatch::default()
            };
            for (i, c) in lattice(999).enumerate() {
                let (x, k) = part.ray([c[0], c[1]], [c[2], c[3]]);
                for (axis, (p, d)) in [(x.x, k.x), (x.y, k.y), (x.z, k.z)].into_iter().enumerate() {
                    batch.position[axis][i] = p;
                    batch.direction[axis][i] = d;
                }
            }
            let mut out = Coordinates::default();
            carry(&[part], &batch, &mut out);
            for i in 0..999 {
                let c = part.cross(batch.position(i), batch.direction(i));
                assert_eq!(c.met, out.part[i] == 0);
                let block = out.values.each_ref().map(|v| v[i].to_bits());
                assert_eq!(
                    block,
                    [c.place[0], c.place[1], c.direction[0], c.direction[1]].map(f64::to_bits)
                );
            }
        }
    }
}
