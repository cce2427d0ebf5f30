//! The faces of a scene as Python hands them over: columns, and the forms that faces share.

use etendue_math::Vec3;
use etendue_trace::scene::SceneFace;
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::carrier::vectors;
use crate::scene_values::{form, frame_of, refuse};

/// All faces; `rows` is an `etendue.scene.face_rows.FaceRows`.
pub fn faces(rows: &Bound<'_, PyAny>) -> PyResult<Vec<SceneFace>> {
    let forms: Vec<Bound<'_, PyDict>> = rows.getattr("forms")?.extract()?;
    // A form is read once, however many faces have it.
    let forms: Vec<_> = forms.iter().map(form).collect::<PyResult<_>>()?;
    let numbers = |name: &str| -> PyResult<PyReadonlyArray1<'_, i64>> { rows.getattr(name)?.extract() };
    let places = |name: &str| -> PyResult<PyReadonlyArray2<'_, f64>> { rows.getattr(name)?.extract() };
    let (of, solids, finishes) = (numbers("form")?, numbers("solids")?, numbers("finishes")?);
    let (frames, axes) = (places("frames")?, places("axes")?);
    if frames.shape()[1] != 12 {
        return Err(refuse(format!("a frame has 12 numbers, not {}", frames.shape()[1])));
    }
    let (of, solids, finishes, axes) = (
        of.as_slice()?,
        solids.as_slice()?,
        finishes.as_slice()?,
        vectors(&axes)?,
    );
    let (frames, _) = frames.as_slice()?.as_chunks::<12>();
    if [frames.len(), solids.len(), finishes.len(), axes.len()] != [of.len(); 4] {
        return Err(refuse("the columns of faces are not of one length"));
    }
    (0..of.len())
        .map(|i| {
            let form = usize::try_from(of[i]).ok().and_then(|number| forms.get(number));
            let form = form.ok_or_else(|| refuse(format!("face {i} has a form that does not exist")))?;
            let finish = usize::try_from(finishes[i]);
            let finish = finish.map_err(|_| refuse(format!("face {i} has a finish that does not exist")))?;
            Ok(SceneFace {
                face: form.clone().at(frame_of(frames[i])),
                solid: usize::try_from(solids[i]).ok(),
                finish,
                axis: Some(Vec3::from(axes[i])).filter(|axis| !axis.x.is_nan()),
            })
        })
        .collect()
}
