//! Carrier surfaces and the coordinates of rays on them.

use etendue_lightfield::carrier::{Beam, CarrierPart, Disk, Focus, Hemisphere, Rectangle, Shape, Tube};
use etendue_math::{Frame, Vec3};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// One chart, as Python hands it over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Part {
    shape: String,
    centre: [f64; 3],
    x: [f64; 3],
    y: [f64; 3],
    z: [f64; 3],
    size: [f64; 2],
    focus: [f64; 4],
    beam: [f64; 3],
}

impl Part {
    /// The core's chart.
    pub fn core(&self) -> PyResult<CarrierPart> {
        let [a, b] = self.size;
        let shape = match self.shape.as_str() {
            "rectangle" => Shape::Rectangle(Rectangle {
                width: a,
                height: b,
                focus: Focus(self.focus),
            }),
            "disk" => Shape::Disk(Disk { radius: a }),
            "hemisphere" => Shape::Hemisphere(Hemisphere { radius: a }),
            "tube" => Shape::Tube(Tube { radius: a, height: b }),
            other => return Err(PyValueError::new_err(format!("no shape is called {other}"))),
        };
        let frame = Frame {
            origin: self.centre.into(),
            x: self.x.into(),
            y: self.y.into(),
            z: self.z.into(),
        };
        let [p, q, radius] = self.beam;
        let beam = Beam::new([p, q], radius)
            .ok_or_else(|| PyValueError::new_err("a beam has to be a disk within that of all direction cosines"))?;
        Ok(CarrierPart { frame, shape, beam })
    }
}

/// Rows of an (n, 3) array as vectors.
pub fn vectors(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    if array.shape()[1] != 3 {
        return Err(PyValueError::new_err("an array of shape (n, 3) is needed"));
    }
    Ok(array
        .as_slice()?
        .chunks_exact(3)
        .map(|row| [row[0], row[1], row[2]])
        .collect())
}

type Owners<'py> = (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>);
type Rays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// For each ray the first part its line leaves (−1: none), and its coordinates (s₁, s₂, a, b) there.
#[pyfunction]
pub fn cross_parts<'py>(
    py: Python<'py>,
    parts: Vec<Part>,
    position: PyReadonlyArray2<'py, f64>,
    direction: PyReadonlyArray2<'py, f64>,
) -> PyResult<Owners<'py>> {
    let parts = parts.iter().map(Part::core).collect::<PyResult<Vec<_>>>()?;
    let (position, direction) = (vectors(&position)?, vectors(&direction)?);
    if position.len() != direction.len() {
        return Err(PyValueError::new_err("positions and directions differ in number"));
    }
    let (mut found, mut values) = (vec![-1; position.len()], vec![0.0; 4 * position.len()]);
    py.detach(|| {
        for (i, (x, k)) in position.iter().zip(&direction).enumerate() {
            let crossings = parts
                .iter()
                .map(|p| p.cross(Vec3::from(*x), Vec3::from(*k).normalized()));
            if let Some((part, crossing)) = (0..).zip(crossings).find(|(_, c)| c.met) {
                found[i] = part;
                values[4 * i..4 * i + 2].copy_from_slice(&crossing.place);
                values[4 * i + 2..4 * i + 4].copy_from_slice(&crossing.direction);
            }
        }
    });
    let n = found.len();
    Ok((
        PyArray1::from_vec(py, found),
        PyArray1::from_vec(py, values).reshape([n, 4])?,
    ))
}

/// Points and directions of rays at coordinates (s₁, s₂, a, b) of a part.
#[pyfunction]
pub fn rays_of_part<'py>(py: Python<'py>, part: Part, coordinates: PyReadonlyArray2<'py, f64>) -> PyResult<Rays<'py>> {
    let part = part.core()?;
    if coordinates.shape()[1] != 4 {
        return Err(PyValueError::new_err("an array of shape (n, 4) is needed"));
    }
    let rays: Vec<(Vec3, Vec3)> = coordinates
        .as_slice()?
        .chunks_exact(4)
        .map(|c| part.ray([c[0], c[1]], [c[2], c[3]]))
        .collect();
    let flat = |pick: fn(&(Vec3, Vec3)) -> Vec3| {
        let values: Vec<f64> = rays.iter().map(pick).flat_map(|v| [v.x, v.y, v.z]).collect();
        PyArray1::from_vec(py, values).reshape([rays.len(), 3])
    };
    Ok((flat(|r| r.0)?, flat(|r| r.1)?))
}
