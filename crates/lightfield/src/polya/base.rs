//! Base measures: what the tree falls back on where the data say nothing.

use etendue_math::special::{ln, ln_gamma};
use multiversion::multiversion;

use super::chunk::{Busy, GROUP};
use super::data::Masses;
use super::grid::Grid;
use super::level::{Level, Step};

/// A base measure over the cells of a grid: a product of factors, each over some neighbouring axes.
#[derive(Clone, Debug)]
pub(super) struct Base {
    /// None of them: equal mass in all cells.
    factors: Vec<Factor>,
}

/// For each level of a grid, for each of its splits or origins: one number per box.
type Table = Vec<Vec<Vec<f64>>>;

/// The share of its lower half in every dyadic box of a few axes.
#[derive(Clone, Debug)]
struct Factor {
    axes: std::ops::Range<usize>,
    grid: Grid,
    shares: Table,
    /// The share of each box in each of those that it is half of.
    halves: Table,
}

/// What the evidence of a split owes to the base measure alone, for one concentration: worked out once per box of a factor
/// instead of once per box of the whole grid.
pub(super) struct SplitTerms {
    tables: Vec<[Table; 3]>,
    /// Where the halves are equal.
    even: [f64; 3],
}

/// Shares of the lower halves of some boxes, and the terms of their splits.
pub(super) struct Splits<'a> {
    /// p
    pub share: &'a mut [f64],
    /// ln Γ(c) − ln Γ(c p) − ln Γ(c (1 − p)), ln p and ln (1 − p); where p is 0 or 1 no number that means anything.
    pub terms: [&'a mut [f64]; 3],
}

fn terms_of(c: f64, share: f64) -> [f64; 3] {
    let p = if share > 0.0 && share < 1.0 { share } else { 0.5 };
    [
        ln_gamma(c) - ln_gamma(c * p) - ln_gamma(c * (1.0 - p)),
        ln(p),
        ln(1.0 - p),
    ]
}

impl Base {
    /// The product of the factors' masses, whose cells are moved cyclically by so many steps along each axis.
    ///
    /// A box without mass has the share ½. Factors of equal masses are left out.
    pub fn product(grid: &Grid, factors: &[Masses<'_>], steps: &[usize]) -> Self {
        let mut first = 0;
        let mut built = Vec::new();
        for (axes, mass) in factors {
            let axes = first..first + axes;
            first = axes.end;
            if mass.iter().all(|m| *m == mass[0]) {
                continue;
            }
            let own = grid.of_axes(axes.clone());
            let mut placed = vec![0.0; mass.len()];
            own.arrange(mass, &steps[axes.clone()], &mut placed);
            let shares = shares(&own, placed);
            built.push(Factor {
                axes,
                halves: halves(&own, &shares),
                grid: own,
                shares,
            });
        }
        Self { factors: built }
    }

    pub(super) const fn is_uniform(&self) -> bool {
        self.factors.is_empty()
    }

    /// The terms of all splits for the concentration `c`.
    pub(super) fn split_terms(&self, c: f64) -> SplitTerms {
        let of_factor = |factor: &Factor| {
            [0, 1, 2].map(|k| {
                let of_box = |share: &f64| terms_of(c, *share)[k];
                let of_level = |splits: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
                    splits.iter().map(|boxes| boxes.iter().map(of_box).collect()).collect()
                };
                factor.shares.iter().map(of_level).collect()
            })
        };
        SplitTerms {
            tables: self.factors.iter().map(of_factor).collect(),
            even: terms_of(c, 0.5),
        }
    }

    /// For boxes `first..first + n` of a level, n a power of two: the base share of each in the box that it is half of along
    /// `axis`.
    pub(super) fn half_shares(&self, level: &Level, axis: usize, first: usize, out: &mut [f64]) {
        match self.factors.iter().find(|f| f.axes.contains(&axis)) {
            None => out.fill(0.5),
            Some(factor) => {
                let id = factor.level_of(level);
                let origins = &factor.grid.levels()[id].origins;
                let origin = origins.iter().position(|s| s.axis == axis - factor.axes.start);
                let table = &factor.halves[id][origin.expect("it is half of something")];
                deal_one(&factor.entries(level, id, first), table, out);
            }
        }
    }

    /// For as many boxes, split along an axis, the base share of the lower half and the terms of the splits: of those groups of
    /// boxes that are busy.
    pub(super) fn splits(
        &self,
        terms: &SplitTerms,
        (level, axis, first): (&Level, usize, usize),
        busy: &Busy,
        out: &mut Splits<'_>,
    ) {
        let [prior, log_lower, log_upper] = &mut out.terms;
        match self.factors.iter().position(|f| f.axes.contains(&axis)) {
            None => {
                out.share.fill(0.5);
                for (row, value) in [prior, log_lower, log_upper].into_iter().zip(terms.even) {
                    row.fill(value);
                }
            }
            Some(index) => {
                let factor = &self.factors[index];
                let id = factor.level_of(level);
                let splits = &factor.grid.levels()[id].splits;
                let split = splits.iter().position(|s| s.axis == axis - factor.axes.start);
                let split = split.expect("the axis can be split");
                let [a, b, c] = &terms.tables[index];
                let tables = [&factor.shares, a, b, c].map(|table| &table[id][split][..]);
                let rows = [&mut *out.share, prior, log_lower, log_upper];
                deal_four(&factor.entries(level, id, first), tables, busy, rows);
            }
        }
    }
}

