//! The compiled half of étendue as the Python module `etendue._core`: arrays in, arrays out.
//!
//! Nothing is computed here. Each file converts one noun, releases the interpreter while the core works, and comes back
//! between rounds of batches to report progress and to honour Ctrl-C.

mod bright_spots;
mod bsdf;
mod carrier;
mod cone;
mod counts;
mod dealing;
mod detector;
mod faces;
mod far_field;
mod field;
mod finish;
mod glints;
mod guide;
mod mesh;
mod patches;
mod polya;
mod ray_index;
mod ray_keys;
mod run;
mod scan;
mod scene;
mod scene_values;
mod source;
mod stored;
mod subset;
mod survey;
mod trace;
mod view;

use pyo3::prelude::*;

/// The compiled core of étendue.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<bsdf::Bsdf>()?;
    module.add_class::<source::RayTable>()?;
    module.add_class::<stored::StoredBytes>()?;
    module.add_class::<source::RingSource>()?;
    module.add_class::<field::LightField>()?;
    module.add_class::<field::FieldRays>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<far_field::FarField>()?;
    module.add_class::<glints::Glints>()?;
    module.add_class::<guide::Guide>()?;
    module.add_class::<bright_spots::BrightSpots>()?;
    module.add_class::<survey::Survey>()?;
    module.add_class::<dealing::Dealing>()?;
    module.add_function(wrap_pyfunction!(source::read_pieces, module)?)?;
    module.add_function(wrap_pyfunction!(source::read_rays, module)?)?;
    module.add_function(wrap_pyfunction!(source::read_colours, module)?)?;
    module.add_function(wrap_pyfunction!(ray_keys::ray_keys, module)?)?;
    module.add_function(wrap_pyfunction!(ray_keys::kept_ray_keys, module)?)?;
    module.add_function(wrap_pyfunction!(source::draw_wavelengths, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::weld, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::weld_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::mesh_facets, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::chord_error, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::open_edges, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::mesh_shells, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::smooth_normals, module)?)?;
    module.add_function(wrap_pyfunction!(scan::scan, module)?)?;
    module.add_function(wrap_pyfunction!(scan::scan_colours, module)?)?;
    module.add_function(wrap_pyfunction!(cone::cone_sums, module)?)?;
    module.add_function(wrap_pyfunction!(ray_index::index_leaf, module)?)?;
    module.add_function(wrap_pyfunction!(ray_index::index_count, module)?)?;
    module.add_function(wrap_pyfunction!(ray_index::index_place, module)?)?;
    module.add_function(wrap_pyfunction!(ray_index::index_arrange, module)?)?;
    module.add_function(wrap_pyfunction!(ray_index::index_sums, module)?)?;
    module.add_function(wrap_pyfunction!(counts::count_rays, module)?)?;
    module.add_function(wrap_pyfunction!(carrier::cross_parts, module)?)?;
    module.add_function(wrap_pyfunction!(carrier::rays_of_part, module)?)?;
    module.add_function(wrap_pyfunction!(field::node_values, module)?)?;
    module.add_function(wrap_pyfunction!(polya::polya_posterior, module)?)?;
    module.add_function(wrap_pyfunction!(polya::polya_average, module)?)?;
    module.add_function(wrap_pyfunction!(polya::polya_evidence, module)?)?;
    module.add_class::<polya::TreeMemory>()?;
    module.add_function(wrap_pyfunction!(subset::select_subset, module)?)?;
    module.add_function(wrap_pyfunction!(subset::deal_parts, module)?)?;
    module.add_function(wrap_pyfunction!(trace::losses, module)?)?;
    module.add_function(wrap_pyfunction!(trace::batch_size, module)?)?;
    module.add_function(wrap_pyfunction!(trace::work_unit, module)?)?;
    module.add_function(wrap_pyfunction!(trace::look_at_scene, module)?)?;
    module.add_function(wrap_pyfunction!(trace::look_at_events, module)?)?;
    module.add_function(wrap_pyfunction!(trace::deepest, module)?)?;
    module.add_function(wrap_pyfunction!(trace::most_solids, module)?)?;
    module.add_function(wrap_pyfunction!(trace::trace_trails, module)?)?;
    module.add_function(wrap_pyfunction!(trace::scene_crossings, module)?)?;
    Ok(())
}
