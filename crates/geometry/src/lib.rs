//! Rays and the surfaces they meet.
//!
//! Rays: `batch` is a structure of arrays that the inner loops run over, `source` anything that yields rays by index, `table`
//! records in memory or in a file, `stored` a stretch of a file, `tally` the flux account of a pass, `scan` the statistics of a
//! ray set in one pass, `colours` its flux by wavelength.
//!
//! Surfaces: `shape` holds the kinds of surface, `mesh` triangles, `face` a shape in its place, `lines` a block of rays that
//! look for surfaces, `assembly` many faces
//! together, `sweep` many rays on simple ones of them, `bounds` and `bvh` what spares the tests that cannot succeed.

pub mod assembly;
pub mod batch;
pub mod bounds;
pub mod bvh;
pub mod colours;
pub mod face;
pub mod lines;
pub mod mesh;
mod pass;
pub mod scan;
pub mod shape;
pub mod source;
pub mod stored;
pub mod sweep;
pub mod table;
pub mod tally;

pub use assembly::Assembly;
pub use batch::RayBatch;
pub use face::Face;
pub use source::RaySource;
pub use tally::Tally;
