//! The tables of light that meets both sides of a surface, by wavelength.

use etendue_math::Vec3;
use etendue_sampling::warp::part_of;

use super::base::Base;
use super::grid::Grid;
use super::lobes::{Incidence, Lit, Lobe, Lobes, Way};
use crate::bsdf::contract::Media;

/// Tables of light that meets one side: reflected and transmitted, by wavelength \[nm\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Side {
    /// Rising wavelengths, each with the tables of both ways; empty: everything is absorbed.
    pub sheets: Vec<(f64, [Option<Way>; 2])>,
}

/// For each wavelength the tables of both ways.
type Sheets = Vec<(f64, [Option<Lobes>; 2])>;

/// The tables of both sides, the front first, ready to be asked.
#[derive(Clone, Debug)]
pub(super) struct Sides {
    sheets: [Sheets; 2],
    /// Of light that leaves on the front and on the back.
    bases: [Base; 2],
}

/// Next to a wavelength, each with its part.
pub(super) type Ways<'a> = [Option<(Lit<'a>, f64)>; 2];

impl Side {
    fn lobes(&self) -> Result<Sheets, String> {
        if self
            .sheets
            .windows(2)
            .any(|pair| pair[0].0.partial_cmp(&pair[1].0) != Some(std::cmp::Ordering::Less))
        {
            return Err("wavelengths do not rise".into());
        }
        let sheet = |(wavelength, ways): &(f64, [Option<Way>; 2])| {
            let [a, b] = ways.each_ref().map(|way| way.as_ref().map(Way::lobes).transpose());
            Ok((*wavelength, [a?, b?]))
        };
        self.sheets.iter().map(sheet).collect()
    }
}

impl Sides {
    /// Of light that meets the front and the back, with the bases of light that leaves there.
    ///
    /// # Errors
    /// What is wrong with the tables.
    pub fn new([front, back]: [&Side; 2], bases: [Base; 2]) -> Result<Self, String> {
        let sheets = [front.lobes()?, back.lobes()?];
        Ok(Self { sheets, bases })
    }

    /// The base of light that leaves on a side.
    #[inline]
    pub fn base(&self, front: bool) -> &Base {
        &self.bases[usize::from(!front)]
    }

    /// All tables of both ways.
    pub fn each(&self) -> impl Iterator<Item = &[Option<Lobes>; 2]> {
        self.sheets.iter().flatten().map(|(_, ways)| ways)
    }

    /// Whether a side has tables at several wavelengths.
    pub fn are_selective(&self) -> bool {
        self.sheets.iter().any(|side| side.len() > 1)
    }

    /// The same with others in the place of these.
    pub fn map(&self, mut other: impl FnMut(&Lobes) -> Option<Lobes>) -> Self {
        let mut sheet = |(at, ways): &(f64, [Option<Lobes>; 2])| {
            (*at, ways.each_ref().map(|lobes| lobes.as_ref().and_then(&mut other)))
        };
        Self {
            sheets: self
                .sheets
                .each_ref()
                .map(|sheets| sheets.iter().map(&mut sheet).collect()),
            bases: self.bases.clone(),
        }
    }

    /// The tables next to a wavelength, each with its part.
    fn sheets(&self, front: bool, wavelength: f64) -> [(&[Option<Lobes>; 2], f64); 2] {
        const NONE: &[Option<Lobes>; 2] = &[None, None];
        let side = &self.sheets[usize::from(!front)];
        let above = side.partition_point(|(at, _)| *at <= wavelength);
        match (above.checked_sub(1), side.get(above)) {
            (None, None) => [(NONE, 0.0); 2],
            (None, Some((_, only))) => [(only, 1.0), (NONE, 0.0)],
            (Some(last), None) => [(&side[last].1, 1.0), (NONE, 0.0)],
            (Some(below), Some((upper, next))) => {
                let (lower, this) = &side[below];
                let part = (wavelength - lower) / (upper - lower);
                [(this, 1.0 - part), (next, part)]
            }
        }
    }

    /// The only lobe of light that meets a side, where it is one for all wavelengths, azimuths and ways; and its way. Most
    /// tables have one, and nothing has to be put together for it.
    #[inline]
    pub fn lone(&self, front: bool) -> Option<(bool, &Lobe)> {
        match &self.sheets[usize::from(!front)][..] {
            [(_, [Some(lobes), None])] => lobes.lone().map(|lobe| (false, lobe)),
            [(_, [None, Some(lobes)])] => lobes.lone().map(|lobe| (true, lobe)),
            _ => None,
        }
    }

    /// What one way of light is shared by: next to a wavelength, each with its part.
    pub fn lit(&self, incidence: &Incidence, front: bool, transmitted: bool, wavelength: f64) -> Ways<'_> {
        self.sheets(front, wavelength).map(|(ways, part)| {
            let lobes = ways[usize::from(transmitted)].as_ref().filter(|_| part > 0.0)?;
            Some((lobes.lit(incidence), part))
        })
    }

    /// The shares in the bases, reflected and transmitted.
    pub fn arriving(&self, incident: Vec3, media: &Media) -> [f64; 2] {
        let (incidence, front) = (Incidence::new(incident), incident.z > 0.0);
        if let Some((transmitted, lobe)) = self.lone(front) {
            return on_its_way(transmitted, lobe.shares(incidence.sine).1[2]);
        }
        [false, true].map(|way| {
            let ways = self.lit(&incidence, front, way, media.wavelength);
            ways.iter().flatten().map(|(lit, part)| part * lit.base()).sum()
        })
    }
}

/// A share of one way, and none of the other.
#[inline]
pub(super) const fn on_its_way(transmitted: bool, share: f64) -> [f64; 2] {
    if transmitted { [0.0, share] } else { [share, 0.0] }
}

/// The share of one way.
pub(super) fn share(ways: &Ways<'_>) -> f64 {
    ways.iter()
        .flatten()
        .fold(0.0, |sum, (lit, part)| sum + part * lit.share())
}

/// A slice or the base (None), picked by its share, with what is left of the number.
pub(super) fn pick<'a>(ways: &Ways<'a>, number: f64) -> (Option<&'a Grid>, f64) {
    let mut left = number * share(ways);
    let mut picked = (None, number);
    for (lit, part) in ways.iter().flatten() {
        let share = part * lit.share();
        picked = lit.pick(part_of(left, share));
        if left < share {
            break;
        }
        left -= share;
    }
    picked
}
