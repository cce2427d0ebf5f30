//! The random numbers of one ray, taken as they are needed.

use etendue_sampling::lattice::DIMENSIONS;
use etendue_sampling::philox::Stream;

/// Numbers between 0 and 1 at the address of a ray: the coordinates of a point of low discrepancy first, if there is one.
#[derive(Clone, Debug)]
pub struct Numbers {
    stream: Stream,
    index: u64,
    block: u64,
    held: [f64; 4],
    used: usize,
    point: [f64; DIMENSIONS],
    next: usize,
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
            point: [0.0; DIMENSIONS],
            next: DIMENSIONS,
        }
    }

    /// Those of ray `index` from the beginning, the first four being known.
    #[inline]
    #[must_use]
    pub const fn begun(stream: Stream, index: u64, four: [f64; 4]) -> Self {
        let mut numbers = Self::new(stream, index, 1);
        numbers.held = four;
        numbers.used = 0;
        numbers
    }

    /// The coordinates of a point, then those of ray `index`.
    #[must_use]
    pub const fn after(point: [f64; DIMENSIONS], stream: Stream, index: u64) -> Self {
        let mut numbers = Self::new(stream, index, 0);
        numbers.point = point;
        numbers.next = 0;
        numbers
    }

    /// The next one.
    #[inline]
    pub fn draw(&mut self) -> f64 {
        if self.next < DIMENSIONS {
            self.next += 1;
            return self.point[self.next - 1];
        }
        if self.used == 4 {
            self.held = self.stream.uniforms(self.index, self.block);
            self.block += 1;
            self.used = 0;
        }
        self.used += 1;
        self.held[self.used - 1]
    }
}
