"""Narrow beams have cells of direction of their own on flat surfaces."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import pytest
from etendue.lightfield.beam_search import with_beam
from etendue.lightfield.etendue_density import PartField
from oracles.light_fields import make_field
from scipy.stats import chi2

MIDDLE, SIDES, CENTRE = (0.21, -0.13), (3.0, 1.8), (0.4, -0.7)
AREA = SIDES[0] * SIDES[1]


def even_disk(count: int, radius: float, random: np.random.Generator) -> np.ndarray:
    """Points of an even disk about the origin."""
    rho, phi = radius * np.sqrt(random.random(count)), 2 * np.pi * random.random(count)
    return np.column_stack([rho * np.cos(phi), rho * np.sin(phi)])


def beam_rays(count: int, sine: float, seed: int, halo: float = 0.0) -> et.RaySet:
    """An even rectangle that shines evenly into a disk of cosines about `MIDDLE`, and with a share into all directions."""
    random = np.random.default_rng(seed)
    place = (random.random((count, 2)) - 0.5) * SIDES + CENTRE
    cosines = even_disk(count, sine, random) + MIDDLE
    wide = random.random(count) < halo
    cosines[wide] = even_disk(int(wide.sum()), 1.0, random)
    up = np.sqrt(1.0 - (cosines**2).sum(axis=1))
    position = np.column_stack([place, np.zeros(count)])
    return et.RaySet(position, np.column_stack([cosines, up]), np.full(count, 60.0 / count))


def directions(cosines: np.ndarray) -> np.ndarray:
    """Unit vectors of direction cosines along X and Y."""
    return np.column_stack([cosines, np.sqrt(1.0 - (cosines**2).sum(axis=1))])


def test_an_even_beam_has_the_flux_and_the_intensity_of_its_etendue() -> None:
    """Of luminance L in the beam alone: Φ = π ρ² A L, I = L A cos θ within it and 0 beside it; what is drawn lies within."""
    beam = (0.2, -0.35, 0.4)
    surface = et.Plane(0.7, *SIDES, CENTRE, beam=beam)
    ones = np.ones((4, 2, 2, 4), dtype=np.float32)
    field = make_field(surface, cells=ones.shape, factors=None)
    lit, dark = PartField(ones, 0.1 * ones, None, None, 2.5), PartField(0 * ones, 0 * ones, None, None, 1.0)
    field = field.replace(parts=(lit, dark))
    assert field.part_flux == pytest.approx([2.5 * math.pi * 0.16 * AREA, 0.0], rel=1e-12)
    random = np.random.default_rng(3)
    k = directions(even_disk(500, 0.999, random))
    inside = np.hypot(k[:, 0] - 0.2, k[:, 1] + 0.35) < 0.4
    found = field.core.intensity(k, 20, 1)
    np.testing.assert_allclose(found, np.where(inside, 2.5 * AREA * k[:, 2], 0.0), rtol=1e-9, atol=1e-12)
    drawn = field.sample(4000, seed=2)
    assert (np.hypot(drawn.direction[:, 0] - 0.2, drawn.direction[:, 1] + 0.35) <= 0.4 + 1e-9).all()
    # Even over the disk: (distance/radius)² is even from 0 to 1, Kolmogorov's test at 10⁻⁴.
    rising = np.sort(((drawn.direction[:, :2] - beam[:2]) ** 2).sum(axis=1) / 0.16)
    off = np.abs(rising - (np.arange(4000) + 0.5) / 4000).max() + 0.5 / 4000
    assert off < math.sqrt(math.log(2 / 1e-4) / 2 / 4000)


def test_each_ray_is_counted_once_whichever_part_takes_it() -> None:
    """The flux of the first part is that of the rays in the disk; all together is all there is."""
    rays = beam_rays(20_000, 0.05, 7, halo=0.3)
    beam = (0.2, -0.1, 0.08)
    field = et.LightField.fit(rays, et.Plane(0.0, *SIDES, CENTRE, (0, 0, 0, 0), beam=beam), depths=(2, 2, 2, 2))
    inside = np.hypot(rays.direction[:, 0] - 0.2, rays.direction[:, 1] + 0.1) <= 0.08
    assert 5.0 < rays.flux[~inside].sum() < 40.0
    assert field.part_flux == pytest.approx([rays.flux[inside].sum(), rays.flux[~inside].sum()], rel=1e-9)


def test_other_directions_keep_no_light_within_the_beam() -> None:
    """The second part alone is dark in the disk, but for cells that its rim passes; in all other directions it is not."""
    rays = beam_rays(20_000, 0.25, 8, halo=0.5)
    field = et.LightField.fit(rays, et.Disk(2.5, 0.0, CENTRE, beam=(0.2, -0.1, 0.3)), depths=(2, 2, 3, 3))
    field = field.replace(
        parts=(PartField(*(np.zeros((1, 1, 1, 1), np.float32),) * 2, None, None, 1.0), field.parts[1])
    )
    k = directions(even_disk(4000, 0.95, np.random.default_rng(4)))
    x = np.tile([*CENTRE, 0.0], (len(k), 1))
    luminance = field.core.luminance(x, k)[0]
    distance = np.hypot(k[:, 0] - 0.2, k[:, 1] + 0.1)
    # Cells of direction are no larger than 1/32 of the square, whose side is 1.77.
    assert not luminance[distance < 0.3 - 0.11].any()
    assert (luminance[distance > 0.3 + 0.11] > 0.0).all()


@pytest.mark.slow
def test_a_narrow_beam_is_found_and_shown_as_sharply_as_the_rays_tell() -> None:
    """Off by less than half of what it is without a beam, and by no more than is stated.

    L = Φ/(π sin² A) in closed form, at even lines in the beam. Errors of lines near each other go together: as if each field
    had eight of its own, the mean square of 16 over the stated one may be `most` by chance (χ², 10⁻⁴).
    """
    sine, ratios, most = 0.03, [], chi2.isf(1e-4, 16) / 16
    truth = 60.0 / (math.pi * sine**2 * AREA)
    random = np.random.default_rng(11)
    k = directions(even_disk(400, 0.8 * sine, random) + MIDDLE)
    x = np.column_stack([(random.random((400, 2)) - 0.5) * 0.8 * SIDES + CENTRE, np.zeros(400)])
    for seed in range(2):
        rays = beam_rays(20_000, sine, seed)
        found = et.LightField.fit(rays, et.Plane(0.0))
        assert found.surface.beam is not None
        assert np.hypot(*(np.array(found.surface.beam[:2]) - MIDDLE)) < 0.15 * sine
        assert sine <= found.surface.beam[2] < 2.5 * sine
        without = et.LightField.fit(rays, dataclasses.replace(found.surface, beam=(0, 0, 1)))
        (off, own), (other, _) = ((v - truth, s) for v, s in (f.core.luminance(x, k) for f in (found, without)))
        assert (off**2).mean() < (other**2).mean() / 4
        ratios.append((off**2).mean() / (own**2).mean())
    assert np.mean(ratios) < most


@pytest.mark.slow
def test_light_without_a_beam_has_none() -> None:
    """Lambert's light, light in all directions, and what is stated to have none."""
    lambertian = et.RingSource(rays=20_000)
    assert with_beam(et.Disk(30), lambertian).beam is None
    narrow = beam_rays(4000, 0.05, 1)
    stated = et.Plane(0.0, *SIDES, CENTRE, beam=(0, 0, 1))
    assert with_beam(stated, narrow) is stated
    assert len(stated.parts()) == 1
    few = beam_rays(1000, 0.05, 1)
    assert with_beam(et.Plane(0.0, *SIDES, CENTRE), few).beam is None
    assert with_beam(et.Disk(2.0, centre=CENTRE), narrow).beam is not None


