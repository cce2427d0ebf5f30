//! A scene as Python hands it over: plain dictionaries, one for each thing, with a `kind` where there are several.

use std::sync::{Arc, OnceLock};

use etendue_geometry::face::{Face, HalfSpace};
use etendue_geometry::mesh::Mesh;
use etendue_geometry::shape::{Asphere, Flat, Outline, Quadric, Shape, Torus};
use etendue_math::{Frame, Vec3};
use etendue_optics::finish::Finish;
use etendue_optics::medium::{Index, Medium};
use etendue_optics::source::{Emitter, Lantern, Lines, PointSource, Source, SurfaceSource};
use etendue_optics::table::{Curve, Table};
use etendue_trace::detector::{Detector, Portion};
use etendue_trace::reverse::lanterns;
use etendue_trace::scene::{Part, Scene as CoreScene};
use etendue_trace::sharing::Sharing;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::far_field::FarField;
use crate::field::LightField;
use crate::surface::vectors;
use crate::view::View;

type Dict<'a, 'py> = &'a Bound<'py, PyDict>;

fn refuse(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

/// The value under a key.
fn get<'py, T: for<'a> FromPyObject<'a, 'py>>(dict: Dict<'_, 'py>, key: &str) -> PyResult<T> {
    let value = dict.get_item(key)?;
    let value = value.ok_or_else(|| PyKeyError::new_err(key.to_owned()))?;
    value.extract().map_err(Into::into)
}

fn optional<'py, T: for<'a> FromPyObject<'a, 'py>>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Option<T>> {
    match dict.get_item(key)? {
        Some(value) if !value.is_none() => Ok(Some(value.extract().map_err(Into::into)?)),
        _ => Ok(None),
    }
}

fn inner<'py>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Bound<'py, PyDict>> {
    let value = dict.get_item(key)?.ok_or_else(|| PyKeyError::new_err(key.to_owned()))?;
    Ok(value.cast_into::<PyDict>()?)
}

fn list<'py>(dict: Dict<'_, 'py>, key: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    get::<Vec<Bound<'py, PyDict>>>(dict, key)
}

fn frame(dict: Dict<'_, '_>) -> PyResult<Frame> {
    let v: Vec<f64> = get(dict, "frame")?;
    let [ox, oy, oz, xx, xy, xz, yx, yy, yz, zx, zy, zz] = v[..] else {
        return Err(refuse(format!("a frame has 12 numbers, not {}", v.len())));
    };
    Ok(Frame {
        origin: Vec3::new(ox, oy, oz),
        x: Vec3::new(xx, xy, xz),
        y: Vec3::new(yx, yy, yz),
        z: Vec3::new(zx, zy, zz),
    })
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
            vertices: get::<Vec<[f64; 2]>>(dict, "vertices")?,
        },
        other => return Err(refuse(format!("no outline is called {other}"))),
    })
}

