"""Gloss and haze against closed forms."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.appearance import (
    RECEPTORS,
    Appearance,
    appearance,
    distinctness_of_image,
    haze_index,
    reflection_haze,
    specular_gloss,
    transmission_haze,
)
from etendue.scatter.materials import MATERIALS
from etendue.scatter.models import Coated, Gaussian, Lambertian, Mirror, Mixture, Transmitter
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]


def glass(*, index: float, angle: float) -> float:
    """Reflectance of polished glass for unpolarised light, by the angles of Fresnel's sines and tangents."""
    i = math.radians(angle)
    t = math.asin(math.sin(i) / index)
    return 0.5 * ((math.sin(i - t) / math.sin(i + t)) ** 2 + (math.tan(i - t) / math.tan(i + t)) ** 2)


@pytest.mark.parametrize("angle", RECEPTORS)
def test_polished_glass(angle: int) -> None:
    """100 by definition for an index of 1.567, and the ratio of Fresnel's reflectances for others."""
    assert specular_gloss(Coated(index=1.567, base_reflectance=0.0), angle) == pytest.approx(100.0, rel=1e-12)
    other = 100.0 * glass(index=1.5, angle=angle) / glass(index=1.567, angle=angle)
    assert specular_gloss(Coated(index=1.5, base_reflectance=0.0), angle) == pytest.approx(other, rel=1e-9)
    mirror = 100.0 * 0.9 / glass(index=1.567, angle=angle)
    assert specular_gloss(Mirror(reflectance=0.9), angle) == pytest.approx(mirror, rel=1e-9)


@pytest.mark.parametrize("angle", RECEPTORS)
def test_a_lambertian_surface(angle: int) -> None:
    """ρ/π ∫ cosθ dΩ = ρ/π 2 cosθ sin δ (ε + sin ε cos ε) over a rectangle of half angles δ and ε."""
    along, across = (math.radians(0.5 * side) for side in RECEPTORS[angle])
    seen = 0.8 / math.pi * 2.0 * math.cos(math.radians(angle)) * math.sin(along)
    seen *= across + math.sin(across) * math.cos(across)
    expected = 100.0 * seen / glass(index=1.567, angle=angle)
    assert specular_gloss(Lambertian(reflectance=0.8), angle) == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_lobe_much_narrower_than_the_receptor_counts_whole_and_a_wide_one_does_not() -> None:
    sigma = 2e-3
    narrow = Gaussian(peak=0.5 / (2.0 * math.pi * sigma**2), sigma=sigma)
    assert specular_gloss(narrow, 60) == pytest.approx(50.0 / glass(index=1.567, angle=60), rel=2e-3)
    # By another route: rays that are drawn from directions within the source, counted in the receptor.
    sigma = 0.05
    wide = Gaussian(peak=0.5 / (2.0 * math.pi * sigma**2), sigma=sigma)
    rng = np.random.default_rng(8)
    inside = drawn = 0
    for k in range(40):
        tilt, turn = rng.uniform(-0.375, 0.375), rng.uniform(-1.25, 1.25)
        a, b = math.radians(60.0 + tilt), math.radians(turn)
        incident = [-math.sin(a) * math.cos(b), -math.sin(b), math.cos(a) * math.cos(b)]
        rays = wide.sample(incident, 20_000, seed=k)
        gone = rays[~np.isnan(rays[:, 0])]
        along = np.degrees(np.arctan2(gone[:, 0], gone[:, 2])) - 60.0
        across = np.degrees(np.arcsin(gone[:, 1]))
        inside += int(((np.abs(along) < 2.2) & (np.abs(across) < 5.85)).sum())
        drawn += 20_000
    share = inside / drawn
    error = math.sqrt(share * (1.0 - share) / drawn)
    found = specular_gloss(wide, 60) * glass(index=1.567, angle=60) / 100.0
    assert abs(found - share) < 4.0 * error
    assert found < 0.3


def test_haze() -> None:
    sigma = 0.02
    film = Gaussian(peak=0.8 / (2.0 * math.pi * sigma**2), sigma=sigma, way="transmitted")
    beyond = 100.0 * math.exp(-0.5 * (math.sin(math.radians(2.5)) / sigma) ** 2)
    assert transmission_haze(film) == pytest.approx(beyond, rel=1e-4)
    # A lobe of half a degree has e^-72 of its light beyond, and no rounding error below 0.
    assert transmission_haze(MATERIALS["holographic-diffuser-0.5"].finish) == 0.0
    clear = Mixture(parts=[Transmitter(transmittance=0.9), Lambertian(reflectance=0.0, transmittance=0.1)])
    assert transmission_haze(clear) == pytest.approx(10.0 * math.cos(math.radians(2.5)) ** 2, rel=1e-9)
    assert appearance(film).haze == transmission_haze(film)
    assert appearance(Mirror(reflectance=0.9)).haze is None
    with pytest.raises(ArgumentError, match="nothing is"):
        transmission_haze(Mirror(reflectance=0.9))


