//! What many lines of sight see of a light field: its parts are read at all of them together.

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::heads::heads_mut;
use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use super::light_field::{PartField, Reading};
use super::points::Points;
use crate::carrier::{Coordinates, carry};
use crate::carrier::{Departures, Sights};

/// What a line of sight sees of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightReading {
    /// Distance along the line \[mm\].
    pub t: f64,
    /// The cosine under which the area is seen (see [`CarrierPart::leaves`](crate::carrier::CarrierPart::leaves)).
    pub cosine: f64,
    /// The place on the part's chart.
    pub place: [f64; 2],
    /// The luminance.
    pub reading: Reading,
}

/// Room to read in: it would take a while to make it anew.
#[derive(Default)]
pub struct SightReader {
    batch: RayBatch,
    left: Departures,
    at: Coordinates,
    points: Points,
}

impl SightReader {
    /// Calls `visit` with the number of each of some lines of sight that see a part, which stands in `frame`, no farther away
    /// than they reach, and with what it sees: to the bit what each line finds by itself.
    pub fn read(
        &mut self,
        part: &PartField,
        frame: &Frame,
        sights: Sights<'_>,
        which: &[u32],
        mut visit: impl FnMut(usize, SightReading),
    ) {
        for which in which.chunks(BLOCK) {
            let Self {
                batch,
                left,
                at,
                points,
            } = self;
            batch.len = which.len();
            for (axis, from) in sights.origin.into_iter().enumerate() {
                gather(&mut batch.position[axis], from, which);
                gather(&mut batch.direction[axis], sights.direction[axis], which);
            }
            turn_back(frame, batch);
            part.part.depart(batch, left);
            carry(std::slice::from_ref(&part.part), batch, at);
            points.read(part, at, which.len());
            for (k, i) in which.iter().enumerate() {
                let (back, i) = (left.distance[k], *i as usize);
                if at.part[k] == Coordinates::NONE || !(-sights.reach[i]..0.0).contains(&back) {
                    continue;
                }
                let seen = SightReading {
                    t: -back,
                    cosine: left.cosine[k],
                    place: [at.values[0][k], at.values[1][k]],
                    reading: points.reading(k),
                };
                visit(i, seen);
            }
        }
    }
}

/// Some entries of a list.
fn gather(into: &mut [f64], from: &[f64], which: &[u32]) {
    for (x, i) in into.iter_mut().zip(which) {
        *x = from[*i as usize];
    }
}

/// Lines of sight as the light goes, in the coordinates of a frame.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn turn_back(frame: &Frame, lines: &mut RayBatch) {
    let n = lines.len;
    let [px, py, pz] = heads_mut(&mut lines.position, n);
    let [kx, ky, kz] = heads_mut(&mut lines.direction, n);
    for i in 0..n {
        let p = frame.point_to_local(Vec3::new(px[i], py[i], pz[i]));
        let k = -frame.direction_to_local(Vec3::new(kx[i], ky[i], kz[i]));
        (px[i], py[i], pz[i]) = (p.x, p.y, p.z);
        (kx[i], ky[i], kz[i]) = (k.x, k.y, k.z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::leave::tests::SomeSights;
    use crate::field::light_field::tests::rough;

    #[test]
    fn each_line_sees_what_it_sees_by_itself() {
        for kind in 0..4 {
            let field = rough(kind);
            let some = SomeSights::about(&field.part, 5000);
            let (sights, frame) = (some.sights(), some.frame);
            // Some of the lines, more than a block of them.
            let which: Vec<u32> = (0..5000).filter(|i| i % 7 != 2).collect();
            let mut found = Vec::new();
            SightReader::default().read(&field, &frame, sights, &which, |i, seen| found.push((i, seen)));
            let alone = which.iter().filter_map(|i| {
                let i = *i as usize;
                let (o, d) = sights.line(i);
                let (p, k) = (frame.point_to_local(o), -frame.direction_to_local(d));
                let (back, cosine) = field.part.leaves(p, k)?;
                let crossing = field.part.cross(p, k);
                (crossing.met && (-sights.reach[i]..0.0).contains(&back)).then(|| {
                    let seen = SightReading {
                        t: -back,
                        cosine,
                        place: crossing.place,
                        reading: field.at(crossing.place, crossing.direction),
                    };
                    (i, seen)
                })
            });
            let alone: Vec<_> = alone.collect();
            assert_eq!(found, alone);
            assert!(alone.len() > 500 && alone.len() < 3000, "{kind}: {}", alone.len());
        }
    }
}
