"""Scenes for Mitsuba 3: one shape and one table of intensities per patch, and the emitter that reads it.

See docs/formats/patches.md. No emitter of Mitsuba's own has intensities that depend on the direction in a tabulated way, on
a surface; the scene brings one along, a Python module that is imported before the scene is loaded.
"""

from __future__ import annotations

import importlib.resources
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from etendue.quantities.patches import Patches
from etendue.quantities.printable import printable
from etendue.units import LUMINANCE_UNIT, MM2_PER_M2

FILES = r"gridded_area\.py|scene\.xml|tables/\d{6,}\.npy|shapes/\d{6,}\.ply|__pycache__/gridded_area\..*"
"""Names of what `write` writes, and of what Python makes of its module."""

BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
"""A patch that light does not pass."""

CLEAR = '<bsdf type="dielectric"><float name="int_ior" value="1"/><float name="ext_ior" value="1"/></bsdf>'
"""One that it does. Paths through the plain `null` surface alone count as empty, and would show nothing."""


def write(patches: Patches, folder: Path, factor: float) -> None:
    """Write ``scene.xml``, ``gridded_area.py``, ``tables/`` and, for patches that are no rectangles, ``shapes/``.

    What Mitsuba renders is luminance in cd/m² as it stands, or radiance in W/(m² sr) for patches in watts, the same in all
    channels. Lengths are mm. The tables are those of the patches; the scene multiplies their light by `factor`.
    """
    emitter = importlib.resources.files("etendue.formats.scenes").joinpath("gridded_area.py.txt")
    (folder / "gridded_area.py").write_bytes(emitter.read_bytes())
    (folder / "tables").mkdir()
    (folder / "shapes").mkdir()
    for i in range(len(patches)):
        table = patches.table(i)
        np.save(folder / "tables" / f"{i + 1:06d}.npy", np.concatenate([table, table[:, :1]], axis=1, dtype="<f4"))
        if len(patches.outline[i]) != 4:
            mesh = "\n".join(_mesh(patches, i))
            (folder / "shapes" / f"{i + 1:06d}.ply").write_text(f"{mesh}\n", encoding="ascii")
    with (folder / "scene.xml").open("w", encoding="utf-8") as file:
        file.writelines(f"{line}\n" for line in _scene(patches, factor))


def _scene(patches: Patches, factor: float) -> Iterator[str]:
    surface = CLEAR if len(patches.parts) > 1 else BLACK
    source = printable(f"{patches.provenance.source}, by {patches.provenance.software}")
    yield '<scene version="3.0.0">'
    # A comment must not hold two hyphens, which a file name may.
    yield f"  <!-- {len(patches)} patches of {source.replace('--', '- -').rstrip('-')}; lengths in mm, rendered in "
    yield f"       {LUMINANCE_UNIT[patches.flux_unit]}; the light is that of the tables times {factor:.9g}; "
    yield "       import gridded_area before loading -->"
    yield '  <integrator type="path"/>'
    for i, (axes, area) in enumerate(zip(patches.axes, patches.projected_area, strict=True)):
        yield from (f"  {line}" for line in _shape(patches, i))
        yield f"    {surface}"
        yield '    <emitter type="gridded_area">'
        yield f'      <string name="filename" value="tables/{i + 1:06d}.npy"/>'
        for name, axis in zip("xyz", axes, strict=True):
            yield f'      <vector name="{name}" value={quoteattr(_numbers(axis))}/>'
        yield f'      <float name="scale" value="{factor * MM2_PER_M2 / area:.9g}"/>'
        yield "    </emitter>"
        yield "  </shape>"
    yield "</scene>"


def _shape(patches: Patches, i: int) -> Iterator[str]:
    if len(patches.outline[i]) != 4:
        yield '<shape type="ply">'
        yield f'  <string name="filename" value="shapes/{i + 1:06d}.ply"/>'
        yield '  <boolean name="face_normals" value="true"/>'
        return
    (width, height), (x, y, z), centre = patches.extent[i], patches.axes[i], patches.centre[i]
    columns = np.stack([x * width / 2, y * height / 2, z, centre], axis=1)
    yield '<shape type="rectangle">'
    yield f'  <transform name="to_world"><matrix value="{_numbers(columns.ravel())} 0 0 0 1"/></transform>'


def _mesh(patches: Patches, i: int) -> Iterator[str]:
    """Triangles from the centre to the sides of the outline, in ASCII PLY."""
    outline = patches.outline[i]
    n = len(outline)
    yield f"ply\nformat ascii 1.0\nelement vertex {n + 1}"
    yield from (f"property float {name}" for name in "xyz")
    yield f"element face {n}\nproperty list uchar int vertex_indices\nend_header"
    yield from (_numbers(point) for point in (patches.centre[i], *outline))
    yield from (f"3 0 {k + 1} {(k + 1) % n + 1}" for k in range(n))


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
