//! Where lines of sight look for light that smooth surfaces send to diffuse ones.

use etendue_math::Vec3;
use etendue_trace::guide::{self, Arrival};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::scene::Scene;

/// Directions in which lines of sight go on from diffuse surfaces by preference.
#[pyclass(frozen, module = "etendue._core")]
pub struct Guide {
    core: guide::Guide,
}

impl Guide {
    /// What it is to the tracer.
    pub const fn core(&self) -> &guide::Guide {
        &self.core
    }
}

#[pymethods]
impl Guide {
    /// From arrivals at the faces of a scene, as `work_unit` tells them: (n, 8).
    #[new]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a number that is no face has no tree"
    )]
    fn new(py: Python<'_>, scene: &Scene, arrivals: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        if arrivals.shape()[1] != 8 {
            return Err(PyValueError::new_err("arrivals of shape (n, 8) are needed"));
        }
        let rows = arrivals.as_slice()?.chunks_exact(8);
        let arrivals = rows.map(|row| Arrival {
            point: Vec3::new(row[0], row[1], row[2]),
            towards: Vec3::new(row[3], row[4], row[5]),
            face: row[6] as u32,
            family: row[7] as u32,
        });
        let arrivals = arrivals.collect();
        let faces = scene.core().roles.len();
        let core = py.detach(|| guide::Guide::new(faces, arrivals));
        Ok(Self { core })
    }
}