/// The shape of a record.
fn shape(dict: Dict<'_, '_>) -> PyResult<Shape> {
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

fn face(dict: Dict<'_, '_>) -> PyResult<Face> {
    let trims: Option<Vec<[f64; 4]>> = optional(dict, "trims")?;
    Ok(Face {
        shape: shape(&inner(dict, "shape")?)?,
        frame: frame(dict)?,
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

fn part(dict: &Bound<'_, PyDict>) -> PyResult<Part> {
    Ok(Part {
        face: face(dict)?,
        solid: optional(dict, "solid")?,
        finish: get(dict, "finish")?,
    })
}

fn curve(dict: Dict<'_, '_>, y: &str) -> PyResult<Curve> {
    Curve::new(get(dict, "wavelength")?, get(dict, y)?).ok_or_else(|| refuse("not a table over increasing wavelengths"))
}

fn medium(dict: &Bound<'_, PyDict>) -> PyResult<Medium> {
    let index = inner(dict, "index")?;
    Ok(Medium {
        index: match get::<String>(&index, "kind")?.as_str() {
            "constant" => Index::Table(Curve::constant(get(&index, "n")?)),
            "sellmeier" => Index::Sellmeier {
                b: get(&index, "b")?,
                c: get(&index, "c")?,
            },
            "table" => Index::Table(curve(&index, "n")?),
            other => return Err(refuse(format!("no kind of index is called {other}"))),
        },
        absorption: curve(&inner(dict, "absorption")?, "per_mm")?,
    })
}

fn table(dict: Dict<'_, '_>, key: &str) -> PyResult<Table> {
    let table = inner(dict, key)?;
    let rows: Vec<Vec<f64>> = get(&table, "values")?;
    let wavelength: Vec<f64> = get(&table, "wavelength")?;
    if rows.iter().any(|row| row.len() != wavelength.len()) {
        return Err(refuse(format!(
            "{key}: rows of values and wavelengths differ in number"
        )));
    }
    Table::new(get(&table, "angle")?, wavelength, rows.concat())
        .ok_or_else(|| refuse(format!("{key}: not a table over increasing angles and wavelengths")))
}

fn finish(dict: &Bound<'_, PyDict>) -> PyResult<Finish> {
    match get::<String>(dict, "kind")?.as_str() {
        "fresnel" => Ok(Finish::Interface),
        "scatter" => {
            let keys = [
                "specular_reflectance",
                "specular_transmittance",
                "diffuse_reflectance",
                "diffuse_transmittance",
            ];
            let [a, b, c, d] = keys.map(|key| table(dict, key));
            Finish::scatter([a?, b?, c?, d?]).ok_or_else(|| refuse("shares below 0, or above 1 together"))
        }
        other => Err(refuse(format!("no finish is called {other}"))),
    }
}

/// A source; ray sets are gathered in `sets`, those of several sources once.
fn source<'py>(dict: &Bound<'py, PyDict>, sets: &mut Vec<Py<PyAny>>) -> PyResult<Source> {
    let py = dict.py();
    let emitter = match get::<String>(dict, "kind")?.as_str() {
        "rays" => {
            let rays = get::<Bound<'py, PyAny>>(dict, "rays")?;
            let known = sets.iter().position(|set| set.bind(py).is(&rays));
            let set = known.unwrap_or_else(|| {
                sets.push(rays.unbind());
                sets.len() - 1
            });
            let spectra: Option<Vec<(Vec<f64>, Vec<f64>)>> = optional(dict, "spectra")?;
            Emitter::Rays {
                set,
                scale: get(dict, "scale")?,
                coloured: optional(dict, "coloured")?.unwrap_or(true),
                spectra: spectra
                    .unwrap_or_default()
                    .into_iter()
                    .map(|(wavelengths, shares)| lines(wavelengths, &shares))
                    .collect::<PyResult<_>>()?,
            }
        }
        "field" => {
            let field = get::<Bound<'py, LightField>>(dict, "field")?;
            Emitter::Field(field.get().sampler(py)?)
        }
        "surface" => {
            let flip = optional(dict, "flip")?.unwrap_or(false);
            if optional::<Vec<[f64; 4]>>(dict, "trims")?.is_some_and(|trims| !trims.is_empty()) {
                return Err(refuse(
                    "an emitting surface cannot be cut by half spaces; cut it by z and r, or make it a mesh",
                ));
            }
            let surface = SurfaceSource::new(shape(&inner(dict, "shape")?)?, flip, get(dict, "exponent")?);
            Emitter::Surface(surface.ok_or_else(|| refuse("an emitting surface needs a finite area and exponent"))?)
        }
        "point" => {
            let rows: Vec<Vec<f64>> = get(dict, "values")?;
            let point = PointSource::new(get(dict, "c")?, get(dict, "gamma")?, &rows.concat());
            Emitter::Point(point.ok_or_else(|| refuse("not an intensity distribution with flux"))?)
        }
        "beam" => Emitter::beam(&shape(&inner(dict, "shape")?)?)
            .ok_or_else(|| refuse("a beam needs a flat shape of finite area"))?,
        other => return Err(refuse(format!("no source is called {other}"))),
    };
    let flux: f64 = get(dict, "flux")?;
    if !(flux > 0.0 && flux.is_finite()) {
        return Err(refuse("a source needs flux"));
    }
    Ok(Source {
        emitter,
        frame: frame(dict)?,
        flux,
        spectrum: lines(get(dict, "wavelengths")?, &get::<Vec<f64>>(dict, "shares")?)?,
    })
}

/// A spectrum from its wavelengths and their shares of the flux.
pub fn lines(wavelengths: Vec<f64>, shares: &[f64]) -> PyResult<Lines> {
    let total: f64 = shares.iter().sum();
    let sound = wavelengths.len() == shares.len()
        && total > 0.0
        && total.is_finite()
        && shares.iter().chain(&wavelengths).all(|v| *v >= 0.0 && v.is_finite());
    if !sound {
        return Err(refuse("a spectrum needs a share of the flux for each wavelength"));
    }
    let mut sum = 0.0;
    let lines = wavelengths.into_iter().zip(shares).map(|(wavelength, share)| {
        sum += share / total;
        (wavelength, sum)
    });
    Ok(lines.collect())
}

fn detector(dict: &Bound<'_, PyDict>, faces: usize) -> PyResult<Detector> {
    Ok(match get::<String>(dict, "kind")?.as_str() {
        "rays" => Detector::Rays(face(dict)?),
        "illuminance" => Detector::Illuminance {
            frame: frame(dict)?,
            width: get(dict, "width")?,
            height: get(dict, "height")?,
            columns: get(dict, "columns")?,
            rows: get(dict, "rows")?,
        },
        // Until it is known which nodes suit it: `Scene::with_far_fields`.
        "intensity" => Detector::Escapes,
        "image" => Detector::Image {
            view: get::<View>(dict, "view")?.core(),
            portion: match (
                optional(dict, "complement")?.unwrap_or(false),
                optional(dict, "shared")?,
            ) {
                (false, _) => Portion::Whole,
                (true, None) => Portion::Unseen,
                (true, Some(rays)) => Portion::Shared(Sharing { rays }),
            },
        },
        "arrivals" => Detector::Arrivals,
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
            Detector::Events {
                most: get(dict, "most")?,
                faces: listed.map(flags).transpose()?,
            }
        }
        other => return Err(refuse(format!("no detector is called {other}"))),
    })
}

/// A scene, ready to be traced.
#[pyclass(frozen, module = "etendue._core")]
pub struct Scene {
    core: Arc<CoreScene>,
    sets: Vec<Py<PyAny>>,
    /// Made when the scene is first looked at: tracing forwards needs none.
    lanterns: OnceLock<Vec<Option<Lantern>>>,
}

impl Scene {
    /// The core's scene.
    pub fn core(&self) -> &CoreScene {
        &self.core
    }

    /// What its sources need to be seen.
    pub fn lanterns(&self) -> &[Option<Lantern>] {
        self.lanterns.get_or_init(|| lanterns(&self.core))
    }

    /// The ray sets that its sources refer to.
    pub fn sets(&self) -> &[Py<PyAny>] {
        &self.sets
    }
}

#[pymethods]
impl Scene {
    /// Whether light can reach a diffuse surface in a way that lines of sight find by chance, or not at all.
    fn may_focus(&self) -> bool {
        self.core.may_focus()
    }

    #[new]
    fn new(record: &Bound<'_, PyDict>) -> PyResult<Self> {
        let each = |key: &str| list(record, key);
        let parts: Vec<Part> = each("faces")?.iter().map(part).collect::<PyResult<_>>()?;
        let finishes = each("finishes")?.iter().map(finish).collect::<PyResult<_>>()?;
        let media = each("media")?.iter().map(medium).collect::<PyResult<_>>()?;
        let solids = each("solids")?
            .iter()
            .map(|s| get(s, "medium"))
            .collect::<PyResult<_>>()?;
        let mut sets = Vec::new();
        let sources = each("sources")?
            .iter()
            .map(|s| source(s, &mut sets))
            .collect::<PyResult<_>>()?;
        let detectors = each("detectors")?
            .iter()
            .map(|d| detector(d, parts.len()))
            .collect::<PyResult<_>>()?;
        let core = CoreScene::new(parts, finishes, media, solids, sources, detectors).map_err(refuse)?;
        Ok(Self {
            core: Arc::new(core),
            sets,
            lanterns: OnceLock::new(),
        })
    }

    /// The same scene, whose detectors of escaping rays share them by these nodes, in their order.
    fn with_far_fields(&self, py: Python<'_>, nodes: Vec<PyRef<'_, FarField>>) -> PyResult<Self> {
        let mut core = CoreScene::clone(&self.core);
        let mut nodes = nodes.iter();
        for detector in &mut core.detectors {
            if matches!(detector, Detector::Escapes) {
                let next = nodes.next().ok_or_else(|| refuse("more far fields than nodes"))?;
                *detector = Detector::Intensity(next.nodes());
            }
        }
        Ok(Self {
            core: Arc::new(core),
            sets: self.sets.iter().map(|set| set.clone_ref(py)).collect(),
            lanterns: OnceLock::new(),
        })
    }
}
