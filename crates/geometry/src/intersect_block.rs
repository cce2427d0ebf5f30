//! A block of rays against faces of simple shapes, several rays at a time.

use std::ops::Range;

use etendue_math::{Frame, Vec3};
use multiversion::multiversion;

use crate::bounds::{Ball, SingleBall, round_up};
use crate::face::Face;
use crate::hits::Hits;
use crate::origin_faces::MOST_ORIGIN_FACES;
use crate::ray_block::RayBlock;
use crate::shape::flat::{Annulus, Rectangle};
use crate::shape::{Outline, Quadric, Shape};

/// Rays that are tried on all simple faces before the next ones are: what they need stays in the cache of first level.
const CHUNK: usize = 256;

/// Numbers of single precision in the longest vectors.
const LANES: usize = 16;

/// A face, and what rules out most rays that miss it.
#[derive(Clone, Copy, Debug)]
pub struct BoundedFace {
    /// Its number.
    pub index: u32,
    /// A ball around it: only rays that meet it are tried on the face. None: all are.
    pub ball: Option<Ball>,
    /// The same in single precision.
    single: Option<SingleBall>,
}

impl BoundedFace {
    /// A face and a ball around it.
    pub fn new(index: u32, ball: Option<Ball>) -> Self {
        let single = ball.and_then(|ball| ball.single());
        Self { index, ball, single }
    }
}

/// Rays in single precision, for a first look.
struct SingleLines {
    origin: [[f32; CHUNK]; 3],
    direction: [[f32; CHUNK]; 3],
    /// How far each has to be looked along \[mm\]: what lies behind two crossings changes nothing.
    reach: [f32; CHUNK],
    /// Whether that is up to date.
    is_reach_known: bool,
    /// No sum of the amounts of the coordinates of a start point is larger \[mm\].
    size: f32,
}

impl SingleLines {
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "what is lost is in the roundings")]
    fn fill(&mut self, lines: &Lines<'_>, n: usize) {
        for (from, to) in lines.origin.into_iter().zip(&mut self.origin) {
            narrow(from, &mut to[..n]);
        }
        for (from, to) in lines.direction.into_iter().zip(&mut self.direction) {
            narrow(from, &mut to[..n]);
        }
        // Side by side, so that several are compared at a time; of what is not finite nothing is known.
        let more = |size: f64, most: f64| if size <= most { most } else { size };
        let mut most = [0.0; LANES];
        let [x, y, z] = lines.origin.map(|axis| axis[..n].chunks(LANES));
        for ((x, y), z) in x.zip(y).zip(z) {
            for (((most, x), y), z) in most.iter_mut().zip(x).zip(y).zip(z) {
                *most = more(x.abs() + y.abs() + z.abs(), *most);
            }
        }
        let most = most.into_iter().fold(0.0, more);
        self.size = round_up(most);
        self.is_reach_known = false;
    }
}

/// Tries a block of rays on some faces, several rays at a time.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn try_simple(faces: &[Face], which: &[BoundedFace], block: &RayBlock, hits: &mut Hits) {
    let none = [[0.0; CHUNK]; 3];
    let mut single = SingleLines {
        origin: none,
        direction: none,
        reach: [0.0; CHUNK],
        is_reach_known: false,
        size: 0.0,
    };
    let any = which.iter().any(|face| face.single.is_some());
    for start in (0..block.len()).step_by(CHUNK) {
        let rays = start..(start + CHUNK).min(block.len());
        if any {
            single.fill(&Lines::of(block, &rays), rays.len());
        }
        for simple in which {
            let face = &faces[simple.index as usize];
            let frame = &face.frame;
            match &face.shape {
                Shape::Flat(flat) => match flat.outline {
                    Outline::Annulus { inner, outer } => {
                        sweep(
                            frame,
                            simple,
                            (block, &mut single),
                            hits,
                            &rays,
                            &Annulus { inner, outer },
                        );
                    }
                    Outline::Rectangle { width, height } => {
                        let half = [0.5 * width, 0.5 * height];
                        sweep(frame, simple, (block, &mut single), hits, &rays, &Rectangle { half });
                    }
                    Outline::Whole | Outline::Polygon { .. } => {
                        sweep(frame, simple, (block, &mut single), hits, &rays, &Annulus::ALL);
                    }
                },
                Shape::Quadric(quadric) => sweep(frame, simple, (block, &mut single), hits, &rays, quadric),
                Shape::Asphere(_) | Shape::Torus(_) | Shape::Mesh(_) => {}
            }
        }
    }
}

#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "what is lost is in the roundings")]
fn narrow(from: &[f64], to: &mut [f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from as f32;
    }
}

/// A surface that a line crosses twice at most.
///
/// Its method is inlined into loops for several instruction sets; a closure would be compiled for the least of them.
trait Simple {
    /// The distances of the crossings, +∞ in place of one that is none.
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2];
}

impl Simple for Annulus {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        [self.crossing(o, d, starts_on), f64::INFINITY]
    }
}

impl Simple for Rectangle {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        [self.crossing(o, d, starts_on), f64::INFINITY]
    }
}

impl Simple for Quadric {
    #[inline(always)]
    fn crossings(&self, o: Vec3, d: Vec3, starts_on: bool) -> [f64; 2] {
        self.crossings(o, d, starts_on)
    }
}

