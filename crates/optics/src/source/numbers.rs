//! The random numbers of one ray, taken as they are needed.

use etendue_sampling::philox::Stream;

/// Numbers between 0 and 1 at the address of a ray.
#[derive(Clone, Debug)]
pub struct Numbers {
    stream: Stream,
    index: u64,
    block: u64,
    held: [f64; 4],
    used: usize,
}

impl Numbers {
    /// Those of ray `index`, from block `block` on.
    #[must_use]
    pub const fn new(stream: Stream, index: u64, block: u64) -> Self {
        Self {
            stream,
            index,
            block,
            held: [0.0; 4],
            used: 4,
        }
    }

    /// The next one.
    #[inline]
    pub fn next(&mut self) -> f64 {
        if self.used == 4 {
            self.held = self.stream.uniforms(self.index, self.block);
            self.block += 1;
            self.used = 0;
        }
        self.used += 1;
        self.held[self.used - 1]
    }
}
