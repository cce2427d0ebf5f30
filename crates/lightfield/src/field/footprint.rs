//! Where in a picture a part of a field is seen, and the light of parts that are no larger than some pixels.
//!
//! A few points in each pixel would miss such a part, or hit it too often. Here the points lie on the part's footprint, and
//! each is counted in the pixel that it falls into: the light of the part is there wherever the edges of pixels are.

use std::collections::BTreeMap;

use etendue_geometry::RayBatch;
use etendue_geometry::ray_batch::BLOCK;
use etendue_math::Vec3;

use super::light_field::{PartField, Reading};
use super::pixel_sums::{PixelSums, lattice_error};
use super::points::Points;
use crate::carrier::{CarrierPart, Coordinates, carry};
use crate::view::View;

/// Pixels across which a part is small.
const SMALL: f64 = 2.0;

/// Points on a footprint: for each pixel of its area, the least, and the most.
const POINTS_PER_PIXEL: f64 = 256.0;
const FEWEST: f64 = 16_384.0;
const MOST: f64 = 4_194_304.0;

/// A rectangle of the picture that holds a part; in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    middle: [f64; 2],
    /// Unit vector along the first side.
    along: [f64; 2],
    sides: [f64; 2],
}

impl Footprint {
    /// Where a part is seen; None if it is not as a whole before the observer.
    #[must_use]
    pub fn of(part: &CarrierPart, view: &View) -> Option<Self> {
        let mut corners = [[0.0; 2]; 8];
        for (place, corner) in corners.iter_mut().zip(part.corners()) {
            *place = view.place(corner)?;
        }
        // Along the longest edge of the box, so that a thin part has a thin footprint.
        let along = (0..8)
            .flat_map(|i| [1, 2, 4].map(|bit| (i, i | bit)))
            .map(|(i, j)| [corners[j][0] - corners[i][0], corners[j][1] - corners[i][1]])
            .max_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])))?;
        let length = along[0].hypot(along[1]);
        let along = if length > 0.0 {
            along.map(|x| x / length)
        } else {
            [1.0, 0.0]
        };
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for [u, v] in corners {
            let at = [u * along[0] + v * along[1], v * along[0] - u * along[1]];
            for (range, at) in ranges.iter_mut().zip(at) {
                *range = [range[0].min(at), range[1].max(at)];
            }
        }
        let [a, b] = ranges.map(|[low, high]| 0.5 * (low + high));
        Some(Self {
            middle: [a * along[0] - b * along[1], a * along[1] + b * along[0]],
            along,
            sides: ranges.map(|[low, high]| high - low),
        })
    }

    /// Whether it is so thin that pixels may miss it.
    #[must_use]
    pub fn is_small(&self) -> bool {
        self.sides[0].min(self.sides[1]) < SMALL && self.area() * POINTS_PER_PIXEL <= MOST
    }

    fn area(&self) -> f64 {
        self.sides[0] * self.sides[1]
    }

    /// A place on it, by shares of its sides from the middle; in pixels along the columns and the rows.
    fn at(&self, share: [f64; 2]) -> [f64; 2] {
        let [a, b] = [share[0] * self.sides[0], share[1] * self.sides[1]];
        [
            self.middle[0] + a * self.along[0] - b * self.along[1],
            self.middle[1] + a * self.along[1] + b * self.along[0],
        ]
    }
}

/// What the points of a footprint that fall into one pixel see.
#[derive(Default)]
struct Seen {
    sums: PixelSums,
    squares: f64,
    /// Sums of every other point: two estimates of the same.
    halves: [f64; 2],
}

