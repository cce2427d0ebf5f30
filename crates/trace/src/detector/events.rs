//! Scatter events, to be seen later from anywhere.

use super::kind::{Kind, Recorded, Scatter, Wants};
use super::record::{Described, Record};

/// Keeps scatter events.
#[derive(Clone, Debug)]
pub struct Events {
    /// How many are kept at most: of more, those of every second ray are dropped, as often as it takes.
    pub most: usize,
    /// For each face whether its scatters count; None: those of all.
    pub faces: Option<Vec<bool>>,
}

impl Described for Events {
    fn read<R: Record>(record: &R) -> Result<Self, R::Error> {
        Ok(Self {
            most: record.whole("most")?,
            faces: record.listed_faces("faces")?,
        })
    }
}

impl Kind for Events {
    fn most_events(&self) -> usize {
        self.most
    }

    fn wants(&self) -> Wants {
        Wants::SCATTERS
    }

    fn scatter(&self, scatter: &mut Scatter<'_>, out: &mut Recorded) {
        let face = scatter.met.interaction().face as usize;
        if self.faces.as_ref().is_none_or(|faces| faces.get(face) == Some(&true)) {
            out.events.push(&scatter.event, scatter.light.state.depth);
        }
    }
}
