"""The torus, as a solid."""

from __future__ import annotations

from etendue.description.files import Files
from etendue.scene.bodies.body import Body, Face
from etendue.scene.shapes import torus


class Torus(torus.Torus, Body):
    """A ring about the z axis as a solid; its keys are those of the surface of the same kind.

    Examples
    --------
    >>> [face.name for face in Torus(major_radius=5, minor_radius=1).faces(Files())]
    ['surface']
    """

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """The whole surface."""
        return (Face("surface", self.record()),)