impl Factor {
    /// The number of the factor's own level that a level of the whole grid belongs to.
    fn level_of(&self, level: &Level) -> usize {
        let halvings = &level.halvings[self.axes.clone()];
        halvings
            .iter()
            .zip(self.grid.depths())
            .fold(0, |id, (h, d)| id * (*d as usize + 1) + *h as usize)
    }

    /// Where boxes `first..` of a level of the whole grid have their entries in the tables of the factor's level `id`.
    fn entries(&self, level: &Level, id: usize, first: usize) -> Entries {
        let own = &self.grid.levels()[id];
        let bits = own.shift_in_tile(0);
        Entries {
            first,
            behind: level.shift_in_tile(self.axes.end),
            behind_tile: level.shift_of_tile(self.axes.end),
            within: (1 << bits) - 1,
            tile: (own.boxes >> bits) - 1,
            bits,
            in_tile: level.shift_in_tile(0),
        }
    }
}

/// Where boxes have their entries in a table of a factor. Of a box's number, some bits are those for the place within the tile
/// along the factor's axes, and some those for the tile.
struct Entries {
    first: usize,
    /// Bits behind the former and the latter.
    behind: u32,
    behind_tile: u32,
    /// Their largest values.
    within: usize,
    tile: usize,
    /// Bits for the place within the tile along the factor's axes, and along all axes.
    bits: u32,
    in_tile: u32,
}

impl Entries {
    #[inline(always)]
    const fn of(&self, number: usize) -> usize {
        (((number >> self.behind_tile) & self.tile) << self.bits) | ((number >> self.behind) & self.within)
    }

    /// Deals the entries of some tables out to groups of boxes, one row for each table.
    #[inline(always)]
    fn deal<const N: usize>(&self, tables: [&[f64]; N], groups: impl Iterator<Item = usize>, rows: [&mut [f64]; N]) {
        const BITS: u32 = GROUP.ilog2();
        let n = rows[0].len();
        if n < GROUP {
            for (table, row) in tables.into_iter().zip(rows) {
                (0..n).for_each(|i| row[i] = table[self.of(self.first + i)]);
            }
            return;
        }
        let mut rows = rows.map(|row| row.as_chunks_mut::<GROUP>().0);
        for group in groups {
            let number = self.first + group * GROUP;
            let start = self.of(number);
            for (table, row) in tables.iter().zip(&mut rows) {
                row[group] = if self.behind >= BITS {
                    [table[start]; GROUP]
                } else if self.behind == 0 && self.bits >= BITS {
                    *table[start..].first_chunk().expect("a whole group")
                } else if self.in_tile >= BITS {
                    let tile = start & !self.within;
                    std::array::from_fn(|i| table[tile | (((number + i) >> self.behind) & self.within)])
                } else {
                    std::array::from_fn(|i| table[self.of(number + i)])
                };
            }
        }
    }
}

/// The entries of one table, dealt out to all boxes of a chunk.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn deal_one(entries: &Entries, table: &[f64], row: &mut [f64]) {
    let all = 0..row.len().div_ceil(GROUP);
    entries.deal([table], all, [row]);
}

/// Those of four tables, to the groups of boxes that are busy.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn deal_four(entries: &Entries, tables: [&[f64]; 4], busy: &Busy, rows: [&mut [f64]; 4]) {
    entries.deal(tables, busy.groups(), rows);
}

/// The shares of all lower halves, from the masses of the cells, each at its place.
fn shares(grid: &Grid, mass: Vec<f64>) -> Table {
    let levels = grid.levels();
    let mut masses: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let mut shares = vec![Vec::new(); levels.len()];
    masses[grid.finest()] = mass;
    for id in (0..grid.finest()).rev() {
        let level = &levels[id];
        let mut total = Vec::new();
        for step in &level.splits {
            let (mut lower, mut upper) = (vec![0.0; level.boxes], vec![0.0; level.boxes]);
            let (lower, upper) = step.halves(&masses[step.level], 0, &mut lower, &mut upper);
            let share = |(l, u): (&f64, &f64)| if l + u > 0.0 { l / (l + u) } else { 0.5 };
            shares[id].push(lower.iter().zip(upper).map(share).collect::<Vec<f64>>());
            total = lower.iter().zip(upper).map(|(l, u)| l + u).collect();
        }
        masses[id] = total;
    }
    shares
}

