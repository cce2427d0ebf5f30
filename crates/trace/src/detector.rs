//! Detectors: what takes note of light and does not change it.

use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::shape::{Flat, Outline, Shape};
use etendue_lightfield::View;
use etendue_math::{Frame, Vec3};

use crate::exitance::Patches;
use crate::far_field::Nodes;
use crate::sharing::Sharing;

/// The part of scattered light that a light image shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Portion {
    /// All of it.
    Whole,
    /// What the reverse tracer cannot find, or leaves to the light image: of sources that cannot be seen backwards, and of all
    /// sources through smooth surfaces onto the first diffuse one.
    Unseen,
    /// Of that light, the share that lines of sight do not have.
    Shared(Sharing),
}

/// A detector.
#[derive(Clone, Debug)]
pub enum Detector {
    /// A ray collecting surface: keeps every ray that crosses it, from either side.
    Rays(Face),
    /// A rectangle in the plane z = 0 of its frame: flux that arrives on its front, by cells.
    Illuminance {
        /// Its centre and axes.
        frame: Frame,
        /// Along x \[mm\].
        width: f64,
        /// Along y \[mm\].
        height: f64,
        /// Cells along x.
        columns: u32,
        /// Cells along y; row 0 is the top, at the largest y.
        rows: u32,
    },
    /// Keeps every ray that escapes: a look at the far field before it is known which nodes suit it.
    Escapes,
    /// The far field: flux of what escapes, shared by the nodes around its direction.
    Intensity(Arc<Nodes>),
    /// The light image: every diffuse scatter, connected to the eye of an observer.
    Image {
        /// What he sees.
        view: View,
        /// Which light counts.
        portion: Portion,
    },
    /// Light that smooth surfaces send to the first diffuse one, of sources that can be seen: where it arrives, and from
    /// where.
    Arrivals,
    /// The flux that diffuse surfaces send out, by the cells of patches.
    Exitance(Arc<Patches>),
    /// Diffuse scatters, to be looked at later from anywhere.
    Events {
        /// How many are kept at most: of more, those of every second ray are dropped, as often as it takes.
        most: usize,
        /// For each face whether its scatters count; None: those of all.
        faces: Option<Vec<bool>>,
    },
}

impl Detector {
    /// The face that rays cross, if there is one.
    #[must_use]
    pub fn face(&self) -> Option<Face> {
        match self {
            Self::Rays(face) => Some(face.clone()),
            Self::Illuminance {
                frame, width, height, ..
            } => Some(Face {
                shape: Shape::Flat(Flat {
                    outline: Outline::Rectangle {
                        width: *width,
                        height: *height,
                    },
                }),
                frame: *frame,
                trims: vec![],
                flipped: false,
            }),
            Self::Escapes
            | Self::Intensity(_)
            | Self::Image { .. }
            | Self::Arrivals
            | Self::Exitance(_)
            | Self::Events { .. } => None,
        }
    }

    /// Whether it wants to know of light at diffuse surfaces.
    #[must_use]
    pub const fn watches_scatter(&self) -> bool {
        matches!(
            self,
            Self::Image { .. } | Self::Arrivals | Self::Exitance(_) | Self::Events { .. }
        )
    }

    /// Whether it wants to know how bright the sources of rays are.
    #[must_use]
    pub const fn shares(&self) -> bool {
        matches!(
            self,
            Self::Arrivals
                | Self::Image {
                    portion: Portion::Shared(_),
                    ..
                }
        )
    }

    /// Whether it wants to know of light that leaves the scene.
    #[must_use]
    pub const fn watches_escape(&self) -> bool {
        matches!(self, Self::Escapes | Self::Intensity(_))
    }

    /// Number of cells that flux is summed in.
    #[must_use]
    pub fn cells(&self) -> usize {
        match self {
            Self::Rays(_) | Self::Escapes | Self::Arrivals | Self::Events { .. } => 0,
            Self::Illuminance { columns, rows, .. } => *columns as usize * *rows as usize,
            Self::Intensity(nodes) => nodes.cells(),
            Self::Image { view, .. } => view.pixels(),
            Self::Exitance(patches) => patches.cells(),
        }
    }
}

/// The cell of an illuminance detector that a point of it lies in, for light along `d`; None if it arrives from behind.
#[must_use]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "inside the number of cells"
)]
pub fn illuminance_cell(frame: &Frame, size: [f64; 2], cells: [u32; 2], point: Vec3, d: Vec3) -> Option<u32> {
    if d.dot(frame.z) >= 0.0 {
        return None;
    }
    let p = frame.point_to_local(point);
    let along = |x: f64, size: f64, n: u32| (((x / size + 0.5) * f64::from(n)) as u32).min(n - 1);
    let column = along(p.x, size[0], cells[0]);
    let row = along(-p.y, size[1], cells[1]);
    Some(row * cells[0] + column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_counted_from_the_top_left() {
        let frame = Frame {
            origin: Vec3::new(1.0, 2.0, 3.0),
            x: Vec3::new(1.0, 0.0, 0.0),
            y: Vec3::new(0.0, 1.0, 0.0),
            z: Vec3::new(0.0, 0.0, 1.0),
        };
        let cell = |x, y, dz| {
            illuminance_cell(
                &frame,
                [4.0, 2.0],
                [4, 2],
                Vec3::new(x, y, 3.0),
                Vec3::new(0.0, 0.0, dz),
            )
        };
        assert_eq!(cell(-0.9, 2.9, -1.0), Some(0));
        assert_eq!(cell(2.9, 2.9, -1.0), Some(3));
        assert_eq!(cell(-0.9, 1.1, -1.0), Some(4));
        assert_eq!(cell(0.5, 2.5, 1.0), None);
    }
}
