//! A table of scattered light by direction: measured, or made of a model.
//!
//! **What is stored.** For each way (reflected, transmitted) and each azimuth and angle of incidence a *slice*: f on a polar
//! grid about the specular direction in the plane of direction cosines, |β − β₀| and azimuth from the direction of β₀; and the share
//! of the flux in it and in the *base*, which leaves with one distribution from all incidences.
//!
//! **In between.** At an angle of incidence between two slices both are moved with β₀ and added by their distance; the sum is
//! scaled to the share there, a monotone cubic in β₀² through the shares of the slices `[Hyman1983]`. Slices that are far
//! apart get others in between, ln f being linear in the angle of incidence. Beyond the first and the last angle the nearest
//! slice moves on unchanged, and what leaves the unit circle of direction cosines is absorbed; tables that reach from the normal
//! to grazing incidence have nothing beyond.
//!
//! **Drawing** is exact: a slice by its share, a node of its grid by what it contributes, a point by the hats about that node in
//! the plane of direction cosines, where area is projected solid angle; and again if the point lies outside the unit circle.

use std::cell::RefCell;
use std::sync::Arc;

use etendue_geometry::surface_points::Vectors;
use etendue_math::Vec3;

use crate::bsdf::contract::{Bsdf, Facts, Media, Parts, Product};
use crate::bsdf::drawn::{Drawn, Outcome};
use crate::bsdf::shares::Shares;

mod arrivals;
mod base;
mod draw;
mod grid;
mod hats;
mod lanes;
mod lobes;
mod nodes;
mod sides;
mod slice;
mod steps;
mod waiting;

use base::Base;
use draw::Group;
use grid::Grid;
use lobes::{ALL, Incidence, Lobes};
use sides::{Sides, on_its_way, pick, share};
use waiting::off_slice;

pub use lobes::{Row, Way};
pub use sides::Side;
pub use slice::Slice;

/// A table of scattered light.
#[derive(Clone, Debug)]
pub struct Tabulated {
    sides: Sides,
    facts: Facts,
    /// Whether any slice has a part in the base; and the same without it, if anything is left.
    base: bool,
    lobes: Option<Arc<dyn Bsdf>>,
    /// See [`Bsdf::most`].
    most: f64,
}

impl Tabulated {
    /// Of light that meets the front and the back. The bases are of light that leaves on the front and on the back: luminances of
    /// any scale at cosines of the angle from the normal that fall evenly from 1 to 0; none: Lambertian.
    ///
    /// # Errors
    /// What is wrong with the tables.
    pub fn new(sides: [&Side; 2], bases: [&[f64]; 2]) -> Result<Self, String> {
        let [front, back] = bases.map(Base::new);
        let sides = Sides::new(sides, [front?, back?])?;
        let base = sides.each().flatten().flatten().any(Lobes::has_base);
        let lobes = base.then(|| sides.map(Lobes::without_base));
        let lobes = lobes.filter(|sides| sides.each().flatten().any(Option::is_some));
        let lobes = lobes.map(|sides| Arc::new(Self::of(sides, false, None)) as Arc<dyn Bsdf>);
        Ok(Self::of(sides, base, lobes))
    }

    fn of(sides: Sides, base: bool, lobes: Option<Arc<dyn Bsdf>>) -> Self {
        let diffuse = [0, 1].map(|way| sides.each().any(|ways| ways[way].is_some()));
        // Between wavelengths and angles shares are no more than at both ends.
        let most = |ways: &[Option<Lobes>; 2]| ways.iter().flatten().map(Lobes::most).sum();
        let most = sides.each().map(most).fold(0.0, f64::max);
        // What reaches this is all of the light: see `picked`.
        let most = if most >= ALL { 1.0 } else { most };
        Self {
            sides,
            base,
            lobes,
            most,
            facts: Facts {
                specular: [false; 2],
                diffuse,
                lambertian: false,
                reciprocal: false,
                constant: None,
                fresnel: false,
            },
        }
    }

    /// What scatters light; None: it is absorbed.
    #[inline]
    fn picked(&self, incident: Vec3, media: &Media, numbers: [f64; 2]) -> Option<Picked<'_>> {
        let incidence = Incidence::new(incident);
        let front = incident.z > 0.0;
        let (way, (grid, number)) = if let Some((way, lobe)) = self.sides.lone(front) {
            let shares = lobe.shares(incidence.sine);
            let share = shares.1.iter().sum::<f64>();
            let scattered = numbers[0] < share || share >= ALL;
            (way, scattered.then(|| lobe.pick(shares, numbers[0]))?)
        } else {
            let ways = [false, true].map(|way| self.sides.lit(&incidence, front, way, media.wavelength));
            let shares = Shares {
                specular: [0.0; 2],
                diffuse: ways.each_ref().map(share),
                refraction: incident.z.abs(),
            };
            let (component, rest) = shares.pick(numbers[0])?;
            let way = component.is_transmitted();
            (way, pick(&ways[usize::from(way)], rest))
        };
        Some(Picked {
            incidence,
            grid,
            base: self.sides.base(front != way),
            numbers: [number, numbers[1]],
            up: front != way,
        })
    }
}

