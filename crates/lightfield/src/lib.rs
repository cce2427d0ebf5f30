//! Estimators of luminance from rays.
//!
//! `view`: an observer and his pixel grid. `cone`: rays that point into a cone about the line to the observer, pixel by
//! pixel (thesis chapter 2). `polya`: counts on a dyadic grid, smoothed by averaging over all its partitions.

pub mod cone;
pub mod counts;
pub mod field;
pub mod polya;
pub mod surface;
pub mod view;

pub use view::View;
