"""TracePro's scatter by formulas, with directions built by hand: values, shares by quadrature, sides, what is refused."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf import read_bsdf_data
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice
from oracles import tracepro_files as by_hand
from oracles.tracepro_files import Function, Row, abg_side, row, section, surface_property

Array = npt.NDArray[np.float64]

THETA = (0.0, 30.0, 60.0)


def read(path: Path, text: str) -> BsdfData:
    path = path / "property.txt"
    path.write_text(text)
    return read_bsdf_data(path)


def floating(scatter: int, f: Function, numbers: Row, *, table: Sequence[Row] = (), way: str = "reflected") -> str:
    """A property with one azimuth of incidence, whose shares are those of f."""
    rows = [
        row(theta=t, left=by_hand.share(f=f, beta0=by_hand.floating(theta=t)), **{way: numbers})  # type: ignore[arg-type]
        for t in THETA
    ]
    return surface_property(scatter=scatter, sections=[section(rows=rows, table=table)])


def fixed(scatter: int, f: Function, numbers: Row, *, table: Sequence[Row] = ()) -> str:
    """A property with two azimuths of incidence."""
    rows = [
        row(theta=t, phi=p, left=by_hand.share(f=f, beta0=by_hand.fixed(theta=t, phi=p)), reflected=numbers)
        for t in THETA
        for p in (0.0, 90.0)
    ]
    return surface_property(scatter=scatter, sections=[section(rows=rows, table=table)])


def scattered(one: BsdfSlice, *, x: Array, y: Array, axis: tuple[float, float]) -> tuple[Array, Array]:
    """Directions at x along an axis and y at 90° from it, counter-clockwise; and which of them there are."""
    beta = -one.incident[:2] + np.multiply.outer(x, axis) + np.multiply.outer(y, [-axis[1], axis[0]])
    height = 1.0 - np.sum(beta * beta, axis=-1)
    up = 1.0 if (one.incident[2] > 0.0) != one.transmitted else -1.0
    return np.concatenate([beta, up * np.sqrt(np.maximum(height, 0.0))[..., None]], axis=-1), height > 0.02


def agrees(
    one: BsdfSlice, f: Function, *, axis: tuple[float, float], spread: tuple[float, float], within: float
) -> None:
    """F of a slice at directions about the specular one, and its share, are those of a function."""
    rng = np.random.default_rng(11)
    x, y = rng.normal(size=(2, 500)) * np.array(spread)[:, None]
    to, there = scattered(one, x=x, y=y, axis=axis)
    wanted = f(x, y)[there]
    assert there.sum() > 100
    assert np.abs(one.at(to[there]) - wanted).max() < within * wanted.max()
    beta0 = -one.incident[:2]
    along = float(beta0 @ axis), float(beta0 @ [-axis[1], axis[0]])
    assert one.integral() == pytest.approx(by_hand.share(f=f, beta0=along), rel=0.01)


RIGHT = (0.0, -1.0)
"""The local x axis of light that goes on towards +x, seen from above: it stands on the right."""


KINDS = {
    "elliptical ABg": (2, by_hand.ellipse(peak=0.5, b=(0.1, 0.3), g=(1.5, 1.2)), (0.05, 0.1, 0.3, 1.5, 1.2), "A is A along"),
    "elliptical ABg by its peak": (
        2, by_hand.ellipse(peak=0.5, b=(0.1, 0.3), g=(1.5, 1.2)), (0.5, 0.1, 0.3, 1.5, 1.2), "A is the peak",
    ),
    "elliptical Gaussian": (3, by_hand.gaussian(peak=2, s=(0.4, 0.2)), (2, 0.4, 0.2, 0, 0), "B and By are half widths"),
    "elliptical Gaussian in g": (3, by_hand.gaussian(peak=2, s=(0.4, 0.2)), (2, 0, 0, 0.4, 0.2), "g and gy are half widths"),
    "1D ABg": (6, by_hand.streak(a=0.05, b=0.1, g=1.5, sigma=0.1), (0.05, 0.1, 0.1, 1.5, 0), "By is the width"),
    "1D ABg, width at 1/e²": (
        6, by_hand.streak(a=0.05, b=0.1, g=1.5, sigma=0.1), (0.05, 0.1, 0, 1.5, 0.2), "gy is the width.*half width at 1/e²",
    ),
    "1D ABg, integral 1": (
        6, by_hand.streak(a=0.05, b=0.1, g=1.5, sigma=0.1),
        (0.05 * 0.1 * math.sqrt(2 * math.pi), 0.1, 0.1, 1.5, 0), "integral 1",
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "way"),
    [*((kind, "reflected") for kind in KINDS), ("elliptical ABg", "transmitted"), ("1D ABg", "transmitted")],
)
def test_formulas_about_the_floating_axis(tmp_path: Path, kind: str, way: str) -> None:
    """The closed form with x on the right of the light, y forwards; which column is what the shares tell."""
    scatter, f, numbers, said = KINDS[kind]
    data = read(tmp_path, floating(scatter, f, numbers, way=way))
    assert data.isotropic
    assert data.mirrored
    assert any(re.search(said, one.found) for one in data.complaints if one.severity == "note")
    assert {round(one.theta, 6) for one in data.slices} >= {0.0, 30.0, 60.0, 85.0}
    for one in data.slices:
        assert one.transmitted is (way == "transmitted")
        if round(one.theta, 6) in THETA[1:]:
            agrees(one, f, axis=RIGHT, spread=(0.15, 0.15), within=0.015)


@pytest.mark.slow
def test_the_floating_axis_at_normal_incidence(tmp_path: Path) -> None:
    """The slice stands for light from any azimuth, a little off the normal: x is on the right of that light."""
    scatter, f, numbers, _ = KINDS["elliptical Gaussian"]
    data = read(tmp_path, floating(scatter, f, numbers))
    bsdf = et.BsdfTable(data)
    for phi in (0.0, 130.0):
        t, p = math.radians(0.01), math.radians(phi)
        incident = np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])
        forwards = -np.array([math.cos(p), math.sin(p)])
        right = np.array([forwards[1], -forwards[0]])
        for x, y in ((0.2, 0.0), (0.0, 0.2), (-0.2, 0.05)):
            beta = x * right + y * forwards
            to = [*beta, math.sqrt(1.0 - beta @ beta)]
            assert float(bsdf.evaluate(incident, to)) == pytest.approx(float(f(np.array(x), np.array(y))), abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["elliptical ABg", "1D ABg"])
def test_formulas_about_the_axis_of_the_sample(tmp_path: Path, kind: str) -> None:
    scatter, f, numbers, _ = KINDS[kind]
    data = read(tmp_path, fixed(scatter, f, numbers))
    assert not data.isotropic
    assert data.facts["zero of azimuth"] == "axis of the sample"
    turns = {round(one.phi, 3) for one in data.slices if one.theta > 1.0}
    assert len(turns) == 36
    looked = 0
    for one in data.slices:
        if round(one.theta, 6) in THETA and round(one.phi, 3) in (180.0, 210.0, 270.0, 350.0):
            agrees(one, f, axis=(1.0, 0.0), spread=(0.15, 0.15), within=0.02)
            looked += 1
    assert looked == 9


@pytest.mark.slow
def test_a_streak_about_the_axis_of_the_sample_in_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between azimuths of incidence the streak stays where it is, as well as 10° allow."""
    for angles in ("INCIDENCES", "SPARSE"):  # beside 0, 30 and 60°, which the file has
        monkeypatch.setattr(f"etendue.formats.bsdf.tracepro_models.{angles}", (40.0, 50.0))
    f = by_hand.streak(a=0.05, b=0.1, g=1.5, sigma=0.15)
    bsdf = et.BsdfTable(read(tmp_path, fixed(6, f, (0.05, 0.1, 0.15, 1.5, 0))))
    for theta, phi in ((30.0, 15.0), (45.0, 77.0)):
        beta0 = np.array(by_hand.fixed(theta=theta, phi=phi))
        incident = np.array([*-beta0, math.cos(math.radians(theta))])
        x, y = np.random.default_rng(5).normal(size=(2, 300)) * 0.1
        x, y = x[np.hypot(x, y) < 0.25], y[np.hypot(x, y) < 0.25]
        beta = beta0 + np.stack([x, y], axis=-1)
        to = np.concatenate([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=-1))[:, None]], axis=-1)
        assert np.abs(bsdf.evaluate(incident, to) - f(x, y)).max() < 0.05 * 0.5
        wanted = by_hand.share(f=f, beta0=(float(beta0[0]), float(beta0[1])))
        assert float(bsdf.reflectance(theta, phi + 180.0)) == pytest.approx(wanted, rel=0.02)


