//! How far triangles are from the curved surfaces that they stand for.

use etendue_math::Vec3;
use etendue_math::trig::turns_of;

use super::topology::sides;

/// A triangle by its neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Facet {
    /// Its area \[the vertices' unit, squared\].
    pub area: f64,
    /// Largest angle by which a neighbour's normal differs from its own, of those between two limits \[turns\]; 0 if none is.
    pub turn: f64,
}

/// Areas and turns of triangles; those angles count that are above `least` and below `most` \[turns\].
///
/// # Panics
/// If a triangle names a vertex that there is not.
#[must_use]
pub fn facets(vertices: &[[f64; 3]], triangles: &[[u32; 3]], [least, most]: [f64; 2]) -> Vec<Facet> {
    let doubled = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3::from(vertices[v as usize]));
        (b - a).cross(c - a)
    };
    let normals: Vec<Vec3> = triangles.iter().map(doubled).collect();
    let of = |normal: &Vec3| Facet {
        area: 0.5 * normal.length(),
        turn: 0.0,
    };
    let mut found: Vec<Facet> = normals.iter().map(of).collect();
    let sides = sides(triangles);
    for (edges, owners) in sides.edge.windows(2).zip(sides.triangle.windows(2)) {
        if edges[0] != edges[1] {
            continue;
        }
        let [a, b] = [owners[0] as usize, owners[1] as usize];
        let product = found[a].area * found[b].area;
        if product <= 0.0 {
            continue;
        }
        // Of unit vectors, so that none is too small for its square.
        let [m, n] = [a, b].map(|i| normals[i] * (0.5 / found[i].area));
        let turn = turns_of(m.dot(n), m.cross(n).length());
        if least < turn && turn < most {
            for i in [a, b] {
                found[i].turn = found[i].turn.max(turn);
            }
        }
    }
    found
}

/// Largest distance between triangles and the surface whose unit normals they have at their corners.
///
/// Between two corners with normals a and b, e from one to the other, a surface that is quadratic along the way is |(b − a)·e|/8
/// from its chord in the middle. Over a triangle such heights s₁, s₂, s₃ over its sides make 4 (s₁ v w + s₂ w u + s₃ u v) in
/// barycentric coordinates: 4/9 (s₁ + s₂ + s₃) at the centroid. Exact but for terms of fourth order in the size of the triangles.
///
/// # Panics
/// If a triangle names a vertex that there is not, or a vertex has no normal.
#[must_use]
pub fn chord_error(vertices: &[[f64; 3]], normals: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let of = |t: &[u32; 3]| {
        let corners = t.map(|v| (Vec3::from(vertices[v as usize]), Vec3::from(normals[v as usize])));
        let heights = [0, 1, 2].map(|k| {
            let ((from, a), (to, b)) = (corners[k], corners[(k + 1) % 3]);
            (b - a).dot(to - from) / 8.0
        });
        let middle = heights.iter().sum::<f64>().abs() * (4.0 / 9.0);
        heights.iter().fold(middle, |most, height| most.max(height.abs()))
    };
    triangles.iter().map(of).fold(0.0, f64::max)
}
