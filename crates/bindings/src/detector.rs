//! Detectors as Python hands them over: one arm for each kind.

use etendue_trace::detector::{Arrivals, Detector, Escapes, Events, Illuminance, Image, Portion, Rays};
use etendue_trace::mis::MisBalance;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::scene_values::{face, frame, get, optional, refuse};
use crate::view::View;

/// A detector of a scene of so many faces, as Python hands it over.
pub fn detector(dict: &Bound<'_, PyDict>, faces: usize) -> PyResult<Detector> {
    Ok(match get::<String>(dict, "kind")?.as_str() {
        "rays" => Detector::Rays(Rays(face(dict)?)),
        "illuminance" => Detector::Illuminance(Illuminance {
            frame: frame(dict)?,
            width: get(dict, "width")?,
            height: get(dict, "height")?,
            columns: get(dict, "columns")?,
            rows: get(dict, "rows")?,
        }),
        // Until it is known which nodes suit it: `Scene::with_far_fields`.
        "intensity" => Detector::Escapes(Escapes),
        "image" => Detector::Image(Image {
            view: get::<View>(dict, "view")?.core(),
            portion: match (
                optional(dict, "complement")?.unwrap_or(false),
                optional(dict, "shared")?,
            ) {
                (false, _) => Portion::Whole,
                (true, None) => Portion::Unseen,
                (true, Some(rays)) => Portion::Shared(MisBalance { rays }),
            },
        }),
        "arrivals" => Detector::Arrivals(Arrivals),
        "scatter" => {
            let listed: Option<Vec<usize>> = optional(dict, "faces")?;
            let flags = |listed: Vec<usize>| -> PyResult<Vec<bool>> {
                let mut flags = vec![false; faces];
                for face in listed {
                    *flags
                        .get_mut(face)
                        .ok_or_else(|| refuse(format!("there is no face {face}")))? = true;
                }
                Ok(flags)
            };
            Detector::Events(Events {
                most: get(dict, "most")?,
                faces: listed.map(flags).transpose()?,
            })
        }
        other => return Err(refuse(format!("no detector is called {other}"))),
    })
}
