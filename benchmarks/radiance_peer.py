"""The map of the cavity by Radiance's ambient cache, for `run_all.py`; its programs come with `pyradiance`."""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pyradiance
import scenes

Array = Any
HOME = Path(pyradiance.__file__).parent
CACHE = "-aa .1 -ab 60 -ad 512 -as 128 -ar 64 -lw 1e-6 -lr 300"
"""A cache that is nearly unbiased here; a coarser one is faster and darker."""


def _run(*command: object, **how: Any) -> subprocess.CompletedProcess[bytes]:
    programs = HOME / "bin"
    environment = {**os.environ, "RAYPATH": str(HOME / "lib"), "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    name, *rest = (str(part) for part in command)
    return subprocess.run([str(programs / name), *rest], check=True, env=environment, stdout=subprocess.PIPE, **how)


def cavity_map(folder: Path, observer: et.Observer, screen: et.Screen) -> Callable[[int], Array]:
    """Maps of the cavity [lm/(mm² sr)], each with a cache of its own."""
    rho, level = scenes.REFLECTANCE, scenes.FLUX / (math.pi**2 * scenes.HOLE**2)
    lines = [
        f"void plastic white 0 0 5 {rho} {rho} {rho} 0 0",
        f"void light lamp 0 0 3 {level} {level} {level}",
        f"white tube wall 0 0 7 0 0 0 0 0 {scenes.HEIGHT} {scenes.RADIUS}",
        f"white ring base 0 0 8 0 0 0 0 0 1 0 {scenes.RADIUS}",
        *(f"lamp ring l{i} 0 0 8 {x} {y} 1e-3 0 0 1 0 {scenes.HOLE}" for i, (x, y) in enumerate(scenes.HOLES)),
    ]
    (folder / "cavity.rad").write_text("\n".join(lines), encoding="ascii")
    octree = folder / "cavity.oct"
    octree.write_bytes(_run("oconv", folder / "cavity.rad").stdout)
    eye = np.asarray(observer.position)
    ahead, up = -eye / np.linalg.norm(eye), screen.axes(observer)[1]
    angles = [2 * math.degrees(math.atan(side / 2 / observer.distance)) for side in (screen.width, screen.height)]
    view = ["-vtv", "-vp", *eye, "-vd", *ahead, "-vu", *up, "-vh", angles[0], "-vv", angles[1]]
    frame = ["-x", screen.columns, "-y", screen.rows, "-pa", 0, "-ps", 1, "-pj", 1, "-u+"]

    def look(_seed: int) -> Array:
        picture = _run("rpict", *view, *frame, *CACHE.split(), "-dj", 0, "-ds", 0, "-dc", 1, "-dt", 0, octree).stdout
        values = _run("pvalue", "-h", "-H", "-df", "-b", input=picture).stdout
        return np.frombuffer(values, np.float32).reshape(screen.shape).astype(float)

    return look
