"""Files of dark samples, whose values are noise around next to nothing: values below 0 count, else shares would double."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.formats.bsdf import read_bsdf_data, write_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

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


@pytest.mark.slow
@pytest.mark.parametrize(
    "form", ["zemax", "lighttools", "speos", "speos-brdf", "ssdd", "klems", "tensor-tree", "tracepro"]
)
def test_noise_around_nothing_in_tables_of_other_programs(form: str, tmp_path: Path) -> None:
    """Values of noise of four times the dark level come back as they were, and the table has their share.

    Over all slices the shares are right within 4 standard errors of their mean; with values below 0 taken for 0 they would
    be about 2.2 times as large (of `speos-brdf`, which states each share, as large, but in other directions).
    """
    clean, path = tmp_path / f"clean.{form}", tmp_path / f"noisy.{form}"
    et.write_bsdf(clean, et.bsdf.Lambertian(reflectance=np.pi * DARK), format=form)
    data, rng = read_bsdf_data(clean), np.random.default_rng(5)
    noisy = [
        dataclasses.replace(one, values=one.values + NOISE * rng.standard_normal(one.values.shape), stated=None)
        for one in data.slices
    ]
    write_bsdf_data(path, dataclasses.replace(data, slices=tuple(noisy)), form)
    back = read_bsdf_data(path)
    for one, again in zip(noisy, back.slices, strict=True):
        np.testing.assert_allclose(again.values, one.values, rtol=1e-5, atol=1e-7)
    shares = np.array([one.integral() for one in back.slices])
    assert abs(shares.mean() - np.pi * DARK) < 4.0 * shares.std() / np.sqrt(shares.size - 1)
    lifted = [dataclasses.replace(one, values=np.maximum(one.values, 0.0)).integral() for one in noisy]
    assert np.mean(lifted) > 1.9 * shares.mean()
    assert any("below 0, down to -0.0" in told.found for told in back.complaints)
    lit = next(one for one in back.slices if one.front)
    found = et.read_bsdf(path).reflectance(lit.theta, phi=0.0 if back.isotropic else lit.phi)
    assert float(found) == pytest.approx(lit.integral(), rel=1e-4)


def test_specular_shares_below_zero_are_none(tmp_path: Path) -> None:
    """A mirror that takes light away is no finish: 0 stands for −0.02, and the text tells how much light that adds."""
    path = tmp_path / "x.ssdd"
    head = "VERSION 0.2\nDATA_TYPE specular_reflectance\nCOLOR_MODEL monochrome\nPARAM0_LIST 0 30 60\nDATA ascii\n"
    path.write_text(f"{head}0.04\n-0.02\n0.1\n")
    (told,) = read_bsdf_data(path).complaints
    assert told.found == "1 of 3 specular shares are below 0 and became 0, which adds up to 0.02 of the light"
    assert float(et.read_bsdf(path).regular_reflectance(30.0)) == pytest.approx(0.0, abs=1e-12)


def test_mean_of_polarisations_counts_what_is_below_zero(tmp_path: Path) -> None:
    """0.03 and −0.01 are 0.01 and not 0.015."""
    path = tmp_path / "x.astm"
    rows = [f"0.5,0,{theta},{phi},{f}" for theta in (0.2, 0.9) for phi in (0.1, 1.1) for f in (0.03, -0.01)]
    path.write_text("\n".join([f"NUM_POINTS {len(rows)}", "VARS theta_i,phi_i,theta_s,phi_s,BSDF", *rows, ""]))
    (one,) = read_bsdf_data(path).slices
    np.testing.assert_allclose(one.values, 0.01, rtol=1e-9)
