//! Quantities that depend on wavelength, or on angle and wavelength: tables that are linear between their nodes.

/// A function of one variable: linear between the nodes, constant outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Curve {
    /// None unless the nodes increase, every number is finite, and there is at least one.
    #[must_use]
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Option<Self> {
        let sound = !x.is_empty() && x.len() == y.len() && increasing(&x) && y.iter().all(|v| v.is_finite());
        sound.then_some(Self { x, y })
    }

    /// The same everywhere.
    #[must_use]
    pub fn constant(y: f64) -> Self {
        Self {
            x: vec![0.0],
            y: vec![y],
        }
    }

    /// The value at `x`.
    #[inline]
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        let (i, weight) = place(&self.x, x);
        if weight == 0.0 {
            self.y[i]
        } else {
            (1.0 - weight) * self.y[i] + weight * self.y[i + 1]
        }
    }

    /// The smallest and the largest value.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let fold = |f: fn(f64, f64) -> f64| self.y.iter().copied().reduce(f).unwrap_or(0.0);
        [fold(f64::min), fold(f64::max)]
    }
}

fn increasing(x: &[f64]) -> bool {
    x.iter().all(|v| v.is_finite()) && x.windows(2).all(|w| w[0] < w[1])
}

/// The node at or below `x` and how far `x` lies towards the next one.
#[inline]
fn place(nodes: &[f64], x: f64) -> (usize, f64) {
    let last = nodes.len() - 1;
    if x <= nodes[0] {
        (0, 0.0)
    } else if x >= nodes[last] {
        (last, 0.0)
    } else {
        let i = nodes.partition_point(|node| *node <= x) - 1;
        (i, (x - nodes[i]) / (nodes[i + 1] - nodes[i]))
    }
}

/// A function of the angle of incidence and the wavelength: bilinear between the nodes, constant outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// \[rad\] from the normal.
    angle: Vec<f64>,
    /// \[nm\].
    wavelength: Vec<f64>,
    /// Angle by angle.
    values: Vec<f64>,
}

impl Table {
    /// None unless the nodes increase, every number is finite, and there is one value for each pair of nodes.
    #[must_use]
    pub fn new(angle: Vec<f64>, wavelength: Vec<f64>, values: Vec<f64>) -> Option<Self> {
        let nodes = !angle.is_empty() && !wavelength.is_empty() && increasing(&angle) && increasing(&wavelength);
        let sound = nodes && values.len() == angle.len() * wavelength.len() && values.iter().all(|v| v.is_finite());
        sound.then_some(Self {
            angle,
            wavelength,
            values,
        })
    }

