"""From numbers to colours: linear, logarithmic or signed, chosen from the numbers themselves unless somebody states it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.extras import require
from etendue.plot import style
from etendue.quantities.arguments import require as require_kind
from etendue.quantities.arguments import require_known

if TYPE_CHECKING:
    from matplotlib.colors import Colormap, Normalize

Array = npt.NDArray[np.float64]
Scale = Literal["auto", "linear", "log"]
SCALES: tuple[Scale, ...] = get_args(Scale)

DECADES = 4
"""How far a logarithmic scale reaches down from the brightest pixel unless `vmin` says otherwise."""

BLACK = 1.0 / 30.0
"""Share of the maximum that is next to black on a linear scale: if half of the lit pixels are darker, colours are
logarithmic."""

SURE = 2.0
"""A pixel is known to be lit if it is so many standard errors above 0."""


class ChosenScale(NamedTuple):
    """A scale, ``"linear"`` or ``"log"``, and why it was taken, as a fact of a caption; no words if it was asked for."""

    name: Literal["linear", "log"]
    why: str


def choose_scale(values: Array, wanted: str, quantity: str = "pixel") -> ChosenScale:
    """The scale that is wanted, or for ``"auto"`` the one that the values ask for.

    It is logarithmic if the median of all values above 0 is less than a thirtieth of the largest, linear otherwise.

    Parameters
    ----------
    values : array
        In any unit; those that are not finite do not count.
    wanted : {"auto", "linear", "log"}
        Which one.
    quantity : str
        What there is one value of, in the words of the caption.

    Raises
    ------
    UnknownNameError
        If there is no such scale.

    Examples
    --------
    >>> choose_scale(np.array([0.0, 1.0, 2.0, 500.0]), "auto")
    ChosenScale(name='log', why='logarithmic colours: the median lit pixel has 0.4 % of the maximum')
    >>> choose_scale(np.array([0.0, 100.0, 200.0, 500.0]), "auto").name
    'linear'
    """
    require_known(wanted, SCALES, "colour scale")
    if wanted != "auto":
        return ChosenScale("log" if wanted == "log" else "linear", "")
    lit = values[np.isfinite(values) & (values > 0.0)]
    if not lit.size:
        return ChosenScale("linear", "")
    share = float(np.median(lit) / lit.max())
    name: Literal["linear", "log"] = "log" if share < BLACK else "linear"
    word = "logarithmic" if name == "log" else "linear"
    return ChosenScale(
        name, f"{word} colours: the median lit {quantity} has {style.percent(100.0 * share)} of the maximum"
    )


def colour_map(colours: str, wanted: str | Colormap | None = None) -> Colormap:
    """The colours that are wanted, or those of `style.COLOUR_MAPS`, with the colour of missing numbers.

    Raises
    ------
    UnknownNameError
        If matplotlib knows no colours of this name.

    Examples
    --------
    >>> colour_map("value").name, colour_map("value", "viridis").name
    ('inferno', 'viridis')
    """
    mpl = require("matplotlib")
    name = style.COLOUR_MAPS[colours] if wanted is None else wanted
    require_kind(name, (str, mpl.colors.Colormap), "plot: cmap", "the name of a colour map of matplotlib, or one")
    if isinstance(name, str) and name not in mpl.colormaps:
        raise UnknownNameError("colour map", name, mpl.colormaps)
    found: Colormap = mpl.colormaps.get_cmap(name).with_extremes(bad=style.DEAD)
    return found


def normalisation(
    data: Array, scale: str, vmin: float | None, vmax: float | None, error: Array | None = None
) -> Normalize:
    """From numbers to colours; the defaults are those of `plot_map`.

    Of values with an `error`, a logarithmic scale goes down to the lowest that is known to be above 0: what is less is
    noise, or the remainder that a light field gives to all of its surface, whose outline is not that of the lamp.

    Raises
    ------
    ArgumentError
        If the range is none.

    Examples
    --------
    >>> values, errors = np.array([0.2, 1.0, 500.0]), np.array([0.3, 0.4, 20.0])
    >>> norm = normalisation(values, "log", None, None, errors)                 # 0.2 ± 0.3 may well be black
    >>> norm.vmin, norm.vmax
    (1.0, 500.0)
    """
    require("matplotlib")
    from matplotlib.colors import LogNorm, Normalize

    finite = np.isfinite(data)
    if scale == "log":
        lit = finite & (data > 0.0)
        high = float(data[lit].max(initial=0.0)) or 1.0 if vmax is None else vmax
        sure = lit if error is None else lit & ~(data < SURE * error)
        low = max(float(data[sure if sure.any() else lit].min(initial=high)), high * 10.0**-DECADES)
        low = low if vmin is None else vmin
        if vmin is None and low >= high:
            low = high / 10.0
    else:
        low = min(0.0, float(data[finite].min(initial=0.0))) if vmin is None else vmin
        high = float(data[finite].max(initial=low)) if vmax is None else vmax
        if vmax is None and high <= low:
            high = low + 1.0
    if not (math.isfinite(low) and math.isfinite(high) and low < high and (scale == "linear" or low > 0.0)):
        above = " above 0" if scale == "log" else ""
        raise ArgumentError(f"plot: the colours would span {low:g} to {high:g}; give finite vmin < vmax{above}.")
    return LogNorm(low, high) if scale == "log" else Normalize(low, high)


def signed_normalisation(data: Array, least: float) -> Normalize:
    """Symmetric about 0, to the 99th percentile of the sizes, or to `least` if all of them are 0.

    Examples
    --------
    >>> signed_normalisation(np.array([-3.0, 3.0]), 1.0).vmin, signed_normalisation(np.zeros(2), 1.0).vmax
    (-3.0, 1.0)
    """
    from matplotlib.colors import Normalize

    sizes = np.abs(data[np.isfinite(data)])
    end = float(np.percentile(sizes, 99)) if sizes.size else 0.0
    end = end if end > 0.0 else float(sizes.max(initial=0.0)) or least
    return Normalize(-end, end)
