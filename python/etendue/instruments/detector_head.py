"""`DetectorHead`: the head of a detector on its arm, and where it stands in the beam."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.bsdf_directions import light_from

Array = npt.NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class DetectorHead:
    """The head of a detector, which shadows the sample where it gets into the beam.

    Parameters
    ----------
    diameter : number
        [mm]; 0: it is in no beam.
    beam_diameter : number
        Of the beam, across it [mm].
    distance : number
        From the middle of the spot to the head [mm].

    Raises
    ------
    ArgumentError
        If the diameter is negative.

    Examples
    --------
    >>> head = DetectorHead(80.0, beam_diameter=14.0, distance=886.0)
    >>> head.shadows(np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]), 0.0).tolist()
    [True, False]
    """

    diameter: float
    beam_diameter: float
    distance: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.diameter < np.inf:
            raise ArgumentError(f"a head of the detector of {self.diameter:g} mm; give its diameter, 0 or more")

    def shadows(self, arms: Array, theta: float) -> npt.NDArray[np.bool_]:
        """At which positions it stands in the beam that comes at an angle of incidence [°] from azimuth 180°, shape (n,)."""
        if not self.diameter:
            return np.zeros(len(arms), bool)
        # Sine of the angle from the beam within which it is.
        sine = 0.5 * (self.diameter + self.beam_diameter) / self.distance
        return np.asarray(arms @ light_from(theta, 180.0) > np.cos(np.arcsin(min(sine, 1.0))))
