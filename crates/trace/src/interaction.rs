//! A ray meets faces: which of them decides, and what it passes from and to.
//!
//! Faces may coincide: a lens on a dome, a die in its silicone. Crossings that rounding cannot tell apart are one event. Its
//! rules: detectors take note first. Each solid whose faces agree is entered or left. A sheet decides before solids, the one
//! listed last before the others; else the face of the last listed solid among those crossed decides, unless the space on
//! both sides belongs to the same, later listed solid: then the face is hidden.

use etendue_geometry::hits::{Hits, TIE};
use etendue_geometry::origin_faces::OriginFaces;
use etendue_geometry::ray_block::RayBlock;
use etendue_geometry::shape::{Crossing, ROUNDING};
use etendue_math::Vec3;
use etendue_optics::fresnel::{reflect, refract};

use crate::ledger::Loss;
use crate::scene::{Act, Scene};
use crate::solid_stack::SolidStack;

/// Crossings in one event.
type Group = Vec<(u32, Crossing)>;

/// Surfaces that light may meet as meshes with interpolated normals; whatever it meets after them has its own normal.
///
/// Mirrored at an interpolated normal, a bundle of étendue dA cos θ dω leaves with dA cos θ' dω: θ and θ' are angles on the
/// triangle and differ by up to twice that between both normals. What shrinks in one place grows in another, but a long chain
/// of total reflections may settle on a closed way where each round shrinks it: light that came in through the surface then
/// never leaves, which no surface does to it. At the triangles' own normals étendue is kept, so such a way holds nothing that
/// came in from outside.
const INTERPOLATED: u32 = 1000;

/// What a ray is at when it meets faces.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Where.
    pub point: Vec3,
    /// Unit normal of the deciding face, against the ray: that which a mesh states at its corners, interpolated, if it does.
    pub normal: Vec3,
    /// The normal of the surface itself, against the ray.
    pub side: Vec3,
    /// The deciding face; the first one met, if none decides.
    pub face: u32,
    /// Its part that is met (a triangle of a mesh).
    pub part: u32,
    /// Whether the ray meets the front of the deciding face.
    pub front: bool,
    /// The finish of the deciding face; None: the ray goes on as if nothing were there.
    pub finish: Option<u32>,
    /// The solids on this side.
    pub before: SolidStack,
    /// The solids on the other side.
    pub after: SolidStack,
    /// What a ray that goes on from here starts on.
    pub origin_faces: OriginFaces,
    /// Distance travelled \[mm\].
    pub t: f64,
}

impl Interaction {
    /// As it is for light that has met `events` surfaces before, forwards and backwards alike: see [`INTERPOLATED`].
    #[inline(always)]
    pub fn limit_interpolation(&mut self, events: u32) {
        if events >= INTERPOLATED {
            self.normal = self.side;
        }
    }

    /// The direction of light that arrived along `d` and was mirrored.
    #[inline]
    #[must_use]
    pub fn mirrored(&self, d: Vec3, cosine: f64) -> Vec3 {
        self.on_its_side(reflect(d, self.normal, cosine), 1.0)
    }

    /// The direction of light that arrived along `d` and was refracted; `across` is the cosine of the angle of refraction.
    #[inline]
    #[must_use]
    pub fn refracted(&self, d: Vec3, cosine: f64, ratio: f64, across: f64) -> Vec3 {
        if ratio == 1.0 {
            return d;
        }
        self.on_its_side(refract(d, self.normal, cosine, ratio, across), -1.0)
    }

    /// An interpolated normal may send light to the wrong side of the surface; then its direction is mirrored on the surface.
    #[inline]
    fn on_its_side(&self, d: Vec3, sign: f64) -> Vec3 {
        let height = d.dot(self.side);
        if height * sign < 0.0 {
            d - self.side * (2.0 * height)
        } else {
            d
        }
    }
}

/// Looks for faces that ray `i` of a block meets together with the nearest one, and settles what happens.
///
/// `detected` is called with each detector that the ray passes, its face's normal and the point.
///
/// # Errors
/// The reason and the face, if the ray is lost.
#[inline(always)]
pub fn interaction_of(
    scene: &Scene,
    lines: &RayBlock,
    hits: &Hits,
    i: usize,
    stack: SolidStack,
    detected: impl FnMut(u32, Vec3, Vec3),
) -> Result<Interaction, (Loss, u32)> {
    let (o, d) = (lines.origin(i), lines.direction(i));
    let nearest = (hits.face[i], hits.crossing(i));
    if hits.tied(i, o) {
        let group = tied(scene, o, d, &lines.origin_faces(i), nearest);
        decide_together(scene, o, d, &group, stack, detected)
    } else {
        single_face(scene, o, d, nearest, stack, detected)
    }
}

