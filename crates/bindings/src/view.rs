//! An observer's view, as Python hands it over.

use etendue_lightfield::View as CoreView;
use pyo3::prelude::*;

/// An observer and the pixel grid through which he looks.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct View {
    eye: [f64; 3],
    target: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    normal: [f64; 3],
    width: f64,
    height: f64,
    columns: u32,
    rows: u32,
}

impl View {
    /// The core's view.
    pub fn core(&self) -> CoreView {
        CoreView {
            observer: self.eye.into(),
            target: self.target.into(),
            right: self.right.into(),
            up: self.up.into(),
            normal: self.normal.into(),
            width: self.width,
            height: self.height,
            columns: self.columns,
            rows: self.rows,
        }
    }
}
