//! Diffuse surfaces cut into patches, and these into bins: the cells in which exitance is summed.

use etendue_geometry::Face;
use etendue_geometry::shape::chart::{BINS, Chart};
use etendue_math::Vec3;

/// The diffuse surfaces of a scene, cut into patches with a front and a back.
#[derive(Clone, Debug)]
pub struct ExitanceCells {
    /// For each face that is cut: its chart, and the first of its bins.
    pub faces: Vec<Option<(Chart, u32)>>,
    /// Of all faces.
    pub bins: u32,
    /// \[nm\], rising; a single one stands for all.
    pub wavelengths: Vec<f64>,
}

impl ExitanceCells {
    /// Cuts each face into patches of the given area, if it has one.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "limited by the number of rays")]
    pub fn cut(faces: &[Face], wavelengths: Vec<f64>, areas: &[Option<f64>]) -> Self {
        let mut bins = 0;
        let cut = |(face, area): (&Face, &Option<f64>)| {
            let chart = Chart::new(&face.shape, (*area)?)?;
            let first = bins;
            bins += chart.areas().len() as u32 * BINS;
            Some((chart, first))
        };
        Self {
            faces: faces.iter().zip(areas).map(cut).collect(),
            bins,
            wavelengths,
        }
    }

    /// Number of cells: of each side of each bin, two for each wavelength.
    #[must_use]
    pub fn cells(&self) -> usize {
        4 * self.bins as usize * self.wavelengths.len()
    }

    /// The side of the bin that a point of a face lies in.
    #[must_use]
    pub fn side(&self, faces: &[Face], place: FacePoint) -> Option<u32> {
        let (chart, first) = self.faces.get(place.face as usize)?.as_ref()?;
        let face = &faces[place.face as usize];
        let bin = first + chart.bin(face.frame.point_to_local(place.point), place.part);
        Some(2 * bin + u32::from(place.front))
    }

    /// The number of the wavelength next to one; None if there are none.
    fn nearest(&self, wavelength: f64) -> Option<usize> {
        let last = self.wavelengths.len().checked_sub(1)?;
        let above = self.wavelengths.partition_point(|one| *one < wavelength).min(last);
        let below = above.saturating_sub(1);
        let [low, high] = [below, above].map(|line| (self.wavelengths[line] - wavelength).abs());
        Some(if low < high { below } else { above })
    }

    /// The cell of light of a wavelength, or of the one nearest to it, that leaves a point of a face; light that the reverse tracer
    /// may leave to the light image has cells of its own.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, reason = "a cell has a number below 2^32")]
    pub fn cell(&self, faces: &[Face], place: FacePoint, wavelength: f64, unseen: bool) -> Option<u32> {
        let line = self.nearest(wavelength)?;
        let cell = self.side(faces, place)? * self.wavelengths.len() as u32 + line as u32;
        Some(2 * cell + u32::from(unseen))
    }
}

/// A point of a face, and the side of it that light leaves.
#[derive(Clone, Copy, Debug)]
pub struct FacePoint {
    /// The face.
    pub face: u32,
    /// Its part.
    pub part: u32,
    /// Whether it is the face's front.
    pub front: bool,
    /// \[mm\].
    pub point: Vec3,
}
