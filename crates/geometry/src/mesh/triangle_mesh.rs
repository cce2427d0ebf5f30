//! Triangles over shared vertices: planes, area, volume, sampling.

use std::fmt;

use etendue_math::Vec3;
use etendue_sampling::alias::Alias;

use crate::bounds::Bounds;
use crate::bvh::Bvh;

use super::block::{Block, LANES, MARGIN, longest_side};

/// Triangles over shared vertices \[mm\], counter-clockwise seen from outside.
///
/// Triangles keep the indices they were given. Those without area are kept out of everything but the list: no ray hits
/// them, no point is drawn on them, their normal is 0 and no edge is theirs.
#[derive(Clone, Debug)]
pub struct Mesh {
    pub(super) vertices: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    vertex_normals: Option<Vec<Vec3>>,
    /// The plane of each triangle: its geometric unit normal and n·p of its points; 0 for a triangle without area.
    planes: Vec<Plane>,
    degenerate: usize,
    area: f64,
    by_area: Alias,
    pub(super) tree: Bvh,
    /// The triangles of each leaf of the tree.
    pub(super) blocks: Vec<Block>,
}

/// The points p with n·p = h: what is asked of a triangle after every hit, in half a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Plane {
    normal: Vec3,
    height: f64,
}

/// Why vertices and triangles are no mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshError {
    /// There is no triangle, or none of them has an area.
    NoArea {
        /// How many triangles there are, all without area.
        triangles: usize,
    },
    /// 2³¹ triangles or vertices, or more.
    TooMany,
    /// A coordinate is NaN or infinite, or so large (above 10¹⁰⁰) that an area would be.
    Vertex {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A triangle names a vertex that there is not.
    Index {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex that it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// There are not as many normals as vertices.
    NormalCount {
        /// How many normals there are.
        normals: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A normal is NaN or infinite.
    Normal {
        /// Index of the vertex that it belongs to.
        vertex: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoArea { triangles: 0 } => write!(f, "the mesh has no triangles"),
            Self::NoArea { triangles } => write!(f, "none of the mesh's {triangles} triangles has an area"),
            Self::TooMany => write!(
                f,
                "a mesh has fewer than 2147483648 triangles and vertices; split this one"
            ),
            Self::Vertex { vertex } => write!(f, "vertex {vertex} has a coordinate that is not a number up to 1e100"),
            Self::Index {
                triangle,
                vertex,
                vertices,
            } => {
                write!(
                    f,
                    "triangle {triangle} names vertex {vertex}, but there are {vertices} vertices, counted from 0"
                )
            }
            Self::NormalCount { normals, vertices } => {
                write!(
                    f,
                    "{normals} normals for {vertices} vertices; give one for each vertex, or none"
                )
            }
            Self::Normal { vertex } => write!(f, "the normal of vertex {vertex} is not finite"),
        }
    }
}

impl std::error::Error for MeshError {}

impl Mesh {
    /// A mesh from vertices \[mm\], triangles as indices of vertices, and, if it is meant to look smooth, a normal for
    /// each vertex, of any length.
    ///
    /// # Errors
    /// A [`MeshError`] says what is wrong with them, and where.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, normals: Option<Vec<Vec3>>) -> Result<Self, MeshError> {
        check(&vertices, &triangles, normals.as_deref())?;
        let corners = |i: usize| triangles[i].map(|v| vertices[v as usize]);
        let (areas, planes): (Vec<f64>, Vec<Plane>) = (0..triangles.len())
            .map(|i| {
                let (area, normal) = area_and_normal(corners(i));
                let height = normal.dot(corners(i)[0]);
                (area, Plane { normal, height })
            })
            .unzip();
        #[allow(clippy::cast_possible_truncation, reason = "fewer than 2³¹ triangles")]
        let real: Vec<u32> = (0..triangles.len() as u32)
            .filter(|i| areas[*i as usize] > 0.0)
            .collect();
        let by_area = Alias::new(&areas).ok_or(MeshError::NoArea {
            triangles: triangles.len(),
        })?;
        let boxes: Vec<Bounds> = real
            .iter()
            .map(|i| corners(*i as usize))
            .map(|c| Bounds::of(c).widened(MARGIN * longest_side(c)))
            .collect();
        let tree = Bvh::new(&boxes, LANES).ok_or(MeshError::TooMany)?;
        let blocks = tree
            .leaves()
            .map(|leaf| {
                let members: Vec<(u32, [Vec3; 3])> = leaf
                    .iter()
                    .map(|i| real[*i as usize])
                    .map(|i| (i, corners(i as usize)))
                    .collect();
                Block::new(&members)
            })
            .collect();
        Ok(Self {
            degenerate: triangles.len() - real.len(),
            area: areas.iter().sum(),
            by_area,
            tree,
            blocks,
            planes,
            vertex_normals: normals,
            vertices,
            triangles,
        })
    }

    /// How many triangles there are, with those without area.
    #[must_use]
    #[allow(clippy::len_without_is_empty, reason = "a mesh is never empty")]
    pub const fn len(&self) -> usize {
        self.triangles.len()
    }

    /// How many triangles have no area and are kept out.
    #[must_use]
    pub const fn degenerate(&self) -> usize {
        self.degenerate
    }

    /// The smallest box around the triangles that have an area \[mm\].
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.real().flat_map(|i| self.triangle(i)))
    }

    /// Whether the box around any triangle has a point in common with a box.
    #[must_use]
    pub fn touches(&self, around: Bounds) -> bool {
        // The tree numbers the triangles that have an area.
        let real: Vec<u32> = self.real().collect();
        self.tree
            .any_in(around, |i| Bounds::of(self.triangle(real[i as usize])).touches(around))
    }

    /// The vertices of a triangle \[mm\].
    ///
    /// # Panics
    /// If there is no triangle `i`, as all methods that take one.
    #[inline]
    #[must_use]
    pub fn triangle(&self, i: u32) -> [Vec3; 3] {
        self.triangles[i as usize].map(|v| self.vertices[v as usize])
    }

    /// Number of triangles.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.triangles.len()
    }

    /// The geometric unit normal of a triangle; its vertices run counter-clockwise about it.
    #[inline]
    #[must_use]
    pub fn normal(&self, i: u32) -> Vec3 {
        self.planes[i as usize].normal
    }

    /// The plane of a triangle: its geometric unit normal n, and n·p of its points \[mm\].
    #[inline]
    #[must_use]
    pub fn plane(&self, i: u32) -> (Vec3, f64) {
        let Plane { normal, height } = self.planes[i as usize];
        (normal, height)
    }

    /// Whether it states normals at its vertices, which are interpolated between them.
    #[must_use]
    pub const fn is_smooth(&self) -> bool {
        self.vertex_normals.is_some()
    }

    /// The weights of the second and third vertex of a triangle at a point of it.
    #[must_use]
    pub fn weights(&self, i: u32, point: Vec3) -> [f64; 2] {
        let [a, b, c] = self.triangle(i);
        let (e, f, p) = (b - a, c - a, point - a);
        let n = e.cross(f);
        let square = n.dot(n);
        [p.cross(f).dot(n) / square, e.cross(p).dot(n) / square]
    }

    /// The unit normal of the smooth surface that a triangle stands for, at weights `u` and `v` of its second and third
    /// vertex: between the normals of its vertices. The geometric one if there are none or they cancel out.
    #[must_use]
    pub fn shading_normal(&self, i: u32, u: f64, v: f64) -> Vec3 {
        let Some(normals) = &self.vertex_normals else {
            return self.normal(i);
        };
        let [a, b, c] = self.triangles[i as usize].map(|vertex| normals[vertex as usize]);
        let sum = a * (1.0 - u - v) + b * u + c * v;
        let unit = sum.normalized();
        if unit.dot(unit).is_finite() {
            unit
        } else {
            self.normal(i)
        }
    }

    /// Area of all triangles \[mm²\].
    #[must_use]
    pub const fn area(&self) -> f64 {
        self.area
    }

    /// A point uniform in area \[mm\], and its triangle, from three uniform numbers in (0, 1).
    #[must_use]
    pub fn sample(&self, u1: f64, u2: f64, u3: f64) -> (Vec3, u32) {
        #[allow(clippy::cast_possible_truncation, reason = "fewer than 2³¹ triangles")]
        let i = self.by_area.pick(u1) as u32;
        let [a, b, c] = self.triangle(i);
        // The share of a triangle nearer to `a` than a part s of its height is s².
        let s = u2.sqrt();
        (a * (1.0 - s) + b * (s * (1.0 - u3)) + c * (s * u3), i)
    }

    /// The volume that the mesh encloses \[mm³\]: negative if it is inside out, meaningless if it is open.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let bounds = self.bounds();
        let middle = (bounds.lo + bounds.hi) * 0.5;
        let sixfold: f64 = self
            .real()
            .map(|i| self.triangle(i).map(|p| p - middle))
            .map(|[a, b, c]| a.dot(b.cross(c)))
            .sum();
        sixfold / 6.0
    }

    /// The triangles that have an area.
    #[allow(clippy::cast_possible_truncation, reason = "fewer than 2³¹ triangles")]
    pub(super) fn real(&self) -> impl Iterator<Item = u32> {
        (0..self.len() as u32).filter(|i| self.planes[*i as usize].normal != Vec3::default())
    }
}

