"""Beam angle, field angle and cut-off of an intensity distribution."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.angle_table import gaps_of, kinks_along, kinks_around
from etendue.quantities.arguments import INTENSITY, require, require_known, require_number
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import NEIGHBOURS
from etendue.quantities.node_errors import known_errors, shared_around

Array = npt.NDArray[np.float64]
Reference = Literal["maximum", "centre"]
REFERENCES: tuple[str, ...] = get_args(Reference)

BEAM, FIELD = 0.5, 0.1
"""Shares of the reference intensity at which beam angle and field angle end."""

CUT_OFF = 0.01
"""Share of the maximum above which light counts as not cut off."""

SURE = 3.0
"""Standard errors by which a value must be above a limit to be certainly above it."""

DRAWS = 256
"""Tables drawn with the stated errors, whose edges show how sure an edge is."""


@dataclasses.dataclass(frozen=True)
class BeamAngle:
    """How wide the light is in one plane through the axis; see `beam_angle`.

    Parameters
    ----------
    plane : float
        C of the half plane on the right [°], 0 to 180; C + 180° is on the left.
    share : float
        Of the reference intensity, at which the beam ends.
    angle : float
        From edge to edge [°]; NaN if no direction of the plane reaches the share.
    standard_error : float
        [°]; NaN where no error of the intensity is known.
    left, right : float
        γ of the edges [°]; negative in the half plane C + 180°. If the light is about γ = 180°, the angle lies on that
        side: 360° less what is between the edges over γ = 0.
    about : float
        γ of the axis that the angle goes over [°], 0 or 180.

    Examples
    --------
    >>> beam_angle(Intensity(c=[0], gamma=[0, 30, 60], values=[[100.0, 50, 0]])).right
    30.0
    """

    plane: float
    share: float
    angle: float
    standard_error: float
    left: float
    right: float
    about: float = 0.0

    def __str__(self) -> str:
        """The angle with its error, or that there is none.

        Examples
        --------
        >>> str(BeamAngle(plane=0, share=0.5, angle=24.318, standard_error=0.21, left=-12.1, right=12.2))
        '24.32° ± 0.21°'
        """
        if math.isnan(self.angle):
            return "none"
        if not self.standard_error > 0.0:
            return f"{self.angle:.4g}°"
        places = max(0, 1 - math.floor(math.log10(self.standard_error)))
        return f"{self.angle:.{places}f}° ± {self.standard_error:.{places}f}°"


def beam_angle(
    intensity: Intensity,
    c: float = 0.0,
    share: float = BEAM,
    reference: Reference = "maximum",
    about: float | None = None,
) -> BeamAngle:
    """The angle that holds all directions of a plane whose intensity is above a share of the largest.

    It goes over γ = 0, or over γ = 180° where there is light above the share in that direction and not at γ = 0. With a
    share of 50 % it is the beam angle, with 10 % the field angle. It is measured from edge to edge, so that a distribution
    with a dark middle has the angle of its outer edges. Light above the share on both sides of the horizon, γ = 90°, and
    below it at the horizon is that of two beams: the angle is that of the one about γ = 0; `about` tells the other.

    In noise, an edge is where the outermost value stands that is above the limit by three standard errors, plus the angle
    beyond it that is above the limit: there, noise lifts as much light over the limit as it pushes below.

    Parameters
    ----------
    intensity : Intensity
        The distribution.
    c : float
        The plane, C and C + 180° [°].
    share : float
        Of the reference, above 0 and below 1.
    reference : {"maximum", "centre"}
        The largest intensity of all directions (`Intensity.peak_intensity`), or that on the axis, γ = 0, as IEC TR 61341
        has it for reflector lamps [IEC2010]_.
    about : float, optional
        γ of the axis, 0 or 180: the angle is that of the light on this side of the horizon alone, and its reference the
        largest intensity there, or that on this axis. None for all light, as told above.

    Returns
    -------
    BeamAngle
        The standard error is that of edges of tables drawn with the stated errors of the nodes, and of the reference; where
        nodes err together (`Intensity.smooth`), that of both half planes being off by their errors.

    Raises
    ------
    ArgumentError
        If the share is not between 0 and 1, the plane is not finite, or `about` is neither 0 nor 180.
    UnknownNameError
        If there is no such reference.

    Examples
    --------
    A Lambertian emitter falls to a half at 60°, and to a tenth at 84.3°:

    >>> import numpy as np
    >>> gamma = np.arange(91.0)
    >>> lambertian = Intensity(c=[0], gamma=gamma, values=[np.cos(np.radians(gamma))])
    >>> round(beam_angle(lambertian).angle, 2), round(beam_angle(lambertian, share=0.1).angle, 1)
    (120.0, 168.5)
    """
    require(intensity, Intensity, "beam_angle: intensity", INTENSITY)
    require_number(share, "beam_angle: share", "a share of the intensity above 0 and below 1")
    require_number(c, "beam_angle: c", "the angle C of the plane in degrees")
    if not 0.0 < share < 1.0:
        raise ArgumentError(f"beam_angle: share is {share:g}; give a share of the intensity above 0 and below 1.")
    require_known(reference, REFERENCES, "reference of a beam angle")
    if not math.isfinite(c):
        raise ArgumentError(f"beam_angle: the plane is C = {c}; give an angle in degrees.")
    if about is not None:
        require_number(about, "beam_angle: about", "0 or 180, the γ of the axis, or None")
    if about not in (None, 0.0, 180.0):
        raise ArgumentError(f"beam_angle: the axis is γ = {about}; give 0 or 180.")
    plane = float(np.mod(c, 360.0))
    plane -= 180.0 if plane >= 180.0 else 0.0
    curve = _signed(intensity, plane)
    if reference == "maximum":
        side = (90.0 if about == 180.0 else 0.0, 90.0 if about == 0.0 else 180.0)
        top, top_error = intensity.largest_between(*side)
    else:
        top, top_error = _on_axis(intensity, plane, about or 0.0)
    upwards = about == 180.0 if about is not None else _lit(curve, 180.0) >= share * top > _lit(curve, 0.0)
    if upwards:
        curve = _from_above(curve)
    if about is not None or _two_beams(curve, share * top):
        curve = _up_to_the_horizon(curve)
    left, right = (
        float(edge[0]) for edge in _edges(curve.gamma, curve.values[None], curve.errors, np.array([share * top]))
    )
    error = _angle_error(intensity, plane, curve, (share * top, share * top_error), upwards)
    first, last = (math.copysign(180.0, edge) - edge for edge in (left, right)) if upwards else (left, right)
    return BeamAngle(plane, share, right - left, error, first, last, 180.0 if upwards else 0.0)


def cut_off_angle(intensity: Intensity, share: float = CUT_OFF) -> float:
    """The angle γ from which on no plane sends more than a share of the largest intensity [°].

    Parameters
    ----------
    intensity : Intensity
        The distribution.
    share : float
        Of the largest intensity (`Intensity.peak_intensity`), above 0 and below 1.

    Returns
    -------
    float
        180 if the light goes all around; NaN if so few rays are behind the table that chance alone could have made its
        largest value (`Intensity.peak_intensity` is not above 0 there).

    Raises
    ------
    ArgumentError
        If the share is not between 0 and 1.

    Examples
    --------
    >>> shielded = Intensity(c=[0], gamma=[0, 60, 61, 180], values=[[500.0, 400, 0, 0]])
    >>> round(cut_off_angle(shielded), 2)
    60.99
    """
    require(intensity, Intensity, "cut_off_angle: intensity", INTENSITY)
    require_number(share, "cut_off_angle: share", "a share of the intensity above 0 and below 1")
    if not 0.0 < share < 1.0:
        raise ArgumentError(f"cut_off_angle: share is {share:g}; give a share of the intensity above 0 and below 1.")
    limit = share * intensity.peak_intensity
    if limit <= 0.0 < intensity.maximum:
        return math.nan
    dark = [] if intensity.gamma[-1] == 180.0 else [0.0]
    gamma = np.append(intensity.gamma, intensity.gamma[-1:] if dark else [])
    edge = np.zeros((intensity.c.size, len(dark)))
    values, errors = np.hstack([intensity.values, edge]), np.hstack([known_errors(intensity), edge])
    # Between two planes the function lies between theirs, and so does its last edge.
    _, last = _edges(gamma, values, errors, np.full(intensity.c.size, limit))
    return float(np.nanmax(last, initial=0.0))


# --- edges -------------------------------------------------------------------------------------------------------------


class _Curve(NamedTuple):
    """A plane: γ from −180° (half plane C + 180°) to 180°; at an angle that stands there twice the values jump."""

    gamma: Array
    values: Array
    errors: Array


def _signed(intensity: Intensity, plane: float) -> _Curve:
    both = [plane, plane + 180.0]
    gamma, (right, left) = intensity.gamma, intensity.planes(both)
    right_error, left_error = _plane_errors(intensity, both)
    # Beside the table there is no light.
    dark = (int(gamma[0] > 0.0), int(gamma[-1] < 180.0))
    angles = np.pad(gamma, dark, mode="edge")
    return _Curve(
        np.concatenate([-angles[::-1], angles]),
        np.concatenate([np.pad(left, dark)[::-1], np.pad(right, dark)]),
        np.concatenate([np.pad(left_error, dark)[::-1], np.pad(right_error, dark)]),
    )


def _lit(curve: _Curve, gamma: float) -> float:
    """The largest value at an angle from the axis, in both half planes; 0 beside the table."""
    return float(curve.values[np.abs(curve.gamma) == gamma].max(initial=0.0))


def _on_axis(intensity: Intensity, plane: float, about: float) -> tuple[float, float]:
    """Intensity on the axis γ = `about`, and its error; 0 beside the table."""
    (row,) = np.nonzero(intensity.gamma == about)
    if not row.size:
        return 0.0, 0.0
    return float(intensity.planes([plane])[0, row[0]]), float(_plane_errors(intensity, [plane])[0, row[0]])


def _two_beams(curve: _Curve, limit: float) -> bool:
    """Whether light is above the limit on both sides of the horizon, and below it at the horizon."""
    bright = curve.values >= limit
    front = np.abs(curve.gamma) < 90.0
    at_horizon = max(_at(curve, curve.values, angle) for angle in (-90.0, 90.0))
    return bool(at_horizon < limit and bright[front].any() and bright[np.abs(curve.gamma) > 90.0].any())


def _up_to_the_horizon(curve: _Curve) -> _Curve:
    """The plane from −90° to 90°."""
    inner = np.abs(curve.gamma) < 90.0
    values, errors = (
        np.concatenate([[_at(curve, rows, -90.0)], rows[inner], [_at(curve, rows, 90.0)]])
        for rows in (curve.values, curve.errors)
    )
    return _Curve(np.concatenate([[-90.0], curve.gamma[inner], [90.0]]), values, errors)


def _at(curve: _Curve, rows: Array, gamma: float) -> float:
    return float(np.interp(gamma, curve.gamma, rows))


def _from_above(curve: _Curve) -> _Curve:
    """The same plane by the angle from γ = 180°."""
    # One half of the values is of either half plane.
    middle = len(curve.gamma) // 2
    left, right = np.arange(middle), np.arange(middle, len(curve.gamma))
    order = np.concatenate([left[::-1], right[::-1]])
    gamma = np.concatenate([-180.0 - curve.gamma[left[::-1]], 180.0 - curve.gamma[right[::-1]]])
    return _Curve(gamma, curve.values[order], curve.errors[order])


def _plane_errors(intensity: Intensity, c: Sequence[float]) -> Array:
    """Standard errors of the half planes, which need not be nodes: those of the two beside them are independent."""
    first, second, share = intensity.between_planes(np.asarray(c, dtype=np.float64))
    share = share[:, None]
    known = known_errors(intensity)
    return np.hypot((1.0 - share) * known[first], share * known[second])


def _edges(gamma: Array, values: Array, errors: Array, limits: Array) -> tuple[Array, Array]:
    """Where tables of one plane rise above their limits and where they fall below them, shape (tables,); NaN if never."""
    above = values - limits[:, None]
    first, second = above[:, :-1], above[:, 1:]
    # Of each step, the share of it in which the straight line is above the limit.
    crossing = np.maximum(first, second) / np.maximum(np.abs(first) + np.abs(second), 1e-300)
    share = np.where((first >= 0.0) & (second >= 0.0), 1.0, np.where((first < 0.0) & (second < 0.0), 0.0, crossing))
    length = share * np.diff(gamma)
    sure = above >= SURE * np.nan_to_num(errors)
    highest = values.argmax(axis=1)
    rows = np.arange(len(values))
    sure[rows, highest] = True
    innermost_left = sure.argmax(axis=1)
    innermost_right = values.shape[1] - 1 - sure[:, ::-1].argmax(axis=1)
    sums = np.concatenate([np.zeros((len(values), 1)), np.cumsum(length, axis=1)], axis=1)
    left = gamma[innermost_left] - sums[rows, innermost_left]
    right = gamma[innermost_right] + sums[:, -1] - sums[rows, innermost_right]
    none = (above[rows, highest] < 0.0) | (limits <= 0.0)
    return np.where(none, np.nan, left), np.where(none, np.nan, right)


def _angle_error(
    intensity: Intensity, plane: float, curve: _Curve, limit_and_error: tuple[float, float], upwards: bool
) -> float:
    """Standard error of the angle between the edges [°]."""
    limit, limit_error = limit_and_error
    if np.isnan(curve.errors).any():
        return math.nan
    off = limit_error if math.isfinite(limit_error) else 0.0
    if intensity.smooth:
        shifts = [
            curve.errors * (curve.gamma < 0.0),
            curve.errors * (curve.gamma >= 0.0),
            np.full_like(curve.errors, off),
        ]
        widths = [_widths(curve, np.stack([-shift, shift]), np.full(2, limit)) for shift in shifts]
        return math.hypot(*(float(width[1] - width[0]) / 2.0 for width in widths))
    draw = np.random.Generator(np.random.Philox(key=1))
    nodes = kinks_along(curve.gamma, curve.values[None])[0]
    gamma, errors = curve.gamma[nodes], curve.errors[nodes]
    # Neighbouring nodes share rays: their errors have the correlation ab / (a² + b²) = ¼.
    turn = math.asin(2.0 * NEIGHBOURS) / 2.0
    white = draw.standard_normal((2, DRAWS, gamma.size + 1))
    right, other = math.cos(turn) * white[..., 1:] + math.sin(turn) * white[..., :-1]
    # What both half planes have in common stands at the same |γ|; the first draw is that of the right one.
    mirror = np.stack([np.interp(-gamma, gamma, row) for row in right])
    from_axis = 180.0 + gamma if upwards else -gamma
    alike = np.where(gamma < 0.0, np.interp(from_axis, intensity.gamma, _alike(intensity, plane)), 0.0)
    noise = errors * (alike * mirror + np.sqrt(1.0 - alike**2) * np.where(gamma < 0.0, other, right))
    drawn = _widths(
        curve._replace(gamma=gamma, values=curve.values[nodes], errors=errors),
        noise,
        limit + off * draw.standard_normal(DRAWS),
    )
    known = np.isfinite(drawn)
    return float(drawn[known].std(ddof=1)) if known.sum() > 1 else math.nan


def _alike(intensity: Intensity, plane: float) -> Array:
    """Correlation of the errors of both half planes at each γ: rows of few nodes around the axis have rays in common."""
    rows = np.ones(intensity.gamma.size)
    # Most rows have their nodes at the same angles.
    known: dict[bytes, float] = {}
    for row, around in enumerate(kinks_around(intensity.c, intensity.values).T):
        if around.sum() > 1:
            nodes = around.tobytes()
            if nodes not in known:
                known[nodes] = _alike_around(intensity.c[around], plane)
            rows[row] = known[nodes]
    return rows


def _alike_around(c: Array, plane: float) -> float:
    """Correlation of values at C and C + 180° that are interpolated between nodes around the axis."""
    weights = np.zeros((2, c.size))
    for number, at in enumerate((plane, plane + 180.0)):
        first = (np.searchsorted(c, at % 360.0, side="right") - 1) % c.size
        share = np.mod(at - c[first], 360.0) / gaps_of(c)[first]
        weights[number, first] += 1.0 - share
        weights[number, (first + 1) % c.size] += share
    right, left = weights
    return shared_around(right, left) / math.sqrt(shared_around(right, right) * shared_around(left, left))


def _widths(curve: _Curve, noise: Array, limits: Array) -> Array:
    left, right = _edges(curve.gamma, curve.values + noise, curve.errors, limits)
    return right - left
