//! Where in their pixels sources are seen that are small there.

use etendue_sampling::ordered::inside;
use etendue_trace::glints;
use etendue_trace::lit_scene::LitScene;
use pyo3::prelude::*;

use crate::run::stoppable;
use crate::scene::Scene;
use crate::view::View;

/// Small images of the sources of a scene, as an observer sees them.
#[pyclass(frozen, module = "etendue._core")]
pub struct Glints {
    core: glints::Glints,
}

impl Glints {
    /// What they are to the tracer.
    pub const fn core(&self) -> &glints::Glints {
        &self.core
    }
}

#[pymethods]
impl Glints {
    /// Looks for them.
    #[new]
    #[pyo3(signature = (scene, view, most_events, threads=None))]
    fn new(py: Python<'_>, scene: &Scene, view: View, most_events: u32, threads: Option<usize>) -> PyResult<Self> {
        let view = view.core();
        let core = stoppable(py, |stop| {
            let lit = LitScene::new(scene.core(), scene.light_samplers()).until(stop);
            inside(threads.unwrap_or(0), || glints::Glints::find(&lit, &view, most_events))
        })?;
        Ok(Self { core })
    }

    /// Number of pixels that have some.
    fn pixels(&self) -> usize {
        self.core.pixels()
    }
}
