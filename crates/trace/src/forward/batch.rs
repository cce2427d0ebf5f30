//! One batch of a run: rays of all sources, block by block, followed to their ends.

use etendue_geometry::RayBatch;
use etendue_geometry::hits::Hits;
use etendue_geometry::origin_faces::NONE;
use etendue_geometry::points_on_faces::PointsOnFaces;
use etendue_geometry::ray_batch::BLOCK;
use etendue_geometry::surface_points::fill;
use etendue_math::Vec3;
use etendue_sampling::ordered::BATCH;
use etendue_sampling::philox::{Pairs, fill_pairs};

use super::block_trace::BlockTrace;
use super::ending::Ending;
use super::interfaces::{Crossed, InterfaceRays};
use super::lambertian_sheet::{LambertianSheet, SheetRays};
use super::queue::RayQueue;
use super::run::Run;
use super::scattering_sheet::{ScatteredRays, ScatteringSheet};
use super::sorter::{Sheet, Sorter, sheets};
use crate::dealing::Dealing;
use crate::detector::Detector;
use crate::events::depth;
use crate::exitance_cells::FacePoint;
use crate::ledger::{Fate, Loss};
use crate::medium_cache::MediumCache;
use crate::mis::SourceLuminance;
use crate::ray_start::start_near;
use crate::ray_state::RayState;
use crate::records::Contribution;
use crate::scene::Scene;
use crate::tallies::{BatchSums, brought_together, sum_up};

/// The purpose under which the events of traced rays are drawn (see [`Pairs::new`]).
const PURPOSE_TRACE: u32 = 0x5452_4143;

/// A block of rays that are followed to their ends.
struct BatchTrace<'a> {
    block: BlockTrace<'a>,
    dealing: &'a Dealing,
    pairs: Pairs,
    /// The number of the block's first ray in the run.
    first: u64,
    /// Those on their way, and those that go on from there.
    now: RayQueue,
    next: RayQueue,
    hits: Hits,
    sorter: Sorter<'a>,
    /// Rays whose random numbers are wanted, and the numbers.
    addresses: Vec<u64>,
    numbers: [Vec<f64>; 2],
    /// Those of the rays that meet a face whose medium is known.
    known: Vec<u32>,
    ending: Ending,
    sheet_rays: SheetRays,
    scattered_rays: ScatteredRays,
    interface_rays: InterfaceRays,
    /// Where rays meet interfaces.
    points: PointsOnFaces,
    /// Fluxes of rays that leave the scene, or are absorbed on a face.
    fluxes: Vec<f64>,
}

/// Traces one batch of a run.
#[must_use]
pub fn trace_batch(scene: &Scene, detectors: &[Detector], run: &Run<'_>, dealing: &Dealing, batch: u64) -> BatchSums {
    let mut trace = BatchTrace::new(scene, detectors, run, dealing);
    trace.batch(batch);
    let mut out = trace.block.out;
    for (detector, recorded) in detectors.iter().zip(&mut out.detectors) {
        dealing.by_units(batch, recorded.contributions.iter_mut());
        let mut copies = vec![];
        if detector.sums_up() {
            let mut of_rays = recorded.of_rays();
            dealing.by_units(batch, of_rays.iter_mut());
            let all = of_rays.iter().chain(&recorded.contributions);
            (recorded.whole, copies) = sum_up(all, detector.cells() - 1, dealing);
        }
        brought_together(&mut recorded.contributions, detector.cells());
        recorded.contributions.append(&mut copies);
    }
    dealing.by_units(batch, out.copies.iter_mut());
    brought_together(&mut out.copies, scene.sources.len() + 1);
    out
}

/// The points at which the first rays of a run (a batch at most) start, turn and end, for drawings; a ray that escapes ends
/// `far` from its last turn.
#[must_use]
pub fn trails(scene: &Scene, run: &Run<'_>, far: f64) -> Vec<Vec<Vec3>> {
    let dealing = Dealing::of(scene, run.rays, run.sets);
    let mut trace = BatchTrace::new(scene, &[], run, &dealing);
    trace.block.trails = Some(Vec::new());
    trace.sorter = Sorter::one_by_one(scene);
    trace.block.far = far;
    trace.batch(0);
    trace.block.trails.unwrap_or_default()
}