@pytest.mark.slow
def test_where_a_model_is_the_same_function_it_is_the_model(tmp_path: Path) -> None:
    """A Gaussian about the axis of the sample, elliptical ABg with g = 1, and ellipses that are circles."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-0.4, 0.4, (2, 50))
    for scatter, f, numbers in (
        (3, by_hand.gaussian(peak=2, s=(0.4, 0.1)), (2, 0.4, 0.1, 0, 0)),
        (2, by_hand.ellipse(peak=0.5, b=(0.1, 0.3), g=(1, 1)), (0.05, 0.1, 0.3, 1, 1)),
    ):
        data = read(tmp_path, fixed(scatter, f, numbers))
        assert data.slices == ()
        assert not data.isotropic
        bsdf = et.BsdfTable(data)
        for phi in (0.0, 40.0):
            beta0 = np.array(by_hand.fixed(theta=20.0, phi=phi))
            beta = beta0 + np.stack([x, y], axis=-1)
            to = np.concatenate([beta, np.sqrt(1.0 - np.sum(beta * beta, axis=-1))[:, None]], axis=-1)
            found = bsdf.evaluate([*-beta0, math.cos(math.radians(20.0))], to)
            assert np.allclose(found, f(x, y), rtol=1e-12)
    circle = by_hand.ellipse(peak=0.5, b=(0.1, 0.1), g=(1.7, 1.7))
    (component,) = read(tmp_path, floating(2, circle, (0.05, 0.1, 0.1, 1.7, 1.7))).components
    assert dict(component) == pytest.approx({"kind": "abg", "a": 0.05, "b": 0.1, "g": 1.7, "way": "reflected"})


BETA = (-0.6, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5)
PROFILE = (0.0, 0.4, 0.1, 1.0, 0.3, 0.6, 0.0)


def profile_rows(*, phis: tuple[float, ...] = (0.0,), values: Sequence[float] = PROFILE) -> list[Row]:
    return [[300, 0.55, t, p, b, 0, v, 0] for t in THETA for p in phis for b, v in zip(BETA, values, strict=True)]


@pytest.mark.parametrize(("numbers", "said"), [((0, 0, 0.1, 0, 0), "By is"), ((0, 0, 0, 0, 0.1), "gy is")])
def test_a_one_dimensional_table_knows_its_sign(tmp_path: Path, numbers: Row, said: str) -> None:
    """Values on the right of the light are those of positive x; a mirrored or turned axis would be seen."""
    f = by_hand.listed(beta=BETA, values=PROFILE, sigma=0.1)
    data = read(tmp_path, floating(7, f, numbers, table=profile_rows()))
    assert data.isotropic
    assert not data.mirrored
    assert any(said in complaint.found for complaint in data.complaints)
    for one in data.slices:
        if round(one.theta, 6) in THETA[1:]:
            agrees(one, f, axis=RIGHT, spread=(0.3, 0.05), within=0.03)
            beyond = scattered(one, x=np.array([0.3, -0.3]), y=np.zeros(2), axis=RIGHT)[0]
            assert one.at(beyond) == pytest.approx([0.6, 0.4], rel=0.01)


def test_a_one_dimensional_table_about_the_axis_of_the_sample(tmp_path: Path) -> None:
    f = by_hand.listed(beta=BETA, values=PROFILE, sigma=0.1)
    data = read(tmp_path, fixed(7, f, (0, 0, 0.1, 0, 0), table=profile_rows(phis=(0.0, 90.0))))
    for one in data.slices:
        if round(one.theta, 6) in THETA and round(one.phi) in (180, 220, 270):
            at = scattered(one, x=np.array([0.3, -0.3]), y=np.zeros(2), axis=(1.0, 0.0))[0][:, :]
            there = np.hypot(at[:, 0], at[:, 1]) < 1.0
            assert one.at(at[there]) == pytest.approx(np.array([0.6, 0.4])[there], rel=0.03)


@pytest.mark.slow
def test_numbers_that_change_with_angle_and_wavelength(tmp_path: Path) -> None:
    """TIS of ABg (0.1, 0.01, 1.5) is 0.935524, 0.872527 and 0.690449 at 0, 30 and 60°: times the A of each row."""
    tis = {0.0: 0.935524, 30.0: 0.872527, 60.0: 0.690449}
    parts = {0.45: {0.0: 0.2, 30.0: 0.5, 60.0: 1.0}, 0.65: {0.0: 0.4, 30.0: 0.6, 60.0: 0.8}}
    rows = [
        row(theta=t, left=part * tis[t], reflected=(0.1 * part, 0.01, 0, 1.5, 0), micrometres=um, mirrored=0.01)
        for um, known in parts.items()
        for t, part in known.items()
    ]
    data = read(tmp_path, surface_property(scatter=1, sections=[section(rows=rows)]))
    assert data.isotropic
    assert data.wavelengths == pytest.approx((450.0, 650.0))
    for one in data.slices:
        assert one.wavelength is not None
        t = round(one.theta, 6)
        if t in tis:
            part = parts[round(one.wavelength) / 1e3][t]
            assert one.integral() == pytest.approx(part * tis[t], rel=2e-3)
            x, y = np.array([0.0, 0.1, -0.05]), np.array([0.0, 0.05, 0.2])
            to = scattered(one, x=x, y=y, axis=RIGHT)[0]
            assert one.at(to) == pytest.approx(0.1 * part / (0.01 + np.hypot(x, y) ** 1.5), rel=2e-3)
        if t == 40.0 and round(one.wavelength) == 450:
            # Numbers are linear between angles.
            ahead = scattered(one, x=np.zeros(1), y=np.array([0.1]), axis=RIGHT)[0]
            part = 0.5 + (1.0 - 0.5) * 10.0 / 30.0
            assert one.at(ahead) == pytest.approx(0.1 * part / (0.01 + 0.1**1.5), rel=2e-3)
    bsdf = et.BsdfTable(data)
    assert bsdf.reflectance([0, 30, 60], wavelength=450.0) == pytest.approx(
        [0.01 + part * tis[t] for t, part in parts[0.45].items()], rel=4e-3
    )
    assert float(bsdf.reflectance(30, wavelength=550.0)) == pytest.approx(0.01 + 0.55 * tis[30.0], rel=4e-3)


def test_numbers_that_change_with_the_azimuth_of_incidence(tmp_path: Path) -> None:
    a = {0.0: 0.02, 90.0: 0.05}
    rows = [row(theta=0, left=0.1, reflected=(0.03, 0.1, 0, 2, 0))]
    rows += [row(theta=40, phi=p, left=0.1, reflected=(value, 0.1, 0, 2, 0)) for p, value in a.items()]
    data = read(tmp_path, surface_property(scatter=1, sections=[section(rows=rows)], coating=4))
    assert not data.isotropic
    assert {round(one.phi, 6) for one in data.slices if round(one.theta) == 40} == {180.0, 270.0}
    for one in data.slices:
        wanted = 0.3 if one.theta < 1.0 else 10.0 * a[round(one.phi - 180.0) % 360]
        if round(one.theta) in (0, 40):
            assert float(one.at(one.incident * [-1, -1, 1])) == pytest.approx(wanted)


def test_a_row_that_scatters_nothing_has_no_widths(tmp_path: Path) -> None:
    """TracePro writes zeros into such rows: between them and the next A falls, and B and g stay."""
    rows = [row(theta=0, left=0.1, reflected=(0.02, 0.1, 0, 2, 0)), row(theta=80, left=0.0)]
    data = read(tmp_path, surface_property(scatter=1, sections=[section(rows=rows)]))
    (half,) = (one for one in data.slices if round(one.theta) == 40)
    x, y = np.array([0.0, 0.2]), np.array([0.0, 0.1])
    assert half.at(scattered(half, x=x, y=y, axis=RIGHT)[0]) == pytest.approx(0.01 / (0.1 + x * x + y * y), rel=1e-3)
    (last,) = (one for one in data.slices if round(one.theta) == 80)
    assert not last.values.any()


def test_a_narrow_streak_keeps_its_light(tmp_path: Path) -> None:
    """Narrower than a step of azimuth far out, it is widened to it: the share of a slice stays that of the formula."""
    sigma, b, g, a = 0.004, 0.05, 1.5, 0.05
    # ∫ ABg over x, times √(2π) σ: the streak is short against the disk's rim along y.
    x = np.geomspace(1e-6, 1.0, 20001)
    along = 2.0 * float(np.trapezoid(a / (b + x**g), x))
    share = along * math.sqrt(2.0 * math.pi) * sigma
    rows = [row(theta=0, left=share, reflected=(a, b, sigma, g, 0))]
    data = read(tmp_path, surface_property(scatter=6, sections=[section(rows=rows)]))
    (normal,) = (one for one in data.slices if one.theta < 1.0)
    assert normal.integral() == pytest.approx(share, rel=0.01)
    # 50 times as narrow, and as bright.
    rows = [row(theta=0, left=share, reflected=(50 * a, b, sigma / 50, g, 0))]
    text = surface_property(scatter=6, sections=[section(rows=rows)])
    with pytest.raises(UnsupportedFormatError, match="a streak with a width of"):
        read(tmp_path, text)


# What is told, and what is refused


def test_what_the_head_says_is_told(tmp_path: Path) -> None:
    # ABg of g = 2 scatters πA ln(1 + 1/B) of light along the normal.
    rows = [row(theta=0, left=0.02 * math.pi * math.log(11.0), reflected=(0.02, 0.1, 0, 2, 0))]
    text = surface_property(scatter=1, sections=[section(rows=rows)], coating=0, polarization=1)
    said = " ".join(str(one) for one in read(tmp_path, text).complaints)
    assert "Fresnel" in said
    assert "line 12: Polarization 1: light is unpolarised here, with the mean of S and P" in said
    quiet = surface_property(scatter=1, sections=[section(rows=rows)])
    assert read(tmp_path, quiet).complaints == ()


def test_shares_that_leave_another_part_for_scatter_are_told(tmp_path: Path) -> None:
    """Of ABg with g = 2 πA ln(1 + 1/B), of an even table π f: held against what the rows leave, and told beside it."""
    rows = [row(theta=0, left=0.1, reflected=(0.02, 0.1, 0, 2, 0))]
    (told,) = read(tmp_path, surface_property(scatter=1, sections=[section(rows=rows)])).complaints
    assert f"leave 0.1 of the light for scatter at 0°, it makes {0.02 * math.pi * math.log(11.0):.4g}" in told.found
    for transmitted, left in ((0.0, 0.3), (0.0, 0.1 * math.pi), (0.02, 0.3)):
        polar = [[300, 0.55, 0, 0, b, a, 0.1, transmitted] for b in (0, 0.5) for a in (0, 120, 240)]
        text = surface_property(scatter=5, sections=[section(rows=[row(theta=0, left=left)], table=polar)])
        data = read(tmp_path, text)
        total = math.pi * (0.1 + transmitted)
        said = [f"leaves {left:.6g} of the light for scatter, the table adds up to {total:.6g}"]
        assert [one.found.partition("shares ")[2] for one in data.complaints] == (said if left == 0.3 else [])
        # What is left is that of both ways together: of either nothing is stated if there is light in both.
        assert [one.stated for one in data.slices] == ([None, None] if transmitted else [pytest.approx(left)])


def test_the_axis_that_the_file_does_not_state_is_told(tmp_path: Path) -> None:
    scatter, f, numbers, _ = KINDS["elliptical Gaussian"]
    said = [str(one) for one in read(tmp_path, floating(scatter, f, numbers)).complaints]
    assert any("does not say whether the axis is that of the sample" in one for one in said)
    assert any("12 angles of incidence from 0 to 85°" in one for one in said)


def test_specular_shares_that_change_with_azimuth_are_told(tmp_path: Path) -> None:
    rows = [row(theta=30, phi=p, left=0.1, mirrored=r) for p, r in ((0, 0.2), (90, 0.4))]
    data = read(tmp_path, surface_property(scatter=0, sections=[section(rows=rows)], coating=4))
    assert data.components[0]["specular_reflectance"] == pytest.approx(0.3)
    assert any("changes with the azimuth of incidence" in str(one) for one in data.complaints)


ABG = [row(theta=0, left=0.1, reflected=(0.02, 0.1, 0, 2, 0))]
TWO = surface_property(scatter=1, sections=[abg_side(a=0.02)] * 2, coating=7)
GAUSSIAN = row(theta=0, left=math.pi * 0.5 * 2 * 0.3 * 0.2, reflected=(2, 0.3, 0.2, 0, 0))


def one_side(scatter: int, rows: Sequence[Row], table: Sequence[Row] = (), **head: int) -> str:
    return surface_property(scatter=scatter, sections=[section(rows=rows, table=table)], **head)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (one_side(1, ABG, interaction=1), "line 11: Interaction 1, a retroreflector"),
        (one_side(8, ABG), "scatter of kind BSDF property"),
        (one_side(1, ABG, coating=2), "a coating of kind stack"),
        (one_side(1, ABG, coating=5), "a coating of kind DLL"),
        (
            one_side(3, [row(theta=0, left=0.5, reflected=(2, 0.3, 0.2, 0, 0))]),
            "agree with no reading: if A is the peak",
        ),
        (one_side(3, [row(theta=0, left=0.0, reflected=(2, 0.3, 0.2, 0, 0))]), "leave nothing for scatter"),
        (one_side(3, [row(theta=0, left=0.2, reflected=(2, 0.3, 0.0, 0, 0))]), "numbers that make no sense"),
        (one_side(3, [[*GAUSSIAN[:12], 2, 0.3, 0.2, 0.2, 0.3, 0, 0, 0, 0, 0]]), "agree with two readings"),
        (one_side(6, [row(theta=0, left=0.2, reflected=(0.05, 0.1, 0, 1.5, 0))]), "numbers that make no sense"),
        (
            one_side(7, [row(theta=0, left=0.2)], [[300, 0.55, 0, 0, b, 0, 0.1, 0] for b in (0, 1)]),
            "values on both sides of 0",
        ),
        (
            one_side(7, [row(theta=0, left=0.2)], [[300, 0.55, 0, 0, b, 5, 0.1, 0] for b in (-1, 1)]),
            "ScatterAzimuth that is not 0",
        ),
        (
            surface_property(
                scatter=1, sections=[abg_side(a=0.02, mirrored=0.3), abg_side(a=0.02, mirrored=0.2)], coating=7
            ),
            "not the same from both sides.*make Refl and Tran of",
        ),
    ],
)
def test_what_is_not_read_is_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UnsupportedFormatError, match=said):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (one_side(1, [row(theta=0, left=0.1, reflected=(0.02, 0, 0, 2, 0))]), "line 17: numbers that make no BSDF"),
        (one_side(1, [row(theta=0, left=0.1, reflected=(1e300, 1e-300, 0, 2, 0))]), "numbers that make no BSDF"),
        (one_side(1, [row(theta=0, left=0.1, reflected=(-0.02, 0.1, 0, 2, 0))]), "below 0"),
        (one_side(1, [row(theta=0, left=0.1, micrometres=0.0)]), "a wavelength that is not more than 0"),
        (one_side(1, ABG, coating=7), "0 sections \\[Side1_Data\\]"),
        (surface_property(scatter=1, sections=[abg_side(a=0.02)] * 2), "though the coating is not direction-sensitive"),
        (TWO.replace("[Side2_Data]", "[Side1_Data]"), "2 sections \\[Side1_Data\\]"),
        (TWO.replace("Side1", "Side3").replace("Side2", "Side1").replace("Side3", "Side2"), "stands in front of"),
        (
            one_side(1, [*ABG, row(theta=0, left=0.1, reflected=(0.03, 0.1, 0, 2, 0))]),
            "0° of incidence is stated twice",
        ),
        (one_side(1, [row(theta=0, left=0.1, phi=500)]), "an azimuth of incidence beyond a turn"),
        (
            one_side(
                5,
                [row(theta=t, left=0.2) for t in (0, 9)],
                [[300, 0.55, t, 0, b, a, 0.1, 0] for t in (0, 9) for b in (0, 1) for a in (0, 90)][:6],
            ),
            "the table at 9° has other ScatterBeta",
        ),
        (
            one_side(1, [*ABG, row(theta=30, left=0.1), row(theta=0, left=0.1, micrometres=0.6)]),
            "not stated for each wavelength",
        ),
        (
            one_side(7, [row(theta=0, left=0.2)], [[300, 0.55, 0, 0, b, 0, 0.1, 0] for b in (-1, 1, 1)]),
            "ScatterBeta that is stated twice",
        ),
        (
            one_side(
                7,
                [row(theta=t, left=0.2) for t in (0, 9)],
                [[300, 0.55, t, 0, b, 0, 0.1, 0] for t in (0, 9) for b in (-1, 1 + t)],
            ),
            "the same for all incidences",
        ),
        (
            one_side(5, [row(theta=90, left=0.2)], [[300, 0.55, 90, 0, b, 0, 0.1, 0] for b in (0, 1)]),
            "at 90° of incidence",
        ),
    ],
)
def test_mistakes_are_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read(tmp_path, text)
