//! Patches of a carrier surface as Python hands them over.

use etendue_math::Vec3;
use etendue_optics::source::PatchSource;
use etendue_optics::source::patches::{Cells, Part, Patch, Steps};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::scene_values::{Dict, frame, get, inner, list, refuse};

fn cells(dict: Dict<'_, '_>) -> PyResult<Cells> {
    Ok(match get::<String>(dict, "kind")?.as_str() {
        "squares" => Cells::Squares {
            corner: get(dict, "corner")?,
            side: get(dict, "side")?,
            first: get(dict, "first")?,
            count: get(dict, "count")?,
        },
        "spherical" => Cells::Spherical {
            radius: get(dict, "radius")?,
            parallels: get(dict, "parallels")?,
        },
        "cylindrical" => Cells::Cylindrical {
            radius: get(dict, "radius")?,
            height: get(dict, "height")?,
            columns: get(dict, "columns")?,
            rows: get(dict, "rows")?,
        },
        other => return Err(refuse(format!("no pixels are called {other}"))),
    })
}

/// The patches of a source.
pub fn patches(dict: Dict<'_, '_>) -> PyResult<PatchSource> {
    let mut parts = Vec::new();
    let mut first = 0;
    for part in list(dict, "parts")? {
        let lit: Vec<usize> = get(&part, "lit")?;
        let next = first + lit.len();
        parts.push(Part {
            frame: frame(&part)?,
            cells: cells(&inner(&part, "cells")?)?,
            lit,
            first,
        });
        first = next;
    }
    let axes: Vec<[f64; 9]> = get(dict, "axes")?;
    let areas: Vec<f64> = get(dict, "projected_area")?;
    let starts: Vec<usize> = get(dict, "start")?;
    let steps: Vec<[u16; 2]> = get(dict, "steps")?;
    if [areas.len(), starts.len(), steps.len()] != [axes.len(); 3] {
        return Err(refuse("patches: lists of different lengths"));
    }
    let found = axes.into_iter().zip(areas).zip(starts).zip(steps);
    let found = found.map(|(((axes, projected_area), start), [theta, phi])| Patch {
        axes: [0, 3, 6].map(|i| Vec3::new(axes[i], axes[i + 1], axes[i + 2])),
        projected_area,
        steps: Steps { theta, phi },
        start,
    });
    let values: PyReadonlyArray1<'_, f64> = get(dict, "values")?;
    let weights: PyReadonlyArray1<'_, f64> = get(dict, "weights")?;
    let source = PatchSource::new(parts, found.collect(), values.as_slice()?.to_vec(), weights.as_slice()?);
    source.ok_or_else(|| refuse("patches: tables without light, or numbers that do not fit"))
}