/// The shares of all boxes in those that they are halves of.
fn halves(grid: &Grid, shares: &Table) -> Table {
    let levels = grid.levels();
    let of_origin = |level: &Level, step: &Step| {
        let above = &levels[step.level];
        let way = above.splits.iter().position(|s| s.axis == step.axis);
        let of_whole = &shares[step.level][way.expect("each origin has its split")];
        let mut halves = vec![0.0; level.boxes];
        halves.copy_from_slice(step.wholes(of_whole, 0, &mut vec![0.0; level.boxes]));
        for (number, share) in halves.iter_mut().enumerate() {
            *share = if step.is_upper(number) { 1.0 - *share } else { *share };
        }
        halves
    };
    let of_level = |level: &Level| level.origins.iter().map(|step| of_origin(level, step)).collect();
    levels.iter().map(of_level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lower_shares((base, terms): (&Base, &SplitTerms), level: &Level, axis: usize, first: usize, out: &mut [f64]) {
        let mut busy = Busy::none();
        busy.find(&vec![2.0; out.len()]);
        let mut rows = vec![vec![0.0; out.len()]; 3];
        let [a, b, c] = &mut rows[..] else { unreachable!() };
        let mut splits = Splits {
            share: out,
            terms: [a, b, c],
        };
        base.splits(terms, (level, axis, first), &busy, &mut splits);
    }

    #[test]
    fn a_product_has_the_shares_of_its_full_table() {
        let depths = [2, 1, 2, 3];
        let space: Vec<f64> = (0..8).map(|i| f64::from((i * 5 + 2) % 7)).collect();
        let direction: Vec<f64> = (0..32).map(|i| 1.0 + f64::from((i * 11) % 13)).collect();
        let full: Vec<f64> = space
            .iter()
            .flat_map(|s| direction.iter().map(move |d| s * d))
            .collect();
        // One tile, and more and more of them until each is a cell.
        for most in [1 << 15, 400, 100, 30, 8, 1] {
            let grid = Grid::with_tiles(depths.to_vec(), most).expect("small");
            for steps in [[0; 4], [3, 1, 2, 5]] {
                let product = Base::product(&grid, &[(2, &space), (2, &direction)], &steps);
                let dense = Base::product(&grid, &[(4, &full)], &steps);
                let terms = [&product, &dense].map(|base| base.split_terms(3.0));
                for level in grid.levels() {
                    for step in &level.splits {
                        for n in (0..).map(|k| 1 << k).take_while(|n| *n <= level.boxes) {
                            for first in (0..level.boxes).step_by(n) {
                                let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
                                lower_shares((&product, &terms[0]), level, step.axis, first, &mut a);
                                lower_shares((&dense, &terms[1]), level, step.axis, first, &mut b);
                                for (a, b) in a.iter().zip(&b) {
                                    // A box of a factor may hold mass where the product holds none.
                                    assert!((a - b).abs() < 1e-14 || *b == 0.5, "{a} {b}");
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn shares_are_ratios_of_masses() {
        // Against sums over the cells of every box, whichever way boxes are numbered.
        let grid = Grid::with_tiles(vec![2, 3], 9).expect("small");
        let mass: Vec<f64> = (0..32).map(|i| f64::from((i * 5 + 2) % 7)).collect();
        let base = Base::product(&grid, &[(2, &mass)], &[0, 0]);
        let sum = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| -> f64 {
            rows.flat_map(|r| columns.clone().map(move |c| r * 8 + c))
                .map(|i| mass[i])
                .sum()
        };
        for level in grid.levels() {
            let [h, k] = [level.halvings[0], level.halvings[1]];
            let (height, width) = (4 >> h, 8 >> k);
            for step in &level.splits {
                let mut found = vec![0.0; level.boxes];
                lower_shares((&base, &base.split_terms(3.0)), level, step.axis, 0, &mut found);
                let mut expected = Vec::new();
                for i in 0..1 << h {
                    for j in 0..1 << k {
                        let (rows, columns) = (i * height..(i + 1) * height, j * width..(j + 1) * width);
                        let whole = sum(rows.clone(), columns.clone());
                        let half = if step.axis == 0 {
                            sum(rows.start..rows.start + height / 2, columns)
                        } else {
                            sum(rows, columns.start..columns.start + width / 2)
                        };
                        expected.push(if whole > 0.0 { half / whole } else { 0.5 });
                    }
                }
                let number = |i: usize, j: usize| {
                    let [a, b] = [level.within[0], level.within[1]];
                    let tile = ((i >> a) << (k - b)) | (j >> b);
                    (tile << (a + b)) | ((i & ((1 << a) - 1)) << b) | (j & ((1 << b) - 1))
                };
                for i in 0..1_usize << h {
                    for j in 0..1_usize << k {
                        assert!((found[number(i, j)] - expected[(i << k) + j]).abs() < 1e-15);
                    }
                }
                let finer = &grid.levels()[step.level];
                let back = finer.origins.iter().find(|o| o.axis == step.axis).expect("there");
                for n in (0..).map(|k| 1 << k).take_while(|n| *n <= finer.boxes) {
                    for first in (0..finer.boxes).step_by(n) {
                        let mut halves = vec![0.0; n];
                        base.half_shares(finer, step.axis, first, &mut halves);
                        for (i, half) in halves.iter().enumerate() {
                            let whole = found[back.range_of_wholes(first + i, 1).start];
                            let expected = if back.is_upper(first + i) { 1.0 - whole } else { whole };
                            assert!(half.to_bits() == expected.to_bits());
                        }
                    }
                }
            }
        }
    }
}
