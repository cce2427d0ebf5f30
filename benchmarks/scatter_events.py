"""How fast stored scatter events are looked at, beside tracing the light image of another observer anew.

The cavity of thesis chapter 4 (see `tracer.py`), seen from 55° through 250 × 125 pixels; then the same behind a grille of
24 576 triangles, past which every line to the eye has to go. Both ways see the same rays: the maps must agree to rounding.

python benchmarks/scatter_events.py [--events 1e7]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
from timing import best, load, timed

# Rays from which the number of scatters of each is learnt.
TRIAL = 1 << 18
RADIUS, HEIGHT, REFLECTANCE, HOLE, AWAY = 21.5, 21.4, 0.984, 2.5, 10.0


def row(job: str, value: str, ratio: str = "") -> None:
    print(f"{job:<52} {value:>28} {ratio:>30}".rstrip(), flush=True)


def cavity(detector: dict[str, Any], *more: dict[str, Any]) -> et.Scene:
    white = {"kind": "lambertian", "reflectance": REFLECTANCE}
    spots = ((AWAY, 0.0), (-AWAY, 0.0), (0.0, AWAY), (0.0, -AWAY))
    disk = {"kind": "disk", "radius": HOLE}
    walls = [
        {"name": "wall", "shape": {"kind": "cylinder", "radius": RADIUS, "height": HEIGHT}, "finish": white},
        {"name": "base", "shape": {"kind": "disk", "radius": RADIUS}, "finish": white},
        *({"name": f"hole {i}", "shape": disk, "at": [*at, 5e-4], "finish": "absorber"} for i, at in enumerate(spots)),
    ]
    lamps = [{"kind": "surface", "shape": disk, "flux": 0.96, "at": [*at, 1e-3]} for at in spots]
    screen = {"width": 50, "height": 25, "columns": 250, "rows": 125}
    eye = {"name": "eye", "theta": 55, "distance": 1000, "screen": screen}
    return et.Scene(sources=lamps, surfaces=[*walls, *more], observers=[eye], detectors=[detector])


def grille(folder: Path) -> dict[str, Any]:
    """A black grille over the cavity: 128 × 96 squares of two triangles each, a quarter of the pitch wide."""
    vertices, triangles = [], []
    for x in np.linspace(-RADIUS, RADIUS, 128):
        for y in np.linspace(-RADIUS, RADIUS, 96):
            n, a = len(vertices), RADIUS / 512
            vertices += [(x - a, y - a), (x + a, y - a), (x + a, y + a), (x - a, y + a)]
            triangles += [(n + 1, n + 2, n + 3), (n + 1, n + 3, n + 4)]
    lines = [f"v {x} {y} {HEIGHT + 1}" for x, y in vertices] + ["f {} {} {}".format(*t) for t in triangles]
    (folder / "grille.obj").write_text("\n".join(lines), encoding="utf-8")
    shape = {"kind": "mesh", "file": str(folder / "grille.obj"), "unit": "mm"}
    return {"name": "grille", "shape": shape, "finish": "absorber"}


def job(name: str, wanted: int, folder: Path, *more: dict[str, Any]) -> None:
    # None of those of the trial is dropped, either.
    kept = {"name": "scatter", "kind": "scatter", "most": 2 * max(wanted, TRIAL)}
    image = {"name": "image", "kind": "image", "observer": "eye"}
    trial = et.trace(cavity(kept, *more), rays=TRIAL)
    rays = round(wanted / len(trial.events.only) * TRIAL)
    once, result = timed(lambda: et.trace(cavity(kept, *more), rays))
    anew, other = timed(lambda: et.trace(cavity(image, *more), rays))
    events = result.events.only
    looks = [timed(lambda: et.luminance_map(events)[0]) for _ in range(4)]
    quick, lmap = min(look[0] for look in looks), looks[0][1]
    np.testing.assert_allclose(lmap.values, other.images["image"].values, rtol=1e-10)
    row(f"{name}: trace with one light image", f"{anew:.2f} s", f"{rays / 1e6:.1f} M rays")
    row(f"{name}: trace with scatter events", f"{once:.2f} s", f"{once / anew:.2f} × with one light image")
    row(f"{name}: map of {len(events) / 1e6:.1f} M events", f"{quick:.2f} s", f"{anew / quick:.1f} × a trace anew")
    row(f"{name}: the first map", f"{looks[0][0]:.2f} s")
    one = best(lambda: et.luminance_map(events, threads=1), 2)
    row(f"{name}: events looked at, all cores", f"{len(events) / quick / 1e6:.1f} M events/s")
    row(f"{name}: events looked at, one thread", f"{len(events) / one / 1e6:.1f} M events/s")
    saved, _ = timed(lambda: result.save(folder / "result.h5"))
    loaded, _ = timed(lambda: et.TraceResult.load(folder / "result.h5").events.only)
    size = (folder / "result.h5").stat().st_size / len(events)
    row(f"{name}: file", f"{size:.0f} bytes an event", f"written {saved:.1f} s, read {loaded:.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--events", type=float, default=1e7)
    options = parser.parse_args()
    print(load(), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        job("cavity", int(options.events), Path(folder))
        job("cavity behind a grille", int(options.events), Path(folder), grille(Path(folder)))


if __name__ == "__main__":
    main()
