//! What a trace amounts to: of one batch, and of the batches of a work unit in their order.

use etendue_sampling::ordered::BATCH;

use crate::dealing::Dealing;
use crate::detector::{Detector, Recorded};
use crate::events::EventReservoir;
use crate::guide::Arrival;
use crate::ledger::Ledger;
use crate::records::{Cell, CollectedRay, Contribution, merge};
use crate::scene::Scene;

/// Sums of cells over the batches of a work unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally {
    /// Of rays without copies, stratum by stratum.
    pub cells: Vec<Cell>,
    /// Of rays with copies: what each unit (see [`Dealing`]) adds to a cell, in the order of cells and units.
    pub copies: Vec<Contribution>,
}

impl Tally {
    /// So many empty cells.
    #[must_use]
    pub fn new(cells: usize, dealing: &Dealing) -> Self {
        Self {
            cells: vec![Cell::default(); cells * dealing.plain()],
            copies: Vec::new(),
        }
    }

    /// Adds the contributions of a batch, [`brought_together`].
    pub fn add(&mut self, contributions: &[Contribution], dealing: &Dealing) {
        let each = self.cells.len() / dealing.plain();
        for contribution in contributions {
            let stratum = dealing.stratum(contribution.unit);
            if stratum < dealing.plain() {
                self.cells[stratum * each + contribution.cell as usize].add(contribution);
            } else {
                self.copies.push(*contribution);
            }
        }
    }

    /// Adds the sums of a batch over all cells, stratum by stratum, to the last cell (see [`sum_up`]).
    fn add_whole(&mut self, sums: &[Cell]) {
        let each = self.cells.len().checked_div(sums.len()).unwrap_or(0);
        for (own, sum) in self.cells.chunks_mut(each.max(1)).zip(sums) {
            if let Some(last) = own.last_mut() {
                last.join(sum);
            }
        }
    }

    /// Brings what batches have of the same unit together, when all of them are added.
    fn settle(&mut self) {
        // Stable: sums are formed in the order of the batches.
        self.copies.sort_by_key(Contribution::place);
        merge(&mut self.copies);
    }
}

/// Contributions to so many cells in the order of cells and units, one of each unit to a cell: those of one ray, and of its
/// copies, are not independent.
pub fn brought_together(contributions: &mut Vec<Contribution>, cells: usize) {
    *contributions = in_order(std::mem::take(contributions), cells);
    merge(contributions);
}

/// What units contribute to all cells together: of rays without copies the sums, stratum by stratum; of rays with copies as
/// contributions to one cell more, by its number, in the order of units.
///
/// # Panics
/// If there are more cells than can be counted.
#[must_use]
pub fn sum_up<'a>(
    contributions: impl Iterator<Item = &'a Contribution> + Clone,
    cell: usize,
    dealing: &Dealing,
) -> (Vec<Cell>, Vec<Contribution>) {
    let cell = u32::try_from(cell).expect("few cells");
    let (mut sums, mut copies) = (vec![Cell::default(); dealing.plain()], vec![]);
    each_unit(contributions, |unit, amount, flux| {
        let whole = Contribution {
            cell,
            unit,
            amount,
            flux,
        };
        match sums.get_mut(dealing.stratum(unit)) {
            Some(sum) => sum.add(&whole),
            None => copies.push(whole),
        }
    });
    (sums, copies)
}

/// Units among which those of a batch lie, in batches, so that each can have a place.
const NEAR: u64 = 4;

/// Calls `visit` with each unit of some contributions, in their order, with what it contributes to all cells and its flux.
fn each_unit<'a>(contributions: impl Iterator<Item = &'a Contribution> + Clone, mut visit: impl FnMut(u64, f64, f64)) {
    let units = contributions.clone().map(|own| own.unit);
    let (Some(first), Some(last)) = (units.clone().min(), units.max()) else {
        return;
    };
    if last - first < NEAR * BATCH {
        #[allow(clippy::cast_possible_truncation, reason = "fewer than there is room for")]
        let place = |unit: u64| (unit - first) as usize;
        // Units that are not among them have no flux.
        let mut whole = vec![(0.0, f64::NAN); place(last) + 1];
        for own in contributions {
            let (amount, flux) = &mut whole[place(own.unit)];
            (*amount, *flux) = (*amount + own.amount, own.flux);
        }
        for (unit, (amount, flux)) in (first..).zip(whole) {
            if !flux.is_nan() {
                visit(unit, amount, flux);
            }
        }
    } else {
        let mut whole: Vec<_> = contributions.map(|own| Contribution { cell: 0, ..*own }).collect();
        whole.sort_by_key(Contribution::place);
        merge(&mut whole);
        for own in whole {
            visit(own.unit, own.amount, own.flux);
        }
    }
}

