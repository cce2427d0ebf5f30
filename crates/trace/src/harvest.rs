//! What a trace amounts to: of one batch, and of many in their order.

use etendue_sampling::ordered::BATCH;

use crate::dealing::Dealing;
use crate::guide::Arrival;
use crate::kept::Kept;
use crate::ledger::Ledger;
use crate::scene::Scene;

/// A ray as a collecting surface keeps it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// \[mm\].
    pub position: [f64; 3],
    /// Unit vector.
    pub direction: [f64; 3],
    /// \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
}

/// Sums of a cell: Σ w, Σ w² with w the contribution of one ray and all its copies, and how many such contributed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Σ w.
    pub sum: f64,
    /// Σ w².
    pub squares: f64,
    /// Rays, copies of one counted once.
    pub rays: u64,
}

/// A contribution to a cell: its number, the ray or, of rays with copies, the unit (see [`Dealing`]), how much.
pub type Mark = (u32, u64, f64);

/// Cells, and what they have of units of which more rays may come.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// The cells of each stratum, one after the other.
    pub cells: Vec<Cell>,
    /// Number of cells of a stratum.
    width: usize,
    /// Sums of open units, by cell and unit.
    pub open: Vec<Mark>,
}

impl Tally {
    /// Empty cells of a number of strata, with sums of units that are open.
    #[must_use]
    pub fn new(width: usize, strata: usize, open: Vec<Mark>) -> Self {
        Self {
            cells: vec![Cell::default(); width * strata],
            width,
            open,
        }
    }

    /// Adds the contributions of a batch. Those of one unit to one cell belong together: they are not independent. Where a
    /// unit adds v to its sum w, Σ w² grows by (w + v)² − w², so that it is right at any time.
    ///
    /// `ahead`: as of [`Dealing::ahead`], after the batch.
    pub fn add(&mut self, mut marks: Vec<Mark>, dealing: &Dealing, ahead: &[u64]) {
        marks.sort_by_key(|(cell, unit, _)| (*cell, *unit));
        let before = std::mem::take(&mut self.open);
        let mut earlier = before.iter().peekable();
        for same in marks.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (number, unit, _) = same[0];
            let sum: f64 = same.iter().map(|(_, _, w)| w).sum();
            let stratum = dealing.stratum(unit);
            let mut held = None;
            if stratum > 0 {
                while let Some(mark) = earlier.next_if(|mark| (mark.0, mark.1) <= (number, unit)) {
                    if (mark.0, mark.1) == (number, unit) {
                        held = Some(mark.2);
                    } else {
                        self.keep(*mark, dealing, ahead);
                    }
                }
                self.keep((number, unit, held.unwrap_or(0.0) + sum), dealing, ahead);
            }
            let cell = &mut self.cells[stratum * self.width + number as usize];
            cell.sum += sum;
            cell.squares += sum * (2.0 * held.unwrap_or(0.0) + sum);
            cell.rays += u64::from(held.is_none());
        }
        for mark in earlier {
            self.keep(*mark, dealing, ahead);
        }
    }

    /// Keeps the sum of a unit while more of its rays may come.
    fn keep(&mut self, mark: Mark, dealing: &Dealing, ahead: &[u64]) {
        if ahead.get(dealing.stratum(mark.1)).is_some_and(|first| mark.1 >= *first) {
            self.open.push(mark);
        }
    }
}

/// What a number of batches amount to.
#[derive(Clone, Debug)]
pub struct Harvest {
    /// The flux account.
    pub ledger: Ledger,
    /// Cells of each detector that has some.
    pub tallies: Vec<Tally>,
    /// Flux that each source gave out, and all of them together: what shows how many equal rays theirs are as good as.
    pub births: Tally,
    /// Rays of each collecting surface.
    pub records: Vec<Vec<Record>>,
    /// Diffuse scatters of each detector of them.
    pub events: Vec<Kept>,
    /// Light that smooth surfaces sent to diffuse ones, if a detector asks for it.
    pub arrivals: Vec<Arrival>,
    /// Rays that the sources gave out.
    pub rays: u64,
    /// Largest | emitted − Σ fates | / emitted of a batch.
    pub imbalance: f64,
}

/// What one batch amounts to: contributions in the order in which they were made.
pub struct Yield {
    /// The flux account.
    pub ledger: Ledger,
    /// Contributions to each detector, by ray.
    pub marks: Vec<Vec<Mark>>,
    /// Flux that each source gave out as rays of their own, and all of them together.
    pub born: Vec<Cell>,
    /// Flux that sources gave out as copies of rays, and all of them together.
    pub copies: Vec<Mark>,
    /// Rays of each collecting surface.
    pub records: Vec<Vec<Record>>,
    /// Diffuse scatters of each detector of them.
    pub events: Vec<Kept>,
    /// Light that smooth surfaces sent to diffuse ones, if a detector asks for it.
    pub arrivals: Vec<Arrival>,
}

impl Yield {
    /// Nothing yet, of one of the batches of a run.
    #[must_use]
    pub fn new(scene: &Scene, batches: u64) -> Self {
        let detectors = scene.detectors.len();
        Self {
            ledger: Ledger::new(scene),
            marks: vec![Vec::new(); detectors],
            born: vec![Cell::default(); scene.sources.len() + 1],
            copies: Vec::new(),
            records: vec![Vec::new(); detectors],
            events: scene.detectors.iter().map(|d| Kept::of_batch(d, batches)).collect(),
            arrivals: Vec::new(),
        }
    }
}

/// Sums of open units, where a run goes on: of each detector, and at the end of the sources.
pub type Open = Vec<Vec<Mark>>;

impl Harvest {
    /// Nothing yet of a run that goes on where these units are open; empty at its start.
    #[must_use]
    pub fn new(scene: &Scene, dealing: &Dealing, open: Open) -> Self {
        let mut open = open.into_iter();
        let mut tally = |width| Tally::new(width, dealing.strata(), open.next().unwrap_or_default());
        Self {
            ledger: Ledger::new(scene),
            tallies: scene.detectors.iter().map(|d| tally(d.cells())).collect(),
            births: tally(scene.sources.len() + 1),
            records: vec![Vec::new(); scene.detectors.len()],
            events: scene.detectors.iter().map(Kept::of).collect(),
            arrivals: Vec::new(),
            rays: 0,
            imbalance: 0.0,
        }
    }

    /// Adds the next batch, which is number `batch` of the run.
    pub fn add(&mut self, part: Yield, dealing: &Dealing, batch: u64) {
        let [emitted, fates] = part.ledger.balance();
        let scale = if emitted.flux() > 0.0 { emitted.flux() } else { 1.0 };
        let lost = if emitted.rays == fates.rays { 0.0 } else { f64::INFINITY };
        self.imbalance = self.imbalance.max((emitted.flux() - fates.flux()).abs() / scale + lost);
        self.rays += emitted.rays;
        self.ledger.merge(&part.ledger);
        let ahead = dealing.ahead(batch * BATCH + emitted.rays);
        for (tally, marks) in self.tallies.iter_mut().zip(part.marks) {
            tally.add(marks, dealing, &ahead);
        }
        for (cell, born) in self.births.cells.iter_mut().zip(part.born) {
            cell.sum += born.sum;
            cell.squares += born.squares;
            cell.rays += born.rays;
        }
        self.births.add(part.copies, dealing, &ahead);
        for (all, events) in self.events.iter_mut().zip(part.events) {
            all.add(events);
        }
        self.arrivals.extend(part.arrivals);
        for (all, records) in self.records.iter_mut().zip(part.records) {
            all.extend(records);
        }
    }
}
