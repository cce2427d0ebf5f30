//! From the sources to the detectors.
//!
//! Every ray keeps its flux and has one fate: at a surface it goes into one of the lobes, or is absorbed, by chance in
//! proportion to their shares, and in a medium it is absorbed at a distance drawn from Beer's law. So the rays that a
//! detector keeps have equal flux if those of the source have.
//!
//! `flock`: rays on their way, sorted by what comes next; `bounce`: many at once off a plain wall; `step`: one by one; `note`:
//! detectors take note.

mod bounce;
mod flock;
mod note;
mod step;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue_geometry::assembly::Hits;
use etendue_geometry::batch::BLOCK;
use etendue_geometry::lines::NONE;
use etendue_geometry::{RayBatch, RaySource};
use etendue_math::Vec3;
use etendue_optics::source::Lantern;
use etendue_sampling::ordered::BATCH;
use etendue_sampling::philox::{Pairs, fill_pairs};
use rayon::prelude::*;

use crate::dealing::Dealing;
use crate::detector::Detector;
use crate::harvest::{Harvest, Open, Yield};
use crate::kept::depth;
use crate::ledger::Fate;
use crate::meeting::{Fillings, Loss};
use crate::scene::Scene;
use crate::sharing::Brightness;
use crate::start::place_near;

use bounce::{Bouncer, Gathered, bouncers};
use flock::{Flock, Rider, Sorter};

/// The purpose under which the events of traced rays are drawn (see [`Pairs::new`]).
const PURPOSE_TRACE: u32 = 0x5452_4143;

/// How many rays, and how.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    /// Of all sources together.
    pub rays: u64,
    /// Seed of the run.
    pub seed: u64,
    /// Events that a ray may have before it is ended.
    pub most_events: u32,
    /// The ray sets that sources refer to.
    pub sets: &'a [&'a dyn RaySource],
    /// Set by whoever wants the work to end at once; what it returns is then worth nothing.
    pub stop: Option<&'a AtomicBool>,
    /// What each source needs to be seen; none are needed unless a light image shares light with lines of sight.
    pub lanterns: &'a [Option<Lantern>],
}

impl Run<'_> {
    fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed))
    }
}

/// Traces batches `batches` of a run on the threads of the current pool, and merges them in order.
#[must_use]
pub fn trace(scene: &Scene, run: &Run<'_>, batches: Range<u64>) -> Harvest {
    trace_on(scene, run, batches, Open::new())
}

/// As [`trace`], of a run whose earlier batches left these sums of open units.
#[must_use]
pub fn trace_on(scene: &Scene, run: &Run<'_>, batches: Range<u64>, open: Open) -> Harvest {
    let dealing = Dealing::of(scene, run.rays, run.sets);
    let parts: Vec<Yield> = batches
        .clone()
        .into_par_iter()
        .map(|b| trace_batch(scene, run, &dealing, b))
        .collect();
    let mut harvest = Harvest::new(scene, &dealing, open);
    for (part, batch) in parts.into_iter().zip(batches) {
        harvest.add(part, &dealing, batch);
    }
    harvest
}

/// A block of rays that are followed to their ends.
struct Walk<'a> {
    scene: &'a Scene,
    run: &'a Run<'a>,
    dealing: &'a Dealing,
    pairs: Pairs,
    fillings: Fillings,
    /// The rays of the block as they were born: the first one's number in the run, and what they carry.
    first: u64,
    riders: Vec<Rider>,
    /// Those on their way, and those that go on from there.
    now: Flock,
    next: Flock,
    hits: Hits,
    sorter: Sorter,
    /// Rays whose random numbers are wanted, and the numbers.
    addresses: Vec<u64>,
    numbers: [Vec<f64>; 2],
    /// Those of the rays that meet a face which are not absorbed.
    going: Vec<u32>,
    gathered: Gathered,
    /// Fluxes of the rays that leave the scene.
    fluxes: Vec<f64>,
    /// Where each ray has been, if that is wanted.
    trails: Option<Vec<Vec<Vec3>>>,
    /// How far a ray that escapes is followed on its trail \[mm\].
    far: f64,
    out: Yield,
}

fn trace_batch(scene: &Scene, run: &Run<'_>, dealing: &Dealing, batch: u64) -> Yield {
    let mut walk = Walk::new(scene, run, dealing);
    walk.batch(batch);
    let copied = walk.out.marks.iter_mut().flatten();
    dealing.units(batch, copied.map(|(_, ray, _)| ray));
    dealing.units(batch, walk.out.copies.iter_mut().map(|(_, ray, _)| ray));
    // Copies follow each other: one mark for all of them.
    walk.out.copies.dedup_by(|next, first| {
        let same = (next.0, next.1) == (first.0, first.1);
        if same {
            first.2 += next.2;
        }
        same
    });
    walk.out
}

