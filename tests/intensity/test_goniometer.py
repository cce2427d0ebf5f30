"""Tables of type A and type B: the right direction, the stated error, the flux, and what was not measured."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import FormatError
from etendue.formats.intensity import goniometer, read_intensity
from etendue.quantities.intensity import Intensity
from scipy.interpolate import RegularGridInterpolator

Array = npt.NDArray[np.float64]

NADIR, LENGTH, ACROSS, UP = np.array([0.0, 0, -1]), np.array([1.0, 0, 0]), np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
"""A luminaire that hangs; C = 0 is along its length, C counts counter-clockwise seen from above."""


def turned(direction: Array, axis: Array, angle: npt.ArrayLike) -> Array:
    """Rodrigues: directions turned about `axis`, counter-clockwise for those against whom the axis points."""
    angle = np.radians(np.asarray(angle, float))[..., None]
    along = axis * (direction @ axis)[..., None]
    return along + np.cos(angle) * (direction - along) + np.sin(angle) * np.cross(axis, direction)


def direction_of(kind: str, horizontal: npt.ArrayLike, vertical: npt.ArrayLike) -> Array:
    """The words of ANSI/IESNA LM-63-02, section 3, as turns of a mirror, one after the other.

    Type A: from photometric horizontal, up by V; then clockwise (seen from above) about the vertical by H. Type B: from
    photometric zero, aside by H in the vertical plane across the luminaire; then by V about the horizontal axis across
    it, nadir towards photometric horizontal. There, at V = 90, H > 0 is clockwise seen from above: away from C = 90.
    """
    horizontal, vertical = np.broadcast_arrays(np.asarray(horizontal, float), np.asarray(vertical, float))
    if kind == "A":
        return turned(turned(LENGTH, ACROSS, -vertical), UP, -horizontal)
    return turned(turned(NADIR, LENGTH, -horizontal), ACROSS, -vertical)


def c_gamma(direction: Array) -> tuple[Array, Array]:
    """(C, γ) of a direction: γ from nadir, C counter-clockwise seen from above."""
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(np.hypot(x, y), -z))


def lobes(direction: Array, kind: str) -> Array:
    """A main beam, a lobe to one side of it and one above: no symmetry whatever."""
    tilted = [(1000.0, 4.0, -7.0, 12.0), (420.0, 22.0, 9.0, 60.0), (260.0, -9.0, 31.0, 90.0)]
    return sum((w * np.exp(k * (direction @ direction_of(kind, h, v) - 1.0)) for w, h, v, k in tilted), np.zeros(()))


def ies(kind: str, horizontal: Array, vertical: Array, values: Array, unit: str = "") -> str:
    number = {"A": 3, "B": 2}[kind]
    rows = [vertical, horizontal, *values]
    keywords = f"[TEST] t\n[_INTENSITYUNITS] {unit}" if unit else "[TEST] t"
    head = f"1 -1 1 {vertical.size} {horizontal.size} {number} 2 0 0 0\n1 1 20"
    text = "\n".join(" ".join(f"{x:.10g}" for x in row) for row in rows)
    return f"IESNA:LM-63-2002\n{keywords}\nTILT=NONE\n{head}\n{text}\n"


Read = Callable[..., Intensity]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def call(*table: object, **more: str) -> Intensity:
        (tmp_path / "a.ies").write_text(ies(*table, **more))
        return read_intensity(tmp_path / "a.ies")

    return call


def table(kind: str, horizontal: Array, vertical: Array) -> Array:
    return lobes(direction_of(kind, horizontal[:, None], vertical), kind)


def grid(low: float, high: float, step: float) -> Array:
    return np.arange(round(low / step), round(high / step) + 1) * step


def worst(led: Intensity, kind: str, mirror: bool = False) -> float:
    """Largest difference from the lobes, as a share of their maximum, over directions all around."""
    d = direction_of(kind, *np.random.default_rng(7).uniform(-35, 35, (2, 5000)))
    c, gamma = c_gamma(d)
    return float(np.abs(led.at(-c if mirror else c, gamma) - lobes(d, kind)).max()) / 1000.0


@pytest.mark.parametrize("kind", ["A", "B"])
def test_directions(read: Read, kind: str) -> None:
    """An asymmetric function, written node by node and found again in the same directions; its mirror image is not."""
    h, v = grid(-60, 60, 1.5), grid(-52, 58, 2)
    led = read(kind, h, v, table(kind, h, v))
    assert worst(led, kind) < 0.02  # 2° over lobes of 5° half width: the curvature between the nodes
    assert worst(led, kind, mirror=True) > 0.3
    assert led.maximum == pytest.approx(float(table(kind, h, v).max()), rel=0.01)
    assert led.symmetry() == "none"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "h", "v", "c", "gamma"),
    [
        ("A", 0, 0, 0, 90),  # photometric horizontal
        ("A", 30, 0, 330, 90),  # clockwise seen from above
        ("A", 0, 30, 0, 120),
        ("A", 20, -40, 340, 50),
        ("A", -150, -10, 150, 80),
        ("B", 0, 0, 0, 0),  # photometric zero
        ("B", 0, 30, 0, 30),
        ("B", 0, -30, 180, 30),
        ("B", 30, 0, 270, 30),
        ("B", -40, 0, 90, 40),
        ("B", 0, 90, 0, 90),  # photometric horizontal
        ("B", 30, 90, 330, 90),  # clockwise seen from above, as type A
        ("B", 0, 150, 0, 150),
    ],
)
def test_single_bright_nodes(read: Read, kind: str, h: float, v: float, c: float, gamma: float) -> None:
    """One node of 100 cd, in the direction that the standard's words name."""
    across, along = (
        (grid(-180, 180, 10), grid(-90, 90, 10)) if kind == "A" else (grid(-90, 90, 10), grid(-180, 180, 10))
    )
    values = np.where((across[:, None] == h) & (along == v), 100.0, 0.0)
    led = read(kind, across, along, values)
    assert float(led.at(c, gamma)) == pytest.approx(100.0, abs=0.5)
    assert led.maximum == pytest.approx(100.0, abs=1e-6)
    assert not any("unknown" in note for note in led.notes)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_flux_and_stated_error(read: Read, kind: str) -> None:
    """The flux of the file's own bilinear function, by quadrature; and no direction is further off."""
    h, v = grid(-30, 30, 5), grid(-40, 40, 4)
    values = table(kind, h, v)
    led = read(kind, h, v, values)
    bilinear = RegularGridInterpolator((h, v), values)
    x, w = np.polynomial.legendre.leggauss(8)
    points, weights = [], []
    for angles in (h, v):
        half = np.diff(angles)[:, None] / 2
        points.append(((angles[1:] + angles[:-1])[:, None] / 2 + half * x).ravel())
        weights.append(np.radians(half * w).ravel())
    mesh = np.meshgrid(*points, indexing="ij")
    flux = float((np.outer(*weights) * bilinear(tuple(mesh)) * np.cos(np.radians(mesh[1 if kind == "A" else 0]))).sum())
    assert led.flux == pytest.approx(flux, rel=goniometer.FLUX_DIFFERENCE)
    rng = np.random.default_rng(3)
    a, b = rng.uniform(-29, 29, 20_000), rng.uniform(-39, 39, 20_000)
    off = np.abs(led.at(*c_gamma(direction_of(kind, a, b))) - bilinear((a, b))).max()
    told = " ".join(led.notes)
    if kind == "A":
        assert "nothing was resampled" in told
        assert off < 1e-6 * values.max()
    else:
        stated = float(re.search(r"bilinear function of the file ([\d.e+-]+) cd", told)[1])
        assert 0.5 * stated < off <= 1.1 * stated
        assert stated <= goniometer.LARGEST_DIFFERENCE * values.max()
        found, own = (float(x) for x in re.search(r"flux ([\d.]+) for ([\d.]+)", told).groups())
        assert own == pytest.approx(flux, rel=1e-4)
        assert found == pytest.approx(led.flux, rel=1e-5)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_what_was_not_measured_is_zero_and_told(read: Read, kind: str) -> None:
    h, v = grid(-30, 40, 5), grid(-20, 20, 5)
    led = read(kind, h, v, np.full((h.size, v.size), 50.0))
    for a, b, value in ((39, 0, 50), (41.5, 0, 0), (-29, 0, 50), (-31.5, 0, 0), (0, 19, 50), (0, 21.5, 0)):
        assert float(led.at(*c_gamma(direction_of(kind, a, b)))) == pytest.approx(value, abs=1e-6), (a, b)
    told = " ".join(led.notes)
    assert "H from -30° to 40° and V from -20° to 20° were measured; what goes elsewhere is unknown" in told
    # ∫ 50 cos(latitude) over the rectangle, closed form
    along, around = ((-20, 20), 70) if kind == "A" else ((-30, 40), 40)
    exact = 50 * np.radians(around) * (np.sin(np.radians(along[1])) - np.sin(np.radians(along[0])))
    assert led.flux == pytest.approx(exact, rel=1e-3)
    if kind == "B":
        assert "at the edge of what was measured the step to 0 became a slope" in told


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["A", "B"])
def test_half_and_quarter_tables(read: Read, kind: str) -> None:
    """Angles from 0° belong to symmetric tables (LM-63 5.13, 5.14): the same as the table with both sides."""
    h, v = grid(0, 40, 5), grid(0, 30, 3)
    quarter = table(kind, h, v)
    whole_h, whole_v = grid(-40, 40, 5), grid(-30, 30, 3)
    whole = quarter[np.abs(np.arange(whole_h.size) - 8)][:, np.abs(np.arange(whole_v.size) - 10)]
    both = read(kind, whole_h, whole_v, whole)
    assert not both.complaints
    from_quarter = read(kind, h, v, quarter)
    assert np.allclose(from_quarter.values, both.values)
    assert sum("begin at 0°" in str(c) for c in from_quarter.complaints) == 2
    half = read(kind, h, whole_v, whole[8:])
    assert np.allclose(half.values, both.values)
    assert sum("horizontal angles begin at 0°" in str(c) for c in half.complaints) == 1


