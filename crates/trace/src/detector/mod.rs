//! Detectors: what records light and does not change it. Each kind is a file that implements [`Kind`], and a line of `kinds!`.

mod arrivals;
mod escapes;
mod events;
mod exitance;
mod illuminance;
mod image;
mod intensity;
mod kind;
mod rays;

pub use arrivals::Arrivals;
pub use escapes::Escapes;
pub use events::Events;
pub use exitance::Exitance;
pub use illuminance::Illuminance;
pub use image::{Image, Portion};
pub use intensity::{FarFieldNodes, Intensity};
pub use kind::{Kind, Light, Recorded, Scatter, Wants};
pub use rays::Rays;

macro_rules! kinds {
    ($($(#[$meaning:meta])+ $name:ident,)+) => {
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
    };
}

kinds! {
    /// Every ray that passes a face.
    Rays,
    /// Flux that arrives on a rectangle, by cells.
    Illuminance,
    /// Every ray that leaves the scene.
    Escapes,
    /// Flux that leaves the scene, by nodes of the far field.
    Intensity,
    /// Luminance of the pixels of an observer.
    Image,
    /// Light that smooth surfaces send to diffuse ones.
    Arrivals,
    /// Flux that diffuse surfaces send out, by cells of patches.
    Exitance,
    /// Scatter events, to be seen later from anywhere.
    Events,
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
