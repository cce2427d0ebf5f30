//! Small places of diffuse surfaces that lines of sight go on to.

use etendue_trace::bright_spots;
use etendue_trace::events::{WORDS, from_row};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::scene::Scene;

/// Small places of diffuse surfaces that much light comes from, if there are such.
#[pyclass(frozen, module = "etendue._core")]
pub struct BrightSpots(Option<bright_spots::BrightSpots>);

impl BrightSpots {
    /// What they are to the tracer.
    pub const fn core(&self) -> Option<&bright_spots::BrightSpots> {
        self.0.as_ref()
    }
}

#[pymethods]
impl BrightSpots {
    /// From scatter events in a scene, as `work_unit` tells them: (n, 15).
    #[new]
    fn new(py: Python<'_>, scene: &Scene, events: PyReadonlyArray2<'_, u64>) -> PyResult<Self> {
        if events.shape()[1] != WORDS {
            return Err(PyValueError::new_err(format!(
                "events of shape (n, {WORDS}) are needed"
            )));
        }
        let (core, rows) = (scene.core(), events.as_slice()?);
        Ok(Self(py.detach(|| {
            let known = rows.chunks_exact(WORDS).filter_map(|row| from_row(core, row));
            bright_spots::BrightSpots::of(known.map(|event| (event.point, event.side, event.flux)).collect())
        })))
    }

    /// Whether there are such places.
    const fn exist(&self) -> bool {
        self.0.is_some()
    }
}
