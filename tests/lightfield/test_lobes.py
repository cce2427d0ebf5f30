"""Smooth lobes of direction: their tops are as bright as they are, which trees by themselves make too dark."""

from __future__ import annotations

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.lightfield.candidate import images_of
from etendue.lightfield.counting import PartCounts, Sums, count_rays
from etendue.lightfield.counting import PartGrids as Grids

Array = npt.NDArray[np.float64]

AXIS = np.array([0.3, -0.2, 0.933]) / np.linalg.norm([0.3, -0.2, 0.933])
WIDTH, HEIGHT = 3.0, 1.0
SURFACE = et.Plane(z=0, width=WIDTH, height=HEIGHT, centre=(0, 0), focus=(0, 0, 0, 0))


def lobe(n: int, kappa: float, seed: int) -> et.RaySet:
    """An even rectangle whose intensity is a von Mises-Fisher lobe about an oblique axis, cut at the horizon; 100 lm."""
    rng = np.random.default_rng(seed)
    across = np.cross(AXIS, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(AXIS, [1.0, 0.0, 0.0]))
    u, turn = rng.random(2 * n), 2 * np.pi * rng.random(2 * n)
    w = 1 + np.log(u + (1 - u) * np.exp(-2 * kappa)) / kappa
    s = np.sqrt(1 - w * w)
    k = w[:, None] * AXIS + (s * np.cos(turn))[:, None] * across + (s * np.sin(turn))[:, None] * np.cross(AXIS, across)
    k = k[k[:, 2] > 0][:n]
    x = np.column_stack([rng.uniform(-WIDTH / 2, WIDTH / 2, n), rng.uniform(-HEIGHT / 2, HEIGHT / 2, n), np.zeros(n)])
    return et.RaySet(x, k, np.full(n, 100.0 / n))


def top(kappa: float) -> float:
    """Luminance along the axis [cd/m²]: Φ p(k)/(A cos θ), p normalised over the hemisphere by quadrature."""
    z, turn = ((np.arange(m) + 0.5) / m for m in (1000, 1000))
    s = np.sqrt(1 - z**2)[:, None]
    along = s * (np.cos(2 * np.pi * turn) * AXIS[0] + np.sin(2 * np.pi * turn) * AXIS[1]) + z[:, None] * AXIS[2]
    norm = 2 * np.pi * np.exp(kappa * (along - 1)).mean()
    return 100e6 / (WIDTH * HEIGHT * norm * AXIS[2])


@pytest.mark.slow
def test_tops_of_lobes_are_as_bright_as_they_are() -> None:
    """The mean of six fits agrees with the closed form; by trees alone it is 0.939 ± 0.012."""
    kappa = 5.0
    fields = (et.LightField.fit(lobe(6000, kappa, seed), SURFACE) for seed in range(6))
    ratios = [float(field.luminance(np.zeros((1, 3)), AXIS[None])[0][0]) / top(kappa) for field in fields]
    mean, error = np.mean(ratios), np.std(ratios, ddof=1) / np.sqrt(len(ratios))
    assert error < 0.02
    assert abs(mean - 1.0) < 3 * error, f"{mean:.3f} ± {error:.3f}"


def test_what_is_put_back_is_smooth_and_keeps_the_light() -> None:
    """The image is brighter at its top and darker where the lobe ends, with the same mean and nothing below its floor."""
    counts = count_rays(lobe(20_000, 8.0, 1), SURFACE, (Grids((2, 2, 2, 2), (6, 7)),), seed=1)["all"][0]
    chart = SURFACE.parts()[0]
    flat, found = (images_of(counts, chart, 1, unflattened=on).densities()[1] for on in (False, True))
    assert found.mean() == pytest.approx(1.0, rel=1e-12)
    assert found.min() > 5e-4
    brightest = np.argsort(flat, axis=None)[-100:]
    assert 1.01 < found.ravel()[brightest].mean() / flat.ravel()[brightest].mean() < 1.1
    ratio = np.log(found / flat)
    assert np.abs(np.diff(ratio, axis=0)).max() < 0.05


def test_even_light_stays_even() -> None:
    """Without a lobe nothing is put back."""
    even = Sums(np.full((64, 64), 5.0), None)
    chart = SURFACE.parts()[0]
    image = images_of(PartCounts(even, even, even), chart, 1).densities()[1]
    assert image == pytest.approx(np.ones((64, 64)), rel=1e-6)
