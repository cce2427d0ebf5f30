"""The luminaire of section 5.6: its maps against sums over directions, and what the instrument takes from them."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from types import ModuleType

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from oracles.parabola import luminance
from oracles.verdicts import REVERSE, assert_agree, assert_differ

Array = npt.NDArray[np.float64]
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FWHM, PIXELS, LINES = 0.6, 40, 256


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("experiments.luminaire")


def by_sums(
    *, model: ModuleType, lmap: et.LuminanceMap, pixels: list[tuple[int, int]], lobe: object, reach: float
) -> Array:
    """Means of pixels from nine points of each, the midpoints of its ninths."""
    pitch = lmap.screen.width / lmap.screen.columns
    off = np.array([-1.0, 0.0, 1.0]) * pitch / 3
    sizes = {"side": model.SIDE, "focus": model.FOCUS, "radius": model.RADIUS, "distance": model.DISTANCE}
    light = {"reflectance": model.REFLECTANCE, "flux": model.FLUX}
    found = []
    for row, column in pixels:
        x, y = float(lmap.screen.x[column]), float(lmap.screen.y[row])
        points = [(x + u, y + v) for u in off for v in off]
        values = [luminance(x=u, y=v, lobe=lobe, reach=reach, **sizes, **light) for u, v in points]  # type: ignore[arg-type]
        found.append(float(np.mean(values)))
    return np.array(found)


@pytest.mark.slow
def test_maps_of_the_luminaire(model: ModuleType) -> None:
    """Every seventh lit pixel within the opening, with the diffuser and with its scan; the two are told apart (χ²)."""
    sample = model.holographic(FWHM)
    scan = et.ScatterGoniometer().measure(sample, span=5, method="quadrature")
    sigma = math.sin(math.radians(FWHM / 2)) / math.sqrt(2 * math.log(2))

    def true(angle: Array) -> Array:
        top = model.TRANSMITTANCE / (2 * math.pi * sigma**2)
        return np.asarray(top * np.exp(-(np.sin(angle) ** 2) / (2 * sigma**2)))

    def measured(angle: Array) -> Array:
        return np.interp(np.degrees(angle), scan.angle, scan.bsdf)

    expected = []
    for diffuser, lobe, reach in ((sample, true, 5.5 * sigma), (et.revolved(scan), measured, math.radians(2.2))):
        lmap = model.look(diffuser, PIXELS, LINES)
        distance = np.hypot(lmap.screen.x[None, :], lmap.screen.y[:, None])
        rows, columns = np.nonzero((distance > 5.0) & (distance < model.RADIUS - 0.4))
        pixels = list(zip(rows[::7].tolist(), columns[::7].tolist(), strict=True))
        values = by_sums(model=model, lmap=lmap, pixels=pixels, lobe=lobe, reach=reach)
        at = tuple(np.array(pixels).T)
        assert_agree(values=lmap.values[at], expected=values, standard_error=lmap.standard_error[at], degrees=REVERSE)
        expected.append((values, lmap.standard_error[at]))
    assert_differ(values=expected[0][0], other=expected[1][0], standard_error=expected[1][1])


@pytest.mark.slow
def test_what_the_instrument_takes_and_deconvolution_gives_back(model: ModuleType) -> None:
    """L_H is 9 % low on average, as in the thesis; L_W is the truth within the error of the scan and of the lines of sight.

    That error comes from maps with lobes of scans that noise might have made as well (see the example).
    """
    example = importlib.import_module("chapter_5_luminaire")
    measured = example.measure(6)
    raw, ours, truth = (
        model.look(one, PIXELS, LINES) for one in (measured.raw, measured.ours, model.holographic(FWHM))
    )
    spread = example.band(measured, PIXELS, LINES)
    chance = math.hypot(example.sampling_error(ours)[0], example.sampling_error(truth)[0])
    error = math.hypot(chance, spread.mean)
    assert error < 0.005 * truth.values.mean()
    assert abs(ours.values.mean() - truth.values.mean()) < 3.0 * error
    assert raw.values.mean() / truth.values.mean() == pytest.approx(0.91, abs=0.01)
    assert truth.values.mean() - raw.values.mean() > 10.0 * error
