//! What a trace amounts to: of one batch, and of many in their order.

use etendue_sampling::ordered::BATCH;

use crate::dealing::Dealing;
use crate::detector::{Detector, Recorded};
use crate::events::EventReservoir;
use crate::guide::Arrival;
use crate::ledger::Ledger;
use crate::records::{Cell, CollectedRay, Contribution};
use crate::scene::Scene;

/// Cells, and what they have of units of which more rays may come.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// The cells of each stratum, one after the other.
    pub cells: Vec<Cell>,
    /// Number of cells of a stratum.
    width: usize,
    /// Sums of open units, by cell and unit.
    pub open: Vec<Contribution>,
}

impl Tally {
    /// Empty cells of a number of strata, with sums of units that are open.
    #[must_use]
    pub fn new(width: usize, strata: usize, open: Vec<Contribution>) -> Self {
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
    pub fn add(&mut self, mut marks: Vec<Contribution>, dealing: &Dealing, ahead: &[u64]) {
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
    fn keep(&mut self, mark: Contribution, dealing: &Dealing, ahead: &[u64]) {
        if ahead.get(dealing.stratum(mark.1)).is_some_and(|first| mark.1 >= *first) {
            self.open.push(mark);
        }
    }
}

/// What a number of batches amount to.
#[derive(Clone, Debug)]
pub struct TraceSums {
    /// The flux account.
    pub ledger: Ledger,
    /// Cells of each detector that has some.
    pub tallies: Vec<Tally>,
    /// Flux that each source gave out, and all of them together: what shows how many equal rays theirs are as good as.
    pub births: Tally,
    /// Rays of each collecting surface.
    pub records: Vec<Vec<CollectedRay>>,
    /// Scatter events of each detector of them.
    pub events: Vec<EventReservoir>,
    /// Light that smooth surfaces sent to diffuse ones, if a detector asks for it.
    pub arrivals: Vec<Arrival>,
    /// Rays that the sources gave out.
    pub rays: u64,
    /// Largest | emitted − Σ fates | / emitted of a batch.
    pub imbalance: f64,
}

/// What one batch amounts to: contributions in the order in which they were made.
pub struct BatchSums {
    /// The flux account.
    pub ledger: Ledger,
    /// What each detector recorded.
    pub detectors: Vec<Recorded>,
    /// Flux that each source gave out as rays of their own, and all of them together.
    pub born: Vec<Cell>,
    /// Flux that sources gave out as copies of rays, and all of them together.
    pub copies: Vec<Contribution>,
}

impl BatchSums {
    /// Nothing yet, of one of the batches of a run.
    #[must_use]
    pub fn new(scene: &Scene, detectors: &[Detector], batches: u64) -> Self {
        Self {
            ledger: Ledger::new(scene),
            detectors: detectors
                .iter()
                .map(|d| Recorded::of_batch(d.most_events(), batches))
                .collect(),
            born: vec![Cell::default(); scene.sources.len() + 1],
            copies: Vec::new(),
        }
    }
}

/// Sums of open units, where a run goes on: of each detector, and at the end of the sources.
pub type Open = Vec<Vec<Contribution>>;

impl TraceSums {
    /// Nothing yet of a run that goes on where these units are open; empty at its start.
    #[must_use]
    pub fn new(scene: &Scene, detectors: &[Detector], dealing: &Dealing, open: Open) -> Self {
        let mut open = open.into_iter();
        let mut tally = |width| Tally::new(width, dealing.strata(), open.next().unwrap_or_default());
        Self {
            ledger: Ledger::new(scene),
            tallies: detectors.iter().map(|d| tally(d.cells())).collect(),
            births: tally(scene.sources.len() + 1),
            records: vec![Vec::new(); detectors.len()],
            events: detectors.iter().map(|d| EventReservoir::new(d.most_events())).collect(),
            arrivals: Vec::new(),
            rays: 0,
            imbalance: 0.0,
        }
    }

    /// Adds the next batch, which is number `batch` of the run.
    pub fn add(&mut self, part: BatchSums, dealing: &Dealing, batch: u64) {
        let [emitted, fates] = part.ledger.balance();
        let scale = if emitted.flux() > 0.0 { emitted.flux() } else { 1.0 };
        let lost = if emitted.rays == fates.rays { 0.0 } else { f64::INFINITY };
        self.imbalance = self.imbalance.max((emitted.flux() - fates.flux()).abs() / scale + lost);
        self.rays += emitted.rays;
        self.ledger.merge(&part.ledger);
        let ahead = dealing.ahead(batch * BATCH + emitted.rays);
        for (number, recorded) in part.detectors.into_iter().enumerate() {
            self.tallies[number].add(recorded.contributions, dealing, &ahead);
            self.events[number].add(recorded.events);
            self.records[number].extend(recorded.rays);
            self.arrivals.extend(recorded.arrivals);
        }
        for (cell, born) in self.births.cells.iter_mut().zip(part.born) {
            cell.sum += born.sum;
            cell.squares += born.squares;
            cell.rays += born.rays;
        }
        self.births.add(part.copies, dealing, &ahead);
    }
}
