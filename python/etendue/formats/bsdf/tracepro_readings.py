"""Closed forms of TracePro's scatter, and what the columns of numbers may stand for in each.

β and β₀ are the projections of the scattered and the specular direction on the surface; x is the part of β − β₀ along the
local x axis, y that across it.

Of the elliptical and the one-dimensional kinds the formulas are documented, and the names of the columns, but not which
column holds which number of a formula. So there are several readings of such a kind, and the shares of the file tell which
one is meant: TracePro makes what is absorbed, specular and scattered add up to 1 in each row.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]

A, B, BY, G, GY = range(5)
"""The columns of one way of light: BRDF_A, BRDF_B, BRDF_By, BRDF_g, BRDF_gy, or those of BTDF."""

NAMES = ("A", "B", "By", "g", "gy")

Value = Callable[[Array, Array, Array], Array]
"""f [1/sr] at x and y, of numbers (k,)."""

Profile = Callable[[Array, Array], Array]
"""The factor of f that depends on x."""

NONE = np.zeros(0)

MOST_ASPECT = 1e3
"""Of lobes that the models hold."""


@dataclasses.dataclass(frozen=True)
class Reading:
    """What the columns of a kind of scatter stand for.

    Parameters
    ----------
    says : str
        In words.
    value : callable
        f [1/sr] at x and y of the same shape, of numbers (k,).
    sound : callable
        Whether numbers (k,) make sense so.
    share : callable
        Of numbers (k,), and of β₀ (x and y): ∫ f over all β on the unit disk, the share of the flux.
    model : callable
        Of numbers (k,), and of whether the axis turns with the plane of incidence: the keys of the finish that is the same
        function, or None.
    widths : callable
        Of numbers (k,): how far f reaches along the axis and across it.
    nodes : array
        |β − β₀| at which a table has to have values.
    """

    says: str
    value: Value
    sound: Callable[[Array], bool]
    share: Callable[[Array, Array], float]
    model: Callable[[Array, bool], dict[str, Any] | None]
    widths: Callable[[Array], tuple[float, float]]
    nodes: Array


def readings(scatter: int, beta: Array) -> tuple[Reading, ...]:
    """Those of a kind of scatter, the likeliest first.

    Parameters
    ----------
    scatter : int
        1, 2, 3, 6 or 7, as the file counts.
    beta : array, shape (n,)
        Of a one-dimensional table: the x of its values, which follow the numbers of the columns.

    Examples
    --------
    >>> (abg,) = readings(1, np.zeros(0))
    >>> abg.value(np.array([0.3]), np.array([0.4]), np.array([0.1, 0.05, 0.0, 2.0, 0.0])).round(6).tolist()
    [0.333333]
    """
    if scatter == 1:
        return (Reading("", _round, _is_abg, _share_of(_round), _round_model, _fall(_round), NONE),)
    if scatter == 2:
        along = "A is A along the axis, so that A/B there is the peak in all directions"
        peak = "A is the peak, BSDF(0)"
        return (_ellipse(along, lambda p: float(p[A] / p[B])), _ellipse(peak, lambda p: float(p[A])))
    if scatter == 3:
        return tuple(_gaussian(x, y) for x, y in ((B, BY), (G, GY)))
    if scatter == 6:
        return tuple(_streak(_profile, _is_abg, across, form) for form in FORMS for across in (BY, GY))
    return tuple(_listed(beta, across, form) for form in FORMS for across in (BY, GY, B, G))


def _is_abg(p: Array) -> bool:
    return bool(p[B] > 0.0 or p[G] == 0.0)


def _profile(r: Array, p: Array) -> Array:
    return np.asarray(p[A] / (p[B] + np.abs(r) ** p[G]))


def _round(x: Array, y: Array, p: Array) -> Array:
    return _profile(np.hypot(x, y), p)


def _round_model(p: Array, turning: bool) -> dict[str, Any]:  # noqa: ARG001 - round lobes know no axis
    return {"kind": "abg", "a": float(p[A]), "b": float(p[B]), "g": float(p[G])}


def _ellipse(says: str, peak: Callable[[Array], float]) -> Reading:
    """ABg whose B and g depend on the azimuth φ of β − β₀ as the radius of an ellipse: 1/B² = cos²φ/Bx² + sin²φ/By².

    The peak is the same at all azimuths: A = BSDF(0)·B.
    """

    def value(x: Array, y: Array, p: Array) -> Array:
        square = x * x + y * y
        there = square > 0.0
        along = np.where(there, x * x, 1.0) / np.where(there, square, 1.0)
        inverse = np.sqrt(along / p[B] ** 2 + (1.0 - along) / p[BY] ** 2)
        g = 0.0 if p[G] == 0.0 else 1.0 / np.sqrt(along / p[G] ** 2 + (1.0 - along) / p[GY] ** 2)
        return np.asarray(peak(p) / (1.0 + np.sqrt(square) ** g * inverse))

    def sound(p: Array) -> bool:
        return bool(p[B] > 0.0 and p[BY] > 0.0 and (p[G] > 0.0) == (p[GY] > 0.0))

    def model(p: Array, turning: bool) -> dict[str, Any] | None:
        keys = {"kind": "abg", "a": peak(p) * float(p[B]), "b": float(p[B]), "g": float(p[G])}
        if p[B] == p[BY] and p[G] == p[GY]:
            return keys
        # Only r itself is stretched like an ellipse: a power of it is not.
        if p[G] == p[GY] == 1.0 and not turning:
            return _stretched(keys, p[BY] / p[B])
        return None

    return Reading(says, value, sound, _share_of(value), model, _fall(value), NONE)


def _gaussian(along: int, across: int) -> Reading:
    """BSDF(0) exp[−2(x²/sx² + y²/sy²)]."""

    def profile(x: Array, p: Array) -> Array:
        return np.asarray(p[A] * np.exp(-2.0 * (x / p[along]) ** 2))

    def model(p: Array, turning: bool) -> dict[str, Any] | None:
        keys = {"kind": "gaussian", "peak": float(p[A]), "sigma": float(p[along]) / 2.0}
        if p[along] == p[across]:
            return keys
        return None if turning else _stretched(keys, p[across] / p[along])

    says = f"A is the peak, {NAMES[along]} and {NAMES[across]} are half widths at 1/e²"
    form = Form("", 0.5, unit=False)
    streak = _streak(profile, lambda p: bool(p[along] > 0.0), across, form)
    return dataclasses.replace(streak, says=f"{says} along the axis and across it", model=model)


def _stretched(keys: dict[str, Any], aspect: float) -> dict[str, Any] | None:
    return {**keys, "aspect": float(aspect)} if 1.0 / MOST_ASPECT <= aspect <= MOST_ASPECT else None


@dataclasses.dataclass(frozen=True)
class Form:
    """A Gaussian across the axis.

    Parameters
    ----------
    says : str
        What its width is.
    sigma : float
        Standard deviations of a width.
    unit : bool
        Whether its integral is 1, instead of its peak.
    """

    says: str
    sigma: float
    unit: bool


FORMS = (
    Form("the standard deviation", 1.0, unit=False),
    Form("the half width at 1/e²", 0.5, unit=False),
    Form("the standard deviation, of a Gaussian with the integral 1", 1.0, unit=True),
)


def _listed(beta: Array, across: int, form: Form) -> Reading:
    """A profile that is linear between the values of a table, and beyond them the last."""

    def profile(x: Array, p: Array) -> Array:
        return np.interp(x, beta, p[GY + 1 :])

    def widths(p: Array) -> tuple[float, float]:
        bright = np.abs(beta[p[GY + 1 :] >= 0.5 * p[GY + 1 :].max()])
        return float(max(bright.max(), np.diff(beta).min())), form.sigma * float(p[across])

    streak = _streak(profile, lambda _: True, across, form, beta)
    return dataclasses.replace(streak, widths=widths, nodes=np.abs(beta))


def _streak(profile: Profile, sound: Callable[[Array], bool], across: int, form: Form, beta: Array = NONE) -> Reading:
    """A profile over x times a Gaussian over y."""

    def gaussian(p: Array) -> tuple[float, float]:
        sigma = form.sigma * float(p[across])
        return sigma, 1.0 / (math.sqrt(2.0 * math.pi) * sigma) if form.unit else 1.0

    def value(x: Array, y: Array, p: Array) -> Array:
        sigma, peak = gaussian(p)
        return np.asarray(profile(x, p) * peak * np.exp(-0.5 * (y / sigma) ** 2))

    def share(p: Array, specular: Array) -> float:
        sigma, peak = gaussian(p)
        ends = np.array([-1.0, 1.0]) - specular[0]
        inside = np.concatenate([-STEPS, STEPS, [0.0], beta])
        edges = np.unique(np.concatenate([ends, inside[(inside > ends[0]) & (inside < ends[1])]]))
        x, weights = _gauss(edges)
        half = np.sqrt(np.maximum(1.0 - (x + specular[0]) ** 2, 0.0))
        bounds = np.stack([-half, half]) - specular[1]
        low, high = _erf(bounds / (math.sqrt(2.0) * sigma))
        return float(np.sum(weights * profile(x, p) * peak * sigma * math.sqrt(0.5 * math.pi) * (high - low)))

    says = f"{NAMES[across]} is the width of the Gaussian across the axis: {form.says}"
    return Reading(
        says, value, lambda p: bool(p[across] > 0.0) and sound(p), share, lambda _p, _turning: None, _fall(value), NONE
    )


def _fall(value: Value) -> Callable[[Array], tuple[float, float]]:
    """Where f has fallen to half of its peak, along the axis and across it."""
    r = np.geomspace(1e-6, 2.0, 400)

    def widths(p: Array) -> tuple[float, float]:
        found = []
        for x, y in ((r, 0.0 * r), (0.0 * r, r)):
            f = value(x, y, p)
            fallen = np.flatnonzero(f < 0.5 * f[0])
            found.append(float(r[fallen[0]] if fallen.size else r[-1]))
        return found[0], found[1]

    return widths


STEPS = np.geomspace(1e-7, 2.0, 60)
"""Edges of cells of a quadrature about the specular direction."""

# numpy has no error function, and SciPy is not there for everybody.
_erf = np.vectorize(math.erf, otypes=[np.float64])

NODES = 6
"""Of the rule of Gauss and Legendre in each cell."""


def _gauss(edges: Array) -> tuple[Array, Array]:
    t, w = gauss_legendre(NODES)
    widths = np.diff(edges)
    return (edges[:-1, None] + widths[:, None] * 0.5 * (t + 1.0)).ravel(), (widths[:, None] * 0.5 * w).ravel()


AZIMUTHS = 720
"""Of the quadrature over the disk."""


def _share_of(value: Value) -> Callable[[Array, Array], float]:
    """By a quadrature in polar coordinates about β₀, in the logarithm of the distance."""

    def share(p: Array, specular: Array) -> float:
        turn = (np.arange(AZIMUTHS) + 0.5) * (2.0 * np.pi / AZIMUTHS)
        u, v = np.cos(turn), np.sin(turn)
        outwards = specular[0] * u + specular[1] * v
        rim = np.sqrt(outwards**2 + 1.0 - specular @ specular) - outwards
        part, weights = _gauss(np.concatenate([[0.0], STEPS / STEPS[-1]]))
        r = rim[:, None] * part
        f = value(r * u[:, None], r * v[:, None], p)
        return float(np.sum(f * r * rim[:, None] * weights) * (2.0 * np.pi / AZIMUTHS))

    return share
