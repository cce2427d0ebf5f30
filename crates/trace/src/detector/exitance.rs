//! The flux that diffuse surfaces send out with one distribution, wherever it came from, by the cells of patches.

use std::sync::Arc;

use super::kind::{Kind, Recorded, Scatter, Wants};
use crate::exitance_cells::{ExitanceCells, FacePoint};
use crate::ray_state::RayState;
use crate::scene::Scene;

/// Adds up flux that leaves diffuse surfaces.
#[derive(Clone, Debug)]
pub struct Exitance(pub Arc<ExitanceCells>);

impl Kind for Exitance {
    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn wants(&self) -> Wants {
        Wants::EXITANCE
    }

    fn scatter(&self, scatter: &mut Scatter<'_>, out: &mut Recorded) {
        let (scene, at, state) = (scatter.scene, scatter.met.interaction(), scatter.light.state);
        let Some(parts) = scatter.met.parts() else { return };
        for (through, share) in [false, true].into_iter().zip(scatter.met.arriving(parts)) {
            let place = FacePoint {
                face: at.face,
                part: at.part,
                front: at.front != through,
                point: at.point,
            };
            self.sheet(scene, place, share, state, out);
        }
    }

    #[inline]
    fn sheet(&self, scene: &Scene, place: FacePoint, share: f64, state: &RayState, out: &mut Recorded) {
        let cell = || {
            self.0
                .cell(scene.face_set.faces(), place, state.wavelength, state.unseen)
        };
        if let Some(cell) = (share > 0.0).then(cell).flatten() {
            out.contribute(cell, state, state.flux * share);
        }
    }
}
