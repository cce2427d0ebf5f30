//! How far away a line leaves a part of a carrier surface, without chart coordinates: for lines that mostly miss it.

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::heads::heads;
use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use super::chart::Chart;
use super::part::{CarrierPart, Shape, of_chart};

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
        let (t, cosine) = of_chart!(self.shape, chart => chart.leave(o, d));
        (!t.is_nan()).then_some((t, cosine))
    }

    /// Where each line of a block leaves the part.
    pub fn depart(&self, batch: &RayBatch, out: &mut Departures) {
        of_chart!(self.shape, chart => depart(&chart, self, batch, out));
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
        of_chart!(self.shape, chart => mark(&chart, &placed, sights, marks));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn depart<C: Chart>(chart: &C, part: &CarrierPart, batch: &RayBatch, out: &mut Departures) {
    let n = batch.len;
    let [px, py, pz] = heads(&batch.position, n);
    let [kx, ky, kz] = heads(&batch.direction, n);
    let (distance, cosine) = (&mut out.distance[..n], &mut out.cosine[..n]);
    for i in 0..n {
        let (o, d) = part.localise(Vec3::new(px[i], py[i], pz[i]), Vec3::new(kx[i], ky[i], kz[i]));
        (distance[i], cosine[i]) = chart.leave(o, d);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn mark<C: Chart>(chart: &C, frame: &Frame, sights: Sights<'_>, marks: &mut [bool]) {
    let n = marks.len();
    let [ox, oy, oz] = heads(&sights.origin, n);
    let [dx, dy, dz] = heads(&sights.direction, n);
    let reach = &sights.reach[..n];
    for i in 0..n {
        let o = frame.point_to_local(Vec3::new(ox[i], oy[i], oz[i]));
        let d = frame.direction_to_local(Vec3::new(dx[i], dy[i], dz[i]));
        // Light goes the other way.
        let (back, _) = chart.leave(o, -d);
        marks[i] |= (back < 0.0) & (-back <= reach[i]);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::carrier::tests::{lattice, zoo};

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
