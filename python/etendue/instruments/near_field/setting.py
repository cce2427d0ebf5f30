"""`Setting`: the geometry of a near-field measurement, and how its pixels are recorded."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.camera import Camera
from etendue.instruments.near_field.positions import ArmPositions
from etendue.quantities.observer import Screen

Array = npt.NDArray[np.float64]


def counts_dtype(exposures: int) -> np.dtype[Any]:
    """Of a pixel that is not dark: which, and what each exposure read."""
    return np.dtype([("pixel", "<u4"), ("counts", "<u2", (exposures,))])


@dataclasses.dataclass(frozen=True)
class Setting:
    """The geometry of a measurement.

    Parameters
    ----------
    positions : ArmPositions
    camera : Camera
    distance, photometer_distance : number
        From the centre [mm].
    field_of_view : number
        Side of the image in the plane through the centre [mm].
    centre : tuple of 3 floats
        [mm]
    lamp_size : number
        Diameter of a ball about the centre that nearly all light passes [mm].
    """

    positions: ArmPositions
    camera: Camera
    distance: float
    photometer_distance: float
    field_of_view: float
    centre: tuple[float, float, float]
    lamp_size: float

    @property
    def screen(self) -> Screen:
        """The image, in the plane through the centre."""
        return Screen(self.field_of_view, self.field_of_view, self.camera.pixels, self.camera.pixels)

    def illuminance_of(self, screen: Screen, distance: float) -> Array:
        """Illuminance [lx] at a distance that each pixel makes with 1 cd/m²: its area · cos⁴ / distance², (rows, columns).

        A pixel of area A in the plane of the image is seen under A cos³ / distance², and its light falls obliquely.
        """
        square = screen.x[None, :] ** 2 + screen.y[:, None] ** 2
        return np.asarray(screen.pixel_area * (distance**2 / (distance**2 + square)) ** 2 / distance**2)
