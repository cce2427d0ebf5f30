//! Tracing: a number of batches at a time, so that Python can report progress, look at errors and stop in between.

use std::ops::Range;

use etendue_geometry::RaySource;
use etendue_geometry::origin_faces::OriginFaces;
use etendue_math::Vec3;
use etendue_sampling::ordered::{BATCH, inside};
use etendue_trace::camera_connection;
use etendue_trace::dealing::Dealing;
use etendue_trace::detector::Detector;
use etendue_trace::events::{DEEPEST, EventReservoir, WORDS};
use etendue_trace::forward::batch::trails;
use etendue_trace::forward::run::Run;
use etendue_trace::guide::Arrival;
use etendue_trace::ledger::{Entry, Ledger, Loss};
use etendue_trace::lit_scene::LitScene;
use etendue_trace::mis::MisBalance;
use etendue_trace::records::{Cell, CollectedRay, Contribution};
use etendue_trace::reverse::method::{LeftOut, Method, Pixel};
use etendue_trace::reverse::render::render;
use etendue_trace::tallies::{Tally, TraceSums};
use etendue_trace::work_unit::work_unit_of;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::bright_spots::BrightSpots;
use crate::carrier::vectors;
use crate::glints::Glints;
use crate::guide::Guide;
use crate::run::stoppable;
use crate::scene::Scene;
use crate::source::{Opened, Source};
use crate::survey::Survey;
use crate::view::View;

fn entries<'py>(py: Python<'py>, entries: &[Entry]) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u64>>) {
    (
        PyArray1::from_iter(py, entries.iter().map(etendue_trace::ledger::Entry::flux)),
        PyArray1::from_iter(py, entries.iter().map(|e| e.rays)),
    )
}

/// A ledger as a dictionary of (flux, rays) arrays.
fn ledger_dict<'py>(py: Python<'py>, ledger: &Ledger) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("emitted", entries(py, &ledger.emitted))?;
    dict.set_item("escaped", entries(py, &[ledger.escaped]))?;
    dict.set_item("on_face", entries(py, &ledger.on_face))?;
    dict.set_item("in_medium", entries(py, &ledger.in_medium))?;
    dict.set_item("terminated", entries(py, &[ledger.terminated]))?;
    dict.set_item("lost", entries(py, &ledger.lost))?;
    dict.set_item("lost_at", ledger.lost_at.to_vec())?;
    dict.set_item("segments", ledger.segments)?;
    Ok(dict)
}

/// Σ w, Σ w², number of rays and Σ w v of each cell.
pub type CellArrays<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<f64>>,
);

pub fn cell_arrays<'a, 'py>(
    py: Python<'py>,
    cells: impl ExactSizeIterator<Item = &'a Cell> + Clone,
) -> CellArrays<'py> {
    (
        PyArray1::from_iter(py, cells.clone().map(|c| c.sum)),
        PyArray1::from_iter(py, cells.clone().map(|c| c.squares)),
        PyArray1::from_iter(py, cells.clone().map(|c| c.rays)),
        PyArray1::from_iter(py, cells.map(|c| c.products)),
    )
}

/// Cell, unit, sum and flux of each unit of rays with copies, in the order of cells and units.
pub type UnitArrays<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

pub fn unit_arrays<'py>(py: Python<'py>, units: &[Contribution]) -> UnitArrays<'py> {
    (
        PyArray1::from_iter(py, units.iter().map(|of| of.cell)),
        PyArray1::from_iter(py, units.iter().map(|of| of.unit)),
        PyArray1::from_iter(py, units.iter().map(|of| of.amount)),
        PyArray1::from_iter(py, units.iter().map(|of| of.flux)),
    )
}

/// The cells of a tally, and its units of rays with copies.
fn tally_arrays<'py>(py: Python<'py>, tally: &Tally) -> (CellArrays<'py>, UnitArrays<'py>) {
    (cell_arrays(py, tally.cells.iter()), unit_arrays(py, &tally.copies))
}

