//! From the sources to the detectors.
//!
//! Every ray keeps its flux and has one fate: at a surface it goes into one of the lobes, or is absorbed, by chance in
//! proportion to their shares, and in a medium it is absorbed at a distance drawn from Beer's law. So the rays that a
//! detector keeps have equal flux if those of the source have.

use std::f64::consts::PI;
use std::ops::Range;

use etendue_geometry::assembly::{Hits, Leaving, Lines, NONE};
use etendue_geometry::batch::BLOCK;
use etendue_geometry::{RayBatch, RaySource};
use etendue_math::Vec3;
use etendue_optics::finish::{Finish, Incidence, Lobe, pick};
use etendue_optics::source::surface::about;
use etendue_sampling::ordered::BATCH;
use etendue_sampling::philox::{Stream, fill_uniforms};
use rayon::prelude::*;

use crate::bounce::{Bouncer, Gathered, bounce, bouncers};
use crate::detector::{Detector, illuminance_cell, intensity_cell};
use crate::exitance::Place;
use crate::eye::Event;
use crate::harvest::{Harvest, Record, Yield};
use crate::inside::Inside;
use crate::kept::depth;
use crate::ledger::Fate;
use crate::meeting::{Fillings, Loss, Meeting, meet};
use crate::scene::Scene;
use crate::start::place_near;

/// The purpose under which the events of traced rays are drawn (see [`Stream::new`]).
const PURPOSE_TRACE: u64 = 0x5452_4143;

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
}

/// The rays of each source in batch `batch`: the first one's number among those of the source, and how many.
///
/// After b batches, source s has had ⌊b B `Q_s`⌋ − ⌊b B Q_{s−1}⌋ rays, Q being the sums of the shares of the flux: every
/// beginning of a run serves all sources in proportion, and each number is known without counting.
#[must_use]
pub fn deal(scene: &Scene, rays: u64, batch: u64) -> Vec<Range<u64>> {
    let bounds = |done: u64| edges(scene, done);
    let (from, to) = (
        bounds((batch * BATCH).min(rays)),
        bounds(((batch + 1) * BATCH).min(rays)),
    );
    (0..scene.sources.len())
        .map(|s| (from[s + 1] - from[s])..(to[s + 1] - to[s]))
        .collect()
}

/// Rays of the first s sources among the first `done` rays.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of `done`"
)]
fn edges(scene: &Scene, done: u64) -> Vec<u64> {
    let total: f64 = scene.sources.iter().map(|s| s.flux).sum();
    let mut sum = 0.0;
    let mut result = vec![0];
    for source in &scene.sources {
        sum += source.flux;
        result.push(((sum / total) * done as f64).floor() as u64);
    }
    let last = result.len() - 1;
    result[last] = done;
    result
}

/// Traces batches `batches` of a run on the threads of the current pool, and merges them in order.
///
/// `stop` is looked at before each batch; batches from the first one that was not begun on are left out, and the number of
/// batches done is returned.
#[must_use]
pub fn trace(scene: &Scene, run: &Run<'_>, batches: Range<u64>) -> Harvest {
    let parts: Vec<Yield> = batches
        .clone()
        .into_par_iter()
        .map(|b| trace_batch(scene, run, b))
        .collect();
    let mut harvest = Harvest::new(scene);
    for part in parts {
        harvest.add(part);
    }
    harvest
}

/// A ray on its way, besides its line.
#[derive(Clone, Copy)]
struct Rider {
    flux: f64,
    wavelength: f64,
    /// Its number in the run.
    ray: u64,
    event: u32,
    inside: Inside,
    /// Whether it has met a diffuse surface.
    scattered: bool,
    /// Whether the reverse tracer does not find it, or leaves it to the light image.
    unseen: bool,
    /// How often the kept events can be thinned before those of this ray are dropped.
    depth: u32,
}

struct Walk<'a> {
    scene: &'a Scene,
    run: &'a Run<'a>,
    stream: Stream,
    fillings: Fillings,
    lines: Lines,
    riders: Vec<Rider>,
    hits: Hits,
    /// Rays and events whose random numbers are wanted, and the numbers.
    addresses: [Vec<u64>; 2],
    numbers: [Vec<f64>; 4],
    /// The faces off which rays are bounced many at a time, and the rays of the block that are.
    bouncers: Vec<Option<Bouncer>>,
    bounced: Vec<Vec<u32>>,
    gathered: Gathered,
    /// Where each ray has been, if that is wanted.
    trails: Option<Vec<Vec<Vec3>>>,
    /// How far a ray that escapes is followed on its trail \[mm\].
    far: f64,
    out: Yield,
}

fn trace_batch(scene: &Scene, run: &Run<'_>, batch: u64) -> Yield {
    let mut walk = Walk::new(scene, run);
    walk.batch(batch);
    walk.out
}

