//! The flux that diffuse surfaces send out, by the cells of patches.

use std::sync::Arc;

use super::kind::{Kind, Recorded, Scatter, Wants};
use crate::exitance_cells::{ExitanceCells, FacePoint};

/// Adds up flux that leaves diffuse surfaces.
#[derive(Clone, Debug)]
pub struct Exitance(pub Arc<ExitanceCells>);

impl Kind for Exitance {
    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn wants(&self) -> Wants {
        Wants::SCATTERS
    }

    fn scatter(&self, scatter: &mut Scatter<'_>, out: &mut Recorded) {
        let (scene, at, state) = (scatter.scene, scatter.met.interaction(), scatter.light.state);
        for (through, share) in [false, true].into_iter().zip(scatter.met.shares().diffuse) {
            let place = FacePoint {
                face: at.face,
                part: at.part,
                front: at.front != through,
                point: at.point,
            };
            let cell = || {
                self.0
                    .cell(scene.face_set.faces(), place, state.wavelength, state.unseen)
            };
            if let Some(cell) = (share > 0.0).then(cell).flatten() {
                out.contribute(cell, state, state.flux * share);
            }
        }
    }
}