/// Rows of position, direction, flux, wavelength.
fn record_array<'py>(py: Python<'py>, records: &[CollectedRay]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = records.iter().flat_map(|r| {
        let [x, y, z] = r.position;
        let [kx, ky, kz] = r.direction;
        [x, y, z, kx, ky, kz, r.flux, r.wavelength]
    });
    PyArray1::from_iter(py, rows).reshape([records.len(), 8])
}

/// Rows of point, direction to where the light came from, the number of the face, and that of the family.
fn arrival_rows<'py>(py: Python<'py>, arrivals: &[Arrival]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = arrivals.iter().flat_map(|a| {
        let (p, k) = (a.point, a.towards);
        [p.x, p.y, p.z, k.x, k.y, k.z, f64::from(a.face), f64::from(a.family)]
    });
    PyArray1::from_iter(py, rows).reshape([arrivals.len(), 8])
}

/// Why rays are lost, in the order of a ledger.
#[pyfunction]
pub fn losses() -> Vec<&'static str> {
    Loss::ALL.iter().map(|loss| loss.name()).collect()
}

/// Rays of a batch.
#[pyfunction]
pub fn batch_size() -> u64 {
    BATCH
}

/// The ray sets of a scene's sources.
fn open<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Vec<Opened<'py>>> {
    scene.sets().iter().map(|s| Opened::new(s.bind(py))).collect()
}

/// Solids that a scene has at most.
#[pyfunction]
pub fn most_solids() -> usize {
    etendue_trace::scene::MOST_SOLIDS
}

/// Traces batches `first..last` of a run of `rays` rays: a work unit. Batches have `batch_size()` rays, or `each`.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
#[pyo3(signature = (scene, rays, seed, most_events, first, last, threads=None, each=None))]
pub fn work_unit<'py>(
    py: Python<'py>,
    scene: &Scene,
    rays: u64,
    seed: u64,
    most_events: u32,
    first: u64,
    last: u64,
    threads: Option<usize>,
    each: Option<u64>,
) -> PyResult<Bound<'py, PyDict>> {
    let each = each.unwrap_or(BATCH).clamp(1, BATCH);
    if first > last || last > rays.div_ceil(each) {
        return Err(PyValueError::new_err(format!("batches {first}..{last} of {rays} rays")));
    }
    let opened = open(py, scene)?;
    let sets: Vec<Source<'_>> = opened.iter().map(Opened::core).collect::<PyResult<_>>()?;
    let sets: Vec<&dyn RaySource> = sets.iter().map(|s| s as &dyn RaySource).collect();
    // Made ready only where they are asked for: that takes a while for light fields.
    let light_samplers = if Detector::wants_of(scene.detectors()).brightness {
        scene.light_samplers()
    } else {
        &[]
    };
    let core = scene.core();
    let batches: Range<u64> = first..last;
    let sums: TraceSums = stoppable(py, |stop| {
        let run = Run {
            rays,
            seed,
            most_events,
            sets: &sets,
            light_samplers,
            stop: Some(stop),
        };
        let dealing = Dealing::of(core, rays, &sets).in_batches_of(each);
        let work = || work_unit_of(core, scene.detectors(), &run, &dealing, batches.clone());
        inside(threads.unwrap_or(0), work)
    })?;
    opened.iter().try_for_each(Opened::check)?;
    let dict = PyDict::new(py);
    dict.set_item("batches", (first, last))?;
    dict.set_item("ledger", ledger_dict(py, &sums.ledger)?)?;
    let tallies: Vec<_> = sums.tallies.iter().map(|tally| tally_arrays(py, tally)).collect();
    dict.set_item("tallies", tallies)?;
    dict.set_item("emitted", tally_arrays(py, &sums.emitted))?;
    let records = PyList::empty(py);
    for detector in &sums.records {
        records.append(record_array(py, detector)?)?;
    }
    dict.set_item("records", records)?;
    let events = PyList::empty(py);
    for detector in &sums.events {
        events.append(event_rows(py, detector)?)?;
    }
    dict.set_item("events", events)?;
    dict.set_item("arrivals", arrival_rows(py, &sums.arrivals)?)?;
    dict.set_item("rays", sums.rays)?;
    dict.set_item("imbalance", sums.imbalance)?;
    Ok(dict)
}

