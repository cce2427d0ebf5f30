"""Scenes for other ray tracers show the luminance of the source: checked by running those ray tracers."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.lightfield.carrier import Cylinder, Disk, Dome, Surface
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.units import RADIANCE_WHITE_EFFICACY
from oracles.sources import DieUnderDome, PrismaticFilm

Array = npt.NDArray[np.float64]

SURFACES: dict[str, tuple[Surface, dict[str, float]]] = {
    "film": (Disk(radius=11.2, centre=(0.9, -0.5)), {"pixel": 3.0, "threshold": 1.0}),
    "dome": (Dome(radius=1.264, window=0.7), {"pixel": 0.2, "threshold": 2.0, "parallels": 6}),
    "watts": (Disk(radius=11.2, centre=(0.9, -0.5)), {"pixel": 6.0, "threshold": 3.0}),
    "cylinder": (Cylinder(radius=1.3, bottom=-0.1, top=1.3), {"pixel": 0.25, "threshold": 3.0}),
}


def fitted(name: str) -> tuple[GriddedSource, Array, Array]:
    """A source that no mirror image or turn leaves as it is, and lines from it."""
    surface, options = SURFACES[name]
    truth = DieUnderDome(floor=0.3) if name in {"dome", "cylinder"} else PrismaticFilm()
    position, direction = truth.rays(30_000, seed=5)
    unit = "W" if name == "watts" else "lm"
    rays = et.RaySet(position, direction, np.full(30_000, truth.total_flux / 30_000), flux_unit=unit)  # type: ignore[arg-type]
    source = GriddedSource.fit(rays, surface, **options)  # type: ignore[arg-type]
    return source, position[:400], direction[:400]


def away_from_edges(source: GriddedSource, points: Array, directions: Array) -> Array:
    """Lines that pass flat outlines and curved pixels alike: within 0.7 of the way from the middle to the edge, in all
    parts. A curved pixel becomes a flat polygon in a scene, and beside its edge the line meets the neighbour."""
    clear = np.ones(len(points), dtype=bool)
    patches = source.patches
    for i in range(len(patches)):
        local = (points - patches.centre[i]) @ patches.axes[i].T
        towards = directions @ patches.axes[i].T
        with np.errstate(divide="ignore", invalid="ignore"):
            at = local - (local[:, 2] / towards[:, 2])[:, None] * towards
        corners = ((patches.outline[i] - patches.centre[i]) @ patches.axes[i].T)[:, :2]
        inner, outer = (inside(at[:, :2], scale * corners) & (towards[:, 2] > 0) for scale in (0.7, 1.3))
        clear &= inner | ~outer
    return clear


def inside(points: Array, polygon: Array) -> npt.NDArray[np.bool_]:
    """Whether points of the plane lie within a polygon: crossings of a ray to the right are odd."""
    odd = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        between = (y0 > points[:, 1]) != (y1 > points[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            odd ^= between & (points[:, 0] < x0 + (points[:, 1] - y0) / (y1 - y0) * (x1 - x0))
    return odd


def expected(name: str) -> tuple[GriddedSource, Array, Array, Array]:
    """A source, lines through it and beside it, and its own luminance along them."""
    source, points, directions = fitted(name)
    grazing = directions[:200] * np.array([1, 1, 0.07])
    grazing /= np.linalg.norm(grazing, axis=1)[:, None]
    points = np.concatenate([points, points + np.array([40, 0, 0]), points[:200]])
    directions = np.concatenate([directions, directions, grazing])
    chosen = (
        np.ones(len(points), dtype=bool) if name in {"film", "watts"} else away_from_edges(source, points, directions)
    )
    points, directions = points[chosen], directions[chosen]
    luminance = source.luminance(points=points, directions=directions)
    assert (luminance > 0).sum() >= 40
    assert (luminance == 0).sum() >= 40
    return source, points, directions, luminance


# --- Radiance ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_radiance_shows_the_same_luminance(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    radiance = pytest.importorskip("pyradiance", reason="pyradiance, which brings Radiance along, is not installed")
    source, points, directions, luminance = expected(name)
    source.save_patches(tmp_path / "p", scenes=["radiance"])
    monkeypatch.chdir(tmp_path / "p" / "radiance")
    Path("scene.oct").write_bytes(radiance.oconv("scene.rad"))
    eyes = np.concatenate([points + 60 * directions, -directions], axis=1)
    answer = radiance.rtrace(eyes.tobytes(), "scene.oct", header=False, inform="d", outform="d", params=["-ab", "0"])
    seen = np.frombuffer(answer).reshape(-1, 3)
    assert np.ptp(seen, axis=1).max() == 0
    factor = 1.0 if name == "watts" else RADIANCE_WHITE_EFFICACY
    # A patch that can be seen through keeps 1e-5 of what is behind it.
    assert np.allclose(factor * seen[:, 0], luminance, rtol=3e-5, atol=0)


def test_radiance_lights_a_wall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Illuminance by Radiance's direct calculation, patch by patch in pieces, against a quadrature over directions."""
    radiance = pytest.importorskip("pyradiance", reason="pyradiance, which brings Radiance along, is not installed")
    source, *_ = fitted("film")
    source.save_patches(tmp_path / "p", scenes=["radiance"])
    monkeypatch.chdir(tmp_path / "p" / "radiance")
    Path("scene.oct").write_bytes(radiance.oconv("scene.rad"))
    wall = np.array([[5.0, -8.0, 30.0, 0.0, 0.0, -1.0]])
    options = ["-ab", "0", "-dj", "0", "-ds", "0.05", "-dt", "0", "-dc", "1"]
    answer = radiance.rtrace(
        wall.tobytes(), "scene.oct", header=False, inform="d", outform="d", irradiance=True, params=options
    )
    p, q = np.meshgrid(*[(np.arange(600) + 0.5) / 300 - 1] * 2)
    p, q = p[p * p + q * q < 1], q[p * p + q * q < 1]
    up = np.column_stack([p, q, np.sqrt(1 - p * p - q * q)])
    illuminance = source.luminance(points=np.tile(wall[0, :3], (len(up), 1)), directions=up).sum() / 300**2
    # Both are rules with steps: pieces of 1/20 of their distance, 600 directions across.
    assert np.frombuffer(answer)[1] * RADIANCE_WHITE_EFFICACY == pytest.approx(illuminance, rel=2e-3)