#[inline(always)]
fn sweep(
    frame: &Frame,
    face: &BoundedFace,
    block: (&RayBlock, &mut SingleLines),
    hits: &mut Hits,
    rays: &Range<usize>,
    shape: &impl Simple,
) {
    if frame.is_straight() {
        sweep_turned::<false>(frame, face, block, hits, rays, shape);
    } else {
        sweep_turned::<true>(frame, face, block, hits, rays, shape);
    }
}

/// Tries rays on a face: all of them, or those that meet the ball around it.
#[inline(always)]
fn sweep_turned<const TURNED: bool>(
    frame: &Frame,
    face: &BoundedFace,
    block: (&RayBlock, &mut SingleLines),
    hits: &mut Hits,
    rays: &Range<usize>,
    shape: &impl Simple,
) {
    let (block, single) = block;
    let (lines, mut found) = (Lines::of(block, rays), Nearest::of(hits, rays));
    let Some(ball) = face.single.filter(|_| single.size < SingleBall::MOST) else {
        for i in 0..rays.len() {
            meet::<TURNED>(frame, face.index, &lines, &mut found, i, shape);
        }
        single.is_reach_known = false;
        return;
    };
    if !single.is_reach_known {
        single.is_reach_known = true;
        narrow(found.second, &mut single.reach[..rays.len()]);
    }
    let n = rays.len();
    let mut met = [[0_u8; 8]; CHUNK / 8];
    {
        let ball = ball.of_rays(single.size);
        // In whole vectors: there is room for more rays than there are, and what is there means nothing.
        let [ox, oy, oz] = single.origin.each_ref().map(|axis| axis.as_chunks::<LANES>().0);
        let [dx, dy, dz] = single.direction.each_ref().map(|axis| axis.as_chunks::<LANES>().0);
        let reach = single.reach.as_chunks::<LANES>().0;
        let met = met.as_flattened_mut();
        for (group, met) in met
            .as_chunks_mut::<LANES>()
            .0
            .iter_mut()
            .enumerate()
            .take(n.div_ceil(LANES))
        {
            let (ox, oy, oz, reach) = (&ox[group], &oy[group], &oz[group], &reach[group]);
            let (dx, dy, dz) = (&dx[group], &dy[group], &dz[group]);
            for i in 0..LANES {
                met[i] = u8::from(ball.meets([ox[i], oy[i], oz[i]], [dx[i], dy[i], dz[i]], reach[i]));
            }
        }
        met[n..].fill(0);
    }
    for (word, first) in met.iter().zip((0..n).step_by(8)) {
        let mut word = u64::from_le_bytes(*word);
        while word != 0 {
            let i = first + (word.trailing_zeros() >> 3) as usize;
            word &= word.wrapping_sub(1);
            meet::<TURNED>(frame, face.index, &lines, &mut found, i, shape);
            #[allow(clippy::cast_possible_truncation, reason = "within the roundings")]
            {
                single.reach[i] = found.second[i] as f32;
            }
        }
    }
}

/// Some rays of a block.
struct Lines<'a> {
    origin: [&'a [f64]; 3],
    direction: [&'a [f64]; 3],
    /// Faces that each starts on.
    faces: [&'a [u32]; MOST_ORIGIN_FACES],
}

impl<'a> Lines<'a> {
    #[inline(always)]
    fn of(block: &'a RayBlock, rays: &Range<usize>) -> Self {
        let n = rays.len();
        Self {
            origin: block.origin.each_ref().map(|v| &v[rays.clone()][..n]),
            direction: block.direction.each_ref().map(|v| &v[rays.clone()][..n]),
            faces: block.faces().map(|v| &v[rays.clone()][..n]),
        }
    }

    #[inline(always)]
    fn line(&self, i: usize) -> (Vec3, Vec3) {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin, self.direction);
        (Vec3::new(ox[i], oy[i], oz[i]), Vec3::new(dx[i], dy[i], dz[i]))
    }
}

/// What they met so far.
struct Nearest<'a> {
    t: &'a mut [f64],
    second: &'a mut [f64],
    face: &'a mut [u32],
}

impl<'a> Nearest<'a> {
    #[inline(always)]
    fn of(hits: &'a mut Hits, rays: &Range<usize>) -> Self {
        let n = rays.len();
        Self {
            t: &mut hits.t[rays.clone()][..n],
            second: &mut hits.second[rays.clone()][..n],
            face: &mut hits.face[rays.clone()][..n],
        }
    }
}

/// Tries a ray on a face.
#[inline(always)]
fn meet<const TURNED: bool>(
    frame: &Frame,
    index: u32,
    lines: &Lines<'_>,
    found: &mut Nearest<'_>,
    i: usize,
    shape: &impl Simple,
) {
    let (mut o, mut d) = lines.line(i);
    o = o - frame.origin;
    if TURNED {
        (o, d) = (frame.direction_to_local(o), frame.direction_to_local(d));
    }
    let [l0, l1, l2, l3] = lines.faces;
    let starts_on = (l0[i] == index) | (l1[i] == index) | (l2[i] == index) | (l3[i] == index);
    let (mut first, mut next, mut face) = (found.t[i], found.second[i], found.face[i]);
    for t in shape.crossings(o, d, starts_on) {
        // Neither behind nor NaN.
        let t = if t > 0.0 { t } else { f64::INFINITY };
        face = if t < first { index } else { face };
        next = least(next, if t < first { first } else { t });
        first = least(first, t);
    }
    (found.t[i], found.second[i], found.face[i]) = (first, next, face);
}

/// The lesser of two numbers that are not NaN: one instruction, as `f64::min` is not.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