impl<'a> BatchTrace<'a> {
    fn new(scene: &'a Scene, detectors: &'a [Detector], run: &'a Run<'a>, dealing: &'a Dealing) -> Self {
        let wants = Detector::wants_of(detectors);
        Self {
            block: BlockTrace {
                scene,
                detectors,
                wants,
                run,
                media: MediumCache::new(scene),
                states: Vec::with_capacity(BLOCK),
                wavelength: None,
                trails: None,
                far: 0.0,
                out: BatchSums::new(scene, detectors, dealing, run.rays.div_ceil(BATCH)),
            },
            dealing,
            pairs: Pairs::new(run.seed, PURPOSE_TRACE),
            first: 0,
            now: RayQueue::default(),
            next: RayQueue::default(),
            hits: Hits::default(),
            sorter: Sorter::new(scene, sheets(scene, wants), &scene.interfaces()),
            addresses: Vec::new(),
            numbers: Default::default(),
            known: Vec::new(),
            ending: Ending::default(),
            sheet_rays: SheetRays::default(),
            scattered_rays: ScatteredRays::default(),
            interface_rays: InterfaceRays::default(),
            points: PointsOnFaces::default(),
            fluxes: Vec::new(),
        }
    }

    /// Traces one batch.
    fn batch(&mut self, batch: u64) {
        let (scene, run) = (self.block.scene, self.block.run);
        let mut emitted = RayBatch::default();
        self.first = self.dealing.first(batch);
        for (number, range) in self.dealing.batch(batch).into_iter().enumerate() {
            let source = &scene.sources[number];
            let count = self.dealing.count(number);
            let mut start = range.start;
            while start < range.end {
                let stop = (start + BLOCK as u64).min(range.end);
                source.emit(number as u64, start..stop, count, run.seed, run.sets, &mut emitted);
                self.count(&emitted, number);
                self.begin(&emitted, number, start);
                self.finish();
                for recorded in &mut self.block.out.detectors {
                    recorded.events.settle();
                }
                self.first += stop - start;
                start = stop;
            }
        }
    }

    /// Counts the rays that a source gave out.
    #[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 sources")]
    fn count(&mut self, emitted: &RayBatch, number: usize) {
        let (fluxes, all) = (&emitted.flux[..emitted.len], self.block.scene.sources.len());
        let stratum = self.dealing.stratum_of(number);
        if stratum >= self.dealing.plain() {
            for cell in [number, all] {
                let each = (self.first..).zip(fluxes).map(|(ray, flux)| Contribution {
                    cell: cell as u32,
                    unit: ray,
                    amount: *flux,
                    flux: *flux,
                });
                self.block.out.copies.extend(each);
            }
            return;
        }
        let sums = fluxes
            .iter()
            .fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
        for cell in [number, all] {
            let cell = &mut self.block.out.own[stratum * (all + 1) + cell];
            cell.sum += sums.0;
            cell.squares += sums.1;
            cell.products += sums.1;
            cell.rays += emitted.len as u64;
        }
    }

    /// Takes in the rays that a source gave out, from its ray `start` on.
    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
    fn begin(&mut self, emitted: &RayBatch, number: usize, start: u64) {
        let (scene, run) = (self.block.scene, self.block.run);
        let (source, near) = (&scene.sources[number], &scene.near[number]);
        let total = scene.sources.iter().map(|s| s.flux).sum();
        let sampler = run.light_samplers.get(number).and_then(Option::as_ref);
        let brightness = self
            .block
            .wants
            .brightness
            .then(|| SourceLuminance::new(source, sampler, total));
        let keeps = self.block.detectors.iter().any(|detector| detector.most_events() > 0);
        let n = emitted.len;
        self.block.out.ledger.emitted[number].add_all(&emitted.flux[..n]);
        self.block.states.clear();
        self.block.states.extend((0..n).map(|i| {
            let ray = self.first + i as u64;
            RayState {
                flux: emitted.flux[i],
                wavelength: match emitted.colour.get(i) {
                    Some(stated) => *stated,
                    None => source.wavelength(run.seed, number as u64, start + i as u64),
                },
                ray,
                scattered: false,
                unseen: !source.is_visible(),
                brightness: brightness.map_or(f64::INFINITY, |b| b.at(emitted.position(i), emitted.direction(i))),
                family: number as u32,
                depth: if keeps { depth(run.seed, ray) } else { 0 },
            }
        }));
        let states = &self.block.states;
        let first = states.first().map(|state| state.wavelength);
        self.block.wavelength = first.filter(|first| states.iter().all(|state| state.wavelength == *first));
        self.now.clear();
        if near.is_empty() && self.block.trails.is_none() && (0..n).all(|i| emitted.usable(i)) {
            let [o, d] = [&emitted.position, &emitted.direction].map(|lists| lists.each_ref().map(|list| &list[..n]));
            self.now.extend(o, d, 0..n as u32, NONE, (0..n).map(|_| NONE));
            return;
        }
        for i in 0..n {
            let RayState { ray, flux, .. } = self.block.states[i];
            if !emitted.usable(i) {
                self.block.out.ledger.book(Fate::Lost(Loss::NotFinite, NONE), flux);
                continue;
            }
            let (o, d) = (emitted.position(i), emitted.direction(i));
            match start_near(scene, o, d, near) {
                Ok((stack, origin_faces)) => {
                    self.block.mark(ray, o);
                    self.now.push(i as u32, (o, d, origin_faces), stack);
                }
                Err((loss, face)) => self.block.out.ledger.book(Fate::Lost(loss, face), flux),
            }
        }
    }

