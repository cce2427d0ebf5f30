//! Where smooth surfaces send light to diffuse ones from: directions that lines of sight go on in by preference.
//!
//! A line of sight that is scattered diffusely finds a lamp behind a lens by chance only. Rays traced forwards, which arrived
//! at the diffuse surface from there, say where to look: as in `[Jensen1995]`, a direction is drawn from a density about those
//! in which the nearest of them arrived. At the first diffuse surface half of the directions are drawn so, half by the cosine
//! law, and fewer from one to the next (see [`share`]): whatever the rays tell, no light is lost, and none weighs more than
//! three times of what it would without them, however often it is scattered.
//!
//! Light comes in families: what a ball focuses and what it mirrors arrive at one place from different sides, one of them
//! hundreds of times more often. Each family has arrivals of its own to go by, and a share of the directions by the root
//! of their number, so that a rare one is not left to chance.

use std::f64::consts::PI;

use etendue_math::Vec3;
use etendue_optics::source::surface::about;

/// Arrivals that a density rests on, at most.
const TOGETHER: usize = 16;

/// Number of the neighbour, in direction, whose distance is the width of the density about an arrival.
const NEIGHBOUR: usize = 3;

/// The least width, as 1 − cosine: a quarter of a minute of arc.
const NARROWEST: f64 = 2.5e-9;

/// How far around its arrivals a density holds, in units of their extent.
const MARGIN: f64 = 0.5;

/// Families of arrivals at one face, at most; the rest are taken as one more.
const FAMILIES: usize = 6;

/// Arrivals that a family has at least.
const FEWEST: usize = 8;

/// Share of the directions that are drawn from the density, where there is one, after so many diffuse scatters.
///
/// A direction that is not drawn so weighs 1/(1 − share) times as much. If the shares did not fall, these weights would
/// multiply from one scatter to the next: at half each, the square of what a path in a white cavity brings would grow by 2ρ²,
/// without an end for a reflectance ρ above 0.71. The product of all 1/(1 − 1/(2 k²)) is √2 π/2 / sin(π/√2) = 2.79; and that
/// the shares do not fall faster leaves the light that is found at later scatters its sum of squares, Σ 2 k² ρ^(2k).
#[must_use]
pub fn share(scatters: u32) -> f64 {
    let number = f64::from(scatters) + 1.0;
    0.5 / (number * number)
}

/// Light that came through smooth surfaces and arrives at the first diffuse one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The diffuse face.
    pub face: u32,
    /// Where \[mm\].
    pub point: Vec3,
    /// Unit vector to where it came from.
    pub towards: Vec3,
    /// Its source and the smooth surfaces on its way (see `ray_state`).
    pub family: u32,
}

