//! A scene as Python hands it over: plain dictionaries, one for each thing, with a `kind` where there are several.

use std::sync::{Arc, OnceLock};

use etendue_optics::bsdf::Bsdf;
use etendue_optics::light_sampler::LightSampler;
use etendue_optics::medium::{Index, Medium};
use etendue_optics::source::{Emitter, IntensityTable, Pattern, Source, SpectralLines, SurfaceSource};
use etendue_optics::table::Curve;
use etendue_trace::detector::{Detector, Intensity};
use etendue_trace::lit_scene::{LitScene, light_samplers};
use etendue_trace::scene::Scene as CoreScene;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::bsdf::Bsdf as BuiltBsdf;
use crate::detector::detector;
use crate::faces::faces;
use crate::far_field::FarField;
use crate::field::LightField;
use crate::finish::finish;
use crate::patches::patches;
use crate::scene_values::{Dict, frame, get, inner, list, optional, refuse, shape};
use crate::view::View;

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

/// A finish: a BSDF that is built already, or its record.
fn finish_of(value: &Bound<'_, PyAny>) -> PyResult<Arc<dyn Bsdf>> {
    match value.extract::<PyRef<'_, BuiltBsdf>>() {
        Ok(built) => Ok(built.core()),
        Err(_) => finish(value.cast::<PyDict>()?),
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
            let pattern = match optional(dict, "exponent")? {
                Some(exponent) => Pattern::CosinePower(exponent),
                None => Pattern::Table(Box::new(intensity_table(dict)?)),
            };
            let surface = SurfaceSource::new(shape(&inner(dict, "shape")?)?, flip, pattern);
            Emitter::Surface(surface.ok_or_else(|| {
                refuse("an emitting surface needs a finite area and exponent; one with a table is flat")
            })?)
        }
        "point" => Emitter::Point(intensity_table(dict)?),
        "patches" => Emitter::Patches(Arc::new(patches(dict)?)),
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

/// The intensity distribution of a source.
fn intensity_table(dict: Dict<'_, '_>) -> PyResult<IntensityTable> {
    let rows: Vec<Vec<f64>> = get(dict, "values")?;
    let table = IntensityTable::new(get(dict, "c")?, get(dict, "gamma")?, &rows.concat());
    table.ok_or_else(|| refuse("not an intensity distribution with flux"))
}

/// A spectrum from its wavelengths and their shares of the flux.
pub fn lines(wavelengths: Vec<f64>, shares: &[f64]) -> PyResult<SpectralLines> {
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

/// A scene, ready to be traced.
#[pyclass(frozen, module = "etendue._core")]
pub struct Scene {
    core: Arc<CoreScene>,
    detectors: Vec<Detector>,
    sets: Vec<Py<PyAny>>,
    /// Made when the scene is first looked at: tracing forwards needs none.
    light_samplers: OnceLock<Vec<Option<LightSampler>>>,
}

impl Scene {
    /// The core's scene.
    pub fn core(&self) -> &CoreScene {
        &self.core
    }

    /// What records light in it.
    pub fn detectors(&self) -> &[Detector] {
        &self.detectors
    }

    /// What its sources need to be seen.
    pub fn light_samplers(&self) -> &[Option<LightSampler>] {
        self.light_samplers.get_or_init(|| light_samplers(&self.core))
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

    /// Rows and columns of a view outside of which its lines of sight meet nothing: the first of each, and that after the last.
    fn window(&self, view: View) -> [(u32, u32); 2] {
        let view = view.core();
        let [columns, rows] = LitScene::new(&self.core, self.light_samplers()).window(&view);
        [rows, columns].map(|range| (range.start, range.end))
    }

    #[new]
    fn new(record: &Bound<'_, PyDict>) -> PyResult<Self> {
        let each = |key: &str| list(record, key);
        let parts = faces(&get(record, "faces")?)?;
        let finishes: Vec<Bound<'_, PyAny>> = get(record, "finishes")?;
        let finishes = finishes.iter().map(finish_of).collect::<PyResult<_>>()?;
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
        let detectors: Vec<Detector> = each("detectors")?
            .iter()
            .map(|d| detector(d, parts.len()))
            .collect::<PyResult<_>>()?;
        let standing = detectors.iter().map(|detector| detector.face()).collect();
        let core = CoreScene::new(parts, finishes, media, solids, sources, standing).map_err(refuse)?;
        Ok(Self {
            core: Arc::new(core),
            detectors,
            sets,
            light_samplers: OnceLock::new(),
        })
    }

    /// The same scene, whose detectors of escaping rays share them by these nodes, in their order.
    fn with_far_fields(&self, py: Python<'_>, nodes: Vec<PyRef<'_, FarField>>) -> PyResult<Self> {
        let mut detectors = self.detectors.clone();
        let mut nodes = nodes.iter();
        for detector in &mut detectors {
            if matches!(detector, Detector::Escapes(_)) {
                let next = nodes.next().ok_or_else(|| refuse("more far fields than nodes"))?;
                *detector = Detector::Intensity(Intensity(next.nodes()));
            }
        }
        Ok(Self {
            core: Arc::clone(&self.core),
            detectors,
            sets: self.sets.iter().map(|set| set.clone_ref(py)).collect(),
            light_samplers: OnceLock::new(),
        })
    }
}