/// One face met alone: what [`decide_together`] comes to then, without its lists.
#[inline(always)]
fn single_face(
    scene: &Scene,
    o: Vec3,
    d: Vec3,
    (index, crossing): (u32, Crossing),
    stack: SolidStack,
    mut detected: impl FnMut(u32, Vec3, Vec3),
) -> Result<Interaction, (Loss, u32)> {
    let face = &scene.face_set.faces()[index as usize];
    let role = scene.roles[index as usize];
    let foot = face.surface_point(o, d, &crossing);
    let front = d.dot(foot.normal) < 0.0;
    let (mut after, mut finish) = (stack, None);
    match role.act {
        Act::Detect(detector) => detected(detector, foot.point, foot.normal),
        Act::Optical(number) if role.solid == 0 => finish = Some(number),
        Act::Optical(number) => {
            if front == stack.contains(role.solid) {
                if crossing.t > TIE * (o.x.abs() + o.y.abs() + o.z.abs()) {
                    return Err((Loss::Contradiction, index));
                }
            } else {
                after = stack.crossed(role.solid).ok_or((Loss::TooDeep, index))?;
                // Hidden in a solid that is listed later.
                finish = (role.solid >= stack.top().min(after.top())).then_some(number);
            }
        }
    }
    let side = if front { foot.normal } else { -foot.normal };
    let normal = face.shading_normal(&crossing).map_or(side, |n| {
        let n = if front { n } else { -n };
        if d.dot(n) < 0.0 { n } else { side }
    });
    let mut origin_faces = OriginFaces::default();
    (origin_faces.face[0], origin_faces.part[0]) = (index, crossing.part);
    Ok(Interaction {
        point: foot.point,
        normal,
        side,
        face: index,
        part: crossing.part,
        front,
        finish,
        before: stack,
        after,
        origin_faces,
        t: crossing.t,
    })
}

/// What a single ray meets first at 0 < t < `reach`; None if it meets nothing.
///
/// # Errors
/// The reason and the face, if the ray is lost.
pub fn first_interaction(
    scene: &Scene,
    o: Vec3,
    d: Vec3,
    origin_faces: &OriginFaces,
    reach: f64,
    stack: SolidStack,
) -> Result<Option<Interaction>, (Loss, u32)> {
    let Some((face, crossing, second)) = scene.face_set.first(o, d, origin_faces, reach) else {
        return Ok(None);
    };
    let length = o.x.abs() + o.y.abs() + o.z.abs() + crossing.t;
    let ignore = |_, _, _| {};
    if second - crossing.t <= TIE * length {
        let group = tied(scene, o, d, origin_faces, (face, crossing));
        decide_together(scene, o, d, &group, stack, ignore).map(Some)
    } else {
        single_face(scene, o, d, (face, crossing), stack, ignore).map(Some)
    }
}

/// The crossings that rounding cannot tell from the nearest one.
#[cold]
#[must_use]
pub fn tied(scene: &Scene, o: Vec3, d: Vec3, origin_faces: &OriginFaces, nearest: (u32, Crossing)) -> Group {
    let length = o.x.abs() + o.y.abs() + o.z.abs() + nearest.1.t;
    let reach = TIE * length;
    let mut group = vec![nearest];
    let faces = scene.face_set.faces();
    // The error of a point is that of o + t d on both lines, and that of the place of each face.
    let error = 4.0 * ROUNDING * length;
    let slack = |index: u32, crossing: &Crossing| {
        let foot = faces[index as usize].surface_point(o, d, crossing);
        error / d.dot(foot.normal).abs().max(f64::MIN_POSITIVE)
    };
    let base = slack(nearest.0, &nearest.1);
    let t = nearest.1.t;
    scene.face_set.crossings(
        o,
        d,
        [(t - reach).max(0.0), t + reach],
        origin_faces,
        |index, crossing| {
            let same = index == nearest.0 && crossing.part == nearest.1.part && crossing.t == t;
            if !same && crossing.t > 0.0 && (crossing.t - t).abs() <= (base + slack(index, &crossing)).min(reach) {
                group.push((index, crossing));
            }
        },
    );
    group
}

