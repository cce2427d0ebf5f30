//! How far away a line leaves a part of a carrier surface, without chart coordinates: for lines that mostly miss it.

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::surface::{CarrierPart, Focus, Shape};

/// Distance along a line at which it leaves a part, and the cosine under which the part's area is seen from where the line
/// begins; the distance is NaN if it does not leave it.
type Left = (f64, f64);

/// A part as lines leave it, in its own coordinates.
trait Leave {
    fn leave(&self, o: Vec3, d: Vec3) -> Left;
}

#[inline(always)]
fn left(met: bool, t: f64, cosine: f64) -> Left {
    (if met { t } else { f64::NAN }, cosine)
}

struct Rectangle {
    width: f64,
    height: f64,
    focus: Focus,
}

impl Leave for Rectangle {
    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let t = -o.z / d.z;
        let there = t + self.focus.at(d.z) / d.z;
        let (x, y) = (
            (o.x + there * d.x) / self.width + 0.5,
            (o.y + there * d.y) / self.height + 0.5,
        );
        let inside = (0.0..=1.0).contains(&x) & (0.0..=1.0).contains(&y);
        left((d.z > 0.0) & inside, t, self.focus.seen(d.z, o.z))
    }
}

struct Disk {
    radius: f64,
}

impl Leave for Disk {
    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let t = -o.z / d.z;
        let (x, y) = ((o.x + t * d.x) / self.radius, (o.y + t * d.y) / self.radius);
        left((d.z > 0.0) & (x * x + y * y <= 1.0), t, d.z)
    }
}

struct Hemisphere {
    radius: f64,
}

impl Leave for Hemisphere {
    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let middle = -o.dot(d);
        let near = o + d * middle;
        let half_chord = self.radius * self.radius - near.dot(near);
        let half = half_chord.max(0.0).sqrt();
        let met = (half_chord > 0.0) & (near.z + d.z * half >= 0.0);
        left(met, middle + half, half / self.radius)
    }
}

struct Tube {
    radius: f64,
    height: f64,
}

impl Leave for Tube {
    #[inline(always)]
    fn leave(&self, o: Vec3, d: Vec3) -> Left {
        let across = d.x * d.x + d.y * d.y;
        let middle = -(o.x * d.x + o.y * d.y) / across;
        let (x, y) = (o.x + middle * d.x, o.y + middle * d.y);
        let half_chord = (self.radius * self.radius - (x * x + y * y)) / across;
        let half = half_chord.max(0.0).sqrt();
        let t = middle + half;
        let z = (o.z + t * d.z) / self.height + 0.5;
        let met = (across > 0.0) & (half_chord > 0.0) & (0.0..=1.0).contains(&z);
        left(met, t, half * across / self.radius)
    }
}

/// Start points and unit directions of lines in the world, one array per axis, and how far each of them goes.
#[derive(Clone, Copy, Debug)]
pub struct Sights<'a> {
    /// \[mm\].
    pub origin: [&'a [f64]; 3],
    /// Away from the start point, against the light.
    pub direction: [&'a [f64]; 3],
    /// \[mm\].
    pub reach: &'a [f64],
}

impl Sights<'_> {
    /// Start point and direction of one of them.
    #[inline(always)]
    #[must_use]
    pub fn line(&self, i: usize) -> (Vec3, Vec3) {
        let [o, d] = [self.origin, self.direction].map(|lists| Vec3::new(lists[0][i], lists[1][i], lists[2][i]));
        (o, d)
    }
}

/// Where the lines of a block leave a part: what [`CarrierPart::leaves`] finds for each, NaN for those that do not.
#[derive(Clone, Debug)]
pub struct Departures {
    /// How far along each line \[mm\].
    pub distance: Vec<f64>,
    /// Under which the area is seen from where the line begins.
    pub cosine: Vec<f64>,
}

impl Default for Departures {
    fn default() -> Self {
        Self {
            distance: vec![0.0; BLOCK],
            cosine: vec![0.0; BLOCK],
        }
    }
}

impl CarrierPart {
    /// How far from `position` the line along `direction` leaves the part, and the cosine under which its area is seen from
    /// there: that of the angle with the normal, and where the depth changes with direction what makes
    /// cosine · area / distance² the solid angle. None if it does not.
    #[inline]
    #[must_use]
    pub fn leaves(&self, position: Vec3, direction: Vec3) -> Option<(f64, f64)> {
        let (o, d) = self.localise(position, direction);
        let (t, cosine) = match self.shape {
            Shape::Rectangle { width, height, focus } => Rectangle { width, height, focus }.leave(o, d),
            Shape::Disk { radius } => Disk { radius }.leave(o, d),
            Shape::Hemisphere { radius } => Hemisphere { radius }.leave(o, d),
            Shape::Tube { radius, height } => Tube { radius, height }.leave(o, d),
        };
        (!t.is_nan()).then_some((t, cosine))
    }

    /// Where each line of a block leaves the part.
    pub fn depart(&self, batch: &RayBatch, out: &mut Departures) {
        match self.shape {
            Shape::Rectangle { width, height, focus } => {
                depart(&Rectangle { width, height, focus }, self, batch, out);
            }
            Shape::Disk { radius } => depart(&Disk { radius }, self, batch, out),
            Shape::Hemisphere { radius } => depart(&Hemisphere { radius }, self, batch, out),
            Shape::Tube { radius, height } => depart(&Tube { radius, height }, self, batch, out),
        }
    }

