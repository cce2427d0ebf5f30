//! Optional Pólya tree: the average over all ways to split a dyadic grid, in closed form.
//!
//! A box of the grid is either left whole, with probability 1 − ρ, or split in half along one of its axes, each with the
//! same share of ρ; the share of its mass that falls into the lower half then has a Beta prior with concentration c about
//! the share of the base measure. Every axis-parallel dyadic partition has its prior probability, every one is averaged
//! with its posterior probability, and no bin width is ever chosen. `[WongMa2010]`, `[Hutter2005]`; theory eqs. 29 to 32.
//!
//! `grid`: the lattice of boxes. `base`: what the tree falls back on. `chunk`: boxes that are worked on together. `kernel`: the
//! arithmetic. `data`: what it is fitted to. `ascend`, `descend`: the sweeps from the cells to the root and back, `sweep`: what they
//! share. `posterior`: what comes out. `average`: of trees on a grid that is moved. `array`: their memory.

mod array;
mod ascend;
mod average;
mod base;
mod chunk;
mod data;
mod descend;
mod grid;
mod kernel;
mod level;
mod posterior;
mod sweep;

pub use array::TreeMemory;
pub use average::{Average, average};
pub use data::{Data, Masses};
pub use grid::Grid;
pub use posterior::{Posterior, log_evidence, posterior};
