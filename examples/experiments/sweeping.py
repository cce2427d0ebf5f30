"""Thresholds and pixel sizes of the gridded algorithm judged as section 3.2.4 of the thesis does, and by rays kept back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import etendue as et
import numpy as np
from etendue.goniophotometry.comparison import compare_intensities
from etendue.goniophotometry.threshold_sweep import THRESHOLDS, held_out_score
from etendue.lightfield.gridded.gridded_source import suited_threshold
from etendue.plot.threshold_picture import plot_threshold_sweep
from etendue.quantities.threshold_sweep import ThresholdSweep
from experiments.gridded_counts import GriddedCounts
from experiments.panels import new_figure, print_table, save

STEPS = 36, 2.5
"""Half planes C, and degrees between the angles γ, of the distributions that are compared."""


def far_field(rays: et.RaySet) -> et.Intensity:
    """Of rays, at `STEPS`."""
    return et.intensity_distribution(rays, *STEPS)


def judged(source: et.GriddedSource, file: et.RaySet, judges: et.RaySet) -> dict[str, float]:
    """As many rays drawn from the patches as a file has, against the file; and the score of rays never seen.

    Parameters
    ----------
    source : GriddedSource
        The patches.
    file : RaySet
        A ray file of the lamp; not the rays that the patches were made of.
    judges : RaySet
        More rays of the lamp.
    """
    drawn = compare_intensities(far_field(source.as_printed.sample(len(file), seed=5)), far_field(file))
    score, error, _ = held_out_score(source.as_printed, judges)
    patches = source.patches
    return {
        "threshold": source.threshold,
        "bins": float(patches.bins.mean()),
        "unreached": float((patches.error > source.threshold).sum()),
        "error": float((patches.error * patches.flux).sum()) / source.total_flux,
        "table_flux": source.table_flux / source.total_flux,
        "ncc": drawn.ncc,
        "nrmse_thesis": drawn.nrmse_thesis,
        "nrmse": drawn.nrmse,
        "score": score,
        "score_error": error,
    }


def sweep(counts: GriddedCounts, file: et.RaySet, judges: et.RaySet, thresholds: Sequence[float]) -> ThresholdSweep:
    """One threshold after the other, from the same rays."""
    rows = [judged(counts.source(threshold), file, judges) for threshold in thresholds]
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return ThresholdSweep(columns, len(counts.lit.pixel), counts.left, len(judges))


def suitability(counts: GriddedCounts, judges: et.RaySet) -> list[str]:
    """How near the threshold that suits the number of rays is to the best, by the score of rays never seen."""
    suited = suited_threshold(counts.lit.rays_per_patch)
    score = {e: held_out_score(counts.source(e).as_printed, judges)[0] for e in (*THRESHOLDS, suited)}
    best = max(THRESHOLDS, key=score.__getitem__)
    told = [f"{suited:g} %", f"{score[suited]:.3f}", f"{best:g} %", f"{score[best]:.3f}", f"{score[0.021]:.3f}"]
    return [f"{counts.lit.rays_per_patch:,.0f}", *told]


def print_sweep(found: ThresholdSweep) -> None:
    """One row for each threshold."""
    print_table(
        ["E", "bins per patch", "NCC", "NRMSE, eq. 3.6", "score"],
        [
            [f"{e:g} %", f"{b:,.0f}", f"{n:.3%}", f"{r:.3%}", f"{s:.4f} ± {d:.4f}"]
            for e, b, n, r, s, d in zip(
                *(found[name] for name in ("threshold", "bins", "ncc", "nrmse_thesis", "score", "score_error")),
                strict=True,
            )
        ],
    )


def draw_sweep(path: Path, found: ThresholdSweep, title: str) -> None:
    """Figure 3.8, 3.9 or 3.13, and below it what it does not show."""
    made = new_figure(5.4, 4.4)
    plot_threshold_sweep(found, ax=list(made.subplots(2, 1)), title=title)
    save(made, path)


def print_pixel_sweep(
    sides: Sequence[float], fit: Callable[[float], et.GriddedSource], file: et.RaySet, judges: et.RaySet
) -> None:
    """The same for the size of the pixels: "a similar method", as the thesis says."""
    rows = []
    for side in sides:
        source = fit(side)
        row = judged(source, file, judges)
        score = f"{row['score']:.4f} ± {row['score_error']:.4f}"
        size = [f"{side:g} mm", f"{len(source.patches):,}", f"{source.threshold:.2g} %", f"{row['bins']:,.0f}"]
        rows.append([*size, f"{row['ncc']:.3%}", f"{row['nrmse_thesis']:.3%}", score])
    print_table(["Δd", "patches", "E", "bins per patch", "NCC", "NRMSE, eq. 3.6", "score"], rows)
