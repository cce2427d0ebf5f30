"""Triangle meshes from files: STL, OBJ, PLY, glTF, and STEP, found by content."""

from __future__ import annotations

import dataclasses
import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.units import MM_PER_LENGTH_UNIT

Array = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]

LARGEST_FILE = 1 << 31
"""Most bytes of a mesh file."""

TOLERANCE = 0.01
"""Largest distance [mm] between a surface of a STEP file and its triangles, unless another is asked for."""

HEAD = 512
"""Bytes that tell a format."""


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
    lines = [line.split() for line in head.decode("utf-8", errors="replace").splitlines()[:-1]]
    first = next((line[0] for line in lines if line and not line[0].startswith("#")), "")
    return first in {"v", "vn", "vt", "o", "g", "s", "mtllib", "usemtl", "f"}


MESH_FORMATS: dict[str, MeshFormat] = {
    form.name: form
    for form in (
        MeshFormat("ply", "PLY", lambda head, _: head.startswith(b"ply")),
        MeshFormat("glb", "binary glTF", lambda head, _: head.startswith(b"glTF"), 1000.0),
        MeshFormat("step", "STEP", lambda head, _: head.lstrip().startswith(b"ISO-10303-21"), 1000.0),
        MeshFormat("gltf", "glTF", lambda head, _: head.lstrip().startswith(b"{"), 1000.0),
        # Binary STL before text: there are binary files that begin with "solid".
        MeshFormat("stl", "binary STL", _is_binary_stl),
        MeshFormat("stl_ascii", "STL", lambda head, _: head.lstrip().startswith(b"solid")),
        MeshFormat("obj", "OBJ", _is_obj),
    )
}
"""Every format by name, in the order in which a file is tested. glTF is in metres by its standard; STEP files state their
unit, and reach us in metres."""


def read_mesh(path: Path, unit: str | None, tolerance: float | None = None) -> tuple[Array, Triangles]:
    r"""Vertices [mm], shape (n, 3), and triangles, shape (m, 3), of everything in a file, as it is stored.

    Parameters
    ----------
    path : Path
        Of the file.
    unit : str or None
        A key of `etendue.units.MM_PER_LENGTH_UNIT` that overrides the format's; None: the format's own, or mm.
    tolerance : float, optional
        Largest distance [mm] between the surfaces of a STEP file and the triangles made of them; `TOLERANCE` if None.

    Raises
    ------
    FormatError
        If the file is of no known format or damaged, if its library is not installed, or if it does not take the unit or
        the tolerance.
    OSError
        If the file cannot be opened.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "sheet.obj"
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    ...     vertices, triangles = read_mesh(path, unit="cm")
    >>> vertices.max(axis=0).tolist(), len(triangles)
    ([10.0, 10.0, 0.0], 2)
    """
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
        file.seek(0)
        raw = file.read()
    if form.name != "step" and tolerance is not None:
        raise FormatError(path, "tolerance", f"{form.title} is made of triangles already", "Leave the tolerance out.")
    if form.name == "step" and unit is not None:
        raise FormatError(path, "unit", f"{unit!r}, and STEP files state their unit themselves", "Leave it out.")
    options = {"tol_linear": TOLERANCE if tolerance is None else tolerance} if form.name == "step" else {}
    vertices, triangles = _load(path, form, raw, options)
    if not len(triangles):
        raise FormatError(path, "whole file", "there are no triangles", "Export the body as a triangle mesh.")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise FormatError(path, "triangles", "one names a vertex that is not there", "The file is damaged.")
    if not np.isfinite(vertices).all():
        raise FormatError(path, "vertices", "a coordinate is not finite", "The file is damaged.")
    mm = MM_PER_LENGTH_UNIT[unit] if unit is not None else form.mm or 1.0
    return vertices * mm, triangles


def _load(path: Path, form: MeshFormat, raw: bytes, options: dict[str, float]) -> tuple[Array, Triangles]:
    if form.name == "step":
        try:
            import cascadio  # noqa: F401, PLC0415 - an extra, which only STEP files need
        except ImportError:
            raise FormatError(
                path, "format", "STEP, whose reader is not installed", "Install it: pip install 'etendue[step]'."
            ) from None
    import trimesh  # noqa: PLC0415 - takes a second to import and is needed by few scenes

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
    except Exception as error:  # noqa: BLE001 - whatever a damaged file makes the library raise
        raise FormatError(path, form.title, f"cannot be read ({error})", "The file is damaged, or no mesh.") from None
    return vertices, triangles
