"""Spectra against the CIE table, and luminous efficacy against quadrature."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.spectrum import Spectrum, photopic_efficiency
from hypothesis import given, settings
from hypothesis import strategies as st

fixed = settings(derandomize=True, deadline=None, max_examples=60)

CIE_018 = {
    360: 3.917e-6, 380: 3.9e-5, 400: 3.96e-4, 450: 0.038, 480: 0.13902, 500: 0.323, 507: 0.44431, 510: 0.503, 530: 0.862,
    550: 0.99495, 555: 1.0, 560: 0.995, 600: 0.631, 650: 0.107, 700: 4.102e-3, 780: 1.499e-5, 830: 4.518e-7,
}  # fmt: skip
"""V(λ) as printed in table 1 of CIE 018:2019 (and 015:2018), copied by hand."""


def test_every_row_of_the_table_is_that_of_another_library() -> None:
    with np.printoptions(), warnings.catch_warnings(action="ignore"):
        import colour

    table = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    assert table.wavelengths.tolist() == list(range(360, 831))
    assert photopic_efficiency(table.wavelengths).tolist() == table.values.tolist()


@st.composite
def spectra(draw: st.DrawFn) -> Spectrum:
    nodes = draw(st.lists(st.floats(200.0, 1100.0), min_size=2, max_size=12, unique=True).map(sorted))
    weights = draw(st.lists(st.floats(0.01, 100.0), min_size=len(nodes), max_size=len(nodes)))
    return Spectrum(np.array(nodes), np.array(weights))


def efficacy_by_quadrature(wavelength: np.ndarray, weight: np.ndarray) -> float:
    """K_m ∫ S V dλ / ∫ S dλ, interval by interval, with V from the CIE table at whole nanometres."""
    whole = np.arange(360.0, 831.0)
    table = photopic_efficiency(whole)
    low, high = max(wavelength[0], 360.0), min(wavelength[-1], 830.0)
    if high <= low:
        return 0.0
    edges = np.unique(np.concatenate([[low, high], whole[(whole > low) & (whole < high)],
                                      wavelength[(wavelength > low) & (wavelength < high)]]))  # fmt: skip

    def product(x: np.ndarray) -> np.ndarray:
        return np.interp(x, wavelength, weight) * np.interp(x, whole, table)

    # Between two edges the product is a parabola, which Gauss' rule of three points integrates exactly.
    nodes, weights = np.polynomial.legendre.leggauss(3)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    visible = math.fsum((half * weights * product(middle + half * nodes)).ravel())
    total = math.fsum(
        (b - a) * (u + v) / 2 for a, b, u, v in zip(wavelength, wavelength[1:], weight, weight[1:], strict=False)
    )
    return 683.0 * visible / total


# --- V(λ) ------------------------------------------------------------------------------------------------------------


def test_photopic_efficiency_is_the_cie_table() -> None:
    for wavelength, value in CIE_018.items():
        assert photopic_efficiency([wavelength])[0] == pytest.approx(value, rel=2e-4), wavelength


def test_photopic_efficiency_is_linear_between_nodes_and_zero_outside() -> None:
    a, b = photopic_efficiency([512.0, 513.0])
    assert photopic_efficiency([512.25])[0] == pytest.approx(0.75 * a + 0.25 * b, rel=1e-14)
    assert photopic_efficiency([359.999, 830.001, 0.0, 1e9]).tolist() == [0, 0, 0, 0]


def test_a_wavelength_that_is_no_number_has_no_efficiency() -> None:
    assert math.isnan(photopic_efficiency([math.nan])[0])


# --- luminous efficacy -----------------------------------------------------------------------------------------------


def test_a_line_has_the_efficacy_of_its_wavelength() -> None:
    assert Spectrum([555.0], [0.2]).luminous_efficacy == pytest.approx(683.0, rel=1e-12)
    assert Spectrum([650.0], [9.0]).luminous_efficacy == pytest.approx(683.0 * 0.107, rel=1e-12)
    assert Spectrum([900.0], [9.0]).luminous_efficacy == 0.0
    assert Spectrum([650.0], [9.0]).total == 9.0


def test_the_equal_energy_spectrum_has_the_known_efficacy() -> None:
    """Σ V(λ)·1 nm = 106.857 nm for the 1 nm table of the CIE; half of the two end nodes is below 2e-6."""
    for low, high in ((360.0, 830.0), (300.0, 1000.0)):
        k = Spectrum([low, high], [1.0, 1.0]).luminous_efficacy
        assert k == pytest.approx(683.0 * 106.857 / (high - low), rel=2e-6)


def test_black_bodies_have_the_known_efficacies() -> None:
    """The luminous efficacy of Planck's law has its maximum, 95 lm/W, near 6640 K (Wyszecki and Stiles, 1.2.2)."""
    wavelength = np.concatenate([np.arange(50.0, 3000.0), np.geomspace(3000.0, 1e6, 4000)])

    def planck(kelvin: float) -> float:
        weight = wavelength**-5 / np.expm1(1.438776877e7 / (wavelength * kelvin))
        return Spectrum(wavelength, weight / weight.max()).luminous_efficacy

    assert planck(6640.0) == pytest.approx(95.0, abs=0.5)
    assert planck(6640.0) > max(planck(6000.0), planck(7400.0))
    # The candela of 1948: 60 cd/cm² at the freezing point of platinum, 2042 K; K = π L / (σ T⁴).
    assert planck(2042.0) == pytest.approx(np.pi * 60e4 / (5.670374e-8 * 2042.0**4), rel=0.01)


