//! Light through optics: from sources to detectors.
//!
//! `scene`: faces with their optical properties, solids with their media, sources. `ray_start`: where a ray starts;
//! `solid_stack`: which solids it is in; `interaction`: which of the faces that it meets decides what becomes of it;
//! `scatter`: what the
//! surface does to it, forwards and backwards; `medium_cache`: refractive index and absorption on its way; `transmittance`:
//! what gets from one point to another.
//!
//! `forward`: from the sources to the detectors; `work_unit`: some batches of a run, and what they amount to; `dealing`: which source
//! gives out which ray, and which rays are copies of one; `detector`: what records light, `records`: what it records; `ray_state`: what a ray carries;
//! `ledger`: the flux account; `tallies`: what batches amount to. `events`: scatter events that are kept for later, thinned to a
//! number of them; `camera_connection`: scatter events connected to an observer.
//!
//! `reverse`: from the observer to the sources; `lit_scene`: a scene with what its sources need to be seen; `exitance_cells` and
//! `exitance`: the light of diffuse surfaces, known beforehand, at which paths may end; `guide`: where they go on from diffuse
//! surfaces, `bright_spots`: small places that they go on to; `glints`: where in a pixel they look for small images of sources; `mis`: light that both directions find.
//! `buckets`: what rays of a block are sorted into.

pub mod bright_spots;
mod buckets;
pub mod camera_connection;
pub mod dealing;
pub mod detector;
pub mod events;
pub mod exitance;
pub mod exitance_cells;
pub mod forward;
pub mod glints;
pub mod guide;
pub mod interaction;
pub mod ledger;
pub mod lit_scene;
pub mod medium_cache;
pub mod mis;
mod ray_start;
pub mod ray_state;
pub mod records;
pub mod reverse;
pub mod scatter;
pub mod scene;
pub mod solid_stack;
pub mod tallies;
pub mod transmittance;
mod wavelengths;
pub mod work_unit;
