//! Random choices of rays.

use etendue_sampling::subset;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Indices in `start..stop` that belong to a random k-subset of `0..n`, of which `taken` were taken before `start`.
#[pyfunction]
pub fn select_subset(
    py: Python<'_>,
    start: u64,
    stop: u64,
    n: u64,
    k: u64,
    taken: u64,
    seed: u64,
) -> PyResult<Bound<'_, PyArray1<u64>>> {
    if start > stop || stop > n || k > n || taken > k {
        return Err(PyValueError::new_err(format!(
            "subset {start}..{stop} of {n}: k = {k}, taken = {taken}"
        )));
    }
    let chosen = py.detach(|| subset::select(start, stop, n, k, taken, seed));
    Ok(PyArray1::from_vec(py, chosen))
}

/// The part, 0 to `parts` − 1, of each ray in `start..stop`.
#[pyfunction]
pub fn deal_parts(py: Python<'_>, start: u64, stop: u64, parts: u32, seed: u64) -> PyResult<Bound<'_, PyArray1<u32>>> {
    if start > stop || parts == 0 {
        return Err(PyValueError::new_err(format!("rays {start}..{stop} in {parts} parts")));
    }
    let dealt = py.detach(|| subset::deal(start, stop, parts, seed));
    Ok(PyArray1::from_vec(py, dealt))
}
