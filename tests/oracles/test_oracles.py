"""The oracles themselves: nothing in them can be swapped unseen, and each number has a second route that shows 5 %."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import itertools
import math
import pkgutil
from collections import defaultdict
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest

import oracles
from oracles import beams, bodies, border, cone, gridded, images, intensity, map_files, meshes, prismatic_film, sources
from oracles.quadrilateral import Quadrilateral
from oracles.radiosity import Cavity

Array = npt.NDArray[np.float64]
MODULES = sorted(m.name for m in pkgutil.iter_modules(oracles.__path__) if not m.name.startswith("test_"))

# --- arguments ---------------------------------------------------------------------------------------------------------

KINDS = {"int": "number", "float": "number", "npt.ArrayLike": "array", "Array": "array"}
"""Annotations that take each other's values."""


def public(module: ModuleType) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Functions, classes and methods of a module that others may call."""
    for name, value in vars(module).items():
        if name.startswith("_") or getattr(value, "__module__", None) != module.__name__:
            continue
        if inspect.isfunction(value) or inspect.isclass(value):
            yield name, value
        if inspect.isclass(value):
            own = (
                (n, inspect.unwrap(getattr(m, "__func__", m))) for n, m in vars(value).items() if not n.startswith("_")
            )
            yield from ((f"{name}.{n}", m) for n, m in own if inspect.isfunction(m))


def swappable(helper: Callable[..., Any]) -> list[list[str]]:
    """Parameters of one kind of which more than one may be given by its place; `one` and `other` may change places."""
    found = defaultdict(list)
    for parameter in inspect.signature(helper).parameters.values():
        by_place = parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD)
        if by_place and parameter.name not in ("self", "other"):
            found[KINDS.get(str(parameter.annotation), str(parameter.annotation))].append(parameter.name)
    return [names for names in found.values() if len(names) > 1]


def test_what_could_be_swapped_is_given_by_name() -> None:
    helpers = {
        f"{name}.{helper}": call
        for name in MODULES
        for helper, call in public(importlib.import_module(f"oracles.{name}"))
    }
    assert len(helpers) > 100
    assert {name: swappable(call) for name, call in helpers.items() if swappable(call)} == {}


def test_a_helper_that_breaks_the_rule_is_found() -> None:
    def swapped(values: Array, truth: npt.ArrayLike, n: int) -> None: ...

    def by_name(values: Array, *, truth: npt.ArrayLike, n: int) -> None: ...

    def compared(one: Array, other: Array) -> None: ...

    @dataclasses.dataclass
    class Ring:
        radius: float
        nodes: int

    assert swappable(swapped) == [["values", "truth"]]
    assert swappable(Ring) == [["radius", "nodes"]]
    assert swappable(by_name) == swappable(compared) == []


# --- numbers -----------------------------------------------------------------------------------------------------------


def cavity() -> tuple[Any, Any]:
    """All light that the disk sends out is absorbed, leaves or falls back."""
    room = Cavity(exitance=2.0)
    return sum((*room.absorbed, *room.left)), 2.0 * math.pi * room.disk**2


def plain_cone() -> tuple[Any, Any]:
    """Two rays along the sight lines of two pixels: L = w/(2π (1 − cos α) A cos θ) each."""
    observer, screen = et.Observer(25.0, 40.0, 1e9), et.Screen(4.0, 2.0, 2, 1, plane="xy")
    sight = np.array(observer.position) / 1e9
    rays = et.RaySet([[-1, 0, 0], [1, 0, 0]], [sight, sight], [3.0, 7.0])
    found = cone.plain_statement(rays, observer, screen, acceptance=5.0)[0]
    solid = 2 * math.pi * (1 - math.cos(math.radians(5.0)))
    return found, np.array([[3.0, 7.0]]) / (solid * 4e-6 * math.cos(math.radians(25.0)))


def quarter_by_cone() -> tuple[Any, Any]:
    """A pixel within one quarter: L (1 + cos α)/2."""
    tilted = Quadrilateral()
    middle = np.array(tilted.centre) + np.array(tilted.edge_a) / 4 - np.array(tilted.edge_b) / 4
    observer, screen = et.Observer(15.0, 70.0, 1e6, target=tuple(middle)), et.Screen(0.2, 0.1, 1, 1)
    found = tilted.cone_expectation(observer, screen, acceptance=11.0)
    return found, tilted.quarters[1] * (1 + math.cos(math.radians(11.0))) / 2


def quarters_by_rays() -> tuple[Any, Any]:
    """Flux of the rays of each quarter, Φ = π L A/4, seen by the luminance along them."""
    tilted = Quadrilateral()
    rays = tilted.rays(400_000, seed=1)
    level = tilted.luminance(points=rays.position, directions=rays.direction)
    found = [rays.flux[level == quarter].sum() for quarter in tilted.quarters]
    return found, math.pi * np.array(tilted.quarters) * tilted.area / 4 * 1e-6


def table_by_quadrature() -> tuple[Any, Any]:
    """Terms of a table without symmetry that have no mean over C leave 4π times the mean over γ."""
    return intensity.flux_by_quadrature(intensity.lid("none")), 4 * math.pi * 1.2 * 731.25


def hats() -> tuple[Any, Any]:
    """Weights of all nodes make the sphere; the mean of cos γ about a node beside the equator is that of a hat."""
    c, gamma = np.arange(8) * 45.0, np.linspace(0.0, 180.0, 37)
    mean, weight = intensity.hat_means(lambda a, b: np.cos(np.radians(b)) + 0.0 * a, c=c, gamma=gamma)
    once = np.where(np.isin(gamma, (0.0, 180.0)), 1.0 / 8, 1.0)
    # Of cos γ sin γ and of sin γ by (1 − |γ − γ₀|/h): half the angle of waves of 2γ, and of γ.
    h = math.radians(5.0)
    damped = (math.sin(h) / h) ** 2 / (math.sin(h / 2) / (h / 2)) ** 2
    return [(weight * once).sum(), mean[3, 12]], [4 * math.pi, damped * math.cos(math.radians(60.0))]


def trapezium() -> tuple[Any, Any]:
    c, gamma = np.arange(12) * 30.0, np.linspace(0.0, 180.0, 181)
    values = 3.0 + np.cos(np.radians(gamma)) + np.sin(np.radians(c))[:, None]
    return intensity.read_by_trapezium(values, c=c, gamma=gamma), 12 * math.pi


def lobes() -> tuple[Any, Any]:
    """A beam holds 1 lm; its rays have the mean cosine (n + 1)/(n + 2) to the axis."""
    z, w = np.polynomial.legendre.leggauss(100)
    turn = np.arange(90) * 4.0
    level = beams.lobe(exponent=6.0, c=70.0, gamma=35.0)(turn, np.degrees(np.arccos(z))[:, None])
    axis = beams.direction(c=70.0, gamma=35.0)
    mean = (beams.beam(200_000, exponent=6.0, c=70.0, gamma=35.0, seed=1) @ axis).mean()
    return [w @ level.mean(axis=1) * 2 * math.pi, mean], [1.0, 7.0 / 8.0]


def searchlight() -> tuple[Any, Any]:
    """Luminance of the ball over the opening of the mirror, as a far ray on the axis sees it."""
    scene = beams.searchlight()
    lamp, mirror = scene.sources[0], scene.surfaces[0]
    level = lamp.flux / (math.pi * 4 * math.pi * lamp.shape.radius**2)
    return beams.PEAK, mirror.finish.stated_reflectance * level * math.pi * mirror.shape.radius**2


def body(lamp: bodies.Body, area: float) -> Callable[[], tuple[Any, Any]]:
    """Φ = A π times the mean luminance over the surface, in directions by Lambert's law."""

    def routes() -> tuple[Any, Any]:
        rng, n = np.random.default_rng(4), 400_000
        x, normal = lamp.on_surface(n, rng)
        v = rng.normal(size=(n, 3))
        k = normal + v / np.linalg.norm(v, axis=1)[:, None]
        k /= np.linalg.norm(k, axis=1)[:, None]
        level = lamp.luminance(points=x + lamp.middle - 0.01 * k, directions=k)
        return lamp.total_flux, level.mean() * math.pi * area * sources.MM2

    return routes


