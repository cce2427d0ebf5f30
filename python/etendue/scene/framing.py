"""A screen on which all of a scene is seen."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.observer import Observer, Screen
from etendue.scene.compiling import Compiled
from etendue.scene.extents import box_of

Array = npt.NDArray[np.float64]

MARGIN = 1.02
"""How much larger than what is seen the screen is."""


def framed_screen(compiled: Compiled, observer: Observer, columns: int = 128, rows: int = 128) -> Screen:
    """The smallest screen of square pixels, about the observer's target, on which all faces of a scene are seen.

    Faces without end do not count; of a scene without faces, its emitting surfaces do.

    Parameters
    ----------
    compiled : Compiled
        What `compile_scene` makes of a scene.
    observer : Observer
        Who looks; the screen stands at his target, at right angles to his line of sight.
    columns, rows : int
        Pixels.

    Raises
    ------
    ArgumentError
        If nothing in the scene has an end, or a part of it reaches as far as the observer.

    Examples
    --------
    >>> import etendue as et
    >>> ball = et.Scene(solids=[{"shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [1, 0, 0]}])
    >>> framed_screen(et.scene.compile_scene(ball), et.Observer(0, 0, 1000), 64, 32).height  # doctest: +ELLIPSIS
    6.138415...
    """
    screen = Screen(1.0, 1.0, columns, rows)
    right, up, normal = screen.axes(observer)
    target = np.array(observer.target)
    away = float(np.linalg.norm(observer.position - target))
    reach = np.zeros(2)
    for corners in finite_boxes(compiled.record["faces"]) or finite_boxes(compiled.record["sources"]):
        depth = (corners - target) @ normal
        if (depth >= away).any():
            raise ArgumentError(
                f"a part of the scene reaches as far as the observer, {away:g} mm away; state the screen's size."
            )
        seen = (corners - target) @ np.array([right, up]).T * (away / (away - depth))[:, None]
        reach = np.maximum(reach, np.abs(seen).max(axis=0))
    side = 2.0 * MARGIN * float((reach / [columns, rows]).max())
    if side == 0.0:
        raise ArgumentError("nothing in the scene has an end; state the screen's size.")
    return Screen(side * columns, side * rows, columns, rows)


def corners_of(compiled: Compiled) -> Array:
    """Corners of the boxes around all that has an end [mm], shape (n, 3); of a scene without faces, of its sources.

    Examples
    --------
    >>> import etendue as et
    >>> ball = et.Scene(solids=[{"shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [1, 0, 0]}])
    >>> corners_of(et.scene.compile_scene(ball)).max(axis=0).tolist()
    [4.0, 3.0, 3.0]
    """
    record = compiled.record
    return np.concatenate([np.zeros((0, 3)), *(finite_boxes(record["faces"]) or finite_boxes(record["sources"]))])


def finite_boxes(things: Sequence[dict[str, Any]]) -> list[Array]:
    """The corners in the world of the boxes around those faces or sources that have an end, shape (8, 3) each [mm].

    Parameters
    ----------
    things : sequence of records
        ``compiled.record["faces"]`` or ``["sources"]``.

    Examples
    --------
    >>> import etendue as et
    >>> ball = et.Scene(solids=[{"shape": {"kind": "ball", "radius": 3}, "medium": "BK7", "at": [1, 0, 0]}])
    >>> (corners,) = finite_boxes(et.scene.compile_scene(ball).record["faces"])
    >>> corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    ([-2.0, -3.0, -3.0], [4.0, 3.0, 3.0])
    """
    found = []
    for thing in things:
        if "shape" not in thing or not np.isfinite(box := box_of(thing["shape"])).all():
            continue
        origin, x, y, z = np.array(thing["frame"]).reshape(4, 3)
        corners = np.array(list(itertools.product(*box.T)))
        found.append(origin + corners @ np.array([x, y, z]))
    return found
