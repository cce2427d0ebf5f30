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

    /// Whether it is 0 everywhere.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.values.iter().all(|v| *v == 0.0)
    }

    /// Its nodes: angles \[rad\] and wavelengths \[nm\].
    #[must_use]
    pub fn nodes(&self) -> (&[f64], &[f64]) {
        (&self.angle, &self.wavelength)
    }

    /// Its smallest value.
    #[must_use]
    pub fn least(&self) -> f64 {
        self.values.iter().copied().fold(f64::INFINITY, f64::min)
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
    fn what_is_no_table_is_refused() {
        assert!(Table::new(vec![0.0, 0.0], vec![1.0], vec![1.0, 1.0]).is_none());
        assert!(Table::new(vec![0.0], vec![1.0], vec![f64::NAN]).is_none());
        assert!(Curve::new(vec![1.0, 2.0], vec![1.0]).is_none());
        assert!(Curve::new(vec![], vec![]).is_none());
    }
}
