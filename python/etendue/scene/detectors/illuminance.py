"""Illuminance meters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import ClassVar, Literal

from etendue.description.files import Files
from etendue.description.values import Length, Pixels
from etendue.quantities.illuminance_map import IlluminanceMap, Point
from etendue.quantities.observer import Screen
from etendue.quantities.powers_of_ten import counted
from etendue.scene.detectors.detector import Detection, Detector, Record, Recorded, Setting
from etendue.scene.observers import ObserverKeys
from etendue.scene.placement import Placement
from etendue.units import MM2_PER_M2


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
    width: float
    height: float
    columns: int
    rows: int
    centre: Point
    right: Point
    up: Point

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return self.columns * self.rows

    def read(self, recorded: Recorded) -> IlluminanceMap:
        """Flux of each cell over its area."""
        counted, origin = recorded.counted, recorded.origin
        screen = Screen(self.width, self.height, self.columns, self.rows, "xy")
        area = screen.pixel_area / MM2_PER_M2
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
            origin.notes,
        )

    def summary(self, quantity: IlluminanceMap) -> str:
        """Mean and uniformity."""
        return f"mean {counted(quantity.mean, quantity.unit)}, least/mean {quantity.uniformity:.3f}"


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