/// The points at which the first rays of a run (a batch at most) start, turn and end, for drawings; a ray that escapes ends
/// `far` from its last turn.
#[must_use]
pub fn trails(scene: &Scene, run: &Run<'_>, far: f64) -> Vec<Vec<Vec3>> {
    let dealing = Dealing::of(scene, run.rays, run.sets);
    let mut walk = Walk::new(scene, run, &dealing);
    walk.trails = Some(Vec::new());
    walk.sorter = Sorter::new(scene, Vec::new());
    walk.far = far;
    walk.batch(0);
    walk.trails.unwrap_or_default()
}

impl<'a> Walk<'a> {
    fn new(scene: &'a Scene, run: &'a Run<'a>, dealing: &'a Dealing) -> Self {
        Self {
            scene,
            run,
            dealing,
            pairs: Pairs::new(run.seed, PURPOSE_TRACE),
            fillings: Fillings::new(scene),
            first: 0,
            riders: Vec::with_capacity(BLOCK),
            now: Flock::default(),
            next: Flock::default(),
            hits: Hits::default(),
            sorter: Sorter::new(scene, bouncers(scene)),
            addresses: Vec::new(),
            numbers: Default::default(),
            going: Vec::new(),
            gathered: Gathered::default(),
            fluxes: Vec::new(),
            trails: None,
            far: 0.0,
            out: Yield::new(scene, run.rays.div_ceil(BATCH)),
        }
    }

    /// Traces one batch.
    fn batch(&mut self, batch: u64) {
        let (scene, run) = (self.scene, self.run);
        let mut births = RayBatch::default();
        self.first = batch * BATCH;
        for (number, range) in self.dealing.batch(batch).into_iter().enumerate() {
            let source = &scene.sources[number];
            let count = self.dealing.count(number);
            let mut start = range.start;
            while start < range.end {
                let stop = (start + BLOCK as u64).min(range.end);
                source.emit(number as u64, start..stop, count, run.seed, run.sets, &mut births);
                self.count(&births, number);
                self.begin(&births, number, start);
                self.finish();
                for kept in &mut self.out.events {
                    kept.settle();
                }
                self.first += stop - start;
                start = stop;
            }
        }
    }

    /// Counts the rays that a source gave out.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 sources")]
    fn count(&mut self, births: &RayBatch, number: usize) {
        let (fluxes, all) = (&births.flux[..births.len], self.scene.sources.len());
        if self.dealing.stratum_of(number) > 0 {
            for cell in [number, all] {
                let marks = (self.first..).zip(fluxes).map(|(ray, flux)| (cell as u32, ray, *flux));
                self.out.copies.extend(marks);
            }
            return;
        }
        let sums = fluxes
            .iter()
            .fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
        for cell in [number, all] {
            let cell = &mut self.out.born[cell];
            cell.sum += sums.0;
            cell.squares += sums.1;
            cell.rays += births.len as u64;
        }
    }

    /// Takes in the rays that a source gave out, from its ray `start` on.
    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
    fn begin(&mut self, births: &RayBatch, number: usize, start: u64) {
        let (scene, run) = (self.scene, self.run);
        let (source, near) = (&scene.sources[number], &scene.near[number]);
        let total = scene.sources.iter().map(|s| s.flux).sum();
        let lantern = run.lanterns.get(number).and_then(Option::as_ref);
        let shared = scene.detectors.iter().any(Detector::shares);
        let brightness = shared.then(|| Brightness::new(source, lantern, total));
        let keeps = scene.detectors.iter().any(|d| matches!(d, Detector::Events { .. }));
        let n = births.len;
        self.out.ledger.emitted[number].add_all(&births.flux[..n]);
        self.riders.clear();
        self.riders.extend((0..n).map(|i| {
            let ray = self.first + i as u64;
            Rider {
                flux: births.flux[i],
                wavelength: match births.colour.get(i) {
                    Some(stated) => *stated,
                    None => source.wavelength(run.seed, number as u64, start + i as u64),
                },
                ray,
                scattered: false,
                unseen: !source.is_visible(),
                brightness: brightness.map_or(f64::INFINITY, |b| b.at(births.position(i), births.direction(i))),
                family: number as u32,
                depth: if keeps { depth(run.seed, ray) } else { 0 },
            }
        }));
        self.now.clear();
        if near.is_empty() && self.trails.is_none() && (0..n).all(|i| births.usable(i)) {
            let [o, d] = [&births.position, &births.direction].map(|lists| lists.each_ref().map(|list| &list[..n]));
            self.now.extend(o, d, 0..n as u32, NONE, (0..n).map(|_| NONE));
            return;
        }
        for i in 0..n {
            let Rider { ray, flux, .. } = self.riders[i];
            if !births.usable(i) {
                self.out.ledger.book(Fate::Lost(Loss::NotFinite, NONE), flux);
                continue;
            }
            let (o, d) = (births.position(i), births.direction(i));
            match place_near(scene, o, d, near) {
                Ok((inside, leaving)) => {
                    self.mark(ray, o);
                    self.now.push(i as u32, (o, d, leaving), inside);
                }
                Err((loss, face)) => self.out.ledger.book(Fate::Lost(loss, face), flux),
            }
        }
    }

