//! Shares of light that leave a surface, tabled over the direction of incidence.

use std::f64::consts::FRAC_PI_2;

use etendue_math::Vec3;
use etendue_math::special::cube_root;

use super::gauss::GAUSS;

/// Parts of a quarter turn for which shares that depend on azimuth are tabled.
const TURNS: usize = 16;

/// Heights for which shares are tabled: the cubes of even steps from 0 to 1, since they change fastest near the surface.
const HEIGHTS: usize = 64;

/// Height below which shares are not known: their limit along the surface is approached with the logarithm only.
pub const LOWEST: f64 = 1.0 / (HEIGHTS * HEIGHTS * HEIGHTS) as f64;

/// N shares over the height of the direction of incidence above the surface and, if they depend on it, over azimuth from the
/// axis, alike in all four quarters; of third order between the nodes.
#[derive(Clone, Debug)]
pub struct Albedo<const N: usize> {
    /// Height by height; azimuths within.
    values: Vec<Vec<[f64; N]>>,
}

/// Lagrange's cubic through four of the nodes 0 … `last` at a place among them: the nodes, mirrored at both ends where
/// the function is even there, and their weights.
#[inline]
fn cubic(place: f64, last: usize, even: bool) -> [(usize, f64); 4] {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 0 to the last node"
    )]
    let mut cell = (place as usize).min(last - 1);
    if !even {
        // The first node is below the lowest height.
        cell = cell.clamp(2, last - 2);
    }
    let t = place - cell as f64;
    let weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ];
    let before = if cell == 0 { 1 } else { cell - 1 };
    let beyond = if cell + 2 > last { last - 1 } else { cell + 2 };
    let nodes = [before, cell, cell + 1, beyond];
    std::array::from_fn(|k| (nodes[k], weights[k]))
}

/// One share over the height of the direction of incidence alone, in steps so fine that it is linear within them to 10⁻⁶.
#[derive(Clone, Debug)]
pub struct ByHeight {
    /// Over even steps of the square root of the height.
    values: Vec<f64>,
}

/// Steps of [`ByHeight`].
const FINE: usize = 4096;

impl ByHeight {
    /// From the share at a height.
    pub fn new(of: impl Fn(f64) -> f64) -> Self {
        let at = |k: usize| {
            let root = k as f64 / FINE as f64;
            of(root * root)
        };
        Self {
            values: (0..=FINE).map(at).collect(),
        }
    }

    /// The share of light from a direction, whichever side it is on.
    #[inline]
    pub fn at(&self, incident: Vec3) -> f64 {
        let place = incident.z.abs().min(1.0).sqrt() * FINE as f64;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to the last node"
        )]
        let cell = (place as usize).min(FINE - 1);
        let [a, b] = [self.values[cell], self.values[cell + 1]];
        a + (place - cell as f64) * (b - a)
    }
}

/// What a function is at the directions that shares are tabled for, all in front: height by height; azimuths within, if it depends
/// on them.
pub fn at_nodes<T: Send>(turning: bool, of: impl Fn(Vec3) -> T + Sync) -> Vec<Vec<T>> {
    let row = &|k: usize| -> Vec<T> {
        let height = (k as f64 / HEIGHTS as f64).powi(3);
        let across = ((1.0 - height) * (1.0 + height)).sqrt();
        let turns = if turning { TURNS } else { 0 };
        let at = |k: usize| {
            let (s, c) = (FRAC_PI_2 * k as f64 / TURNS as f64).sin_cos();
            of(Vec3::new(across * c, across * s, height))
        };
        (0..=turns).map(at).collect()
    };
    // The rows take long and do not depend on each other.
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(HEIGHTS);
    let every = &|first: usize| {
        (first..HEIGHTS)
            .step_by(threads)
            .map(|k| row(k + 1))
            .collect::<Vec<_>>()
    };
    let mut dealt: Vec<_> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..threads).map(|first| scope.spawn(move || every(first))).collect();
        let ended = started.into_iter().map(std::thread::ScopedJoinHandle::join);
        ended
            .map(|rows| {
                rows.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
                    .into_iter()
            })
            .collect()
    });
    (0..HEIGHTS).filter_map(|k| dealt[k % threads].next()).collect()
}

