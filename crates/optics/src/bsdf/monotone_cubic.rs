//! A smooth curve through points that keeps their order.

/// A monotone cubic through points: between two of rising values it rises, and beyond the ends it is constant.
///
/// Slopes after `[Fritsch1984]`.
#[derive(Clone, Debug)]
pub(super) struct Cubic {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Cubic {
    pub(super) fn new(x: &[f64], y: &[f64]) -> Self {
        let n = x.len();
        let h: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let d: Vec<f64> = y.windows(2).zip(&h).map(|(pair, h)| (pair[1] - pair[0]) / h).collect();
        let mut slope = vec![0.0; n];
        for k in 1..n.max(2) - 1 {
            if d[k - 1] * d[k] > 0.0 {
                let (w1, w2) = (2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]);
                slope[k] = (w1 + w2) / (w1 / d[k - 1] + w2 / d[k]);
            }
        }
        if n == 2 {
            slope = vec![d[0]; 2];
        } else if n > 2 {
            let end = |h0: f64, h1: f64, d0: f64, d1: f64| {
                let s = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
                if s * d0 <= 0.0 {
                    0.0
                } else if d0 * d1 <= 0.0 && s.abs() > 3.0 * d0.abs() {
                    3.0 * d0
                } else {
                    s
                }
            };
            slope[0] = end(h[0], h[1], d[0], d[1]);
            slope[n - 1] = end(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
        }
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