/// Light that is scattered by a slice or a base, before it is known where to.
#[derive(Clone, Copy)]
struct Picked<'a> {
    incidence: Incidence,
    /// None: the base.
    grid: Option<&'a Grid>,
    base: &'a Base,
    /// Two numbers that have not been used.
    numbers: [f64; 2],
    up: bool,
}

impl Picked<'_> {
    /// The direction.
    #[inline]
    fn direction(&self, incident: Vec3) -> Vec3 {
        let Some(grid) = self.grid else {
            return self.base.direction(self.up, self.numbers);
        };
        off_slice(&self.incidence, incident, grid, self.numbers, self.up)
    }
}

impl Bsdf for Tabulated {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn is_selective(&self) -> bool {
        self.sides.are_selective()
    }

    fn shares(&self, incident: Vec3, media: &Media) -> Shares {
        let incidence = Incidence::new(incident);
        let front = incident.z > 0.0;
        let diffuse = match self.sides.lone(front) {
            Some((way, lobe)) => on_its_way(way, lobe.share(incidence.sine)),
            None => [false, true].map(|way| share(&self.sides.lit(&incidence, front, way, media.wavelength))),
        };
        Shares {
            specular: [0.0; 2],
            diffuse,
            refraction: incident.z.abs(),
        }
    }

    fn most(&self) -> f64 {
        self.most
    }

    fn evaluate(&self, incident: Vec3, scattered: Vec3, media: &Media) -> f64 {
        let incidence = Incidence::new(incident);
        let place = incidence.place(incident, scattered);
        let front = incident.z > 0.0;
        let transmitted = front != (scattered.z > 0.0);
        let luminance = self.leaving(scattered, media);
        if let Some((way, lobe)) = self.sides.lone(front) {
            return if way == transmitted {
                lobe.at(incidence.sine, place, luminance)
            } else {
                0.0
            };
        }
        let ways = self.sides.lit(&incidence, front, transmitted, media.wavelength);
        ways.iter()
            .flatten()
            .map(|(lit, part)| part * lit.at(place, luminance))
            .sum()
    }

    fn parts(&self) -> Option<Parts<'_>> {
        self.base.then_some(Parts {
            product: self,
            rest: self.lobes.as_ref(),
        })
    }

    fn draw(&self, incident: Vec3, transmitted: bool, media: &Media, numbers: [f64; 2]) -> Vec3 {
        let incidence = Incidence::new(incident);
        let front = incident.z > 0.0;
        let (grid, number) = match self.sides.lone(front) {
            Some((_, lobe)) => {
                let shares = lobe.shares(incidence.sine);
                lobe.pick(shares, numbers[0] * shares.1.iter().sum::<f64>())
            }
            None => pick(
                &self.sides.lit(&incidence, front, transmitted, media.wavelength),
                numbers[0],
            ),
        };
        let picked = Picked {
            incidence,
            grid,
            base: self.sides.base(front != transmitted),
            numbers: [number, numbers[1]],
            up: front != transmitted,
        };
        picked.direction(incident)
    }

    /// As any BSDF does, but what light is shared by is looked up once.
    fn sample(&self, incident: Vec3, media: &Media, numbers: [f64; 2]) -> Drawn {
        let picked = self.picked(incident, media, numbers);
        picked.map_or(Drawn::Absorbed, |picked| Drawn::Scattered(picked.direction(incident)))
    }

    /// As any BSDF does, but where a side has a single lobe, for many rays together.
    fn sample_many(&self, directions: &mut Vectors, media: &[Media], numbers: [&[f64]; 2], outcomes: &mut [Outcome]) {
        let above = directions[2].iter().filter(|z| **z > 0.0).count();
        let one_side = above == 0 || above == outcomes.len();
        if let Some((way, lobe)) = one_side.then(|| self.sides.lone(above > 0)).flatten() {
            let mut all = directions.each_mut().map(Vec::as_mut_slice);
            let up = (above > 0) != way;
            let base = self.sides.base(up);
            GROUP.with_borrow_mut(|group| group.draw((lobe, base, up), &mut all, numbers, outcomes));
            return;
        }
        for (k, outcome) in outcomes.iter_mut().enumerate() {
            let [x, y, z] = directions.each_ref().map(|list| list[k]);
            let drawn = self.sample(Vec3::new(x, y, z), &media[k], numbers.map(|list| list[k]));
            *outcome = drawn.keep(directions, k);
        }
    }
}

