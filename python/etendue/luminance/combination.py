"""One map from the maps of independent runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require
from etendue.quantities.luminance_map import LuminanceMap, check_luminance_map, dead_note
from etendue.quantities.provenance import Provenance

LOOKING = ("luminance by", "light field on")
"""How the steps of a provenance begin that tell how rays were looked at, and no longer which, unless they draw some by a
seed of their own."""


def _rays_of(provenance: Provenance) -> Provenance:
    """What a map was made of: all steps before the rays were looked at."""
    looked = (number for number, step in enumerate(provenance.steps) if step.startswith(LOOKING) and "seed" not in step)
    return dataclasses.replace(provenance, steps=provenance.steps[: next(looked, None)])


def combine_maps(maps: Sequence[LuminanceMap]) -> LuminanceMap:
    """Mean of maps of one source, each from a ray set of its own that stands for the whole source.

    This is how [Audenaert2014]_ section 2.3.1 joins the incident ray tables of 28 runs: the flux of a ray is divided by
    the number of runs. Each map weighs the same; a pixel that is dead in one run counts there as 0, and is dead in the
    result if it is dead in all. Standard errors add in squares; an unknown one stays unknown.

    Parameters
    ----------
    maps : sequence of LuminanceMap
        Same observer, screen and unit; independent of each other (other seeds, other parts of `RaySet.thin`).

    Raises
    ------
    ArgumentError
        If there is no map, one is none of luminance, they differ in observer, screen or unit, or two are of the same rays:
        their origin and all that was done to the rays is the same, whatever they were looked at by.

    Examples
    --------
    >>> import etendue as et
    >>> observer, screen = et.Observer(0, 0, 150), et.Screen(40, 40, 4, 4)
    >>> runs = [et.luminance_map(et.RingSource(seed=s), observer, screen, method="cone") for s in (1, 2)]
    >>> both = combine_maps(runs)
    >>> int(both.rays.sum()) == sum(int(run.rays.sum()) for run in runs)
    True
    """
    require(maps, (list, tuple), "combine_maps: maps", "a list of maps of the same view, e.g. [first, second]")
    if not maps:
        raise ArgumentError("combine_maps: no maps.")
    for lmap in maps:
        check_luminance_map(lmap, "combine_maps")
    first = maps[0]
    for other in maps[1:]:
        for name in ("observer", "screen", "flux_unit"):
            if getattr(other, name) != getattr(first, name):
                raise ArgumentError(
                    f"combine_maps: {name} differs: {getattr(first, name)} and {getattr(other, name)}. "
                    "Only maps of the same view can be combined."
                )
    earlier: dict[Provenance, int] = {}
    for number, lmap in enumerate(maps, start=1):
        origin = _rays_of(lmap.provenance)
        if lmap.provenance.format != "memory" and origin in earlier:
            raise ArgumentError(
                f"combine_maps: maps {earlier[origin]} and {number} are of the same rays ({origin.source}"
                f"{''.join(f'; {step}' for step in origin.steps)}): their errors are not independent. Give maps of other "
                "seeds, files, or parts of `RaySet.thin`."
            )
        earlier[origin] = number
    n = len(maps)
    missing = [np.isnan(m.values) for m in maps]
    dead = np.all(missing, axis=0)
    values = np.sum([np.nan_to_num(m.values) for m in maps], axis=0) / n
    # A dead pixel adds nothing; the unknown error of a live one stays unknown, and so does an unknown number of rays.
    variances = [np.where(gone, 0.0, m.standard_error**2) for m, gone in zip(maps, missing, strict=True)]
    error = np.sqrt(np.sum(variances, axis=0)) / n
    unknown = np.any([m.rays < 0 for m in maps], axis=0)
    rays = np.where(unknown, -1, np.sum([m.rays for m in maps], axis=0))
    notes = (
        f"mean of {n} independent maps" + ("" if unknown.any() else f", {rays.sum():,} rays in all"),
        dead_note(dead),
    )
    sources = tuple(m.provenance for m in maps)
    return dataclasses.replace(
        first,
        values=np.where(dead, np.nan, values),
        standard_error=np.where(dead, np.nan, error),
        rays=rays,
        provenance=first.provenance.then(
            f"mean of {n} maps; the others: " + "; ".join(" ".join(s.steps) for s in sources[1:])
        ),
        notes=notes,
    )
