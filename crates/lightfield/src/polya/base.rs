//! Base measures: what the tree falls back on where the data say nothing.

use etendue_math::special::{ln, ln_gamma};

use super::grid::{Grid, Level};

/// A base measure over the cells of a grid: a product of factors, each over some neighbouring axes.
#[derive(Clone, Debug)]
pub struct Base {
    /// None of them: equal mass in all cells.
    factors: Vec<Factor>,
}

/// For each level of a grid, for each of its splits: one number per box.
type Table = Vec<Vec<Vec<f64>>>;

/// The share of its lower half in every dyadic box of a few axes.
#[derive(Clone, Debug)]
struct Factor {
    axes: std::ops::Range<usize>,
    grid: Grid,
    shares: Table,
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
    /// Equal mass in all cells.
    #[must_use]
    pub const fn uniform() -> Self {
        Self { factors: Vec::new() }
    }

    /// The product of the factors' masses; each factor takes the next axes of the grid, as many as its own depths.
    ///
    /// A box without mass has the share ½. Factors of equal masses are left out. None if the factors do not fit the depths.
    #[must_use]
    pub fn product(depths: &[u32], factors: &[(usize, &[f64])]) -> Option<Self> {
        let mut first = 0;
        let mut built = Vec::new();
        for (axes, mass) in factors {
            let axes = first..first + axes;
            let grid = Grid::new(depths.get(axes.clone())?.to_vec())?;
            if mass.len() != grid.cells() {
                return None;
            }
            first = axes.end;
            if mass.iter().all(|m| *m == mass[0]) {
                continue;
            }
            let shares = shares(&grid, mass);
            built.push(Factor { axes, grid, shares });
        }
        (first == depths.len()).then_some(Self { factors: built })
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

    /// For boxes `first..first + n` of a level, split along `axis`: the base share of the lower half.
    pub(super) fn lower_shares(&self, level: &Level, axis: usize, first: usize, out: &mut [f64]) {
        match self.factors.iter().find(|f| f.axes.contains(&axis)) {
            None => out.fill(0.5),
            Some(factor) => factor.spread(&factor.shares, level, axis, first, out),
        }
    }

    /// The same with the terms of the splits.
    pub(super) fn splits(&self, terms: &SplitTerms, level: &Level, axis: usize, first: usize, out: &mut Splits<'_>) {
        self.lower_shares(level, axis, first, out.share);
        match self.factors.iter().position(|f| f.axes.contains(&axis)) {
            None => {
                for (row, value) in out.terms.iter_mut().zip(terms.even) {
                    row.fill(value);
                }
            }
            Some(index) => {
                for (row, table) in out.terms.iter_mut().zip(&terms.tables[index]) {
                    self.factors[index].spread(table, level, axis, first, row);
                }
            }
        }
    }
}

impl Factor {
    /// Deals the numbers of a table out to boxes `first..first + n` of a level of the whole grid, split along `axis`.
    fn spread(&self, table: &Table, level: &Level, axis: usize, first: usize, out: &mut [f64]) {
        let halvings = &level.halvings[self.axes.clone()];
        let id = halvings
            .iter()
            .zip(self.grid.depths())
            .fold(0, |id, (h, d)| id * (*d as usize + 1) + *h as usize);
        let own = &self.grid.levels()[id];
        let split = own.splits.iter().position(|s| s.axis == axis - self.axes.start);
        let table = &table[id][split.expect("the axis can be split")];
        let low_bits: u32 = level.halvings[self.axes.end..].iter().sum();
        let mask = own.boxes - 1;
        let n = out.len();
        if low_bits == 0 && own.boxes >= n {
            let start = first & mask;
            out.copy_from_slice(&table[start..start + n]);
        } else if n >> low_bits == 0 {
            out.fill(table[(first >> low_bits) & mask]);
        } else if low_bits == 0 {
            out.chunks_exact_mut(own.boxes).for_each(|o| o.copy_from_slice(table));
        } else {
            for (i, run) in out.chunks_exact_mut(1 << low_bits).enumerate() {
                run.fill(table[((first >> low_bits) + i) & mask]);
            }
        }
    }
}

/// The shares of all lower halves, from the masses of the cells.
fn shares(grid: &Grid, mass: &[f64]) -> Table {
    let levels = grid.levels();
    let mut masses: Vec<Vec<f64>> = vec![Vec::new(); levels.len()];
    let mut shares = vec![Vec::new(); levels.len()];
    masses[grid.finest()] = mass.to_vec();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_has_the_shares_of_its_full_table() {
        let depths = [2, 1, 2, 3];
        let space: Vec<f64> = (0..8).map(|i| f64::from((i * 5 + 2) % 7)).collect();
        let direction: Vec<f64> = (0..32).map(|i| 1.0 + f64::from((i * 11) % 13)).collect();
        let full: Vec<f64> = space
            .iter()
            .flat_map(|s| direction.iter().map(move |d| s * d))
            .collect();
        let product = Base::product(&depths, &[(2, &space), (2, &direction)]).expect("fits");
        let dense = Base::product(&depths, &[(4, &full)]).expect("fits");
        let grid = Grid::new(depths.to_vec()).expect("small");
        for level in grid.levels() {
            for step in &level.splits {
                for n in (0..).map(|k| 1 << k).take_while(|n| *n <= level.boxes) {
                    for first in (0..level.boxes).step_by(n) {
                        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
                        product.lower_shares(level, step.axis, first, &mut a);
                        dense.lower_shares(level, step.axis, first, &mut b);
                        for (a, b) in a.iter().zip(&b) {
                            // A box of a factor may hold mass where the product holds none.
                            assert!((a - b).abs() < 1e-14 || *b == 0.5, "{a} {b}");
                        }
                    }
                }
            }
        }
        assert!(Base::product(&depths, &[(2, &space)]).is_none());
        assert!(Base::product(&depths, &[(2, &direction), (2, &space)]).is_none());
    }
}
