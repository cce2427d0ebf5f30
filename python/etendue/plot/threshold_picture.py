"""Figs. 3.8, 3.9 and 3.13 of the thesis, and below them what they do not show."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.plot import style
from etendue.quantities.arguments import require
from etendue.quantities.threshold_sweep import ThresholdSweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, LEFT, RIGHT = 5.8, 0.8, 0.85
PANEL, GAP = 1.75, 0.42
"""Of the figure and its two diagrams [inches]."""

MOST_TICKS = 10


@overload
def plot_threshold_sweep(
    sweep: ThresholdSweep, path: str | os.PathLike[str] | None = None, *, title: str | None = None, ax: None = None
) -> Figure: ...


@overload
def plot_threshold_sweep(
    sweep: ThresholdSweep, path: None = None, *, title: str | None = None, ax: Sequence[Axes] | npt.NDArray[Any]
) -> tuple[Axes, ...]: ...


def plot_threshold_sweep(
    sweep: ThresholdSweep,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw how well a source is sampled over the threshold, by the criterion of the thesis and by rays kept back.

    Parameters
    ----------
    sweep : ThresholdSweep
        At least two thresholds above 0.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf. The same sweep gives the same bytes.
    title : str, optional
        First line.
    ax : sequence of matplotlib.axes.Axes, optional
        The two axes to draw on, one above the other in a figure of your own: far field, and held-out score; there is no
        caption then.

    Returns
    -------
    matplotlib.figure.Figure or tuple of matplotlib.axes.Axes
        The figure, not registered with pyplot; or the axes of `ax`.

    Raises
    ------
    ArgumentError
        If there are fewer thresholds, the directory of `path` does not exist, `path` and `ax` are both given, or there
        are not two axes.
    UnknownNameError
        If the extension of `path` is none of a picture.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> from etendue.quantities.threshold_sweep import COLUMNS
    >>> columns = {name: np.array([0.9, 0.8]) for name in COLUMNS} | {"threshold": np.array([2.1, 0.021])}
    >>> figure = plot_threshold_sweep(ThresholdSweep(columns, patches=437, rays=10**6, held_out=10**5))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['NCC [%]', 'NRMSE [%]', 'held-out score [nat per ray]']
    """
    require(sweep, ThresholdSweep, "plot_threshold_sweep: sweep", "what et.threshold_sweep(rays, surface) gives")
    if not (len(sweep) >= 2 and (sweep["threshold"] > 0.0).all()):
        raise ArgumentError("plot_threshold_sweep: give a sweep over two or more thresholds above 0 %.")
    heading = title if title is not None else "Threshold of the flux error"
    if ax is not None:
        first, second = style.given_axes(ax, 2, path)
        _far_field(first, sweep)
        _score(second, sweep)
        style.put_title(first, heading)
        return first, second
    facts = style.wrapped(_facts(sweep), WIDTH - 0.6)
    below = 0.3 + 0.15 * len(facts)
    bottom = below + 0.42
    height = bottom + 2 * PANEL + GAP + 1.15
    figure = style.new_figure(WIDTH, height)
    wide = WIDTH - LEFT - RIGHT
    upper = style.add_axes(figure, LEFT, bottom + PANEL + GAP, wide, PANEL)
    _far_field(upper, sweep)
    lower = style.add_axes(figure, LEFT, bottom, wide, PANEL)
    _score(lower, sweep)
    style.add_text(figure, 0.3, height - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    subtitle = "above: far field of all patches together against that of the rays; below: rays that were kept back"
    style.add_text(figure, 0.3, height - 0.52, subtitle, size=style.TICK_SIZE, color=style.FAINT)
    for number, line in enumerate(reversed(facts)):
        style.add_text(figure, 0.3, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    return style.finish(figure, path)


def _far_field(axes: Axes, sweep: ThresholdSweep) -> None:
    """NCC and NRMSE of the far field, as in the thesis; above them how many bins that takes."""
    threshold = sweep["threshold"]
    other = axes.twinx()
    for panel, name, label, marker, colour in (
        (axes, "ncc", "NCC", "o", style.LINES[0]),
        (other, "nrmse_thesis", "NRMSE", "s", style.LINES[1]),
    ):
        panel.plot(threshold, 100.0 * sweep[name], marker=marker, markersize=3.5, color=colour, linewidth=1.2)
        style.dress(panel)
        panel.set_ylabel(f"{label} [%]")
        panel.yaxis.label.set_color(colour)
        panel.margins(y=0.12)
        panel.yaxis.set_major_locator(style.locator_for(PANEL))
        panel.ticklabel_format(axis="y", useOffset=False)
    _over_threshold(axes, sweep)
    axes.set_xticklabels([])
    _mark(axes, threshold[sweep.best("ncc")], style.LINES[0], "")
    bins = axes.secondary_xaxis("top")
    shown = _ticks(sweep)
    labels = [style.grouped(f"{n:.0f}") for n in sweep["bins"][shown]]
    bins.set_xticks(threshold[shown], labels, rotation=45, ha="left")
    bins.minorticks_off()
    bins.tick_params(
        labelsize=style.TICK_SIZE - 1, color=style.RULE, labelcolor=style.FAINT, width=0.6, length=3, pad=1
    )
    bins.spines["top"].set_visible(False)
    axes.text(
        -0.02, 1.03, "bins\nper patch", transform=axes.transAxes,
        ha="right", size=style.TICK_SIZE - 1, color=style.FAINT,
    )  # fmt: skip


def _score(axes: Axes, sweep: ThresholdSweep) -> None:
    """The held-out score with its error, and what the two criteria choose."""
    threshold, score, error = sweep["threshold"], sweep["score"], sweep["score_error"]
    colour = style.LINES[2]
    order = np.argsort(threshold)
    low, high = (score + sign * error for sign in (-1.0, 1.0))
    axes.fill_between(threshold[order], low[order], high[order], color=colour, alpha=0.25, linewidth=0.0)
    axes.plot(threshold, score, marker="o", markersize=3.5, color=colour, linewidth=1.2)
    style.dress(axes)
    axes.set_ylabel("held-out score [nat per ray]")
    axes.yaxis.label.set_color(colour)
    axes.yaxis.set_major_locator(style.locator_for(PANEL))
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.margins(y=0.12)
    _over_threshold(axes, sweep)
    axes.set_xlabel("threshold of E [%]")
    if score.min() < 0.0:
        axes.axhline(0.0, color=style.FAINT, linewidth=0.6, linestyle=(0, (4, 3)))
    by_ncc, by_score = (float(threshold[sweep.best(name)]) for name in ("ncc", "score"))
    if by_ncc == by_score:
        _mark(axes, by_score, colour, "best NCC and score")
        return
    _mark(axes, by_ncc, style.LINES[0], "best NCC")
    _mark(axes, by_score, colour, "best score", height=0.14)


def _over_threshold(axes: Axes, sweep: ThresholdSweep) -> None:
    """Thresholds fall to the right, where bins become fine."""
    threshold = sweep["threshold"]
    axes.set_xscale("log")
    room = (threshold.max() / threshold.min()) ** 0.06
    axes.set_xlim(threshold.max() * room, threshold.min() / room)
    shown = threshold[_ticks(sweep)]
    axes.set_xticks(shown, [style.plain(value) for value in shown])
    axes.minorticks_off()
    axes.grid(visible=True, axis="y", color=style.RULE, linewidth=0.4)
    axes.set_axisbelow(True)


def _ticks(sweep: ThresholdSweep) -> npt.NDArray[np.intp]:
    """The rows that have a tick: all of them, or as many as have room if they were in even steps."""
    order = np.argsort(sweep["threshold"])
    return order[:: -(-len(order) // MOST_TICKS)]


def _mark(axes: Axes, threshold: float, colour: str, label: str, height: float = 0.04) -> None:
    axes.axvline(threshold, color=colour, linewidth=0.8, linestyle=(0, (2, 2)))
    left = axes.transData.transform((threshold, 0.0))[0] < axes.transAxes.transform((0.5, 0.0))[0]
    axes.annotate(
        label, (threshold, height), xycoords=("data", "axes fraction"), xytext=(4 if left else -4, 0),
        textcoords="offset points", ha="left" if left else "right", size=style.TICK_SIZE, color=colour,
    )  # fmt: skip


def _facts(sweep: ThresholdSweep) -> Iterator[str]:
    """What the picture rests on, fact by fact."""
    by_ncc, by_score = sweep.best("ncc"), sweep.best("score")
    yield f"{style.grouped(str(sweep.rays))} rays on {style.grouped(str(sweep.patches))} patches"
    yield f"{style.grouped(str(sweep.held_out))} rays kept back; 0 nat is a uniform light field"
    for name, row in (("NCC", by_ncc), ("score", by_score)):
        threshold = style.plain(float(sweep["threshold"][row]))
        yield f"by {name} {threshold} %: NCC {100 * sweep['ncc'][row]:.2f} %, score {sweep['score'][row]:.3f} nat".replace(
            "-", "−"
        )
    yield Path(sweep.provenance.source).name
