//! The part of a table that leaves with one distribution, whatever the direction it came from: a(incident) l(scattered)/π.
//!
//! l is a function of the angle from the normal, the same for all light that leaves on one side of the surface, and a l/π is
//! nowhere more than f. Where f falls towards the horizon, as that of a coated base does, this is much more than a Lambertian
//! floor; and where f is 0 there, as in most measured tables, there is no such floor at all.

use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_sampling::more_numbers::MoreNumbers;

use super::contract::{Bsdf, Facts, Media, Product, Shares, by_cosine};
use super::table_bounds::{Least, RINGS, edge, least};
use super::table_lobes::{Lobe, Lobes};
use super::table_sides::Sides;

/// By how much a product has to be more than the floors to be taken instead.
const CLEARLY: f64 = 1.02;

/// The part of the light that a product has to be.
const ENOUGH: f64 = 0.02;

/// How often is tried again for a direction of the rest.
const TRIES: u32 = 10_000;

/// Numbers at the edges of rings, from the normal to the horizon.
type AtEdges = [f64; RINGS + 1];

/// The product in a table.
#[derive(Clone, Debug)]
pub(super) struct TableProduct {
    /// The shares a, as floors.
    shares: Sides,
    /// l on the front and on the back, linear in the square of the sine between edges.
    luminance: [AtEdges; 2],
    /// Squares of the sines of the edges.
    squares: AtEdges,
}

/// What is left of a table without the product in it.
#[derive(Clone, Debug)]
pub(super) struct TableRest {
    pub table: Arc<dyn Bsdf>,
    pub product: TableProduct,
}

impl TableProduct {
    /// None if the floors are as much, or if it is a small part of the light.
    pub fn of(table: &Sides) -> Option<Self> {
        let lobes = table.lobes();
        let known = least(&lobes.iter().map(|(lobe, _)| *lobe).collect::<Vec<_>>());
        let squares: AtEdges = std::array::from_fn(|k| edge(k).powi(2));
        let mut shares = vec![[0.0; RINGS + 1]; lobes.len()];
        let mut luminance = [[1.0; RINGS + 1]; 2];
        for (luminance, front) in luminance.iter_mut().zip([true, false]) {
            let own: Vec<usize> = (0..lobes.len()).filter(|k| lobes[*k].1 == front).collect();
            let rings: Vec<&Least> = own.iter().flat_map(|k| &known[*k]).collect();
            let Some((arriving, leaving)) = split(&rings) else {
                continue;
            };
            let there = at_edges(&leaving);
            let mean = mean(&there);
            *luminance = there.map(|l| l / mean);
            for (k, arriving) in own.iter().zip(arriving.chunks(RINGS)) {
                shares[*k] = at_edges(arriving).map(|a| a * mean);
            }
        }
        let at_edges_of = |of: &dyn Fn(&Lobe, f64) -> f64| {
            let one = |(lobe, _): &(&Lobe, bool)| mean(&std::array::from_fn(|k| of(lobe, edge(k))));
            lobes.iter().map(one).sum::<f64>()
        };
        let all = at_edges_of(&Lobe::share);
        let floors = at_edges_of(&|lobe, sine| lobe.shares(sine).1[2]);
        let product: f64 = shares.iter().map(mean).sum();
        if product <= CLEARLY * floors || product <= ENOUGH * all {
            return None;
        }
        let sines: AtEdges = std::array::from_fn(edge);
        let floor = |((lobe, _), shares): (&(&Lobe, bool), &AtEdges)| lobe.of_floor(&sines, shares);
        let mut floors = lobes.iter().zip(&shares).map(floor);
        Some(Self {
            shares: table.map(|lobes| Some(Lobes::with_rows(floors.by_ref().take(lobes.rows().len()).collect()))),
            luminance,
            squares,
        })
    }

    /// l on one side, by the square of the sine of the angle.
    #[inline]
    fn luminance(&self, front: bool, square: f64) -> f64 {
        let above = self.squares.partition_point(|edge| *edge <= square).clamp(1, RINGS);
        let [from, to] = [self.squares[above - 1], self.squares[above]];
        let l = &self.luminance[usize::from(!front)];
        let part = ((square - from) / (to - from)).min(1.0);
        l[above - 1] + part * (l[above] - l[above - 1])
    }
}

