//! Light through optics: from sources to detectors.
//!
//! `scene`: faces with their optical properties, solids with their media, sources, detectors. `start`: where a ray starts;
//! `inside`: which solids it is in; `meeting`: which of the faces that it meets decides what becomes of it.
//!
//! `forward`: from the sources to the detectors; `dealing`: which source gives out which ray, and which rays are copies of
//! one; `detector`: what takes note of light, `far_field`: of what leaves; `ledger`: the flux account;
//! `harvest`: what batches amount to. `eye`: diffuse scatters connected to an observer; `kept`: those that are kept for later,
//! thinned to a number of them.
//!
//! `reverse`: from the eye to the sources; `wave`: a block of its paths; `exitance`: the light of diffuse surfaces, known
//! beforehand, at which paths may end; `guide`: where they go on from diffuse
//! surfaces; `glints`: where in a pixel they look for small images of sources; `sharing`: light that both directions find. `lists`: what rays of a block are sorted
//! into.

pub mod dealing;
pub mod detector;
pub mod exitance;
pub mod eye;
pub mod far_field;
pub mod forward;
pub mod glints;
pub mod guide;
pub mod harvest;
pub mod inside;
pub mod kept;
pub mod ledger;
mod lists;
pub mod meeting;
pub mod reverse;
pub mod scene;
pub mod sharing;
mod start;
mod wave;
