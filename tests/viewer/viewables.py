"""What can be looked at: values and files, small."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np

from viewer.conftest import FIELDS

LAMP: dict[str, Any] = {
    "name": "lamp",
    "kind": "surface",
    "shape": {"kind": "rectangle", "width": 2, "height": 1},
    "at": [0.3, -0.2, 1.0],
    "flux": 100,
}
CARD: dict[str, Any] = {"name": "card", "kind": "illuminance", "width": 40, "height": 30, "columns": 4, "rows": 3}


@functools.cache
def traced() -> et.TraceResult:
    disk = {"name": "disk", "kind": "rays", "shape": {"kind": "disk", "radius": 20}, "at": [0, 0, 5]}
    card = {**CARD, "at": [0, 0, 30], "toward": [0, 0, -1]}
    return et.trace(et.Scene(sources=[LAMP], detectors=[disk, card]), rays=20_000)


def make_files(folder: Path) -> Path:
    """One file of each kind in a folder, and one that is none."""
    FIELDS["lamp"].save(folder / "lamp.h5")
    et.write_rays(folder / "rings.tm25ray", et.RingSource(rays=2000).ray_set())
    two = et.LuminanceMap([[3.0, 1.0]], [[0.1, 0.1]], [[9, 3]], et.Observer(1, 2, 30), et.Screen(2, 1, 2, 1))
    two.save(folder / "map.exr")
    traced().save(folder / "trace.h5")
    et.Scene(sources=[LAMP]).save(folder / "scene.toml")
    (folder / "notes.txt").write_text("nothing to be seen")
    return folder


def spot(*, width: float, theta: float, phi: float, rays: int = 40_000) -> et.LightField:
    """A disk whose beam has this full width at half its maximum [°] about a direction [°]."""
    rng = np.random.default_rng(7)
    around = rng.normal(0.0, np.radians(width) / np.sqrt(8 * np.log(2)), (rays, 2))
    right, up, toward = et.Observer(theta, phi, 1).axes()
    direction = toward + around @ np.array([right, up])
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    radius, turn = 3.0 * np.sqrt(rng.random(rays)), 2 * np.pi * rng.random(rays)
    place = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=1)
    return et.LightField.fit(et.RaySet(place, direction, np.full(rays, 100 / rays)), et.Disk(radius=3.2))
