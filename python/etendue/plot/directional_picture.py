"""A lobe in two dimensions before and after its deconvolution: two maps, the residuals, and two cuts."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.directional_deconvolution import DirectionalDeconvolution
from etendue.plot import style
from etendue.plot.map_picture import draw_slim_bar
from etendue.quantities.arguments import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT = 13.2, 3.7
"""Of the figure [inches]."""

LEFT, BOTTOM, PANEL, TALL = 0.7, 0.85, 2.3, 2.3
"""Margins of the first diagram, and the sides of each [inches]."""

STARTS = (0.7, 3.35, 6.9, 10.55)
"""Left edges of the four diagrams [inches]."""

DECADES = 3.0
"""That colours show below the largest value."""

FINE = 161
"""Points of a map along each side, and of a cut."""


@overload
def plot_directions(
    found: DirectionalDeconvolution,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_directions(
    found: DirectionalDeconvolution,
    path: None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any],
) -> tuple[Axes, ...]: ...


def plot_directions(
    found: DirectionalDeconvolution,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw what `deconvolve_directions` found.

    Two maps of f over the angles of the detector from the regular direction, as measured and without the instrument, with
    the same colours; the residuals of all positions; cuts along the plane of incidence and across it, with the error band.
    Coarse positions outside the window are left out.

    Parameters
    ----------
    found : DirectionalDeconvolution
        What to draw.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    title : str, optional
        Above everything.
    ax : four Axes, optional
        matplotlib's, to draw on instead of a figure of its own; there is no path then.

    Returns
    -------
    Figure, or tuple of Axes
        matplotlib's; the axes if they were handed over.

    Raises
    ------
    MissingLibraryError
        If matplotlib or SciPy is not installed.
    ArgumentError
        If there are not four axes, or a path beside them.
    UnknownNameError
        If the extension is none of .png, .svg and .pdf.

    Examples
    --------
    >>> import etendue as et
    >>> sample = et.bsdf.Gaussian(peak=200.0, sigma=0.012, aspect=2.0)
    >>> scan = et.ScatterGoniometer(photons=1e6).measure_window(sample, 60, step=1, span=6, method="quadrature")
    >>> len(et.plot_directions(et.deconvolve_directions(scan)).axes)
    6
    """
    require(found, DirectionalDeconvolution, "plot_directions: found", "what et.deconvolve_directions(scan) gives")
    if ax is not None:
        panels = style.given_axes(ax, 4, path)
        _draw(panels, found)
        if title:
            style.put_title(panels[0], title)
        return panels
    figure = style.new_figure(WIDTH, HEIGHT)
    _draw([style.add_axes(figure, left, BOTTOM, PANEL, TALL) for left in STARTS], found)
    facts = [found.stop, f"cells of {found.cell:.2g}°", f"incidence {found.scan.incidence:g}°, {found.scan.way}"]
    if found.regular.share > 0.0:
        facts.insert(
            0, f"{found.regular.share:.4g} ± {found.regular.error:.1g} of the light in a single direction, not drawn"
        )
    for k, line in enumerate(style.wrapped(facts, WIDTH - 2 * LEFT)):
        style.add_text(figure, LEFT, 0.3 - 0.15 * k, line, size=style.CAPTION_SIZE, color=style.FAINT)
    if title:
        style.add_text(figure, LEFT, HEIGHT - 0.22, title, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    return style.finish(figure, path)


def _draw(panels: Sequence[Axes], found: DirectionalDeconvolution) -> None:
    for axes in panels:
        style.dress(axes)
    scan = found.scan
    step = float(np.quantile(scan.spacing, 0.1))
    shown = scan.spacing < 2.0 * step
    along, across = _angles(found, scan.direction[shown])
    between = scipy_part("interpolate").LinearNDInterpolator
    limits = (float(along.min()), float(along.max()), float(across.min()), float(across.max()))
    x, y = np.meshgrid(np.linspace(limits[0], limits[1], FINE), np.linspace(limits[2], limits[3], FINE))
    raw = between(np.column_stack([along, across]), scan.bsdf[shown])
    error = None
    if found.standard_error is not None:
        error = between(np.column_stack([along, across]), found.standard_error[shown])
    inside = ~np.isnan(raw(x, y))
    after = np.where(inside, found.evaluate(_directions(found, x, y)), np.nan)
    _maps(panels[:2], raw(x, y), after, limits)
    _residuals(panels[2], along, across, found.residuals[shown], limits, known=found.standard_error is not None)
    _cuts(panels[3], found, raw, error, limits)


def _angles(found: DirectionalDeconvolution, d: Array) -> tuple[Array, Array]:
    """In the plane of incidence from the regular direction, and across it [°]."""
    along = np.degrees(np.arctan2(d[..., 0], np.abs(d[..., 2]))) - found.scan.incidence
    return along, np.degrees(np.arcsin(np.clip(d[..., 1], -1.0, 1.0)))


def _directions(found: DirectionalDeconvolution, along: Array, across: Array) -> Array:
    a, b = np.radians(along + found.scan.incidence), np.radians(across)
    up = -1.0 if found.scan.behind else 1.0
    return np.stack([np.sin(a) * np.cos(b), np.sin(b), up * np.cos(a) * np.cos(b)], axis=-1)


def _maps(panels: Sequence[Axes], raw: Array, after: Array, limits: tuple[float, float, float, float]) -> None:
    from matplotlib.colors import LogNorm

    top = float(max(np.nanmax(raw), np.nanmax(after)))
    positive = np.concatenate([one[one > 0.0] for one in (raw, after)])
    low = max(top * 10.0**-DECADES, 0.8 * float(positive.min()))
    norm = LogNorm(low, top)
    options: dict[str, Any] = {
        "origin": "lower",
        "extent": limits,
        "aspect": "auto",
        "cmap": style.COLOUR_MAPS["value"],
    }
    for axes, values, name in zip(panels, (raw, after), ("f as measured", "f without the instrument"), strict=True):
        axes.set_facecolor(style.DEAD)
        image = axes.imshow(np.maximum(values, low), norm=norm, **options)
        axes.set(xlabel="in the plane of incidence [°]")
        style.put_title(axes, name)
    panels[0].set_ylabel("across it [°]")
    panels[1].set_yticklabels([])
    draw_slim_bar(image, "1/sr", panels[1])


def _residuals(
    axes: Axes, along: Array, across: Array, values: Array, limits: tuple[float, float, float, float], *, known: bool
) -> None:
    scale = 3.0 if known else float(np.abs(values).max() or 1.0)
    side = max(2.0, 0.8 * 72.0 * PANEL / np.sqrt(values.size))
    image = axes.scatter(along, across, (side**2), values, marker="s", lw=0, cmap="RdBu_r", vmin=-scale, vmax=scale)
    axes.set(xlabel="in the plane of incidence [°]", xlim=limits[:2], ylim=limits[2:])
    style.put_title(axes, "Residuals of the scan")
    draw_slim_bar(image, "errors" if known else "flux", axes)


def _cuts(
    axes: Axes, found: DirectionalDeconvolution, raw: Any, error: Any, limits: tuple[float, float, float, float]
) -> None:
    # A cut along the edge of a position is none: a hair inside.
    for k, (name, colour) in enumerate((("in the plane", style.LINES[0]), ("across it", style.LINES[2]))):
        t = np.linspace(limits[2 * k], limits[2 * k + 1], FINE)
        x, y = (t, np.zeros(FINE)) if k == 0 else (np.zeros(FINE), t)
        f = found.evaluate(_directions(found, x, y))
        axes.plot(t, raw(x, y), "--", color=colour, lw=0.9, label="as measured" if k else None)
        axes.plot(t, np.maximum(f, 1e-300), color=colour, lw=1.2, label=name)
        if error is not None:
            e = error(x, y)
            axes.fill_between(t, np.maximum(f - e, 1e-300), f + e, color=colour, alpha=0.25, lw=0)
    top = max(found.peak, float(found.scan.bsdf.max()))
    axes.set_yscale("log")
    style.put_log_numbers(axes.yaxis)
    low = max(top * 10.0**-DECADES, 0.3 * float(np.quantile(found.scan.bsdf[found.scan.bsdf > 0.0], 0.02)))
    axes.set(ylim=(low, 10.0 * top), xlabel="from the regular direction [°]", ylabel="f [1/sr]")
    style.put_legend(axes, loc="upper left")
    style.put_title(axes, "Cuts")
