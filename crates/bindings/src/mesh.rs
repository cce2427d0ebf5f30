//! Triangle meshes before they are faces: arrays of vertices and of their numbers.

use etendue_geometry::mesh::{facets, smooth, topology};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Points<'py> = PyReadonlyArray2<'py, f64>;
type Numbers<'py> = Bound<'py, PyArray1<u32>>;
type Values<'py> = Bound<'py, PyArray1<f64>>;
type Corners<'py> = PyReadonlyArray2<'py, u32>;

/// A vertex at each place, in rising order of x, y and z, and for each vertex the number of its place.
#[pyfunction]
pub fn weld<'py>(py: Python<'py>, vertices: Points<'py>) -> PyResult<(Numbers<'py>, Numbers<'py>)> {
    let points = triples(&vertices)?;
    let welded = py.detach(|| topology::weld(points));
    Ok((
        PyArray1::from_vec(py, welded.kept),
        PyArray1::from_vec(py, welded.number),
    ))
}

/// The vertices that triangles with an area use, one at each place in rising order of x, y and z, and the triangles over these.
#[pyfunction]
pub fn weld_mesh<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    triangles: Corners<'py>,
) -> PyResult<(Numbers<'py>, Bound<'py, PyArray2<u32>>)> {
    let (points, corners) = mesh(&vertices, &triangles)?;
    let cleaned = py.detach(|| topology::cleaned(points, corners));
    Ok((PyArray1::from_vec(py, cleaned.kept), rows(py, cleaned.triangles)?))
}

/// Area of each triangle, and the largest angle \[turns\] by which a neighbour turns from it, of those between two limits.
#[pyfunction]
pub fn mesh_facets<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    triangles: Corners<'py>,
    limits: [f64; 2],
) -> PyResult<(Values<'py>, Values<'py>)> {
    let (points, corners) = mesh(&vertices, &triangles)?;
    let found = py.detach(|| facets::facets(points, corners, limits));
    Ok((
        PyArray1::from_iter(py, found.iter().map(|facet| facet.area)),
        PyArray1::from_iter(py, found.iter().map(|facet| facet.turn)),
    ))
}

/// Largest distance between triangles and the surface whose unit normals they have at their corners.
#[pyfunction]
pub fn chord_error<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    normals: Points<'py>,
    triangles: Corners<'py>,
) -> PyResult<f64> {
    let (points, corners) = mesh(&vertices, &triangles)?;
    let normals = triples(&normals)?;
    if normals.len() != points.len() {
        return Err(PyValueError::new_err("a normal for each vertex is needed"));
    }
    Ok(py.detach(|| facets::chord_error(points, normals, corners)))
}

/// Edges that are not shared by two triangles with opposite senses, shape (k, 2), in rising order.
#[pyfunction]
pub fn open_edges<'py>(py: Python<'py>, triangles: Corners<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
    let corners = triples(&triangles)?;
    let open = py.detach(|| topology::open_edges(corners));
    rows(py, open)
}

/// The number of the shell of each triangle.
#[pyfunction]
pub fn mesh_shells<'py>(py: Python<'py>, triangles: Corners<'py>) -> PyResult<Numbers<'py>> {
    let corners = triples(&triangles)?;
    Ok(PyArray1::from_vec(py, py.detach(|| topology::shells(corners))))
}

/// Vertices, triangles and unit normals: means over the triangles around each vertex whose normals have at least this cosine.
#[pyfunction]
pub fn smooth_normals<'py>(
    py: Python<'py>,
    vertices: Points<'py>,
    triangles: Corners<'py>,
    least: f64,
) -> PyResult<Smooth<'py>> {
    let (points, corners) = mesh(&vertices, &triangles)?;
    let found = py.detach(|| smooth::smooth_normals(points, corners, least));
    Ok((
        PyArray1::from_vec(py, found.vertex),
        rows(py, found.triangles)?,
        rows(py, found.normal)?,
    ))
}

type Smooth<'py> = (Numbers<'py>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray2<f64>>);

type MeshRows<'a> = (&'a [[f64; 3]], &'a [[u32; 3]]);

/// Vertices and triangles over them.
fn mesh<'a>(vertices: &'a Points<'_>, triangles: &'a Corners<'_>) -> PyResult<MeshRows<'a>> {
    let (points, corners) = (triples(vertices)?, triples(triangles)?);
    if corners.iter().flatten().any(|v| *v as usize >= points.len()) {
        return Err(PyValueError::new_err("a triangle names a vertex that there is not"));
    }
    Ok((points, corners))
}

/// The rows of an array of shape (n, 3).
fn triples<'a, T: numpy::Element>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [[T; 3]]> {
    if array.shape()[1] != 3 {
        return Err(PyValueError::new_err("shape (n, 3) is needed"));
    }
    let (rows, _) = array.as_slice()?.as_chunks::<3>();
    Ok(rows)
}

/// An array of rows.
fn rows<T: numpy::Element + Copy, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    numpy::PyArrayMethods::reshape(&PyArray1::from_vec(py, rows.into_flattened()), [count, N])
}