/// a and l for the least f in rings of incidence and of scattered directions, as much as can be: of some tries the best. None if
/// there is nothing.
///
/// With l given the greatest a are known, and with a given the greatest l. A try begins with an a that is what f is in most
/// directions, and leaves those incidences out that have least light where there is least of it: their a follows from l.
fn split(rings: &[&Least]) -> Option<(Vec<f64>, Least)> {
    let areas: Least = std::array::from_fn(area);
    let mut best: Option<(f64, Vec<f64>, Least)> = None;
    for part in [0.1, 0.25, 0.5, 0.75] {
        let typical: Vec<f64> = rings.iter().map(|f| PI * exceeded(f, &areas, part)).collect();
        let mut order: Vec<usize> = (0..rings.len()).filter(|n| typical[*n] > 0.0).collect();
        let weakest = |n: &usize| {
            rings[*n]
                .iter()
                .fold(f64::INFINITY, |low, f| low.min(PI * f / typical[*n]))
        };
        order.sort_by(|a, b| weakest(b).total_cmp(&weakest(a)));
        let mut kept = order.len();
        while kept > 0 {
            let leaving: Least = std::array::from_fn(|j| {
                let each = order[..kept].iter().map(|n| PI * rings[*n][j] / typical[*n]);
                each.fold(f64::INFINITY, f64::min)
            });
            let most = |f: &&Least| {
                let each = f.iter().zip(&leaving).filter(|(_, l)| **l > 0.0);
                let most = each.map(|(f, l)| PI * f / l).fold(f64::INFINITY, f64::min);
                if most.is_finite() { most } else { 0.0 }
            };
            let arriving: Vec<f64> = rings.iter().map(most).collect();
            let each = arriving.iter().enumerate().map(|(n, a)| a * areas[n % RINGS]);
            let l = leaving.iter().zip(&areas).map(|(l, area)| l * area);
            let all = each.sum::<f64>() * l.sum::<f64>();
            if all > best.as_ref().map_or(0.0, |(all, ..)| *all) {
                best = Some((all, arriving, leaving));
            }
            kept = kept * 3 / 4;
        }
    }
    best.map(|(_, arriving, leaving)| (arriving, leaving))
}

/// The part of the directions, by projected solid angle, that lie in a ring.
fn area(ring: usize) -> f64 {
    edge(ring + 1).powi(2) - edge(ring).powi(2)
}

/// What f is more than in all but this part of the directions.
fn exceeded(f: &Least, areas: &Least, part: f64) -> f64 {
    let mut order: Vec<usize> = (0..RINGS).collect();
    order.sort_by(|a, b| f[*a].total_cmp(&f[*b]));
    let mut sum = 0.0;
    let found = order.into_iter().find(|ring| {
        sum += areas[*ring];
        sum >= part
    });
    found.map_or(0.0, |ring| f[ring])
}

/// A function that is nowhere more than what is given for the rings, linear in the square of the sine from edge to edge.
fn at_edges(rings: &[f64]) -> AtEdges {
    std::array::from_fn(|k| rings[k.saturating_sub(1)].min(rings[k.min(RINGS - 1)]))
}

/// The mean of such a function by projected solid angle.
fn mean(edges: &AtEdges) -> f64 {
    (0..RINGS)
        .map(|ring| area(ring) * 0.5 * (edges[ring] + edges[ring + 1]))
        .sum()
}

impl Product for TableProduct {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        self.shares.floors(incident, media)
    }

    fn leaving(&self, scattered: Vec3, _media: &Media) -> f64 {
        let square = scattered.x * scattered.x + scattered.y * scattered.y;
        self.luminance(scattered.z > 0.0, square)
    }

    fn is_even(&self) -> bool {
        false
    }
}

impl TableRest {
    /// The shares of the rest.
    fn diffuse(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        let (all, product) = (
            self.table.shares(incident, media).diffuse,
            self.product.arriving(incident, media),
        );
        // Shares are interpolated, and f is not integrated anew.
        std::array::from_fn(|side| (all[side] - product[side]).max(0.0))
    }
}

impl Bsdf for TableRest {
    fn facts(&self) -> &Facts {
        self.table.facts()
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        Shares {
            specular: [0.0; 2],
            diffuse: self.diffuse(incident, media),
            refraction: incident.z.abs(),
        }
    }

    fn most(&self) -> f64 {
        self.table.most()
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let way = usize::from((incident.z > 0.0) != (scattered.z > 0.0));
        let product = self.product.arriving(incident, media)[way] * self.product.leaving(scattered, media);
        (self.table.evaluate(incident, scattered, media) - product * FRAC_1_PI).max(0.0)
    }

    /// Directions of the table, of which each stays with the part of f that is not in the product.
    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let share = self.product.arriving(incident, media)[usize::from(transmitted)] * FRAC_1_PI;
        let mut more = MoreNumbers::new(numbers);
        let mut pair = numbers;
        for _ in 0..TRIES {
            let scattered = self.table.draw(incident, transmitted, media, pair);
            let f = self.table.evaluate(incident, scattered, media);
            if more.draw() * f >= share * self.product.leaving(scattered, media) {
                return scattered;
            }
            pair = more.pair();
        }
        by_cosine((incident.z > 0.0) != transmitted, numbers)
    }
}

#[cfg(test)]
mod tests {
    use etendue_math::trig::sin_cos_turns;
    use etendue_sampling::philox::Stream;

    use super::super::rough_coat::RoughCoat;
    use super::super::table_grid::Slice;
    use super::super::table_lobes::{Incidence, Row, Way};
    use super::super::table_sides::Side;
    use super::*;
    use crate::table::Table;

    const MEDIA: Media = Media {
        wavelength: 555.0,
        front: 1.0,
        back: 1.0,
    };