thread_local! {
    /// Room to work in: it would take a while to make it anew.
    static GROUP: RefCell<Box<Group>> = RefCell::new(Box::new(Group::new()));
}

/// The base.
impl Product for Tabulated {
    fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        self.sides.arriving(incident, media)
    }

    #[inline]
    fn leaving(&self, scattered: Vec3, _media: &Media) -> f64 {
        self.sides.base(scattered.z > 0.0).luminance(scattered.z.abs())
    }

    fn is_even(&self) -> bool {
        [true, false].iter().all(|front| self.sides.base(*front).is_even())
    }
}

#[cfg(test)]
impl crate::bsdf::examples::Examples for Tabulated {
    // f has kinks at the nodes of each slice. A quadrature of 16 times the steps leaves 4e-6.
    const QUADRATURE: f64 = 2e-4;

    fn examples() -> Vec<Self> {
        use std::f64::consts::TAU;

        use self::lobes::{Row, Way};
        use self::slice::Slice;

        let slice = |azimuths: usize, width: f64, [skew, aside]: [f64; 2], sine: f64, [share, base]: [f64; 2]| {
            let radial: Vec<f64> = (0..24).map(|i| 2.0 * (f64::from(i) / 23.0).powi(2)).collect();
            let mut f = Vec::new();
            for j in 0..azimuths {
                // Those of both sides have the same bits.
                let turn = j.min(azimuths - j) as f64 / azimuths as f64;
                let side = if 2 * j < azimuths { aside } else { -aside };
                let stretch = 1.0 + skew * (TAU * turn).cos() + side * (TAU * turn).sin();
                f.extend(radial.iter().map(|r| (-0.5 * (r / (width * stretch)).powi(2)).exp()));
            }
            Slice {
                sine,
                radial,
                azimuths,
                f,
                share,
                base,
            }
        };
        let lobe = |width: f64, skew: f64, sine: f64, share: f64, base: f64| {
            slice(12, width, [skew, 0.5 * skew], sine, [share, base])
        };
        let row = |azimuth: f64, k: f64| Row {
            azimuth,
            slices: vec![
                lobe(0.4, 0.2 * k, 0.0, 0.3, 0.2),
                lobe(0.5, -0.3 * k, 0.5, 0.35 * k, 0.25),
                lobe(0.3, 0.4 * k, 0.94, 0.5, 0.1 * k),
            ],
        };
        let side = |way: [Option<Way>; 2]| Side {
            sheets: vec![(500.0, way)],
        };
        let isotropic = Way {
            rows: vec![row(0.0, 1.0)],
        };
        let turned = Way {
            rows: vec![row(0.0, 0.5), row(0.3, 1.0), row(0.7, 0.7)],
        };
        let faint = Way {
            rows: vec![Row {
                azimuth: 0.0,
                slices: vec![lobe(0.6, 0.1, 0.3, 0.2, 0.0)],
            }],
        };
        let coloured = Side {
            sheets: vec![
                (450.0, [Some(isotropic.clone()), None]),
                (600.0, [Some(faint.clone()), Some(faint.clone())]),
            ],
        };
        // Alike on both sides of the plane of incidence, with an azimuth opposite to the first and without.
        let alike = |azimuths: usize| Way {
            rows: vec![Row {
                azimuth: 0.0,
                slices: [(0.4, 0.0, 0.5), (0.3, 0.6, 0.6), (0.5, 0.95, 0.4)]
                    .map(|(width, sine, share)| slice(azimuths, width, [0.4, 0.0], sine, [share, 0.1]))
                    .to_vec(),
            }],
        };
        let both = side([Some(turned), Some(faint)]);
        let one = side([Some(isotropic), None]);
        let [even, odd] = [14, 9].map(|azimuths| side([Some(alike(azimuths)), None]));
        // Of light that grazes, most of the lobe lies beyond the horizon.
        let wide = Way {
            rows: vec![Row {
                azimuth: 0.0,
                slices: vec![lobe(0.6, 0.3, 0.0, 0.9, 0.0), lobe(0.6, 0.3, 0.99, 0.9, 0.0)],
            }],
        };
        let wide = side([Some(wide), None]);
        // Bases that fall towards the horizon, to 0 before it, and with a hole; the middle of steps is where a lattice looks.
        let [falling, ending, broken] = [
            &[1.0, 0.9, 0.7, 0.4, 0.1][..],
            &[2.0, 2.0, 1.0, 0.0, 0.0],
            &[1.0, 0.0, 3.0],
        ];
        [
            ([&one, &one], [&[][..]; 2]),
            ([&both, &one], [falling, &[]]),
            ([&coloured, &both], [ending, falling]),
            ([&even, &odd], [falling, broken]),
            ([&wide, &one], [&[], &[]]),
        ]
        .map(|(sides, bases)| Self::new(sides, bases).expect("sound"))
        .to_vec()
    }
}
