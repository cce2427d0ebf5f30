"""Sources that look aside have the field of the upright ones, turned."""

from __future__ import annotations

import etendue as et
import numpy as np
import pytest
from oracles.sources import PrismaticFilm

TOWARDS = (0.5, -0.3, -0.6)
TURN = np.array([0.3, 0.5, 0.0]), float(np.degrees(np.arctan2(np.hypot(0.5, 0.3), -0.6)))
"""About ẑ × TOWARDS, by the angle between them."""
DISK = {"radius": 11.2, "centre": (0.9, -0.5)}


def there(vector: np.ndarray) -> np.ndarray:
    """A vector that is turned as the source is."""
    return et.RaySet([vector], [vector], [1.0]).rotated(*TURN).position[0]


@pytest.mark.slow
@pytest.mark.parametrize("found", [False, True])
def test_the_field_of_turned_rays_is_the_turned_field(found: bool) -> None:
    """A film without symmetry, and its rays turned to (0.5, −0.3, −0.6): counts, and with them fields, are the same.

    Luminance along lines, all flux, and maps of an observer who turns with it are equal to rounding on a stated disk; on one
    that is found, as far as a direction of six digits and a radius from turned rays lets them.
    """
    truth = PrismaticFilm()
    position, direction = truth.rays(20_000, seed=5)
    rays = et.RaySet(position, direction, np.full(20_000, truth.total_flux / 20_000))
    turned = rays.rotated(*TURN)
    upright = et.LightField.fit(rays, "auto" if found else et.Disk(**DISK))
    aside = et.LightField.fit(turned, "auto" if found else et.Disk(**DISK, towards=TOWARDS))
    assert isinstance(aside.surface, et.Disk)
    assert aside.surface.towards is not None
    unit = np.array(TOWARDS) / np.linalg.norm(TOWARDS)
    np.testing.assert_allclose(aside.surface.parts()[0].axes[2], unit, atol=2e-6)
    near = 1e-3 if found else 1e-12
    lines = slice(0, 2000)
    here = upright.core.luminance(position[lines], direction[lines])[0]
    same = aside.core.luminance(turned.position[lines], turned.direction[lines])[0]
    assert (here > 0.0).mean() > 0.99
    assert np.quantile(np.abs(same - here) / here, 0.98) < near
    assert aside.total_flux == pytest.approx(upright.total_flux, rel=1e-12)
    eye, screen = et.Observer(20, 30, 300), et.Screen(26, 26, 24, 24)
    x, y, z = there(eye.position)
    along, up = np.degrees(np.arctan2(y, x)), there(screen.axes(eye)[1])
    who = et.Observer(float(np.degrees(np.arccos(z / 300))), float(along), 300, up=tuple(up.tolist()))
    first, second = (et.luminance_map(field, o, screen) for field, o in ((upright, eye), (aside, who)))
    assert (first.values > 0.0).mean() > 0.3
    off = np.abs(second.values - first.values)
    assert np.quantile(off, 0.98) < near * first.values.max()
    # Pixels at the edge of a disk that is found notice its last digits: there are more points for one and not the other, and
    # what they tell of an edge is in the errors.
    stated = np.hypot(first.standard_error, second.standard_error)
    assert (off <= (stated if found else near * first.values.max())).all()