/// Of each pass and pixel, six numbers; and two of all together.
type Looks<'py> = (
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    (f64, f64),
);

/// Looks at a scene: for each of the passes `first..last` and each pixel, row by row, the mean luminance, the part of it that
/// is found by chance, and the sources' own deviation \[flux unit/(mm² sr)\]; and the shares of the lines that meet a smooth
/// surface first, and that see a diffuse one directly; and the mean luminance of light that was scattered on its way. Beside
/// them the sum over passes and pixels of the mean weight that lines still had when they were given up, having met as many
/// surfaces as they may, and when they were lost.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
#[pyo3(signature = (scene, view, paths, seed, most_events, left, first, last, threads=None, survey=None, shared=None, guide=None, glints=None, spots=None))]
pub fn look_at_scene<'py>(
    py: Python<'py>,
    scene: &Scene,
    view: View,
    paths: u32,
    seed: u64,
    most_events: u32,
    left: &str,
    first: u32,
    last: u32,
    threads: Option<usize>,
    survey: Option<&Survey>,
    shared: Option<f64>,
    guide: Option<&Guide>,
    glints: Option<&Glints>,
    spots: Option<&BrightSpots>,
) -> PyResult<Looks<'py>> {
    let view = view.core();
    let left = match left {
        "nothing" => LeftOut::Nothing,
        "caustics" => shared.map_or(LeftOut::Caustics, |rays| LeftOut::Shared(MisBalance { rays })),
        "scattered" => LeftOut::Scattered,
        other => return Err(PyValueError::new_err(format!("nothing is called {other}"))),
    };
    let method = Method {
        paths,
        seed,
        most_events,
        left,
        guide: guide.map(Guide::core),
        spots: spots.and_then(BrightSpots::core),
        glints: glints.map(Glints::core),
    };
    let image = stoppable(py, |stop| {
        let lit = LitScene::new(scene.core(), scene.light_samplers()).until(stop);
        let survey = survey.map(Survey::core);
        inside(threads.unwrap_or(0), || {
            render(&lit, &view, &method, survey, first..last)
        })
    })?;
    let (passes, all_rows, all_columns) = ((first..last).len(), view.rows as usize, view.columns as usize);
    let [columns, rows] = [&image.columns, &image.rows].map(|range| range.start as usize..range.end as usize);
    let array = |pick: fn(&Pixel) -> f64| -> PyResult<Bound<'py, PyArray3<f64>>> {
        // Memory of zeros that nothing is written to costs nothing.
        let array = PyArray3::zeros(py, [passes, all_rows, all_columns], false);
        let mut all = array.readwrite();
        let all = all.as_slice_mut()?;
        for (row, pixels) in rows.clone().zip(image.pixels.chunks((columns.len() * passes).max(1))) {
            for pass in 0..passes {
                let start = (pass * all_rows + row) * all_columns + columns.start;
                let of_pass = pixels[pass..].iter().step_by(passes);
                for (value, pixel) in all[start..start + columns.len()].iter_mut().zip(of_pass) {
                    *value = pick(pixel);
                }
            }
        }
        Ok(array)
    };
    let sum = |of: fn(&Pixel) -> f64| image.pixels.iter().map(of).sum();
    Ok((
        array(|p| p.mean)?,
        array(|p| p.chance)?,
        array(|p| p.deviation)?,
        array(|p| p.met[0])?,
        array(|p| p.met[1])?,
        array(|p| p.scattered)?,
        (sum(|p| p.given_up), sum(|p| p.lost)),
    ))
}

