//! The depth at which light is sharp, by its inclination.

/// The depth at which light of each inclination is sharp: a cubic in 1 − cos θ, from its constant term on \[mm\].
///
/// It moves places by a function of the direction only, so that étendue stays what it is. Theory eq. 41.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Focus(pub [f64; 4]);

impl Focus {
    /// The height at which lines of this direction cosine along z have their places.
    #[inline(always)]
    #[must_use]
    pub fn at(&self, cosine: f64) -> f64 {
        let [a, b, c, d] = self.0;
        let lean = 1.0 - cosine;
        a + lean * (b + lean * (c + lean * d))
    }

    /// What takes the place of the cosine of a line in cosine · area / distance², the solid angle under which an area of
    /// places is seen from `height` above the plane, the distance being that to the plane.
    ///
    /// With the slope m of the line, x' = x - (h - ζ) m; ζ changes with m, so that the determinant of dx'/dm is
    /// (h - ζ)² (1 + ζ' c (1 - c²)/(h - ζ)), and dm = dΩ/c³: theory eq. 42.
    #[inline(always)]
    #[must_use]
    pub fn seen(&self, cosine: f64, height: f64) -> f64 {
        let above = height - self.at(cosine);
        let nearer = if above == 0.0 { 1.0 } else { height / above };
        cosine * nearer * nearer / self.stretch(cosine, above)
    }

    /// The second factor of that determinant.
    #[inline(always)]
    fn stretch(&self, cosine: f64, above: f64) -> f64 {
        let [_, b, c, d] = self.0;
        let lean = 1.0 - cosine;
        let slope = -(b + lean * (2.0 * c + lean * 3.0 * d));
        // On the surface itself nothing is seen of it.
        if above == 0.0 {
            1.0
        } else {
            1.0 + slope * cosine * (1.0 - cosine * cosine) / above
        }
    }

    /// The cosine of the line from a place to a point `across` beside it and `height` above the plane; None if there is none.
    pub(super) fn aim(&self, across: f64, height: f64) -> Option<f64> {
        let cosine_of = |slope: f64| 1.0 / (1.0 + slope * slope).sqrt();
        let mut slope = across / (height - self.at(1.0));
        for _ in 0..AIM_STEPS {
            let cosine = cosine_of(slope);
            let above = height - self.at(cosine);
            let step = (across - above * slope) / (above * self.stretch(cosine, above));
            slope += step;
            if !(slope >= 0.0 && above > 0.0) {
                return None;
            }
            if step.abs() <= 1e-14 * (1.0 + slope) {
                return Some(cosine_of(slope));
            }
        }
        None
    }

    /// The lowest and the highest of the heights, over all directions.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let [_, b, c, d] = self.0;
        // Where the slope b + 2 c l + 3 d l² over the lean l is zero, without cancellation.
        let root = (c * c - 3.0 * b * d).max(0.0).sqrt();
        let sum = -(c + root.copysign(c));
        [1.0, 0.0, 1.0 - sum / (3.0 * d), 1.0 - b / sum]
            .into_iter()
            .filter(|cosine| (0.0..=1.0).contains(cosine))
            .map(|cosine| self.at(cosine))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
                [low.min(z), high.max(z)]
            })
    }

    /// The largest height of a place above or below the plane.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.0.iter().map(|f| f.abs()).sum()
    }
}

/// Newton steps towards the direction in which a place is seen: a handful suffice where the depth changes little.
const AIM_STEPS: usize = 32;
