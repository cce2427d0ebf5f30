//! The flux ledger: every ray has one fate, and all fates together carry what was emitted.

use crate::scene::Scene;

/// Why a ray was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// It left a solid that it was not in, or entered one that it was in: the solid is open, or its normals do not agree.
    Contradiction,
    /// It is in more than four solids at once.
    TooDeep,
    /// It has no direction or no position any more, or came without.
    NotFinite,
    /// A medium has no refractive index at its wavelength.
    NoIndex,
}

impl Loss {
    /// Every reason, in order.
    pub const ALL: [Self; 4] = [Self::Contradiction, Self::TooDeep, Self::NotFinite, Self::NoIndex];

    /// Its name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Contradiction => "contradiction",
            Self::TooDeep => "more than four solids at once",
            Self::NotFinite => "not finite",
            Self::NoIndex => "no refractive index",
        }
    }
}

/// Flux and number of rays. The sum is kept with what rounding takes from it (Neumaier), so that accounts of any length
/// close to rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entry {
    sum: f64,
    rest: f64,
    /// Rays.
    pub rays: u64,
}

impl Entry {
    /// \[flux unit\].
    #[must_use]
    pub fn flux(&self) -> f64 {
        self.sum + self.rest
    }

    #[inline]
    fn plus(&mut self, flux: f64) {
        let sum = self.sum + flux;
        let (large, small) = if self.sum.abs() >= flux.abs() {
            (self.sum, flux)
        } else {
            (flux, self.sum)
        };
        self.rest += (large - sum) + small;
        self.sum = sum;
    }

    /// One ray more.
    #[inline]
    pub fn add(&mut self, flux: f64) {
        self.plus(flux);
        self.rays += 1;
    }

    /// Many rays more, by their fluxes \[flux unit\], in eight sums side by side.
    pub fn add_all(&mut self, fluxes: &[f64]) {
        let eights = fluxes.chunks_exact(8);
        let rest = eights.remainder();
        let mut sums = [0.0; 8];
        for eight in eights {
            for (sum, flux) in sums.iter_mut().zip(eight) {
                *sum += flux;
            }
        }
        for flux in sums.iter().chain(rest) {
            self.plus(*flux);
        }
        self.rays += fluxes.len() as u64;
    }

    /// Another entry's sums.
    pub fn merge(&mut self, other: &Self) {
        self.plus(other.sum);
        self.rest += other.rest;
        self.rays += other.rays;
    }
}

/// What happened to a ray in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It left the scene.
    Escaped,
    /// Absorbed on a face, by its number.
    OnFace(u32),
    /// Absorbed in a medium, by its number.
    InMedium(usize),
    /// Ended after the largest number of events that a ray may have.
    Terminated,
    /// Lost, for a reason, at a face.
    Lost(Loss, u32),
}

/// The account of a number of rays.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger {
    /// By source.
    pub emitted: Vec<Entry>,
    /// What left the scene.
    pub escaped: Entry,
    /// By face.
    pub on_face: Vec<Entry>,
    /// By medium.
    pub in_medium: Vec<Entry>,
    /// What had too many events.
    pub terminated: Entry,
    /// By reason, in the order of [`Loss::ALL`].
    pub lost: [Entry; Loss::ALL.len()],
    /// The face at which the first ray of each reason was lost.
    pub lost_at: [Option<u32>; Loss::ALL.len()],
    /// Rays times faces met: nearest-hit queries.
    pub segments: u64,
}

impl Ledger {
    /// An empty account.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self {
            emitted: vec![Entry::default(); scene.sources.len()],
            escaped: Entry::default(),
            on_face: vec![Entry::default(); scene.roles.len()],
            in_medium: vec![Entry::default(); scene.media.len()],
            terminated: Entry::default(),
            lost: Default::default(),
            lost_at: [None; Loss::ALL.len()],
            segments: 0,
        }
    }

    /// Books the fate of a ray.
    #[inline]
    pub fn book(&mut self, fate: Fate, flux: f64) {
        match fate {
            Fate::Escaped => self.escaped.add(flux),
            Fate::OnFace(number) => self.on_face[number as usize].add(flux),
            Fate::InMedium(medium) => self.in_medium[medium].add(flux),
            Fate::Terminated => self.terminated.add(flux),
            Fate::Lost(loss, number) => {
                let reason = loss as usize;
                self.lost[reason].add(flux);
                self.lost_at[reason].get_or_insert(number);
            }
        }
    }

    /// Adds another account.
    pub fn merge(&mut self, other: &Self) {
        let lists = [
            (&mut self.emitted, &other.emitted),
            (&mut self.on_face, &other.on_face),
            (&mut self.in_medium, &other.in_medium),
        ];
        for (mine, theirs) in lists {
            mine.iter_mut().zip(theirs).for_each(|(a, b)| a.merge(b));
        }
        self.escaped.merge(&other.escaped);
        self.terminated.merge(&other.terminated);
        self.lost.iter_mut().zip(&other.lost).for_each(|(a, b)| a.merge(b));
        for (mine, theirs) in self.lost_at.iter_mut().zip(other.lost_at) {
            *mine = mine.or(theirs);
        }
        self.segments += other.segments;
    }

    /// What was emitted, and the sum of all fates.
    #[must_use]
    pub fn balance(&self) -> [Entry; 2] {
        let sum = |entries: &mut dyn Iterator<Item = &Entry>| {
            entries.fold(Entry::default(), |mut total, entry| {
                total.merge(entry);
                total
            })
        };
        let fates = [self.escaped, self.terminated];
        let mut all = self
            .on_face
            .iter()
            .chain(&self.in_medium)
            .chain(&self.lost)
            .chain(&fates);
        [sum(&mut self.emitted.iter()), sum(&mut all)]
    }
}