/// Where the first `rays` rays of a run of as many start, turn and end: one (k, 3) array each \[mm\]; a ray that escapes ends
/// `far` from its last turn.
#[pyfunction]
#[pyo3(signature = (scene, rays, seed, most_events, far))]
pub fn trace_trails<'py>(
    py: Python<'py>,
    scene: &Scene,
    rays: u64,
    seed: u64,
    most_events: u32,
    far: f64,
) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
    let opened = open(py, scene)?;
    let sets: Vec<Source<'_>> = opened.iter().map(Opened::core).collect::<PyResult<_>>()?;
    let sets: Vec<&dyn RaySource> = sets.iter().map(|s| s as &dyn RaySource).collect();
    let core = scene.core();
    let found = stoppable(py, |stop| {
        let run = Run {
            rays,
            seed,
            most_events,
            sets: &sets,
            stop: Some(stop),
            light_samplers: &[],
        };
        trails(core, &run, far)
    })?;
    opened.iter().try_for_each(Opened::check)?;
    found
        .into_iter()
        .map(|trail| {
            let points = trail.iter().flat_map(|p| [p.x, p.y, p.z]);
            PyArray1::from_iter(py, points).reshape([trail.len(), 3])
        })
        .collect()
}

type Crossings<'py> = (
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f64>>,
);

/// Every crossing of lines with faces at 0 < t: number of the line, face, t \[mm\].
#[pyfunction]
pub fn scene_crossings<'py>(
    py: Python<'py>,
    scene: &Scene,
    points: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
) -> PyResult<Crossings<'py>> {
    let (points, directions) = (vectors(&points)?, vectors(&directions)?);
    if points.len() != directions.len() {
        return Err(PyValueError::new_err("points and directions differ in number"));
    }
    let (mut lines, mut faces, mut distances) = (Vec::new(), Vec::new(), Vec::new());
    py.detach(|| {
        for (line, (o, d)) in (0..).zip(points.iter().zip(&directions)) {
            let (o, d) = (Vec3::from(*o), Vec3::from(*d).normalized());
            let range = [0.0, f64::INFINITY];
            scene
                .core()
                .face_set
                .crossings(o, d, range, &OriginFaces::default(), |face, crossing| {
                    lines.push(line);
                    faces.push(face);
                    distances.push(crossing.t);
                });
        }
    });
    Ok((
        PyArray1::from_vec(py, lines),
        PyArray1::from_vec(py, faces),
        PyArray1::from_vec(py, distances),
    ))
}

/// Rows of scatter events, and how often they were thinned.
type Events<'py> = (Bound<'py, PyArray2<u64>>, u32);

fn event_rows<'py>(py: Python<'py>, reservoir: &EventReservoir) -> PyResult<Events<'py>> {
    let mut words = Vec::with_capacity(reservoir.count() * WORDS);
    reservoir.rows().for_each(|row| words.extend_from_slice(row));
    Ok((
        PyArray1::from_vec(py, words).reshape([reservoir.count(), WORDS])?,
        reservoir.level(),
    ))
}

/// How often anything is thinned at most.
#[pyfunction]
pub fn deepest() -> u32 {
    DEEPEST
}

/// The light image of stored scatter events, whose rays bring such fluxes, as (Σ w, Σ w², rays, Σ w v) of each pixel.
#[pyfunction]
#[pyo3(signature = (scene, events, brought, view, threads=None))]
pub fn look_at_events<'py>(
    py: Python<'py>,
    scene: &Scene,
    events: PyReadonlyArray2<'py, u64>,
    brought: PyReadonlyArray1<'py, f64>,
    view: View,
    threads: Option<usize>,
) -> PyResult<CellArrays<'py>> {
    if events.shape()[1] != WORDS || brought.len() != events.shape()[0] {
        return Err(PyValueError::new_err(format!(
            "events of shape (n, {WORDS}), and n fluxes, are needed"
        )));
    }
    let (core, view) = (scene.core(), view.core());
    let (rows, brought) = (events.as_slice()?, brought.as_slice()?);
    let cells = stoppable(py, |stop| {
        inside(threads.unwrap_or(0), || {
            camera_connection::look_at_events(core, rows, brought, &view, Some(stop))
        })
    })?;
    let cells = cells.ok_or_else(|| PyValueError::new_err("the events are of another scene"))?;
    Ok(cell_arrays(py, cells.iter()))
}
