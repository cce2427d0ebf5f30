//! Étendue counts of a ray source.

use etendue_lightfield::counts::{CHANCES, PartGrids, Plan, Sums, count};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::carrier::Part;
use crate::run::interruptible;
use crate::scan::account_dict;
use crate::source::with_source;

/// Σ w and Σ w² per cell as arrays; numbers and None if all weights are equal.
fn sums(py: Python<'_>, sums: Sums) -> (Bound<'_, PyAny>, Option<Bound<'_, PyArray1<f64>>>) {
    match sums {
        Sums::Equal(counts) => (PyArray1::from_vec(py, counts).into_any(), None),
        Sums::Weighted(sums) => {
            let [sum, squares] = [0, 1].map(|k| PyArray1::from_iter(py, sums.iter().map(|both| both[k])));
            (sum.into_any(), Some(squares))
        }
    }
}

/// One pass: for each of the grids "grid", "space" and "direction" the pair (Σ w, Σ w²), with cells ordered by fold
/// (fitted, held out), part, coordinates; beside them the kept rays, the rays not met, and the tally.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "Python hands them over by name")]
#[pyo3(signature = (source, parts, grids, held_out, kept, seed, threads=None, progress=None))]
pub fn count_rays<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    parts: Vec<Part>,
    grids: Vec<([u32; 4], [u32; 2])>,
    held_out: f64,
    kept: f64,
    seed: u64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "shares from 0 to 1"
    )]
    let chances = |share: f64| (share.clamp(0.0, 1.0) * f64::from(CHANCES)).round() as u32;
    let plan = Plan {
        parts: parts.iter().map(Part::core).collect::<PyResult<_>>()?,
        grids: grids
            .iter()
            .map(|(depths, fine)| PartGrids {
                depths: *depths,
                fine: *fine,
            })
            .collect(),
        held_out: chances(held_out),
        kept: chances(kept.min(held_out)),
        seed,
    };
    let counts = with_source(source, |source| {
        interruptible(py, threads, progress, |threads, tick| {
            count(source, &plan, threads, tick)
        })
    })?
    .ok_or_else(|| PyValueError::new_err("these grids do not fit the parts, or have too many cells"))?;
    let result = PyDict::new(py);
    result.set_item("grid", sums(py, counts.grid))?;
    result.set_item("space", sums(py, counts.space))?;
    result.set_item("direction", sums(py, counts.direction))?;
    result.set_item("weight", counts.weight)?;
    let parts: Vec<i64> = counts.kept.iter().map(|k| i64::from(k.part)).collect();
    let weights: Vec<f64> = counts.kept.iter().map(|k| k.weight).collect();
    let coordinates: Vec<f64> = counts.kept.iter().flat_map(|k| k.coordinates).collect();
    let n = parts.len();
    result.set_item("kept_part", PyArray1::from_vec(py, parts))?;
    result.set_item("kept_weight", PyArray1::from_vec(py, weights))?;
    result.set_item("kept", PyArray1::from_vec(py, coordinates).reshape([n, 4])?)?;
    result.set_item("unmet_rays", counts.unmet_rays)?;
    result.set_item("unmet_flux", counts.unmet_flux)?;
    result.set_item("tally", account_dict(py, &counts.tally)?)?;
    Ok(result)
}
