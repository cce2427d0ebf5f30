"""A near-field measurement: images from four positions on one scale, over all decades that the exposures reach."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.near_field.run import NearFieldRun
from etendue.plot import style
from etendue.plot.colour_scale import colour_map
from etendue.plot.map_picture import axis_names, bar_beside, draw_colour_bar, draw_screen
from etendue.quantities.arguments import require, require_number
from etendue.quantities.powers_of_ten import counted
from etendue.units import LUMINANCE_NAME, LUMINANCE_UNIT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage

    from etendue.quantities.luminance_map import LuminanceMap

WIDTH, HEIGHT = 11.4, 3.75
"""Of the figure [inches]."""

LEFT, BOTTOM, PANEL, GAP = 0.65, 0.95, 2.15, 0.3
"""Margins of the first picture, side of each, room between two [inches]."""

IMAGES = 4
"""Evenly spread over the positions of a plane from which the lamp is not dark."""

DECADES = 6.0
"""Under the highest luminance, at most."""


def plot_near_field(
    run: NearFieldRun,
    path: str | os.PathLike[str] | None = None,
    *,
    title: str | None = None,
    c: float = 0.0,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Images of a lamp from four positions in one plane, in false colours on one logarithmic scale.

    Parameters
    ----------
    run : NearFieldRun
        What to draw.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    title : str, optional
        Above everything; the source of the light if left out.
    c : number
        Plane of the positions [°].
    ax : four Axes, optional
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
        If there are not four axes, or a path beside them.
    UnknownNameError
        If the extension is none of .png, .svg and .pdf.

    Examples
    --------
    >>> import etendue as et
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    >>> run = et.NearFieldGoniophotometer(step=30, camera_pixels=16).measure(et.Scene(sources=[disk]))
    >>> len(et.plot_near_field(run).axes)                                      # four images and a colour bar
    5
    """
    require(run, NearFieldRun, "plot_near_field: run", "what et.NearFieldGoniophotometer().measure(lamp) gives")
    require_number(c, "plot_near_field: c", "an angle in °")
    if not math.isfinite(c):
        raise ArgumentError(f"plot_near_field: c is {c:g}; give an angle in °.")
    maps = [run.luminance_map(gamma, c) for gamma in _positions(run, c)]
    if ax is not None:
        panels = style.given_axes(ax, len(maps), path)
        image = _draw(panels, maps)
        draw_colour_bar(image, _all(maps), *_label(run), bar_beside(panels[-1], maps[-1].screen))
        if title:
            style.put_title(panels[0], title)
        return panels
    figure = style.new_figure(WIDTH, HEIGHT)
    image = _draw([style.add_axes(figure, LEFT + k * (PANEL + GAP), BOTTOM, PANEL, PANEL) for k in range(IMAGES)], maps)
    bar = style.add_axes(figure, LEFT + 4 * PANEL + 3 * GAP + 0.2, BOTTOM, 0.14, PANEL)
    draw_colour_bar(image, _all(maps), *_label(run), bar)
    setting, exposures = run.setting, run.setting.camera.exposures
    facts = [
        f"{style.grouped(str(len(setting.positions)))} positions at {style.plain(setting.distance)} mm",
        f"{exposures} exposure{'s' * (exposures != 1)} of {setting.camera.bits} bits",
        f"dynamic range {style.grouped(f'{setting.camera.dynamic_range:.0f}')} : 1",
        f"total flux {counted(run.total_flux, run.flux_unit)}",
        f"{style.percent(100.0 * run.disagreement)} of it elsewhere than by the photometer",
    ]
    for k, line in enumerate(style.wrapped(facts, WIDTH - 2 * LEFT)):
        style.add_text(figure, LEFT, 0.3 - 0.15 * k, line, size=style.CAPTION_SIZE, color=style.FAINT)
    heading = title if title is not None else run.provenance.source
    style.add_text(figure, LEFT, HEIGHT - 0.3, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    return style.finish(figure, path)


def _positions(run: NearFieldRun, c: float) -> list[float]:
    """γ of the images."""
    stops = run.setting.positions
    lit = [float(gamma) for gamma in stops.rings if run.sees_light(stops.nearest(float(gamma), c))]
    if not lit:
        lit = [float(gamma) for gamma in stops.rings]
    return [lit[round(k * (len(lit) - 1) / (IMAGES - 1))] for k in range(IMAGES)]


def _draw(panels: Sequence[Axes], maps: Sequence[LuminanceMap]) -> AxesImage:
    """The images on one scale."""
    from matplotlib.colors import LogNorm

    lit = _all(maps)[_all(maps) > 0.0]
    high = float(lit.max(initial=0.0)) or 1.0
    low = max(float(lit.min(initial=high)), high * 10.0**-DECADES)
    norm = LogNorm(low if low < high else high / 10.0, high)
    for k, (axes, lmap) in enumerate(zip(panels, maps, strict=True)):
        image = draw_screen(axes, lmap.values, lmap.screen, colour_map("value"), norm, (PANEL, PANEL), axis_names(lmap))
        axes.set_aspect("equal")
        if k > 0:
            axes.set_ylabel("")
            axes.set_yticklabels([])
        style.put_title(axes, f"γ {lmap.observer.theta:g}°, C {lmap.observer.phi:g}°")
    return image


def _all(maps: Sequence[LuminanceMap]) -> npt.NDArray[np.float64]:
    return np.concatenate([lmap.values.ravel() for lmap in maps])


def _label(run: NearFieldRun) -> tuple[str, str]:
    return LUMINANCE_NAME[run.flux_unit], LUMINANCE_UNIT[run.flux_unit]
