//! Rays: where they are kept, how they are read in batches, what they amount to.
//!
//! `batch`: a structure of arrays that the inner loops run over. `source`: anything that yields rays by index. `table`:
//! records in memory or in a mapped file. `tally`: the flux account of a pass. `scan`: the statistics of a ray set in one pass.

pub mod batch;
pub mod bounds;
pub mod bvh;
pub mod mesh;
pub mod scan;
pub mod source;
pub mod table;
pub mod tally;

pub use batch::RayBatch;
pub use source::RaySource;
pub use tally::Tally;