    /// A point more on the trail of a ray.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "below the size of a batch")]
    fn mark(&mut self, ray: u64, point: Vec3) {
        if let Some(trails) = &mut self.trails {
            let slot = (ray % BATCH) as usize;
            trails.resize(trails.len().max(slot + 1), Vec::new());
            trails[slot].push(point);
        }
    }

    /// Follows all rays of the block to their ends. At any time all of them have had the same number of events.
    fn finish(&mut self) {
        // Lent out, so that what is done with one ray can use all else.
        let (mut now, mut next) = (std::mem::take(&mut self.now), std::mem::take(&mut self.next));
        let (mut hits, mut sorter) = (std::mem::take(&mut self.hits), std::mem::take(&mut self.sorter));
        let mut event = 0;
        while !now.is_empty() && !self.run.is_stopped() {
            self.scene.assembly.nearest(&now.lines, &mut hits);
            self.out.ledger.segments += now.len() as u64;
            let last = event + 1 >= self.run.most_events;
            sorter.sort(&now, &hits, last);
            self.let_go(&now, sorter.gone());
            next.clear();
            for (bouncer, which) in sorter.bounced() {
                self.draw(&now, which, event);
                self.bounce(bouncer, which, &now, &hits, &mut next);
            }
            self.draw(&now, sorter.single(), event);
            for (k, i) in sorter.single().iter().enumerate() {
                let numbers = self.numbers.each_ref().map(|list| list[k]);
                self.step(&now, &hits, *i as usize, numbers, event, &mut next);
            }
            std::mem::swap(&mut now, &mut next);
            event += 1;
        }
        (self.now, self.next, self.hits, self.sorter) = (now, next, hits, sorter);
    }

    /// Two random numbers for each of some rays.
    fn draw(&mut self, now: &Flock, which: &[u32], event: u32) {
        let address = |i: &u32| self.first + u64::from(now.who[*i as usize]);
        self.addresses.clear();
        self.addresses.extend(which.iter().map(address));
        fill_pairs(self.pairs, &self.addresses, event, &mut self.numbers);
    }

    /// Rays leave the scene.
    fn let_go(&mut self, now: &Flock, which: &[u32]) {
        self.fluxes.clear();
        let flux = |i: &u32| self.riders[now.who[*i as usize] as usize].flux;
        self.fluxes.extend(which.iter().map(flux));
        self.out.ledger.escaped.add_all(&self.fluxes);
        if self.trails.is_none() && !self.scene.detectors.iter().any(Detector::watches_escape) {
            return;
        }
        for i in which {
            let i = *i as usize;
            let rider = self.riders[now.who[i] as usize];
            let (o, d) = (now.lines.origin(i), now.lines.direction(i));
            self.mark(rider.ray, o + d * self.far);
            self.escape(d, &rider);
        }
    }

    /// Rays that meet one face go on together, or are absorbed.
    fn bounce(&mut self, bouncer: Bouncer, which: &[u32], now: &Flock, hits: &Hits, next: &mut Flock) {
        let account = &mut self.out.ledger.on_face[bouncer.face as usize];
        let [numbers, turns] = &mut self.numbers;
        self.going.clear();
        for (k, i) in which.iter().enumerate() {
            if bouncer.absorbs(numbers[k]) {
                account.add(self.riders[now.who[*i as usize] as usize].flux);
            } else {
                // No later than where it is: the numbers move up.
                let kept = self.going.len();
                (numbers[kept], turns[kept]) = (numbers[k], turns[k]);
                self.going.push(*i);
            }
        }
        self.gathered.gather(now, hits, &self.going);
        let face = &self.scene.assembly.faces()[bouncer.face as usize];
        self.gathered.bounce(face, bouncer, &self.numbers);
        self.gathered.go_on(bouncer.face, next);
    }
}
