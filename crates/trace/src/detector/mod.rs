//! Detectors: what records light and does not change it.
//!
//! Each kind is a file that implements [`Kind`], and a line of `kinds!`. Those that can be described outside the core implement
//! [`Described`] too, and their line says what they are called there.

mod arrivals;
mod escapes;
mod events;
mod exitance;
mod illuminance;
mod image;
mod intensity;
mod kind;
mod rays;
mod record;

pub use arrivals::Arrivals;
pub use escapes::Escapes;
pub use events::Events;
pub use exitance::Exitance;
pub use illuminance::Illuminance;
pub use image::{Image, Portion};
pub use intensity::{FarFieldNodes, Intensity};
pub use kind::{Kind, Light, Recorded, Scatter, Wants};
pub use rays::Rays;
pub use record::{Described, Record};

macro_rules! kinds {
    ($($(#[$meaning:meta])+ $name:ident $(= $called:literal)?,)+) => {
        /// A detector.
        #[derive(Clone, Debug)]
        pub enum Detector {
            $($(#[$meaning])+ $name($name),)+
        }

        impl std::ops::Deref for Detector {
            type Target = dyn Kind;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$name(detector) => detector,)+
                }
            }
        }

        impl Detector {
            /// The detector of a kind that a record describes.
            ///
            /// # Errors
            ///
            /// If no kind is called so, or the record is not that of one.
            pub fn read<R: Record>(kind: &str, record: &R) -> Result<Self, R::Error> {
                match kind {
                    $($($called => $name::read(record).map(Self::$name),)?)+
                    other => Err(R::refuse(&format!("no detector is called {other}"))),
                }
            }
        }
    };
}

kinds! {
    /// Every ray that passes a face.
    Rays = "rays",
    /// Flux that arrives on a rectangle, by cells.
    Illuminance = "illuminance",
    /// Every ray that leaves the scene: a far field until it is known which nodes suit it.
    Escapes = "intensity",
    /// Flux that leaves the scene, by nodes of the far field.
    Intensity,
    /// Luminance of the pixels of an observer.
    Image = "image",
    /// Light that smooth surfaces send to diffuse ones.
    Arrivals = "arrivals",
    /// Flux that diffuse surfaces send out, by cells of patches.
    Exitance,
    /// Scatter events, to be seen later from anywhere.
    Events = "scatter",
}

impl Detector {
    /// What any of some detectors wants to be told of.
    #[must_use]
    pub fn wants_of(detectors: &[Self]) -> Wants {
        detectors
            .iter()
            .fold(Wants::default(), |wants, detector| wants.or(detector.wants()))
    }
}
