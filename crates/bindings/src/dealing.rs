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

    /// Number of strata without copies, which are the first ones.
    const fn plain(&self) -> usize {
        self.0.plain()
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

    /// The unit of each ray, its stratum, and what it brings in the whole run over the flux of the ray; by the rays' numbers
    /// in the run.
    fn units<'py>(&self, py: Python<'py>, rays: PyReadonlyArray1<'py, u64>) -> PyResult<RayUnits<'py>> {
        let of_batch = |same: &[u64]| self.0.units(same[0] / BATCH, same.iter().copied());
        let parts = rays.as_slice()?.chunk_by(|a, b| *a / BATCH == *b / BATCH);
        let units: Vec<(u64, f64)> = parts.flat_map(of_batch).collect();
        Ok((
            PyArray1::from_iter(py, units.iter().map(|of| of.0)),
            PyArray1::from_iter(py, units.iter().map(|of| self.0.stratum(of.0) as u64)),
            PyArray1::from_iter(py, units.iter().map(|of| of.1)),
        ))
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

/// Unit, stratum and share of rays.
type RayUnits<'py> = (
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Units of rays with copies as Python hands them over: cell, unit, sum, flux.
type UnitRows<'py> = (
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u64>,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
);

/// Cell, stratum, what it grows by; open units.
type JoinedArrays<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u64>>,
    CellArrays<'py>,
    UnitArrays<'py>,
);

fn units((cells, units, sums, fluxes): &UnitRows<'_>) -> PyResult<Vec<Contribution>> {
    let (cells, units) = (cells.as_slice()?, units.as_slice()?);
    let amounts = sums.as_slice()?.iter().zip(fluxes.as_slice()?);
    let rows = cells.iter().zip(units).zip(amounts);
    Ok(rows
        .map(|((cell, unit), (amount, flux))| Contribution {
            cell: *cell,
            unit: *unit,
            amount: *amount,
            flux: *flux,
        })
        .collect())
}