    /// The same everywhere.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self {
            angle: vec![0.0],
            wavelength: vec![0.0],
            values: vec![value],
        }
    }

    /// The value for light that arrives at an angle with this cosine.
    #[inline]
    #[must_use]
    pub fn at(&self, cosine: f64, wavelength: f64) -> f64 {
        if let [value] = self.values[..] {
            return value;
        }
        let columns = self.wavelength.len();
        let (j, v) = place(&self.wavelength, wavelength);
        let row = |i: usize| {
            let low = self.values[i * columns + j];
            if v == 0.0 {
                low
            } else {
                (1.0 - v) * low + v * self.values[i * columns + j + 1]
            }
        };
        if self.angle.len() == 1 {
            return row(0);
        }
        let (i, u) = place(&self.angle, cosine.clamp(-1.0, 1.0).acos());
        if u == 0.0 {
            row(i)
        } else {
            (1.0 - u) * row(i) + u * row(i + 1)
        }
    }

    /// Adds `share` of the values for light that arrives at an angle with this cosine to `sums`, one for each wavelength at which
    /// there are nodes.
    #[inline]
    pub fn add_all(&self, cosine: f64, share: f64, sums: &mut [f64]) {
        let columns = self.wavelength.len();
        let (i, u) = if self.angle.len() == 1 {
            (0, 0.0)
        } else {
            place(&self.angle, cosine.clamp(-1.0, 1.0).acos())
        };
        let row = |i: usize| &self.values[i * columns..(i + 1) * columns];
        let (low, high) = (row(i), row(if u == 0.0 { i } else { i + 1 }));
        for ((sum, low), high) in sums.iter_mut().zip(low).zip(high) {
            *sum += share * ((1.0 - u) * low + u * high);
        }
    }

    /// Its value, if it is the same everywhere.
    #[must_use]
    pub fn constant_value(&self) -> Option<f64> {
        let first = self.values[0];
        self.values.iter().all(|value| *value == first).then_some(first)
    }

    /// Whether it is not the same at all wavelengths.
    #[must_use]
    pub fn depends_on_wavelength(&self) -> bool {
        let rows = self.values.chunks(self.wavelength.len());
        rows.into_iter().any(|row| row.iter().any(|value| *value != row[0]))
    }

    /// Whether it is not the same at all angles.
    #[must_use]
    pub fn depends_on_angle(&self) -> bool {
        let columns = self.wavelength.len();
        self.values.windows(columns + 1).any(|pair| pair[0] != pair[columns])
    }

    /// All angles \[rad\] and wavelengths \[nm\] at which one of some tables has nodes.
    #[must_use]
    pub fn breakpoints(tables: &[Self]) -> [Vec<f64>; 2] {
        let collect = |pick: fn(&Self) -> &[f64]| tables.iter().flat_map(|t| pick(t).to_vec()).collect();
        [collect(|t| &t.angle), collect(|t| &t.wavelength)]
    }

    /// Whether tables are shares of one whole: none is negative anywhere, and together they are 1 at most.
    #[must_use]
    pub fn are_shares(tables: &[Self]) -> bool {
        // Sums of bilinear functions are extreme at the nodes of any of them.
        let [angles, wavelengths] = Self::breakpoints(tables);
        let sum = |angle: f64, wavelength| tables.iter().map(|t| t.at(angle.cos(), wavelength)).sum::<f64>();
        tables.iter().all(|t| t.values.iter().all(|value| *value >= 0.0))
            && angles.iter().all(|angle| {
                wavelengths
                    .iter()
                    .all(|wavelength| sum(*angle, *wavelength) <= 1.0 + 1e-9)
            })
    }

    /// Whether it is 0 everywhere.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.values.iter().all(|v| *v == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_bilinear_between_its_nodes_and_constant_outside() {
        let table = Table::new(
            vec![0.0, 1.0],
            vec![400.0, 500.0, 700.0],
            vec![1.0, 2.0, 6.0, 3.0, 8.0, 0.0],
        )
        .expect("sound");
        let at = |angle: f64, wavelength| table.at(angle.cos(), wavelength);
        assert!((at(0.25, 450.0) - (0.75 * 1.5 + 0.25 * 5.5)).abs() < 1e-12);
        assert!((at(0.5, 600.0) - (0.5 * 4.0 + 0.5 * 4.0)).abs() < 1e-12);
        assert_eq!(at(1.4, 900.0), 0.0);
        assert_eq!(at(0.0, 300.0), 1.0);
    }

    #[test]
    fn all_wavelengths_at_once_are_those_of_each() {
        let several = Table::new(
            vec![0.0, 1.0],
            vec![400.0, 500.0, 700.0],
            vec![1.0, 2.0, 6.0, 3.0, 8.0, 0.0],
        );
        let alone = Table::new(vec![0.0], vec![400.0, 500.0], vec![0.25, 0.5]);
        for table in [several, alone].map(|table| table.expect("sound")) {
            for angle in [0.0, 0.3, 1.0, 1.5] {
                let mut sums = vec![0.5; table.wavelength.len()];
                table.add_all(f64::cos(angle), 2.0, &mut sums);
                for (sum, w) in sums.iter().zip(&table.wavelength) {
                    assert!((sum - 0.5 - 2.0 * table.at(f64::cos(angle), *w)).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn shares_of_one_whole_are_known_at_all_nodes() {
        let part = |a, b| Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
        let kink = Table::new(vec![0.0, 0.7, 1.5], vec![500.0], vec![0.1, 0.6, 0.1]).expect("sound");
        assert!(Table::are_shares(&[part(0.5, 0.5), part(0.4, 0.5)]));
        assert!(!Table::are_shares(&[part(0.5, 0.5), part(0.4, 0.6)]));
        assert!(!Table::are_shares(&[part(0.5, 0.5), kink.clone()]));
        assert!(!Table::are_shares(&[part(-0.1, 0.5), part(0.4, 0.4)]));
        assert!(kink.depends_on_angle() && kink.constant_value().is_none());
        let colours = Table::new(vec![0.0, 1.0], vec![400.0, 500.0], vec![0.1, 0.2, 0.1, 0.2]).expect("sound");
        assert!(!colours.depends_on_angle() && colours.constant_value().is_none());
        assert_eq!(part(0.3, 0.3).constant_value(), Some(0.3));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert!(Table::new(vec![0.0, 0.0], vec![1.0], vec![1.0, 1.0]).is_none());
        assert!(Table::new(vec![0.0], vec![1.0], vec![f64::NAN]).is_none());
        assert!(Curve::new(vec![1.0, 2.0], vec![1.0]).is_none());
        assert!(Curve::new(vec![], vec![]).is_none());
    }
}
