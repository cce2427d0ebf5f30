//! Tracing: a number of batches at a time, so that Python can report progress, look at errors and stop in between.

use std::ops::Range;

use etendue_geometry::RaySource;
use etendue_sampling::ordered::{BATCH, within};
use etendue_trace::forward::{Cell, Harvest, Record, Run, trace};
use etendue_trace::ledger::{Entry, Ledger};
use etendue_trace::meeting::Loss;
use etendue_trace::reverse::{Lit, Method, Pixel};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::scene::Scene;
use crate::source::{Opened, Source};
use crate::view::View;

fn entries<'py>(py: Python<'py>, entries: &[Entry]) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u64>>) {
    (
        PyArray1::from_iter(py, entries.iter().map(|e| e.flux())),
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

fn cell_arrays<'py>(py: Python<'py>, cells: &[Cell]) -> impl IntoPyObject<'py> {
    (
        PyArray1::from_iter(py, cells.iter().map(|c| c.sum)),
        PyArray1::from_iter(py, cells.iter().map(|c| c.squares)),
        PyArray1::from_iter(py, cells.iter().map(|c| c.rays)),
    )
}

/// Rows of position, direction, flux, wavelength.
fn record_array<'py>(py: Python<'py>, records: &[Record]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = records.iter().flat_map(|r| {
        let [x, y, z] = r.position;
        let [kx, ky, kz] = r.direction;
        [x, y, z, kx, ky, kz, r.flux, r.wavelength]
    });
    PyArray1::from_iter(py, rows).reshape([records.len(), 8])
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

/// Traces batches `first..last` of a run of `rays` rays.
#[pyfunction]
#[pyo3(signature = (scene, rays, seed, most_events, first, last, threads=None))]
pub fn trace_batches<'py>(
    py: Python<'py>,
    scene: &Scene,
    rays: u64,
    seed: u64,
    most_events: u32,
    first: u64,
    last: u64,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    if first > last || last > rays.div_ceil(BATCH) {
        return Err(PyValueError::new_err(format!("batches {first}..{last} of {rays} rays")));
    }
    let sets: Vec<Opened<'_>> = scene.sets().iter().map(|s| Opened::new(s.bind(py))).collect::<PyResult<_>>()?;
    let sets: Vec<Source<'_>> = sets.iter().map(Opened::core).collect::<PyResult<_>>()?;
    let sets: Vec<&dyn RaySource> = sets.iter().map(|s| s as &dyn RaySource).collect();
    let run = Run {
        rays,
        seed,
        most_events,
        sets: &sets,
    };
    let core = scene.core();
    let batches: Range<u64> = first..last;
    let harvest: Harvest = py.detach(|| within(threads.unwrap_or(0), |_| trace(core, &run, batches.clone())));
    let dict = PyDict::new(py);
    dict.set_item("ledger", ledger_dict(py, &harvest.ledger)?)?;
    let cells = PyList::empty(py);
    for detector in &harvest.cells {
        cells.append(cell_arrays(py, detector))?;
    }
    dict.set_item("cells", cells)?;
    let records = PyList::empty(py);
    for detector in &harvest.records {
        records.append(record_array(py, detector)?)?;
    }
    dict.set_item("records", records)?;
    dict.set_item("rays", harvest.rays)?;
    dict.set_item("imbalance", harvest.imbalance)?;
    Ok(dict)
}

/// Looks at a scene: for each pixel, row by row, the sums over passes `first..last` of the mean luminance of a pass, of its
/// square, and of the sources' own deviation \[flux unit/(mm² sr)\].
#[pyfunction]
#[pyo3(signature = (scene, view, paths, seed, most_events, without_caustics, first, last, threads=None))]
pub fn look_at_scene<'py>(
    py: Python<'py>,
    scene: &Scene,
    view: View,
    paths: u32,
    seed: u64,
    most_events: u32,
    without_caustics: bool,
    first: u32,
    last: u32,
    threads: Option<usize>,
) -> PyResult<[Bound<'py, PyArray2<f64>>; 3]> {
    let view = view.core();
    let method = Method {
        paths,
        seed,
        most_events,
        without_caustics,
    };
    let pixels = py.detach(|| {
        let lit = Lit::new(scene.core(), scene.lanterns());
        within(threads.unwrap_or(0), |_| lit.look(&view, &method, first..last))
    });
    let shape = [view.rows as usize, view.columns as usize];
    let array = |pick: fn(&Pixel) -> f64| PyArray1::from_iter(py, pixels.iter().map(pick)).reshape(shape);
    Ok([array(|p| p.sum)?, array(|p| p.squares)?, array(|p| p.deviation)?])
}
