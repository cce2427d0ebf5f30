//! The light of diffuse surfaces, known beforehand.

use etendue_sampling::ordered::inside;
use etendue_trace::exitance::ExitanceSurvey;
use etendue_trace::lit_scene::LitScene;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::run::stoppable;
use crate::scene::Scene;

/// The diffuse surfaces of a scene as patches, and which of them can be used to end lines of sight.
#[pyclass(frozen, module = "etendue._core")]
pub struct Survey {
    core: ExitanceSurvey,
}

impl Survey {
    /// What it is to the tracer.
    pub fn core(&self) -> &ExitanceSurvey {
        &self.core
    }
}

#[pymethods]
impl Survey {
    /// Surveys a scene with rays traced forwards.
    #[new]
    #[pyo3(signature = (scene, seed, most_events, threads=None))]
    fn new(py: Python<'_>, scene: &Scene, seed: u64, most_events: u32, threads: Option<usize>) -> PyResult<Self> {
        if !scene.sets().is_empty() {
            return Err(PyValueError::new_err("ray sets have to be fitted before a survey"));
        }
        let core = stoppable(py, |stop| {
            let lit = LitScene::new(scene.core(), scene.light_samplers()).until(stop);
            inside(threads.unwrap_or(0), || ExitanceSurvey::new(&lit, seed, most_events))
        })?;
        Ok(Self { core })
    }

    /// Number of patches, and the share of them that can be used.
    fn patches(&self) -> (usize, f64) {
        (self.core.patches(), self.core.usable())
    }
}
