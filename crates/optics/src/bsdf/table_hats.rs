//! What is drawn from along the radial coordinate of a slice: hats, one for each coordinate.

use etendue_sampling::more_numbers::MoreNumbers;
use etendue_sampling::warp::part_of;

/// The function of r that is 1 at a radial coordinate, 0 at those next to it, and linear in between, times r: the density of
/// what belongs to that coordinate.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Hat {
    pub node: f64,
    /// The part of it that lies nearer to 0.
    pub inner: f64,
    /// Towards 0, and away from it.
    pub slopes: [Slope; 2],
}

/// One side of a hat. With s from 0 at the far end to 1 at its top the density is s (far + s (node − far)).
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    pub far: f64,
    /// Its part of the hat.
    pub share: f64,
    /// The part of it that goes with s; the rest goes with s² towards 0, and with s (1 − s) away from it.
    pub linear: f64,
}

impl Hat {
    /// The hat of a radial coordinate, and its integral.
    pub(super) fn of(radial: &[f64], i: usize) -> (Self, f64) {
        let node = radial[i];
        let side = |other: Option<&f64>| {
            // Nothing beyond the first and the last coordinate.
            let far = other.copied().unwrap_or(node);
            let step = (node - far).abs();
            let straight = 0.5 * far.min(node);
            let bent = if far < node { step / 3.0 } else { step / 6.0 };
            let linear = if bent > 0.0 { straight / (straight + bent) } else { 1.0 };
            (step * (straight + bent), far, linear)
        };
        let below = i.checked_sub(1).map(|below| &radial[below]);
        let [inside, outside] = [below, radial.get(i + 1)].map(side);
        let whole = inside.0 + outside.0;
        let inner = if whole > 0.0 { inside.0 / whole } else { 0.0 };
        let slope = |(_, far, linear), share| Slope { far, share, linear };
        let slopes = [slope(inside, inner), slope(outside, 1.0 - inner)];
        (Self { node, inner, slopes }, whole)
    }

    /// The side that a number decides for.
    #[inline(always)]
    pub(super) fn side(&self, number: f64) -> Side<'_> {
        let outwards = u8::from(number >= self.inner);
        Side {
            slope: &self.slopes[usize::from(outwards)],
            // Without a branch, which nobody can foresee.
            left: number - f64::from(outwards) * self.inner,
            inwards: outwards == 0,
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
        side.slope.far + s * (self.node - side.slope.far)
    }
}

/// A side of a hat, and what is left of the number that decided for it: less than its share.
pub(super) struct Side<'a> {
    pub slope: &'a Slope,
    pub left: f64,
    inwards: bool,
}

impl Side<'_> {
    /// What is left where the part that goes with s ends.
    #[inline(always)]
    pub(super) fn limit(&self) -> f64 {
        self.slope.share * self.slope.linear
    }

    /// Whether it is in the other part.
    #[inline(always)]
    pub(super) fn is_bent(&self) -> bool {
        self.left >= self.limit()
    }

    /// The place s along the slope in that part.
    #[inline]
    pub(super) fn bent(&self, other: f64) -> f64 {
        bent([self.left / self.slope.share, self.slope.linear], other, self.inwards)
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
