//! Keys of rays as arrays.

use etendue_geometry::{RaySource, ray_keys as core};
use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::source::with_source;

/// A key of each ray's place and direction, shapes (n, 3).
#[pyfunction]
pub fn ray_keys<'py>(
    py: Python<'py>,
    position: PyReadonlyArray2<'py, f64>,
    direction: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<u64>>> {
    if position.shape()[1] != 3 || direction.shape() != position.shape() {
        return Err(PyValueError::new_err("places and directions have shape (n, 3)"));
    }
    let (places, ways) = (position.as_array(), direction.as_array());
    let of = |row: numpy::ndarray::ArrayView1<'_, f64>| [row[0], row[1], row[2]];
    let keys = places.rows().into_iter().zip(ways.rows());
    let keys: Vec<u64> = keys.map(|(place, way)| core::ray_key(of(place), of(way))).collect();
    Ok(PyArray1::from_vec(py, keys))
}

/// Keys, and flux of the same rays.
type KeysAndFlux<'py> = (Bound<'py, PyArray1<u64>>, Bound<'py, PyArray1<f64>>);

/// Keys that are multiples of `every`, and the flux, of the rays of ranges (start, stop) that have flux.
#[pyfunction]
#[pyo3(signature = (source, ranges, every, threads=None))]
pub fn kept_ray_keys<'py>(
    py: Python<'py>,
    source: &Bound<'py, PyAny>,
    ranges: Vec<(u64, u64)>,
    every: u64,
    threads: Option<usize>,
) -> PyResult<KeysAndFlux<'py>> {
    with_source(source, |source| {
        let there = |(start, stop): &(u64, u64)| start <= stop && *stop <= source.len();
        if every == 0 || !ranges.iter().all(there) {
            let told = format!(
                "ranges {ranges:?} of {} rays, of which each {every}th is kept",
                source.len()
            );
            return Err(PyValueError::new_err(told));
        }
        let ranges: Vec<_> = ranges.iter().map(|(start, stop)| *start..*stop).collect();
        let (keys, flux) = py.detach(|| core::kept_keys(source, &ranges, every, threads.unwrap_or(0)));
        Ok((PyArray1::from_vec(py, keys), PyArray1::from_vec(py, flux)))
    })
}
