"""Beams that are hardly wider than the cells of direction of the light field that shows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from etendue.lightfield.carrier.part import ALL, Part
from etendue.lightfield.etendue_density import PartField
from etendue.lightfield.trees import Base

ENOUGH = 400.0
"""Cells of direction that a beam must fill, lest what its edges lose to the cells around them shows beside the errors of
20 000 rays or more."""

BLURRED = 0.3
"""An even beam of k cells was found to lack some `BLURRED`/√k of its luminance, as long as its edges are not all of it."""

LEAST_TOLD = 30.0
"""Cells below which they cannot: the beam may be as narrow as light can be."""

NARROW = 0.25
"""Share of all cells from which on light is no beam: cells are as wide as few rays, or who stated them, would have it."""


def filled_cells(part: PartField) -> tuple[float, int]:
    """How many cells of direction the light of a part fills, as many as even light would, and how many there are.

    They are cells of étendue, of the finest grid over direction: (Σ m)²/Σ m² of the light m that all places send into each.

    Examples
    --------
    >>> beam = np.zeros((1, 1, 8, 8), dtype=np.float32)
    >>> beam[0, 0, 3:5, 3:6] = 2.0
    >>> filled_cells(PartField(beam, beam, None, None, 1.0))
    (6.0, 64)
    """
    place, _ = Base(part.space, None).masses(part.ratio.shape)
    light = np.einsum("ijkl,ij->kl", part.ratio, place)
    if part.direction is not None:
        fine = [n // m for n, m in zip(part.direction.shape, light.shape, strict=True)]
        light = part.direction * np.repeat(np.repeat(light, fine[0], axis=0), fine[1], axis=1)
    squares = float(np.square(light).sum())
    return (float(light.sum()) ** 2 / squares if squares > 0.0 else 0.0), light.size


def told_of_narrow_beams(charts: Sequence[Part], parts: Sequence[PartField], fluxes: Sequence[float]) -> Iterator[str]:
    """What is to be said of the part with the most light, if its cells of direction blur it.

    Examples
    --------
    >>> beam = np.zeros((1, 1, 64, 64), dtype=np.float32)
    >>> beam[0, 0, 30:34, 30:33] = 2.0
    >>> from etendue.lightfield.carrier.part import WORLD
    >>> whole = Part("disk", "disk", (0, 0, 0), WORLD, (1.0, 0.0))
    >>> list(told_of_narrow_beams([whole], [PartField(beam, beam, None, None, 1.0)], [100.0]))  # doctest: +ELLIPSIS
    ["the light fills no more than 12 of the light field's 4,096 cells of direction, which blur it: ..."]
    """
    brightest = int(np.argmax(fluxes))
    filled, cells = filled_cells(parts[brightest])
    if not 0.0 < filled < min(ENOUGH, NARROW * cells):
        return
    off = "much more" if filled < LEAST_TOLD else f"some {100.0 * BLURRED / filled**0.5:.1g} % more"
    stated = "" if charts[brightest].beam != ALL else "; a plane or a disk with a beam has cells for it alone"
    yield (
        f"the light fills no more than {filled:,.0f} of the light field's {cells:,} cells of direction, which blur it: "
        f"luminances in the beam are off by {off} than their errors; a cone much narrower than the beam shows them from the "
        f"rays themselves{stated}"
    )