/// Adds to a map what is seen of a part that is small in it.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "numbers from 0 to MOST, and places within the grid"
)]
pub fn add_small(field: &PartField, footprint: &Footprint, view: &View, map: &mut [Reading]) {
    let points = (footprint.area() * POINTS_PER_PIXEL).ceil().max(FEWEST);
    let weight = footprint.area() / points;
    let mut seen = BTreeMap::<usize, Seen>::new();
    let (mut batch, mut at, mut read) = (RayBatch::default(), Coordinates::default(), Points::default());
    let mut pixels = [0_usize; BLOCK];
    for first in (0..points as u64).step_by(BLOCK) {
        batch.len = BLOCK.min((points as u64 - first) as usize);
        let mut any = false;
        for (i, pixel) in pixels[..batch.len].iter_mut().enumerate() {
            let number = first + i as u64;
            let place = footprint.at([
                (number as f64 + 0.5) / points - 0.5,
                (number as f64 * GOLDEN + 0.5).fract() - 0.5,
            ]);
            *pixel = pixel_at(view, place).unwrap_or(usize::MAX);
            any |= *pixel != usize::MAX;
            aim(view, place, i, &mut batch);
        }
        if !any {
            continue;
        }
        carry(std::slice::from_ref(&field.part), &batch, &mut at);
        read.read(field, &at, batch.len);
        for (i, pixel) in pixels[..batch.len].iter().enumerate() {
            if *pixel != usize::MAX && at.part[i] != Coordinates::NONE {
                let own = seen.entry(*pixel).or_default();
                let coordinates = at.values.each_ref().map(|values| values[i]);
                let deviations = [0, 1, 2].map(|kind| read.deviations[kind][i]);
                own.sums.add(field.part.wraps(), coordinates, read.value[i], deviations);
                own.squares += read.value[i] * read.value[i];
                own.halves[i % 2] += read.value[i];
            }
        }
    }
    for (pixel, own) in seen {
        let value = weight * own.sums.value;
        let by_variance = lattice_error(1.0 / weight, weight * own.squares - value * value);
        let left = by_variance.max(weight * (own.halves[0] - own.halves[1]).abs());
        let reading = &mut map[pixel];
        reading.value += value;
        reading.deviation = reading.deviation.hypot(weight * own.sums.deviation(field)).hypot(left);
    }
}

/// The golden ratio's fraction: its multiples are even over the unit interval however many there are.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The pixel of a place, if it lies in the picture.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "inside 0..columns and 0..rows by the test"
)]
fn pixel_at(view: &View, [column, row]: [f64; 2]) -> Option<usize> {
    let inside = (0.0..f64::from(view.columns)).contains(&column) && (0.0..f64::from(view.rows)).contains(&row);
    inside.then(|| row as usize * view.columns as usize + column as usize)
}

