//! What is traced: faces with their optical properties, solids with their media, sources.

use std::collections::HashMap;
use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::FaceSet;
use etendue_geometry::bounds::Bounds;
use etendue_geometry::shape::ROUNDING;
use etendue_math::Vec3;
use etendue_optics::bsdf::{Bsdf, Facts};
use etendue_optics::medium::Medium;
use etendue_optics::source::Source;

/// A ray starts on a face if it starts no farther from it than this, in units of |x| + |y| + |z|: what rounding does to points
/// that come through several frames.
pub const START: f64 = 64.0 * ROUNDING;

/// What a face does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// It is a surface with optical properties: a finish, by its number.
    Optical(u32),
    /// It belongs to a detector, by its number; rays pass it unchanged.
    Detect(u32),
}

/// What the tracer knows of a face besides its geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role {
    /// The solid it bounds, numbered from 1; 0 for a sheet.
    pub solid: u16,
    /// What it does.
    pub act: Act,
}

/// Solids of a scene: their numbers from 1 have sixteen bits in a [`SolidStack`](crate::solid_stack::SolidStack).
pub const MOST_SOLIDS: usize = u16::MAX as usize - 1;

/// A scene, complete and unchanging.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Every face: those of the scene, then those of its detectors.
    pub face_set: FaceSet,
    /// One for each face.
    pub roles: Vec<Role>,
    /// For each face, the direction that the first axis of its BSDF follows, if that matters.
    pub axes: Vec<Option<Vec3>>,
    /// Optical properties.
    pub finishes: Vec<Arc<dyn Bsdf>>,
    /// Media; the first one fills the surroundings.
    pub media: Vec<Medium>,
    /// The medium of each solid.
    pub solids: Vec<u32>,
    /// What emits.
    pub sources: Vec<Source>,
    /// For each source, the faces that its rays may start on, and those of the solids that they may start in.
    pub near: Vec<Vec<u32>>,
}

/// A face and what it does, as a scene is made of.
#[derive(Clone, Debug)]
pub struct SceneFace {
    /// The face.
    pub face: Face,
    /// The solid it bounds, numbered from 0; None for a sheet.
    pub solid: Option<usize>,
    /// Number of its finish.
    pub finish: usize,
    /// The direction that the first axis of its BSDF follows along the surface, if that matters.
    pub axis: Option<Vec3>,
}

/// The faces that rays of a source may start on or in, by the boxes around them.
#[allow(clippy::cast_possible_truncation, reason = "a scene has fewer than 2^32 faces")]
fn near(source: &Source, face_set: &FaceSet, roles: &[Role]) -> Vec<u32> {
    let around = source.bounds();
    // A ray starts on a sheet if it starts no farther from it than rounding may have moved it (see `ray_start`).
    let reach = 4.0
        * START
        * [around.lo, around.hi]
            .map(|p| p.x.abs() + p.y.abs() + p.z.abs())
            .iter()
            .sum::<f64>();
    // A box around each solid.
    let mut solids: HashMap<u16, Bounds> = HashMap::new();
    for (role, bounds) in roles.iter().zip(face_set.bounds()) {
        let all = solids.entry(role.solid).or_insert(Bounds::EMPTY);
        *all = all.union(*bounds);
    }
    let each = roles.iter().zip(face_set.faces()).zip(0..);
    each.filter(|((role, face), _)| {
        if role.solid == 0 {
            !around.is_finite() || face.may_touch(around.widened(reach))
        } else {
            around.touches(solids[&role.solid])
        }
    })
    .map(|(_, index)| index)
    .collect()
}

impl Scene {
    /// A scene from its parts. `detectors`: the face on which each detector stands, if it stands on one.
    ///
    /// # Errors
    /// Says what refers to something that does not exist, or what there is too much of.
    pub fn new(
        parts: Vec<SceneFace>,
        finishes: Vec<Arc<dyn Bsdf>>,
        media: Vec<Medium>,
        solids: Vec<u32>,
        sources: Vec<Source>,
        detectors: Vec<Option<Face>>,
    ) -> Result<Self, String> {
        if media.is_empty() {
            return Err("a scene needs at least the medium of its surroundings".into());
        }
        if solids.len() > MOST_SOLIDS {
            return Err(format!("{} solids; a scene has {MOST_SOLIDS} at most", solids.len()));
        }
        if let Some(medium) = solids.iter().find(|m| **m as usize >= media.len()) {
            return Err(format!("a solid of medium {medium}; there are {}", media.len()));
        }
        if parts.len() + detectors.len() >= (u32::MAX / 2) as usize {
            return Err(format!("{} faces", parts.len()));
        }
        let (mut faces, mut roles, mut axes) = (Vec::new(), Vec::new(), Vec::new());
        for (number, part) in parts.into_iter().enumerate() {
            let solid = part.solid.map_or(0, |s| s + 1);
            if solid > solids.len() || part.finish >= finishes.len() {
                return Err(format!("face {number} names a solid or a finish that does not exist"));
            }
            #[allow(clippy::cast_possible_truncation, reason = "checked above")]
            roles.push(Role {
                solid: solid as u16,
                act: Act::Optical(part.finish as u32),
            });
            faces.push(part.face);
            axes.push(part.axis);
        }
        for (number, face) in detectors.into_iter().enumerate() {
            if let Some(face) = face {
                #[allow(clippy::cast_possible_truncation, reason = "checked above")]
                roles.push(Role {
                    solid: 0,
                    act: Act::Detect(number as u32),
                });
                faces.push(face);
                axes.push(None);
            }
        }
        let face_set = FaceSet::new(faces);
        let near = sources.iter().map(|source| near(source, &face_set, &roles)).collect();
        Ok(Self {
            face_set,
            roles,
            axes,
            finishes,
            media,
            solids,
            sources,
            near,
        })
    }

    /// Whether light can reach a diffuse surface in a way that lines of sight find by chance, or not at all: through smooth
    /// surfaces, or from a source that cannot be seen.
    #[must_use]
    pub fn may_focus(&self) -> bool {
        let may_redirect = || self.may_reflect() || !self.sources.iter().all(Source::is_visible);
        self.any_finish(Facts::is_diffuse) && may_redirect()
    }

    /// Whether there are surfaces that mirror or refract light.
    #[must_use]
    pub fn may_reflect(&self) -> bool {
        self.any_finish(Facts::is_specular)
    }

    fn any_finish(&self, test: fn(&Facts) -> bool) -> bool {
        let is = |finish: u32| test(self.finishes[finish as usize].facts());
        self.roles
            .iter()
            .any(|role| matches!(role.act, Act::Optical(finish) if is(finish)))
    }

    /// Of each face whether it is a smooth interface of a solid, which light meets at the normal of the surface itself.
    #[must_use]
    pub fn interfaces(&self) -> Vec<bool> {
        let smooth = |finish: u32| self.finishes[finish as usize].facts().fresnel;
        let interface = |(role, face): (&Role, &Face)| {
            role.solid != 0 && !face.shape.is_smooth() && matches!(role.act, Act::Optical(finish) if smooth(finish))
        };
        self.roles.iter().zip(self.face_set.faces()).map(interface).collect()
    }

    /// The medium that fills the space of a solid, 0 being the surroundings.
    #[inline]
    #[must_use]
    pub fn medium(&self, solid: u16) -> usize {
        if solid == 0 {
            0
        } else {
            self.solids[usize::from(solid) - 1] as usize
        }
    }
}
