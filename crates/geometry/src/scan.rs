//! The statistics of a ray set in one pass.

use std::ops::ControlFlow;

use multiversion::multiversion;

use crate::pass::{Sums, over_all_rays};
use crate::pass_account::PassAccount;
use crate::ray_batch::{Defect, LANES, RayBatch};
use crate::source::RaySource;

/// What a ray set amounts to. Sums run over the usable rays, in file order by batches.
#[derive(Clone, Debug)]
pub struct Scan {
    /// The flux account.
    pub tally: PassAccount,
    /// Smallest and largest flux of a usable ray.
    pub flux_range: [f64; 2],
    /// Smallest and largest coordinate on each axis \[mm\].
    pub bounds: [[f64; 2]; 3],
    /// Σ w x \[flux · mm\].
    pub weighted_position: [f64; 3],
    /// Σ w k.
    pub weighted_direction: [f64; 3],
    /// Σ w k kᵀ as xx, xy, xz, yy, yz, zz.
    pub weighted_outer: [f64; 6],
    /// Σ w (1 − k kᵀ) x, the right-hand side of the virtual focus \[flux · mm\].
    pub focus_rhs: [f64; 3],
}

impl Default for Scan {
    fn default() -> Self {
        Self {
            tally: PassAccount::default(),
            flux_range: [f64::INFINITY, f64::NEG_INFINITY],
            bounds: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            weighted_position: [0.0; 3],
            weighted_direction: [0.0; 3],
            weighted_outer: [0.0; 6],
            focus_rhs: [0.0; 3],
        }
    }
}

impl Sums for Scan {
    fn add_block(&mut self, batch: &RayBatch) {
        self.tally.add_block(batch);
        let n = batch.len;
        let position = batch.position.each_ref().map(|axis| &axis[..n]);
        let direction = batch.direction.each_ref().map(|axis| &axis[..n]);
        let found = lanes(
            position,
            direction,
            &batch.flux[..n],
            batch.defects == [0; Defect::COUNT],
        );
        let ranges = self.bounds.iter_mut().chain(std::iter::once(&mut self.flux_range));
        for ((range, low), high) in ranges.zip(found.low).zip(found.high) {
            widen_by(
                range,
                low.into_iter().fold(f64::INFINITY, f64::min),
                high.into_iter().fold(f64::NEG_INFINITY, f64::max),
            );
        }
        let targets = self.weighted_position.iter_mut().chain(&mut self.weighted_direction);
        let targets = targets.chain(&mut self.focus_rhs).chain(&mut self.weighted_outer);
        for (target, sum) in targets.zip(found.sums) {
            *target += sum.into_iter().sum::<f64>();
        }
    }

    fn merge(&mut self, other: &Self) {
        self.tally.merge(&other.tally);
        for (range, o) in
            std::iter::once((&mut self.flux_range, other.flux_range)).chain(self.bounds.iter_mut().zip(other.bounds))
        {
            widen_by(range, o[0], o[1]);
        }
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.weighted_position, &other.weighted_position);
        add(&mut self.weighted_direction, &other.weighted_direction);
        add(&mut self.weighted_outer, &other.weighted_outer);
        add(&mut self.focus_rhs, &other.focus_rhs);
    }
}

fn widen_by(range: &mut [f64; 2], low: f64, high: f64) {
    range[0] = range[0].min(low);
    range[1] = range[1].max(high);
}

/// One value for each lane.
type Lane<T> = [T; LANES];

/// What a block amounts to, lane by lane.
struct Lanes {
    /// Σ w x, Σ w k, Σ w (x − (x·k) k) and Σ w k kᵀ; rays that cannot be used have no flux.
    sums: [Lane<f64>; 15],
    /// Smallest coordinates and flux of the usable rays.
    low: [Lane<f64>; 4],
    /// Largest ones.
    high: [Lane<f64>; 4],
}

/// Lanes that are summed at a time: so few that their sums stay in registers.
const GROUP: usize = 8;

/// One value for each of them.
type Group<T> = [T; GROUP];

/// The arrays of a block.
const PX: usize = 0;
const PY: usize = 1;
const PZ: usize = 2;
const KX: usize = 3;
const KY: usize = 4;
const KZ: usize = 5;
const W: usize = 6;

/// Its rays in rows of lanes: whole ones, and the last one with zeros behind its end.
struct Rows<'a> {
    whole: [&'a [Lane<f64>]; 7],
    last: [Lane<f64>; 7],
}

