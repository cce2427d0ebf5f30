"""A BSDF: curves in the plane of incidence, the lobe in direction cosines and as a surface, shares by angle of incidence."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, get_args, overload

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.plot import style
from etendue.plot.map_picture import draw_slim_bar
from etendue.quantities.arguments import BSDF, require, require_known, require_number
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.bsdf import Bsdf, Side

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = npt.NDArray[np.float64]

WIDTH, HEIGHT = 7.9, 7.3
"""Of the figure [inches]."""

LEFT, BOTTOM, PANEL, ACROSS, UP = 0.75, 0.55, 2.65, 1.2, 0.9
"""Margins of the diagrams, side of each, and room between two and between two rows [inches]."""

INCIDENCES = (0.0, 30.0, 60.0, 75.0)
"""Angles of incidence that are shown [°]."""

DECADES = 4.0
"""That logarithmic axes show below the largest value."""

NEAREST = 2e-3
"""From the specular direction to the next point of the curves [°]; further points lie further apart."""

RINGS, SPOKES = 100, 120
"""Of the polar surface: steps from the specular direction to the horizon, and around it."""

SURFACE = "#f0b45a"
"""Colour of the polar surface where it is lit."""

NARROW = 5.0
"""Logarithm by which the first of these steps is less than the last: lobes of a tenth of a degree still are round."""

EDGE = 1e-6
"""Part of the way to the horizon that is left, so that rounding leads nowhere beyond it."""


@overload
def plot_bsdf(
    bsdf: Bsdf,
    path: str | os.PathLike[str] | None = None,
    *,
    side: Side = "front",
    incidence: float = 45.0,
    title: str | None = None,
    ax: None = None,
) -> Figure: ...


@overload
def plot_bsdf(
    bsdf: Bsdf,
    path: None = None,
    *,
    side: Side = "front",
    incidence: float = 45.0,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any],
) -> tuple[Axes, ...]: ...


def plot_bsdf(
    bsdf: Bsdf,
    path: str | os.PathLike[str] | None = None,
    *,
    side: Side = "front",
    incidence: float = 45.0,
    title: str | None = None,
    ax: Sequence[Axes] | npt.NDArray[Any] | None = None,
) -> Figure | tuple[Axes, ...]:
    """Draw a BSDF.

    Four diagrams: f in the plane of incidence over the angle of the scattered light, negative on the side where light comes
    from; f over the direction cosines of the scattered light, at one incidence; the shares of the flux over the angle of
    incidence; and f at that incidence as a surface about the place where light arrives, whose distance from there is log f.
    What is transmitted is dashed in the first and in the shares, lies behind in the surface, and is left out over direction
    cosines if anything is reflected.

    Parameters
    ----------
    bsdf : Bsdf
        A model or a table.
    path : path, optional
        Where to write the picture, .png, .svg or .pdf.
    side : {"front", "back"}
        The side that the light meets.
    incidence : number
        Angle of incidence [°] of the diagrams of one incidence, from 0 to below 90°.
    title : str, optional
        Above everything.
    ax : three Axes, optional
        matplotlib's, to draw the first three diagrams on instead of a figure of its own; there is no path then, and no
        surface, which needs axes in three dimensions.

    Returns
    -------
    Figure, or tuple of Axes
        matplotlib's; the axes if they were handed over.

    Raises
    ------
    MissingLibraryError
        If matplotlib is not installed.
    ArgumentError
        If there are not three axes, or a path beside them; or `incidence` is no angle from 0 to below 90°.
    UnknownNameError
        If the extension is none of .png, .svg and .pdf.

    Examples
    --------
    >>> from etendue.scatter.models import Gaussian
    >>> len(plot_bsdf(Gaussian(peak=5, sigma=0.15)).axes)
    5
    """
    require(bsdf, Bsdf, "plot_bsdf: bsdf", BSDF)
    require_known(side, get_args(Side), "side")
    require_number(incidence, "plot_bsdf: incidence", "an angle from 0 to below 90°")
    if not 0.0 <= incidence < 90.0:
        raise ArgumentError(f"incidence is {incidence!r}; give an angle from 0 to below 90°.")
    if ax is not None:
        panels = style.given_axes(ax, 3, path)
        _draw(panels, bsdf, side, incidence)
        if title:
            style.put_title(panels[0], title)
        return panels
    figure = style.new_figure(WIDTH, HEIGHT)
    right, upper = LEFT + PANEL + ACROSS, BOTTOM + PANEL + UP
    places = ((LEFT, upper), (right, upper), (LEFT, BOTTOM))
    _draw([style.add_axes(figure, *place, PANEL, PANEL) for place in places], bsdf, side, incidence)
    across, up = right / WIDTH, BOTTOM / HEIGHT
    solid = figure.add_axes((across, up, PANEL / WIDTH, PANEL / HEIGHT), projection="3d")
    _surface(solid, bsdf, incidence, behind=side == "back")
    if title:
        style.add_text(figure, LEFT, HEIGHT - 0.25, title, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    return style.finish(figure, path)


def _draw(panels: Sequence[Axes], bsdf: Bsdf, side: Side, incidence: float) -> None:
    behind = side == "back"
    _in_plane(panels[0], bsdf, behind=behind)
    _lobe(panels[1], bsdf, incidence, behind=behind)
    _shares(panels[2], bsdf, side)


def _ways(bsdf: Bsdf) -> list[tuple[bool, str]]:
    """The ways of scattered light that there are, with the style of their lines."""
    return [(way, line) for way, line, there in ((False, "-", bsdf.reflects), (True, "--", bsdf.transmits)) if there]


def _in_plane(axes: Axes, bsdf: Bsdf, *, behind: bool) -> None:
    style.dress(axes)
    # Narrow lobes are about the specular direction, and about the light where they are sent back.
    beside = np.concatenate([[0.0], np.geomspace(NEAREST, 2.0, 25)])
    lobes = np.add.outer([*INCIDENCES], np.concatenate([-beside, beside])).ravel()
    angles = np.unique(np.concatenate([np.linspace(-89.9, 89.9, 1441), lobes, -lobes]))
    highest = 0.0
    for theta, colour in zip(INCIDENCES, style.LINES, strict=False):
        incident = direction(max(theta, 1e-6), 180.0, behind=behind)
        for transmitted, line in _ways(bsdf):
            scattered = direction(angles, 0.0, behind=behind != transmitted)
            f = bsdf.evaluate(incident, scattered)
            highest = max(highest, float(f.max()))
            label = f"from {theta:g}°" if line == "-" or not bsdf.reflects else None
            axes.plot(angles, np.maximum(f, 1e-300), line, color=colour, lw=1.1, label=label)
    if highest > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(highest * 10.0**-DECADES, highest * 2.0)
        style.put_log_numbers(axes.yaxis)
        style.put_legend(axes, loc="best")
    axes.set(xlim=(-90, 90), xticks=range(-90, 91, 30), xlabel="angle of scattered light [°]", ylabel="f [1/sr]")
    style.put_title(axes, "In the plane of incidence")


def _lobe(axes: Axes, bsdf: Bsdf, theta: float, *, behind: bool) -> None:
    from matplotlib.colors import LogNorm

    style.dress(axes)
    transmitted = not bsdf.reflects
    cosines = np.linspace(-1.0, 1.0, 401)
    x, y = np.meshgrid(cosines, cosines)
    square = 1.0 - x * x - y * y
    up = behind == transmitted
    scattered = np.stack([x, y, np.sqrt(np.maximum(square, 0.0)) * (1.0 if up else -1.0)], axis=-1)
    inside = square > 0.0
    f = np.full(x.shape, np.nan)
    f[inside] = bsdf.evaluate(direction(theta, 180.0, behind=behind), scattered[inside])
    top = float(np.nanmax(f))
    if top > 0.0:
        lowest = max(top * 10.0**-DECADES, 0.8 * float(np.nanmin(f)))
        norm = LogNorm(lowest, top)
        image = axes.imshow(
            np.maximum(f, lowest), origin="lower", extent=(-1, 1, -1, 1), norm=norm, cmap=style.COLOUR_MAPS["value"]
        )
        draw_slim_bar(image, "1/sr", axes)
    axes.set(xlabel="β along the plane of incidence", ylabel="β across")
    way = "transmitted" if transmitted else "reflected"
    scattered_at_all = bsdf.reflects or bsdf.transmits
    style.put_title(axes, f"f {way}, incidence {theta:g}°" if scattered_at_all else "Nothing is scattered")


def _surface(axes: Any, bsdf: Bsdf, theta: float, *, behind: bool) -> None:
    """Axes in three dimensions, of which matplotlib states no types."""
    from matplotlib.colors import LightSource

    incident = direction(theta, 180.0, behind=behind)
    sheets = [polar_surface(bsdf, incident, transmitted=transmitted) for transmitted, _ in _ways(bsdf)]
    top = max((float(f.max()) for _, f in sheets), default=0.0)
    heights = [float(toward[0, 0, 2]) for toward, _ in sheets] + [float(incident[2])]
    low, high = (float(any(sign * height > 0.0 for height in heights)) for sign in (-1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-low, high))
    axes.set_box_aspect((2, 2, low + high), zoom=1.35)
    axes.view_init(elev=-18 if high == 0.0 else 18, azim=-65)
    rim = direction(90.0, np.linspace(0.0, 360.0, 181))
    axes.plot(*rim.T, color=style.RULE, lw=0.8)
    axes.plot(*np.stack([1.15 * incident, 0.0 * incident], axis=1), color=style.LINES[1], lw=1.2)
    for toward, f in sheets if top > 0.0 else ():
        radius = np.clip(1.0 + np.log10(np.maximum(f / top, 1e-300)) / DECADES, 0.0, 1.0)
        axes.plot_surface(
            *np.moveaxis(radius[..., None] * toward, -1, 0),
            color=SURFACE,
            lightsource=LightSource(azdeg=250, altdeg=-50 if high == 0.0 else 50),
            rcount=RINGS,
            ccount=SPOKES,
            linewidth=0.0,
            antialiased=False,
            rasterized=True,
        )
    scattered = f"log f as distance, incidence {theta:g}°" if top > 0.0 else "Nothing is scattered from here"
    style.put_title(axes, scattered if sheets else "Nothing is scattered")


def polar_surface(bsdf: Bsdf, incident: Array, *, transmitted: bool) -> tuple[Array, Array]:
    """Directions of one way of light and f there: rings about the specular direction, close together near it.

    Parameters
    ----------
    bsdf : Bsdf
        A model or a table.
    incident : array, shape (3,)
        Unit vector to where the light comes from.
    transmitted : bool
        About the direction straight on, behind the surface.

    Returns
    -------
    array, array
        Unit vectors of shape (rings, azimuths, 3), from the specular direction to the horizon; f [1/sr].

    Examples
    --------
    >>> from etendue.scatter.models import Lambertian
    >>> toward, f = polar_surface(Lambertian(reflectance=0.5), direction(40.0, 180.0), transmitted=False)
    >>> toward[0, 0].round(3).tolist(), abs(toward[-1, :, 2]).max().round(3).tolist()
    ([0.643, -0.0, 0.766], 0.0)
    """
    # In the sense in which normals of the surface point away from the middle, so that it is lit from outside.
    azimuth = np.linspace(360.0, 0.0, SPOKES + 1)
    # Heights are cos r · |i_z| + sin r · cos φ · √(1 − i_z²) at an angle r from the specular direction: 0 at the horizon.
    height = abs(float(incident[2]))
    horizon = np.degrees(np.arctan2(height, -np.cos(np.radians(azimuth)) * np.sqrt(max(0.0, 1.0 - height**2))))
    steps = np.expm1(NARROW * np.linspace(0.0, 1.0 - EDGE, RINGS + 1)) / np.expm1(NARROW)
    grid = PolarGrid("specular", np.zeros(1), np.zeros(1))
    toward = grid.direction(steps[:, None] * horizon, azimuth, incident, transmitted=transmitted)
    return toward, bsdf.evaluate(incident, toward)


def _shares(axes: Axes, bsdf: Bsdf, side: Side) -> None:
    style.dress(axes)
    theta = np.linspace(0.0, 89.5, 180)
    curves: list[tuple[str, Array, str]] = [
        ("R, all", bsdf.reflectance(theta, side=side), "-"),
        ("R, specular", bsdf.regular_reflectance(theta, side=side), ":"),
        ("T, all", bsdf.transmittance(theta, side=side), "--"),
        ("T, straight on", bsdf.regular_transmittance(theta, side=side), "-."),
    ]
    for (label, values, line), colour in zip(curves, style.LINES, strict=False):
        if values.max() > 0.0:
            axes.plot(theta, values, line, color=colour, lw=1.2, label=label)
    # Of reflected light, if there is any.
    last = bsdf.known_to(side=side, transmitted=not bsdf.reflects)
    if last < theta[-1]:
        axes.axvspan(last, 90.0, color=style.RULE, alpha=0.5, lw=0, label="extrapolated")
    axes.set(
        xlim=(0, 90),
        ylim=(0, 1.02),
        xticks=range(0, 91, 30),
        xlabel="angle of incidence [°]",
        ylabel="share of the flux",
    )
    if axes.lines:
        style.put_legend(axes, loc="best")
    style.put_title(axes, "Directional-hemispherical")
