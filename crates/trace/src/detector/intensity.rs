//! The far field between nodes: every ray is shared by the nodes around its direction, as who reads the table shares it.
//!
//! A table of intensity stands for the function that is linear in γ between rows and in C between the nodes of a row. Its
//! basis are the hats of the nodes, which add up to 1 everywhere. Who gives each node its hat's share of every ray, and
//! divides by the integral of the hat, has a function with exactly the flux of the rays.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue_math::Vec3;

use super::kind::{Kind, Light, Recorded, Wants};

/// Nodes of the far field: rows of γ, and the nodes C of each row.
#[derive(Clone, Debug, PartialEq)]
pub struct FarFieldNodes {
    /// From 0 to π, rising.
    gamma: Vec<f64>,
    /// Of each row, from 0 and below 2π, rising; one node stands for all C.
    c: Vec<Vec<f64>>,
    /// Number of the first node of each row; behind the last one, of all.
    first: Vec<u32>,
}

impl FarFieldNodes {
    /// Nodes in radians; None if they do not rise, do not begin where they must, or are too many.
    #[must_use]
    pub fn new(gamma: Vec<f64>, c: Vec<Vec<f64>>) -> Option<Self> {
        let rise = |angles: &[f64]| angles.first() == Some(&0.0) && angles.windows(2).all(|pair| pair[0] < pair[1]);
        let whole = gamma.len() >= 2 && rise(&gamma) && gamma[gamma.len() - 1] >= PI;
        if !whole || c.len() != gamma.len() || !c.iter().all(|row| rise(row) && row[row.len() - 1] < 2.0 * PI) {
            return None;
        }
        let mut first = vec![0_u32];
        for row in &c {
            let end = first[first.len() - 1] as usize + row.len();
            first.push(u32::try_from(end).ok().filter(|n| *n < u32::MAX)?);
        }
        Some(Self { gamma, c, first })
    }

    /// Number of nodes, and one cell more, for all rays together.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.total() as usize + 1
    }

    /// The cell of all rays together.
    fn total(&self) -> u32 {
        self.first[self.gamma.len()]
    }

    /// Gives `put` the nodes around a direction and their shares, which add up to 1; then the cell of all rays.
    #[allow(clippy::cast_possible_truncation, reason = "rows have fewer than 2^32 nodes")]
    pub fn share(&self, d: Vec3, mut put: impl FnMut(u32, f64)) {
        let (gamma, c) = (d.x.hypot(d.y).atan2(d.z), d.y.atan2(d.x));
        let c = if c < 0.0 { c + 2.0 * PI } else { c };
        let row = (self.gamma.partition_point(|g| *g <= gamma).max(1) - 1).min(self.gamma.len() - 2);
        let up = ((gamma - self.gamma[row]) / (self.gamma[row + 1] - self.gamma[row])).clamp(0.0, 1.0);
        for (row, share) in [(row, 1.0 - up), (row + 1, up)] {
            if share == 0.0 {
                continue;
            }
            let (nodes, first) = (&self.c[row], self.first[row]);
            let before = nodes.partition_point(|node| *node <= c).max(1) - 1;
            let after = (before + 1) % nodes.len();
            if after == before {
                put(first, share);
                continue;
            }
            let end = if after == 0 { 2.0 * PI } else { nodes[after] };
            let on = ((c - nodes[before]) / (end - nodes[before])).clamp(0.0, 1.0);
            put(first + before as u32, share * (1.0 - on));
            if on > 0.0 {
                put(first + after as u32, share * on);
            }
        }
        put(self.total(), 1.0);
    }
}

/// The far field: flux of what escapes, shared by the nodes around its direction.
#[derive(Clone, Debug)]
pub struct Intensity(pub Arc<FarFieldNodes>);

impl Kind for Intensity {
    fn cells(&self) -> usize {
        self.0.cells()
    }

    fn wants(&self) -> Wants {
        Wants::ESCAPES
    }

    fn escape(&self, light: &Light<'_>, out: &mut Recorded) {
        let state = light.state;
        self.0.share(light.direction, |node, share| {
            out.contribute(node, state, share * state.flux);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes() -> FarFieldNodes {
        let degrees = |angles: &[f64]| angles.iter().map(|a| a.to_radians()).collect::<Vec<_>>();
        let rows = [
            vec![0.0],
            degrees(&[0.0, 90.0, 120.0, 270.0]),
            degrees(&[0.0, 180.0]),
            vec![0.0],
        ];
        FarFieldNodes::new(vec![0.0, 0.5, 2.0, PI], rows.to_vec()).expect("sound")
    }

    fn found(gamma: f64, c: f64) -> Vec<(u32, f64)> {
        let c = c.to_radians();
        let mut shares = vec![];
        nodes().share(
            Vec3::new(gamma.sin() * c.cos(), gamma.sin() * c.sin(), gamma.cos()),
            |node, share| shares.push((node, share)),
        );
        shares
    }

    #[test]
    fn shares_are_those_of_linear_interpolation_and_add_up() {
        let expected = [
            // Between rows 1 and 2, in row 1 between 270° and 0°, in row 2 between 180° and 0°.
            (
                1.25,
                300.0,
                vec![
                    (4, 1.0 / 3.0),
                    (1, 1.0 / 6.0),
                    (6, 1.0 / 6.0),
                    (5, 1.0 / 3.0),
                    (7 + 1, 1.0),
                ],
            ),
            (0.25, 105.0, vec![(0, 0.5), (2, 0.25), (3, 0.25), (8, 1.0)]),
            (3.0, 10.0, vec![]),
        ];
        for (gamma, c, shares) in expected {
            let got = found(gamma, c);
            let sum: f64 = got.iter().map(|(_, share)| share).sum();
            assert!((sum - 2.0).abs() < 1e-12, "{got:?}");
            for ((node, share), (a, b)) in got.iter().zip(&shares) {
                assert!(node == a && (share - b).abs() < 1e-12, "{got:?}");
            }
        }
        assert_eq!(nodes().cells(), 9);
    }

    #[test]
    fn nodes_that_are_none_are_refused() {
        assert!(FarFieldNodes::new(vec![0.0, PI], vec![vec![0.0]]).is_none());
        assert!(FarFieldNodes::new(vec![0.0, 1.0], vec![vec![0.0], vec![0.0]]).is_none());
        assert!(FarFieldNodes::new(vec![0.0, PI], vec![vec![0.0], vec![0.0, 7.0]]).is_none());
        assert!(FarFieldNodes::new(vec![0.0, PI], vec![vec![0.0], vec![]]).is_none());
    }
}
