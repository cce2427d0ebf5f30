"""Patches as the core takes them: pixels that lines of sight meet, and the tables that are read there."""

from __future__ import annotations

from typing import Any

import numpy as np

from etendue.lightfield.gridded.curved_pixels import CylindricalPixels, SphericalPixels
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.lightfield.gridded.pixels import Pixelation, SquarePixels
from etendue.quantities.patches import Patches


def core_patches(surface: PixelatedSurface, patches: Patches) -> dict[str, Any]:
    """Parts, patches and tables.

    Parameters
    ----------
    surface : PixelatedSurface
        What the patches are pixels of.
    patches : Patches
        In the order of their pixels.

    Returns
    -------
    dict
        Lengths in mm; values with the flux of the tables.

    Examples
    --------
    >>> import etendue as et
    >>> grid = et.GriddedSource.fit(et.RingSource(rays=5000), et.Plane(z=0), 20.0, 2.1)
    >>> record = core_patches(grid.surface, grid.patches)
    >>> record["parts"][0]["cells"]["count"], len(record["steps"]) == len(grid.patches)
    ((4, 4), True)
    """
    weights = np.zeros(len(patches.values))
    for _, chosen, solid_angle in patches.by_grid():
        for i in chosen:
            weights[patches.start[i] : patches.start[i + 1]] = solid_angle
    parts = []
    for offset, pixels in zip(surface.offsets, surface.pixels, strict=False):
        lit = patches.pixel[(patches.pixel >= offset) & (patches.pixel < offset + pixels.count)] - offset
        frame = [*map(float, pixels.part.centre), *np.array(pixels.part.axes, dtype=np.float64).ravel().tolist()]
        parts.append({"frame": frame, "cells": _cells(pixels), "lit": lit.tolist()})
    return {
        "parts": parts,
        "axes": patches.axes.reshape(-1, 9).tolist(),
        "projected_area": patches.projected_area.tolist(),
        "start": patches.start[:-1].tolist(),
        "steps": np.stack([patches.theta_step, patches.phi_step], axis=1).tolist(),
        "values": np.ascontiguousarray(patches.values),
        "weights": weights,
    }


def _cells(pixels: Pixelation) -> dict[str, Any]:
    if isinstance(pixels, SquarePixels):
        first, count = pixels.lattice
        return {
            "kind": "squares",
            "corner": pixels.corner,
            "side": pixels.side,
            "first": tuple(map(float, first)),
            "count": tuple(map(int, count)),
        }
    if isinstance(pixels, SphericalPixels):
        return {"kind": "spherical", "radius": pixels.part.size[0], "parallels": pixels.parallels}
    assert isinstance(pixels, CylindricalPixels)  # noqa: S101 - there are no others
    radius, height = pixels.part.size
    return {"kind": "cylindrical", "radius": radius, "height": height, "columns": pixels.columns, "rows": pixels.rows}