    /// A direction at an angle with this sine, from which light goes on along +x.
    fn at(sine: f64) -> Vec3 {
        Vec3::new(-sine, 0.0, ((1.0 - sine) * (1.0 + sine)).sqrt())
    }

    /// A table of f and of shares of reflected light, every 5°, on a fine grid.
    fn tabled(f: impl Fn(Vec3, Vec3) -> f64, share: impl Fn(Vec3) -> f64) -> Sides {
        let radial: Vec<f64> = std::iter::once(0.0)
            .chain((0..60).map(|k| 0.005 * 400_f64.powf(f64::from(k) / 59.0)))
            .chain((0..40).map(|k| 0.41 + 0.04 * f64::from(k)))
            .collect();
        let mut radial: Vec<f64> = radial.into_iter().filter(|r| *r <= 2.0).collect();
        radial.sort_by(f64::total_cmp);
        let slice = |k: u32| {
            let sine = (5.0 * f64::from(k)).to_radians().sin();
            let places = (0..72).flat_map(|j| radial.iter().map(move |r| (*r, f64::from(j) / 72.0)));
            let value = |(r, turn): (f64, f64)| {
                let (s, c) = sin_cos_turns(turn);
                let (x, y) = (sine + r * c, r * s);
                // Beyond the horizon as just before it.
                let [x, y] = [x, y].map(|v| v / (x * x + y * y).sqrt().max(1.0));
                f(at(sine), Vec3::new(x, y, (1.0 - x * x - y * y).max(1e-18).sqrt()))
            };
            Slice {
                sine,
                radial: radial.clone(),
                azimuths: 72,
                f: places.map(value).collect(),
                share: share(at(sine)),
                floor: 0.0,
            }
        };
        let row = Row {
            azimuth: 0.0,
            slices: (0..18).map(slice).collect(),
        };
        let side = Side {
            sheets: vec![(555.0, [Some(Way { rows: vec![row] }), None])],
        };
        Sides::new(&side, &Side::default()).expect("sound")
    }

    #[test]
    fn what_a_coated_base_sends_out_is_found() {
        let paint = RoughCoat::new([0.2, 0.2], true, 1.5, Table::constant(0.8)).expect("sound");
        let f = |incident, scattered| paint.evaluate(incident, scattered, &MEDIA);
        let sides = tabled(f, |incident| paint.shares(incident, &MEDIA).diffuse[0]);
        let found = TableProduct::of(&sides).expect("there is one");
        let known = paint.parts().expect("has parts").product;
        for angle in [0.0, 17.0, 33.0, 52.0, 68.0, 77.0] {
            let d = at(f64::to_radians(angle).sin());
            let [a, all] = [&found as &dyn Product, known].map(|product| product.arriving(d, &MEDIA)[0]);
            assert!(a > 0.94 * all && a < 1.01 * all, "{angle}: {a} of {all}");
            let [l, all] = [&found as &dyn Product, known].map(|product| product.leaving(d, &MEDIA));
            // Azimuths that are 5° apart blur the horizon.
            assert!(
                (l / all - 1.0).abs() < if angle < 60.0 { 0.06 } else { 0.2 },
                "{angle}: {l} of {all}"
            );
        }
    }

    #[test]
    fn f_is_nowhere_less_than_the_product() {
        // A base that has nothing beyond 80° and a lobe aside of the plane of incidence.
        let f = |incident: Vec3, scattered: Vec3| {
            let base = 0.2 * (scattered.z - 0.17).max(0.0) * incident.z.sqrt();
            let (x, y) = (scattered.x + incident.x, scattered.y + incident.y - 0.2);
            base + 0.8 * etendue_math::special::exp(-20.0 * (x * x + y * y))
        };
        let sides = tabled(f, |_| 0.4);
        let product = TableProduct::of(&sides).expect("there is one");
        let lobe = sides.lobes()[0].0;
        let (numbers, mut least) = (Stream::new(5, 8), f64::INFINITY);
        for k in 0..200_000 {
            let [a, b, c, _] = numbers.uniforms(k, 0);
            let (incident, scattered) = (at(a), by_cosine(true, [b, c]));
            let place = Incidence::new(incident).place(incident, scattered);
            let there = product.arriving(incident, &MEDIA)[0] * product.leaving(scattered, &MEDIA) * FRAC_1_PI;
            let left = lobe.at(a, place.0, place.1) - there;
            assert!(left >= -1e-12, "{incident:?} {scattered:?}: {left} beside {there}");
            least = if there > 0.01 { least.min(left / there) } else { least };
        }
        // And somewhere it is about as much.
        assert!(least < 0.02, "{least}");
    }

    #[test]
    fn a_lobe_without_a_base_has_no_product() {
        let f = |incident: Vec3, scattered: Vec3| {
            let (x, y) = (scattered.x + incident.x, scattered.y + incident.y);
            etendue_math::special::exp(-50.0 * (x * x + y * y))
        };
        assert!(TableProduct::of(&tabled(f, |_| 0.06)).is_none());
    }
}