/// The arrivals of all families near to a point.
#[derive(Clone, Copy, Debug)]
pub struct Near<'a> {
    guide: &'a Guide,
    leaves: [Option<(f64, &'a Leaf)>; FAMILIES + 1],
    total: f64,
}

/// Densities of directions, face by face and place by place.
#[derive(Clone, Debug)]
pub struct Guide {
    /// For each face that light arrives at: the trees of its families, and their shares.
    roots: Vec<Vec<(f64, usize)>>,
    nodes: Vec<Node>,
    towards: Vec<Vec3>,
}

/// A node of a tree over the places of arrivals.
#[derive(Clone, Debug)]
enum Node {
    /// Places below `at` along an axis are in the next node, the others in node `above`.
    Split { axis: usize, at: f64, above: usize },
    /// A few arrivals.
    Leaf(Leaf),
}

/// Arrivals near to each other.
#[derive(Clone, Debug)]
pub struct Leaf {
    first: usize,
    count: usize,
    /// The box in which they count.
    lo: [f64; 3],
    hi: [f64; 3],
    /// One over the width of the density about each, as 1 − cosine.
    sharpness: f64,
}

const fn coordinates(p: Vec3) -> [f64; 3] {
    [p.x, p.y, p.z]
}

impl Guide {
    /// From arrivals at the faces of a scene, in any order that is always the same.
    #[must_use]
    pub fn new(faces: usize, mut arrivals: Vec<Arrival>) -> Self {
        arrivals.sort_by_key(|arrival| (arrival.face, arrival.family));
        let mut guide = Self {
            roots: vec![Vec::new(); faces],
            nodes: Vec::new(),
            towards: Vec::with_capacity(arrivals.len()),
        };
        for same in arrivals.chunk_by_mut(|a, b| a.face == b.face) {
            let face = same[0].face as usize;
            if face >= faces {
                continue;
            }
            let families = same.chunk_by(|a, b| a.family == b.family);
            let mut counts: Vec<(usize, u32)> = families.map(|f| (f.len(), f[0].family)).collect();
            counts.sort_by(|a, b| b.cmp(a));
            let large = counts.iter().take(FAMILIES).filter(|(n, _)| *n >= FEWEST);
            let own: Vec<u32> = large.map(|(_, family)| *family).collect();
            let rank = |a: &Arrival| own.iter().position(|f| *f == a.family).unwrap_or(own.len());
            same.sort_by_key(rank);
            for together in same.chunk_by_mut(|a, b| rank(a) == rank(b)) {
                guide.roots[face].push(((together.len() as f64).sqrt(), guide.nodes.len()));
                guide.grow(together);
            }
        }
        guide
    }

    /// Number of arrivals.
    #[must_use]
    pub const fn arrivals(&self) -> usize {
        self.towards.len()
    }

    /// Adds the nodes of some arrivals.
    fn grow(&mut self, arrivals: &mut [Arrival]) {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for arrival in arrivals.iter() {
            for (axis, x) in coordinates(arrival.point).into_iter().enumerate() {
                lo[axis] = lo[axis].min(x);
                hi[axis] = hi[axis].max(x);
            }
        }
        let extent: [f64; 3] = std::array::from_fn(|axis| hi[axis] - lo[axis]);
        let axis = (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
        if arrivals.len() > TOGETHER && extent[axis] > 0.0 {
            let middle = arrivals.len() / 2;
            let key = |a: &Arrival| coordinates(a.point)[axis];
            arrivals.sort_by(|a, b| key(a).total_cmp(&key(b)));
            let (at, node) = (key(&arrivals[middle]), self.nodes.len());
            self.nodes.push(Node::Split { axis, at, above: 0 });
            let (below, from) = arrivals.split_at_mut(middle);
            self.grow(below);
            let above = self.nodes.len();
            self.nodes[node] = Node::Split { axis, at, above };
            self.grow(from);
            return;
        }
        // Of many at one point, no more than enough.
        let arrivals = &arrivals[..arrivals.len().min(TOGETHER)];
        let margin = MARGIN * extent[axis];
        let first = self.towards.len();
        self.towards.extend(arrivals.iter().map(|arrival| arrival.towards));
        let directions = &self.towards[first..];
        let width = |towards: &Vec3| {
            let mut off: Vec<f64> = directions.iter().map(|other| 1.0 - towards.dot(*other)).collect();
            off.sort_by(f64::total_cmp);
            off[NEIGHBOUR.min(off.len() - 1)]
        };
        let mean = directions.iter().map(width).sum::<f64>() / directions.len() as f64;
        // One arrival alone says little.
        let width = if directions.len() > NEIGHBOUR {
            mean.max(NARROWEST)
        } else {
            1.0
        };
        self.nodes.push(Node::Leaf(Leaf {
            first,
            count: directions.len(),
            lo: lo.map(|x| x - margin),
            hi: hi.map(|x| x + margin),
            sharpness: 1.0 / width,
        }));
    }

    /// The arrivals near to a point of a face; None if there are none.
    #[must_use]
    pub fn near(&self, face: u32, point: Vec3) -> Option<Near<'_>> {
        let mut near = Near {
            guide: self,
            leaves: [None; FAMILIES + 1],
            total: 0.0,
        };
        for (slot, (share, root)) in near.leaves.iter_mut().zip(self.roots.get(face as usize)?) {
            if let Some(leaf) = self.leaf(*root, point) {
                *slot = Some((*share, leaf));
                near.total += share;
            }
        }
        (near.total > 0.0).then_some(near)
    }

    /// The arrivals of a tree near to a point.
    fn leaf(&self, root: usize, point: Vec3) -> Option<&Leaf> {
        let mut node = root;
        let place = coordinates(point);
        loop {
            match &self.nodes[node] {
                Node::Split { axis, at, above } => node = if place[*axis] < *at { node + 1 } else { *above },
                Node::Leaf(leaf) => {
                    let inside = (0..3).all(|axis| (leaf.lo[axis]..=leaf.hi[axis]).contains(&place[axis]));
                    return inside.then_some(leaf);
                }
            }
        }
    }

    /// Density of a direction about the arrivals of a leaf \[1/sr\].
    ///
    /// About each arrival (1 + 2s)/4π · (1 + s(1 − cos))⁻², with s the sharpness: it has far tails, so that light between
    /// the arrivals is not missed.
    fn density(&self, leaf: &Leaf, d: Vec3) -> f64 {
        let s = leaf.sharpness;
        let near = &self.towards[leaf.first..leaf.first + leaf.count];
        let sum: f64 = near
            .iter()
            .map(|towards| {
                let x = 1.0 + s * (1.0 - towards.dot(d)).max(0.0);
                1.0 / (x * x)
            })
            .sum();
        sum * (1.0 + 2.0 * s) / (4.0 * PI * leaf.count as f64)
    }

    /// A direction about one of the arrivals of a leaf, from three numbers.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "below the number of arrivals"
    )]
    fn draw(&self, leaf: &Leaf, [which, height, turn]: [f64; 3]) -> Vec3 {
        let s = leaf.sharpness;
        let which = ((which * leaf.count as f64) as usize).min(leaf.count - 1);
        // The share below 1 − cos = t is t/(1 + s t) · (1 + 2s)/2.
        let x = 2.0 * height / (1.0 + 2.0 * s);
        let t = (x / (1.0 - s * x)).clamp(0.0, 2.0);
        about(self.towards[leaf.first + which], 1.0 - t, turn)
    }
}

