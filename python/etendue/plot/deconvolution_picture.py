"""A deconvolved scan: the lobe before and after with its error band, residuals, and how the iteration stopped."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from etendue.instruments.deconvolution import Deconvolution
from etendue.plot import style
from etendue.quantities.arguments import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 11.4, 3.9
"""Of the figure [inches]."""

LEFT, BOTTOM, PANEL, GAP, TALL = 0.75, 0.95, 2.75, 0.85, 2.4
"""Margins of the first diagram, width of each, room between two, and their height [inches]."""

SHOWN = 1e-3
"""Of the largest value: what lies further out is left out of the picture."""


@overload
def plot_deconvolution(
    found: Deconvolution, path: str | os.PathLike[str] | None = None, *, title: str | None = None, ax: None = None
) -> Figure: ...


@overload
def plot_deconvolution(
    found: Deconvolution,
    path: None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any],
) -> tuple[Axes, ...]: ...


def plot_deconvolution(
    found: Deconvolution,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw what `deconvolve` found.

    Left the scan as it was measured and without the instrument, with its error band; in the middle the residuals; right the
    error function E(i) and the iteration that was chosen.

    Parameters
    ----------
    found : Deconvolution
        What to draw.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    title : str, optional
        Above everything.
    ax : three Axes, optional
        matplotlib's, to draw on instead of a figure of its own; there is no path then.

    Returns
    -------
    Figure, or tuple of Axes
        matplotlib's; the axes if they were handed over.

    Raises
    ------
    MissingLibraryError
        If matplotlib is not installed.
    ArgumentError
        If there are not three axes, or a path beside them.
    UnknownNameError
        If the extension is none of .png, .svg and .pdf.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer()
    >>> sample = et.bsdf.CosinePower(peak=598.5, exponent=3761, way="transmitted")
    >>> scan = goniometer.measure(sample, step=0.25, span=5, rays=20_000)
    >>> len(et.plot_deconvolution(et.deconvolve(scan, goniometer.instrument_function())).axes)
    3
    """
    require(found, Deconvolution, "plot_deconvolution: found", "what et.deconvolve(scan, signature) gives")
    if ax is not None:
        panels = style.given_axes(ax, 3, path)
        _draw(panels, found)
        if title:
            style.put_title(panels[0], title)
        return panels
    figure = style.new_figure(WIDTH, HEIGHT)
    _draw([style.add_axes(figure, LEFT + k * (PANEL + GAP), BOTTOM, PANEL, TALL) for k in range(3)], found)
    before, after = found.total_scatter
    facts = [found.stop, f"total scatter {before:.4g} before, {after:.4g} after", f"operator: {found.operator}"]
    for k, line in enumerate(style.wrapped(facts, WIDTH - 2 * LEFT)):
        style.add_text(figure, LEFT, 0.34 - 0.15 * k, line, size=style.CAPTION_SIZE, color=style.FAINT)
    if title:
        style.add_text(figure, LEFT, HEIGHT - 0.25, title, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    return style.finish(figure, path)


def _draw(panels: Sequence[Axes], found: Deconvolution) -> None:
    for axes in panels:
        style.dress(axes)
    lit = np.flatnonzero((found.values > SHOWN * found.peak) | (found.raw > SHOWN * found.raw.max()))
    limits = (float(found.angle[lit[0]]), float(found.angle[lit[-1]]))
    _lobe(panels[0], found)
    _residuals(panels[1], found)
    for axes in panels[:2]:
        if limits[0] < limits[1]:
            axes.set_xlim(*limits)
        axes.set_xlabel("angle of the detector [°]")
    if found.error_function.size:
        _error_function(panels[2], found)
        return
    # Nothing was iterated: there is room for what is faint.
    _logarithmic(panels[2], found)
    if limits[0] < limits[1]:
        panels[2].set_xlim(*limits)


def _logarithmic(axes: Axes, found: Deconvolution) -> None:
    least = SHOWN * found.peak

    def shown(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.where(values > least, values, np.nan)

    axes.semilogy(found.angle, shown(found.raw), "--", color=style.LINES[1], lw=1.1)
    if found.standard_error is not None:
        low, high = found.values - found.standard_error, found.values + found.standard_error
        axes.fill_between(found.angle, np.maximum(low, least), shown(high), color=style.LINES[0], alpha=0.25, lw=0)
    axes.semilogy(found.angle, shown(found.values), color=style.LINES[0], lw=1.2)
    axes.set(ylim=(least, 2.0 * max(found.peak, float(found.raw.max()))), xlabel="angle of the detector [°]")
    axes.set_ylabel("f [1/sr]")
    style.put_log_numbers(axes.yaxis)
    style.put_title(axes, "The same, logarithmic")


def _lobe(axes: Axes, found: Deconvolution) -> None:
    axes.plot(found.angle, found.raw, "--", color=style.LINES[1], lw=1.1, label="as measured")
    if found.standard_error is not None:
        low, high = found.values - found.standard_error, found.values + found.standard_error
        axes.fill_between(found.angle, low, high, color=style.LINES[0], alpha=0.25, lw=0, label="± standard error")
    axes.plot(found.angle, found.values, color=style.LINES[0], lw=1.2, label="without the instrument")
    top = 1.05 * max(found.peak, float(found.raw.max()))
    axes.set(ylim=(min(0.0, 1.05 * float(found.values.min())), 1.25 * top), ylabel="f [1/sr]")
    style.put_legend(axes, loc="upper left")
    style.put_title(axes, "The lobe")


def _residuals(axes: Axes, found: Deconvolution) -> None:
    axes.axhline(0.0, color=style.RULE, lw=0.8)
    axes.plot(found.angle, found.residuals, ".", color=style.LINES[0], ms=2.5)
    known = found.standard_error is not None
    axes.set_ylabel("measured − fitted" + (" [standard errors]" if known else " [flux]"))
    style.put_title(axes, "Residuals of the scan")


def _error_function(axes: Axes, found: Deconvolution) -> None:
    error = found.error_function
    counted = np.arange(1, error.size + 1)
    axes.loglog(counted, error / error.max(), color=style.LINES[0], lw=1.2)
    axes.axvline(found.iterations, color=style.LINES[1], lw=1.0, ls="--", label=f"stop: {found.iterations}")
    axes.set(xlabel="iteration i", ylabel="E(i) over its largest value")
    for axis in (axes.xaxis, axes.yaxis):
        style.put_log_numbers(axis)
    style.put_legend(axes, loc="best")
    style.put_title(axes, "E(i), eq. 5.7")