def source(lamp: Any) -> Callable[[], tuple[Any, Any]]:
    """Φ = ∫ L dx dy dp dq over a plane above all that shines, to directions that are Lambertian upwards."""

    def routes() -> tuple[Any, Any]:
        rng, n = np.random.default_rng(5), 1_000_000
        x0, x1, y0, y1 = lamp.extent
        r, turn = np.sqrt(rng.random(n)), 2 * math.pi * rng.random(n)
        p, q = r * np.cos(turn), r * np.sin(turn)
        points = np.stack([rng.uniform(x0, x1, n), rng.uniform(y0, y1, n), np.zeros(n)], axis=1)
        k = np.stack([p, q, np.sqrt(1 - p * p - q * q)], axis=1)
        level = lamp.luminance(points=points, directions=k)
        return lamp.total_flux, level.mean() * math.pi * (x1 - x0) * (y1 - y0) * sources.MM2

    return routes


def dome() -> tuple[Any, Any]:
    """The same over the hemisphere of the dome, to Lambertian directions about its normals."""
    lamp, rng, n = sources.DieUnderDome(), np.random.default_rng(6), 1_000_000
    v, k = rng.normal(size=(2, n, 3))
    normal = v / np.linalg.norm(v, axis=1)[:, None]
    normal[:, 2] = np.abs(normal[:, 2])
    k = normal + k / np.linalg.norm(k, axis=1)[:, None]
    k /= np.linalg.norm(k, axis=1)[:, None]
    level = lamp.luminance(points=lamp.radius * normal, directions=k)
    return lamp.total_flux, level.mean() * math.pi * 2 * math.pi * lamp.radius**2 * sources.MM2


