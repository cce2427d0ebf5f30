"""``etendue demo``: a source whose luminance is known, mapped, with truth beside estimate."""

from __future__ import annotations

import dataclasses
import math
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.table import Table

from etendue.cli.terminal import check_outputs, count, output, print_json, progress_bar, say
from etendue.luminance.estimate import luminance_map
from etendue.luminance.methods import Cone
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.sources.ring_source import RingSource


@dataclasses.dataclass(frozen=True)
class ZoneResult:
    """Truth and estimate of one ring [cd/m²]: mean over the pixels that lie wholly inside it."""

    zone: int
    truth: float
    estimate: float
    standard_error: float
    pixels: int
    rays: int

    @property
    def deviation(self) -> float:
        """(estimate - truth) / standard error; NaN if no ray was seen."""
        return (self.estimate - self.truth) / self.standard_error if self.rays else math.nan


def zone_results(source: RingSource, lmap: LuminanceMap) -> list[ZoneResult]:
    """Mean luminance of each ring in a map of the screen seen face on, with its standard error, beside the truth.

    A pixel that no ray reached counts as 0: leaving it out would bias the mean upwards.
    """
    screen = lmap.screen
    half = np.hypot(screen.width / screen.columns, screen.height / screen.rows) / 2
    radius = np.hypot(screen.x[None, :], screen.y[:, None])
    results = []
    for zone, (inner, outer) in enumerate(zip(source.edges, source.edges[1:], strict=False)):
        inside = (radius + half < outer) & ((radius - half > inner) | (inner == 0))
        values, errors = np.nan_to_num(lmap.values[inside]), np.nan_to_num(lmap.standard_error[inside])
        mean, error = float(values.mean()), float(np.sqrt((errors**2).sum()) / len(values))
        truth = source.zone_luminance[zone]
        results.append(ZoneResult(zone + 1, truth, mean, error, len(values), int(lmap.rays[inside].sum())))
    return results


def demo(
    picture: Annotated[Path, typer.Option("-o", "--output", help="The picture to write, .png")] = Path(
        "etendue-demo.png"
    ),
    rays: Annotated[
        int, typer.Option("--rays", help="Rays to draw, 1e5 or more.", parser=count(100_000), metavar="NUMBER")
    ] = 200_000_000,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the rays.")] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Make the three-ring source of thesis 2.3, map it, print truth beside estimate, and write a picture."""
    check_outputs([picture], (".png",))
    source = RingSource(rays=rays, seed=seed)
    observer, screen = Observer(theta=0, phi=0, distance=150), Screen(70, 70, 64, 64)
    method = Cone()
    start = time.perf_counter()
    with progress_bar("rays", len(source)) as progress:
        lmap = luminance_map(source, observer, screen, method=method, progress=progress)
    seconds = time.perf_counter() - start
    results = zone_results(source, lmap)
    lmap.plot(picture, title="Three Lambertian rings, 300 / 200 / 100 lm", scale="log")
    if json:
        zones = [dataclasses.asdict(r) | {"deviation": r.deviation} for r in results]
        print_json(
            {
                "rays": len(source),
                "seconds": seconds,
                "zones": zones,
                "unit": lmap.unit,
                "picture": picture,
                "notes": list(lmap.notes),
            }
        )
        return
    say(f"Three Lambertian rings (300, 200, 100 lm; radii 10, 20, 30 mm), {len(source):,} rays in {seconds:.1f} s,")
    say(f"seen face on from {observer.distance:g} mm within {method.half_angle}°:")
    table = Table(
        "ring", "truth Φ/(πA)", "estimate", "standard error", "deviation", "rays seen", box=None, pad_edge=False
    )
    for column in table.columns[1:]:
        column.justify = "right"
    for r in results:
        table.add_row(
            str(r.zone), f"{r.truth:,.0f} cd/m²", f"{r.estimate:,.0f}", f"± {r.standard_error:,.0f}",
            f"{r.deviation:+.2f} σ" if r.rays else "not seen", f"{r.rays:,}",
        )  # fmt: skip
    output.print(table)
    for note in lmap.notes:
        say(note)
    say(f"picture: {picture}")