impl<'a> Rows<'a> {
    fn new(arrays: [&'a [f64]; 7]) -> Self {
        let parted = arrays.map(|array| array.as_chunks::<LANES>());
        Self {
            whole: parted.map(|(whole, _)| whole),
            last: parted.map(|(_, rest)| std::array::from_fn(|lane| rest.get(lane).copied().unwrap_or(0.0))),
        }
    }

    /// Goes through the whole rows, for the lanes of one group: `add` is given one row of the arrays that it wants.
    #[inline(always)]
    fn whole<const ARRAYS: usize>(
        &self,
        group: usize,
        wanted: [usize; ARRAYS],
        mut add: impl FnMut([&Group<f64>; ARRAYS]),
    ) {
        let count = self.whole[0].len();
        let whole = wanted.map(|array| &self.whole[array][..count]);
        for row in 0..count {
            add(whole.map(|rows| of_group(&rows[row], group)));
        }
    }

    /// Sums over all rows, likewise.
    #[inline(always)]
    fn sums<const SUMS: usize, const ARRAYS: usize>(
        &self,
        group: usize,
        wanted: [usize; ARRAYS],
        add: impl Fn(&mut [Group<f64>; SUMS], [&Group<f64>; ARRAYS]),
    ) -> [Group<f64>; SUMS] {
        let mut sums = [[0.0; GROUP]; SUMS];
        self.whole(group, wanted, |row| add(&mut sums, row));
        add(&mut sums, wanted.map(|array| of_group(&self.last[array], group)));
        sums
    }

    /// Smallest and largest values of one array over the usable rays.
    #[inline(always)]
    fn extremes(&self, group: usize, array: usize, all: bool) -> [Group<f64>; 2] {
        let mut found = [[f64::INFINITY; GROUP], [f64::NEG_INFINITY; GROUP]];
        if all {
            let [low, high] = &mut found;
            self.whole(group, [array], |[value]| {
                for lane in 0..GROUP {
                    low[lane] = if value[lane] < low[lane] {
                        value[lane]
                    } else {
                        low[lane]
                    };
                    high[lane] = if value[lane] > high[lane] {
                        value[lane]
                    } else {
                        high[lane]
                    };
                }
            });
        }
        let [low, high] = &mut found;
        let mut add = |[value, x, y, z]: [&Group<f64>; 4]| {
            for lane in 0..GROUP {
                let (value, usable) = (value[lane], is_usable([x[lane], y[lane], z[lane]]));
                low[lane] = if usable & (value < low[lane]) { value } else { low[lane] };
                high[lane] = if usable & (value > high[lane]) {
                    value
                } else {
                    high[lane]
                };
            }
        };
        let wanted = [array, KX, KY, KZ];
        if !all {
            self.whole(group, wanted, &mut add);
        }
        add(wanted.map(|array| of_group(&self.last[array], group)));
        found
    }
}

/// Adds a term of each ray, times its flux, to the sum of its lane.
#[inline(always)]
fn add_up(sum: &mut Group<f64>, w: &Group<f64>, term: impl Fn(usize) -> f64) {
    for (lane, sum) in sum.iter_mut().enumerate() {
        *sum += w[lane] * term(lane);
    }
}

/// Whether a ray has a direction: one that cannot be used has none.
#[inline(always)]
fn is_usable([x, y, z]: [f64; 3]) -> bool {
    (x != 0.0) | (y != 0.0) | (z != 0.0)
}

/// The lanes of one group.
#[inline(always)]
fn of_group<T>(lanes: &Lane<T>, group: usize) -> &Group<T> {
    &lanes.as_chunks::<GROUP>().0[group]
}

/// Sums and extremes of a block. `all` says that all its rays can be used.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn lanes(position: [&[f64]; 3], direction: [&[f64]; 3], flux: &[f64], all: bool) -> Lanes {
    let [[px, py, pz], [kx, ky, kz]] = [position, direction];
    let rows = Rows::new([px, py, pz, kx, ky, kz, flux]);
    let mut found = Lanes {
        sums: [[0.0; LANES]; 15],
        low: [[f64::INFINITY; LANES]; 4],
        high: [[f64::NEG_INFINITY; LANES]; 4],
    };
    for g in 0..LANES / GROUP {
        let own = g * GROUP..(g + 1) * GROUP;
        let mut put = |at: usize, sums: &[Group<f64>]| {
            for (into, sum) in found.sums[at..].iter_mut().zip(sums) {
                into[own.clone()].copy_from_slice(sum);
            }
        };
        let weighted = |sums: &mut [Group<f64>; 3], [x, y, z, w]: [&Group<f64>; 4]| {
            for (sum, value) in sums.iter_mut().zip([x, y, z]) {
                add_up(sum, w, |lane| value[lane]);
            }
        };
        put(0, &rows.sums(g, [PX, PY, PZ, W], weighted));
        put(3, &rows.sums(g, [KX, KY, KZ, W], weighted));
        let across = |sums: &mut [Group<f64>; 3], [px, py, pz, kx, ky, kz, w]: [&Group<f64>; 7]| {
            let along: Group<f64> =
                std::array::from_fn(|lane| px[lane] * kx[lane] + py[lane] * ky[lane] + pz[lane] * kz[lane]);
            for (sum, (p, k)) in sums.iter_mut().zip([(px, kx), (py, ky), (pz, kz)]) {
                add_up(sum, w, |lane| p[lane] - along[lane] * k[lane]);
            }
        };
        put(6, &rows.sums(g, [PX, PY, PZ, KX, KY, KZ, W], across));
        let outer = |sums: &mut [Group<f64>; 6], [x, y, z, w]: [&Group<f64>; 4]| {
            for (sum, (a, b)) in sums.iter_mut().zip([(x, x), (x, y), (x, z), (y, y), (y, z), (z, z)]) {
                add_up(sum, w, |lane| a[lane] * b[lane]);
            }
        };
        put(9, &rows.sums(g, [KX, KY, KZ, W], outer));
        for (k, array) in [PX, PY, PZ, W].into_iter().enumerate() {
            let [low, high] = rows.extremes(g, array, all);
            found.low[k][own.clone()].copy_from_slice(&low);
            found.high[k][own.clone()].copy_from_slice(&high);
        }
    }
    found
}