    /// Follows all rays of the block to their ends. At any time all of them have had the same number of events.
    fn finish(&mut self) {
        // Lent out, so that what is done with one ray can use all else.
        let (mut now, mut next) = (std::mem::take(&mut self.now), std::mem::take(&mut self.next));
        let (mut hits, mut sorter) = (std::mem::take(&mut self.hits), std::mem::take(&mut self.sorter));
        let mut event = 0;
        while !now.is_empty() && !self.block.run.is_stopped() {
            self.block.scene.face_set.nearest(&now.lines, &mut hits);
            self.block.out.ledger.segments += now.len() as u64;
            let last = event + 1 >= self.block.run.most_events;
            sorter.sort(&now, &hits, last);
            self.let_go(&now, sorter.gone());
            next.clear();
            for (sheet, which) in sorter.bounced() {
                self.draw(&now, which, event);
                match sheet {
                    Sheet::Lambertian(sheet) => self.bounce(sheet, which, &now, &hits, &mut next),
                    Sheet::Scattering(sheet) => self.scatter(sheet, which, &now, &hits, &mut next),
                }
            }
            self.draw(&now, sorter.interfaces(), event);
            self.cross(sorter.interfaces(), &now, &hits, event, &mut next);
            self.draw(&now, sorter.single(), event);
            for (k, i) in sorter.single().iter().enumerate() {
                let numbers = self.numbers.each_ref().map(|list| list[k]);
                self.block.step(&now, &hits, *i as usize, numbers, event, &mut next);
            }
            std::mem::swap(&mut now, &mut next);
            event += 1;
        }
        (self.now, self.next, self.hits, self.sorter) = (now, next, hits, sorter);
    }

    /// Two random numbers for each of some rays.
    fn draw(&mut self, now: &RayQueue, which: &[u32], event: u32) {
        let address = |i: &u32| self.first + u64::from(now.who[*i as usize]);
        self.addresses.clear();
        self.addresses.extend(which.iter().map(address));
        fill_pairs(self.pairs, &self.addresses, event, &mut self.numbers);
    }

    /// Rays leave the scene.
    fn let_go(&mut self, now: &RayQueue, which: &[u32]) {
        self.fluxes.clear();
        let flux = |i: &u32| self.block.states[now.who[*i as usize] as usize].flux;
        self.fluxes.extend(which.iter().map(flux));
        self.block.out.ledger.escaped.add_all(&self.fluxes);
        if self.block.trails.is_none() && !self.block.wants.escapes {
            return;
        }
        for i in which {
            let i = *i as usize;
            let state = self.block.states[now.who[i] as usize];
            let (o, d) = (now.lines.origin(i), now.lines.direction(i));
            self.block.mark(state.ray, o + d * self.block.far);
            self.block.escape(d, &state);
        }
    }

    /// Rays that meet one face go on together, or are absorbed.
    fn bounce(&mut self, sheet: LambertianSheet, which: &[u32], now: &RayQueue, hits: &Hits, next: &mut RayQueue) {
        let (going, gone) = self
            .ending
            .split(which, &mut self.numbers, |number| sheet.absorbs(number));
        let states = &self.block.states;
        let flux = |i: &u32| states[now.who[*i as usize] as usize].flux;
        fill(&mut self.fluxes, gone.iter().map(flux));
        self.block.out.ledger.on_face[sheet.face as usize].add_all(&self.fluxes);
        self.sheet_rays.gather(now, hits, going);
        let face = &self.block.scene.face_set.faces()[sheet.face as usize];
        self.sheet_rays.bounce(face, sheet, &self.numbers);
        self.sheet_rays.go_on(sheet.face, next);
    }

