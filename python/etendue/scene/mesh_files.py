"""Triangle meshes from files: STL, OBJ, PLY, glTF, and STEP, found by content."""

from __future__ import annotations

import dataclasses
import io
import logging
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.head import STEP_SIGNATURE
from etendue.quantities.memory import require_memory
from etendue.scene.mesh_limits import LARGEST_FILE, check_mesh, require_mesh_memory
from etendue.scene.obj_files import read_obj
from etendue.scene.stated_normals import states_normals
from etendue.scene.step_files import StepBody, read_step
from etendue.scene.triangles import as_written
from etendue.units import MM_PER_LENGTH_UNIT

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

HEAD = 1 << 14
"""Bytes that tell a format: remarks may stand first."""


_FACET = re.compile(rb"^\s*facet\b", re.MULTILINE | re.IGNORECASE)


@dataclasses.dataclass(frozen=True)
class MeshFormat:
    """A format of meshes.

    Parameters
    ----------
    name : str
        As the reading library calls it.
    title : str
        For messages.
    recognise : callable
        From the first bytes and the size of a file.
    mm : float or None
        Millimetres per stored unit where the format fixes the unit.

    Examples
    --------
    >>> MESH_FORMATS["ply"].recognise(b"ply", 3)
    True
    """

    name: str
    title: str
    recognise: Callable[[bytes, int], bool]
    mm: float | None = None


def _is_binary_stl(head: bytes, size: int) -> bool:
    return len(head) >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little")


def _is_obj(head: bytes, _size: int) -> bool:
    lines = [line.split() for line in head.decode("utf-8-sig", errors="replace").splitlines()[:-1]]
    first = next((line[0] for line in lines if line and not line[0].startswith("#")), "")
    return first in {"v", "vn", "vt", "o", "g", "s", "mtllib", "usemtl", "f"}


MESH_FORMATS: dict[str, MeshFormat] = {
    form.name: form
    for form in (
        MeshFormat("ply", "PLY", lambda head, _: head.startswith(b"ply")),
        MeshFormat("glb", "binary glTF", lambda head, _: head.startswith(b"glTF"), 1000.0),
        MeshFormat("step", "STEP", lambda head, _: head.lstrip().startswith(STEP_SIGNATURE)),
        MeshFormat("gltf", "glTF", lambda head, _: head.lstrip().startswith(b"{"), 1000.0),
        # Binary STL before text: there are binary files that begin with "solid".
        MeshFormat("stl", "binary STL", _is_binary_stl),
        MeshFormat("stl_ascii", "STL", lambda head, _: head.lstrip()[:5].lower() == b"solid"),
        MeshFormat("obj", "OBJ", _is_obj),
    )
}
"""Every format by name, in the order in which a file is tested. glTF is in metres by its standard; STEP files state their
unit."""


@dataclasses.dataclass(frozen=True, eq=False)
class StoredMesh:
    """What a file holds.

    Parameters
    ----------
    vertices : array, shape (n, 3)
        [mm]
    triangles : array of int, shape (m, 3)
    normals : array, shape (n, 3), or None
        At the vertices, where the file tells the true surface.
    chord_error : float or None
        Largest distance between the triangles and the true surfaces [mm], where the file tells these.
    unread_normals : bool
        Whether the file states normals at its vertices besides, which are not read: exporters write what shades well, not
        what the surface is.

    Examples
    --------
    >>> StoredMesh(np.eye(3), np.array([[0, 1, 2]])).normals is None
    True
    """

    vertices: Array
    triangles: Triangles
    normals: Array | None = None
    chord_error: float | None = None
    unread_normals: bool = False


