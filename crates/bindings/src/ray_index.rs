//! The index of rays by direction and position.

use etendue_lightfield::ray_index::{
    Cells, LEAF, RayIndex, arrange as core_arrange, count as core_count, index_sums as core_sums, place as core_place,
};
use etendue_math::Vec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::cone::{Cone, SumArrays};
use crate::run::interruptible;
use crate::scan::account_dict;
use crate::source::{Opened, RayTable, Records, Source, with_source};

fn grid(side: u32) -> PyResult<Cells> {
    Cells::new(side).ok_or_else(|| PyValueError::new_err(format!("{side} cells along a side")))
}

/// Rays of a leaf.
#[pyfunction]
pub fn index_leaf() -> usize {
    LEAF
}

/// First pass: (usable rays of each cell, tally).
#[pyfunction]
#[pyo3(signature = (source, side, threads=None, progress=None))]
pub fn index_count<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    side: u32,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyArray1<u64>>, Bound<'py, PyDict>)> {
    let cells = grid(side)?;
    let (counts, tally) = with_source(source, |source| {
        interruptible(py, threads, progress, |threads, tick| {
            core_count(source, cells, threads, tick)
        })
    })?;
    Ok((PyArray1::from_vec(py, counts), account_dict(py, &tally)?))
}

/// Second pass: the records of the usable rays into `out`, each cell's from its place in `starts` on. False if they are
/// not those that were counted.
#[pyfunction]
#[pyo3(signature = (source, side, starts, out, threads=None, progress=None))]
pub fn index_place(
    py: Python<'_>,
    source: &Bound<'_, PyAny>,
    side: u32,
    starts: PyReadonlyArray1<'_, u64>,
    mut out: PyReadwriteArray1<'_, u8>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<bool> {
    let (cells, starts, out) = (grid(side)?, starts.as_slice()?, out.as_slice_mut()?);
    with_source(source, |source| {
        let table = match source {
            Source::Table(table) => Some(table),
            _ => None,
        };
        interruptible(py, threads, progress, |threads, tick| {
            core_place(source, table, cells, starts, out, threads, tick)
        })
    })
}

/// Last pass: the records of a writable table in the order of their leaves; returns the boxes, shape (leaves, 8).
#[pyfunction]
#[pyo3(signature = (records, side, starts, centre, threads=None, progress=None))]
pub fn index_arrange<'py>(
    py: Python<'py>,
    records: &Bound<'py, RayTable>,
    side: u32,
    starts: PyReadonlyArray1<'py, u64>,
    centre: [f64; 3],
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (cells, starts, layout) = (grid(side)?, starts.as_slice()?, records.get().layout);
    let [x, y, z] = centre;
    let Records::Array(bytes) = &records.get().records else {
        return Err(PyValueError::new_err(
            "records are put in order in memory or in a map, not in a file",
        ));
    };
    let mut bytes = bytes.bind(py).try_readwrite()?;
    let bytes = bytes.as_slice_mut()?;
    let bounds = interruptible(py, threads, progress, |threads, tick| {
        core_arrange(bytes, &layout, cells, starts, Vec3::new(x, y, z), threads, tick)
    })?;
    let bounds = bounds.ok_or_else(|| PyRuntimeError::new_err("the records do not fit their cells"))?;
    let leaves = bounds.len();
    PyArray1::from_vec(py, bounds.into_iter().flatten().collect()).reshape([leaves, 8])
}

/// For each cone the sums (Σ w, Σ w², number of rays), each of shape (acceptances, rows, columns), and the number of rays
/// looked at.
#[pyfunction]
#[pyo3(signature = (records, side, starts, bounds, centre, cones, threads=None, progress=None))]
#[allow(clippy::too_many_arguments, reason = "an index is that many tables")]
pub fn index_sums<'py>(
    py: Python<'py>,
    records: &Bound<'py, RayTable>,
    side: u32,
    starts: PyReadonlyArray1<'py, u64>,
    bounds: PyReadonlyArray2<'py, f32>,
    centre: [f64; 3],
    cones: Vec<Cone>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<(SumArrays<'py>, u64)>> {
    let opened = Opened::table(py, records.get())?;
    let Source::Table(rays) = opened.core()? else {
        return Err(PyValueError::new_err("an index is one over records"));
    };
    let [x, y, z] = centre;
    let index = RayIndex::new(
        rays,
        grid(side)?,
        Vec3::new(x, y, z),
        starts.as_slice()?,
        bounds.as_slice()?,
    )
    .ok_or_else(|| PyValueError::new_err("the tables of the index do not fit each other"))?;
    let core: Vec<_> = cones.iter().map(Cone::core).collect();
    let sums = interruptible(py, threads, progress, |threads, tick| {
        core_sums(&index, &core, threads, tick)
    });
    opened.check()?;
    let sums = sums?;
    let arrays = sums.into_iter().zip(&cones);
    arrays
        .map(|((sum, looked), cone)| Ok((cone.arrays(py, sum)?, looked)))
        .collect()
}
