"""Azimuths of incidence of tables: as many as f between them asks for."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_directions import light_from
from etendue.scatter.turns import MOST, TOLERANCE, turns_of


def brushed(*, sigma: float, aspect: float) -> et.Bsdf:
    """A lobe that stays where it is when the light turns."""
    return et.bsdf.Gaussian(peak=2, sigma=sigma, aspect=aspect)


def off_in_the_middle(*, bsdf: et.Bsdf, low: float, high: float) -> float:
    """By how much of the light f at a middle azimuth is off the mean of both sides: directions at random about β₀."""
    beta = 0.6 * np.random.default_rng(3).uniform(-1.0, 1.0, (20_000, 2))

    def f(turn: float) -> np.ndarray:
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        to = np.column_stack([c * beta[:, 0] - s * beta[:, 1], s * beta[:, 0] + c * beta[:, 1]])
        incident = light_from(30.0, 180.0 + turn)
        to = to - incident[:2]
        inside = np.sum(to * to, axis=1) < 1.0
        up = np.sqrt(np.where(inside, 1.0 - np.sum(to * to, axis=1), 1.0))
        vectors = np.column_stack([to, up])
        vectors[~inside] = (0.0, 0.0, 1.0)
        return np.where(inside, bsdf.evaluate(incident, vectors), 0.0)

    middle = f(0.5 * (low + high))
    return float(np.abs(middle - 0.5 * (f(low) + f(high))).sum() / middle.sum())


@pytest.mark.parametrize(("aspect", "count"), [(1.0, 8), (1.5, 16), pytest.param(3.0, 32, marks=pytest.mark.slow)])
def test_azimuths_are_as_close_as_the_lobe_asks(aspect: float, count: int) -> None:
    """Between those chosen f is off by less than the tolerance; between twice as wide ones by more."""
    bsdf = brushed(sigma=0.08, aspect=aspect)
    found = turns_of(bsdf.evaluate, [10.0, 30.0, 50.0], [False])
    assert len(found.azimuths) == count
    step = 360.0 / count
    assert np.allclose(np.diff(found.azimuths), step)
    assert max(off_in_the_middle(bsdf=bsdf, low=low, high=low + step) for low in found.azimuths) < 1.1 * TOLERANCE
    if count > 8:
        wide = max(off_in_the_middle(bsdf=bsdf, low=low, high=low + 2.0 * step) for low in found.azimuths)
        assert wide > 0.9 * TOLERANCE


def test_a_bound_is_told() -> None:
    """A lobe as long as 20 times its width needs more than there may be."""
    found = turns_of(brushed(sigma=0.05, aspect=20.0).evaluate, [30.0], [False])
    assert len(found.azimuths) == MOST
    assert found.off > TOLERANCE


def test_of_a_table_its_own_azimuths_are_taken() -> None:
    """Azimuths at which it is known come first, whatever they are."""
    found = turns_of(lambda i, s: np.ones(len(s)), [30.0], [False], known=[10.0, 130.0, 250.0])  # noqa: ARG005
    assert found.azimuths == (10.0, 130.0, 250.0)


@pytest.mark.slow
def test_a_brushed_surface_in_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """F at azimuths between those of 45°: within 12 % of the model where it is above a fiftieth of its peak.

    At the one incidence that the file has: what lies between incidences is looked at in test_bsdf_formats.py.
    """
    monkeypatch.setattr("etendue.scatter.files.INCIDENCES", (40.0,))
    bsdf = brushed(sigma=0.1, aspect=3.0)
    path = tmp_path / "brushed.dat"
    lost = et.write_bsdf(path, bsdf, "fred")
    assert not any("azimuths" in one for one in lost)
    back = et.read_bsdf(path)
    ring = np.radians(np.arange(0.0, 360.0, 5.0))
    worst = 1.0
    for turn in (10.0, 22.5, 33.0):
        incident = light_from(40.0, 180.0 + turn)
        beta = -incident[:2] + 0.2 * np.column_stack([np.cos(ring), np.sin(ring)])
        to = np.column_stack([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=1))])
        f, true = back.evaluate(incident, to), bsdf.evaluate(incident, to)
        lit = true > 0.02 * true.max()
        worst = max(worst, float(np.exp(np.abs(np.log(f[lit] / true[lit])).max())))
    assert worst < 1.12