/// The points at which the first rays of a run (a batch at most) start, turn and end, for drawings; a ray that escapes ends
/// `far` from its last turn.
#[must_use]
pub fn trails(scene: &Scene, run: &Run<'_>, far: f64) -> Vec<Vec<Vec3>> {
    let mut walk = Walk::new(scene, run);
    walk.trails = Some(Vec::new());
    walk.bouncers.clear();
    walk.bounced.clear();
    walk.far = far;
    walk.batch(0);
    walk.trails.unwrap_or_default()
}

impl<'a> Walk<'a> {
    fn new(scene: &'a Scene, run: &'a Run<'a>) -> Self {
        // Detectors of scattered light, absorbing surroundings and trails want to know of every scatter by itself.
        let watched = scene.detectors.iter().any(|d| {
            matches!(
                d,
                Detector::Image { .. } | Detector::Exitance(_) | Detector::Events { .. }
            )
        });
        let clear = scene.media[0].absorption.range() == [0.0, 0.0];
        let bouncers = if clear && !watched { bouncers(scene) } else { Vec::new() };
        Self {
            scene,
            run,
            bounced: vec![Vec::new(); bouncers.len()],
            bouncers,
            gathered: Gathered::default(),
            stream: Stream::new(run.seed, PURPOSE_TRACE),
            fillings: Fillings::new(scene),
            lines: Lines::default(),
            riders: Vec::with_capacity(BLOCK),
            hits: Hits::default(),
            addresses: Default::default(),
            numbers: Default::default(),
            trails: None,
            far: 0.0,
            out: Yield::new(scene, run.rays.div_ceil(BATCH)),
        }
    }

    /// Traces one batch.
    fn batch(&mut self, batch: u64) {
        let (scene, run) = (self.scene, self.run);
        let mut births = RayBatch::default();
        let totals = edges(scene, run.rays);
        let keeps = scene.detectors.iter().any(|d| matches!(d, Detector::Events { .. }));
        let mut mark = 0;
        for (number, range) in deal(scene, run.rays, batch).into_iter().enumerate() {
            let source = &scene.sources[number];
            let count = totals[number + 1] - totals[number];
            let mut start = range.start;
            while start < range.end {
                let stop = (start + BLOCK as u64).min(range.end);
                source.emit(number as u64, start..stop, count, run.seed, run.sets, &mut births);
                for i in 0..births.len {
                    let flux = births.flux[i];
                    self.out.ledger.emitted[number].add(flux);
                    let ray = batch * BATCH + mark;
                    if births.usable(i) {
                        let wavelength = source.wavelength(run.seed, number as u64, start + i as u64);
                        let rider = Rider {
                            flux,
                            wavelength,
                            ray,
                            event: 0,
                            inside: Inside::default(),
                            scattered: false,
                            unseen: !source.is_visible(),
                            depth: if keeps { depth(run.seed, ray) } else { 0 },
                        };
                        self.start(births.position(i), births.direction(i), rider, &scene.near[number]);
                    } else {
                        self.out.ledger.book(Fate::Lost(Loss::NotFinite, NONE), flux);
                    }
                    mark += 1;
                }
                self.finish();
                for kept in &mut self.out.events {
                    kept.settle();
                }
                start = stop;
            }
        }
    }
}

/// Place of a ray in its batch.
#[allow(clippy::cast_possible_truncation, reason = "below the size of a batch")]
const fn slot(rider: &Rider) -> usize {
    (rider.ray % BATCH) as usize
}

/// How a ray goes on.
type Next = Result<(Vec3, Vec3, Leaving), Fate>;

