//! Integrals over the facets that a direction sees, several facets at a time: what tables of shares are made of.
//!
//! A lattice of Fibonacci, which does better with edges in unknown places than a product of rules.

use etendue_math::Vec3;
use etendue_math::trig::sin_cos_turns;
use multiversion::multiversion;

use super::facets::Facets;
use crate::fresnel::fresnel;

/// Two neighbours of Fibonacci, the nodes of the quadrature over facets and what spreads them; fewer where azimuth matters.
const NODES: [[u32; 2]; 2] = [[17_711, 10_946], [6_765, 4_181]];

/// Facets that are summed side by side, whatever the instruction set.
const LANES: usize = 32;

/// A direction mirrored by a facet.
#[inline(always)]
pub fn mirrored(i: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * i.dot(h)) - i
}

/// A direction refracted by a facet, from the cosines on both sides and the ratio of the index there to that here.
#[inline(always)]
pub fn refracted(i: Vec3, h: Vec3, cosine: f64, across: f64, ratio: f64) -> Vec3 {
    let o = h * (cosine / ratio - across) - i * ratio.recip();
    o * o.length().recip()
}

/// The nodes of the quadrature.
#[derive(Debug)]
pub struct FacetLattice {
    facets: Facets,
    /// Sine and cosine of the turn, the other number that a facet is drawn from, and the weight, over the number of nodes.
    nodes: [Vec<f64>; 4],
}

impl FacetLattice {
    /// For facets of a kind.
    #[must_use]
    pub fn new(facets: Facets) -> Self {
        let [count, step] = NODES[usize::from(facets.turns())];
        let all = f64::from(count);
        let mut nodes: [Vec<f64>; 4] = std::array::from_fn(|_| Vec::new());
        for k in 0..count {
            let turn = (f64::from(k) * f64::from(step) / all + 0.25 / all).fract();
            // Finer towards both ends, where functions may behave like a root.
            let u = (f64::from(k) + 0.5) / all;
            let (sine, cosine) = sin_cos_turns(turn);
            let node = [sine, cosine, u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / all];
            nodes.iter_mut().zip(node).for_each(|(list, value)| list.push(value));
        }
        // A whole number of lanes: the last ones count for nothing.
        let padded = nodes[0].len().next_multiple_of(LANES);
        for (list, value) in nodes.iter_mut().zip([0.0, 1.0, 0.5, 0.0]) {
            list.resize(padded, value);
        }
        Self { facets, nodes }
    }

    /// The shares of light from `i` that facets between media reflect to where it gets away, and, if it is asked for, send
    /// through, by the ratio of the index on the other side to that on the side of the light.
    #[must_use]
    pub fn reflected_and_transmitted(&self, i: Vec3, ratio: f64, through: bool) -> [f64; 2] {
        match (self.facets.ggx(), through) {
            (true, true) => shares::<true, true>(self, i, ratio),
            (true, false) => shares::<true, false>(self, i, ratio),
            (false, true) => shares::<false, true>(self, i, ratio),
            (false, false) => shares::<false, false>(self, i, ratio),
        }
    }

    /// For each facet the cosine under which light from `i` meets it, and the share that a perfect reflector sends away there.
    pub fn mirrors(&self, i: Vec3, cosines: &mut Vec<f64>, shares: &mut Vec<f64>) {
        for list in [&mut *cosines, &mut *shares] {
            list.clear();
            list.resize(self.nodes[0].len(), 0.0);
        }
        if self.facets.ggx() {
            mirrors::<true>(self, i, cosines, shares);
        } else {
            mirrors::<false>(self, i, cosines, shares);
        }
    }
}

/// What a node and its facet are worth: the direction there, the cosine, and the weight times the part of such facets.
#[inline(always)]
fn node<const GGX: bool>(facets: &Facets, i: Vec3, [sine, cosine, height, weight]: [f64; 4]) -> (Vec3, f64, f64) {
    let drawn = facets.drawn::<GGX>(i, (sine, cosine), height);
    (drawn.h, i.dot(drawn.h), weight * drawn.more)
}

