//! Rays and the surfaces they meet.
//!
//! Rays: `ray_batch` is a structure of arrays that the inner loops run over, `source` anything that yields rays by index,
//! `table` records in memory or in a file, `stored` a stretch of a file, `tally` the flux account of a pass, `scan` the
//! statistics of a ray set in one pass, `colours` its flux by wavelength, `ray_keys` what copies of a ray have in common.
//!
//! Surfaces: `shape` holds the kinds of surface, `mesh` triangles, `face` a shape in its place, `bounds` and `bvh` what spares
//! the tests that cannot succeed. `ray_block`: rays that look for surfaces; `origin_faces`: the faces that they start on;
//! `face_set`: many faces together; `intersect_block`: a block of rays against simple ones of them; `hits`: what the rays meet
//! first; `surface_points`: where on a face, and the normals there.

pub mod bounds;
pub mod bvh;
pub mod colours;
pub mod face;
pub mod face_set;
pub mod hits;
mod intersect_block;
pub mod mesh;
pub mod origin_faces;
mod pass;
pub mod pass_account;
pub mod points_on_faces;
pub mod ray_batch;
pub mod ray_block;
pub mod ray_keys;
pub mod scan;
pub mod shape;
pub mod source;
pub mod stored;
pub mod surface_points;
pub mod table;

pub use face::Face;
pub use face_set::FaceSet;
pub use pass_account::PassAccount;
pub use ray_batch::RayBatch;
pub use source::RaySource;