# --- Mitsuba -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def mi() -> Iterator[Any]:
    mitsuba = pytest.importorskip("mitsuba", reason="Mitsuba is not installed")
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    before = list(sys.path)
    yield mitsuba
    sys.path[:] = before
    sys.modules.pop("gridded_area", None)


def load(mi: Any, folder: Path, scene: str = "scene.xml") -> tuple[ModuleType, Any]:
    sys.path.insert(0, str(folder))
    return importlib.import_module("gridded_area"), mi.load_file(str(folder / scene))


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_mitsuba_shows_the_same_luminance(name: str, tmp_path: Path, mi: Any) -> None:
    source, points, directions, luminance = expected(name)
    source.save_patches(tmp_path / "p", scenes=["mitsuba"])
    _, scene = load(mi, tmp_path / "p" / "mitsuba")
    integrator, sampler = scene.integrator(), mi.load_dict({"type": "independent"})
    sampler.seed(0)
    seen = np.array([
        integrator.sample(scene, sampler, mi.RayDifferential3f(mi.Point3f(p + 60 * d), mi.Vector3f(-d)))[0]
        for p, d in zip(points, directions, strict=True)
    ])  # fmt: skip
    assert np.ptp(seen, axis=1).max() == 0
    # Single precision: where a table is steep an angle's last bit counts.
    assert np.allclose(seen[:, 0], luminance, rtol=3e-5, atol=1e-6 * luminance.max())


@pytest.mark.slow
def test_mitsuba_lights_a_wall(tmp_path: Path, mi: Any) -> None:
    """What the emitter sends by its own sampling, against a quadrature over the source: within 4 standard errors."""
    source, *_ = fitted("film")
    source.save_patches(tmp_path / "p", scenes=["mitsuba"])
    folder = tmp_path / "p" / "mitsuba"
    direct = '<integrator type="direct"><integer name="bsdf_samples" value="0"/></integrator>'
    wall = """<shape type="rectangle"><transform name="to_world"><scale value="50"/><rotate x="1" angle="180"/>
      <translate z="30"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape></scene>"""
    text = (folder / "scene.xml").read_text("utf-8").replace('<integrator type="path"/>', direct)
    (folder / "wall.xml").write_text(text.replace("</scene>", wall), "utf-8")
    _, scene = load(mi, folder, "wall.xml")
    integrator, sampler = scene.integrator(), mi.load_dict({"type": "independent"})
    sampler.seed(3)
    at = np.array([5.0, -8.0, 30.0])
    ray = mi.RayDifferential3f(mi.Point3f(at - [0, 0, 5]), mi.Vector3f(0, 0, 1))
    seen = np.array([integrator.sample(scene, sampler, ray)[0][0] for _ in range(20_000)])
    step = 0.1
    x, y = np.meshgrid(np.arange(-15, 15, step) + step / 2, np.arange(-15, 15, step) + step / 2)
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    distance = np.linalg.norm(at - points, axis=1)
    directions = (at - points) / distance[:, None]
    illuminance = (
        source.luminance(points=points, directions=directions) * directions[:, 2] ** 2 / distance**2
    ).sum() * step**2
    error = seen.std() / np.sqrt(len(seen))
    assert error < 0.02 * seen.mean()
    assert abs(seen.mean() - 0.5 * illuminance / np.pi) < 4 * error


@pytest.mark.slow
def test_mitsuba_rays_from_the_emitter_carry_the_flux(tmp_path: Path, mi: Any) -> None:
    """Mean weight of emitted rays: the flux of each patch's table times the factor, within 4 standard errors."""
    source, *_ = fitted("watts")
    source.save_patches(tmp_path / "p", scenes=["mitsuba"])
    _, scene = load(mi, tmp_path / "p" / "mitsuba")
    rng = np.random.default_rng(4)
    assert len(scene.emitters()) == len(source.patches)
    for emitter in scene.emitters()[:4]:
        here = np.linalg.norm(source.patches.centre - np.array(emitter.bbox().center()), axis=1) < 1e-3
        (flux,) = source.factor * source.patches.table_flux[here]
        weights = np.array([
            emitter.sample_ray(0.0, u[0], mi.Point2f(u[1:3]), mi.Point2f(u[3:5]))[1][0] for u in rng.random((4000, 5))
        ])  # fmt: skip
        # Areas are mm² in the scene, radiance is W/(m² sr).
        mean, error = weights.mean() * 1e-6, weights.std() / np.sqrt(4000) * 1e-6
        assert abs(mean - flux) < 4 * error