impl Walk<'_> {
    fn start(&mut self, o: Vec3, d: Vec3, rider: Rider, near: &[u32]) {
        match place_near(self.scene, o, d, near) {
            Ok((inside, leaving)) => {
                if let Some(trails) = &mut self.trails {
                    trails.resize(trails.len().max(slot(&rider) + 1), Vec::new());
                    trails[slot(&rider)].push(o);
                }
                self.lines.push(o, d, leaving);
                self.riders.push(Rider { inside, ..rider });
            }
            Err((loss, face)) => self.out.ledger.book(Fate::Lost(loss, face), rider.flux),
        }
    }

    /// Follows all rays of the block to their ends.
    fn finish(&mut self) {
        while !self.lines.is_empty() {
            let mut hits = std::mem::take(&mut self.hits);
            self.scene.assembly.nearest(&self.lines, &mut hits);
            self.out.ledger.segments += self.lines.len() as u64;
            self.let_go(&mut hits);
            let [ray, event] = &mut self.addresses;
            ray.clear();
            ray.extend(self.riders.iter().map(|r| r.ray));
            event.clear();
            event.extend(self.riders.iter().map(|r| u64::from(r.event)));
            fill_uniforms(self.stream, ray, event, &mut self.numbers);
            let mut kept = 0;
            for list in &mut self.bounced {
                list.clear();
            }
            for i in 0..self.lines.len() {
                let mut rider = self.riders[i];
                let next = if let Some(face) = self.bouncing(&hits, i, &rider) {
                    rider.event += 1;
                    if self.bouncers[face].is_some_and(|b| b.absorbs(self.numbers[0][i])) {
                        Err(Fate::OnFace(hits.face[i]))
                    } else {
                        // Its line is set when all rays that meet this face are; until then it moves up as it is.
                        #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
                        self.bounced[face].push(kept as u32);
                        hits.keep(i, kept);
                        for list in &mut self.numbers {
                            list[kept] = list[i];
                        }
                        Ok((self.lines.origin(i), self.lines.direction(i), Leaving::default()))
                    }
                } else {
                    let next = self.step(&hits, i, &mut rider);
                    if let Some(trails) = &mut self.trails {
                        let t = if hits.t[i].is_finite() { hits.t[i] } else { self.far };
                        trails[slot(&rider)].push(self.lines.origin(i) + self.lines.direction(i) * t);
                    }
                    next
                };
                match next {
                    Ok((o, d, leaving)) => {
                        self.lines.set(kept, o, d, leaving);
                        self.riders[kept] = rider;
                        kept += 1;
                    }
                    Err(fate) => self.out.ledger.book(fate, rider.flux),
                }
            }
            let faces = self.scene.assembly.faces().iter().zip(&self.bouncers);
            for ((face, bouncer), which) in faces.zip(&self.bounced) {
                if let (Some(bouncer), false) = (bouncer, which.is_empty()) {
                    let (lines, room) = (&mut self.lines, &mut self.gathered);
                    bounce(face, *bouncer, which, &hits, &self.numbers, lines, room);
                }
            }
            self.lines.truncate(kept);
            self.riders.truncate(kept);
            self.hits = hits;
        }
    }

    /// Rays that meet nothing and cannot be absorbed on their way leave, before anything is worked out for them.
    fn let_go(&mut self, hits: &mut Hits) {
        let scene = self.scene;
        let clear = |solid: u16| scene.media[scene.medium(solid)].absorption.range() == [0.0, 0.0];
        let clear_outside = clear(0);
        let mut kept = 0;
        for i in 0..self.lines.len() {
            let rider = self.riders[i];
            let top = rider.inside.top();
            if hits.face[i] == NONE && (if top == 0 { clear_outside } else { clear(top) }) {
                let (o, d) = (self.lines.origin(i), self.lines.direction(i));
                if let Some(trails) = &mut self.trails {
                    trails[slot(&rider)].push(o + d * self.far);
                }
                self.escape(d, &rider);
                self.out.ledger.book(Fate::Escaped, rider.flux);
            } else {
                if kept < i {
                    self.lines.set(
                        kept,
                        self.lines.origin(i),
                        self.lines.direction(i),
                        self.lines.leaving(i),
                    );
                    self.riders[kept] = rider;
                    hits.keep(i, kept);
                }
                kept += 1;
            }
        }
        self.lines.truncate(kept);
        self.riders.truncate(kept);
    }

    /// The face off which ray `i` is bounced together with others, if it is.
    #[inline]
    fn bouncing(&self, hits: &Hits, i: usize, rider: &Rider) -> Option<usize> {
        let face = hits.face[i] as usize;
        let alone = self.bouncers.get(face)?.is_some() && !hits.tied(i, self.lines.origin(i));
        let free = rider.inside == Inside::default() && rider.event + 1 < self.run.most_events;
        (alone && free).then_some(face)
    }

    #[inline]
    fn step(&mut self, hits: &Hits, i: usize, rider: &mut Rider) -> Next {
        let scene = self.scene;
        let d = self.lines.direction(i);
        let numbers = self.numbers.each_ref().map(|v| v[i]);
        let filling = self.fillings.at(scene, rider.inside.top(), rider.wavelength);
        if filling.absorption > 0.0 && -numbers[3].ln() < filling.absorption * hits.t[i] {
            return Err(Fate::InMedium(scene.medium(rider.inside.top())));
        }
        if hits.face[i] == NONE {
            self.escape(d, rider);
            return Err(Fate::Escaped);
        }
        let out = &mut self.out;
        let meeting = meet(scene, &self.lines, hits, i, rider.inside, |detector, point, _| {
            detect(scene, out, detector, point, d, rider);
        })
        .map_err(|(loss, face)| Fate::Lost(loss, face))?;
        rider.event += 1;
        if rider.event >= self.run.most_events {
            return Err(Fate::Terminated);
        }
        let Some(finish) = meeting.finish else {
            rider.inside = meeting.after;
            return Ok((meeting.point, d, meeting.leaving));
        };
        self.scatter(&meeting, finish, d, numbers, rider)
    }

    #[inline]
    fn scatter(&mut self, meeting: &Meeting, number: u32, d: Vec3, numbers: [f64; 4], rider: &mut Rider) -> Next {
        let scene = self.scene;
        let finish = &scene.finishes[number as usize];
        let light = Incidence {
            cosine: (-d.dot(meeting.normal)).min(1.0),
            wavelength: rider.wavelength,
            n1: self.fillings.at(scene, meeting.before.top(), rider.wavelength).n,
            n2: self.fillings.at(scene, meeting.after.top(), rider.wavelength).n,
        };
        if !(light.n1 > 0.0 && light.n2 > 0.0) {
            return Err(Fate::Lost(Loss::NoIndex, meeting.face));
        }
        if finish.is_diffuse() && !self.scene.detectors.is_empty() {
            self.show(meeting, number, &light, d, rider);
        }
        let (shares, across) = finish.shares(&light);
        let Some(lobe) = pick(&shares, numbers[0]) else {
            return Err(Fate::OnFace(meeting.face));
        };
        if lobe.is_transmission() {
            rider.inside = meeting.after;
        }
        // Smooth surfaces before the first diffuse one; an interface of equal media is none.
        let nothing = matches!(finish, Finish::Interface) && light.n1 == light.n2;
        rider.unseen |= lobe.is_specular() && !rider.scattered && !nothing;
        rider.scattered |= !lobe.is_specular();
        let d = match lobe {
            Lobe::SpecularReflection => meeting.mirrored(d, light.cosine),
            Lobe::SpecularTransmission => meeting.refracted(d, light.cosine, light.n1 / light.n2, across),
            // Diffuse light is spread about the surface itself, so that none of it starts behind it.
            Lobe::DiffuseReflection => about(meeting.side, (1.0 - numbers[1]).sqrt(), numbers[2]),
            Lobe::DiffuseTransmission => about(-meeting.side, (1.0 - numbers[1]).sqrt(), numbers[2]),
        };
        Ok((meeting.point, d, meeting.leaving))
    }

    /// The far field takes note of a ray that leaves the scene.
    fn escape(&mut self, d: Vec3, rider: &Rider) {
        for (detector, marks) in self.scene.detectors.iter().zip(&mut self.out.marks) {
            if let Detector::Intensity { planes, steps } = detector {
                marks.push((intensity_cell(*planes, *steps, d), rider.ray, rider.flux));
            }
        }
    }

    /// Detectors of scattered light take note.
    fn show(&mut self, meeting: &Meeting, finish: u32, light: &Incidence, d: Vec3, rider: &Rider) {
        let event = Event::new(meeting, finish, d, [rider.flux, rider.wavelength], rider.ray);
        for (number, detector) in self.scene.detectors.iter().enumerate() {
            match detector {
                Detector::Image { view, complement } if rider.unseen || !complement => {
                    if let Some((pixel, light)) = event.seen(self.scene, view, &mut self.fillings) {
                        self.out.marks[number].push((pixel, rider.ray, light));
                    }
                }
                Detector::Exitance(patches) => {
                    for through in [false, true] {
                        let share = PI * self.scene.finishes[finish as usize].bsdf(light, through);
                        let place = Place {
                            face: meeting.face,
                            part: meeting.part,
                            front: meeting.front != through,
                            point: meeting.point,
                        };
                        let cell = || patches.cell(self.scene, place, rider.wavelength, rider.unseen);
                        if let Some(cell) = (share > 0.0).then(cell).flatten() {
                            self.out.marks[number].push((cell, rider.ray, rider.flux * share));
                        }
                    }
                }
                Detector::Events { faces, .. }
                    if faces
                        .as_ref()
                        .is_none_or(|faces| faces.get(meeting.face as usize) == Some(&true)) =>
                {
                    self.out.events[number].push(&event, rider.depth);
                }
                _ => {}
            }
        }
    }
}

fn detect(scene: &Scene, out: &mut Yield, detector: u32, point: Vec3, d: Vec3, rider: &Rider) {
    let number = detector as usize;
    match &scene.detectors[number] {
        Detector::Rays(_) => out.records[number].push(Record {
            position: [point.x, point.y, point.z],
            direction: [d.x, d.y, d.z],
            flux: rider.flux,
            wavelength: rider.wavelength,
        }),
        Detector::Illuminance {
            frame,
            width,
            height,
            columns,
            rows,
        } => {
            if let Some(cell) = illuminance_cell(frame, [*width, *height], [*columns, *rows], point, d) {
                out.marks[number].push((cell, rider.ray, rider.flux));
            }
        }
        Detector::Intensity { .. } | Detector::Image { .. } | Detector::Exitance(_) | Detector::Events { .. } => {}
    }
}
