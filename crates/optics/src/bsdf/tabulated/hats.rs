//! What is drawn from along the radial coordinate of a slice: hats, one for each coordinate.

use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;

/// The function of r that is 1 at a radial coordinate, 0 at those next to it, and linear in between, times r: the density of
/// what belongs to that coordinate. All about it is worked out when it is asked: lists of it would crowd the caches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hat {
    pub below: f64,
    pub node: f64,
    pub above: f64,
}

/// One side of a hat, and what is left of the number that decided for it: less than its share. With s from 0 at the far end to 1
/// at its top the density is s (far + s (node − far)).
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub far: f64,
    pub left: f64,
    /// Its part of the hat.
    share: f64,
    /// The part of it that goes with s; the rest goes with s² towards 0, and with s (1 − s) away from it.
    linear: f64,
    inwards: bool,
}

impl Hat {
    /// The hat of a radial coordinate. There is nothing beyond the first and the last one.
    #[inline(always)]
    pub(super) fn of(radial: &[f64], i: usize) -> Self {
        Self {
            below: radial[i.saturating_sub(1)],
            node: radial[i],
            above: radial[(i + 1).min(radial.len() - 1)],
        }
    }

    /// Of both sides the integral, and what of their mean goes with s and otherwise.
    #[inline(always)]
    fn sides(&self) -> [(f64, f64, f64); 2] {
        let side = |step: f64, nearer: f64, bent: f64| {
            let straight = 0.5 * nearer;
            (step * (straight + bent), straight, bent)
        };
        let [inside, outside] = [self.node - self.below, self.above - self.node];
        [
            side(inside, self.below, inside * (1.0 / 3.0)),
            side(outside, self.node, outside * (1.0 / 6.0)),
        ]
    }

    /// Its integral.
    pub(super) fn whole(&self) -> f64 {
        self.sides().iter().map(|(whole, ..)| whole).sum()
    }

    /// The side that a number decides for.
    #[inline(always)]
    pub(super) fn side(&self, number: f64) -> Side {
        let [inside, outside] = self.sides();
        let whole = inside.0 + outside.0;
        let inner = if whole > 0.0 { inside.0 / whole } else { 0.0 };
        let inwards = number < inner;
        // Selections, not branches, which nobody can foresee.
        let (_, straight, bent) = if inwards { inside } else { outside };
        Side {
            far: if inwards { self.below } else { self.above },
            left: number - if inwards { 0.0 } else { inner },
            share: if inwards { inner } else { 1.0 - inner },
            linear: if bent > 0.0 { straight / (straight + bent) } else { 1.0 },
            inwards,
        }
    }

    /// A radial coordinate with its density, from two numbers of which the second is not used up.
    #[inline]
    pub(super) fn draw(&self, number: f64, other: f64) -> f64 {
        let side = self.side(number);
        let s = if side.is_bent() {
            side.bent(other)
        } else {
            part_of(side.left, side.limit()).sqrt()
        };
        side.far + s * (self.node - side.far)
    }
}

impl Side {
    /// What is left where the part that goes with s ends.
    #[inline(always)]
    pub(super) fn limit(&self) -> f64 {
        self.share * self.linear
    }

    /// Whether it is in the other part.
    #[inline(always)]
    pub(super) fn is_bent(&self) -> bool {
        self.left >= self.limit()
    }

    /// The place s along the slope in that part.
    #[inline]
    pub(super) fn bent(&self, other: f64) -> f64 {
        bent([self.left / self.share, self.linear], other, self.inwards)
    }
}

/// A place along a slope in the part that does not go with s, from what is left of a number and where that part begins, and from
/// another number.
#[inline]
fn bent([rest, linear]: [f64; 2], other: f64, inwards: bool) -> f64 {
    // The largest of three numbers has the density 3 s², the middle one 6 s (1 − s).
    let first = part_of(rest - linear, 1.0 - linear);
    let [second, third] = MoreNumbers::new([rest, other]).pair();
    let [low, high] = [first.min(second), first.max(second)];
    if inwards {
        high.max(third)
    } else {
        third.clamp(low, high)
    }
}
