//! The statistics of a ray set.

use etendue_geometry::PassAccount;
use etendue_geometry::colours::{Bin, Colours, colours as core_colours};
use etendue_geometry::scan::{Scan, scan as core_scan};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::run::interruptible;
use crate::source::with_source;

/// The account of a pass as a dictionary.
pub fn account_dict<'py>(py: Python<'py>, tally: &PassAccount) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("rays", tally.rays)?;
    dict.set_item("defects", tally.defects)?;
    dict.set_item("dark", tally.dark)?;
    dict.set_item("flux", tally.flux)?;
    dict.set_item("flux_squared", tally.flux_squared)?;
    dict.set_item("norm_error", tally.norm_error)?;
    Ok(dict)
}

/// One pass over a source: (tally, moments), both dictionaries.
#[pyfunction]
#[pyo3(signature = (source, threads=None, progress=None))]
pub fn scan<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let scan: Scan = with_source(source, |source| {
        interruptible(py, threads, progress, |threads, tick| core_scan(source, threads, tick))
    })?;
    let moments = PyDict::new(py);
    moments.set_item("flux_range", scan.flux_range)?;
    moments.set_item("bounds", scan.bounds)?;
    moments.set_item("weighted_position", scan.weighted_position)?;
    moments.set_item("weighted_direction", scan.weighted_direction)?;
    moments.set_item("weighted_outer", scan.weighted_outer)?;
    moments.set_item("focus_rhs", scan.focus_rhs)?;
    Ok((account_dict(py, &scan.tally)?, moments))
}

/// One pass over a source whose records tell the colours of their rays, as a dictionary: ``flux``, ``mean``, ``low`` and
/// ``high`` of each bin of colours, and ``unknown``: flux and number of the rays without one.
#[pyfunction]
#[pyo3(signature = (source, threads=None, progress=None))]
pub fn scan_colours<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let found: Colours = with_source(source, |source| {
        interruptible(py, threads, progress, |threads, tick| {
            core_colours(source, threads, tick)
        })
    })?;
    let dict = PyDict::new(py);
    let array = |pick: fn(&Bin) -> f64| PyArray1::from_iter(py, found.bins.values().map(pick));
    dict.set_item("flux", array(|bin| bin.flux))?;
    dict.set_item("mean", array(Bin::mean))?;
    dict.set_item("low", array(|bin| bin.range[0]))?;
    dict.set_item("high", array(|bin| bin.range[1]))?;
    dict.set_item("unknown", found.unknown)?;
    Ok(dict)
}
