"""An instrument of which only its instrument function is known: a round blur, the same at all positions."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from etendue.instruments.beam_and_aperture import axes_of
from etendue.instruments.bench import TOGETHER, Sight
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.operators import folded
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.quadrature import gauss_legendre

Array = npt.NDArray[np.float64]

RADII_PER_NODE, AZIMUTHS_PER_NODE = 4, 8
"""Rings of the blur, and nodes on each, by the fineness of an aperture."""


@dataclasses.dataclass(frozen=True, eq=False)
class RoundBlur:
    """What a scan of the bare beam says of its instrument.

    Exact about the regular direction, where the spot is seen as the beam is, whatever the incidence; elsewhere the spot is
    an ellipse whose size is not known.

    Parameters
    ----------
    signature : GoniometerScan
        Of the bare beam.
    solid_angle : number
        Of the aperture [sr]; 1 if it is not known, so that f is in units of the flux.

    Examples
    --------
    >>> import etendue as et
    >>> blur = RoundBlur.of(et.ScatterGoniometer().instrument_function())
    >>> round(blur.reach, 2)
    1.3
    """

    signature: GoniometerScan
    solid_angle: float
    radius: Array
    blur: Array

    @classmethod
    def of(cls, signature: GoniometerScan, solid_angle: float | None = None) -> RoundBlur:
        """From the scan; its own solid angle if none is given.

        Raises
        ------
        ArgumentError
            If it holds no light, or ends on one side of its middle.
        """
        known = solid_angle or signature.solid_angle or 1.0
        return cls(signature, known, *folded(signature))

    @property
    def reach(self) -> float:
        """Angle from its middle at which the instrument function ends [°]."""
        return float(self.radius[-1])

    def sights(self, arms: Array, theta: float, beam: int, aperture: int) -> Iterator[Sight]:  # noqa: ARG002 - the beam is in the blur
        """Lines about each position, weighted by the blur; all start at the middle of the spot."""
        x, w = gauss_legendre(RADII_PER_NODE * aperture)
        radius = 0.5 * self.reach * (x + 1.0)
        around = AZIMUTHS_PER_NODE * aperture
        azimuth = (np.arange(around) + 0.5) * (2.0 * np.pi / around)
        part = w * np.interp(radius, self.radius, self.blur) * np.sin(np.radians(radius))
        share = np.repeat(part / part.sum() / around, around)
        r, a = np.radians(np.repeat(radius, around)), np.tile(azimuth, radius.size)
        local = np.column_stack([np.sin(r) * np.cos(a), np.sin(r) * np.sin(a), np.cos(r)])
        together = max(1, TOGETHER // len(local))
        for at in range(0, len(arms), together):
            d = arms[at : at + together]
            frames = np.array([[*axes_of(one), one] for one in d])
            s = np.einsum("nk,ikc->inc", local, frames)
            leaving = s[..., 2] * d[:, None, 2] > 0.0
            weights = np.where(leaving, share * np.abs(s[..., 2]) * self.solid_angle, 0.0)
            yield Sight(slice(at, at + len(d)), direction(theta, 180.0)[None], s[:, None], weights[:, None])

    def bare(self, arms: Array, axis: Array) -> Array:
        """The instrument function by angle from the axis."""
        turned = np.degrees(2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(arms - axis, axis=1), 0.0, 1.0)))
        return np.asarray(np.interp(turned, self.radius, self.blur, right=0.0) * self.signature.flux.max())