/// Bits of a cell's number that contributions are dealt out by at once.
const DIGIT: u32 = 11;

/// Contributions to so many cells in the order of cells and units; those of the same cell and unit stay in theirs.
fn in_order(mut contributions: Vec<Contribution>, cells: usize) -> Vec<Contribution> {
    let bits = cells.max(2).next_power_of_two().ilog2();
    let passes = bits.div_ceil(DIGIT);
    let digit = bits.div_ceil(passes);
    if contributions.len() < 1 << digit {
        contributions.sort_by_key(Contribution::place);
        return contributions;
    }
    // By the cells digit by digit, the last one first: few of one cell are left to be sorted by their units.
    let mut dealt = contributions.clone();
    let mut places = vec![0; 1 << digit];
    for pass in 0..passes {
        let digit_of = |cell: u32| (cell >> (pass * digit)) as usize & ((1 << digit) - 1);
        places.fill(0);
        for contribution in &contributions {
            places[digit_of(contribution.cell)] += 1;
        }
        let mut before = 0;
        for place in &mut places {
            before += std::mem::replace(place, before);
        }
        for contribution in &contributions {
            let place = &mut places[digit_of(contribution.cell)];
            dealt[*place] = *contribution;
            *place += 1;
        }
        std::mem::swap(&mut contributions, &mut dealt);
    }
    for of_cell in contributions.chunk_by_mut(|a, b| a.cell == b.cell) {
        of_cell.sort_by_key(Contribution::place);
    }
    contributions
}

/// What a work unit's copies of rays add to a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Joined {
    /// Cell, stratum, and what it grows by.
    pub cells: Vec<(u32, usize, Cell)>,
    /// Sums of the units of which more copies may come, by cell and unit.
    pub open: Vec<Contribution>,
}

/// Adds the copies of a work unit to a run, whose earlier work units left sums of units `open`, and which has now given out
/// `done` rays; both lists are in the order of cells and units.
///
/// Where a unit adds v to its sum w, Σ w² grows by (w + v)² − w², so that it is right at any time.
#[must_use]
pub fn join(dealing: &Dealing, open: &[Contribution], copies: &[Contribution], done: u64) -> Joined {
    let ahead = dealing.ahead(done);
    let mut joined = Joined::default();
    let mut keep = |unit: Contribution, stratum: usize| {
        if ahead.get(stratum).is_some_and(|first| unit.unit >= *first) {
            joined.open.push(unit);
        }
    };
    let mut earlier = open.iter().peekable();
    for &grown in copies {
        let mut held = None;
        while let Some(other) = earlier.next_if(|other| other.place() <= grown.place()) {
            if other.place() == grown.place() {
                held = Some(other.amount);
            } else {
                keep(*other, dealing.stratum(other.unit));
            }
        }
        let (stratum, before) = (dealing.stratum(grown.unit), held.unwrap_or(0.0));
        let (cell, sum) = (grown.cell, grown.amount);
        keep(
            Contribution {
                amount: before + sum,
                ..grown
            },
            stratum,
        );
        if joined
            .cells
            .last()
            .is_none_or(|last| (last.0, last.1) != (cell, stratum))
        {
            joined.cells.push((cell, stratum, Cell::default()));
        }
        if let Some((_, _, cell)) = joined.cells.last_mut() {
            cell.sum += sum;
            cell.squares += sum * (2.0 * before + sum);
            cell.products += sum * grown.flux;
            cell.rays += u64::from(held.is_none());
        }
    }
    for other in earlier {
        keep(*other, dealing.stratum(other.unit));
    }
    joined
}

/// What a work unit amounts to.
#[derive(Clone, Debug)]
pub struct TraceSums {
    /// The flux account.
    pub ledger: Ledger,
    /// Cells of each detector that has some.
    pub tallies: Vec<Tally>,
    /// Flux that each source gave out, and all of them together: what shows how many equal rays theirs are as good as.
    pub emitted: Tally,
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
    /// Flux that each source gave out as rays without copies, and all of them together, stratum by stratum.
    pub own: Vec<Cell>,
    /// Flux that sources gave out as copies of rays, and all of them together.
    pub copies: Vec<Contribution>,
}