impl<const N: usize> Albedo<N> {
    /// From the shares at a direction in front.
    pub fn new(turning: bool, of: impl Fn(Vec3) -> [f64; N] + Sync) -> Self {
        Self::from_nodes(at_nodes(turning, of))
    }

    /// From the shares at the nodes, as [`at_nodes`] has them.
    pub fn from_nodes(mut values: Vec<Vec<[f64; N]>>) -> Self {
        // Along the surface as at the lowest height above it.
        values.insert(0, values[0].clone());
        Self { values }
    }

    /// The shares of light from a direction, whichever side it is on.
    #[inline]
    pub fn at(&self, incident: Vec3) -> [f64; N] {
        let place = cube_root(incident.z.abs().clamp(LOWEST, 1.0)) * HEIGHTS as f64;
        let mut sum = [0.0; N];
        for (node, weight) in cubic(place, HEIGHTS, false) {
            let row = Self::along(&self.values[node], incident);
            for k in 0..N {
                sum[k] += weight * row[k];
            }
        }
        sum
    }

    fn along(row: &[[f64; N]], incident: Vec3) -> [f64; N] {
        if row.len() == 1 {
            return row[0];
        }
        let place = incident.y.abs().atan2(incident.x.abs()) / FRAC_PI_2 * TURNS as f64;
        let nodes = cubic(place, TURNS, true);
        std::array::from_fn(|k| nodes.iter().map(|(node, weight)| weight * row[*node][k]).sum())
    }

    /// Means over diffuse light: ∫ share cos θ dΩ/π.
    pub fn means(&self) -> [f64; N] {
        let mean = |row: &[[f64; N]], k: usize| {
            if row.len() == 1 {
                return row[0][k];
            }
            // The trapezoidal rule is that of a whole turn.
            let inner: f64 = row[1..TURNS].iter().map(|v| v[k]).sum();
            (inner + 0.5 * (row[0][k] + row[TURNS][k])) / TURNS as f64
        };
        let rows: Vec<[f64; N]> = self
            .values
            .iter()
            .map(|row| std::array::from_fn(|k| mean(row, k)))
            .collect();
        // 2 ∫ E h dh with h = u³; the rule of Gauss and Legendre with five nodes is exact for each cell.
        let mut sum = [0.0; N];
        for cell in 0..HEIGHTS {
            for (x, w) in GAUSS {
                let place = cell as f64 + x;
                let u = place / HEIGHTS as f64;
                for (node, weight) in cubic(place, HEIGHTS, false) {
                    for k in 0..N {
                        sum[k] += w * weight * rows[node][k] * 6.0 * u.powi(5) / HEIGHTS as f64;
                    }
                }
            }
        }
        sum
    }

    /// The least of a function of the shares at the nodes.
    pub fn least(&self, of: impl Fn(&[f64; N]) -> f64) -> f64 {
        self.values.iter().flatten().map(of).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_means_are_those_of_the_function() {
        let of = |d: Vec3| [0.5 + 0.3 * d.z * d.z + 0.1 * (d.x * d.x - d.y * d.y), d.z];
        let table = Albedo::new(true, of);
        for (x, y, z) in [
            (0.6, 0.0, 0.8),
            (-0.48, 0.36, 0.8),
            (0.0, 1.0, 0.0),
            (0.09, -0.12, -0.988_685_997),
        ] {
            let (found, expected) = (table.at(Vec3::new(x, y, z)), of(Vec3::new(x, y, f64::abs(z))));
            assert!(
                (0..2).all(|k| (found[k] - expected[k]).abs() < 5e-6),
                "{found:?} {expected:?}"
            );
        }
        let means = table.means();
        assert!(
            (means[0] - 0.65).abs() < 1e-6 && (means[1] - 2.0 / 3.0).abs() < 1e-6,
            "{means:?}"
        );
        assert!((table.least(|v| v[0]) - 0.4).abs() < 1e-9);
    }
}
