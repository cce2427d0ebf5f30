"""What all optical properties of surfaces have in common: keys as a scene states them, and the BSDF that they describe."""

from __future__ import annotations

import abc
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.description.values import Vector
from etendue.scatter.bsdf import Bsdf

Record = dict[str, Any]


class Finish(Description, Bsdf, abc.ABC):
    """An optical property of surfaces: the finish of a scene, and a BSDF."""

    @abc.abstractmethod
    def record(self, files: Files) -> Record:
        """The finish as the core takes it.

        Raises
        ------
        ArgumentError
            If more light leaves than arrives, at any angle or wavelength.
        FormatError, OSError
            If a table cannot be read.
        """

    def unbuilt(self, files: Files) -> Record:
        """The same before the core was asked whether it takes it, for a mixture, which asks with all parts at once."""
        return self.record(files)

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """Whether light gets through, so that a solid behind it needs a medium."""
        return False

    def __getstate__(self) -> dict[Any, Any]:
        """For pickle: what was asked of the core is asked again."""
        state = super().__getstate__()
        return state | {"__dict__": {key: value for key, value in state["__dict__"].items() if key != "_compiled"}}


class Directed(Finish, abc.ABC):
    """A finish that may scatter otherwise along an axis than across it.

    Examples
    --------
    >>> from etendue.scatter.models import Gaussian
    >>> Gaussian(peak=1, sigma=0.1, aspect=2, axis=(0, 1, 0)).axis
    (0.0, 1.0, 0.0)
    """

    axis: Vector = (1.0, 0.0, 0.0)
    """Where the x axis of the BSDF points, in the coordinates of the solid or surface; it is laid on the surface there."""

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        if not np.linalg.norm(self.axis) > 0.0:
            raise ValueError("'axis' has no direction")
        return self
