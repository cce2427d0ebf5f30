"""A scene whose light image and whose lines of sight must agree, whatever its surfaces are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import etendue as et
import numpy as np
from scipy.stats import chi2


def forwards_and_backwards_agree(
    *,
    surfaces: Sequence[Mapping[str, Any]] = (),
    solids: Sequence[Mapping[str, Any]] = (),
    media: Mapping[str, Any] | None = None,
    below: bool = False,
    sharp: float = 0.05,
    lamp: Mapping[str, Any] | None = None,
    rays: int = 200_000,
    lines: int = 4000,
) -> None:
    """χ² of the difference over 16 pixels, at a significance of 1e-4; both are as `sharp` in each pixel, together.

    A small lamp stands above the origin, or below it, and shines on it; the observer looks at the origin from above, at 50°.
    It is a Lambertian disk, or what `lamp` says. `rays` forwards and `lines` of sight per pixel are as many as that takes.
    """
    side = -1 if below else 1
    screen = {"width": 24, "height": 24, "columns": 4, "rows": 4}
    scene = et.Scene(
        sources=[
            {
                **(lamp or {"kind": "surface", "shape": {"kind": "disk", "radius": 1.5}, "flux": 100}),
                "at": [4, 2, 9 * side],
                "toward": [-0.3, -0.1, -side],
            }
        ],
        surfaces=list(surfaces),
        solids=list(solids),
        media=dict(media or {}),
        detectors=[{"kind": "image", "name": "eye", "observer": "o"}],
        observers=[{"name": "o", "theta": 50, "phi": 20, "distance": 400, "screen": screen}],
    )
    forwards = et.trace(scene, rays=rays, seed=3).quantity_of("eye")
    observer, view = et.Observer(theta=50, phi=20, distance=400), et.Screen(24, 24, 4, 4)
    method = et.PathTracing(rays_per_pixel=lines, forward_rays=0, gather=False, seed=4)
    backwards = et.luminance_map(scene, observer, view, method=method)
    assert isinstance(forwards, et.LuminanceMap)
    error = np.hypot(forwards.standard_error, backwards.standard_error)
    z = (forwards.values - backwards.values) / error
    assert np.isfinite(z).all()
    statistic = float(np.sum(z * z))
    assert statistic < chi2.ppf(1.0 - 1e-4, z.size), (statistic, forwards.values, backwards.values)
    least = float((error / backwards.values).max())
    assert least < sharp, least


def two_walls(finish: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A floor below the lamp and a wall beside it, which see each other."""
    square = {"kind": "rectangle", "width": 30, "height": 30}
    return [
        {"shape": square, "finish": finish},
        {"shape": square, "at": [-12, 0, 12], "toward": [1, 0, 0.1], "finish": finish},
    ]
