"""Threads of the core live as long as a call: a process may fork afterwards, and its children can do all the same."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

WORK = """
import os, sys
import etendue as et
import numpy as np
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

LAMP = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
WALL = {"shape": {"kind": "rectangle", "width": 20, "height": 20}, "at": [0, 0, 9], "toward": [0, 0, -1]}

def work():
    rng = np.random.default_rng(1)
    k = rng.normal(size=(20_000, 3))
    k[:, 2] = np.abs(k[:, 2])
    k /= np.linalg.norm(k, axis=1)[:, None]
    rays = et.RaySet(np.column_stack([rng.random((20_000, 2)), np.zeros(20_000)]), k, np.ones(20_000))
    field = et.LightField.fit(rays, et.Plane(z=0, width=1, height=1, centre=(0.5, 0.5)), depths=(3, 3, 3, 3))
    seen = et.luminance_map(field, et.Observer(10, 20, 500), et.Screen(2, 2, 16, 16)).values
    grid = PolarGrid("cosines", np.linspace(0, 2, 5), np.arange(0.0, 360.0, 60.0))
    slices = [
        BsdfSlice(direction(theta, phi), np.full(grid.shape, 0.1 + phi / 1e4), grid=grid)
        for theta in (10.0, 60.0) for phi in np.arange(0.0, 360.0, 90.0)
    ]
    table = et.BsdfTable(BsdfData(slices, isotropic=False, mirrored=False))
    shared = table.reflectance(30.0, 45.0)
    scene = et.Scene(sources=[LAMP], surfaces=[{**WALL, "finish": {"kind": "bsdf", "bsdf": table}}])
    traced = et.trace(scene, 200_000, 1).ledger.escaped.flux
    lit = et.luminance_map(scene, et.Observer(160, 0, 100), et.Screen(5, 5, 8, 8), rays_per_pixel=16).values
    return seen.tobytes(), lit.tobytes(), float(shared), float(traced)

here = work()
child = os.fork()
if child == 0:
    os._exit(0 if work() == here else 3)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no forks")
def test_a_process_may_fork_after_anything() -> None:
    """The child would wait for ever for threads that it does not have."""
    threads = {"RAYON_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-W", "ignore", "-c", WORK]
    done = subprocess.run(command, check=False, env=os.environ | threads, timeout=240, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
