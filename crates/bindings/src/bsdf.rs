//! A BSDF by itself: f, samples, densities and shares of arrays of directions.

use std::sync::Arc;

use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf as CoreBsdf, Media, Outcome};
use etendue_sampling::philox::Stream;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::finish::finish;
use crate::scene_values::refuse;

/// Optical properties of a surface, as a scene takes them, to be asked outside of one.
#[pyclass(frozen, module = "etendue._core")]
pub struct Bsdf {
    core: Arc<dyn CoreBsdf>,
}

type Directions<'py> = PyReadonlyArray2<'py, f64>;

fn vectors(directions: &Directions<'_>) -> PyResult<Vec<Vec3>> {
    let rows = directions.as_array();
    if rows.ncols() != 3 {
        return Err(refuse("directions have three components"));
    }
    Ok(rows.outer_iter().map(|v| Vec3::new(v[0], v[1], v[2])).collect())
}

fn media([wavelength, front, back]: [f64; 3]) -> Media {
    Media {
        wavelength,
        front,
        back,
    }
}

/// How many rays are drawn for together.
const TOGETHER: usize = 1024;

/// Directions of light that is mirrored or refracted.
fn specular(incident: Vec3, media: &Media, cosine: Option<f64>) -> Vec3 {
    match cosine {
        None => Vec3::new(-incident.x, -incident.y, incident.z),
        Some(cosine) => {
            let [n1, n2] = media.seen_from(incident);
            let ratio = n1 / n2;
            Vec3::new(-ratio * incident.x, -ratio * incident.y, -cosine.copysign(incident.z))
        }
    }
}

impl Bsdf {
    /// What a scene takes.
    pub fn core(&self) -> Arc<dyn CoreBsdf> {
        Arc::clone(&self.core)
    }

    fn drawn(&self, n: usize, seed: u64, media: &Media, incident: impl Fn(usize) -> Vec3) -> Vec<f64> {
        let stream = Stream::new(seed, 0);
        let mut found = Vec::with_capacity(3 * n);
        for first in (0..n).step_by(TOGETHER) {
            let rays = first..n.min(first + TOGETHER);
            let pairs: Vec<_> = rays.clone().map(|k| stream.uniforms(k as u64, 0)).collect();
            let numbers = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).collect::<Vec<f64>>());
            let incident: Vec<Vec3> = rays.map(&incident).collect();
            let of = |component: fn(&Vec3) -> f64| incident.iter().map(component).collect::<Vec<f64>>();
            let mut directions = [of(|d| d.x), of(|d| d.y), of(|d| d.z)];
            let all = vec![*media; incident.len()];
            let mut outcomes = vec![Outcome::Absorbed; incident.len()];
            self.core
                .sample_many(&mut directions, &all, [&numbers[0], &numbers[1]], &mut outcomes);
            found.extend(
                incident
                    .iter()
                    .zip(&outcomes)
                    .enumerate()
                    .flat_map(|(k, (i, outcome))| {
                        let [x, y, z] = directions.each_ref().map(|list| list[k]);
                        let d = match outcome {
                            Outcome::Absorbed => Vec3::new(f64::NAN, f64::NAN, f64::NAN),
                            Outcome::Mirrored => specular(*i, media, None),
                            Outcome::Refracted => specular(*i, media, Some(z)),
                            Outcome::Scattered => Vec3::new(x, y, z),
                        };
                        [d.x, d.y, d.z]
                    }),
            );
        }
        found
    }

    fn of_pairs<'py>(
        &self,
        py: Python<'py>,
        pairs: [&Directions<'py>; 2],
        surroundings: [f64; 3],
        function: fn(&dyn CoreBsdf, Vec3, Vec3, &Media) -> f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let [incident, scattered] = [vectors(pairs[0])?, vectors(pairs[1])?];
        if incident.len() != scattered.len() {
            return Err(refuse("as many incident directions as scattered ones"));
        }
        let media = media(surroundings);
        let found: Vec<f64> = py.detach(|| {
            let both = incident.iter().zip(&scattered);
            both.map(|(i, s)| function(&*self.core, *i, *s, &media)).collect()
        });
        Ok(found.into_pyarray(py))
    }
}

#[pymethods]
impl Bsdf {
    /// From the record of a finish.
    #[new]
    fn new(record: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(Self { core: finish(record)? })
    }

    /// f \[1/sr\] of pairs of directions; `media`: wavelength \[nm\], refractive index in front and behind.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        incident: Directions<'py>,
        scattered: Directions<'py>,
        media: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_pairs(py, [&incident, &scattered], media, |b, i, s, m| b.evaluate(i, s, m))
    }

    /// Density \[1/sr\] of scattered directions.
    fn pdf<'py>(
        &self,
        py: Python<'py>,
        incident: Directions<'py>,
        scattered: Directions<'py>,
        media: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.of_pairs(py, [&incident, &scattered], media, |b, i, s, m| b.pdf(i, s, m))
    }

    /// Shares of light from each direction: mirrored, refracted, scattered back and to the other side; shape (n, 4).
    fn shares<'py>(
        &self,
        py: Python<'py>,
        incident: Directions<'py>,
        media: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (incident, media) = (vectors(&incident)?, self::media(media));
        let found: Vec<f64> = py.detach(|| {
            let shares = |i: &Vec3| self.core.shares(*i, &media).in_order();
            incident.iter().flat_map(shares).collect()
        });
        let rows = Array2::from_shape_vec((incident.len(), 4), found).map_err(|e| refuse(e.to_string()))?;
        Ok(rows.into_pyarray(py))
    }

    /// What becomes of `n` rays from a direction: directions, shape (n, 3), NaN where a ray is absorbed. Ray k has the same
    /// numbers in every call with the same seed.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        incident: [f64; 3],
        n: usize,
        seed: u64,
        media: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (media, [x, y, z]) = (self::media(media), incident);
        let incident = Vec3::new(x, y, z);
        let found = py.detach(|| self.drawn(n, seed, &media, |_| incident));
        let rows = Array2::from_shape_vec((n, 3), found).map_err(|e| refuse(e.to_string()))?;
        Ok(rows.into_pyarray(py))
    }

    /// What becomes of one ray from each direction: the same numbers as `sample` has, ray by ray.
    fn sample_each<'py>(
        &self,
        py: Python<'py>,
        incident: Directions<'py>,
        seed: u64,
        media: [f64; 3],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (incident, media) = (vectors(&incident)?, self::media(media));
        let n = incident.len();
        let found = py.detach(|| self.drawn(n, seed, &media, |k| incident[k]));
        let rows = Array2::from_shape_vec((n, 3), found).map_err(|e| refuse(e.to_string()))?;
        Ok(rows.into_pyarray(py))
    }

    /// What holds at all angles: whether light is mirrored, refracted, scattered back, scattered to the other side; and
    /// whether it goes back as it came.
    fn facts(&self) -> ([bool; 4], bool) {
        let facts = self.core.facts();
        let [a, b] = facts.specular;
        let [c, d] = facts.diffuse;
        ([a, b, c, d], facts.reciprocal)
    }
}
