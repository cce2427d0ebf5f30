"""Maps of many observers, one after the other, on one scale of colours."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from etendue.errors import ArgumentError
from etendue.plot import style
from etendue.plot.animation_files import COLOURS, Frame, Writing, writer_for
from etendue.plot.colour_scale import Scale, choose_scale, colour_map, normalisation
from etendue.plot.map_picture import MapLayout, axis_names, draw_colour_bar, draw_screen
from etendue.quantities.arguments import require, require_number, require_path
from etendue.quantities.luminance_map import LuminanceMap, check_luminance_map

if TYPE_CHECKING:
    from matplotlib.colors import Colormap

DPI = 100
"""Of frames: a GIF of 36 has one to three megabytes."""

OF_MAP = 224
"""Colours of a GIF that are those of the map; the others are for letters and lines."""


def plot_animation(
    maps: Sequence[LuminanceMap],
    path: str | os.PathLike[str],
    scale: Scale = "auto",
    *,
    seconds: float = 0.12,
    vmin: float | None = None,
    vmax: float | None = None,
    title: str | None = None,
    cmap: str | Colormap | None = None,
) -> None:
    """Write a moving picture of maps: all on one scale, each with its observer named.

    Parameters
    ----------
    maps : sequence of LuminanceMap
        Two or more of one quantity, on screens of one size, in the order in which they are shown.
    path : path
        ``.gif``; ``.mp4``, for which the program ffmpeg must be installed; or ``.html``, a page of one file with a slider,
        which asks nothing of any network. The same maps give the same bytes.
    scale : {"auto", "linear", "log"}
        As of `plot_map`, by the pixels of all maps together.
    seconds : float
        That each map stays, 0.02 to 60.
    vmin, vmax, title, cmap
        As of `plot_map`.

    Raises
    ------
    ArgumentError
        If there are fewer than two maps, they differ in quantity or size, `seconds`, `vmin` or `vmax` are out of their
        range, the directory of `path` does not exist, or ffmpeg is needed and not there.
    UnknownNameError
        If `scale`, `cmap` or the extension of `path` does not exist.
    MissingLibraryError
        If matplotlib is not installed.

    Examples
    --------
    >>> import etendue as et
    >>> from tempfile import TemporaryDirectory
    >>> lamp = et.Scene(sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}])
    >>> around = [et.Observer(40, phi, 1000, up=(0, 0, 1)) for phi in (0, 180)]
    >>> maps = et.luminance_map(lamp, around, et.Screen(3, 3, 8, 8), rays_per_pixel=16)
    >>> with TemporaryDirectory() as folder:
    ...     et.plot_animation(maps, Path(folder) / "lamp.gif")
    ...     (Path(folder) / "lamp.gif").stat().st_size > 1000
    True
    """
    require(maps, (list, tuple), "plot_animation: maps", "a list of two LuminanceMaps or more")
    for lmap in maps:
        check_luminance_map(lmap, "plot_animation")
    require_path(path, "plot_animation: path", "the path of a moving picture, .gif, .html or .mp4")
    for name, end in (("vmin", vmin), ("vmax", vmax)):
        if end is not None:
            require_number(end, f"plot_animation: {name}", "a luminance, or None")
    require_number(seconds, "plot_animation: seconds", "how long a map stays, 0.02 to 60")
    writer = writer_for(path)
    if not 0.02 <= seconds <= 60.0:
        raise ArgumentError(f"plot_animation: seconds is {seconds!r}; give how long a map stays, 0.02 to 60.")
    _check(maps)
    heading = title if title is not None else style.headed(maps[0].quantity.capitalize(), _source(maps), 4.0)
    colours = colour_map("value", cmap)
    frames = list(_frames(maps, scale, vmin, vmax, heading, colours))
    labels = [style.describe_observer(lmap.observer) for lmap in maps]
    writer(Writing(frames, labels, heading, seconds, _palette(colours)), path)


def _palette(colours: Colormap) -> Frame:
    """Those of the map, white to black for the letters, and that of missing numbers."""
    of_map = colours(np.linspace(0.0, 1.0, OF_MAP))[:, :3]
    greys = np.linspace(0.0, 1.0, COLOURS - OF_MAP - 1)[:, None].repeat(3, axis=1)
    return np.round(255.0 * np.concatenate([of_map, greys, [colours.get_bad()[:3]]])).astype(np.uint8)


def _check(maps: Sequence[LuminanceMap]) -> None:
    if len(maps) < 2:
        raise ArgumentError(f"plot_animation: {len(maps)} map does not move; give two or more, of several observers.")
    if len({lmap.unit for lmap in maps}) > 1:
        units = ", ".join(sorted({lmap.unit for lmap in maps}))
        raise ArgumentError(f"plot_animation: maps in {units} cannot share a scale; show those of one unit.")
    if len({(one.screen.width, one.screen.height, one.screen.plane) for one in maps}) > 1:
        raise ArgumentError("plot_animation: the screens differ in size; give one screen to all observers.")


def _source(maps: Sequence[LuminanceMap]) -> str:
    names = {lmap.provenance.source for lmap in maps}
    return names.pop() if len(names) == 1 else ""


def _frames(
    maps: Sequence[LuminanceMap],
    scale: str,
    vmin: float | None,
    vmax: float | None,
    heading: str,
    colours: Colormap,
) -> Iterator[Frame]:
    """One figure, of which only the pixels and the observer's line change."""
    values = np.concatenate([lmap.values.ravel() for lmap in maps])
    errors = np.concatenate([lmap.standard_error.ravel() for lmap in maps])
    chosen = choose_scale(values, scale)
    norm = normalisation(values, chosen.name, vmin, vmax, errors)
    first = maps[0]
    facts = [f"{len(maps)} observers, one scale", *([chosen.why] if chosen.why else [])]
    facts += [f"{first.screen.columns} × {first.screen.rows} pixels", Path(first.provenance.source).name]
    layout = MapLayout.around(first.screen, [fact for fact in facts if fact], [])
    figure = style.new_figure(layout.width, layout.height)
    figure.set_dpi(DPI)
    axes = style.add_axes(figure, *layout.picture)
    image = draw_screen(axes, first.values, first.screen, colours, norm, layout.picture[2:], axis_names(first))
    draw_colour_bar(image, values, first.quantity, first.unit, style.add_axes(figure, *layout.bar))
    left, top = layout.text_left, layout.height
    style.add_text(figure, left, top - 0.32, heading, size=style.TITLE_SIZE, color=style.INK, weight="bold")
    style.add_text(figure, left, top - 0.54, " ", size=style.LABEL_SIZE, color=style.FAINT)
    told = figure.texts[-1]
    for number, line in enumerate(reversed(layout.caption)):
        style.add_text(figure, left, 0.14 + 0.15 * number, line, size=style.CAPTION_SIZE, color=style.FAINT)
    style.finish(figure, None)
    lowest = -np.inf if norm.vmin is None else norm.vmin
    # What is the same in all frames is drawn once. Frames of axes lie over the pixels.
    changing = [image, *axes.spines.values(), told]
    for part in changing:
        part.set_animated(True)
    # The class is that of `style.new_figure`, which draws into memory.
    canvas: Any = figure.canvas
    canvas.draw()
    unchanged = canvas.copy_from_bbox(figure.bbox)
    for lmap in maps:
        clipped = np.where(np.isnan(lmap.values), np.nan, np.maximum(lmap.values, lowest))
        image.set_data(np.ma.masked_invalid(clipped))
        told.set_text(f"seen at {style.describe_observer(lmap.observer)}")
        canvas.restore_region(unchanged)
        for part in changing:
            figure.draw_artist(part)
        yield np.array(canvas.buffer_rgba())[..., :3].copy()
