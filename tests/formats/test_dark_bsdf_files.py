"""Files of dark samples, whose values are noise around next to nothing: values below 0 count, else shares would double."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.formats.bsdf import read_bsdf_data, write_bsdf_data
from etendue.quantities.bsdf_data import BsdfData, BsdfSlice, PolarGrid, light_from

GRID = PolarGrid("normal", np.arange(1.0, 90.0, 4.0), np.arange(0.0, 360.0, 10.0))
DARK, NOISE = 0.002, 0.008


def dark() -> BsdfSlice:
    noisy = DARK + NOISE * np.random.default_rng(5).standard_normal(GRID.shape)
    return BsdfSlice(light_from(30.0, 180.0), noisy, grid=GRID)


def pab(*, one: BsdfSlice) -> bytes:
    """By hand: étendue does not write it."""
    lines = ["#format: theta phi BSDF", "#intheta 30", "#inphi 180", "#upphi 90"]
    for k, phi in enumerate(GRID.azimuth):
        lines += [f"{theta:g} {phi:g} {one.values[k, i]:.9g}" for i, theta in enumerate(GRID.radial)]
    return "\n".join([*lines, ""]).encode()


@pytest.mark.parametrize("form", ["fred", "astm", "bird", "pab"])
def test_noise_around_nothing_keeps_its_mean(form: str, tmp_path: Path) -> None:
    """The share read is that of the values before they were written, within 4 standard errors of the dark level's.

    With values below 0 taken for 0 the mean of the noise alone would be 0.4 of its deviation, and the share 2.2 times.
    """
    one, path = dark(), tmp_path / "x.dat"
    if form == "pab":
        path.write_bytes(pab(one=one))
    else:
        write_bsdf_data(path, BsdfData((one,)), form)
    data = read_bsdf_data(path)
    (back,) = data.slices
    share = float(np.sum(back.values * np.sin(np.radians(2.0 * GRID.radial))))
    share *= np.radians(4.0) * np.radians(10.0) / 2.0
    weights = np.broadcast_to(np.sin(np.radians(2.0 * GRID.radial)), GRID.shape)
    spread = NOISE * float(np.sqrt(np.sum(weights**2))) * np.radians(4.0) * np.radians(10.0) / 2.0
    assert abs(share - np.pi * DARK) < 4.0 * spread
    assert back.integral() == pytest.approx(one.integral(), rel=1e-5)
    assert float(et.read_bsdf(path).reflectance(30.0)) == pytest.approx(one.integral(), rel=1e-5)
    count = int((one.values < 0.0).sum())
    assert any(told.found.startswith(f"{count} of {one.values.size} below 0") for told in data.complaints)


def test_mean_of_polarisations_counts_what_is_below_zero(tmp_path: Path) -> None:
    """0.03 and −0.01 are 0.01 and not 0.015."""
    path = tmp_path / "x.astm"
    rows = [f"0.5,0,{theta},{phi},{f}" for theta in (0.2, 0.9) for phi in (0.1, 1.1) for f in (0.03, -0.01)]
    path.write_text("\n".join([f"NUM_POINTS {len(rows)}", "VARS theta_i,phi_i,theta_s,phi_s,BSDF", *rows, ""]))
    (one,) = read_bsdf_data(path).slices
    np.testing.assert_allclose(one.values, 0.01, rtol=1e-9)