    /// Rays that meet smooth interfaces of solids go on, mirrored or refracted.
    fn cross(&mut self, which: &[u32], now: &RayQueue, hits: &Hits, event: u32, next: &mut RayQueue) {
        self.interface_rays.make_room(which.len());
        let faces = self.block.scene.face_set.faces();
        self.points.find(faces, &now.lines, hits, which);
        let mut place = 0;
        for (k, i) in which.iter().enumerate() {
            let (i, block) = (*i as usize, &mut self.block);
            let who = now.who[i];
            let wavelength = block.states[who as usize].wavelength;
            if let Some(met) = Crossed::new(
                block.scene,
                now,
                hits,
                i,
                self.points.get(k),
                wavelength,
                &mut block.media,
            ) {
                self.interface_rays.put(place, who, &met, self.numbers[0][k]);
                place += 1;
            } else {
                let numbers = self.numbers.each_ref().map(|list| list[k]);
                block.step(now, hits, i, numbers, event, next);
            }
        }
        self.interface_rays.make_room(place);
        self.interface_rays.pass();
        for (who, face, passed) in self.interface_rays.passed() {
            self.block.states[who as usize].go_smoothly(face, passed);
        }
        self.interface_rays.go_on(next);
    }

    /// Rays that meet one face go on, each as it is drawn, or are absorbed.
    fn scatter(&mut self, sheet: ScatteringSheet<'_>, which: &[u32], now: &RayQueue, hits: &Hits, next: &mut RayQueue) {
        let BlockTrace {
            scene,
            detectors,
            wants,
            media,
            states,
            wavelength,
            out,
            ..
        } = &mut self.block;
        let (rays, scattered, absorbed) = (&mut self.sheet_rays, &mut self.scattered_rays, &mut self.fluxes);
        let same = wavelength.and_then(|all| media.around(scene, all));
        if same.is_none() {
            self.known.clear();
            for (k, i) in which.iter().enumerate() {
                let state = &states[now.who[*i as usize] as usize];
                if media.around(scene, state.wavelength).is_none() {
                    out.ledger.book(Fate::Lost(Loss::NoIndex, sheet.face), state.flux);
                    continue;
                }
                for list in &mut self.numbers {
                    list[self.known.len()] = list[k];
                }
                self.known.push(*i);
            }
        }
        let known = if same.is_some() { which } else { &self.known };
        // Before it is known where and under which angle, unless somebody asks for that.
        let early = !wants.exitance;
        let (going, gone) = self
            .ending
            .split(known, &mut self.numbers, |number| early & sheet.absorbs(number));
        fill(
            absorbed,
            gone.iter().map(|i| states[now.who[*i as usize] as usize].flux),
        );
        scattered.media.clear();
        match same {
            Some(all) => scattered.media.resize(going.len(), all),
            None => scattered.media.extend(going.iter().filter_map(|i| {
                let state = &states[now.who[*i as usize] as usize];
                media.around(scene, state.wavelength)
            })),
        }
        rays.gather(now, hits, going);
        rays.reach(&scene.face_set.faces()[sheet.face as usize]);
        for k in (0..going.len()).filter(|_| wants.exitance) {
            let ray = rays.get(k);
            let place = FacePoint {
                face: sheet.face,
                part: ray.part,
                front: ray.d.dot(ray.normal) < 0.0,
                point: ray.point,
            };
            let share = sheet.product(ray.d, ray.normal, scattered.media[k]);
            let state = &mut states[ray.who as usize];
            for (detector, out) in detectors.iter().zip(&mut out.detectors) {
                detector.sheet(scene, place, share, state, out);
            }
            state.scattered = true;
        }
        let n = going.len();
        scattered.sample(&sheet, rays, self.numbers.each_ref().map(|list| &list[..n]));
        scattered.turn(&sheet, rays, |who| absorbed.push(states[who as usize].flux));
        out.ledger.on_face[sheet.face as usize].add_all(absorbed);
        rays.go_on(sheet.face, next);
    }
}
