"""`PolarGrid`: scattered directions in polar coordinates about the normal or about the specular direction."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_directions import direction, mirrored

Array = npt.NDArray[np.float64]
GridFrame = Literal["normal", "specular", "cosines"]
GRID_FRAMES: tuple[str, ...] = get_args(GridFrame)

GRAZING = 1e-9
"""Heights below which a direction lies in the surface."""


@dataclasses.dataclass(frozen=True, eq=False)
class PolarGrid:
    """Scattered directions in polar coordinates about the normal or about the specular direction.

    Parameters
    ----------
    frame : {"normal", "specular", "cosines"}
        ``"normal"``: the radial coordinate is θ [°] from the normal of the side where light leaves, the azimuth φ [°] from
        +x towards +y.
        ``"specular"``: it is the angle [°] to the specular direction s (mirrored, or straight on), and the azimuth [°] turns
        from the direction e at right angles to s that lies in the plane of incidence on the side of the normal, towards
        s × e. If s is the normal, e points to −β₀ of a slightly larger incidence at the same azimuth.
        ``"cosines"``: it is |β − β₀|, β and β₀ being the projections of the scattered and the specular direction on the
        surface, and the azimuth [°] turns from the direction of β₀ towards +90° about +z (Harvey and Shack). At normal
        incidence the direction of β₀ is that of a slightly larger incidence at the same azimuth, if `light_from` made the
        incident direction; if it is the normal exactly, light counts as from azimuth 0, and β₀ points to −x.
    radial : array, shape (n,)
        Increasing, not negative.
    azimuth : array, shape (m,)
        Increasing, at most 360° wide; values repeat after 360°. A single azimuth: values do not depend on it.

    Examples
    --------
    >>> about = PolarGrid("specular", [0.0, 10.0], [0.0, 180.0])
    >>> about.directions(direction(30.0, 180.0), transmitted=False)[0, 1].round(3).tolist()  # 10° towards the normal
    [0.342, -0.0, 0.94]
    """

    frame: GridFrame
    radial: Array
    azimuth: Array

    def __post_init__(self) -> None:
        if self.frame not in GRID_FRAMES:
            raise ArgumentError(f"frame is one of {', '.join(GRID_FRAMES)}, not {self.frame!r}")
        for name in ("radial", "azimuth"):
            values = np.array(getattr(self, name), np.float64)
            if values.ndim != 1 or not values.size or not np.isfinite(values).all() or (np.diff(values) <= 0.0).any():
                raise ArgumentError(f"the {name} coordinates of a grid are finite and increase")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if self.radial[0] < 0.0 or np.ptp(self.azimuth) > 360.0:
            raise ArgumentError("radial coordinates are not negative, and azimuths span 360° at most")

    @property
    def shape(self) -> tuple[int, int]:
        """Azimuths, radial coordinates."""
        return self.azimuth.size, self.radial.size

    def directions(self, incident: Array, *, transmitted: bool) -> Array:
        """Scattered directions, shape (m, n, 3); NaN where a coordinate is no direction on the side where light leaves."""
        return self.direction(self.radial[None, :], self.azimuth[:, None], incident, transmitted=transmitted)

    def direction(self, radial: npt.ArrayLike, azimuth: npt.ArrayLike, incident: Array, *, transmitted: bool) -> Array:
        """The directions at coordinates, shape (…, 3); NaN where there is none on the side where light leaves."""
        r, a = np.broadcast_arrays(np.asarray(radial, np.float64), np.radians(azimuth))
        side = math.copysign(1.0, incident[2]) * (-1.0 if transmitted else 1.0)
        forward = _forward(incident)
        if self.frame == "normal":
            found = direction(np.degrees(np.radians(r)), np.degrees(a), behind=side < 0.0)
        elif self.frame == "specular":
            s, e, across = specular_axes(incident, transmitted=transmitted)
            t = np.radians(r)
            turned = np.cos(a)[..., None] * e + np.sin(a)[..., None] * across
            found = np.cos(t)[..., None] * s + np.sin(t)[..., None] * turned
        else:
            sideways = np.array([-forward[1], forward[0]])
            beta = -incident[:2] + r[..., None] * (np.cos(a)[..., None] * forward + np.sin(a)[..., None] * sideways)
            with np.errstate(invalid="ignore"):
                height = side * np.sqrt(1.0 - np.sum(beta * beta, axis=-1))
            found = np.concatenate([beta, height[..., None]], axis=-1)
        gone = ~(found[..., 2] * side >= -GRAZING)
        found[gone] = np.nan
        return found

    def coordinates(self, scattered: npt.ArrayLike, incident: Array, *, transmitted: bool) -> tuple[Array, Array]:
        """The inverse of `direction`: radial coordinates and azimuths [°] from 0 to 360 of directions of shape (…, 3)."""
        v = np.asarray(scattered, np.float64)
        forward = _forward(incident)
        if self.frame == "normal":
            radial = np.degrees(np.arctan2(np.hypot(v[..., 0], v[..., 1]), np.abs(v[..., 2])))
            azimuth = np.arctan2(v[..., 1], v[..., 0])
        elif self.frame == "specular":
            s, e, across = specular_axes(incident, transmitted=transmitted)
            x, y = v @ e, v @ across
            radial = np.degrees(np.arctan2(np.hypot(x, y), v @ s))
            azimuth = np.arctan2(y, x)
        else:
            off = v[..., :2] + incident[:2]
            radial = np.hypot(off[..., 0], off[..., 1])
            azimuth = np.arctan2(forward[0] * off[..., 1] - forward[1] * off[..., 0], off @ forward)
        return np.asarray(radial), np.degrees(azimuth) % 360.0


def _forward(incident: Array) -> Array:
    """The direction of β₀ in the plane of the surface; along −x where light comes along the normal exactly."""
    across = math.hypot(incident[0], incident[1])
    return -incident[:2] / across if across > 0.0 else np.array([-1.0, 0.0])


def specular_axes(incident: Array, *, transmitted: bool) -> tuple[Array, Array, Array]:
    """The specular direction s, e at right angles to it towards the normal of its side, and s × e.

    Parameters
    ----------
    incident : array, shape (3,)
        Unit vector to where the light comes from.
    transmitted : bool
        Whether the light passes to the other side: s then goes straight on.

    Returns
    -------
    array, array, array, shape (3,)

    Examples
    --------
    >>> s, e, across = specular_axes(np.array([-0.6, 0.0, 0.8]), transmitted=False)
    >>> (s + 0.0).tolist(), (e + 0.0).tolist(), (across + 0.0).tolist()
    ([0.6, 0.0, 0.8], [-0.8, 0.0, 0.6], [0.0, -1.0, 0.0])
    """
    s = -incident if transmitted else mirrored(incident)
    side = math.copysign(1.0, s[2])
    forward = _forward(incident)
    sine = math.hypot(s[0], s[1])
    e = np.array([*(-abs(s[2]) * forward), side * sine])
    return s, e, np.cross(s, e)
