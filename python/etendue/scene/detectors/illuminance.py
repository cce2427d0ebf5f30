"""Illuminance meters."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist
from types import MappingProxyType
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.description.values import Length, Pixels
from etendue.quantities.illuminance_map import IlluminanceMap, Point
from etendue.quantities.measured import measured
from etendue.quantities.observer import Screen
from etendue.quantities.powers_of_ten import rounded
from etendue.scene.detectors.detector import Counted, Detection, Detector, Record, Recorded, Setting, brightest_of
from etendue.scene.observers import ObserverKeys
from etendue.scene.placement import Placement
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]

TOLD = 0.01
"""By which share chance may lower the least illuminance without a word: uniformities are stated to two digits."""


@dataclasses.dataclass(frozen=True)
class GridIlluminance(Detection[IlluminanceMap]):
    """Illuminance on a rectangle.

    Parameters
    ----------
    width, height, columns, rows
        Of the grid [mm].
    centre, right, up
        As of `IlluminanceMap`.
    """

    KIND = "illuminance"
    HAS_FACE = True
    HAS_WHOLE = True
    width: float
    height: float
    columns: int
    rows: int
    centre: Point
    right: Point
    up: Point

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in: those of the grid, and the last one for all of them."""
        return self.columns * self.rows + 1

    def read(self, recorded: Recorded) -> IlluminanceMap:
        """Flux of each cell over its area."""
        counted, origin = recorded.counted, recorded.origin
        screen = Screen(self.width, self.height, self.columns, self.rows, "xy")
        area = screen.pixel_area / MM2_PER_M2
        flux_error = float(counted.error[-1])
        counted = Counted(counted.flux[:-1], counted.error[:-1], counted.rays[:-1])
        return IlluminanceMap(
            counted.flux.reshape(screen.shape) / area,
            counted.error.reshape(screen.shape) / area,
            counted.rays.reshape(screen.shape),
            screen,
            self.centre,
            self.right,
            self.up,
            origin.flux_unit,
            origin.provenance.then(f"illuminance on {self.name!r}"),
            (*origin.notes, *_chance_told(counted)),
            flux_error,
        )

    def summary(self, quantity: IlluminanceMap) -> str:
        """Mean and uniformity."""
        mean = measured(quantity.mean, quantity.mean_error, quantity.unit)
        return f"mean {mean}, least/mean {rounded(quantity.uniformity, 3)}"

    def figures(self, quantity: IlluminanceMap) -> dict[str, Any]:
        """Mean and uniformity, the brightest cell, and how many there are."""
        mean = {"mean": quantity.mean, "mean_error": quantity.mean_error, "uniformity": quantity.uniformity}
        return mean | brightest_of(quantity)


def lowered_by_chance(values: Array, errors: Array) -> float:
    """By which share of what it would be the least of noisy values is too low, if all are as good as equal.

    The least of K values that are equal is too low by m of their standard errors on average, m being the mean of the largest
    of K normal deviates, Φ⁻¹((K − ⅜)/(K + ¼)) [Blom1958]_. Where values differ, it is less.

    Parameters
    ----------
    values, errors : array
        Of one shape; values are 0 or more.

    Returns
    -------
    float
        0 where the error of the least value is not known.

    Examples
    --------
    >>> round(lowered_by_chance(np.full(100, 500.0), np.full(100, 10.0)), 3)
    0.048
    """
    at = int(values.argmin())
    least, error = float(values.ravel()[at]), float(errors.ravel()[at])
    if not error > 0.0:
        return 0.0
    low = error * NormalDist().inv_cdf((values.size - 0.375) / (values.size + 0.25))
    return low / (least + low)


def _chance_told(counted: Counted) -> Iterator[str]:
    """What noise does to the least illuminance, which is what the uniformity is made of."""
    flux = counted.flux
    missed = int((counted.rays == 0).sum())
    if missed == flux.size:
        yield (
            "no ray met it on the side of its +z: it is dark there, faces away from the light, was missed by chance, or the "
            "light starts on it, which does not count; 'toward' turns it, and more rays tell"
        )
    elif missed:
        yield (
            f"no ray met {missed:,} of {flux.size:,} cells: they are dark, or were missed by chance, and least/mean is 0; "
            "more rays, or fewer cells, tell"
        )
    elif (share := lowered_by_chance(flux, counted.error)) > TOLD:
        at = int(flux.argmin())
        known, low = (rounded(100 * of, 2) for of in (counted.error[at] / flux[at], share))
        yield (
            f"the darkest of {flux.size:,} cells is known to {known} %; chance may have lowered it, and least/mean, by up "
            f"to {low} %: more rays, or fewer cells, tell them better"
        )


class Illuminance(Detector, Placement):
    """An illuminance meter: a grid on a rectangle, for light that arrives on the side of its +z.

    Parameters
    ----------
    width, height : number
        Along its x and y [mm], > 0.
    columns, rows : int
        Cells along x and y.
    at, toward, axis, angle, rotation, spin
        Where it stands.

    Examples
    --------
    >>> floor = Illuminance(width=1000, height=500, columns=20, rows=10)
    >>> floor.record(Files(), {})["columns"]
    20
    """

    DETECTION = GridIlluminance

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({
        "pixels": "columns and rows",
        "shape": "its size, width and height in mm: it is a rectangle",
        **Placement.INSTEAD,
    })  # fmt: skip

    kind: Literal["illuminance"] = "illuminance"
    width: Length
    height: Length
    columns: Pixels
    rows: Pixels

    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:  # noqa: ARG002
        """The grid and its place."""
        return {
            "kind": "illuminance",
            "frame": self.frame().record(),
            "width": self.width,
            "height": self.height,
            "columns": self.columns,
            "rows": self.rows,
        }

    def detection(self, name: str, setting: Setting) -> GridIlluminance:  # noqa: ARG002
        """The grid in its place."""
        ox, oy, oz, xx, xy, xz, yx, yy, yz, *_ = self.frame().record()
        axes = (ox, oy, oz), (xx, xy, xz), (yx, yy, yz)
        return GridIlluminance(name, self.width, self.height, self.columns, self.rows, *axes)