    /// Marks the lines of sight that meet the part's emitting side at 0 < t ≤ `reach`, the part standing in `frame`; others
    /// keep their marks. Rounding may decide otherwise than [`CarrierPart::leaves`] at the very rim.
    pub fn mark(&self, frame: &Frame, sights: Sights<'_>, marks: &mut [bool]) {
        let own = &self.frame;
        let placed = Frame {
            origin: frame.point_to_world(own.origin),
            x: frame.direction_to_world(own.x),
            y: frame.direction_to_world(own.y),
            z: frame.direction_to_world(own.z),
        };
        match self.shape {
            Shape::Rectangle { width, height, focus } => {
                mark(&Rectangle { width, height, focus }, &placed, sights, marks);
            }
            Shape::Disk { radius } => mark(&Disk { radius }, &placed, sights, marks),
            Shape::Hemisphere { radius } => mark(&Hemisphere { radius }, &placed, sights, marks),
            Shape::Tube { radius, height } => mark(&Tube { radius, height }, &placed, sights, marks),
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn depart<L: Leave>(leave: &L, part: &CarrierPart, batch: &RayBatch, out: &mut Departures) {
    let n = batch.len;
    let [px, py, pz] = batch.position.each_ref().map(|v| &v[..n]);
    let [kx, ky, kz] = batch.direction.each_ref().map(|v| &v[..n]);
    let (distance, cosine) = (&mut out.distance[..n], &mut out.cosine[..n]);
    for i in 0..n {
        let (o, d) = part.localise(Vec3::new(px[i], py[i], pz[i]), Vec3::new(kx[i], ky[i], kz[i]));
        (distance[i], cosine[i]) = leave.leave(o, d);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark<L: Leave>(part: &L, frame: &Frame, sights: Sights<'_>, marks: &mut [bool]) {
    let n = marks.len();
    let [ox, oy, oz] = sights.origin.map(|v| &v[..n]);
    let [dx, dy, dz] = sights.direction.map(|v| &v[..n]);
    let reach = &sights.reach[..n];
    for i in 0..n {
        let o = frame.point_to_local(Vec3::new(ox[i], oy[i], oz[i]));
        let d = frame.direction_to_local(Vec3::new(dx[i], dy[i], dz[i]));
        // Light goes the other way.
        let (back, _) = part.leave(o, -d);
        marks[i] |= (back < 0.0) & (-back <= reach[i]);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::surface::tests::{lattice, zoo};

    /// Lines of sight about a part.
    pub(crate) struct SomeSights {
        pub(crate) frame: Frame,
        origin: [Vec<f64>; 3],
        direction: [Vec<f64>; 3],
        reach: Vec<f64>,
    }

    impl SomeSights {
        /// From before the part, from behind it, and past it, with a reach that is enough or not.
        pub(crate) fn about(part: &CarrierPart, n: u32) -> Self {
            let mut sights = Self {
                frame: Frame {
                    origin: Vec3::new(-3.0, 2.0, 1.0),
                    x: Vec3::new(0.0, 0.6, 0.8),
                    y: Vec3::new(1.0, 0.0, 0.0),
                    z: Vec3::new(0.0, 0.8, -0.6),
                },
                origin: Default::default(),
                direction: Default::default(),
                reach: Vec::new(),
            };
            for (i, [s1, s2, a, b]) in lattice(n).enumerate() {
                let (x, k) = part.ray([s1, s2], [a, b]);
                let (aside, away) = ([0.0, 0.0, 4.0][i % 3], [5.0, 5.0, -5.0][i % 3]);
                let o = sights.frame.point_to_world(x + k * away + Vec3::new(aside, 0.0, 0.0));
                let d = -sights.frame.direction_to_world(k);
                for (lists, v) in [(&mut sights.origin, o), (&mut sights.direction, d)] {
                    for (list, x) in lists.iter_mut().zip([v.x, v.y, v.z]) {
                        list.push(x);
                    }
                }
                sights.reach.push(if i % 2 == 0 { 5.5 } else { 4.5 });
            }
            sights
        }

        pub(crate) fn sights(&self) -> Sights<'_> {
            Sights {
                origin: self.origin.each_ref().map(Vec::as_slice),
                direction: self.direction.each_ref().map(Vec::as_slice),
                reach: &self.reach,
            }
        }
    }

    #[test]
    fn lines_of_sight_are_marked_where_they_are_left() {
        for part in zoo() {
            let some = SomeSights::about(&part, 4000);
            let (sights, frame) = (some.sights(), some.frame);
            let expected = (0..4000).map(|i| {
                let (o, d) = sights.line(i);
                let left = part.leaves(frame.point_to_local(o), -frame.direction_to_local(d));
                left.is_some_and(|(back, _)| back < 0.0 && -back <= sights.reach[i])
            });
            let mut marks = vec![false; sights.reach.len()];
            part.mark(&frame, sights, &mut marks);
            assert_eq!(marks, expected.collect::<Vec<bool>>());
            let met = marks.iter().filter(|m| **m).count();
            assert!(met > 500 && met < 2500, "{part:?}: {met}");
        }
    }
}
