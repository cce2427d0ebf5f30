"""Scenes for Radiance [WardShakespeare1998]: one polygon and one table of intensities per patch.

See docs/formats/patches.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from etendue.quantities.patches import Patches
from etendue.units import MM2_PER_M2, RADIANCE_WHITE_EFFICACY

FILES = r"patches\.cal|scene\.rad|tables/\d{6,}\.dat|scene\.oct"
"""Names of what `write` writes, and of the octree that `oconv` makes of it."""

SHARE = 1e-5
"""Of light that a patch that can be seen through keeps back."""

FUNCTIONS = f"""\
{{ Luminance of a patch from its intensities. Real arguments of a pattern: A1 to A9, unit vectors x, y, z of the patch,
  z its normal; A10, what turns intensity into radiance along the normal: 1 / area [m2], over lumens per watt if the
  tables are in candela, times the factor of the scene. }}

patch_x = -(Dx*A1 + Dy*A2 + Dz*A3);
patch_y = -(Dx*A4 + Dy*A5 + Dz*A6);
patch_z = -(Dx*A7 + Dy*A8 + Dz*A9);

patch_theta = atan2(sqrt(patch_x*patch_x + patch_y*patch_y), patch_z) * {180 / np.pi!r};
patch_azimuth = atan2(patch_y, patch_x) * {180 / np.pi!r};
patch_phi = if(patch_azimuth, patch_azimuth, patch_azimuth + 360);

{{ I / (A cos theta), 0 behind the patch }}
patch_radiance(intensity) = if(patch_z - 1e-6, intensity * A10 / patch_z, 0);

{{ of a patch that can be seen through }}
patch_share = {SHARE!r};
"""


def write(patches: Patches, folder: Path, factor: float) -> None:
    """Write ``scene.rad``, ``patches.cal`` and ``tables/``; a scene is rendered from within its folder.

    The tables are those of the patches; the scene multiplies their light by `factor`.

    Luminous flux becomes radiance by the 179 lm/W that Radiance divides by everywhere: 179 times what `rtrace` gives is
    cd/m². Watts stay watts. Lengths are mm.
    """
    (folder / "tables").mkdir()
    (folder / "patches.cal").write_text(FUNCTIONS, encoding="ascii")
    for i in range(len(patches)):
        table = "\n".join(_table(patches, i))
        (folder / "tables" / f"{i + 1:06d}.dat").write_text(f"{table}\n", encoding="ascii")
    with (folder / "scene.rad").open("w", encoding="ascii") as file:
        file.writelines(f"{line}\n" for line in _scene(patches, factor))


def _table(patches: Patches, i: int) -> Iterator[str]:
    """Intensities over θ, whose nodes are listed, and φ, which closes the circle."""
    grid, table = patches.grid(i), patches.table(i)
    rows, columns = grid.shape
    yield "2"
    yield f"0 0 {rows}"
    yield _numbers(grid.theta)
    yield f"0 360 {columns + 1}"
    for row in np.concatenate([table, table[:, :1]], axis=1):
        yield _numbers(row)


def _scene(patches: Patches, factor: float) -> Iterator[str]:
    luminous = patches.flux_unit == "lm"
    through = len(patches.parts) > 1
    source = _one_line(f"{patches.provenance.source}, by {patches.provenance.software}")
    yield f"# {len(patches)} patches of {source}; lengths in mm"
    unit = f"watts of {RADIANCE_WHITE_EFFICACY:g} lm; cd/m2 is {RADIANCE_WHITE_EFFICACY:g} times the radiance"
    yield f"# tables in {'cd' if luminous else 'W/sr'}; radiance in {unit if luminous else 'watts'}"
    yield f"# The light is that of the tables times {factor:.9g}"
    if through:
        yield "# Light of one part passes the others: a patch adds its own light to what is behind it, and casts no shadow."
    for i, (axes, area) in enumerate(zip(patches.axes, patches.projected_area, strict=True)):
        name = f"patch{i + 1:06d}"
        scale = factor * MM2_PER_M2 / area / (RADIANCE_WHITE_EFFICACY if luminous else 1.0)
        yield f"\nvoid brightdata {name}_lid"
        yield f"5 patch_radiance tables/{i + 1:06d}.dat patches.cal patch_theta patch_phi"
        yield f"0\n10 {_numbers([*axes.ravel(), scale])}"
        if through:
            yield f"{name}_lid glow {name}_glow\n0\n0\n4 {_numbers([1 / SHARE] * 3)} 0"
            yield f"void mixfunc {name}_light\n4 {name}_glow void patch_share patches.cal\n0\n0"
        else:
            yield f"{name}_lid light {name}_light\n0\n0\n3 1 1 1"
        corners = patches.outline[i]
        yield f"{name}_light polygon {name}\n0\n0\n{corners.size} {_numbers(corners.ravel())}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _one_line(text: str) -> str:
    return " ".join(text.encode("ascii", errors="replace").decode("ascii").split())