fn check(vertices: &[Vec3], triangles: &[[u32; 3]], normals: Option<&[Vec3]>) -> Result<(), MeshError> {
    const LIMIT: usize = 1 << 31;
    if triangles.len() >= LIMIT || vertices.len() >= LIMIT {
        return Err(MeshError::TooMany);
    }
    let within = |p: &Vec3, limit: f64| p.x.abs() <= limit && p.y.abs() <= limit && p.z.abs() <= limit;
    if let Some(vertex) = vertices.iter().position(|p| !within(p, 1e100)) {
        return Err(MeshError::Vertex { vertex });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(vertex) = corners.iter().find(|v| **v as usize >= vertices.len()) {
            return Err(MeshError::Index {
                triangle,
                vertex: *vertex,
                vertices: vertices.len(),
            });
        }
    }
    if let Some(normals) = normals {
        if normals.len() != vertices.len() {
            return Err(MeshError::NormalCount {
                normals: normals.len(),
                vertices: vertices.len(),
            });
        }
        if let Some(vertex) = normals.iter().position(|n| !within(n, f64::MAX)) {
            return Err(MeshError::Normal { vertex });
        }
    }
    Ok(())
}

/// Area and unit normal; both 0 if the vertices, as rounded, lie on a line.
fn area_and_normal(corners: [Vec3; 3]) -> (f64, Vec3) {
    let [a, b, c] = corners;
    // Scaled, so that no square underflows or overflows. A scale of infinity makes NaN, which is no area.
    let side = longest_side(corners);
    let scale = 1.0 / side;
    let double = ((b - a) * scale).cross((c - a) * scale);
    let length = double.length();
    let area = 0.5 * length * side * side;
    if area > 0.0 && area.is_finite() {
        (area, double * (1.0 / length))
    } else {
        (0.0, Vec3::default())
    }
}
