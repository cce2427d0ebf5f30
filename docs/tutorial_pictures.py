"""Make the pictures of the tutorial, in a folder in which its commands were run.

usage: python docs/tutorial_pictures.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import etendue as et
from etendue.plot import style
from matplotlib import pyplot as plt

FIGURES = Path(__file__).with_name("figures")
NAME = "A glowing cylinder and half a ball"


def main() -> None:
    """Draw the scene, and both maps on one scale."""
    folder = Path(sys.argv[1])
    et.draw_scene(et.Scene.load(folder / "lamp.toml"), FIGURES / "tutorial-layout.png", section="y=0", title=NAME)
    bare, through = (et.read_map(folder / f"{name}.exr") for name in ("bare", "through"))
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained", dpi=130)
    look = {"x": 0.01, "ha": "left", "size": style.TITLE_SIZE, "color": style.INK, "weight": "bold"}
    figure.suptitle(f"{NAME}, from the side", **look)
    top = float(bare.values.max())
    for one, lmap, title in zip(axes, (bare, through), ("bare", "through the lens"), strict=True):
        lmap.plot(ax=one, scale="linear", vmin=0.0, vmax=top, title=title)
    figure.savefig(FIGURES / "tutorial-maps.png", metadata={"Software": None})


if __name__ == "__main__":
    main()
