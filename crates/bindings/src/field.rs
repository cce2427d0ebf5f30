//! Light fields as Python objects.

use std::sync::{Arc, OnceLock};

use etendue_lightfield::field::draw::{FieldRays as CoreRays, Sampler};
use etendue_lightfield::field::intensity::intensity;
use etendue_lightfield::field::look::{along, look};
use etendue_lightfield::field::nodes;
use etendue_lightfield::field::{Averaging, Factor, FineErrors, LightField as CoreField, PartField, Reading};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::carrier::{Part, vectors};
use crate::run::stoppable;
use crate::view::View;

/// Values at the centres of cells of a grid whose linear interpolation has the means given over the cells.
#[pyfunction]
pub fn node_values<'py>(
    py: Python<'py>,
    means: PyReadonlyArray1<'py, f64>,
    shape: Vec<usize>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let means = means.as_slice()?;
    let cells = shape.iter().try_fold(1_usize, |cells, n| cells.checked_mul(*n));
    if cells != Some(means.len()) {
        return Err(PyValueError::new_err("one mean per cell of the shape is needed"));
    }
    Ok(PyArray1::from_vec(py, py.detach(|| nodes::node_values(means, &shape))))
}

/// The light that leaves one part, as Python hands it over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct FieldPart<'py> {
    part: Part,
    cells: [usize; 4],
    ratio: PyReadonlyArray1<'py, f32>,
    deviation: PyReadonlyArray1<'py, f32>,
    space: Option<PyReadonlyArray2<'py, f64>>,
    direction: Option<PyReadonlyArray2<'py, f64>>,
    level: f64,
    space_error: Option<PyReadonlyArray2<'py, f64>>,
    direction_error: Option<PyReadonlyArray2<'py, f64>>,
    cells_left: Vec<f64>,
    within_left: Vec<f64>,
}

impl FieldPart<'_> {
    fn core(&self) -> PyResult<PartField> {
        let refuse = |message: &str| PyValueError::new_err(message.to_owned());
        let part = self.part.core()?;
        let (ratio, deviation) = (self.ratio.as_slice()?, self.deviation.as_slice()?);
        let cells: usize = self.cells.iter().product();
        if ratio.len() != cells || deviation.len() != cells || !self.cells.iter().all(|n| n.is_power_of_two()) {
            return Err(refuse(
                "ratio and deviation need one entry per cell, and powers of two cells along each axis",
            ));
        }
        let sound = |v: &[f32]| v.iter().all(|r| *r >= 0.0 && r.is_finite());
        if !(sound(ratio) && sound(deviation) && self.level >= 0.0 && self.level.is_finite()) {
            return Err(refuse("ratio, deviation and level must be finite and not negative"));
        }
        let factor = |values: Option<&PyReadonlyArray2<'_, f64>>, wraps: bool| match values {
            None => Ok(Factor::one()),
            Some(values) => Factor::new(values.shape()[0], values.as_slice()?.to_vec(), wraps)
                .ok_or_else(|| refuse("a factor needs n × n values, n a power of two, finite and not negative")),
        };
        let mut errors = FineErrors::none();
        for (own, values, wraps) in [
            (&mut errors.space, &self.space_error, part.wraps()),
            (&mut errors.direction, &self.direction_error, false),
        ] {
            if values.is_some() {
                *own = factor(values.as_ref(), wraps)?;
            }
        }
        for (own, left) in [
            (&mut errors.cells, &self.cells_left),
            (&mut errors.within, &self.within_left),
        ] {
            *own = Averaging::new(left.clone()).ok_or_else(|| refuse("what averaging leaves lies from 0 to 1"))?;
        }
        Ok(PartField {
            part,
            cells: self.cells,
            ratio: ratio.iter().zip(deviation).map(|(r, d)| [*r, *d]).collect(),
            space: factor(self.space.as_ref(), part.wraps())?,
            direction: factor(self.direction.as_ref(), false)?,
            level: self.level,
            errors,
        })
    }
}

/// A light field, ready to be read, looked at and drawn from.
#[pyclass(frozen, module = "etendue._core")]
pub struct LightField {
    field: Arc<CoreField>,
    /// Both made when they are first asked for: reading needs none.
    sampler: OnceLock<Option<Arc<Sampler>>>,
    fluxes: OnceLock<Vec<f64>>,
}

impl LightField {
    /// What draws rays from it.
    pub fn sampler(&self, py: Python<'_>) -> PyResult<Arc<Sampler>> {
        let make = || Sampler::new(Arc::clone(&self.field)).map(Arc::new);
        let sampler = py.detach(|| self.sampler.get_or_init(make).clone());
        sampler.ok_or_else(|| PyValueError::new_err("a light field needs flux"))
    }

