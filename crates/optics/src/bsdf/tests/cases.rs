//! What every kind of BSDF is asked at.

use super::super::contract::Media;

/// Equal media, and others: less in front, more in front.
pub(super) const MEDIA: [Media; 3] = [
    Media {
        wavelength: 555.0,
        front: 1.0,
        back: 1.0,
    },
    Media {
        wavelength: 450.0,
        front: 1.0,
        back: 1.5,
    },
    Media {
        wavelength: 700.0,
        front: 1.6,
        back: 1.1,
    },
];

/// Heights of directions in front of a surface and behind it: along the normal, between, grazing.
pub(super) const HEIGHTS: [f64; 10] = [1.0, -1.0, 0.9, -0.8, 0.5, -0.4, 0.1, -0.05, 1e-6, -1e-6];
