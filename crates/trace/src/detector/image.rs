//! The light image: every scatter event, connected to an observer.

use etendue_lightfield::View;

use super::kind::{Kind, Recorded, Scatter, Wants};
use super::record::{Described, Record};
use crate::camera_connection::seen;
use crate::mis::MisBalance;

/// The part of scattered light that a light image shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Portion {
    /// All of it.
    Whole,
    /// What the reverse tracer cannot find, or leaves to the light image: of sources that cannot be seen backwards, and of all
    /// sources through smooth surfaces that mirror or bend light onto the first diffuse one.
    Unseen,
    /// Of that light, the share that lines of sight do not have.
    Shared(MisBalance),
}

/// The light image of an observer.
#[derive(Clone, Debug)]
pub struct Image {
    /// What the observer sees.
    pub view: View,
    /// Which light counts.
    pub portion: Portion,
}

impl Described for Image {
    fn read<R: Record>(record: &R) -> Result<Self, R::Error> {
        let portion = match (record.flag("complement")?, record.optional_number("shared")?) {
            (false, _) => Portion::Whole,
            (true, None) => Portion::Unseen,
            (true, Some(rays)) => Portion::Shared(MisBalance { rays }),
        };
        let view = record.view("view")?;
        Ok(Self { view, portion })
    }
}

impl Kind for Image {
    fn cells(&self) -> usize {
        self.view.pixels()
    }

    fn wants(&self) -> Wants {
        Wants {
            brightness: matches!(self.portion, Portion::Shared(_)),
            ..Wants::SCATTERS
        }
    }

    fn scatter(&self, scatter: &mut Scatter<'_>, out: &mut Recorded) {
        let state = scatter.light.state;
        if !state.unseen && self.portion != Portion::Whole {
            return;
        }
        if let Some((pixel, light, density)) = seen(&scatter.event, scatter.scene, &self.view, scatter.media) {
            let share = match self.portion {
                Portion::Shared(balance) => balance.forwards(density, state.brightness),
                Portion::Whole | Portion::Unseen => 1.0,
            };
            out.contribute(pixel, state, light * share);
        }
    }
}
