//! Which source gives out which ray of a run, and which rays are copies of one another.

use etendue_sampling::ordered::BATCH;
use etendue_trace::dealing::Dealing as CoreDealing;
use etendue_trace::records::Contribution;
use etendue_trace::tallies::{Joined, join};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::trace::{CellArrays, UnitArrays, cell_arrays, unit_arrays};

/// The rays of a run, dealt to its sources.
#[pyclass(frozen, module = "etendue._core")]
pub struct Dealing(CoreDealing);

#[pymethods]
impl Dealing {
    /// Of sources with these fluxes and, of those that give out rays of a set, its number and length.
    #[new]
    #[allow(clippy::needless_pass_by_value, reason = "Python hands them over")]
    fn new(fluxes: Vec<f64>, sets: Vec<Option<(usize, u64)>>, rays: u64) -> PyResult<Self> {
        if fluxes.len() != sets.len() || fluxes.is_empty() || !fluxes.iter().sum::<f64>().is_finite() {
            return Err(PyValueError::new_err("a flux and a set, or none, for each source"));
        }
        Ok(Self(CoreDealing::new(&fluxes, &sets, rays)))
    }

    /// Number of strata.
    const fn strata(&self) -> usize {
        self.0.strata()
    }

    /// Of each source: its stratum, and its rays in the whole run.
    fn sources(&self) -> Vec<(usize, u64)> {
        let count = self.0.sources();
        (0..count).map(|s| (self.0.stratum_of(s), self.0.count(s))).collect()
    }

    /// Of each stratum how many units there are among the first `done` rays.
    fn done(&self, done: u64) -> Vec<u64> {
        self.0.done(done)
    }

    /// The unit of each ray, and its stratum; by the rays' numbers in the run.
    fn units<'py>(
        &self,
        py: Python<'py>,
        rays: PyReadonlyArray1<'py, u64>,
    ) -> PyResult<[Bound<'py, PyArray1<u64>>; 2]> {
        let mut units = rays.as_slice()?.to_vec();
        for same in units.chunk_by_mut(|a, b| *a / BATCH == *b / BATCH) {
            let batch = same[0] / BATCH;
            self.0.units(batch, same.iter_mut());
        }
        let strata: Vec<u64> = units.iter().map(|unit| self.0.stratum(*unit) as u64).collect();
        Ok([PyArray1::from_vec(py, units), PyArray1::from_vec(py, strata)])
    }

    /// Adds units of rays with copies to open ones, when `done` rays are given out: what cells of strata grow by, and the
    /// units of which more copies may come.
    #[allow(clippy::needless_pass_by_value, reason = "Python hands them over")]
    fn join<'py>(
        &self,
        py: Python<'py>,
        open: UnitRows<'py>,
        copies: UnitRows<'py>,
        done: u64,
    ) -> PyResult<JoinedArrays<'py>> {
        let Joined { cells, open } = join(&self.0, &units(&open)?, &units(&copies)?, done);
        Ok((
            PyArray1::from_iter(py, cells.iter().map(|grown| grown.0)),
            PyArray1::from_iter(py, cells.iter().map(|grown| grown.1 as u64)),
            cell_arrays(py, cells.iter().map(|grown| &grown.2)),
            unit_arrays(py, &open),
        ))
    }
}

/// Units of rays with copies as Python hands them over: cell, unit, sum.
type UnitRows<'py> = (
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u64>,
    PyReadonlyArray1<'py, f64>,
);

/// Cell, stratum, what it grows by; open units.
type JoinedArrays<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u64>>,
    CellArrays<'py>,
    UnitArrays<'py>,
);

fn units((cells, units, sums): &UnitRows<'_>) -> PyResult<Vec<Contribution>> {
    let (cells, units, sums) = (cells.as_slice()?, units.as_slice()?, sums.as_slice()?);
    let rows = cells.iter().zip(units).zip(sums).map(|((c, u), s)| (*c, *u, *s));
    Ok(rows.collect())
}