impl Near<'_> {
    /// Density of a direction \[1/sr\].
    #[must_use]
    pub fn density(&self, d: Vec3) -> f64 {
        let each = self.leaves.iter().flatten();
        each.map(|(share, leaf)| share * self.guide.density(leaf, d))
            .sum::<f64>()
            / self.total
    }

    /// A direction from three numbers.
    #[must_use]
    pub fn draw(&self, [which, height, turn]: [f64; 3]) -> Vec3 {
        let mut number = which * self.total;
        let mut last = None;
        for (share, leaf) in self.leaves.iter().flatten() {
            last = Some((number / share, leaf));
            if number < *share {
                break;
            }
            number -= share;
        }
        // What is left of a number that has decided is again spread evenly.
        last.map_or(Vec3::new(0.0, 0.0, 1.0), |(number, leaf)| {
            self.guide.draw(leaf, [number.clamp(0.0, 1.0), height, turn])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use etendue_sampling::philox::Stream;

    fn guide() -> Guide {
        let numbers = Stream::new(3, 4);
        let arrivals = (0..500).map(|i| {
            let [a, b, c, d] = numbers.uniforms(i, 0);
            Arrival {
                face: 1,
                point: Vec3::new(5.0 * a, 3.0 * b, 0.0),
                towards: if i % 20 == 0 {
                    about(Vec3::new(-0.8, 0.0, 0.6), 1.0 - 0.001 * c, d)
                } else {
                    about(Vec3::new(0.6, 0.0, 0.8), 1.0 - 0.01 * c, d)
                },
                family: u32::from(i % 20 == 0),
            }
        });
        Guide::new(3, arrivals.collect())
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        let guide = guide();
        assert!(guide.near(0, Vec3::new(2.0, 1.0, 0.0)).is_none());
        assert!(guide.near(1, Vec3::new(2.0, 9.0, 0.0)).is_none());
        let near = guide.near(1, Vec3::new(2.0, 1.0, 0.0)).expect("inside");
        assert_eq!(near.leaves.iter().flatten().count(), 2);
        // The mean of f/p over directions is ∫ f dω, for f with a closed form: 1, and a cap about another axis.
        let axis = Vec3::new(0.0, 0.6, 0.8);
        let (n, mut sums) = (1_000_000_u32, [0.0; 4]);
        let stream = Stream::new(5, 6);
        for i in 0..n {
            let [a, b, c, _] = stream.uniforms(u64::from(i), 0);
            let d = near.draw([a, b, c]);
            assert!((d.length() - 1.0).abs() < 1e-12);
            let p = near.density(d);
            let cap = if d.dot(axis) > 0.7 { 1.0 } else { 0.0 };
            for (k, f) in [(0, 1.0), (2, cap)] {
                sums[k] += f / p;
                sums[k + 1] += f / p * (f / p);
            }
        }
        let n = f64::from(n);
        for (k, expected) in [(0, 4.0 * PI), (2, 2.0 * PI * 0.3)] {
            let mean = sums[k] / n;
            let error = ((sums[k + 1] / n - mean * mean) / n).sqrt();
            assert!(error < 0.03 * expected, "{error}");
            assert!(
                (mean - expected).abs() < 3.9 * error,
                "{mean} ± {error}, {expected} expected"
            );
        }
    }

    #[test]
    fn every_place_among_arrivals_has_some() {
        let guide = guide();
        assert_eq!(guide.arrivals(), 500);
        let leaves = guide.nodes.iter().filter_map(|node| match node {
            Node::Leaf(leaf) => Some(leaf.count),
            Node::Split { .. } => None,
        });
        assert!(leaves.clone().all(|count| count <= TOGETHER));
        assert_eq!(leaves.sum::<usize>(), 500);
    }

    #[test]
    fn many_at_one_point_are_no_endless_tree() {
        let one = Arrival {
            face: 0,
            point: Vec3::new(1.0, 2.0, 3.0),
            towards: Vec3::new(0.0, 0.0, 1.0),
            family: 0,
        };
        let guide = Guide::new(1, vec![one; 1000]);
        let near = guide.near(0, one.point).expect("there");
        let [x, y] = [near.density(one.towards), near.density(-one.towards)];
        assert!(x > 1e6 && y > 0.0 && x.is_finite());
    }
}
