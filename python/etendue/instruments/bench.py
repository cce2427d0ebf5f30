"""`Bench`: beam, aperture and distance of a goniometer, and the lines of sight from the one to the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.beam_and_aperture import Aperture, Beam, axes_of, into_the_sample
from etendue.quantities.vectors import lengths

Array = npt.NDArray[np.float64]

TOGETHER = 20_000
"""Lines of sight that are looked at together: no more than the processor has near."""


class Sight(NamedTuple):
    """Lines of sight of some positions.

    Parameters
    ----------
    positions : slice
        Which.
    incident : array, shape (b, 3)
        To where the light of each node of the beam comes from.
    scattered : array, shape (i, b, n, 3)
        From nodes of the beam on the sample to nodes of the aperture.
    weights : array, shape (i, b, n)
        Share of the beam that passes for f = 1/sr: the étendue of each line over the area of the beam. 0 on the other side
        of the sample.
    """

    positions: slice
    incident: Array
    scattered: Array
    weights: Array


@dataclasses.dataclass(frozen=True)
class Bench:
    """A beam on a sample, and an aperture on an arm about the middle of the spot.

    Parameters
    ----------
    beam : Beam
        Across it.
    aperture : Aperture
        At right angles to the arm.
    distance : number
        From the middle of the spot to the aperture [mm].

    Raises
    ------
    ArgumentError
        If the distance is too short for both.

    Examples
    --------
    >>> bench = Bench(Beam(14.0), Aperture("disk", 25.0), 886.0)
    >>> round(1e4 * bench.solid_angle, 3), round(bench.reach, 2)
    (6.253, 1.26)
    """

    beam: Beam
    aperture: Aperture
    distance: float

    def __post_init__(self) -> None:
        reach = 0.5 * self.beam.diameter + self.aperture.reach
        if not reach < self.distance < np.inf:
            raise ArgumentError(
                f"a distance of {self.distance:g} mm from sample to aperture, but beam and aperture reach {reach:g} mm; "
                "give more"
            )

    @property
    def solid_angle(self) -> float:
        """Ω of the aperture, area over square of the distance [sr]."""
        return self.aperture.area / self.distance**2

    @property
    def reach(self) -> float:
        """Angle from the middle of the bare beam at which its last light gets into the aperture [°]."""
        grown = abs(1.0 + self.distance * np.tan(np.radians(self.beam.divergence)) / (0.5 * self.beam.diameter))
        off = 0.5 * self.beam.diameter * grown + self.aperture.reach
        off += self.distance * np.tan(np.radians(0.5 * self.beam.source_angle))
        return float(np.degrees(np.arctan(off / self.distance)))

    def sights(self, arms: Array, theta: float, beam: int, aperture: int) -> Iterator[Sight]:
        """Lines of sight between nodes of beam and aperture, some positions after the other.

        Parameters
        ----------
        arms : array, shape (k, 3)
            Positions of the detector.
        theta : number
            Angle of incidence [°].
        beam, aperture : int
            Fineness of the nodes across each.
        """
        points, tilts, share = self.beam.nodes(beam)
        start, v = into_the_sample(points, tilts, theta, across=False)
        offsets, area = self.aperture.nodes(aperture)
        together = max(1, TOGETHER // (len(points) * len(offsets)))
        for at in range(0, len(arms), together):
            d = arms[at : at + together]
            frames = np.array([axes_of(one) for one in d])
            ends = self.distance * d[:, None] + np.einsum("na,iac->inc", offsets, frames)
            off = ends[:, None] - start[None, :, None]
            length = lengths(off)
            s = off / length[..., None]
            leaving = s[..., 2] * d[:, None, None, 2] > 0.0
            facing = np.einsum("ibnc,ic->ibn", s, d)
            weights = share[None, :, None] * area * np.abs(s[..., 2]) * facing / length**2
            yield Sight(slice(at, at + len(d)), -v, s, np.where(leaving, weights, 0.0))

    def bare(self, arms: Array, axis: Array) -> Array:
        """Share of the bare beam that gets into the aperture at positions, the beam going along `axis`."""
        turned = np.degrees(2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(arms - axis, axis=1), 0.0, 1.0)))
        return self.beam.overlap(self.aperture, turned, self.distance)

    def remarks(self) -> dict[str, Any]:
        """What it is, by the names of `ScatterGoniometer`, as lines of a file."""
        profile = self.beam.profile
        return {
            "beam_diameter": self.beam.diameter,
            "aperture_diameter": self.aperture.diameter,
            "distance": self.distance,
            "aperture": self.aperture.shape,
            "inner_diameter": self.aperture.inner,
            "profile": profile if isinstance(profile, str) else " ".join(map(repr, profile)),
            "divergence": self.beam.divergence,
            "source_angle": self.beam.source_angle,
        }

    @classmethod
    def from_remarks(cls, remarks: Mapping[str, str]) -> Bench | None:
        """The inverse of `remarks`; None if beam, aperture or distance are missing.

        Raises
        ------
        ValueError
            If a value is no number.
        ArgumentError, UnknownNameError
            If they are impossible.

        Examples
        --------
        >>> Bench.from_remarks({"beam_diameter": "14", "aperture_diameter": "25", "distance": "886"}).distance
        886.0
        """
        if not {"beam_diameter", "aperture_diameter", "distance"} <= set(remarks):
            return None

        def value(key: str) -> float:
            return float(remarks.get(key, "0"))

        profile: Any = remarks.get("profile", "uniform")
        if profile not in ("uniform", "gaussian"):
            profile = tuple(map(float, profile.split()))
        beam = Beam(value("beam_diameter"), profile, value("divergence"), value("source_angle"))
        shape: Any = remarks.get("aperture", "disk")
        return cls(beam, Aperture(shape, value("aperture_diameter"), value("inner_diameter")), value("distance"))
