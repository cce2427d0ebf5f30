"""Triangle meshes as surfaces, from files or from numbers."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Le, MaxLen, MinLen
from pydantic import model_validator

from etendue.description.files import Files
from etendue.description.values import LONGEST, AsNumber, AsRow, Finite, FirstMistake, Index, Point
from etendue.errors import ArgumentError
from etendue.scene.mesh_files import StoredMesh, read_mesh
from etendue.scene.shapes.shape import Record, Shape, Sheet, Trim
from etendue.scene.triangles import chord_error, facet_angle, open_edges, smooth_normals, volume, welded

Array = npt.NDArray[np.float64]
Triangle = Annotated[tuple[Index, Index, Index], AsRow]
Unit = Literal["nm", "um", "mm", "cm", "m", "inch", "feet"]

SMOOTH = 30.0
"""[°] Neighbours that turn by less are probably meant as one curved surface; it is what the note proposes."""


@dataclasses.dataclass(frozen=True, eq=False)
class Triangulation:
    """A mesh in mm: vertices (n, 3), triangles (m, 3), and edges that no two triangles share (k, 2).

    It is welded, unless it has the normals of the surfaces that it stands for (n, 3); where these differ, a vertex is there
    more than once. `notes` are for whoever uses it, `facet_notes` only matter where light passes it.

    Examples
    --------
    >>> triangle = Mesh(vertices=[(0, 0, 0), (1, 0, 0), (0, 1, 0)], triangles=[(0, 1, 2)])
    >>> len(triangle.triangulation(Files()).open_edges)
    3
    """

    vertices: Array
    triangles: npt.NDArray[np.int64]
    open_edges: npt.NDArray[np.int64]
    normals: Array | None = None
    notes: tuple[str, ...] = ()
    facet_notes: tuple[str, ...] = ()

    @property
    def volume(self) -> float:
        """Volume within [mm³], if the mesh is closed."""
        return volume(self.vertices, self.triangles)


class Mesh(Shape):
    """A triangle mesh, as a surface or as a solid. Its normal is on the side from which triangles run counter-clockwise.

    As a solid it has the face ``surface``.

    Parameters
    ----------
    file : path, optional
        STL, OBJ, PLY or glTF, of which all bodies are taken as one; STEP with ``pip install 'etendue[step]'``.
    body : str, optional
        Name of one body of a STEP file; needed if there are several. ``etendue info`` lists them.
    vertices : rows of 3 numbers, optional
        Instead of a file [mm].
    triangles : rows of 3 integers, optional
        Numbers of vertices, from 0.
    unit : str, optional
        Of the file's lengths: nm, um, mm, cm, m, inch, feet. STL, OBJ and PLY do not say; without it they are taken to be
        in mm. glTF is in m. STEP knows its own.
    scale : number
        By which all lengths are multiplied.
    tolerance : number, optional
        Of STEP files: distance between a surface and the triangles made of it that is asked for [mm]. The reader may exceed
        it here and there; the notes state the chord error that came out. Without it, 1/2000 of the body's longest side, and
        normals turn by less than 0.05 rad along a triangle.
    crease_angle : number, optional
        [°] Neighbours whose normals differ by less are one smooth surface, with interpolated normals; 0: flat triangles.
        Without it, triangles of STEP files have the normals of the true surfaces, all others are flat: vertex normals that
        an OBJ, PLY or glTF file states are not used, and the notes say so.

    Examples
    --------
    >>> Mesh(file="reflector.stl", unit="inch").unit
    'inch'
    """

    kind: Literal["mesh"] = "mesh"
    file: Path | None = None
    vertices: Annotated[tuple[Point, ...], MinLen(3), MaxLen(1 << 20), FirstMistake, AsRow] | None = None
    triangles: Annotated[tuple[Triangle, ...], MinLen(1), MaxLen(1 << 21), FirstMistake, AsRow] | None = None
    unit: Unit | None = None
    body: Annotated[str, MinLen(1)] | None = None
    scale: Annotated[float, Finite, Ge(1e-9), Le(1e9), AsNumber] = 1.0
    tolerance: Annotated[float, Finite, Ge(1e-4), Le(LONGEST), AsNumber] | None = None
    crease_angle: Annotated[float, Finite, Ge(0.0), Le(180.0), AsNumber] | None = None

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if (self.vertices is None) != (self.triangles is None):
            raise ValueError("'vertices' and 'triangles' belong together: give both or neither")
        if (self.file is None) == (self.vertices is None):
            raise ValueError("give either a 'file', or 'vertices' and 'triangles'")
        if self.vertices is not None and self.triangles is not None:
            for key in ("unit", "tolerance", "body"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key!r} is that of a file; 'vertices' are in mm, and exact")
            largest = max(map(max, self.triangles))
            if largest >= len(self.vertices):
                raise ValueError(f"'triangles' name vertex {largest}, and there are {len(self.vertices)}, from 0")
        return self

    def triangulation(self, files: Files) -> Triangulation:
        """The mesh, welded.

        Raises
        ------
        FormatError
            If the file is no mesh.
        ArgumentError
            If it is larger than any scene, or no triangle has an area.
        OSError
            If the file cannot be opened.
        """
        if self.file is not None:
            stored = read_mesh(files.find(self.file), self.unit, self.tolerance, self.body)
        else:
            stored = StoredMesh(np.array(self.vertices), np.array(self.triangles, dtype=np.int64))
        placed = stored.vertices * self.scale
        if not np.abs(placed).max() <= LONGEST:
            raise ArgumentError(
                f"the mesh reaches {np.abs(placed).max():.3g} mm, more than {LONGEST:g}; check its unit"
            )
        vertices, triangles = welded(placed, stored.triangles)
        if not len(triangles):
            raise ArgumentError("no triangle of the mesh has an area")
        edges = open_edges(triangles)
        if stored.normals is not None and self.crease_angle is None:
            notes = self._stated(stored)
            return Triangulation(placed, stored.triangles, edges, stored.normals, notes)
        return Triangulation(
            vertices, triangles, edges, notes=self._stated(stored), facet_notes=self._facets(vertices, triangles)
        )

    def _stated(self, stored: StoredMesh) -> tuple[str, ...]:
        """How far the triangles of a file are from its surfaces, and what else it says of these that is not used."""
        if stored.unread_normals:
            return (f"the file's vertex normals are not used: {self._normals_instead()}",)
        if not stored.chord_error:
            return ()
        kind = "flat" if self.crease_angle == 0.0 else "with interpolated normals"
        error = stored.chord_error * self.scale
        note = (
            f"{len(stored.triangles):,} triangles, {kind}, stand for curved surfaces and are up to {error:.2g} mm away from "
            "them (chord error); a smaller 'tolerance' brings them nearer"
        )
        return (note,)

    def _normals_instead(self) -> str:
        if self.crease_angle is None:
            return f"triangles are flat; crease_angle = {SMOOTH:g} makes smooth normals from them"
        if self.crease_angle == 0.0:
            return "triangles are flat, as crease_angle = 0 asks for"
        return f"crease_angle = {self.crease_angle:g} makes normals from the triangles"

    def _facets(self, vertices: Array, triangles: npt.NDArray[np.int64]) -> tuple[str, ...]:
        """What flat triangles do where a curved surface is meant."""
        if self.crease_angle:
            return ()
        angle = facet_angle(vertices, triangles, SMOOTH)
        if angle == 0.0:
            return ()
        rounded, faces, normals = smooth_normals(vertices, triangles, SMOOTH)
        note = (
            f"{len(triangles):,} flat triangles stand for a curved surface: neighbours turn by {angle:.2g}° (median over "
            f"the area) and are about {chord_error(rounded, faces, normals):.2g} mm away from it; light is refracted and "
            f"mirrored as by facets. crease_angle = {SMOOTH:g} makes the normals smooth"
        )
        return (note,)

    def record(self, mesh: Triangulation) -> Record:
        """The mesh as the core takes it, with normals if it has them or creases are given."""
        vertices, triangles, normals = mesh.vertices, mesh.triangles, mesh.normals
        if self.crease_angle:
            vertices, triangles, normals = smooth_normals(vertices, triangles, self.crease_angle)
        if len(vertices) > np.iinfo(np.uint32).max:
            raise ArgumentError(f"{len(vertices):,} vertices are more than a mesh can have; make it coarser")
        return {"kind": "mesh", "vertices": vertices, "triangles": triangles.astype(np.uint32), "normals": normals}

    def sheet(self, trim: Trim, files: Files) -> Sheet:
        """The mesh within half spaces; ranges of z are half spaces too."""
        if trim.radius is not None:
            raise ArgumentError("trim.radius: a mesh is trimmed by z and half spaces only")
        mesh = self.triangulation(files)
        return Sheet(self.record(mesh), [*trim.planes(), *trim.planes_of_z()], mesh.notes)
