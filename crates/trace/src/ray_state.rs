//! What a ray carries on its way.

/// What a ray carries.
#[derive(Clone, Copy, Debug)]
pub struct RayState {
    /// \[flux unit\].
    pub flux: f64,
    /// \[nm\].
    pub wavelength: f64,
    /// Its number in the run.
    pub ray: u64,
    /// Whether it has met a diffuse surface.
    pub scattered: bool,
    /// Whether the reverse tracer does not find it, or leaves it to the light image.
    pub unseen: bool,
    /// Luminance of the source where it started, over the flux of all sources \[1/(mm² sr)\], if a detector asks for it; ∞ if
    /// lines of sight cannot meet it.
    pub brightness: f64,
    /// Which source it came from and through which smooth surfaces, as a number that few others share.
    pub family: u32,
    /// How often the stored events can be thinned before those of this ray are dropped.
    pub depth: u32,
}

impl RayState {
    /// The ray was mirrored or refracted at a smooth surface, which matters before it meets the first diffuse one.
    #[inline(always)]
    pub const fn go_smoothly(&mut self, face: u32, transmitted: bool) {
        if !self.scattered {
            self.unseen = true;
            self.family = self
                .family
                .wrapping_add(1)
                .wrapping_mul(0x9E37_79B1)
                .wrapping_add(2 * face + transmitted as u32);
        }
    }
}
