"""Round bodies: balls, domes, rods, frusta."""

from __future__ import annotations

from typing import Any, Literal

from etendue.description.files import Files
from etendue.description.values import Length, LengthOrZero
from etendue.scene.bodies.body import Body, Face
from etendue.scene.bodies.flat import lid
from etendue.scene.shapes.round import Cone, Cylinder, Hemisphere, Sphere
from etendue.scene.shapes.shape import Record


class Ball(Body):
    """A ball around the origin, with the face ``surface``.

    Parameters
    ----------
    radius : number
        [mm], > 0.

    Examples
    --------
    >>> [face.name for face in Ball(radius=3).faces(Files())]
    ['surface']
    """

    kind: Literal["ball"] = "ball"
    radius: Length

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """The sphere."""
        return (Face("surface", Sphere(radius=self.radius).quadric()),)


class Dome(Body):
    """Half a ball that stands on z = 0, with the faces ``dome`` and ``base``.

    Parameters
    ----------
    radius : number
        [mm], > 0.

    Examples
    --------
    >>> [face.name for face in Dome(radius=3).faces(Files())]
    ['dome', 'base']
    """

    kind: Literal["dome"] = "dome"
    radius: Length

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """The hemisphere and the disk below it."""
        return (Face("dome", Hemisphere(radius=self.radius).quadric()), lid("base", disk(self.radius), 0.0, top=False))


class Rod(Body):
    """A closed cylinder about the z axis that stands on z = 0, with the faces ``side``, ``bottom`` and ``top``.

    Parameters
    ----------
    radius, height : number
        [mm], > 0.

    Examples
    --------
    >>> [face.name for face in Rod(radius=3, height=2).faces(Files())]
    ['side', 'bottom', 'top']
    """

    kind: Literal["rod"] = "rod"
    radius: Length
    height: Length

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """The side and two disks."""
        return (
            Face("side", Cylinder(radius=self.radius, height=self.height).quadric()),
            lid("bottom", disk(self.radius), 0.0, top=False),
            lid("top", disk(self.radius), self.height, top=True),
        )


class Frustum(Body):
    """A frustum of a cone about the z axis that stands on z = 0, with the faces ``side``, ``bottom`` and ``top``.

    Parameters
    ----------
    radius_bottom, radius_top : number
        [mm], ≥ 0, not both 0; an end of radius 0 is a tip and no face.
    height : number
        [mm], > 0.

    Examples
    --------
    >>> [face.name for face in Frustum(radius_bottom=3, radius_top=0, height=2).faces(Files())]
    ['side', 'bottom']
    """

    kind: Literal["frustum"] = "frustum"
    radius_bottom: LengthOrZero
    radius_top: LengthOrZero
    height: Length

    def model_post_init(self, _context: Any) -> None:
        """Refuse what no cone is."""
        self._side()

    def _side(self) -> Cone:
        return Cone(radius_bottom=self.radius_bottom, radius_top=self.radius_top, height=self.height)

    def faces(self, files: Files) -> tuple[Face, ...]:  # noqa: ARG002 - other bodies come from files
        """The side and a disk at each end that has a width."""
        found = [Face("side", self._side().quadric())]
        if self.radius_bottom > 0.0:
            found.append(lid("bottom", disk(self.radius_bottom), 0.0, top=False))
        if self.radius_top > 0.0:
            found.append(lid("top", disk(self.radius_top), self.height, top=True))
        return tuple(found)


def disk(radius: float) -> Record:
    """The outline of a disk as the core takes it.

    Examples
    --------
    >>> disk(2.0)
    {'kind': 'annulus', 'inner': 0.0, 'outer': 2.0}
    """
    return {"kind": "annulus", "inner": 0.0, "outer": radius}


ROUND_BODIES: dict[str, type[Body]] = {cls.model_fields["kind"].default: cls for cls in (Ball, Dome, Rod, Frustum)}
"""Round bodies by kind."""