impl BatchSums {
    /// Nothing yet, of one of the batches of a run.
    #[must_use]
    pub fn new(scene: &Scene, detectors: &[Detector], dealing: &Dealing, batches: u64) -> Self {
        Self {
            ledger: Ledger::new(scene),
            detectors: detectors
                .iter()
                .map(|d| Recorded::of_batch(d.most_events(), batches))
                .collect(),
            own: vec![Cell::default(); (scene.sources.len() + 1) * dealing.plain()],
            copies: Vec::new(),
        }
    }
}

impl TraceSums {
    /// Nothing yet.
    #[must_use]
    pub fn new(scene: &Scene, detectors: &[Detector], dealing: &Dealing) -> Self {
        Self {
            ledger: Ledger::new(scene),
            tallies: detectors.iter().map(|d| Tally::new(d.cells(), dealing)).collect(),
            emitted: Tally::new(scene.sources.len() + 1, dealing),
            records: vec![Vec::new(); detectors.len()],
            events: detectors.iter().map(|d| EventReservoir::new(d.most_events())).collect(),
            arrivals: Vec::new(),
            rays: 0,
            imbalance: 0.0,
        }
    }

    /// The sums of batches, in their order.
    #[must_use]
    pub fn of(scene: &Scene, detectors: &[Detector], dealing: &Dealing, batches: Vec<BatchSums>) -> Self {
        let mut sums = Self::new(scene, detectors, dealing);
        for batch in batches {
            sums.add(batch, dealing);
        }
        sums.tallies.iter_mut().for_each(Tally::settle);
        sums.emitted.settle();
        sums
    }

