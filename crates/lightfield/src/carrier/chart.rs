//! What every chart of a carrier surface answers, in its own frame.

use etendue_math::Vec3;

use super::beam::Beam;
use super::focus::Focus;

/// An equal-area chart of a shape in its frame: where lines leave it, and which line leaves at a place.
pub trait Chart: Copy {
    /// \[mm²\].
    fn area(&self) -> f64;

    /// Largest distance of a place from the origin \[mm\].
    fn reach(&self) -> f64;

    /// Half the extent of the places along x and y, and their lowest and highest z \[mm\].
    fn extent(&self) -> (f64, f64, [f64; 2]);

    /// The depth of places, by the inclination of their lines.
    fn focus(&self) -> Focus {
        Focus::default()
    }

    /// Where the line through `o` along the unit vector `d` leaves the shape.
    fn cross(&self, o: Vec3, d: Vec3) -> Crossing;

    /// The point at a place, and the unit vector there whose cosines are p and q along the surface and `up` to the normal: the
    /// inverse of [`Chart::cross`].
    fn ray(&self, place: [f64; 2], cosines: [f64; 3]) -> (Vec3, Vec3);

    /// How far along it the line leaves the shape, without chart coordinates.
    fn leave(&self, o: Vec3, d: Vec3) -> Left;
}

/// Where a line leaves a part: place and direction, each coordinate from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Departure {
    /// Whether the line leaves the part at all; the rest means nothing if not.
    pub met: bool,
    /// Chart coordinates (s₁, s₂).
    pub place: [f64; 2],
    /// Concentric coordinates (a, b) of the local direction cosines, within the beam that the part takes.
    pub direction: [f64; 2],
}

/// Where a line leaves a shape: chart coordinates of the place, and the local direction cosines p and q.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    met: bool,
    place: [f64; 2],
    cosines: [f64; 2],
}

impl Crossing {
    /// The departure from a part that takes the directions of a beam.
    #[inline(always)]
    pub(super) fn within(self, beam: &Beam) -> Departure {
        let [p, q] = self.cosines;
        let (inside, direction) = beam.coordinates(p, q);
        Departure {
            met: self.met & inside,
            place: self.place,
            direction,
        }
    }
}

/// The crossing of a line at a place, under the local direction cosines p and q.
#[inline(always)]
pub(super) fn crossing(inside: bool, place: (f64, f64), p: f64, q: f64) -> Crossing {
    let (s1, s2) = place;
    let met = inside & (0.0..=1.0).contains(&s1) & (0.0..=1.0).contains(&s2);
    Crossing {
        met,
        place: [s1, s2],
        cosines: [p, q],
    }
}

/// Points on the rim of a disk may come out of its square by rounding.
#[inline(always)]
pub(super) fn clamped((u, v): (f64, f64)) -> (f64, f64) {
    (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}

/// Distance along a line at which it leaves a part, and the cosine under which the part's area is seen from where the line
/// begins; the distance is NaN if it does not leave it.
pub type Left = (f64, f64);

/// That of a line that leaves the part only if it is `met`.
#[inline(always)]
pub(super) fn left(met: bool, t: f64, cosine: f64) -> Left {
    (if met { t } else { f64::NAN }, cosine)
}
