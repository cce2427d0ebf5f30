//! More random numbers where two are not enough: those that follow from the two.

/// A stream of numbers from 0 to 1 that two numbers stand for: the same two give the same stream.
///
/// Splitmix `[Steele2014]` from the bits of both.
#[derive(Clone, Copy, Debug)]
pub struct MoreNumbers {
    state: u64,
}

impl MoreNumbers {
    /// That of two numbers.
    #[must_use]
    pub const fn new(numbers: [f64; 2]) -> Self {
        let [a, b] = [numbers[0].to_bits(), numbers[1].to_bits()];
        Self {
            state: a.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b.rotate_left(32),
        }
    }

    /// The next number.
    #[allow(clippy::cast_precision_loss, reason = "53 bits")]
    pub fn draw(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// The next two.
    pub fn pair(&mut self) -> [f64; 2] {
        [self.draw(), self.draw()]
    }
}
