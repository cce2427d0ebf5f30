"""From rays to luminance maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args, overload

import numpy as np

from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.acceptance import LADDER, AcceptanceChoice, choose_acceptance, comparison_screen
from etendue.luminance.cone import ConeEstimate, ConeView, check_acceptance, cone_estimates
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import Progress, RayStream, Tally

Method = Literal["auto", "cone"]
METHODS: tuple[str, ...] = get_args(Method)

DEFAULT_ACCEPTANCE = 1.5
"""Half-angle [°] of the cone in [Audenaert2014]_ section 2.3.2."""


@overload
def luminance_map(
    rays: RayStream,
    observer: Observer,
    screen: Screen,
    *,
    method: Method = ...,
    acceptance: float | None = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> LuminanceMap: ...
@overload
def luminance_map(
    rays: RayStream,
    observer: Sequence[Observer],
    screen: Screen | Sequence[Screen],
    *,
    method: Method = ...,
    acceptance: float | None = ...,
    threads: int | None = ...,
    progress: Progress | None = ...,
) -> list[LuminanceMap]: ...
def luminance_map(
    rays: RayStream,
    observer: Observer | Sequence[Observer],
    screen: Screen | Sequence[Screen],
    *,
    method: Method = "auto",
    acceptance: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LuminanceMap | list[LuminanceMap]:
    """What an observer sees of the rays' source: luminance per pixel, with its standard error.

    Rays travel in free space, forwards and backwards along their lines: where on its line a ray starts has no influence.

    Parameters
    ----------
    rays : RayStream
        A ray set, or a source that draws its rays on demand.
    observer : Observer or sequence of Observer
        Any number is served in one pass.
    screen : Screen or sequence of Screen
        One for all observers, or one each.
    method : {"auto", "cone"}
        ``"cone"``: eqs. 2.2 to 2.4 of [Audenaert2014]_. ``"auto"``: the cone with the acceptance of least estimated
        error, unless `acceptance` is given; the map's notes say which and why.
    acceptance : float, optional
        Half-angle α of the cone [°]; if None, 1.5 for ``"cone"`` and chosen for ``"auto"``.
    threads : int, optional
        All cores if None. The result has the same bits for any number.
    progress : callable, optional
        Called with the number of rays done.

    Returns
    -------
    LuminanceMap or list of LuminanceMap
        [cd/m²] for rays in lm, [W/(m² sr)] for rays in W.

    Raises
    ------
    ArgumentError
        If the rays have no position, an angle is out of its domain, or the numbers of observers and screens differ.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=500_000, seed=1)
    >>> lmap = et.luminance_map(rays, et.Observer(0, 0, 1000), et.Screen(20, 20, 1, 1), method="cone", acceptance=5)
    >>> truth = rays.luminance(0, 0)
    >>> bool(abs(lmap.values[0, 0] - truth) < 3 * lmap.standard_error[0, 0] + 0.25 * truth)
    True
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS)
    observers = [observer] if isinstance(observer, Observer) else list(observer)
    screens = [screen] * len(observers) if isinstance(screen, Screen) else list(screen)
    if len(observers) != len(screens) or not observers:
        raise ArgumentError(f"{len(observers)} observers and {len(screens)} screens; give one screen, or one for each.")
    pairs = list(zip(observers, screens, strict=True))
    # "auto" chooses what is left open: a stated acceptance leaves it nothing to choose.
    if method == "cone" or acceptance is not None:
        angle = check_acceptance(DEFAULT_ACCEPTANCE if acceptance is None else acceptance)
        estimates, tally = cone_estimates(rays, [ConeView(o, s, (angle,)) for o, s in pairs], threads, progress)
        maps = [_map(rays, estimate, 0, tally, None) for estimate in estimates]
    else:
        maps = _automatic(rays, pairs, threads, progress)
    return maps[0] if isinstance(observer, Observer) else maps


def _automatic(
    rays: RayStream, pairs: list[tuple[Observer, Screen]], threads: int | None, progress: Progress | None
) -> list[LuminanceMap]:
    """Compare the acceptances of the ladder; a second pass only for maps with more pixels than the comparison had."""
    ladder = [ConeView(o, comparison_screen(s), LADDER) for o, s in pairs]
    compared, tally = cone_estimates(rays, ladder, threads, progress)
    choices = [choose_acceptance(e, s) for e, (_, s) in zip(compared, pairs, strict=True)]
    fine = [i for i, (e, (_, s)) in enumerate(zip(compared, pairs, strict=True)) if e.view.screen != s]
    views = [ConeView(*pairs[i], (choices[i].acceptance,)) for i in fine]
    refined = dict(zip(fine, cone_estimates(rays, views, threads, progress)[0] if fine else [], strict=True))
    return [
        _map(rays, refined[i], 0, tally, choice) if i in refined else _map(rays, estimate, choice.index, tally, choice)
        for i, (estimate, choice) in enumerate(zip(compared, choices, strict=True))
    ]


def _map(
    rays: RayStream, estimate: ConeEstimate, index: int, tally: Tally, choice: AcceptanceChoice | None
) -> LuminanceMap:
    counts = estimate.rays[index]
    dead = counts == 0
    values = np.where(dead, np.nan, estimate.luminance[index])
    error = np.where(dead, np.nan, np.sqrt(estimate.variance[index]))
    angle = estimate.view.acceptances[index]
    notes = [
        f"{counts.sum():,} of {tally.rays:,} rays head for the observer within {angle:.4g}° through the screen",
        f"{int(dead.sum()):,} of {dead.size:,} pixels are dead (no ray): NaN",
    ]
    if not dead.all():
        notes.append(f"median relative standard error {np.median(error[~dead] / values[~dead]):.2%} of the live pixels")
    if tally.unusable:
        notes.append(f"{tally.unusable:,} rays cannot be used and were left out; see the ray set's complaints")
    if choice is not None:
        notes.append(choice.reason)
    method = "cone" if choice is None else "auto (cone)"
    return LuminanceMap(
        values=values,
        standard_error=error,
        rays=counts,
        observer=estimate.view.observer,
        screen=estimate.view.screen,
        flux_unit=rays.flux_unit,
        provenance=rays.provenance.then(f"luminance by {method}, acceptance {angle:.6g}°"),
        notes=tuple(notes),
    )
