//! An orthonormal frame in space.

use crate::Vec3;

/// A right-handed orthonormal frame: where it stands and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Where the frame stands \[mm\].
    pub origin: Vec3,
    /// Unit vector along the frame's x axis.
    pub x: Vec3,
    /// Unit vector along the frame's y axis.
    pub y: Vec3,
    /// Unit vector along the frame's z axis.
    pub z: Vec3,
}

impl Frame {
    /// Whether its axes are those of the world.
    #[inline]
    #[must_use]
    pub fn is_straight(&self) -> bool {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[x, y, z]| Vec3::new(x, y, z));
        [self.x, self.y, self.z] == [x, y, z]
    }

    /// The components of a world direction along the frame's axes.
    #[inline(always)]
    #[must_use]
    pub fn direction_to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// The coordinates of a world point in the frame.
    #[inline(always)]
    #[must_use]
    pub fn point_to_local(&self, p: Vec3) -> Vec3 {
        self.direction_to_local(p - self.origin)
    }

    /// The world direction with these components along the frame's axes.
    #[inline(always)]
    #[must_use]
    pub fn direction_to_world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// The world point with these coordinates in the frame.
    #[inline(always)]
    #[must_use]
    pub fn point_to_world(&self, p: Vec3) -> Vec3 {
        self.origin + self.direction_to_world(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_and_world_are_inverse_for_a_turned_frame() {
        let frame = Frame {
            origin: Vec3::new(1.0, -2.0, 0.5),
            x: Vec3::new(0.6, 0.8, 0.0),
            y: Vec3::new(0.0, 0.0, 1.0),
            z: Vec3::new(0.8, -0.6, 0.0),
        };
        let p = Vec3::new(0.3, 4.0, -7.0);
        let back = frame.point_to_world(frame.point_to_local(p));
        assert!((back - p).length() < 1e-14);
        assert_eq!(frame.direction_to_local(frame.z), Vec3::new(0.0, 0.0, 1.0));
    }
}