/// Scans a whole source. Ends early, with the sums so far, if `progress` breaks.
pub fn scan(source: &impl RaySource, threads: usize, progress: impl FnMut(u64) -> ControlFlow<()>) -> Scan {
    over_all_rays(source, threads, progress)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Float, Layout, RayTable};

    /// x, y, z, the direction and the flux, one after the other.
    const LAYOUT: Layout = Layout {
        stride: 56,
        position: Some(0),
        direction: 24,
        flux: 48,
        float: Float::F64,
        colour: None,
        length_scale: 1.0,
    };

    #[test]
    fn sums_of_an_asymmetric_set_match_a_plain_loop() {
        let n = 200_001_u64;
        let rays: Vec<[f64; 7]> = (0..n)
            .map(|i| {
                let t = i as f64 / n as f64;
                let k = [(7.0 * t).sin(), 0.3 + t, 1.0 - 0.5 * t];
                let norm = (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]).sqrt();
                [
                    3.0 * t - 1.0,
                    t * t,
                    0.1 - t,
                    k[0] / norm,
                    k[1] / norm,
                    k[2] / norm,
                    1.0 + t,
                ]
            })
            .collect();
        let bytes: Vec<u8> = rays.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let table = RayTable::new(&bytes, LAYOUT).expect("valid");
        let scanned = scan(&table, 2, |_| ControlFlow::Continue(()));
        let plain = |f: &dyn Fn(&[f64; 7]) -> f64| rays.iter().map(f).sum::<f64>();
        assert_eq!(scanned.tally.rays, n);
        assert!((scanned.tally.flux / plain(&|r| r[6]) - 1.0).abs() < 1e-12);
        assert!((scanned.tally.flux_squared / plain(&|r| r[6] * r[6]) - 1.0).abs() < 1e-12);
        assert!((scanned.weighted_outer[4] / plain(&|r| r[6] * r[4] * r[5]) - 1.0).abs() < 1e-12);
        assert!((scanned.weighted_position[1] / plain(&|r| r[6] * r[1]) - 1.0).abs() < 1e-12);
        let rhs = plain(&|r| r[6] * (r[2] - (r[0] * r[3] + r[1] * r[4] + r[2] * r[5]) * r[5]));
        assert!((scanned.focus_rhs[2] / rhs - 1.0).abs() < 1e-12);
        assert!((scanned.bounds[0][0] + 1.0).abs() < 1e-15 && (scanned.flux_range[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn rays_that_cannot_be_used_widen_nothing() {
        // Eleven rays: one lane is longer than others. Every ray lies off the origin, where defective ones are put.
        let ray = |i: usize| {
            let t = i as f64;
            let spoilt = [f64::NAN, 0.0, f64::INFINITY][i % 3];
            let flux = [2.0, 0.0, 3.0 + t][i % 3];
            let k = if i == 4 { 0.0 } else { 0.6 };
            let z = if i % 4 == 3 { spoilt } else { 0.8 };
            [
                3.0 + t,
                -2.0 - t,
                5.0,
                0.0,
                k,
                if i == 4 { 0.0 } else { z },
                if i == 8 { -1.0 } else { flux },
            ]
        };
        let bytes: Vec<u8> = (0..11).flat_map(ray).flat_map(f64::to_le_bytes).collect();
        let table = RayTable::new(&bytes, LAYOUT).expect("valid");
        let scanned = scan(&table, 1, |_| ControlFlow::Continue(()));
        // 3: not a number; 4: no direction; 8: negative flux. That z is 0 at 7 is no defect.
        assert_eq!(scanned.tally.defects, [1, 1, 1]);
        assert_eq!(scanned.bounds, [[3.0, 13.0], [-12.0, -2.0], [5.0, 5.0]]);
        assert_eq!((scanned.flux_range, scanned.tally.dark), ([0.0, 8.0], 3));
        let used = [0, 1, 2, 5, 6, 7, 9, 10].map(ray);
        let first: f64 = used.iter().map(|r| r[6] * r[0]).sum();
        assert!((scanned.weighted_position[0] / first - 1.0).abs() < 1e-14);
    }
}
