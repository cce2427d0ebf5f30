//! A block of rays as a structure of arrays.

use etendue_math::Vec3;
use multiversion::multiversion;

/// Rays per block: seven arrays of f64 fit the second-level cache.
pub const BLOCK: usize = 2048;

/// Rays that are summed side by side, whatever the instruction set: partial sums are formed so. A loop over so many is
/// compiled to one over several at a time.
pub const LANES: usize = 64;

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
        let n = self.len;
        let position = self.position.each_ref().map(|axis| &axis[..n]);
        let [kx, ky, kz] = self.direction.each_mut().map(|axis| &mut axis[..n]);
        let (norm_error, all) = normalise(position, kx, ky, kz, &self.flux[..n]);
        self.norm_error = norm_error;
        self.defects = [0; Defect::COUNT];
        if !all {
            (0..n).for_each(|i| self.take_out_if_defective(i));
        }
    }

    /// Takes ray `i` out if it cannot be used; others have a unit direction by now.
    fn take_out_if_defective(&mut self, i: usize) {
        let [px, py, pz] = self.position.each_mut().map(|axis| &mut axis[i]);
        let [kx, ky, kz] = self.direction.each_mut().map(|axis| &mut axis[i]);
        let flux = &mut self.flux[i];
        let k2 = *kx * *kx + *ky * *ky + *kz * *kz;
        let defect = if !is_finite(*px + *py + *pz + k2 + *flux) {
            Defect::NotFinite
        } else if k2 < SHORTEST {
            Defect::NoDirection
        } else if *flux < 0.0 {
            Defect::NegativeFlux
        } else {
            return;
        };
        self.defects[defect as usize] += 1;
        for value in [px, py, pz, kx, ky, kz, flux] {
            *value = 0.0;
        }
    }

    /// Whether ray `i` can be used (its direction is not zero).
    #[inline]
    #[must_use]
    pub fn usable(&self, i: usize) -> bool {
        self.direction[0][i] != 0.0 || self.direction[1][i] != 0.0 || self.direction[2][i] != 0.0
    }
}

/// Square of the length of a direction that points nowhere.
const SHORTEST: f64 = 1e-12;

/// Whether a sum is finite, which it is only if every term is (or the terms overflow, which no length in millimetres does).
/// By a difference, which stays a comparison of floats in loops over several rays at a time.
#[inline(always)]
#[allow(clippy::eq_op, reason = "∞ − ∞ is not a number")]
fn is_finite(sum: f64) -> bool {
    sum - sum == 0.0
}

/// Makes the directions of usable rays unit vectors and leaves those of others; the largest | |k| − 1 | before, and whether all
/// rays can be used. Several rays at a time, the same bits on every instruction set.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn normalise([px, py, pz]: [&[f64]; 3], kx: &mut [f64], ky: &mut [f64], kz: &mut [f64], flux: &[f64]) -> (f64, bool) {
    // Maxima of floats above 0 are those of their bits; of integers, several can be found at a time.
    let (mut error, mut defective) = (0_u64, 0_u64);
    let rays = px.iter().zip(py).zip(pz).zip(kx).zip(ky).zip(kz).zip(flux);
    for ((((((px, py), pz), kx), ky), kz), w) in rays {
        let k2 = *kx * *kx + *ky * *ky + *kz * *kz;
        let usable = is_finite(px + py + pz + k2 + w) & (k2 >= SHORTEST) & (*w >= 0.0);
        let norm = k2.sqrt();
        let inverse = 1.0 / norm;
        let off = (norm - 1.0).abs().to_bits();
        let off = if usable { off } else { 0 };
        error = if off > error { off } else { error };
        defective |= u64::from(!usable);
        let scale = if usable { inverse } else { 1.0 };
        *kx *= scale;
        *ky *= scale;
        *kz *= scale;
    }
    (f64::from_bits(error), defective == 0)
}
