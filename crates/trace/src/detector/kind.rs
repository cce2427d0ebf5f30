//! What a detector is asked and told.

use etendue_geometry::Face;
use etendue_math::Vec3;

use crate::events::{EventReservoir, ScatterEvent};
use crate::exitance_cells::FacePoint;
use crate::guide::Arrival;
use crate::medium_cache::MediumCache;
use crate::ray_state::RayState;
use crate::records::{Cell, CollectedRay, Contribution};
use crate::scatter::SurfaceEvent;
use crate::scene::Scene;

/// What a detector has to be told of, besides rays that pass its face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "one for each thing that there is to be told"
)]
pub struct Wants {
    /// Light that leaves the scene.
    pub escapes: bool,
    /// Light that meets diffuse surfaces.
    pub scatters: bool,
    /// How much of it each sends out.
    pub exitance: bool,
    /// How bright the source of each ray is.
    pub brightness: bool,
}

impl Wants {
    /// Light that leaves the scene.
    pub const ESCAPES: Self = Self {
        escapes: true,
        scatters: false,
        exitance: false,
        brightness: false,
    };

    /// Light that meets diffuse surfaces.
    pub const SCATTERS: Self = Self {
        escapes: false,
        scatters: true,
        exitance: false,
        brightness: false,
    };

    /// How much diffuse surfaces send out.
    pub const EXITANCE: Self = Self {
        escapes: false,
        scatters: false,
        exitance: true,
        brightness: false,
    };

    /// What either wants.
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        Self {
            escapes: self.escapes || other.escapes,
            scatters: self.scatters || other.scatters,
            exitance: self.exitance || other.exitance,
            brightness: self.brightness || other.brightness,
        }
    }
}

/// A ray where it is told of.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    /// Where it goes.
    pub direction: Vec3,
    /// What it carries.
    pub state: &'a RayState,
}

impl Light<'_> {
    /// The ray as it is kept, at a point \[mm\].
    #[must_use]
    pub fn at(&self, point: Vec3) -> CollectedRay {
        let d = self.direction;
        CollectedRay {
            position: [point.x, point.y, point.z],
            direction: [d.x, d.y, d.z],
            flux: self.state.flux,
            wavelength: self.state.wavelength,
        }
    }
}

/// Light that meets a diffuse surface.
pub struct Scatter<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its media.
    pub media: &'a mut MediumCache,
    /// The surface, and what becomes of the light there.
    pub met: &'a SurfaceEvent<'a>,
    /// What an observer needs to know of it.
    pub event: ScatterEvent,
    /// The ray.
    pub light: Light<'a>,
}

/// What a detector has recorded of a batch.
#[derive(Clone, Debug, Default)]
pub struct Recorded {
    /// Contributions to its cells, by ray.
    pub contributions: Vec<Contribution>,
    /// Sums over all of its cells, stratum by stratum, if they are formed (see [`Kind::sums_up`]).
    pub whole: Vec<Cell>,
    /// Rays.
    pub rays: Vec<CollectedRay>,
    /// Their numbers in the run, if what they bring to the last cell is to be summed up.
    pub numbers: Vec<u64>,
    /// Scatter events.
    pub events: EventReservoir,
    /// Light that smooth surfaces sent to diffuse ones.
    pub arrivals: Vec<Arrival>,
}

impl Recorded {
    /// Nothing yet, of one of `batches` batches that have room for so many scatter events together.
    #[must_use]
    pub fn of_batch(most_events: usize, batches: u64) -> Self {
        Self {
            events: EventReservoir::of_batch(most_events, batches),
            ..Self::default()
        }
    }

    /// What the rays contribute that are kept with their numbers.
    #[must_use]
    pub fn of_rays(&self) -> Vec<Contribution> {
        let of_ray = |(ray, unit): (&CollectedRay, &u64)| Contribution {
            cell: 0,
            unit: *unit,
            amount: ray.flux,
            flux: ray.flux,
        };
        self.rays.iter().zip(&self.numbers).map(of_ray).collect()
    }

    /// What a ray contributes to a cell.
    #[inline]
    pub fn contribute(&mut self, cell: u32, state: &RayState, amount: f64) {
        self.contributions.push(Contribution {
            cell,
            unit: state.ray,
            amount,
            flux: state.flux,
        });
    }
}

/// A kind of detector. Whatever it is told of, light goes on as if it were not there.
pub trait Kind {
    /// The face that rays pass, if it stands on one.
    fn face(&self) -> Option<Face> {
        None
    }

    /// Number of cells that flux is summed in.
    fn cells(&self) -> usize {
        0
    }

    /// Whether its last cell is given all that the others have, or that its rays bring, when a batch is done.
    fn sums_up(&self) -> bool {
        false
    }

    /// Scatter events that it holds at most.
    fn most_events(&self) -> usize {
        0
    }

    /// What it has to be told of.
    fn wants(&self) -> Wants {
        Wants::default()
    }

    /// A ray passes its face at a point \[mm\].
    fn passing(&self, _light: &Light<'_>, _point: Vec3, _out: &mut Recorded) {}

    /// A ray leaves the scene.
    fn escape(&self, _light: &Light<'_>, _out: &mut Recorded) {}

    /// A ray meets a diffuse surface.
    fn scatter(&self, _scatter: &mut Scatter<'_>, _out: &mut Recorded) {}

    /// A ray meets a sheet that sends light back from this side, with the share of its product (see `Parts`).
    fn sheet(&self, _scene: &Scene, _place: FacePoint, _share: f64, _state: &RayState, _out: &mut Recorded) {}
}
