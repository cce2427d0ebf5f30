//! Which vertices coincide, which triangles share an edge, and which hang together.

use etendue_math::Vec3;
use etendue_sampling::ordered::inside;
use rayon::prelude::*;

/// Vertices of which no two coincide.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Welded {
    /// A vertex at each place, in rising order of x, y and z.
    pub kept: Vec<u32>,
    /// For each vertex the number of its place.
    pub number: Vec<u32>,
}

/// Brings vertices at the same place together. Coordinates are finite.
///
/// # Panics
/// If there are 2³² vertices or more.
#[must_use]
pub fn weld(vertices: &[[f64; 3]]) -> Welded {
    let count = u32::try_from(vertices.len()).expect("fewer than 2³² vertices");
    // Integers in the order of the numbers; adding 0 turns −0 into 0.
    let rank = |value: f64| {
        let bits = (value + 0.0).to_bits();
        if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
    };
    let places = inside(0, || {
        let mut places: Vec<([u64; 3], u32)> = vertices.iter().map(|p| p.map(rank)).zip(0..count).collect();
        places.par_sort_unstable();
        places
    });
    let mut welded = Welded {
        kept: Vec::new(),
        number: vec![0; vertices.len()],
    };
    for alike in places.chunk_by(|a, b| a.0 == b.0) {
        // Fewer than there are vertices.
        #[allow(clippy::cast_possible_truncation, reason = "no more places than vertices")]
        let place = welded.kept.len() as u32;
        welded.kept.push(alike[0].1);
        for (_, vertex) in alike {
            welded.number[*vertex as usize] = place;
        }
    }
    welded
}

/// Triangles over vertices of which no two coincide, those left out that have no area.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cleaned {
    /// The vertices that are used, in rising order of x, y and z: a number of each.
    pub kept: Vec<u32>,
    /// The triangles over these.
    pub triangles: Vec<[u32; 3]>,
}

/// Brings vertices at the same place together, and leaves triangles without an area out.
///
/// # Panics
/// If there are 2³² vertices or more, or a triangle names one that there is not.
#[must_use]
pub fn cleaned(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Cleaned {
    let Welded { kept, number } = weld(vertices);
    let has_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3::from(vertices[kept[v as usize] as usize]));
        (b - a).cross(c - a) != Vec3::default()
    };
    let mut triangles: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| t.map(|v| number[v as usize]))
        .filter(has_area)
        .collect();
    let mut places = vec![0; kept.len()];
    for vertex in triangles.iter().flatten() {
        places[*vertex as usize] = 1;
    }
    let mut count = 0;
    for place in &mut places {
        let used = *place;
        *place = count;
        count += used;
    }
    let mut used = Vec::with_capacity(count as usize);
    for (vertex, ends) in kept
        .iter()
        .zip(places.iter().zip(places.iter().skip(1).chain([&count])))
    {
        if ends.0 < ends.1 {
            used.push(*vertex);
        }
    }
    for vertex in triangles.iter_mut().flatten() {
        *vertex = places[*vertex as usize];
    }
    Cleaned { kept: used, triangles }
}

/// The sides of triangles in the rising order of their edges (lower vertex, higher vertex); those of one edge in the order of
/// their triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sides {
    /// The edge of each.
    pub edge: Vec<[u32; 2]>,
    /// The triangle of each.
    pub triangle: Vec<u32>,
    /// Whether the triangle runs from the lower vertex to the higher one.
    pub forward: Vec<bool>,
}

/// The sides of triangles. Vertices that coincide are one vertex by now.
///
/// # Panics
/// If there are 2³² triangles or more.
#[must_use]
pub fn sides(triangles: &[[u32; 3]]) -> Sides {
    let count = u32::try_from(triangles.len()).expect("fewer than 2³² triangles");
    let each = || {
        let of = |([a, b, c], triangle): (&[u32; 3], u32)| [(*a, *b), (*b, *c), (*c, *a)].map(|ends| (ends, triangle));
        triangles.iter().zip(0..count).flat_map(of)
    };
    // Dealt out by the lower vertex, of which each has few.
    let vertices = triangles.iter().flatten().max().map_or(0, |most| *most as usize + 1);
    let mut next = vec![0_usize; vertices + 1];
    for ((a, b), _) in each() {
        next[a.min(b) as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        next[vertex + 1] += next[vertex];
    }
    let firsts = next.clone();
    let mut dealt = vec![(0, 0, false); 3 * triangles.len()];
    for ((a, b), triangle) in each() {
        let place = &mut next[a.min(b) as usize];
        dealt[*place] = (a.max(b), triangle, a < b);
        *place += 1;
    }
    let mut found = Sides {
        edge: Vec::with_capacity(dealt.len()),
        triangle: Vec::with_capacity(dealt.len()),
        forward: Vec::with_capacity(dealt.len()),
    };
    for (low, ends) in (0_u32..).zip(firsts.windows(2)) {
        let own = &mut dealt[ends[0]..ends[1]];
        own.sort_unstable();
        found.edge.extend(own.iter().map(|side| [low, side.0]));
        found.triangle.extend(own.iter().map(|side| side.1));
        found.forward.extend(own.iter().map(|side| side.2));
    }
    found
}

/// The edges at which triangles are not closed, in rising order: all that do not belong to exactly two of them, which pass along
/// them in opposite directions. A solid has none.
#[must_use]
pub fn open_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = sides(triangles);
    let mut forward = &sides.forward[..];
    let mut open = Vec::new();
    for uses in sides.edge.chunk_by(|a, b| a == b) {
        let (own, rest) = forward.split_at(uses.len());
        forward = rest;
        if !matches!(own, [true, false] | [false, true]) {
            open.push(uses[0]);
        }
    }
    open
}

/// The number of the shell that each triangle belongs to, from 0 in the order of their first triangles: triangles that share
/// an edge are of one.
#[must_use]
pub fn shells(triangles: &[[u32; 3]]) -> Vec<u32> {
    fn root(parent: &mut [u32], mut triangle: u32) -> u32 {
        while parent[triangle as usize] != triangle {
            let above = parent[parent[triangle as usize] as usize];
            parent[triangle as usize] = above;
            triangle = above;
        }
        triangle
    }
    let sides = sides(triangles);
    let mut parent: Vec<u32> = (0_u32..).take(triangles.len()).collect();
    for (edges, owners) in sides.edge.windows(2).zip(sides.triangle.windows(2)) {
        if edges[0] == edges[1] {
            let roots = [0, 1].map(|k| root(&mut parent, owners[k]));
            // The root of a shell is its first triangle.
            parent[roots[0].max(roots[1]) as usize] = roots[0].min(roots[1]);
        }
    }
    let (mut shell, mut count) = (vec![0; triangles.len()], 0);
    for triangle in (0_u32..).take(triangles.len()) {
        let first = root(&mut parent, triangle);
        shell[triangle as usize] = if first == triangle {
            count += 1;
            count - 1
        } else {
            shell[first as usize]
        };
    }
    shell
}
