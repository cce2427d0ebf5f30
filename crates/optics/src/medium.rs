//! Media: refractive index and absorption.

use crate::table::Curve;

/// Refractive index as a function of the wavelength in vacuum.
#[derive(Clone, Debug, PartialEq)]
pub enum Index {
    /// Linear between nodes \[nm\]; a single node is a constant.
    Table(Curve),
    /// n² = 1 + Σ bᵢ λ²/(λ² − cᵢ), λ in µm: Sellmeier's formula.
    Sellmeier {
        /// Strengths.
        b: Vec<f64>,
        /// Squares of the resonance wavelengths \[µm²\].
        c: Vec<f64>,
    },
}

impl Index {
    /// n at a wavelength \[nm\]. NaN where Sellmeier's formula has no real answer.
    #[must_use]
    pub fn at(&self, wavelength: f64) -> f64 {
        match self {
            Self::Table(curve) => curve.at(wavelength),
            Self::Sellmeier { b, c } => {
                let square = (wavelength * 1e-3) * (wavelength * 1e-3);
                let terms = b.iter().zip(c).map(|(b, c)| b * square / (square - c));
                (1.0 + terms.sum::<f64>()).sqrt()
            }
        }
    }
}

/// What fills a part of space.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    /// Refractive index.
    pub index: Index,
    /// Napierian absorption coefficient \[1/mm\] over the wavelength \[nm\].
    pub absorption: Curve,
}

/// A medium at one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpticalConstants {
    /// Refractive index.
    pub n: f64,
    /// Napierian absorption coefficient \[1/mm\].
    pub absorption: f64,
}

impl Medium {
    /// The medium at a wavelength \[nm\].
    #[must_use]
    pub fn at(&self, wavelength: f64) -> OpticalConstants {
        OpticalConstants {
            n: self.index.at(wavelength),
            absorption: self.absorption.at(wavelength),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bk7_at_the_d_line_has_the_index_of_its_data_sheet() {
        // SCHOTT N-BK7 517642: n_d = 1.51680 at 587.5618 nm.
        let bk7 = Index::Sellmeier {
            b: vec![1.039_612_12, 0.231_792_344, 1.010_469_45],
            c: vec![0.006_000_698_67, 0.020_017_914_4, 103.560_653],
        };
        assert!((bk7.at(587.5618) - 1.516_80).abs() < 5e-6);
        assert!((bk7.at(486.1327) - 1.522_38).abs() < 5e-6);
    }
}