def test_only_the_angles_of_the_standard() -> None:
    with pytest.raises(ArgumentError, match="20, 60, 85"):
        specular_gloss(Mirror(reflectance=0.9), 45)


def lambert_in(*, rho: float, angle: float, low: float, high: float, across: float) -> float:
    """ρ/π ∫ cosθ dΩ over a rectangle about a direction: angles in the plane of incidence from low to high, ± across / 2."""
    a = math.sin(math.radians(angle + high)) - math.sin(math.radians(angle + low))
    b = math.radians(0.5 * across)
    return rho / math.pi * a * (b + math.sin(b) * math.cos(b))


def test_reflection_haze_of_a_lambertian_surface() -> None:
    parts = [lambert_in(rho=0.8, angle=20.0, low=c - 0.9, high=c + 0.9, across=3.6) for c in (-1.9, 1.9)]
    expected = 100.0 * sum(parts) / glass(index=1.567, angle=20.0)
    assert reflection_haze(Lambertian(reflectance=0.8)) == pytest.approx(expected, rel=1e-9)
    assert reflection_haze(Coated(index=1.567, base_reflectance=0.0)) == 0.0


def test_haze_index_and_distinctness_of_a_lambertian_surface() -> None:
    """Fluxes over the widths of their slits: nearly the same for a matt surface, whose distinctness is that of no image."""
    white = Lambertian(reflectance=0.8)
    whole = lambert_in(rho=0.8, angle=30.0, low=-0.2, high=0.2, across=5.0) / 0.4
    for angle, width in ((2, 0.4), (5, 0.5)):
        parts = [
            lambert_in(rho=0.8, angle=30.0, low=c - 0.5 * width, high=c + 0.5 * width, across=5.0)
            for c in (-angle, angle)
        ]
        expected = 100.0 * 0.5 * sum(parts) / width / whole
        assert haze_index(white, angle) == pytest.approx(expected, rel=1e-9)
    # The mirror's part of the slits beside: of the image's 0.44° those from 0.23° on, so nothing.
    assert distinctness_of_image(white) == pytest.approx(0.0, abs=0.01)
    for nothing in (distinctness_of_image, haze_index):
        with pytest.raises(ArgumentError, match="nothing is"):
            nothing(Mirror(reflectance=0.0))
    with pytest.raises(ArgumentError, match="2 and 5"):
        haze_index(white, 3)


def test_distinctness_of_a_sharp_image_under_a_veil() -> None:
    """A mirror of 4 % and a Lambertian veil, by hand: of the mirror's image 0.4/0.44 fall into the slit."""
    veiled = Mixture(parts=[Mirror(reflectance=0.04), Lambertian(reflectance=0.8)])
    veil = lambert_in(rho=0.8, angle=30.0, low=-0.2, high=0.2, across=5.0) / 0.4
    beside = [lambert_in(rho=0.8, angle=30.0, low=c - 0.07, high=c + 0.07, across=5.0) / 0.14 for c in (-0.3, 0.3)]
    image = 0.04 * (0.4 / 0.44) / 0.4
    expected = 100.0 * (1.0 - 0.5 * sum(beside) / (image + veil))
    assert distinctness_of_image(veiled) == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_reflection_haze_of_a_lobe_by_rays() -> None:
    """Rays from directions within the source, counted in the receptors on both sides."""
    sigma = 0.03
    lobe = Gaussian(peak=0.5 / (2.0 * math.pi * sigma**2), sigma=sigma)
    inside = drawn = 0
    # Evenly over the source, whose parts send different shares there.
    for k, (i, j) in enumerate(np.ndindex(6, 10)):
        tilt, turn = 0.75 * ((i + 0.5) / 6.0 - 0.5), 2.5 * ((j + 0.5) / 10.0 - 0.5)
        a, b = math.radians(20.0 + tilt), math.radians(turn)
        rays = lobe.sample([-math.sin(a) * math.cos(b), -math.sin(b), math.cos(a) * math.cos(b)], 20_000, seed=k)
        gone = rays[~np.isnan(rays[:, 0])]
        along = np.degrees(np.arctan2(gone[:, 0], gone[:, 2])) - 20.0
        across = np.degrees(np.arcsin(gone[:, 1]))
        beside = np.abs(np.abs(along) - 1.9) < 0.9
        inside += int((beside & (np.abs(across) < 1.8)).sum())
        drawn += 20_000
    share = inside / drawn
    found = reflection_haze(lobe) * glass(index=1.567, angle=20) / 100.0
    assert abs(found - share) < 4.0 * math.sqrt(share * (1.0 - share) / drawn)


