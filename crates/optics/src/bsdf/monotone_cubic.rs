//! A smooth curve through points that keeps their order.

/// A monotone cubic through points: between two of rising values it rises, and beyond the ends it is constant.
///
/// Its slopes are those of parabolas through three points, where that keeps the order, and otherwise the steepest ones that do
/// `[Hyman1983]`: what varies smoothly is met to the third power of the distance between points.
#[derive(Clone, Debug)]
pub(super) struct Cubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Cubic {
    /// Through points whose x rise.
    pub(super) fn new(x: &[f64], y: &[f64]) -> Self {
        let h: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let d: Vec<f64> = y.windows(2).zip(&h).map(|(pair, h)| (pair[1] - pair[0]) / h).collect();
        let slope = match d[..] {
            [] => vec![0.0; x.len()],
            [only] => vec![only; 2],
            _ => {
                let last = d.len() - 1;
                let within = (1..d.len()).map(|k| {
                    let parabola = (h[k] * d[k - 1] + h[k - 1] * d[k]) / (h[k - 1] + h[k]);
                    limited(limited(parabola, d[k - 1]), d[k])
                });
                let end = |[h0, h1]: [f64; 2], [d0, d1]: [f64; 2]| {
                    let parabola = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
                    limited(parabola, d0)
                };
                let first = end([h[0], h[1]], [d[0], d[1]]);
                let end = end([h[last], h[last - 1]], [d[last], d[last - 1]]);
                std::iter::once(first).chain(within).chain([end]).collect()
            }
        };
        Self {
            x: x.to_vec(),
            y: y.to_vec(),
            slope,
        }
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        let n = self.x.len();
        if x <= self.x[0] {
            return self.y[0];
        }
        if x >= self.x[n - 1] {
            return self.y[n - 1];
        }
        let k = self.x.partition_point(|node| *node <= x) - 1;
        let h = self.x[k + 1] - self.x[k];
        let t = (x - self.x[k]) / h;
        let (a, b) = (self.y[k], self.y[k + 1]);
        let s = t * t * (3.0 - 2.0 * t);
        let value = a + s * (b - a) + h * t * (1.0 - t) * ((1.0 - t) * self.slope[k] - t * self.slope[k + 1]);
        value.clamp(a.min(b), a.max(b))
    }
}

/// The nearest slope that goes the way of a secant and is at most three times as steep.
fn limited(slope: f64, secant: f64) -> f64 {
    let steepest = 3.0 * secant;
    slope.clamp(steepest.min(0.0), steepest.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_met_and_keep_their_order() {
        let x = [0.0, 0.1, 0.15, 0.6, 0.7, 1.5];
        let y = [3.0, 1.0, 1.0, 0.999, -4.0, 2.0];
        let cubic = Cubic::new(&x, &y);
        for (x, y) in x.into_iter().zip(y) {
            assert_eq!(cubic.at(x), y);
        }
        for (x, y) in x.windows(2).zip(y.windows(2)) {
            let at = |k: u32| cubic.at(x[0] + (x[1] - x[0]) * f64::from(k) / 1000.0);
            assert!((0..1000).all(|k| (at(k + 1) - at(k)) * (y[1] - y[0]).signum() >= -1e-15));
        }
    }

    #[test]
    fn errors_fall_with_the_third_power_of_steps() {
        let f = |x: f64| (3.0 - x) * (3.0 - x) / (1.0 + x);
        let worst = |n: u32| {
            let x: Vec<f64> = (0..=n).map(|k| (f64::from(k) / f64::from(n)).powf(1.5)).collect();
            let cubic = Cubic::new(&x, &x.iter().copied().map(f).collect::<Vec<_>>());
            let off = |k: u32| (cubic.at(f64::from(k) / 1e4) - f(f64::from(k) / 1e4)).abs();
            (0..=10_000).map(off).fold(0.0, f64::max)
        };
        let [few, many] = [worst(16), worst(64)];
        assert!(many < few / 40.0, "{few:e} {many:e}");
    }
}
