//! Is a mesh closed?

use std::collections::HashMap;

use super::triangle_mesh::Mesh;

impl Mesh {
    /// The edges at which the surface is not closed: all that do not belong to exactly two triangles, which pass along
    /// them in opposite directions. Vertices at the same place are one vertex, named by its lowest index; an edge is
    /// (lower, higher), in rising order. A solid has none.
    #[must_use]
    pub fn open_edges(&self) -> Vec<[u32; 2]> {
        let mut first_at: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.vertices.len());
        let vertex: Vec<u32> = (0_u32..)
            .zip(&self.vertices)
            // Adding 0 turns −0 into 0.
            .map(|(i, p)| {
                *first_at
                    .entry([p.x, p.y, p.z].map(|v| (v + 0.0).to_bits()))
                    .or_insert(i)
            })
            .collect();
        let mut edges: Vec<([u32; 2], bool)> = self
            .real()
            .map(|i| self.triangles[i as usize].map(|v| vertex[v as usize]))
            .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[from, to]| {
                if from < to {
                    ([from, to], true)
                } else {
                    ([to, from], false)
                }
            })
            .collect();
        edges.sort_unstable();
        edges
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|uses| !matches!(uses, [(_, false), (_, true)]))
            .map(|uses| uses[0].0)
            .collect()
    }
}
