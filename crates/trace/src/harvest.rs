//! What a trace amounts to: of one batch, and of many in their order.

use crate::detector::Detector;
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

/// Sums of a cell: Σ w, Σ w² with w the contribution of one ray, and how many rays contributed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Σ w.
    pub sum: f64,
    /// Σ w².
    pub squares: f64,
    /// Rays.
    pub rays: u64,
}

/// What a number of batches amount to.
#[derive(Clone, Debug)]
pub struct Harvest {
    /// The flux account.
    pub ledger: Ledger,
    /// Cells of each detector that has some.
    pub cells: Vec<Vec<Cell>>,
    /// Rays of each collecting surface.
    pub records: Vec<Vec<Record>>,
    /// Diffuse scatters of each detector of them.
    pub events: Vec<Kept>,
    /// Rays that the sources gave out.
    pub rays: u64,
    /// Largest | emitted − Σ fates | / emitted of a batch.
    pub imbalance: f64,
}

/// What one batch amounts to: contributions in the order in which they were made.
pub struct Yield {
    /// The flux account.
    pub ledger: Ledger,
    /// For each detector: cell, ray, contribution.
    pub marks: Vec<Vec<(u32, u64, f64)>>,
    /// Rays of each collecting surface.
    pub records: Vec<Vec<Record>>,
    /// Diffuse scatters of each detector of them.
    pub events: Vec<Kept>,
}

impl Yield {
    /// Nothing yet, of one of the batches of a run.
    #[must_use]
    pub fn new(scene: &Scene, batches: u64) -> Self {
        let detectors = scene.detectors.len();
        Self {
            ledger: Ledger::new(scene),
            marks: vec![Vec::new(); detectors],
            records: vec![Vec::new(); detectors],
            events: scene.detectors.iter().map(|d| Kept::of_batch(d, batches)).collect(),
        }
    }
}

impl Harvest {
    /// Nothing yet.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let detectors = scene.detectors.len();
        let cells = |detector: &Detector| vec![Cell::default(); detector.cells()];
        Self {
            ledger: Ledger::new(scene),
            cells: scene.detectors.iter().map(cells).collect(),
            records: vec![Vec::new(); detectors],
            events: scene.detectors.iter().map(Kept::of).collect(),
            rays: 0,
            imbalance: 0.0,
        }
    }

    /// Adds the next batch.
    pub fn add(&mut self, part: Yield) {
        let [emitted, fates] = part.ledger.balance();
        let scale = if emitted.flux() > 0.0 { emitted.flux() } else { 1.0 };
        let lost = if emitted.rays == fates.rays { 0.0 } else { f64::INFINITY };
        self.imbalance = self.imbalance.max((emitted.flux() - fates.flux()).abs() / scale + lost);
        self.rays += emitted.rays;
        self.ledger.merge(&part.ledger);
        for (cells, marks) in self.cells.iter_mut().zip(part.marks) {
            gather(cells, marks);
        }
        for (all, events) in self.events.iter_mut().zip(part.events) {
            all.add(events);
        }
        for (all, records) in self.records.iter_mut().zip(part.records) {
            all.extend(records);
        }
    }
}

/// Adds contributions (cell, ray, w) to cells. Those of one ray to one cell belong together: they are not independent.
pub fn gather(cells: &mut [Cell], mut marks: Vec<(u32, u64, f64)>) {
    marks.sort_by_key(|(cell, ray, _)| (*cell, *ray));
    for same in marks.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let sum: f64 = same.iter().map(|(_, _, w)| w).sum();
        let cell = &mut cells[same[0].0 as usize];
        cell.sum += sum;
        cell.squares += sum * sum;
        cell.rays += 1;
    }
}
