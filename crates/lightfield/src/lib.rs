//! Estimators of luminance from rays.
//!
//! `view`: an observer and his pixel grid. `cone`: rays that point into a cone about the line to the observer, pixel by
//! pixel (thesis chapter 2).

pub mod cone;
pub mod view;

pub use view::View;
