"""Standard errors of a measured table at the directions of another one that is made of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import NORMAL
from etendue.quantities.bsdf_slice import BsdfSlice

Array = npt.NDArray[np.float64]


def with_standard_errors(made: BsdfData, measured: BsdfData) -> BsdfData:
    """A table made of a measured one, with standard errors of its values.

    The error of a value between measured ones is interpolated as the value is. That is right where neighbours err together,
    and an upper bound where they are independent: the standard deviation of a weighted sum is no more than the weighted sum
    of standard deviations. Errors move with the specular direction, and are those of the nearest angle of incidence.

    Parameters
    ----------
    made : BsdfData
        Of slices on grids.
    measured : BsdfData
        What it was made of.

    Returns
    -------
    BsdfData
        `made` itself if errors are not known for all of its light.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.quantities.polar_grid import PolarGrid
    >>> coarse, fine = (PolarGrid("normal", radial, [0.0]) for radial in ([0.0, 80.0], [0.0, 20.0, 80.0]))
    >>> one = BsdfSlice(direction(30.0, 0.0), [[0.3, 0.1]], grid=coarse, standard_error=[[0.01, 0.03]])
    >>> other = BsdfSlice(direction(30.0, 0.0), [[0.3, 0.25, 0.1]], grid=fine)
    >>> with_standard_errors(BsdfData([other]), BsdfData([one])).slices[0].standard_error.round(6).tolist()
    [[0.01, 0.015, 0.03]]
    """
    slices = []
    for one in made.slices:
        known = [each for each in measured.slices if (each.front, each.transmitted) == (one.front, one.transmitted)]
        if not known or any(each.standard_error is None for each in known):
            return made
        parts = _by_wavelength(known, one.wavelength)
        error = np.sum([part * _at_incidence(one, own, measured) for own, part in parts], axis=0)
        slices.append(dataclasses.replace(one, standard_error=error, interpolated=True))
    return dataclasses.replace(made, slices=tuple(slices))


def _by_wavelength(known: list[BsdfSlice], wavelength: float | None) -> list[tuple[list[BsdfSlice], float]]:
    """Slices of the wavelengths on both sides of one, and their parts; those of no wavelength hold at all."""
    stated = sorted({one.wavelength for one in known if one.wavelength is not None})
    if not stated or wavelength is None:
        return [(known, 1.0)]
    parts = _linear(stated, min(max(wavelength, stated[0]), stated[-1]))
    return [([one for one in known if one.wavelength in (None, at)], part) for at, part in parts]


def _linear(nodes: list[float], x: float) -> list[tuple[float, float]]:
    """The nodes on both sides of x, which is within them, and their parts."""
    if x in nodes:
        return [(x, 1.0)]
    above = int(np.searchsorted(nodes, x))
    part = (x - nodes[above - 1]) / (nodes[above] - nodes[above - 1])
    return [(nodes[above - 1], 1.0 - part), (nodes[above], part)]


def _at_incidence(one: BsdfSlice, known: list[BsdfSlice], measured: BsdfData) -> Array:
    """Errors of slices at the directions of another one: linear in the azimuth of incidence, unless it does not matter."""
    near = min(known, key=lambda each: abs(each.theta - one.theta)).theta
    around = {each.phi: each for each in reversed(known) if abs(each.theta - near) < NORMAL}
    if measured.isotropic or len(around) == 1 or near < NORMAL:
        first = next(each for each in known if abs(each.theta - near) < NORMAL)
        return _errors(one, first, turned=measured.isotropic or near >= NORMAL)
    nodes = sorted(around)
    start = nodes[0]
    beyond = _linear([*nodes, start + 360.0], start + (one.phi - start) % 360.0)
    errors = [part * _errors(one, around[phi if phi in around else start], turned=True) for phi, part in beyond]
    return np.asarray(np.sum(errors, axis=0))


def _errors(one: BsdfSlice, measured: BsdfSlice, *, turned: bool) -> Array:
    """Errors of a slice at the directions of another one, moved with the specular direction; NaN where there are none."""
    turn = np.radians(measured.phi - one.phi) if turned else 0.0
    c, s = np.cos(turn), np.sin(turn)
    off = (one.directions[..., :2] + one.incident[:2]) @ np.array([[c, s], [-s, c]])
    beta = off - measured.incident[:2]
    # What is moved beyond the hemisphere has the error at its rim.
    beta = beta / np.maximum(np.linalg.norm(beta, axis=-1, keepdims=True), 1.0)
    height = np.sqrt(np.maximum(1.0 - np.sum(beta * beta, axis=-1), 0.0))
    to = np.concatenate([beta, np.copysign(height, one.directions[..., 2])[..., None]], axis=-1)
    errors = np.asarray(measured.standard_error)
    if measured.grid is not None:
        return dataclasses.replace(measured, values=errors, standard_error=None).at(to)
    # Single points stand for what is nearest to them in direction cosines.
    points = measured.directions[:, :2]
    nearness = beta @ points.T - 0.5 * np.sum(points * points, axis=-1)
    return np.asarray(errors[np.argmax(nearness, axis=-1)])