#[cold]
fn decide_together(
    scene: &Scene,
    o: Vec3,
    d: Vec3,
    group: &[(u32, Crossing)],
    stack: SolidStack,
    mut detected: impl FnMut(u32, Vec3, Vec3),
) -> Result<Interaction, (Loss, u32)> {
    let faces = scene.face_set.faces();
    let (mut after, mut origin_faces) = (stack, OriginFaces::default());
    // The best of what could decide: (rank, face, finish, foot), a sheet ranking above all solids.
    let mut decides: Option<(u32, usize, u32)> = None;
    let surface_point = |at: usize| {
        let (index, crossing) = &group[at];
        faces[*index as usize].surface_point(o, d, crossing)
    };
    let first = surface_point(0);
    for (at, (index, _)) in group.iter().enumerate() {
        origin_faces.add(*index, group[at].1.part);
        let role = scene.roles[*index as usize];
        match role.act {
            Act::Detect(detector) => {
                let foot = surface_point(at);
                detected(detector, foot.point, foot.normal);
            }
            Act::Optical(finish) => {
                if role.solid == 0 {
                    decides = Some((u32::MAX, at, finish));
                    continue;
                }
                if group[..at]
                    .iter()
                    .any(|(f, _)| scene.roles[*f as usize].solid == role.solid)
                {
                    continue;
                }
                match crossed(scene, group, at, role.solid, o, d, stack) {
                    Cross::No => {}
                    Cross::Against if group[0].1.t <= TIE * (o.x.abs() + o.y.abs() + o.z.abs()) || group.len() > 1 => {}
                    Cross::Against => return Err((Loss::Contradiction, *index)),
                    Cross::Yes => {
                        after = after.crossed(role.solid).ok_or((Loss::TooDeep, *index))?;
                        let rank = u32::from(role.solid);
                        if decides.is_none_or(|(best, _, _)| rank > best) {
                            decides = Some((rank, at, finish));
                        }
                    }
                }
            }
        }
    }
    let hidden = |rank: u32| rank < u32::from(stack.top().min(after.top()));
    let verdict = decides.filter(|(rank, _, _)| !hidden(*rank));
    let (face, foot) = verdict.map_or((group[0].0, first), |(_, at, _)| {
        (group[at].0, if at == 0 { first } else { surface_point(at) })
    });
    let front = d.dot(foot.normal) < 0.0;
    let side = if front { foot.normal } else { -foot.normal };
    let at = verdict.map_or(0, |(_, at, _)| at);
    let normal = faces[face as usize].shading_normal(&group[at].1).map_or(side, |n| {
        let n = if front { n } else { -n };
        // Seen from behind, an interpolated normal says nothing.
        if d.dot(n) < 0.0 { n } else { side }
    });
    Ok(Interaction {
        point: foot.point,
        normal,
        side,
        face,
        part: group[at].1.part,
        front,
        finish: verdict.map(|(_, _, finish)| finish),
        before: stack,
        after,
        origin_faces,
        t: group[0].1.t,
    })
}

enum Cross {
    /// The solid is touched only: entered and left at once.
    No,
    /// It is crossed, as the ray could.
    Yes,
    /// Its faces say that the ray enters a solid that it is in, or leaves one that it is not in.
    Against,
}

/// What the faces of one solid in a group say, the first of them being `at`.
fn crossed(
    scene: &Scene,
    group: &[(u32, Crossing)],
    at: usize,
    solid: u16,
    o: Vec3,
    d: Vec3,
    stack: SolidStack,
) -> Cross {
    let faces = scene.face_set.faces();
    let (mut enters, mut leaves) = (false, false);
    for (index, crossing) in &group[at..] {
        if scene.roles[*index as usize].solid == solid {
            let inward = d.dot(faces[*index as usize].surface_point(o, d, crossing).normal) < 0.0;
            (enters, leaves) = (enters | inward, leaves | !inward);
        }
    }
    if enters && leaves {
        Cross::No
    } else if leaves == stack.contains(solid) {
        Cross::Yes
    } else {
        Cross::Against
    }
}