@pytest.mark.slow
def test_errors_of_a_table_are_what_its_cells_bring_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each cell moved by its error, one after the other: the root of the sum of squares is the error of gloss.

    That of twelve drawn tables squared, over it, times 11, is χ² with 11 degrees of freedom; bounds at 10⁻⁴ on both sides.
    """
    radial = np.concatenate([np.linspace(0.0, 12.0, 7), np.linspace(20.0, 180.0, 9)])
    grid = PolarGrid("specular", radial, np.arange(0.0, 360.0, 120.0))
    values = np.full(grid.shape, 0.2) + 0.3 * np.exp(-0.5 * (radial / 4.0) ** 2)
    errors = 0.1 * values

    def table(f: np.ndarray, *, known: bool) -> BsdfTable:
        one = BsdfSlice(direction(60.0, 180.0), f, grid=grid, standard_error=errors if known else None)
        return BsdfTable(BsdfData((one,)))

    plain = specular_gloss(table(values, known=False), 60)
    square = 0.0
    for j, i in np.ndindex(grid.shape):
        # The aperture of 4.4° × 11.7° ends 6.3° from the mirrored direction, and the source is 2.5° across.
        if radial[i] <= 10.0:
            moved = values.copy()
            moved[j, i] += errors[j, i]
            square += (specular_gloss(table(moved, known=False), 60) - plain) ** 2
    looks = appearance(table(values, known=True))
    assert 1.14 < 11.0 * looks.errors["gloss 60"] ** 2 / square < 37.4
    monkeypatch.setattr("etendue.scatter.appearance.DRAWS", 2)
    few = appearance(table(values, known=True))
    assert appearance(table(values, known=True)).errors == few.errors
    assert appearance(table(values, known=True), seed=2).errors != few.errors
    assert appearance(table(values, known=False)).errors == {}


@pytest.mark.slow
def test_errors_of_interpolated_values_do_not_shrink_in_the_mean() -> None:
    """What each factor of 2 of the distance brings, its values all off together, against the spread of drawn tables.

    By χ² of 11 degrees of freedom at a significance of 1e-3.
    """
    grid = PolarGrid("cosines", np.append(0.0, np.geomspace(1e-3, 2.0, 34)), np.arange(0.0, 360.0, 60.0))
    incident = direction(20.0, 180.0)
    values = np.full(grid.shape, 0.2)
    errors = 0.1 * values

    def table(f: Array, *, known: bool) -> BsdfTable:
        error = errors if known else None
        return BsdfTable(
            BsdfData([BsdfSlice(incident, f, grid=grid, standard_error=error, interpolated=True)], isotropic=True)
        )

    octave = np.log2(np.maximum(grid.radial, 1e-4) / 1e-4)
    plain = specular_gloss(table(values, known=False), 20)
    square = 0.0
    for k in range(16):
        hats = np.maximum(1.0 - np.abs(octave - np.arange(17)[:, None]), 0.0)
        moved = values + errors * hats[k] / np.sqrt((hats**2).sum(axis=0))
        square += (specular_gloss(table(moved, known=False), 20) - plain) ** 2
    looks = appearance(table(values, known=True))
    assert 1.83 < 11.0 * looks.errors["gloss 20"] ** 2 / square < 31.26
    # No less than a third of what it is if all values are off together.
    assert looks.errors["gloss 20"] > 0.1 * plain / 3.0


@pytest.mark.slow
def test_errors_of_a_table_that_scatters_nearly_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors that lead beyond all light are no obstacle; they are those of half the light, twice."""
    monkeypatch.setattr("etendue.scatter.appearance.DRAWS", 2)
    grid = PolarGrid("normal", np.array([0.0, 45.0, 89.0]), np.array([0.0, 120.0, 240.0]))

    def looks(share: float, *components: dict[str, object]) -> Appearance:
        f = np.full(grid.shape, share / math.pi)
        one = BsdfSlice(direction(40.0, 180.0), f, grid=grid, standard_error=0.5 * f)
        return appearance(BsdfTable(BsdfData([one], components, isotropic=True)))

    whole, half = looks(0.99), looks(0.495)
    for name in ("gloss 20", "reflection haze"):
        # As exactly as shares between incidences are tabled.
        assert whole.errors[name] == pytest.approx(2.0 * half.errors[name], rel=1e-5)
    assert whole.errors["distinctness"] == pytest.approx(half.errors["distinctness"], rel=1e-6)
    # What is mirrored is known.
    glossy = looks(0.495, {"kind": "mirror", "reflectance": 0.04})
    assert glossy.errors["gloss 20"] == pytest.approx(half.errors["gloss 20"], rel=1e-6)
