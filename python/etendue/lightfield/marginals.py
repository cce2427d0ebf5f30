"""Marginals of a light field that are those of its images: iterative proportional scaling of its factors."""

from __future__ import annotations

import dataclasses

import numpy as np

from etendue.lightfield.counting import FloatArray
from etendue.lightfield.etendue_density import PartField
from etendue.lightfield.nodes import node_values
from etendue.lightfield.trees import Base

SWEEPS = 2
"""Times that both marginals are set. Each sweep spoils the other one by ever less."""

LARGEST_FACTOR = 50.0
"""By which the density at a place or a direction may change in one step, against the mean of the image or what is brighter
in it: what is dark in the tree stays finite."""


def scaled(part: PartField, images: Base, wraps: bool) -> PartField:
    """The field times one function of the place and one of the direction, so that its marginals are the images.

    The tree's boxes see the place coarsely, an image by itself sees it finely. Of all fields with the marginals of the
    images the one that is scaled to them is the nearest to the tree's in relative entropy [Csiszar1975]_.

    Parameters
    ----------
    part : PartField
        Its factors are replaced: a product of other ones times the ratio is scaled to the same field.
    images : Base
        Wanted densities over the place and over the direction, none of them None.
    wraps : bool
        Whether the first coordinate closes upon itself.

    Examples
    --------
    >>> ratio = np.ones((2, 2, 1, 1), np.float32)
    >>> flat = PartField(ratio, ratio, None, None, 1.0)
    >>> image = np.array([[1.0, 3.0], [2.0, 2.0]])
    >>> scaled(flat, Base(image, np.ones((1, 1))), False).space.tolist()
    [[0.328125, 1.671875], [1.046875, 0.953125]]
    """
    if images.space is None or images.direction is None:
        return part
    wanted = (_nodes(images.space), _nodes(images.direction))
    n1, n2, n3, n4 = part.ratio.shape
    place = (_tents(len(wanted[0]), n1, wraps), _tents(len(wanted[0]), n2, False))
    turn = (_tents(len(wanted[1]), n3, False), _tents(len(wanted[1]), n4, False))
    ratio = part.ratio.reshape(n1 * n2, n3 * n4)
    space, direction = (np.ones_like(w) for w in wanted)
    for _ in range(SWEEPS):
        aims = (turn[0].T @ direction @ turn[1]).ravel() / direction.size
        space = _set(wanted[0], place[0] @ (ratio @ aims).reshape(n1, n2) @ place[1].T)
        places = (place[0].T @ space @ place[1]).ravel() / space.size
        direction = _set(wanted[1], turn[0] @ (places @ ratio).reshape(n3, n4) @ turn[1].T)
    aims = (turn[0].T @ direction @ turn[1]).ravel() / direction.size
    space = _set(wanted[0], place[0] @ (ratio @ aims).reshape(n1, n2) @ place[1].T)
    return dataclasses.replace(part, space=space / space.mean(), direction=direction / direction.mean())


def marginals(part: PartField, sides: tuple[int, int], wraps: bool) -> tuple[FloatArray, FloatArray]:
    """Densities of a field over the place and over the direction, at the centres of fine cells, mean 1.

    Parameters
    ----------
    part : PartField
        Of any level.
    sides : tuple of int
        Fine cells along either side, over place and over direction; as many as the factors have, where there are any.
    wraps : bool
        Whether s₁ closes upon itself.

    Returns
    -------
    tuple of array, shapes (n, n) and (m, m)

    Examples
    --------
    >>> ratio = np.arange(1, 17, dtype=np.float32).reshape(2, 2, 2, 2)
    >>> space, direction = marginals(PartField(ratio, ratio, None, None, 1.0), (2, 2), False)
    >>> space.shape, round(float(space.mean()), 12), bool(space[0, 0] < space[1, 1])
    ((2, 2), 1.0, True)
    """
    n1, n2, n3, n4 = part.ratio.shape
    space = np.ones((sides[0],) * 2) if part.space is None else part.space
    direction = np.ones((sides[1],) * 2) if part.direction is None else part.direction
    place = (_tents(len(space), n1, wraps), _tents(len(space), n2, False))
    turn = (_tents(len(direction), n3, False), _tents(len(direction), n4, False))
    ratio = part.ratio.reshape(n1 * n2, n3 * n4).astype(np.float64)
    aims = (turn[0].T @ direction @ turn[1]).ravel()
    places = (place[0].T @ space @ place[1]).ravel()
    over_place = space * (place[0] @ (ratio @ aims).reshape(n1, n2) @ place[1].T)
    over_direction = direction * (turn[0] @ (places @ ratio).reshape(n3, n4) @ turn[1].T)
    return over_place / over_place.mean(), over_direction / over_direction.mean()


def _nodes(image: FloatArray) -> FloatArray:
    """Values at cell centres between which a factor is linear."""
    values: FloatArray = node_values(image)
    return values


def _set(wanted: FloatArray, found: FloatArray) -> FloatArray:
    """The factor that makes the marginal found the one wanted."""
    mean = max(float(found.mean()), np.finfo(np.float64).tiny)
    # A narrow beam is hundreds of times as bright as the mean of all directions.
    most = np.maximum(wanted, wanted.mean()) * (LARGEST_FACTOR / mean)
    factor = np.divide(wanted, found, out=most, where=found > wanted / most)
    return np.where(wanted > 0, factor, 0.0)


def _tents(fine: int, coarse: int, wraps: bool) -> FloatArray:
    """Weights of the coarse cells' tents at the centres of fine cells, (fine, coarse)."""
    at = (np.arange(fine) + 0.5) / fine * coarse - 0.5
    lower = np.floor(at).astype(np.intp)
    weights = np.zeros((fine, coarse))
    for cell, weight in ((lower, 1.0 - (at - lower)), (lower + 1, at - lower)):
        inside = cell % coarse if wraps else np.clip(cell, 0, coarse - 1)
        np.add.at(weights, (np.arange(fine), inside), weight)
    return weights
