//! Light that smooth surfaces send to the first diffuse one, of sources that can be seen: where it arrives, and from where.

use super::kind::{Kind, Recorded, Scatter, Wants};
use super::record::{Described, Record};
use crate::guide::Arrival;

/// Keeps such arrivals.
#[derive(Clone, Copy, Debug)]
pub struct Arrivals;

impl Described for Arrivals {
    fn read<R: Record>(_record: &R) -> Result<Self, R::Error> {
        Ok(Self)
    }
}

impl Kind for Arrivals {
    fn wants(&self) -> Wants {
        Wants {
            brightness: true,
            ..Wants::SCATTERS
        }
    }

    fn scatter(&self, scatter: &mut Scatter<'_>, out: &mut Recorded) {
        let state = scatter.light.state;
        if state.unseen && !state.scattered && state.brightness.is_finite() {
            let at = scatter.met.interaction();
            out.arrivals.push(Arrival {
                face: at.face,
                point: at.point,
                towards: -scatter.light.direction,
                family: state.family,
            });
        }
    }
}
