//! The cone estimator.

use etendue_lightfield::cone::{Cone as CoreCone, Sums, cone_sums as core_cone_sums};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::run::interruptible;
use crate::scan::account_dict;
use crate::source::with_source;
use crate::view::View;

/// A view with its acceptances, as Python hands it over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Cone {
    view: View,
    acceptances: Vec<f64>,
    disk: Option<f64>,
}

impl Cone {
    /// As the core takes it.
    pub fn core(&self) -> CoreCone {
        CoreCone {
            view: self.view.core(),
            acceptances: self.acceptances.clone(),
            disk: self.disk,
        }
    }

    /// The sums of this cone, each of shape (acceptances, rows, columns).
    pub fn arrays<'py>(&self, py: Python<'py>, sums: Sums) -> PyResult<SumArrays<'py>> {
        let view = self.view.core();
        let shape = [self.acceptances.len(), view.rows as usize, view.columns as usize];
        Ok((
            PyArray1::from_vec(py, sums.flux).reshape(shape)?,
            PyArray1::from_vec(py, sums.flux_squared).reshape(shape)?,
            PyArray1::from_vec(py, sums.rays).reshape(shape)?,
        ))
    }
}

pub type SumArrays<'py> = (
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<u64>>,
);

/// For each cone the sums (Σ w, Σ w², number of rays), each of shape (acceptances, rows, columns), and the tally.
#[pyfunction]
#[pyo3(signature = (source, cones, threads=None, progress=None))]
pub fn cone_sums<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    cones: Vec<Cone>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Vec<SumArrays<'py>>, Bound<'py, PyDict>)> {
    let core: Vec<CoreCone> = cones.iter().map(Cone::core).collect();
    let (sums, tally) = with_source(source, |source| {
        interruptible(py, threads, progress, |threads, tick| {
            core_cone_sums(source, &core, threads, tick)
        })
    })?;
    let arrays = sums.into_iter().zip(&cones).map(|(sum, cone)| cone.arrays(py, sum));
    Ok((arrays.collect::<PyResult<_>>()?, account_dict(py, &tally)?))
}
