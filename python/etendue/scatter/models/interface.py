"""A smooth interface of two media."""

from __future__ import annotations

from typing import Literal

from etendue.description.files import Files
from etendue.scatter.models.finish import Finish, Record


class Interface(Finish):
    """A smooth interface of the media on both sides: refraction, Fresnel reflection and total internal reflection.

    Examples
    --------
    >>> Interface().record(Files())
    {'kind': 'fresnel'}
    """

    kind: Literal["interface"] = "interface"

    def record(self, files: Files) -> Record:  # noqa: ARG002 - other finishes have tables
        """Nothing but its name: the media tell the rest."""
        return {"kind": "fresnel"}

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """Always."""
        return True