/// The line from a place of the picture to the observer, as the ray `i` of a block.
fn aim(view: &View, place: [f64; 2], i: usize, batch: &mut RayBatch) {
    let point = view.point(place);
    let k: Vec3 = (view.observer - point).normalized();
    for (axis, (x, k)) in [(point.x, k.x), (point.y, k.y), (point.z, k.z)].into_iter().enumerate() {
        (batch.position[axis][i], batch.direction[axis][i]) = (x, k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::{Disk, Focus, Hemisphere, Rectangle, Shape, Tube};
    use crate::field::factor::Factor;
    use crate::field::light_field::tests::rough;

    fn view(columns: u32, rows: u32) -> View {
        let observer = Vec3::new(120.0, -80.0, 300.0);
        let target = Vec3::new(0.3, -0.2, 0.7);
        let normal = (observer - target).normalized();
        let right = Vec3::new(-normal.y, normal.x, 0.0).normalized();
        let up = normal.cross(right);
        View {
            observer,
            target,
            right,
            up,
            normal,
            width: 30.0,
            height: 20.0,
            columns,
            rows,
        }
    }

    /// A part of luminance 2 everywhere.
    fn even(shape: Shape) -> PartField {
        let mut field = rough(0);
        field.part.shape = shape;
        field.ratio.fill([1.0, 0.1]);
        (field.space, field.direction) = (Factor::one(), Factor::one());
        field
    }

    /// Sum of the luminances of a map by the area of a pixel, in mm².
    fn light(view: &View, map: &[Reading]) -> f64 {
        let pixel = view.width * view.height / view.pixels() as f64;
        map.iter().map(|r| r.value).sum::<f64>() * pixel
    }

    /// The area that a flat part covers in the picture, by the corners of its outline.
    fn outline(view: &View, part: &CarrierPart, turns: usize) -> f64 {
        let place = |i: usize| {
            let point = match part.shape {
                Shape::Rectangle(_) => {
                    part.ray([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][i % 4], [0.5; 2])
                        .0
                }
                Shape::Disk(Disk { radius }) => {
                    let (sine, cosine) = (i as f64 / turns as f64 * std::f64::consts::TAU).sin_cos();
                    part.frame
                        .point_to_world(Vec3::new(radius * cosine, radius * sine, 0.0))
                }
                _ => unreachable!("flat"),
            };
            view.place(point).expect("before the observer")
        };
        let twice: f64 = (0..turns)
            .map(|i| {
                let ([a, b], [c, d]) = (place(i), place(i + 1));
                a * d - b * c
            })
            .sum();
        0.5 * twice.abs() * view.width * view.height / view.pixels() as f64
    }

    #[test]
    fn small_parts_bring_all_their_light_into_any_grid() {
        let flat = Focus::default();
        let thin = Shape::Rectangle(Rectangle {
            width: 9.0,
            height: 1e-4,
            focus: flat,
        });
        let narrow = Shape::Rectangle(Rectangle {
            width: 1e-3,
            height: 4.0,
            focus: flat,
        });
        let rectangle = Shape::Rectangle(Rectangle {
            width: 0.7,
            height: 0.4,
            focus: flat,
        });
        let disk = Shape::Disk(Disk { radius: 0.3 });
        for (shape, turns) in [(thin, 4), (narrow, 4), (rectangle, 4), (disk, 4000)] {
            let field = even(shape);
            for (columns, rows) in [(1, 1), (7, 5), (30, 20)] {
                let view = view(columns, rows);
                let footprint = Footprint::of(&field.part, &view).expect("before the observer");
                assert!(footprint.is_small());
                let mut map = vec![Reading::default(); view.pixels()];
                add_small(&field, &footprint, &view, &mut map);
                let expected = 2.0 * outline(&view, &field.part, turns);
                assert!(
                    (light(&view, &map) / expected - 1.0).abs() < 2e-3,
                    "{shape:?} {columns}"
                );
                // The deviation of a tenth everywhere, and little for the edges of pixels.
                assert!(
                    map.iter()
                        .all(|r| r.deviation < 0.4 * r.value || r.value < 0.02 * expected)
                );
            }
        }
    }

    #[test]
    fn all_of_a_part_is_within_its_footprint() {
        let focus = Focus([0.4, -1.3, 2.1, -0.6]);
        let shapes = [
            Shape::Rectangle(Rectangle {
                width: 2.0,
                height: 1.0,
                focus,
            }),
            Shape::Disk(Disk { radius: 1.2 }),
            Shape::Hemisphere(Hemisphere { radius: 0.8 }),
            Shape::Tube(Tube {
                radius: 0.6,
                height: 2.0,
            }),
        ];
        let view = view(60, 40);
        for shape in shapes {
            let part = even(shape).part;
            let footprint = Footprint::of(&part, &view).expect("before the observer");
            let mut met = 0;
            for i in 0..400 {
                for j in 0..400 {
                    let place = [f64::from(i) * 0.15, f64::from(j) * 0.1];
                    let point = view.observer + view.through(place);
                    if !part.cross(point, -view.through(place)).met {
                        continue;
                    }
                    met += 1;
                    let [u, v] = [place[0] - footprint.middle[0], place[1] - footprint.middle[1]];
                    let [a, b] = footprint.along;
                    assert!((u * a + v * b).abs() <= 0.5 * footprint.sides[0]);
                    assert!((v * a - u * b).abs() <= 0.5 * footprint.sides[1]);
                }
            }
            assert!(met > 50, "{shape:?}");
        }
    }

    #[test]
    fn what_is_not_before_the_observer_has_none() {
        let mut part = even(Shape::Disk(Disk { radius: 1.0 })).part;
        part.frame.origin = view(1, 1).observer;
        assert!(Footprint::of(&part, &view(1, 1)).is_none());
    }
}
