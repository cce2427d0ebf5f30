//! The optional Pólya tree.

use etendue_lightfield::polya::{Base, Data, Grid, average, log_evidence, posterior};
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

impl Masses<'_> {
    /// The factors of a product; none of a table of cells.
    fn factors(&self) -> PyResult<Vec<(usize, &[f64])>> {
        match self {
            Self::Cells(_) => Ok(Vec::new()),
            Self::Factors(factors) => factors
                .iter()
                .map(|(axes, mass)| Ok((*axes, mass.as_slice()?)))
                .collect(),
        }
    }
}

struct Problem {
    grid: Grid,
    base: Base,
}

impl Problem {
    fn new(depths: Vec<u32>, weight: &[f64], squared: Option<&[f64]>, masses: Option<&Masses<'_>>) -> PyResult<Self> {
        let refuse = |message: String| Err(PyValueError::new_err(message));
        let factors = match masses {
            None => Vec::new(),
            Some(Masses::Cells(mass)) => vec![(depths.len(), mass.as_slice()?)],
            Some(product) => product.factors()?,
        };
        let base = if factors.is_empty() {
            Base::uniform()
        } else if let Some(base) = Base::product(&depths, &factors) {
            base
        } else {
            return refuse(format!("the masses of the base do not fit the depths {depths:?}"));
        };
        let Some(grid) = Grid::new(depths) else {
            return refuse("no axis, or more than 2^34 boxes".into());
        };
        if weight.len() != grid.cells() || squared.is_some_and(|s| s.len() != grid.cells()) {
            return refuse(format!("{} cells need as many weights", grid.cells()));
        }
        Ok(Self { grid, base })
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
    let weight = weight.as_slice()?;
    let squared = weight_squared.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
    let Problem { grid, base } = Problem::new(depths, weight, squared, base.as_ref())?;
    let result = stoppable(py, |stop| {
        let data = Data {
            weight,
            squared,
            base: &base,
            stop: Some(stop),
        };
        posterior(&grid, &data, concentration, threads.unwrap_or(0))
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
    let weight = weight.as_slice()?;
    let squared = weight_squared.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
    let base = base.map(Masses::Factors);
    let Problem { grid, base: own } = Problem::new(depths, weight, squared, base.as_ref())?;
    if positions.is_empty() || positions.iter().any(|p| p.len() != grid.depths().len()) {
        return Err(PyValueError::new_err(
            "give positions with one number of steps per axis",
        ));
    }
    let factors = base.as_ref().map(Masses::factors).transpose()?.unwrap_or_default();
    let result = stoppable(py, |stop| {
        let data = Data {
            weight,
            squared,
            base: &own,
            stop: Some(stop),
        };
        average(&grid, &data, &factors, concentration, &positions, threads.unwrap_or(0))
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
    let weight = weight.as_slice()?;
    let squared = weight_squared.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
    let Problem { grid, base } = Problem::new(depths, weight, squared, base.as_ref())?;
    stoppable(py, |stop| {
        let data = Data {
            weight,
            squared,
            base: &base,
            stop: Some(stop),
        };
        log_evidence(&grid, &data, concentration, threads.unwrap_or(0))
    })
}
