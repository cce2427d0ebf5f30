"""Where the detector of a goniometer stands: along an arc, in a window about the regular direction, over a hemisphere."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require_number
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]
Plane = Literal["in-plane", "cross-plane"]

MOST = 1_000_000
"""Of a scan."""

COARSEST, FINEST = 30.0, 0.5
"""Steps over a hemisphere [°]."""


def even_angles(middle: float, step: float, span: float) -> Array:
    """Angles in even steps to `span` on both sides of a middle [°].

    Raises
    ------
    ArgumentError
        If there are none, or more than a million.

    Examples
    --------
    >>> even_angles(30.0, 0.5, 1.0).tolist()
    [29.0, 29.5, 30.0, 30.5, 31.0]
    """
    require_number(step, "step", "the angle between positions in °")
    require_number(span, "span", "the angle to the last position on both sides in °")
    if not 0.0 < step < 90.0 or not 0.0 < span <= 180.0 or span / step > MOST:
        raise ArgumentError(f"steps of {step:g}° to {span:g}° on both sides; give a step and a span of more than 0")
    k = int(np.floor(span / step + 1e-9))
    # 8.7 and not 8.700000000000001: files hold what people would write.
    return np.round(middle + step * np.arange(-k, k + 1), 10)


def detector_directions(angle: npt.ArrayLike, incidence: float, plane: Plane, *, behind: bool) -> Array:
    """Positions in one plane through the regular direction, shape (…, 3), light coming from azimuth 180°.

    Examples
    --------
    >>> detector_directions([30.0], 30.0, "in-plane", behind=False).round(3).tolist()
    [[0.5, 0.0, 0.866]]
    """
    if plane == "in-plane":
        return direction(angle, 0.0, behind=behind)
    a = np.radians(angle)[..., None]
    return np.asarray(np.cos(a) * direction(incidence, 0.0, behind=behind) + np.sin(a) * np.array([0.0, 1.0, 0.0]))


def window(incidence: float, step: float, span: float, *, behind: bool) -> Array:
    """Positions in even steps about the regular direction, shape (n, 3): turned in the plane of incidence, then across it.

    Those in the plane of the sample or beyond are left out.

    Examples
    --------
    >>> window(60.0, 1.0, 2.0, behind=False).shape
    (25, 3)
    """
    across = np.radians(even_angles(0.0, step, span))
    if (2 * across.size) ** 2 > 4 * MOST:
        raise ArgumentError(f"steps of {step:g}° to {span:g}° on both sides are more than a million positions")
    if span >= 90.0:
        raise ArgumentError(f"a window of {span:g}° on both sides; it reaches less than 90° far")
    angle = even_angles(incidence, step, span)
    arms = direction(angle[np.abs(angle) < 90.0 - 0.5 * step], 0.0, behind=behind)[:, None]
    turned = np.cos(across)[:, None] * arms + np.sin(across)[:, None] * np.array([0.0, 1.0, 0.0])
    return np.asarray(turned.reshape(-1, 3))


def hemisphere(step: float) -> PolarGrid:
    """Even steps of the angle from the normal and of the azimuth; the last is half a step, at most 5°, above the sample.

    Raises
    ------
    ArgumentError
        If the steps are not from 0.5 to 30°.

    Examples
    --------
    >>> hemisphere(30.0).radial.tolist()
    [0.0, 30.0, 60.0]
    """
    require_number(step, "the step over a hemisphere", f"an angle from {FINEST:g} to {COARSEST:g}°")
    if not FINEST <= step <= COARSEST:
        raise ArgumentError(f"steps of {step:g}° over a hemisphere; give {FINEST:g} to {COARSEST:g}°")
    polar = np.arange(0.0, 90.0 - min(0.5 * step, 5.0) + 1e-9, step)
    return PolarGrid("normal", polar, np.linspace(0.0, 360.0, max(round(360.0 / step), 3), endpoint=False))


def hemisphere_around(incidence: float, step: float, hole: float, *, behind: bool) -> Array:
    """Positions over a hemisphere, rings of about even steps, shape (n, 3), none within `hole` [°] of the regular direction.

    Examples
    --------
    >>> len(hemisphere_around(0.0, 30.0, 20.0, behind=False))
    16
    """
    found = []
    for theta in hemisphere(step).radial:
        around = max(round(360.0 * np.sin(np.radians(theta)) / step), 1)
        found.append(direction(theta, np.arange(around) * (360.0 / around), behind=behind))
    arms = np.concatenate(found)
    regular = direction(incidence, 0.0, behind=behind)
    return np.asarray(arms[arms @ regular < np.cos(np.radians(hole))])
