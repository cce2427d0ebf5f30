"""A sample on a goniometer, turned about its normal."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.scatter.bsdf import WAVELENGTH, Bsdf, Side

Array = npt.NDArray[np.float64]


class TurnedSample(Bsdf):
    """A BSDF whose x axis points to another azimuth.

    Parameters
    ----------
    bsdf : Bsdf
        As it is.
    turn : number
        By which it is turned about +z, from +x towards +y [°].

    Examples
    --------
    >>> import etendue as et
    >>> brushed = et.bsdf.Gaussian(peak=1.0, sigma=0.1, aspect=3.0)
    >>> across = TurnedSample(brushed, 90.0)
    >>> bool(across.evaluate([0, 0, 1], [0.6, 0, 0.8]) == brushed.evaluate([0, 0, 1], [0, 0.6, 0.8]))
    True
    """

    def __init__(self, bsdf: Bsdf, turn: float) -> None:
        self.bsdf, self.turn = bsdf, turn

    def record(self, files: Files) -> dict[str, Any]:  # noqa: ARG002 - there is none
        """A scene turns its surfaces by `axis`; this one is for goniometers alone."""
        raise ArgumentError("a turned sample is for goniometers; in a scene, state the axis of its finish")

    def evaluate(
        self,
        incident: npt.ArrayLike,
        scattered: npt.ArrayLike,
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """As of the sample, in its own frame."""
        back = turned(incident, -self.turn), turned(scattered, -self.turn)
        return self.bsdf.evaluate(*back, wavelength=wavelength, media=media)

    def sample(
        self,
        incident: npt.ArrayLike,
        n: int,
        *,
        seed: int = 0,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """As of the sample, in its own frame."""
        rays = self.bsdf.sample(turned(incident, -self.turn), n, seed=seed, wavelength=wavelength, media=media)
        return turned(rays, self.turn)

    def _shares(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, side: Side, media: tuple[float, float, float]
    ) -> tuple[Array, Array, Array, Array]:
        of, azimuth = self.bsdf, np.asarray(phi) - self.turn
        more: dict[str, Any] = {"wavelength": media[0], "media": media[1:]}
        mirrored, straight = (
            share(theta, azimuth, side, **more) for share in (of.regular_reflectance, of.regular_transmittance)
        )
        back, through = (share(theta, azimuth, side, **more) for share in (of.reflectance, of.transmittance))
        return mirrored, straight, back - mirrored, through - straight

    @property
    def ways(self) -> tuple[bool, bool, bool, bool]:
        """As of the sample."""
        return self.bsdf.ways


def turned(vectors: npt.ArrayLike, turn: float) -> Array:
    """Vectors of shape (…, 3) turned about +z, from +x towards +y [°].

    Examples
    --------
    >>> turned([1.0, 0.0, 0.0], 90.0).round(12).tolist()
    [0.0, 1.0, 0.0]
    """
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    return np.asarray(np.asarray(vectors, np.float64) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