def thesis_table() -> tuple[Any, Any]:
    """The same intensity in all bins: the table has it, and E is what the last half bin loses against the edge."""
    pixel = gridded.Pixel(np.eye(3))
    thetas, phis = gridded.bin_ranges(theta_step=15, phi_step=60)
    for (low, high), (left, right) in itertools.product(thetas, phis):
        omega = math.radians(right - left) * (math.cos(math.radians(low)) - math.cos(math.radians(high)))
        towards = beams.direction(c=(left + right) / 2, gamma=(low + high) / 2)
        pixel.add(towards, 2.5 * omega)
    centres, table = gridded.table(pixel, theta_step=15, phi_step=60)
    lost = 50 * math.cos(math.radians(centres[-2]))
    return [*table[:-1].ravel(), gridded.flux_error(pixel, theta_step=15, phi_step=60)], [2.5] * table[:-1].size + [
        lost
    ]


def equal_cells() -> tuple[Any, Any]:
    cells = gridded.spherical_cells(4)
    found = [(math.cos(a) - math.cos(b)) * (d - c) for a, b, c, d in cells]
    return found, np.full(len(found), 2 * math.pi / len(found))


def measures() -> tuple[Any, Any]:
    """1 + k times an image is off by k times its root mean square; what is correlated by half has a measure of 1/√2."""
    truth = images.limb(64)
    rng = np.random.default_rng(3)
    one, other = rng.normal(size=(2, 400, 400))
    rms = math.sqrt(float((truth**2).mean())) / truth.max()
    return [images.nrmse(1.2 * truth, truth=truth), images.ncc(one + other, truth=one)], [0.2 * rms, math.sqrt(0.5)]


def best_gaussian() -> tuple[Any, Any]:
    """Without noise the narrowest is the best, and what it takes off a sharp image is the error."""
    truth = images.disk(64)
    smooth = images.gaussian_filter(truth, images.WIDTHS[0], mode="reflect", truncate=5)
    off = math.sqrt(float(((smooth * truth.sum() / smooth.sum() - truth) ** 2).mean())) / truth.max()
    return images.oracle_gaussian(truth, truth=truth), (off, np.corrcoef(smooth.ravel(), truth.ravel())[0, 1])


