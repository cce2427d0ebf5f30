"""What a prior of small total variation says of a lobe, for Richardson and Lucy's iteration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from etendue.instruments.lobe_splines import LobeSplines

Array = npt.NDArray[np.float64]

STRENGTHS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
"""Of the prior, from which held-out counts choose."""

FLAT = 1e-6
"""Of the largest weight: a slope by step below which there is none."""

LEAST = 0.2
"""What the prior may divide by."""


def total_variation(splines: LobeSplines, strength: float) -> Callable[[Array], Array]:
    """The factor 1/(1 − λ div(∇x/|∇x|)) of [Dey2006]_, for weights of splines of shape (m, k).

    Of the finest splines alone: where positions are farther apart, nothing is to be smoothed. Where a neighbour is missing
    there is no gradient.

    Parameters
    ----------
    splines : LobeSplines
        m of them.
    strength : number
        λ, relative to what the counts say of a weight.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.instruments.lobe_splines import splines_for
    >>> arms = direction([9.0, 10.0, 11.0], 0.0)
    >>> splines = splines_for(arms, arms[1], np.ones(3), 1.0, 1.0)
    >>> bool(np.all(total_variation(splines, 0.01)(np.ones((splines.count, 1))) == 1.0))
    True
    """

    def factor(x: Array) -> Array:
        divergence = np.zeros_like(x)
        for level in splines.levels[:1]:
            there = level.number >= 0
            g = np.zeros((*there.shape, x.shape[1]))
            g[there] = x[level.number[there]]
            along, across = np.zeros_like(g), np.zeros_like(g)
            along[:-1] = (g[1:] - g[:-1]) * (there[1:] & there[:-1])[..., None]
            across[:, :-1] = (g[:, 1:] - g[:, :-1]) * (there[:, 1:] & there[:, :-1])[..., None]
            length = np.sqrt(along**2 + across**2 + (FLAT * np.maximum(g.max(axis=(0, 1)), 1e-300)) ** 2)
            along, across = along / length, across / length
            flow = along + across
            flow[1:] -= along[:-1]
            flow[:, 1:] -= across[:, :-1]
            divergence[level.number[there]] = flow[there]
        return np.asarray(1.0 / np.maximum(1.0 - strength * divergence, LEAST))

    return factor
