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

/// Sums of a cell over rays, each with all its copies: of what they contribute, w, of its square, and of w v with v their flux.
/// Errors of rays of unequal flux rest on Σ w v.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// Σ w.
    pub sum: f64,
    /// Σ w².
    pub squares: f64,
    /// Σ w v.
    pub products: f64,
    /// Rays, copies of one counted once.
    pub rays: u64,
}

impl Cell {
    /// Adds what one ray and all its copies contribute.
    pub fn add(&mut self, contribution: &Contribution) {
        let w = contribution.amount;
        self.sum += w;
        self.squares += w * w;
        self.products += w * contribution.flux;
        self.rays += 1;
    }

    /// Adds the sums over other rays.
    pub fn join(&mut self, other: &Self) {
        self.sum += other.sum;
        self.squares += other.squares;
        self.products += other.products;
        self.rays += other.rays;
    }
}

/// What a ray contributes to a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// The number of the cell.
    pub cell: u32,
    /// That of the ray in the run or, of rays with copies, of the unit (see [`crate::dealing::Dealing`]).
    pub unit: u64,
    /// How much.
    pub amount: f64,
    /// Flux of the ray, or what the unit brings in the whole run.
    pub flux: f64,
}

impl Contribution {
    /// What contributions are brought together by.
    #[must_use]
    pub const fn place(&self) -> (u32, u64) {
        (self.cell, self.unit)
    }
}

/// Makes one of contributions that follow each other and are of the same unit to the same cell.
pub fn merge(contributions: &mut Vec<Contribution>) {
    contributions.dedup_by(|next, first| {
        let same = next.place() == first.place();
        if same {
            first.amount += next.amount;
        }
        same
    });
}
