//! Detectors as Python hands them over.

use etendue_geometry::Face;
use etendue_lightfield::View as CoreView;
use etendue_math::Frame;
use etendue_trace::detector::{Detector, Record};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::scene_values::{face, frame, get, optional, refuse};
use crate::view::View;

/// What Python says of a detector of a scene of so many faces.
struct Description<'a, 'py> {
    dict: &'a Bound<'py, PyDict>,
    faces: usize,
}

impl Record for Description<'_, '_> {
    type Error = PyErr;

    fn refuse(message: &str) -> PyErr {
        refuse(message)
    }

    fn number(&self, key: &str) -> PyResult<f64> {
        get(self.dict, key)
    }

    fn optional_number(&self, key: &str) -> PyResult<Option<f64>> {
        optional(self.dict, key)
    }

    fn whole(&self, key: &str) -> PyResult<usize> {
        get(self.dict, key)
    }

    fn flag(&self, key: &str) -> PyResult<bool> {
        Ok(optional(self.dict, key)?.unwrap_or(false))
    }

    fn listed_faces(&self, key: &str) -> PyResult<Option<Vec<bool>>> {
        let Some(listed) = optional::<Vec<usize>>(self.dict, key)? else {
            return Ok(None);
        };
        let mut flags = vec![false; self.faces];
        for face in listed {
            *flags
                .get_mut(face)
                .ok_or_else(|| refuse(format!("there is no face {face}")))? = true;
        }
        Ok(Some(flags))
    }

    fn view(&self, key: &str) -> PyResult<CoreView> {
        get::<View>(self.dict, key).map(|view| view.core())
    }

    fn frame(&self) -> PyResult<Frame> {
        frame(self.dict)
    }

    fn face(&self) -> PyResult<Face> {
        face(self.dict)
    }
}

/// A detector of a scene of so many faces, as Python hands it over.
pub fn detector(dict: &Bound<'_, PyDict>, faces: usize) -> PyResult<Detector> {
    Detector::read(&get::<String>(dict, "kind")?, &Description { dict, faces })
}
