//! The random numbers of one ray, taken as they are needed.

use etendue_sampling::lattice::ShiftedPoint;
use etendue_sampling::philox::Stream;

/// Numbers between 0 and 1 at the address of a ray: the coordinates of a point of low discrepancy first, if there is one.
#[derive(Clone, Debug)]
pub struct Numbers {
    stream: Stream,
    index: u64,
    block: u64,
    held: [f64; 4],
    used: u32,
    /// How many times four coordinates of the point were drawn.
    fours: u32,
    point: Option<ShiftedPoint>,
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
            fours: 0,
            point: None,
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

    /// The coordinates of a point, by whose first shift (see [`ShiftedPoint::shift`]) it is moved, then those of ray `index`.
    #[inline]
    #[must_use]
    pub fn after(point: ShiftedPoint, shift: &[f64; 4], stream: Stream, index: u64) -> Self {
        let mut numbers = Self::new(stream, index, 0);
        (numbers.held, numbers.used, numbers.fours) = (point.moved(0, shift), 0, 1);
        numbers.point = Some(point);
        numbers
    }

    /// The next one.
    #[inline]
    pub fn draw(&mut self) -> f64 {
        if self.used == 4 {
            self.refill();
        }
        self.used += 1;
        self.held[self.used as usize - 1]
    }

    /// One that has nothing to do with the point: at a place of its own for each number that was drawn before.
    #[inline]
    #[must_use]
    pub fn aside(&self) -> f64 {
        let place = self.block << 16 | u64::from(self.fours) << 8 | u64::from(self.used);
        self.stream.uniforms(self.index, 1 << 63 | place)[0]
    }

    #[inline]
    fn refill(&mut self) {
        self.used = 0;
        if let Some(point) = &self.point {
            self.held = point.four(u64::from(self.fours));
            self.fours += 1;
            if u64::from(self.fours) == ShiftedPoint::FOURS {
                self.point = None;
            }
        } else {
            self.held = self.stream.uniforms(self.index, self.block);
            self.block += 1;
        }
    }
}
