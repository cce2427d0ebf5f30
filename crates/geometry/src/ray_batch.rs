//! A block of rays as a structure of arrays.

use etendue_math::Vec3;

/// Rays per block: seven arrays of f64 fit the second-level cache.
pub const BLOCK: usize = 2048;

/// Up to [`BLOCK`] rays: positions \[mm\], directions, flux \[flux unit of the source\].
///
/// Directions are unit vectors for usable rays. A ray that cannot be used (see [`Defect`]) has flux 0 and direction 0.
#[derive(Clone, Debug)]
pub struct RayBatch {
    /// Number of rays in use; the arrays are always [`BLOCK`] long.
    pub len: usize,
    /// Positions, one array per axis.
    pub position: [Vec<f64>; 3],
    /// Unit directions, one array per axis.
    pub direction: [Vec<f64>; 3],
    /// Flux of each ray.
    pub flux: Vec<f64>,
    /// What the records say of each ray's colour: its wavelength \[nm\], or the number of its spectrum. Empty if they say
    /// nothing, and unless it was asked for (see [`crate::table::Layout::colour`]).
    pub colour: Vec<f64>,
    /// Why rays of this block could not be used, by [`Defect`].
    pub defects: [u64; Defect::COUNT],
    /// Largest | |k| − 1 | of the directions as they were stored.
    pub norm_error: f64,
    /// Room for the records of a file on their way here, kept from block to block.
    pub room: Vec<u8>,
}

/// Why a ray cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// A coordinate, direction cosine or flux is NaN or infinite.
    NotFinite,
    /// The direction is shorter than 1e-6: it points nowhere.
    NoDirection,
    /// The flux is negative.
    NegativeFlux,
}

impl Defect {
    /// Number of kinds.
    pub const COUNT: usize = 3;
}

impl Default for RayBatch {
    fn default() -> Self {
        let zeros = || vec![0.0; BLOCK];
        Self {
            len: 0,
            position: std::array::from_fn(|_| zeros()),
            direction: std::array::from_fn(|_| zeros()),
            flux: zeros(),
            colour: Vec::new(),
            defects: [0; Defect::COUNT],
            norm_error: 0.0,
            room: Vec::new(),
        }
    }
}

impl RayBatch {
    /// Position of ray `i` \[mm\].
    #[inline]
    #[must_use]
    pub fn position(&self, i: usize) -> Vec3 {
        Vec3::new(self.position[0][i], self.position[1][i], self.position[2][i])
    }

    /// Direction of ray `i`.
    #[inline]
    #[must_use]
    pub fn direction(&self, i: usize) -> Vec3 {
        Vec3::new(self.direction[0][i], self.direction[1][i], self.direction[2][i])
    }

    /// Normalises the directions of the block just filled, and takes rays that cannot be used out of it (flux and
    /// direction become 0) with their reasons counted.
    pub fn settle(&mut self) {
        self.defects = [0; Defect::COUNT];
        let mut norm_error = 0.0_f64;
        let [px, py, pz] = &mut self.position;
        let [kx, ky, kz] = &mut self.direction;
        for i in 0..self.len {
            let k2 = kx[i] * kx[i] + ky[i] * ky[i] + kz[i] * kz[i];
            // A sum is finite only if every term is (or the terms overflow, which no length in millimetres does).
            let finite = (px[i] + py[i] + pz[i] + k2 + self.flux[i]).is_finite();
            let usable = finite & (k2 >= 1e-12) & (self.flux[i] >= 0.0);
            let norm = k2.sqrt();
            let scale = if usable { 1.0 / norm } else { 0.0 };
            if usable {
                norm_error = norm_error.max((norm - 1.0).abs());
                kx[i] *= scale;
                ky[i] *= scale;
                kz[i] *= scale;
            } else {
                let defect = if !finite {
                    Defect::NotFinite
                } else if k2 < 1e-12 {
                    Defect::NoDirection
                } else {
                    Defect::NegativeFlux
                };
                self.defects[defect as usize] += 1;
                (px[i], py[i], pz[i]) = (0.0, 0.0, 0.0);
                (kx[i], ky[i], kz[i]) = (0.0, 0.0, 0.0);
                self.flux[i] = 0.0;
            }
        }
        self.norm_error = norm_error;
    }

    /// Whether ray `i` can be used (its direction is not zero).
    #[inline]
    #[must_use]
    pub fn usable(&self, i: usize) -> bool {
        self.direction[0][i] != 0.0 || self.direction[1][i] != 0.0 || self.direction[2][i] != 0.0
    }
}
