//! Where a ray starts: in which solids, on which faces.

use etendue_geometry::origin_faces::{MOST_ORIGIN_FACES, NONE, OriginFaces};
use etendue_geometry::shape::Crossing;
use etendue_math::Vec3;

use crate::ledger::Loss;
use crate::scene::{START, Scene};
use crate::solid_stack::SolidStack;

/// The solids that a ray starts in, and the faces that it starts on.
///
/// A start point on a face is on the side that the ray goes to.
///
/// # Errors
/// If it is in more than four solids.
pub fn place(scene: &Scene, o: Vec3, d: Vec3) -> Result<(SolidStack, OriginFaces), (Loss, u32)> {
    let mut start = Start::new(o, d);
    scene.face_set.crossings(
        o,
        d,
        [-start.reach, f64::INFINITY],
        &OriginFaces::default(),
        |index, crossing| {
            start.note(scene, index, crossing);
        },
    );
    start.settled(scene)
}

/// The solids that an observer is in who looks at `target`, and the faces that the observer is on.
///
/// Views are often aimed at an edge or a corner, and of two faces that meet there a line may cross one and miss the other. So
/// lines beside that one are asked, and what most of them say counts.
///
/// # Errors
/// If most of them say that the observer is in more than four solids.
pub fn place_observer(scene: &Scene, o: Vec3, target: Vec3) -> Result<(SolidStack, OriginFaces), (Loss, u32)> {
    let toward = (target - o).normalized();
    let answers = BESIDE.map(|off| place(scene, o, (toward + off).normalized()));
    let mut best = answers[0];
    let votes = |answer| answers.iter().filter(|other| **other == answer).count();
    for answer in &answers[1..] {
        if votes(*answer) > votes(best) {
            best = *answer;
        }
    }
    best
}

/// How directions differ from that in which an observer looks: about a degree, and none along what scenes are built along.
const BESIDE: [Vec3; 5] = [
    Vec3::new(0.0137, -0.0059, 0.0083),
    Vec3::new(-0.0071, 0.0149, 0.0031),
    Vec3::new(-0.0043, -0.0107, -0.0131),
    Vec3::new(0.0097, 0.0023, -0.0151),
    Vec3::new(0.0029, 0.0113, 0.0127),
];

/// As [`place`], for a ray that can start only on or in what the faces in `near` say.
///
/// # Errors
/// If it is in more than four solids.
#[inline]
pub fn start_near(scene: &Scene, o: Vec3, d: Vec3, near: &[u32]) -> Result<(SolidStack, OriginFaces), (Loss, u32)> {
    if near.is_empty() {
        return Ok((SolidStack::default(), OriginFaces::default()));
    }
    let mut start = Start::new(o, d);
    for &index in near {
        let solid = scene.roles[index as usize].solid != 0;
        if !solid && !scene.face_set.faces()[index as usize].may_hold(o, start.reach) {
            continue;
        }
        let range = [-start.reach, if solid { f64::INFINITY } else { start.reach }];
        scene.face_set.faces()[index as usize].crossings(o, d, range, &[], |crossing| {
            start.note(scene, index, crossing);
        });
    }
    start.settled(scene)
}

/// What is known of a start point.
struct Start {
    o: Vec3,
    d: Vec3,
    /// Crossings no farther than this are at the start itself.
    reach: f64,
    origin_faces: OriginFaces,
    /// The nearest crossing of each solid ahead tells whether the ray leaves it there.
    nearest: Vec<(u16, u32, Crossing)>,
}

impl Start {
    const fn new(o: Vec3, d: Vec3) -> Self {
        Self {
            o,
            d,
            reach: START * (o.x.abs() + o.y.abs() + o.z.abs()),
            origin_faces: OriginFaces {
                face: [NONE; MOST_ORIGIN_FACES],
                part: [NONE; MOST_ORIGIN_FACES],
            },
            nearest: Vec::new(),
        }
    }

    fn note(&mut self, scene: &Scene, index: u32, crossing: Crossing) {
        if crossing.t <= self.reach {
            self.origin_faces.add(index, crossing.part);
            return;
        }
        let solid = scene.roles[index as usize].solid;
        if solid != 0 {
            match self.nearest.iter_mut().find(|entry| entry.0 == solid) {
                Some(entry) if entry.2.t <= crossing.t => {}
                Some(entry) => *entry = (solid, index, crossing),
                None => self.nearest.push((solid, index, crossing)),
            }
        }
    }

    fn settled(self, scene: &Scene) -> Result<(SolidStack, OriginFaces), (Loss, u32)> {
        let mut stack = SolidStack::default();
        for (solid, index, crossing) in self.nearest {
            let foot = scene.face_set.faces()[index as usize].surface_point(self.o, self.d, &crossing);
            if self.d.dot(foot.normal) > 0.0 {
                stack = stack.crossed(solid).ok_or((Loss::TooDeep, index))?;
            }
        }
        Ok((stack, self.origin_faces))
    }
}
