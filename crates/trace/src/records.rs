//! What is recorded of light: rays, contributions to cells, and the sums of cells.

/// A ray as a collecting surface keeps it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollectedRay {
    /// \[mm\].
    pub position: [f64; 3],
    /// Unit vector.
    pub direction: [f64; 3],
    /// \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
}

/// Sums of a cell: Σ w, Σ w² with w the contribution of one ray and all its copies, and how many such contributed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Σ w.
    pub sum: f64,
    /// Σ w².
    pub squares: f64,
    /// Rays, copies of one counted once.
    pub rays: u64,
}

/// A contribution to a cell: its number, the ray or, of rays with copies, the unit (see [`crate::dealing::Dealing`]), how much.
pub type Contribution = (u32, u64, f64);