def test_isotropic_type_b_is_isotropic(read: Read) -> None:
    h, v = grid(-90, 90, 15), grid(-180, 180, 30)
    led = read("B", h, v, np.full((h.size, v.size), 7.0))
    assert np.allclose(led.values, 7.0)
    assert led.flux == pytest.approx(4 * np.pi * 7)
    assert not any("unknown" in note for note in led.notes)


def test_watts(read: Read) -> None:
    h, v = grid(-10, 10, 5), grid(-10, 10, 5)
    led = read("B", h, v, np.full((h.size, v.size), 50.0), unit="mW/sr")
    assert (led.flux_unit, led.maximum) == ("W", pytest.approx(0.05))
    assert any("W/sr" in note for note in led.notes)


@pytest.mark.parametrize(
    ("kind", "h", "v", "message"),
    [
        ("B", (-95, 0, 95), (-90, 90), "horizontal angles run from -95° to 95°, beyond -90° to 90°"),
        ("A", (-90, 90), (-100, 90), "vertical angles run from -100° to 90°, beyond -90° to 90°"),
        ("B", (0,), (-90, 90), "there is one horizontal angle"),
        ("B", (10, 5), (-90, 90), "horizontal angles: they do not rise"),
    ],
)
def test_what_is_refused(read: Read, kind: str, h: tuple[float, ...], v: tuple[float, ...], message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(kind, np.array(h, float), np.array(v, float), np.ones((len(h), len(v))))


@pytest.mark.slow
def test_very_fine_tables_stay_small(read: Read) -> None:
    """0.05° in V over ±50°: fine tables become no more than `MOST_NODES` of a C-γ table, with the error told."""
    h, v = np.linspace(-50, 50, 101), np.linspace(-50, 50, 2001)
    values = 1000.0 * np.exp(-((h[:, None] - 10) ** 2 + (v + 5) ** 2) / 200.0)
    led = read("B", h, v, np.round(values, 3))
    assert led.values.size <= goniometer.MOST_NODES
    assert float(led.at(*c_gamma(direction_of("B", 10, -5)))) == pytest.approx(1000, rel=1e-3)
    assert any("0.0" in note and "% of the maximum" in note for note in led.notes)
