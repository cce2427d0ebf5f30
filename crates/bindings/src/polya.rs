//! The optional Pólya tree.

use etendue_lightfield::polya::{Grid, posterior};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Moments<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, f64);

/// Posterior mean of the ratio of mass to base mass, mean of its square, ln evidence; arrays over the cells of a grid of
/// 2^depths\[k\] cells along axis k, last axis fastest.
#[pyfunction]
pub fn polya_posterior<'py>(
    py: Python<'py>,
    depths: Vec<u32>,
    weight: PyReadonlyArray1<'py, f64>,
    weight_squared: PyReadonlyArray1<'py, f64>,
    base: PyReadonlyArray1<'py, f64>,
    concentration: f64,
) -> PyResult<Moments<'py>> {
    let grid = Grid::new(depths).ok_or_else(|| PyValueError::new_err("no axis, or more than 2^34 boxes"))?;
    let (weight, weight_squared, base) = (weight.as_slice()?, weight_squared.as_slice()?, base.as_slice()?);
    if [weight.len(), weight_squared.len(), base.len()]
        .iter()
        .any(|n| *n != grid.cells())
    {
        return Err(PyValueError::new_err(format!(
            "{} cells need as many weights and base masses",
            grid.cells()
        )));
    }
    let result = py.detach(|| posterior(&grid, weight, weight_squared, base, concentration));
    Ok((
        PyArray1::from_vec(py, result.ratio),
        PyArray1::from_vec(py, result.ratio_squared),
        result.log_evidence,
    ))
}