    fn part(&self, index: usize) -> PyResult<&PartField> {
        let found = self.field.parts.get(index);
        found.ok_or_else(|| PyValueError::new_err(format!("there is no part {index}")))
    }
}

type Pixels<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);
type Readings<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

fn readings(py: Python<'_>, readings: Vec<Reading>) -> Readings<'_> {
    let values = readings.iter().map(|r| r.value).collect();
    let deviations = readings.iter().map(|r| r.deviation).collect();
    (PyArray1::from_vec(py, values), PyArray1::from_vec(py, deviations))
}

#[pymethods]
impl LightField {
    #[new]
    fn new(parts: Vec<FieldPart<'_>>) -> PyResult<Self> {
        let parts = parts.iter().map(FieldPart::core).collect::<PyResult<Vec<_>>>()?;
        Ok(Self {
            field: Arc::new(CoreField { parts }),
            sampler: OnceLock::new(),
            fluxes: OnceLock::new(),
        })
    }

    /// Flux of each part.
    fn flux(&self, py: Python<'_>) -> Vec<f64> {
        let make = || self.field.parts.iter().map(PartField::flux).collect();
        py.detach(|| self.fluxes.get_or_init(make).clone())
    }

    /// Mean luminance of each cell of a part, and mean of its standard deviation.
    #[pyo3(signature = (part, threads=None))]
    fn cell_means<'py>(&self, py: Python<'py>, part: usize, threads: Option<usize>) -> PyResult<Readings<'py>> {
        let field = self.part(part)?;
        let found = py.detach(|| field.cell_means(threads.unwrap_or(0)));
        Ok(readings(py, found))
    }

    /// Luminance and its standard deviation along lines given by points and directions.
    #[pyo3(signature = (points, directions, threads=None))]
    fn luminance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        directions: PyReadonlyArray2<'py, f64>,
        threads: Option<usize>,
    ) -> PyResult<Readings<'py>> {
        let (points, directions) = (vectors(&points)?, vectors(&directions)?);
        if points.len() != directions.len() {
            return Err(PyValueError::new_err("points and directions differ in number"));
        }
        let found = stoppable(py, |stop| {
            along(&self.field, &points, &directions, threads.unwrap_or(0), Some(stop))
        })?;
        Ok(readings(py, found))
    }

    /// Luminance and its standard deviation at coordinates (s₁, s₂, a, b) of a part.
    fn at<'py>(
        &self,
        py: Python<'py>,
        part: usize,
        coordinates: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Readings<'py>> {
        let field = self.part(part)?;
        if coordinates.shape()[1] != 4 {
            return Err(PyValueError::new_err("an array of shape (n, 4) is needed"));
        }
        let rows = coordinates.as_slice()?;
        let found = py.detach(|| {
            rows.chunks_exact(4)
                .map(|c| field.at([c[0], c[1]], [c[2], c[3]]))
                .collect()
        });
        Ok(readings(py, found))
    }

    /// Intensity in each direction, by a midpoint rule of `side`² points on every part.
    #[pyo3(signature = (directions, side, threads=None))]
    fn intensity<'py>(
        &self,
        py: Python<'py>,
        directions: PyReadonlyArray2<'py, f64>,
        side: u32,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let directions = vectors(&directions)?;
        let found = stoppable(py, |stop| {
            intensity(&self.field, &directions, side, threads.unwrap_or(0), Some(stop))
        })?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Mean luminance of each pixel of a view and its standard deviation, shape (rows, columns).
    #[pyo3(signature = (view, samples, threads=None))]
    fn look<'py>(&self, py: Python<'py>, view: View, samples: u32, threads: Option<usize>) -> PyResult<Pixels<'py>> {
        let view = view.core();
        let found = stoppable(py, |stop| {
            look(&self.field, &view, samples, threads.unwrap_or(0), Some(stop))
        })?;
        let shape = [view.rows as usize, view.columns as usize];
        let (values, deviations) = readings(py, found);
        Ok((values.reshape(shape)?, deviations.reshape(shape)?))
    }
}

/// A number of equal rays drawn from a field.
#[pyclass(frozen, module = "etendue._core")]
pub struct FieldRays {
    sampler: Arc<Sampler>,
    rays: u64,
    seed: u64,
}

impl FieldRays {
    /// The core's source of these rays.
    pub fn core(&self) -> CoreRays<'_> {
        CoreRays {
            sampler: &self.sampler,
            rays: self.rays,
            seed: self.seed,
        }
    }
}

#[pymethods]
impl FieldRays {
    #[new]
    fn new(py: Python<'_>, field: &LightField, rays: u64, seed: u64) -> PyResult<Self> {
        Ok(Self {
            sampler: field.sampler(py)?,
            rays,
            seed,
        })
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(usize::try_from(self.rays)?)
    }
}
