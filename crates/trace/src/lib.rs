//! Light through optics: from sources to detectors.
//!
//! `scene`: faces with their optical properties, solids with their media, sources, detectors. `inside`: which solids a ray is
//! in. `meeting`: a ray meets faces, and which of them decides. `detector`: what takes note of light. `eye`: diffuse
//! scatters connected to an observer. `ledger`: the flux account. `forward`: from the sources to the detectors. `reverse`: from the eye to the sources.

mod bounce;
pub mod detector;
pub mod eye;
pub mod forward;
pub mod inside;
pub mod ledger;
pub mod meeting;
pub mod reverse;
pub mod scene;