@pytest.mark.slow
def test_a_symmetric_field_has_a_beam_about_the_normal() -> None:
    """Where a symmetry is stated, the beam has it; a beam that is stated aside is refused."""
    rays = beam_rays(6000, 0.05, 2)
    rays = et.RaySet(rays.position - (*CENTRE, 0), directions(rays.direction[:, :2] - MIDDLE), rays.flux)
    field = et.LightField.fit(rays, et.Plane(0.0, *SIDES, (0, 0)), symmetry="mirror-xy", depths=(2, 2, 2, 2))
    assert field.surface.beam is not None
    assert field.surface.beam[:2] == (0.0, 0.0)
    aside = et.Plane(0.0, *SIDES, (0, 0), beam=(0.01, 0, 0.1))
    with pytest.raises(et.ArgumentError, match="state a beam about the normal"):
        et.LightField.fit(rays, aside, symmetry="mirror-xy", depths=(2, 2, 2, 2))


@pytest.mark.parametrize("beam", [(0.6, 0.5, 0.3), (0, 0, 0), (0, 0, -0.1), (1.0, 0.0, 0.1)])
def test_a_beam_beyond_all_directions_is_refused(beam: tuple[float, float, float]) -> None:
    for kind in (et.Plane, et.Disk):
        with pytest.raises(et.ArgumentError, match="within that of radius 1"):
            kind(beam=beam)


def test_the_resolution_of_a_beam_is_that_of_its_cells() -> None:
    """Cells of direction of a beam of sine ρ about θ are ρ/cos θ times those of all directions."""
    rays = beam_rays(6000, 0.05, 3)
    found = et.LightField.fit(
        rays, et.Plane(0.0, *SIDES, CENTRE, beam=(*MIDDLE, 0.08)), depths=(3, 3, 3, 3)
    ).resolution()
    cosine = math.sqrt(1.0 - MIDDLE[0] ** 2 - MIDDLE[1] ** 2)
    assert found.part == "beam"
    assert found.cell_direction == pytest.approx(math.degrees(math.sqrt(math.pi)) * 0.08 / 8 / cosine, rel=1e-12)
    assert found.direction < 3.0
