//! Three lines of sight, one through a place on the screen and two beside it, at the surfaces that they meet together.

use etendue_optics::bsdf::Shares;

use super::passing::Line;
use crate::interaction::{Interaction, first_interaction};
use crate::medium_cache::MediumCache;
use crate::scatter::SurfaceEvent;
use crate::scene::Scene;

/// A chain of smooth surfaces from a start: the line there and those beside it.
#[derive(Clone)]
pub(super) struct Chain {
    pub(super) lines: [Line; 3],
    pub(super) weight: f64,
    pub(super) ways: Vec<bool>,
}

/// What three lines meet; None if it is nothing, or not the same.
pub(super) fn interactions(scene: &Scene, lines: &[Line; 3]) -> Option<[Interaction; 3]> {
    let next = |line: &Line| {
        let Line {
            o,
            d,
            stack,
            origin_faces,
        } = line;
        first_interaction(scene, *o, *d, origin_faces, f64::INFINITY, *stack).ok()?
    };
    let first = next(&lines[0])?;
    let same = |line: &Line| {
        let met = next(line)?;
        (met.face == first.face && met.finish == first.finish && met.after == first.after).then_some(met)
    };
    Some([first, same(&lines[1])?, same(&lines[2])?])
}

/// A line at a smooth surface.
pub(super) struct AtSurface<'a> {
    event: SurfaceEvent<'a>,
    /// What of the radiance is mirrored and refracted.
    pub(super) factors: [f64; 2],
    shares: Shares,
}

/// A line is lost: it contradicts what it is in, or a medium has no index.
pub(super) struct Lost;

/// Three lines at what they meet; None if they go on as if nothing were there.
pub(super) fn turn<'a>(
    scene: &'a Scene,
    lines: &[Line; 3],
    met: &'a [Interaction; 3],
    wavelength: f64,
    media: &mut MediumCache,
) -> Result<Option<[AtSurface<'a>; 3]>, Lost> {
    let mut event = |k: usize| SurfaceEvent::new(scene, &met[k], lines[k].d, wavelength, media).map_err(|_| Lost);
    let Some(first) = event(0)? else {
        return Ok(None);
    };
    let events = [first, event(1)?.ok_or(Lost)?, event(2)?.ok_or(Lost)?];
    Ok(Some(events.map(|event| {
        let (factors, shares) = event.seen();
        AtSurface { event, factors, shares }
    })))
}

/// Three lines behind what is not there for them.
pub(super) fn straight(lines: &[Line; 3], met: &[Interaction; 3]) -> [Line; 3] {
    std::array::from_fn(|k| Line {
        o: met[k].point,
        d: lines[k].d,
        stack: met[k].after,
        origin_faces: met[k].origin_faces,
    })
}

/// Three lines beyond a smooth surface; None if one of them cannot go there.
pub(super) fn turned(at: &[AtSurface<'_>; 3], transmitted: bool) -> Option<[Line; 3]> {
    let possible = at.iter().all(|line| line.factors[usize::from(transmitted)] > 0.0);
    possible.then(|| {
        at.each_ref().map(|AtSurface { event, shares, .. }| {
            let (d, stack) = if transmitted {
                event.refracted(shares.refraction)
            } else {
                event.mirrored()
            };
            let met = event.interaction();
            Line {
                o: met.point,
                d,
                stack,
                origin_faces: met.origin_faces,
            }
        })
    })
}
