//! A part of a carrier surface: a shape, and where it stands.

use etendue_math::{Frame, Vec3};

use super::beam::Beam;
use super::chart::{Chart, Departure};
use super::disk::Disk;
use super::focus::Focus;
use super::hemisphere::Hemisphere;
use super::rectangle::Rectangle;
use super::tube::Tube;

/// The shape of a part in its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Flat, with corners.
    Rectangle(Rectangle),
    /// Flat and round.
    Disk(Disk),
    /// Half a sphere.
    Hemisphere(Hemisphere),
    /// The side of a cylinder.
    Tube(Tube),
}

/// What is asked of the chart of a shape, whichever it is.
macro_rules! of_chart {
    ($shape:expr, $chart:ident => $asked:expr) => {
        match $shape {
            Shape::Rectangle($chart) => $asked,
            Shape::Disk($chart) => $asked,
            Shape::Hemisphere($chart) => $asked,
            Shape::Tube($chart) => $asked,
        }
    };
}
pub(super) use of_chart;

/// One chart of a carrier surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarrierPart {
    /// Where the part stands.
    pub frame: Frame,
    /// What it is.
    pub shape: Shape,
    /// The directions that it takes.
    pub beam: Beam,
}

impl CarrierPart {
    /// Area \[mm²\].
    #[must_use]
    pub fn area(&self) -> f64 {
        of_chart!(self.shape, chart => chart.area())
    }

    /// Largest distance of a place of the part from the origin of its frame \[mm\]. Where the depth of places changes with
    /// direction, lines near the horizon may cross the plane farther out.
    #[must_use]
    pub fn reach(&self) -> f64 {
        of_chart!(self.shape, chart => chart.reach())
    }

    /// The corners of a box along the axes of the part's frame that holds all its places: those of low x first, as
    /// [`Bounds::corners`](etendue_geometry::bounds::Bounds::corners) has them.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        let (x, y, [low, high]) = of_chart!(self.shape, chart => chart.extent());
        std::array::from_fn(|i| {
            let side = |bit: usize, length: f64| if i & bit == 0 { -length } else { length };
            let z = if i & 1 == 0 { low } else { high };
            self.frame.point_to_world(Vec3::new(side(4, x), side(2, y), z))
        })
    }

    /// Étendue \[mm² sr\] of all light that can leave the part: its area, times π and the share of direction cosines that it takes.
    #[must_use]
    pub fn etendue(&self) -> f64 {
        std::f64::consts::PI * self.beam.share() * self.area()
    }

    /// Whether the first coordinate closes upon itself.
    #[must_use]
    pub const fn wraps(&self) -> bool {
        matches!(self.shape, Shape::Tube(_))
    }

    /// The depth of its places, by the inclination of their lines.
    #[inline(always)]
    fn focus(&self) -> Focus {
        of_chart!(self.shape, chart => chart.focus())
    }

    /// A point of the line that leaves the part at the place of this point and normal under this cosine.
    #[must_use]
    pub fn leaving(&self, point: Vec3, normal: Vec3, cosine: f64) -> Vec3 {
        point + normal * self.focus().at(cosine)
    }

    /// Where the line that leaves at a place and goes to `p` leaves the part, and the cosine by which the area of its place is
    /// seen from `p`; None if there is no such line.
    ///
    /// The cosine holds the change of depth with direction, so that cosine · area / distance² is the solid angle.
    #[must_use]
    pub fn seen_from(&self, place: [f64; 2], p: Vec3) -> Option<(Vec3, f64)> {
        let (point, normal) = self.stand(place);
        let away = p - point;
        let focus = self.focus();
        if focus == Focus::default() {
            let cosine = away.dot(normal) / away.length();
            return (cosine > 0.0).then_some((point, cosine));
        }
        let height = away.dot(normal);
        let across = away - normal * away.dot(normal);
        let cosine = focus.aim(across.length(), height)?;
        let seen = focus.seen(cosine, height);
        let sharp = point + normal * focus.at(cosine);
        let k = (p - sharp).normalized();
        (seen > 0.0 && height > 0.0).then_some((p - k * (height / cosine), seen))
    }

    /// Where the line through `position` along `direction` leaves the part.
    #[inline]
    #[must_use]
    pub fn cross(&self, position: Vec3, direction: Vec3) -> Departure {
        let (o, d) = self.localise(position, direction);
        of_chart!(self.shape, chart => chart.cross(o, d)).within(&self.beam)
    }

    /// A line in the coordinates of the part.
    #[inline(always)]
    pub(super) fn localise(&self, position: Vec3, direction: Vec3) -> (Vec3, Vec3) {
        (
            self.frame.point_to_local(position),
            self.frame.direction_to_local(direction),
        )
    }

    /// The point at chart coordinates (s₁, s₂), and the direction at (a, b) there: the inverse of [`Self::cross`].
    #[must_use]
    pub fn ray(&self, place: [f64; 2], direction: [f64; 2]) -> (Vec3, Vec3) {
        self.leave_along(place, self.beam.cosines(direction))
    }

    /// The point at a place, and the normal there.
    #[must_use]
    pub fn stand(&self, place: [f64; 2]) -> (Vec3, Vec3) {
        self.leave_along(place, [0.0, 0.0, 1.0])
    }

    fn leave_along(&self, place: [f64; 2], cosines: [f64; 3]) -> (Vec3, Vec3) {
        let (point, k) = of_chart!(self.shape, chart => chart.ray(place, cosines));
        (self.frame.point_to_world(point), self.frame.direction_to_world(k))
    }
}
