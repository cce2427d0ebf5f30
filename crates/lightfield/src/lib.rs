//! Estimators of luminance from rays.
//!
//! `view`: an observer and his pixel grid. `cone`: rays that point into a cone about the line to the observer, pixel by
//! pixel (thesis chapter 2). `ray_index`: rays in an order in which those that a cone can see stand together.
//!
//! `carrier`: surfaces that light fields live on, and coordinates on them. `field`: light fields; `counts`: rays counted in
//! their cells; `polya`: counts on a dyadic grid, smoothed by averaging over all its partitions.

pub mod carrier;
pub mod cone;
pub mod counts;
pub mod field;
pub mod polya;
pub mod ray_index;
pub mod view;

pub use view::View;