def read_mesh(path: Path, unit: str | None, tolerance: float | None = None, body: str | None = None) -> StoredMesh:
    r"""What is in a file, as it is stored.

    Parameters
    ----------
    path : Path
        Of the file.
    unit : str or None
        A key of `etendue.units.MM_PER_LENGTH_UNIT` that overrides the format's; None: the format's own, or mm.
    tolerance : float, optional
        Distance [mm] between the surfaces of a STEP file and the triangles made of them that is asked for, see
        `StoredMesh.chord_error` for what came out; None: from the size of the body.
    body : str, optional
        Name of a body of a STEP file; one that holds several needs it.

    Raises
    ------
    FormatError
        If the file is of no known format or damaged, if its library is not installed, if it does not take the unit, the
        tolerance or the body, or holds several bodies and none is named.
    MemoryLimitError
        If there is no room for it.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "sheet.obj"
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    ...     mesh = read_mesh(path, unit="cm")
    >>> mesh.vertices.max(axis=0).tolist(), len(mesh.triangles)
    ([10.0, 10.0, 0.0], 2)
    """
    form, raw = _opened(path)
    if form.name != "step":
        for key, value in (("tolerance", tolerance), ("body", body)):
            if value is not None:
                raise FormatError(path, key, f"{form.title} is made of triangles already", f"Leave the {key} out.")
    elif unit is not None:
        raise FormatError(path, "unit", f"{unit!r}, and STEP files state their unit themselves", "Leave it out.")
    if form.name == "step":
        mesh = _step_body(path, read_step(path, raw, tolerance, body))
    else:
        vertices, triangles = read_obj(path, raw) if form.name == "obj" else _load(path, form, raw)
        mm = MM_PER_LENGTH_UNIT[unit] if unit is not None else form.mm or 1.0
        # In the file's own unit, in which somebody wrote them.
        mesh = StoredMesh(as_written(vertices) * mm, triangles, unread_normals=states_normals(form.name, raw))
    require_mesh_memory(path, len(mesh.triangles))
    if not len(mesh.triangles):
        raise FormatError(path, "whole file", "there are no triangles", "Export the body as a triangle mesh.")
    if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.vertices):
        raise FormatError(path, "triangles", "one names a vertex that is not there", "The file is damaged.")
    if not np.isfinite(mesh.vertices).all():
        raise FormatError(path, "vertices", "a coordinate is not finite", "The file is damaged.")
    return mesh


def step_bodies(path: Path) -> list[StepBody] | None:
    r"""The bodies of a STEP file, with triangles as fine as a scene takes by default; None if it is no such file.

    Raises
    ------
    FormatError
        If it is damaged, or its library is not installed.
    OSError
        If it cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "sheet.obj"
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")
    ...     step_bodies(path) is None
    True
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
    if not MESH_FORMATS["step"].recognise(head, 0):
        return None
    return read_step(path, _opened(path)[1], None)


def _opened(path: Path) -> tuple[MeshFormat, bytes]:
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(HEAD)
        form = next((form for form in MESH_FORMATS.values() if form.recognise(head, size)), None)
        if form is None:
            known = ", ".join(form.title for form in MESH_FORMATS.values())
            raise FormatError(
                path, "byte 0", f"{head[:16]!r} begins no mesh file that étendue knows", f"Known: {known}."
            )
        if size > LARGEST_FILE:
            raise FormatError(path, "size", f"{size:,} bytes", f"A mesh may have {LARGEST_FILE:,}; make it coarser.")
        require_memory(size, f"{path}: a mesh of {size:,} bytes")
        file.seek(0)
        raw = file.read()
    check_mesh(path, form.name, raw)
    return form, raw


def _step_body(path: Path, bodies: list[StepBody]) -> StoredMesh:
    if len(bodies) > 1:
        names = ", ".join(repr(body.name) for body in bodies)
        raise FormatError(
            path, "body", f"there are {len(bodies)} bodies: {names}", "Name one of them with 'body', one in each solid."
        )
    (found,) = bodies
    return StoredMesh(found.vertices, found.triangles, found.normals, found.chord_error)


def _load(path: Path, form: MeshFormat, raw: bytes) -> tuple[Array, Triangles]:
    import trimesh  # noqa: PLC0415 - takes a second to import and is needed by few scenes

    # It logs a traceback over normals of STL files that are no numbers; without a handler Python would print it.
    if not (log := logging.getLogger("trimesh")).handlers:
        log.addHandler(logging.NullHandler())
    # Pictures and the files of materials would be read for nothing; STL has none.
    options: dict[str, Any] = {} if form.name.startswith("stl") else {"skip_materials": True}
    try:
        mesh: Any = trimesh.load_mesh(
            io.BytesIO(raw),
            file_type=form.name,
            process=False,
            resolver=trimesh.resolvers.FilePathResolver(os.fspath(path)),
            **options,
        )
        vertices = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        triangles = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001 - whatever a damaged file makes the library raise
        raise FormatError(path, form.title, f"cannot be read ({error})", "The file is damaged, or no mesh.") from None
    if form.name == "stl_ascii":
        begun = len(_FACET.findall(raw))
        if begun != len(triangles):
            found = f"{begun:,} facets begin, and {len(triangles):,} of them can be read"
            raise FormatError(path, "whole file", found, "The file is cut off, or damaged.")
    return vertices, triangles
