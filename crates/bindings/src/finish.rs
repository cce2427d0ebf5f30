//! A BSDF as Python hands it over: a plain dictionary with a `kind`.

use std::sync::Arc;

use etendue_optics::bsdf::{Bsdf, Mixture, Parameters, Row, Side, Slice, Tabulated, Way, described};
use etendue_optics::table::Table;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::scene_values::{Dict, get, inner, optional, refuse};

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

/// The record of a finish, as the core asks for its parameters.
struct Described<'a, 'py>(&'a Bound<'py, PyDict>);

impl Parameters for Described<'_, '_> {
    fn number(&self, key: &str) -> Result<f64, String> {
        get(self.0, key).map_err(|error| error.to_string())
    }

    fn table(&self, key: &str) -> Result<Table, String> {
        table(self.0, key).map_err(|error| error.to_string())
    }
}

/// The BSDF of a record.
pub fn finish(dict: &Bound<'_, PyDict>) -> PyResult<Arc<dyn Bsdf>> {
    let kind = get::<String>(dict, "kind")?;
    match kind.as_str() {
        "sum" => {
            let members: Vec<(f64, Bound<'_, PyDict>)> = get(dict, "members")?;
            let members: PyResult<Vec<_>> = members.iter().map(|(weight, of)| Ok((*weight, finish(of)?))).collect();
            let sum = Mixture::new(members?).ok_or_else(|| refuse("parts below 0, or more than 1 together"))?;
            Ok(Arc::new(sum))
        }
        "table" => {
            let sides = [side(dict, "front")?, side(dict, "back")?];
            let bases: [Vec<f64>; 2] = get(dict, "bases")?;
            let table = Tabulated::new(sides.each_ref(), bases.each_ref().map(Vec::as_slice)).map_err(refuse)?;
            Ok(Arc::new(table))
        }
        other => match described(other, &Described(dict)) {
            Some(bsdf) => bsdf.map_err(refuse),
            None => Err(refuse(format!("no finish is called {other}"))),
        },
    }
}

/// The tables of scatter of one side.
fn side(dict: &Bound<'_, PyDict>, key: &str) -> PyResult<Side> {
    let sheets: Vec<Bound<'_, PyDict>> = get(dict, key)?;
    let sheet = |of: &Bound<'_, PyDict>| {
        let [a, b] = ["reflected", "transmitted"].map(|key| {
            let rows: Option<Vec<Bound<'_, PyDict>>> = optional(of, key)?;
            let way = |rows: Vec<Bound<'_, PyDict>>| {
                let rows: PyResult<Vec<_>> = rows.iter().map(row).collect();
                Ok::<_, PyErr>(Way { rows: rows? })
            };
            rows.map(way).transpose()
        });
        Ok((get(of, "wavelength")?, [a?, b?]))
    };
    let sheets: PyResult<Vec<_>> = sheets.iter().map(sheet).collect();
    Ok(Side { sheets: sheets? })
}

fn row(dict: &Bound<'_, PyDict>) -> PyResult<Row> {
    let slices: Vec<Bound<'_, PyDict>> = get(dict, "slices")?;
    let slice = |of: &Bound<'_, PyDict>| {
        let f: PyReadonlyArray2<'_, f64> = get(of, "f")?;
        Ok(Slice {
            sine: get(of, "sine")?,
            radial: get(of, "radial")?,
            azimuths: f.as_array().nrows(),
            f: f.as_array().iter().copied().collect(),
            share: get(of, "share")?,
            base: get(of, "base")?,
        })
    };
    let slices: PyResult<Vec<_>> = slices.iter().map(slice).collect();
    Ok(Row {
        azimuth: get(dict, "azimuth")?,
        slices: slices?,
    })
}
