"""Triangle meshes as solids."""

from __future__ import annotations

import dataclasses

import numpy as np

from etendue.description.files import Files
from etendue.scene.bodies.body import Body, Face
from etendue.scene.placement import HERE
from etendue.scene.shapes import mesh
from etendue.scene.shapes.mesh import Triangulation
from etendue.scene.shells import senses


class Mesh(mesh.Mesh, Body):
    """A closed triangle mesh as a solid; its keys are those of the surface of the same kind.

    A closed shell whose triangles run clockwise seen from outside is turned inside out; one within another that runs the
    other way is a cavity.

    Examples
    --------
    >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    >>> tetrahedron = Mesh(vertices=corners, triangles=[(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    >>> tetrahedron.faces(Files())[0].flip
    True
    """

    def faces(self, files: Files) -> tuple[Face, ...]:
        """The whole mesh as one face, with its normals outwards."""
        mesh = self.triangulation(files)
        edges = mesh.open_edges
        if not len(edges):
            return (self._closed(mesh),)
        x, y, z = mesh.vertices[edges[0]].mean(axis=0)
        doubt = (
            f"the mesh is open: {len(edges):,} edges are not shared by two triangles of the same sense, one of them around "
            f"({x:.4g}, {y:.4g}, {z:.4g}) mm; light that gets in there is in the wrong medium"
        )
        return (Face("surface", self.record(mesh), doubts=(doubt,), notes=mesh.notes),)

    def _closed(self, mesh: Triangulation) -> Face:
        """The face of a closed mesh, with its normals outwards."""
        if mesh.normals is not None:  # those of a STEP file lead out of its bodies, or into them
            return self._face(mesh, mesh.volume < 0.0)
        inward, twice = senses(mesh.vertices, mesh.triangles)
        doubts: tuple[str, ...] = ()
        if twice is not None:
            x, y, z = twice
            doubt = (
                f"a closed part of the mesh, around ({x:.4g}, {y:.4g}, {z:.4g}) mm, lies within another part that runs the "
                "same way; light that meets it is lost: as a cavity it runs the other way, and a body of another medium is "
                "a solid of its own"
            )
            doubts = (doubt,)
        if inward.all():
            return self._face(mesh, True, doubts)
        turned = np.where(inward[:, None], mesh.triangles[:, ::-1], mesh.triangles)
        return self._face(dataclasses.replace(mesh, triangles=turned), False, doubts)

    def _face(self, mesh: Triangulation, flip: bool, doubts: tuple[str, ...] = ()) -> Face:
        return Face("surface", self.record(mesh), HERE, flip, None, doubts, mesh.notes, mesh.facet_notes)
