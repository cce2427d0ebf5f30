//! Luminance at many points of a part at a time, table by table.
//!
//! Points of one pixel mostly lie between the same cells of a table. Then its entries are fetched once, and the rest is
//! arithmetic on several points at a time; where they do not, what one point needs of a large table is on its way from memory
//! while others are worked on. Either way each point gets the same bits as by itself.

use etendue_geometry::ray_batch::BLOCK;
use etendue_math::heads::heads_mut;
use multiversion::multiversion;

use super::factor::groups;
use super::light_field::{PartField, Reading, joined, weighed};
use super::tent::Tents;
use crate::carrier::Coordinates;

/// What is found at up to [`BLOCK`] points.
pub struct Points {
    /// Luminance.
    pub value: Vec<f64>,
    /// Standard deviations: of the cells, of the place within a cell, of the direction within one. Each kind of error has
    /// neighbours of its own with which it goes together.
    pub deviations: [Vec<f64>; 3],
    scratch: Scratch,
}

/// Room for the cells and the values of some points.
struct Scratch {
    tents: [Tents; 4],
    factors: [[f64; Tents::MOST]; 2],
    errors: [[f64; Tents::MOST]; 2],
}

impl Default for Points {
    fn default() -> Self {
        Self {
            value: vec![0.0; BLOCK],
            deviations: std::array::from_fn(|_| vec![0.0; BLOCK]),
            scratch: Scratch {
                tents: std::array::from_fn(|_| Tents::default()),
                factors: [[0.0; Tents::MOST]; 2],
                errors: [[0.0; Tents::MOST]; 2],
            },
        }
    }
}

impl Points {
    /// What was found at a point, with all kinds of errors together.
    #[inline(always)]
    #[must_use]
    pub fn reading(&self, i: usize) -> Reading {
        let variance: f64 = self.deviations.iter().map(|d| d[i] * d[i]).sum();
        Reading {
            value: self.value[i],
            deviation: variance.sqrt(),
        }
    }

    /// Reads the first `count` points of a part; what is found where a line does not leave the part means nothing.
    pub fn read(&mut self, part: &PartField, at: &Coordinates, count: usize) {
        if let Some((lower, upper)) = extent(at, count) {
            part.space.fetch(lower, upper, count);
            part.errors.space.fetch(lower, upper, count);
        }
        for first in (0..count).step_by(Tents::MOST) {
            let some = first..count.min(first + Tents::MOST);
            if at.part[some.clone()].iter().any(|owner| *owner != Coordinates::NONE) {
                let found = Found {
                    value: &mut self.value[some.clone()],
                    deviations: self.deviations.each_mut().map(|d| &mut d[some.clone()]),
                };
                let coordinates = at.values.each_ref().map(|v| &v[some.clone()]);
                read_some(&mut self.scratch, part, coordinates, found);
            }
        }
    }
}

/// The corners of the places of the first `count` points that lie on the part; None if none does.
fn extent(at: &Coordinates, count: usize) -> Option<([f64; 2], [f64; 2])> {
    let (mut lower, mut upper) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (i, owner) in at.part[..count].iter().enumerate() {
        if *owner != Coordinates::NONE {
            for axis in 0..2 {
                let x = at.values[axis][i];
                lower[axis] = if x < lower[axis] { x } else { lower[axis] };
                upper[axis] = if x > upper[axis] { x } else { upper[axis] };
            }
        }
    }
    (lower[0] <= upper[0]).then_some((lower, upper))
}

/// Where to write what is found.
struct Found<'a> {
    value: &'a mut [f64],
    deviations: [&'a mut [f64]; 3],
}

/// Compiled for each instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn read_some(scratch: &mut Scratch, part: &PartField, [s1, s2, a, b]: [&[f64]; 4], found: Found<'_>) {
    let n = found.value.len();
    let Scratch { tents, factors, errors } = scratch;
    let [space, direction] = heads_mut(factors, n);
    let [of_place, of_direction] = heads_mut(errors, n);
    let [x, y, ..] = &mut *tents;
    part.space.fill([s1, s2], [x, y], space);
    part.direction.fill([a, b], [x, y], direction);
    part.errors.space.fill([s1, s2], [x, y], of_place);
    part.errors.direction.fill([a, b], [x, y], of_direction);
    for (axis, (tents, x)) in tents.iter_mut().zip([s1, s2, a, b]).enumerate() {
        tents.look_up(x, part.cells[axis], axis == 0 && part.part.wraps());
    }
    // First the ratio with its deviation in place of the luminance.
    let (value, [of_cells, by_place, by_direction]) = (found.value, found.deviations);
    for (some, ratio) in groups(value) {
        let deviation = &mut of_cells[some.clone()];
        if let [Some(x), Some(y), Some(u), Some(v)] = tents.each_ref().map(|t| t.shared(some.clone())) {
            let corners = part.corners([x, y, u, v]);
            let [x, y, u, v] = tents.each_ref().map(|t| t.weights(some.clone()));
            for (i, (ratio, deviation)) in ratio.iter_mut().zip(deviation).enumerate() {
                let weights = [x[i], y[i], u[i], v[i]].map(|w| [1.0 - w, w]);
                [*ratio, *deviation] = weighed(|[i, j, k]| corners[i][j][k], weights);
            }
        } else {
            for (i, (ratio, deviation)) in some.zip(ratio.iter_mut().zip(deviation)) {
                [*ratio, *deviation] = part.ratio_under(&tents.each_ref().map(|t| t.get(i)));
            }
        }
    }
    for i in 0..n {
        let (ratio, factors, errors) = (
            [value[i], of_cells[i]],
            [space[i], direction[i]],
            [of_place[i], of_direction[i]],
        );
        let deviations;
        (value[i], deviations) = joined(part.level, ratio, factors, errors);
        [of_cells[i], by_place[i], by_direction[i]] = deviations;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::carrier::tests::lattice;
    use crate::field::Factor;
    use crate::field::light_field::tests::rough;

    #[test]
    fn each_point_is_read_as_by_itself_whether_it_shares_its_cells_or_not() {
        for kind in 0..4 {
            for narrow in [1.0, 0.01] {
                let mut part = rough(kind);
                if kind == 3 {
                    // One cell along the last axis, and no factor over the direction.
                    part.cells = [4, 4, 4, 1];
                    part.direction = Factor::one();
                }
                part.errors.space =
                    Factor::new(4, (0..16).map(|i| f64::from(i) * 0.05).collect(), part.part.wraps()).expect("sound");
                let mut at = Coordinates::default();
                for (i, point) in lattice(300).enumerate() {
                    for (values, x) in at.values.iter_mut().zip(point) {
                        values[i] = 0.3 + (x - 0.3) * narrow;
                    }
                    at.part[i] = if i % 7 == 3 { Coordinates::NONE } else { 0 };
                }
                let mut points = Points::default();
                points.read(&part, &at, 300);
                for i in (0..300).filter(|i| at.part[*i] == 0) {
                    let [s1, s2, a, b] = at.values.each_ref().map(|v| v[i]);
                    let alone = part.at([s1, s2], [a, b]);
                    let variance: f64 = points.deviations.iter().map(|d| d[i] * d[i]).sum();
                    assert!(points.value[i].to_bits() == alone.value.to_bits() && alone.value > 0.0);
                    assert!(variance.sqrt().to_bits() == alone.deviation.to_bits());
                }
            }
        }
    }
}
