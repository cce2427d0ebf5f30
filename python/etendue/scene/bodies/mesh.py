"""Triangle meshes as solids."""

from __future__ import annotations

from etendue.description.files import Files
from etendue.scene.bodies.body import Body, Face
from etendue.scene.placement import HERE
from etendue.scene.shapes import mesh


class Mesh(mesh.Mesh, Body):
    """A closed triangle mesh as a solid; its keys are those of the surface of the same kind.

    If it is closed and its triangles run clockwise seen from outside, it is turned inside out.

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
            flip, told = mesh.volume < 0.0, (mesh.notes, mesh.facet_notes)
            return (Face("surface", self.record(mesh), HERE, flip, None, (), *told),)
        x, y, z = mesh.vertices[edges[0]].mean(axis=0)
        doubt = (
            f"the mesh is open: {len(edges):,} edges are not shared by two triangles of the same sense, one of them around "
            f"({x:.4g}, {y:.4g}, {z:.4g}) mm; light that gets in there is in the wrong medium"
        )
        return (Face("surface", self.record(mesh), doubts=(doubt,), notes=mesh.notes),)
