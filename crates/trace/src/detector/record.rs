//! A detector as it is described outside the core: values under keys.

use etendue_geometry::Face;
use etendue_lightfield::View;
use etendue_math::Frame;

/// A description that a detector is read from.
pub trait Record {
    /// What is told of a description that cannot be read.
    type Error;

    /// A complaint about the description.
    fn refuse(message: &str) -> Self::Error;

    /// The number under a key.
    ///
    /// # Errors
    ///
    /// If there is none.
    fn number(&self, key: &str) -> Result<f64, Self::Error>;

    /// The number under a key, if there is one.
    ///
    /// # Errors
    ///
    /// If something else stands there.
    fn optional_number(&self, key: &str) -> Result<Option<f64>, Self::Error>;

    /// The whole number, 0 or more, under a key.
    ///
    /// # Errors
    ///
    /// If there is none.
    fn whole(&self, key: &str) -> Result<usize, Self::Error>;

    /// Whether a key says yes; no if it is not there.
    ///
    /// # Errors
    ///
    /// If something else stands there.
    fn flag(&self, key: &str) -> Result<bool, Self::Error>;

    /// For each face of the scene whether its number stands in the list under a key; None: there is no list.
    ///
    /// # Errors
    ///
    /// If the list names a face that the scene has not.
    fn listed_faces(&self, key: &str) -> Result<Option<Vec<bool>>, Self::Error>;

    /// The view under a key.
    ///
    /// # Errors
    ///
    /// If there is none.
    fn view(&self, key: &str) -> Result<View, Self::Error>;

    /// Where the detector stands.
    ///
    /// # Errors
    ///
    /// If the description does not say.
    fn frame(&self) -> Result<Frame, Self::Error>;

    /// Its shape in its place.
    ///
    /// # Errors
    ///
    /// If the description does not say.
    fn face(&self) -> Result<Face, Self::Error>;
}

/// Kinds of detectors that can be described.
pub trait Described: Sized {
    /// The detector that a record describes.
    ///
    /// # Errors
    ///
    /// If something is missing, or is not what it should be.
    fn read<R: Record>(record: &R) -> Result<Self, R::Error>;
}