@fixed
@given(spectra())
def test_efficacy_equals_quadrature_of_the_product(spectrum: Spectrum) -> None:
    expected = efficacy_by_quadrature(spectrum.wavelength, spectrum.weight)
    assert spectrum.luminous_efficacy == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("wavelength", "weight"),
    [
        ([300.0, 400.0], [1.0, 1.0]),  # a step of V at 360 nm inside an interval
        ([200.0, 10_000.0], [0.3, 1.0]),  # and at 830 nm
        ([610.2, 610.7], [1.0, 3.0]),  # all between two nodes of V
        ([555.0, 555.5, 556.0], [0.0, 1.0, 0.0]),
    ],
)
def test_efficacy_at_the_edges_of_the_table(wavelength: list[float], weight: list[float]) -> None:
    expected = efficacy_by_quadrature(np.array(wavelength), np.array(weight))
    assert expected > 0
    assert Spectrum(wavelength, weight).luminous_efficacy == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("wavelength", [[200.0, 360.0], [830.0, 2000.0], [250.0, 300.0]])
def test_light_that_nobody_sees_has_no_efficacy(wavelength: list[float]) -> None:
    assert Spectrum(wavelength, [1.0, 2.0]).luminous_efficacy == 0.0


def test_no_light_has_no_efficacy() -> None:
    assert Spectrum([500.0, 600.0], [0.0, 0.0]).luminous_efficacy == 0.0
    assert Spectrum([500.0], [0.0]).luminous_efficacy == 0.0


@fixed
@given(spectra(), st.floats(1e-6, 1e6), st.floats(0.01, 0.99))
def test_efficacy_depends_neither_on_scale_nor_on_more_nodes_on_the_same_lines(
    spectrum: Spectrum, scale: float, place: float
) -> None:
    k = spectrum.luminous_efficacy
    assert Spectrum(spectrum.wavelength, spectrum.weight * scale).luminous_efficacy == pytest.approx(
        k, rel=1e-9, abs=1e-12
    )
    extra = (1 - place) * spectrum.wavelength[:-1] + place * spectrum.wavelength[1:]
    nodes = np.union1d(spectrum.wavelength, extra)
    finer = Spectrum(nodes, np.interp(nodes, spectrum.wavelength, spectrum.weight))
    assert finer.luminous_efficacy == pytest.approx(k, rel=1e-6, abs=1e-9)
    assert finer.total == pytest.approx(spectrum.total, rel=1e-9)
    assert 0.0 <= k <= 683.0


def test_total_is_the_area_under_the_lines() -> None:
    assert Spectrum([400.0, 410.0, 450.0], [1.0, 3.0, 0.0]).total == pytest.approx(20 + 60, rel=1e-15)


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wavelength", "weight", "message"),
    [
        ([], [], "equally long"),
        ([500.0, 600.0], [1.0], "equally long"),
        ([[500.0]], [[1.0]], "equally long"),
        ([500.0, math.nan], [1.0, 1.0], "not finite"),
        ([500.0, 600.0], [1.0, math.inf], "not finite"),
        ([600.0, 500.0], [1.0, 1.0], "rise"),
        ([500.0, 500.0], [1.0, 1.0], "rise"),
        ([0.0, 500.0], [1.0, 1.0], "above 0 nm"),
        ([500.0, 600.0], [1.0, -1e-9], "not be negative"),
    ],
)
def test_refuses(wavelength: list[float], weight: list[float], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        Spectrum(wavelength, weight)  # type: ignore[arg-type]


def test_keeps_copies_that_nobody_changes() -> None:
    wavelength = np.array([500.0, 600.0])
    spectrum = Spectrum(wavelength, np.ones(2))
    wavelength[0] = 1.0
    assert spectrum.wavelength[0] == 500.0
    with pytest.raises(ValueError, match="read-only"):
        spectrum.weight[0] = 2.0
