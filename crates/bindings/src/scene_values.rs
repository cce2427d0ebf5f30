//! What records of scenes are made of: values under keys, places, shapes, faces.

use std::sync::Arc;

use etendue_geometry::face::{Face, HalfSpace};
use etendue_geometry::mesh::Mesh;
use etendue_geometry::shape::{Asphere, Flat, Outline, Quadric, Shape, Torus};
use etendue_math::{Frame, Vec3};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::carrier::vectors;

/// A record as Python hands it over.
pub type Dict<'a, 'py> = &'a Bound<'py, PyDict>;

/// A complaint about a record.
pub fn refuse(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

/// The value under a key.
pub fn get<'py, T: for<'a> FromPyObject<'a, 'py>>(dict: Dict<'_, 'py>, key: &str) -> PyResult<T> {
    let value = dict.get_item(key)?;
    let value = value.ok_or_else(|| PyKeyError::new_err(key.to_owned()))?;
    value.extract().map_err(Into::into)
}

/// The value under a key, if there is one.
pub fn optional<'py, T: for<'a> FromPyObject<'a, 'py>>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Option<T>> {
    match dict.get_item(key)? {
        Some(value) if !value.is_none() => Ok(Some(value.extract().map_err(Into::into)?)),
        _ => Ok(None),
    }
}

/// The record under a key.
pub fn inner<'py>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Bound<'py, PyDict>> {
    let value = dict.get_item(key)?.ok_or_else(|| PyKeyError::new_err(key.to_owned()))?;
    Ok(value.cast_into::<PyDict>()?)
}

/// The records under a key.
pub fn list<'py>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    get::<Vec<Bound<'py, PyDict>>>(dict, key)
}

/// The place of a record.
pub fn frame(dict: Dict<'_, '_>) -> PyResult<Frame> {
    let numbers: Vec<f64> = get(dict, "frame")?;
    let numbers = numbers.try_into();
    let numbers = numbers.map_err(|n: Vec<f64>| refuse(format!("a frame has 12 numbers, not {}", n.len())))?;
    Ok(frame_of(numbers))
}

/// A place from its origin and the x, y and z axis.
pub fn frame_of([ox, oy, oz, xx, xy, xz, yx, yy, yz, zx, zy, zz]: [f64; 12]) -> Frame {
    Frame {
        origin: Vec3::new(ox, oy, oz),
        x: Vec3::new(xx, xy, xz),
        y: Vec3::new(yx, yy, yz),
        z: Vec3::new(zx, zy, zz),
    }
}

fn outline(dict: Dict<'_, '_>) -> PyResult<Outline> {
    Ok(match get::<String>(dict, "kind")?.as_str() {
        "whole" => Outline::Whole,
        "rectangle" => Outline::Rectangle {
            width: get(dict, "width")?,
            height: get(dict, "height")?,
        },
        "annulus" => Outline::Annulus {
            inner: get(dict, "inner")?,
            outer: get(dict, "outer")?,
        },
        "polygon" => Outline::Polygon {
            vertices: get::<Vec<[f64; 2]>>(dict, "vertices")?.into(),
        },
        other => return Err(refuse(format!("no outline is called {other}"))),
    })
}

/// The shape of a record.
pub fn shape(dict: Dict<'_, '_>) -> PyResult<Shape> {
    Ok(match get::<String>(dict, "kind")?.as_str() {
        "flat" => {
            let outline = outline(&inner(dict, "outline")?)?;
            if matches!(&outline, Outline::Polygon { vertices } if vertices.len() < 3) {
                return Err(refuse("a polygon needs three corners"));
            }
            Shape::Flat(Flat { outline })
        }
        "quadric" => Shape::Quadric(Quadric {
            r2: get(dict, "r2")?,
            z2: get(dict, "z2")?,
            z1: get(dict, "z1")?,
            z0: get(dict, "z0")?,
            z: get(dict, "z")?,
            r: get(dict, "r")?,
        }),
        "asphere" => {
            let coefficients = get(dict, "coefficients")?;
            Asphere::new(
                get(dict, "curvature")?,
                get(dict, "conic")?,
                coefficients,
                get(dict, "r")?,
            )
            .map(Shape::Asphere)
            .ok_or_else(|| refuse("an asphere that ends inside its radii, or is not finite"))?
        }
        "torus" => Shape::Torus(Torus {
            major: get(dict, "major")?,
            minor: get(dict, "minor")?,
        }),
        "mesh" => {
            let vertices: PyReadonlyArray2<'_, f64> = get(dict, "vertices")?;
            let triangles: PyReadonlyArray2<'_, u32> = get(dict, "triangles")?;
            let normals: Option<PyReadonlyArray2<'_, f64>> = optional(dict, "normals")?;
            let points = |array: &PyReadonlyArray2<'_, f64>| -> PyResult<Vec<Vec3>> {
                Ok(vectors(array)?.into_iter().map(Vec3::from).collect())
            };
            if triangles.shape()[1] != 3 {
                return Err(refuse("triangles of shape (m, 3) are needed"));
            }
            let corners = triangles
                .as_slice()?
                .chunks_exact(3)
                .map(|t| [t[0], t[1], t[2]])
                .collect();
            let normals = normals.as_ref().map(points).transpose()?;
            let mesh = Mesh::new(points(&vertices)?, corners, normals);
            Shape::Mesh(Arc::new(mesh.map_err(|error| refuse(error.to_string()))?))
        }
        other => return Err(refuse(format!("no shape is called {other}"))),
    })
}

/// What a face is, wherever it stands.
#[derive(Clone)]
pub struct Form {
    shape: Shape,
    trims: Vec<HalfSpace>,
    flipped: bool,
}

impl Form {
    /// The face of this form that stands there.
    pub fn at(self, frame: Frame) -> Face {
        Face {
            shape: self.shape,
            frame,
            trims: self.trims,
            flipped: self.flipped,
        }
    }
}

/// The form of a record.
pub fn form(dict: Dict<'_, '_>) -> PyResult<Form> {
    let trims: Option<Vec<[f64; 4]>> = optional(dict, "trims")?;
    Ok(Form {
        shape: shape(&inner(dict, "shape")?)?,
        trims: trims
            .unwrap_or_default()
            .into_iter()
            .map(|[x, y, z, offset]| HalfSpace {
                normal: Vec3::new(x, y, z),
                offset,
            })
            .collect(),
        flipped: optional(dict, "flip")?.unwrap_or(false),
    })
}

/// The face of a record.
pub fn face(dict: Dict<'_, '_>) -> PyResult<Face> {
    Ok(form(dict)?.at(frame(dict)?))
}