/// The share of what meets a facet under a perfect reflector that gets away.
#[inline(always)]
fn away<const GGX: bool>(facets: &Facets, i: Vec3, hidden: f64, h: Vec3) -> f64 {
    let o = mirrored(i, h);
    let seen = o.z * Facets::seen_by_both(i.z, o.z, [hidden, facets.hidden_of::<GGX>(o)]);
    if o.z > 0.0 { seen } else { 0.0 }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn shares<const GGX: bool, const THROUGH: bool>(lattice: &FacetLattice, i: Vec3, ratio: f64) -> [f64; 2] {
    let facets = lattice.facets;
    let hidden = facets.hidden_of::<GGX>(i);
    let [sines, cosines, heights, weights] = &lattice.nodes;
    let (sines, _) = sines.as_chunks::<LANES>();
    let (cosines, _) = cosines.as_chunks::<LANES>();
    let (heights, _) = heights.as_chunks::<LANES>();
    let (weights, _) = weights.as_chunks::<LANES>();
    let mut sums = [[0.0; LANES]; 2];
    for (((sines, cosines), heights), weights) in sines.iter().zip(cosines).zip(heights).zip(weights) {
        for lane in 0..LANES {
            let numbers = [sines[lane], cosines[lane], heights[lane], weights[lane]];
            let (h, cosine, part) = node::<GGX>(&facets, i, numbers);
            let f = fresnel(cosine, 1.0, ratio);
            let reflected = f.reflectance * part * away::<GGX>(&facets, i, hidden, h);
            sums[0][lane] += if cosine > 0.0 { reflected } else { 0.0 };
            if THROUGH {
                let o = refracted(i, h, cosine, f.cosine, ratio);
                let up = Vec3::new(o.x, o.y, -o.z);
                let seen = Facets::seen_through(i.z, up.z, [hidden, facets.hidden_of::<GGX>(up)]);
                let passed = (1.0 - f.reflectance) * part * seen / i.z;
                let passes = (cosine > 0.0) & (f.reflectance < 1.0) & (up.z > 0.0);
                sums[1][lane] += if passes { passed } else { 0.0 };
            }
        }
    }
    sums.map(|lanes| lanes.into_iter().sum())
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn mirrors<const GGX: bool>(lattice: &FacetLattice, i: Vec3, cosines_met: &mut [f64], shares: &mut [f64]) {
    let facets = lattice.facets;
    let hidden = facets.hidden_of::<GGX>(i);
    let [sines, cosines, heights, weights] = &lattice.nodes;
    let (sines, _) = sines.as_chunks::<LANES>();
    let (cosines, _) = cosines.as_chunks::<LANES>();
    let (heights, _) = heights.as_chunks::<LANES>();
    let (weights, _) = weights.as_chunks::<LANES>();
    let (cosines_met, _) = cosines_met.as_chunks_mut::<LANES>();
    let (shares, _) = shares.as_chunks_mut::<LANES>();
    let nodes = sines.iter().zip(cosines).zip(heights).zip(weights);
    for ((((sines, cosines), heights), weights), (met, shares)) in nodes.zip(cosines_met.iter_mut().zip(shares)) {
        for lane in 0..LANES {
            let numbers = [sines[lane], cosines[lane], heights[lane], weights[lane]];
            let (h, cosine, part) = node::<GGX>(&facets, i, numbers);
            let share = part * away::<GGX>(&facets, i, hidden, h);
            met[lane] = cosine;
            shares[lane] = if cosine > 0.0 { share } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares by slopes of facets, without drawing them: the density and what is seen of them, on a grid.
    fn by_slopes(facets: Facets, i: Vec3, ratio: f64) -> [f64; 2] {
        let (n, m) = (1200, 600);
        let mut sums = [0.0; 2];
        for a in 0..n {
            // Heights of facets, finer towards both ends: dΩ = dφ dz, dz = 6 u (1 − u) du.
            let u = (f64::from(a) + 0.5) / f64::from(n);
            let z = 1.0 - u * u * (3.0 - 2.0 * u);
            let r = ((1.0 - z) * (1.0 + z)).sqrt();
            let solid = 6.0 * u * (1.0 - u) / f64::from(n) * std::f64::consts::TAU / f64::from(m);
            for b in 0..m {
                let (s, c) = sin_cos_turns((f64::from(b) + 0.5) / f64::from(m));
                let h = Vec3::new(r * c, r * s, z);
                let cosine = i.dot(h);
                if cosine <= 0.0 {
                    continue;
                }
                let (f, light) = (fresnel(cosine, 1.0, ratio), facets.density(h) * cosine / i.z * solid);
                let o = mirrored(i, h);
                if o.z > 0.0 {
                    let seen = i.z * o.z * Facets::seen_by_both(i.z, o.z, [facets.hidden(i), facets.hidden(o)]);
                    sums[0] += f.reflectance * light * seen;
                }
                let o = refracted(i, h, cosine, f.cosine, ratio);
                if f.reflectance < 1.0 && o.z < 0.0 {
                    let up = Vec3::new(o.x, o.y, -o.z);
                    let seen = Facets::seen_through(i.z, up.z, [facets.hidden(i), facets.hidden(up)]);
                    sums[1] += (1.0 - f.reflectance) * light * seen;
                }
            }
        }
        sums
    }

    #[test]
    fn shares_are_those_of_a_grid_of_slopes() {
        for (alpha, ggx) in [
            ([0.3, 0.3], true),
            ([0.5, 0.5], false),
            ([0.6, 0.2], true),
            ([0.2, 0.5], false),
        ] {
            let facets = Facets::new(alpha, ggx).expect("sound");
            let lattice = FacetLattice::new(facets);
            for (i, ratio) in [
                (Vec3::new(0.48, 0.36, 0.8), 1.5),
                (Vec3::new(-0.3, 0.9, 0.316_227_766), 1.5),
                (Vec3::new(0.48, 0.64, 0.6), 1.0 / 1.5),
            ] {
                let i = i.normalized();
                let (found, known) = (
                    lattice.reflected_and_transmitted(i, ratio, true),
                    by_slopes(facets, i, ratio),
                );
                for k in 0..2 {
                    assert!(
                        (found[k] - known[k]).abs() < 3e-4,
                        "{alpha:?} {ggx} {ratio}: {found:?} {known:?}"
                    );
                }
                let reflected = lattice.reflected_and_transmitted(i, ratio, false);
                assert_eq!(reflected, [found[0], 0.0]);
                let (mut cosines, mut shares) = (Vec::new(), Vec::new());
                lattice.mirrors(i, &mut cosines, &mut shares);
                let by_facet: f64 = cosines
                    .iter()
                    .zip(&shares)
                    .filter(|(_, share)| **share > 0.0)
                    .map(|(cosine, share)| fresnel(*cosine, 1.0, ratio).reflectance * share)
                    .sum();
                assert!((by_facet - found[0]).abs() < 1e-12, "{by_facet} {found:?}");
            }
        }
    }
}