def film() -> tuple[Any, Any]:
    """A film of air lets everything through."""
    rng = np.random.default_rng(1)
    towards = np.abs(rng.normal(size=(1000, 3))) + np.array([-1.0, -0.5, 0.1])
    return prismatic_film.seen_through(towards, index=1.0, thickness=0.7, rng=rng).mean(), 1.0


def ball_met() -> tuple[Any, Any]:
    """Where a line meets a unit ball, d = −o·k ± √((o·k)² − o² + 1), at cosines ∓√((o·k)² − o² + 1)."""
    shape = {"kind": "quadric", "r2": 1.0, "z2": 1.0, "z1": 0.0, "z0": -1.0, "r": (0.0, 2.0), "z": (-2.0, 2.0)}
    face = {"shape": shape, "frame": [0.1, 0.2, 0.3, 1, 0, 0, 0, 1, 0, 0, 0, 1], "trims": [], "flip": False}
    o, k = np.array([-3.0, 0.5, 0.1]), np.array([0.96, 0.0, 0.28])
    found = border.hits([face], o=o, d=k)
    away = o - [0.1, 0.2, 0.3]
    half = math.sqrt((away @ k) ** 2 - away @ away + 1.0)
    expected = [(-away @ k - half, -half), (-away @ k + half, half)]
    return [hit[:2] for hit in found], expected


def divided() -> tuple[Any, Any]:
    vertices, triangles = meshes.divided_sphere(5)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6, 4 / 3 * math.pi


def eight_bits() -> tuple[Any, Any]:
    values = np.geomspace(1e-3, 1e6, 50)
    return [map_files.eight_bits(float(value)) for value in values], values


ROUTES: dict[str, tuple[Callable[[], tuple[Any, Any]], float]] = {
    "cavity": (cavity, 1e-5),
    "cone": (plain_cone, 1e-6),
    "quadrilateral by the cone": (quarter_by_cone, 1e-4),
    # 400 000 rays: 23 000 in the dimmest quarter.
    "quadrilateral by rays": (quarters_by_rays, 0.025),
    "table": (table_by_quadrature, 2e-3),
    "hats": (hats, 1e-3),
    "trapezium": (trapezium, 1e-4),
    "lobe and beam": (lobes, 2e-3),
    "searchlight": (searchlight, 1e-12),
    # Spread of the luminance over a million lines: 0.1 to 0.25 %.
    "globe": (body(bodies.Globe(), 4 * math.pi * 2.5**2), 5e-3),
    "block": (body(bodies.Block(), 8 * (1.5 * 0.6 + 0.6 * 2.2 + 2.2 * 1.5)), 5e-3),
    "rod": (body(bodies.Rod(), 2 * math.pi * 1.1 * (1.1 + 4.6)), 5e-3),
    "disk": (source(sources.LimbDarkenedDisk()), 5e-3),
    "film source": (source(sources.PrismaticFilm()), 1e-2),
    "led": (source(sources.StructuredLed()), 5e-3),
    "dome": (dome, 2e-2),
    "gridded table": (thesis_table, 1e-12),
    "equal cells": (equal_cells, 1e-12),
    "measures": (measures, 1e-2),
    "best Gaussian": (best_gaussian, 1e-12),
    "prismatic film": (film, 1e-12),
    "hits": (ball_met, 1e-12),
    "divided sphere": (divided, 5e-3),
    "eight bits": (eight_bits, 2**-8),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ROUTES)
def test_two_routes_agree_and_five_per_cent_are_found(name: str) -> None:
    routes, tolerance = ROUTES[name]
    found, expected = (np.asarray(value, dtype=np.float64) for value in routes())
    np.testing.assert_allclose(found, expected, rtol=tolerance)
    for factor in (1.05, 0.95):
        assert (np.abs(factor * found - expected) > tolerance * np.abs(expected)).all()
