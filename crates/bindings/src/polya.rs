//! The optional Pólya tree.

use std::sync::atomic::AtomicBool;

use etendue_lightfield::polya::{self, Data, Grid, average, log_evidence, posterior};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::run::stoppable;

type Floats<'py> = PyReadonlyArray1<'py, f64>;
type Moments<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, f64);
type Averages<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Vec<f64>);

/// A base measure as Python hands it over: the mass of each cell, or the factors of a product, each with its number of axes.
#[derive(FromPyObject)]
pub enum Masses<'py> {
    Cells(Floats<'py>),
    Factors(Vec<(usize, Floats<'py>)>),
}

/// What is to be fitted, as Python hands it over.
struct Problem<'a> {
    grid: Grid,
    weight: &'a [f64],
    squared: Option<&'a [f64]>,
    factors: Vec<polya::Masses<'a>>,
}

impl<'a> Problem<'a> {
    fn new(
        depths: Vec<u32>,
        weight: &'a Floats<'_>,
        squared: Option<&'a Floats<'_>>,
        masses: Option<&'a Masses<'_>>,
    ) -> PyResult<Self> {
        let refuse = |message: String| Err(PyValueError::new_err(message));
        let factors = match masses {
            None => Vec::new(),
            Some(Masses::Cells(mass)) => vec![(depths.len(), mass.as_slice()?)],
            Some(Masses::Factors(factors)) => factors
                .iter()
                .map(|(axes, mass)| Ok((*axes, mass.as_slice()?)))
                .collect::<PyResult<_>>()?,
        };
        let Some(grid) = Grid::new(depths) else {
            return refuse("no axis, or more than 2^34 boxes".into());
        };
        let (weight, squared) = (weight.as_slice()?, squared.map(PyReadonlyArray1::as_slice).transpose()?);
        if weight.len() != grid.cells() || squared.is_some_and(|s| s.len() != grid.cells()) {
            return refuse(format!("{} cells need as many weights", grid.cells()));
        }
        let problem = Self {
            grid,
            weight,
            squared,
            factors,
        };
        if !problem.data(None).fits(&problem.grid) {
            return refuse(format!(
                "the masses of the base do not fit the depths {:?}",
                problem.grid.depths()
            ));
        }
        Ok(problem)
    }

    fn data<'b>(&'b self, stop: Option<&'b AtomicBool>) -> Data<'b> {
        Data {
            weight: self.weight,
            squared: self.squared,
            factors: &self.factors,
            stop,
        }
    }
}

/// Posterior mean of the ratio of mass to base mass, mean of its square, ln evidence; arrays over the cells of a grid of
/// 2^depths\[k\] cells along axis k, last axis fastest.
#[pyfunction]
#[pyo3(signature = (depths, weight, weight_squared, base, concentration, threads=None))]
pub fn polya_posterior<'py>(
    py: Python<'py>,
    depths: Vec<u32>,
    weight: Floats<'py>,
    weight_squared: Option<Floats<'py>>,
    base: Option<Masses<'py>>,
    concentration: f64,
    threads: Option<usize>,
) -> PyResult<Moments<'py>> {
    let problem = Problem::new(depths, &weight, weight_squared.as_ref(), base.as_ref())?;
    let result = stoppable(py, |stop| {
        let data = problem.data(Some(stop));
        posterior(&problem.grid, &data, concentration, threads.unwrap_or(0))
    })?;
    Ok((
        PyArray1::from_vec(py, result.ratio),
        PyArray1::from_vec(py, result.ratio_squared),
        result.log_evidence,
    ))
}

/// Averages of trees whose cells are moved cyclically by some steps along each axis: mean of mass over base mass per cell, mean of
/// its square, and ln evidence of each tree.
#[pyfunction]
#[pyo3(signature = (depths, weight, weight_squared, base, concentration, positions, threads=None))]
#[allow(clippy::too_many_arguments, reason = "one per name in Python")]
pub fn polya_average<'py>(
    py: Python<'py>,
    depths: Vec<u32>,
    weight: Floats<'py>,
    weight_squared: Option<Floats<'py>>,
    base: Option<Vec<(usize, Floats<'py>)>>,
    concentration: f64,
    positions: Vec<Vec<usize>>,
    threads: Option<usize>,
) -> PyResult<Averages<'py>> {
    let base = base.map(Masses::Factors);
    let problem = Problem::new(depths, &weight, weight_squared.as_ref(), base.as_ref())?;
    if positions.is_empty() || positions.iter().any(|p| p.len() != problem.grid.depths().len()) {
        return Err(PyValueError::new_err(
            "give positions with one number of steps per axis",
        ));
    }
    let result = stoppable(py, |stop| {
        let data = problem.data(Some(stop));
        average(&problem.grid, &data, concentration, &positions, threads.unwrap_or(0))
    })?;
    Ok((
        PyArray1::from_vec(py, result.ratio),
        PyArray1::from_vec(py, result.ratio_squared),
        result.log_evidence,
    ))
}

/// ln evidence alone, for the same arguments.
#[pyfunction]
#[pyo3(signature = (depths, weight, weight_squared, base, concentration, threads=None))]
pub fn polya_evidence<'py>(
    py: Python<'py>,
    depths: Vec<u32>,
    weight: Floats<'py>,
    weight_squared: Option<Floats<'py>>,
    base: Option<Masses<'py>>,
    concentration: f64,
    threads: Option<usize>,
) -> PyResult<f64> {
    let problem = Problem::new(depths, &weight, weight_squared.as_ref(), base.as_ref())?;
    stoppable(py, |stop| {
        let data = problem.data(Some(stop));
        log_evidence(&problem.grid, &data, concentration, threads.unwrap_or(0))
    })
}

/// Holds the memory of trees between them from when it is entered to when it is left.
#[pyclass(module = "etendue._core")]
#[derive(Default)]
pub struct TreeMemory {
    held: Vec<polya::TreeMemory>,
}

#[pymethods]
impl TreeMemory {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    fn __enter__(&mut self) {
        self.held.push(polya::TreeMemory::begin());
    }

    fn __exit__(&mut self, _kind: Bound<'_, PyAny>, _error: Bound<'_, PyAny>, _traceback: Bound<'_, PyAny>) {
        self.held.pop();
    }
}