    fn add(&mut self, part: BatchSums, dealing: &Dealing) {
        let [emitted, fates] = part.ledger.balance();
        let scale = if emitted.flux() > 0.0 { emitted.flux() } else { 1.0 };
        let lost = if emitted.rays == fates.rays { 0.0 } else { f64::INFINITY };
        self.imbalance = self.imbalance.max((emitted.flux() - fates.flux()).abs() / scale + lost);
        self.rays += emitted.rays;
        self.ledger.merge(&part.ledger);
        for (number, recorded) in part.detectors.into_iter().enumerate() {
            self.tallies[number].add(&recorded.contributions, dealing);
            self.tallies[number].add_whole(&recorded.whole);
            self.events[number].add(recorded.events);
            self.records[number].extend(recorded.rays);
            self.arrivals.extend(recorded.arrivals);
        }
        for (cell, own) in self.emitted.cells.iter_mut().zip(&part.own) {
            cell.join(own);
        }
        self.emitted.add(&part.copies, dealing);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use etendue_sampling::philox::Stream;

    use super::*;

    fn contribution(cell: u32, unit: u64, amount: f64) -> Contribution {
        Contribution {
            cell,
            unit,
            amount,
            flux: 1.0,
        }
    }

    #[test]
    fn contributions_come_in_the_order_of_cells_and_units_and_stay_in_their_own() {
        let stream = Stream::new(7, 2);
        for (number, cells) in [(0, 5), (40, 1), (3000, 2), (3000, 2049), (9000, 200_000_u32)] {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small numbers")]
            let of = |i: u64| {
                let [a, b, ..] = stream.uniforms(i, 0);
                contribution((a * a * f64::from(cells)) as u32, (b * 50.0) as u64, i as f64)
            };
            let made: Vec<Contribution> = (0..number).map(of).collect();
            let mut expected = made.clone();
            expected.sort_by_key(Contribution::place);
            assert_eq!(in_order(made, cells as usize), expected);
        }
    }

    #[test]
    fn what_is_summed_up_is_that_of_each_unit() {
        // Rays of a lamp; units of 50 and of 10⁶ rays with copies lie close together, and far apart.
        for length in [50, 1_000_000] {
            let dealing = Dealing::new(&[1.0, 1.0], &[None, Some((0, length))], 4 * length);
            let ahead = 4 * length;
            let made: Vec<Contribution> = [
                (0, 7, 1.0),
                (2, ahead, 8.0),
                (0, 9, 2.0),
                (2, 7, 4.0),
                (3, 8, 0.0),
                (3, ahead, 16.0),
            ]
            .map(|(cell, unit, amount)| contribution(cell, unit, amount))
            .to_vec();
            let (sums, copies) = sum_up(made.iter(), 5, &dealing);
            let mut expected = Cell::default();
            for (unit, amount) in [(7, 5.0), (8, 0.0), (9, 2.0)] {
                expected.add(&contribution(5, unit, amount));
            }
            assert_eq!(sums, [expected]);
            assert_eq!(copies, [contribution(5, ahead, 24.0)]);
        }
        let none = sum_up([].iter(), 3, &Dealing::new(&[1.0], &[None], 9));
        assert_eq!(none, (vec![Cell::default()], vec![]));
    }

    /// However a run is cut into work units: Σ w² is that of whole units, Σ w v of what they bring in the whole run, and none
    /// is open at the end.
    #[test]
    fn copies_that_go_on_from_one_work_unit_to_the_next_are_one_contribution() {
        let rays = 5 * BATCH + 1234;
        // A lamp, a set of 1000 rays given out many times, one of 7 that two sources share, one of which a part is given out.
        let fluxes = [0.3, 1.7, 0.05, 0.11, 0.2];
        let sets = [None, Some((0, 1000)), Some((1, 7)), Some((1, 7)), Some((2, 1_000_000))];
        let dealing = Dealing::new(&fluxes, &sets, rays);
        let stream = Stream::new(5, 1);
        // Flux of the record that a ray of a source is of, over what the source says of all of them.
        let record = |unit: u64| (unit % 5 + 1) as f64;
        let ray = |batch: u64, number: u64| {
            let unit = dealing.units(batch, std::iter::once(number))[0].0;
            let (mut before, mut source) = (dealing.first(batch), 0);
            for (s, range) in dealing.batch(batch).iter().enumerate() {
                source = if number >= before && range.start < range.end {
                    s
                } else {
                    source
                };
                before += range.end - range.start;
            }
            (
                source,
                unit,
                record(unit) * fluxes[source] / dealing.count(source) as f64,
            )
        };
        let contributions = |batch: u64| -> Vec<Contribution> {
            let numbers = batch * BATCH..((batch + 1) * BATCH).min(rays);
            let mut list: Vec<Contribution> = numbers
                .filter(|ray| stream.word(*ray).is_multiple_of(4))
                .map(|number| Contribution {
                    cell: u32::from(stream.word(number).to_le_bytes()[1] % 3),
                    unit: number,
                    amount: (stream.word(number) >> 40) as f64,
                    flux: ray(batch, number).2,
                })
                .collect();
            dealing.by_units(batch, list.iter_mut());
            brought_together(&mut list, 3);
            list
        };
        let mut whole: BTreeMap<(u32, u64), f64> = BTreeMap::new();
        for of_unit in (0..6).flat_map(contributions) {
            *whole.entry(of_unit.place()).or_default() += of_unit.amount;
        }
        let mut brought: BTreeMap<u64, f64> = BTreeMap::new();
        for number in 0..rays {
            let (_, unit, flux) = ray(number / BATCH, number);
            *brought.entry(unit).or_default() += flux;
        }
        let mut expected = vec![Cell::default(); 12];
        for ((cell, unit), w) in whole {
            expected[dealing.stratum(unit) * 3 + cell as usize].add(&Contribution {
                cell,
                unit,
                amount: w,
                flux: brought[&unit],
            });
        }
        for cuts in [&[0, 6][..], &[0, 1, 2, 3, 4, 5, 6], &[0, 2, 5, 6]] {
            let (mut found, mut open) = (vec![Cell::default(); 12], Vec::new());
            for pair in cuts.windows(2) {
                let mut tally = Tally::new(3, &dealing);
                (pair[0]..pair[1]).for_each(|batch| tally.add(&contributions(batch), &dealing));
                tally.settle();
                let joined = join(&dealing, &open, &tally.copies, (pair[1] * BATCH).min(rays));
                open = joined.open;
                let own = tally.cells.iter().enumerate().map(|(cell, sums)| (cell, *sums));
                let copied = joined
                    .cells
                    .iter()
                    .map(|(cell, stratum, sums)| (stratum * 3 + *cell as usize, *sums));
                for (place, sums) in own.chain(copied) {
                    found[place].sum += sums.sum;
                    found[place].squares += sums.squares;
                    found[place].products += sums.products;
                    found[place].rays += sums.rays;
                }
                assert_eq!(open.is_empty(), pair[1] == 6);
            }
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(found.rays, expected.rays);
                // Whole numbers below 2⁵³ add up exactly; their squares do not.
                assert_eq!(found.sum, expected.sum);
                assert!((found.squares / expected.squares - 1.0).abs() < 1e-12);
                assert!((found.products / expected.products - 1.0).abs() < 1e-10);
            }
        }
    }
}
