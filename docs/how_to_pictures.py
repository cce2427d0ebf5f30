"""Make the pictures of the page "How to": its blocks are run on an LED with a dome, and some of what they draw is kept.

usage: python docs/how_to_pictures.py
"""

from __future__ import annotations

import contextlib
import dataclasses
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from docs.materials import write_materials
from docs.pages import Block, blocks
from docs.running import compile_toml, run_console, run_python
from experiments.led import ray_file
from PIL import Image

DOCS = Path(__file__).parent
PAGE = DOCS / "how-to.md"
RAYS = 500_000
WIDTH = 900
"""Pixels that a picture has at most from left to right."""

KEPT = {
    "rings.png": "demo",
    "characteristic.png": "characteristic",
    "thresholds.png": "thresholds",
    "acceptances.png": "acceptances",
    "polar.png": "polar",
    "difference.png": "difference",
    "traced.png": "traced",
    "layout.png": "layout",
    "heights.png": "sweep",
    "seen-40.png": "index",
    "regions.png": "regions",
    "orbit.gif": "orbit",
}
"""Pictures that the page's blocks draw, and their names among the figures, after ``how-to-``."""


def without_output(block: Block) -> Block:
    """The commands of a block of the command line alone: of another LED they print something else."""
    lines, goes_on = [], False
    for line in block.text.splitlines():
        if line.startswith("$ ") or goes_on:
            lines.append(line)
            goes_on = line.endswith("\\")
    return dataclasses.replace(block, text="\n".join(lines) + "\n")


def main() -> None:
    """Run the page, and keep its pictures."""
    names: dict[str, Any] = {"__name__": "__main__"}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_materials(Path(folder), led=ray_file(RAYS))
        for block in blocks(PAGE):
            if block.language == "python":
                run_python(block, "how-to.md", names)
            elif block.language == "console":
                run_console(without_output(block), "how-to.md")
            elif block.language == "toml":
                compile_toml(block, "how-to.md")
            for name in [name for name in KEPT if Path(name).exists()]:
                keep(Path(name))


def keep(drawn: Path) -> None:
    """Move a picture among the figures, no wider than it must be."""
    place = DOCS / "figures" / f"how-to-{KEPT[drawn.name]}{drawn.suffix}"
    if drawn.suffix == ".gif":
        place.write_bytes(drawn.read_bytes())
    else:
        with Image.open(drawn) as full:
            small = full.convert("RGB")
            small.thumbnail((WIDTH, 10 * WIDTH), Image.Resampling.LANCZOS)
            # All 256 colours, moved to where the picture has them: fewer leave bands in colour bars.
            small.quantize(256, kmeans=3).save(place, optimize=True)
    drawn.unlink()


if __name__ == "__main__":
    main()
