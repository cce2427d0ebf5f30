"""Maps by the cone: the rays that head for the observers, at a stated acceptance or at that of least error."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import cast

import numpy as np

from etendue.formats.rays.ray_index import RayIndex
from etendue.luminance.acceptance import LADDER, AcceptanceChoice, choose_acceptance, comparison_screen
from etendue.luminance.cone import ConeEstimate, ConeView, cone_estimates
from etendue.luminance.methods import Cone
from etendue.luminance.observer_disk import check_disk, widest_angle
from etendue.quantities.distinct_rays import DistinctRays
from etendue.quantities.luminance_map import LuminanceMap, dead_note
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, RayStream, Tally


def look_through_cone(
    rays: RayStream,
    pairs: list[tuple[Observer, Screen]],
    how: Cone,
    threads: int | None = None,
    progress: Progress | None = None,
) -> list[LuminanceMap]:
    """The maps of rays that head for the observers; see `luminance_map`."""
    distinct = DistinctRays.of(rays, join=not isinstance(rays, RayIndex))
    look = partial(cone_estimates, distinct.rays, threads=threads, progress=progress, excess=distinct.excess)
    if how.observer_radius is not None:
        radius = float(how.observer_radius)
        for observer, screen in pairs:
            check_disk(observer, screen, radius)
        views = [ConeView(o, s, (widest_angle(o, s, radius),), radius) for o, s in pairs]
        estimates, tally = look(views)
        return [_map(rays, distinct, estimate, 0, tally, None) for estimate in estimates]
    if how.half_angle == "auto":
        return _automatic(rays, distinct, pairs, look)
    angle = float(cast("float", how.half_angle))
    estimates, tally = look([ConeView(o, s, (angle,)) for o, s in pairs])
    return [_map(rays, distinct, estimate, 0, tally, None) for estimate in estimates]


def _automatic(
    rays: RayStream,
    distinct: DistinctRays,
    pairs: list[tuple[Observer, Screen]],
    look: Callable[[list[ConeView]], tuple[list[ConeEstimate], Tally]],
) -> list[LuminanceMap]:
    """Compare the acceptances of the ladder; a second pass only for maps with more pixels than the comparison had."""
    ladder = [ConeView(o, comparison_screen(s), LADDER) for o, s in pairs]
    compared, tally = look(ladder)
    choices = [choose_acceptance(e, s) for e, (_, s) in zip(compared, pairs, strict=True)]
    fine = [i for i, (e, (_, s)) in enumerate(zip(compared, pairs, strict=True)) if e.view.screen != s]
    views = [ConeView(*pairs[i], (choices[i].acceptance,)) for i in fine]
    refined = dict(zip(fine, look(views)[0] if fine else [], strict=True))
    return [
        _map(rays, distinct, refined[i], 0, tally, choice)
        if i in refined
        else _map(rays, distinct, estimate, choice.index, tally, choice)
        for i, (estimate, choice) in enumerate(zip(compared, choices, strict=True))
    ]


def _map(
    rays: RayStream,
    distinct: DistinctRays,
    estimate: ConeEstimate,
    index: int,
    tally: Tally,
    choice: AcceptanceChoice | None,
) -> LuminanceMap:
    counts = estimate.rays[index]
    dead = counts == 0
    values = np.where(dead, np.nan, estimate.luminance[index])
    error = np.where(dead, np.nan, np.sqrt(estimate.variance[index]))
    angle, disk = estimate.view.acceptances[index], estimate.view.disk
    within = (
        f"head for the observer within {angle:.4g}°" if disk is None else f"cross the observer's disk of {disk:.4g} mm"
    )
    notes = [
        f"{counts.sum():,} of {tally.rays:,} rays {within} through the screen",
        dead_note(dead),
    ]
    if isinstance(rays, RayIndex):
        notes.append(f"by the index: {estimate.looked:,} rays were looked at, and no other can be seen")
    notes.append(
        "standard errors hold the noise of the rays alone; what the cone blurs, over the angle and by parallax at the edges "
        "of the source, is not in them"
    )
    if unusable := tally.unusable + distinct.unusable:
        notes.append(f"{unusable:,} rays cannot be used and were left out; see the ray set's complaints")
    if choice is not None:
        notes.append(choice.reason)
    notes += [*distinct.notes, *rays.notes]
    method = "cone" if choice is None else "cone, automatic acceptance"
    limit = f"acceptance {angle:.6g}°" if disk is None else f"observer of radius {disk:.6g} mm"
    return LuminanceMap(
        values=values,
        standard_error=error,
        rays=counts,
        observer=estimate.view.observer,
        screen=estimate.view.screen,
        flux_unit=rays.flux_unit,
        provenance=rays.provenance.then(f"luminance by {method}, {limit}"),
        notes=tuple(notes),
    )
