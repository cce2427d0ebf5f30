//! Triangle meshes: the nearest hit of a ray, area, volume, sampling, and what is not closed.
//!
//! `triangle_mesh`: the triangles themselves. `block`: eight of them against one ray. `query`: rays against the whole mesh.
//! `topology`: which vertices coincide, which triangles share an edge. `smooth`: normals of curved surfaces. `facets`:
//! how far triangles are from these.

mod block;
pub mod facets;
mod query;
pub mod smooth;
#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small numbers")]
mod tests;
pub mod topology;
mod triangle_mesh;

pub use block::{MeshHit, NO_TRIANGLE};
pub use query::{Found, MOST_ORIGIN_TRIANGLES, Rays};
pub use triangle_mesh::{Mesh, MeshError};
