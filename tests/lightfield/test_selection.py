"""The automatic surface against sources whose best surface is known; start points are scattered: lines alone tell."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Box, Cylinder, Disk, Dome, Hemisphere, Plane, Sphere
from etendue.lightfield.selection.scorer import SurfaceScorer
from etendue.lightfield.selection.search import SurfaceChoice, choose_surface, told_apart
from etendue.lightfield.selection.settings import SelectionSettings
from etendue.quantities.report import RayFileWarning
from oracles.bodies import Block, Globe, Rod
from oracles.sources import DieUnderDome, LimbDarkenedDisk, PrismaticFilm, StructuredLed

Array = npt.NDArray[np.float64]

N, MANY = 20_000, 40_000

QUICK = SelectionSettings(one_fold_from=1, search_one_fold_from=1)
"""One fold is held out: for what must not matter, however well the surfaces are told apart."""
MOVE = np.array([0.3, -0.2, 0.75])
"""So that no depth is zero, and none is at an axis."""


def scattered(position: Array, direction: Array, reach: float, seed: int = 5) -> tuple[Array, Array]:
    """The same lines, with start points anywhere within `reach` along them."""
    return position + direction * np.random.default_rng(seed).uniform(-reach, reach, (len(position), 1)), direction


def rays_of(position: Array, direction: Array, **more: object) -> et.RaySet:
    return et.RaySet(position, direction, np.ones(len(position)), **more)  # type: ignore[arg-type]


def led_lines(n: int = N) -> tuple[Array, Array]:
    position, direction = StructuredLed().rays(n, seed=1)
    return scattered(position + MOVE, direction, 3.0)


@pytest.fixture(scope="module")
def led_choice() -> SurfaceChoice:
    return choose_surface(rays_of(*led_lines()))


# --- flat sources ------------------------------------------------------------------------------------------------------

FLAT = {
    # source, kind, radius of the source [mm], largest error of the depth in such radii
    # Its cut-offs move with the place, so that what is within its rim hardly tells the depth.
    "film": (PrismaticFilm(), Disk, 11.2, 2e-3),
    "led": (StructuredLed(), Plane, 0.6, 2e-3),
    "die": (DieUnderDome(), Plane, 1.264, 0.01),
    "die in a scattering dome": (DieUnderDome(floor=0.3), Dome, 1.264, 0.01),
}
"""Five seeds gave less. A dome's image of its die is curved: the best plane is some thousandths of the radius beside it."""


@pytest.mark.slow
@pytest.mark.parametrize("name", list(FLAT))
def test_a_flat_source_is_found_at_its_depth(name: str, led_choice: SurfaceChoice) -> None:
    source, kind, radius, error = FLAT[name]
    if name == "led":
        choice = led_choice
    else:
        # What a dome blurs takes more rays.
        position, direction = source.rays(N if name == "film" else MANY, seed=1)  # type: ignore[attr-defined]
        choice = choose_surface(rays_of(*scattered(position + MOVE, direction, 0.3 * radius)))
    surface = choice.surface
    assert type(surface) is kind
    assert isinstance(surface, Plane | Disk | Dome)
    assert surface.z == pytest.approx(MOVE[2], abs=error * radius)
    assert choice.depths is not None
    low, high = choice.depths
    assert low < surface.z < high
    slack = 2e-3 * radius if isinstance(source, DieUnderDome) else 0.0
    assert low - slack < MOVE[2] < high + slack
    assert high - low < 0.05 * radius
    x0, x1, y0, y1 = source.extent  # type: ignore[attr-defined]
    if name == "die":  # it magnifies the die by its index; light that it scatters comes from all of the dome
        assert isinstance(surface, Plane)
        assert 1.5 < surface.closed("width") < 2.02 * radius
        assert 1.35 < surface.closed("height") < 2.02 * radius
    elif isinstance(surface, Plane):
        assert (surface.width, surface.height) == pytest.approx((x1 - x0, y1 - y0), rel=0.01)
    else:
        assert surface.radius == pytest.approx(radius, rel=0.01)
    assert surface.centre == pytest.approx(np.add(MOVE[:2], [(x0 + x1) / 2, (y0 + y1) / 2]), abs=0.07 * radius)
    (row,) = (row for row in choice.table if row.surface == surface)
    assert (row.lag, row.lag_error) == (0.0, 0.0)
    assert row.unmet < 0.01
    # Once for each kind, and once more if the focused plane is not the plane itself.
    assert [type(row.surface) for row in choice.table].count(kind) <= (2 if kind is Plane else 1)
    told = next(note for note in choice.notes if note.startswith("depths between "))
    bounds = [float(word) for word in told.removeprefix("depths between ").partition(" mm")[0].split(" and ")]
    assert bounds == pytest.approx([low, high], abs=0.02 * (high - low))


# --- lamps that shine all round ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_globe_is_a_sphere() -> None:
    globe = Globe()
    choice = choose_surface(rays_of(*scattered(*globe.rays(N, seed=1), 3.0)))
    assert isinstance(choice.surface, Sphere)
    assert choice.surface.radius == pytest.approx(globe.radius, rel=0.01)
    assert choice.surface.centre == pytest.approx(globe.middle, abs=0.01 * globe.radius)
    assert choice.depths is None  # light in all directions: no plane was tried


@pytest.mark.slow
def test_the_upper_half_of_a_globe_is_a_hemisphere() -> None:
    globe = Globe()
    position, direction = globe.rays(2 * N, seed=1)
    upper = position[:, 2] > globe.middle[2]
    choice = choose_surface(rays_of(*scattered(position[upper], direction[upper], 3.0)))
    assert isinstance(choice.surface, Hemisphere)
    assert choice.surface.radius == pytest.approx(globe.radius, rel=0.02)
    assert choice.surface.centre == pytest.approx(globe.middle, abs=0.02 * globe.radius)


@pytest.mark.slow
def test_a_rod_is_a_cylinder() -> None:
    rod = Rod()
    choice = choose_surface(rays_of(*scattered(*rod.rays(N, seed=1), 3.0)))
    surface = choice.surface
    assert isinstance(surface, Cylinder)
    assert surface.radius == pytest.approx(rod.radius, rel=0.01)
    ends = rod.middle[2] - rod.height / 2, rod.middle[2] + rod.height / 2
    assert (surface.bottom, surface.top) == pytest.approx(ends, abs=0.01 * rod.height)
    assert surface.centre == pytest.approx(rod.middle[:2], abs=0.01 * rod.radius)


@pytest.mark.slow
@pytest.mark.parametrize("reach", [0.0, 3.0], ids=["by its start points", "by its lines"])
def test_a_block_is_a_box(reach: float) -> None:
    block = Block()
    choice = choose_surface(rays_of(*scattered(*block.rays(N, seed=1), reach)), settings=QUICK)
    surface = choice.surface
    assert isinstance(surface, Box)
    error = 0.02 if reach else 1e-3
    assert (surface.width, surface.height, surface.depth) == pytest.approx(2 * np.array(block.half), abs=2 * error)
    assert surface.centre == pytest.approx(block.middle, abs=error)
    (row,) = (row for row in choice.table if row.surface == surface)
    assert row.unmet < 1e-3


# --- what must not matter ----------------------------------------------------------------------------------------------


def assert_alike(choice: SurfaceChoice, other: SurfaceChoice, length: float = 1.0, move: float = 0.0) -> None:
    """The same plane, its lengths times a factor, then moved along X, Y and Z."""
    a, b = choice.surface, other.surface
    assert isinstance(a, Plane)
    assert isinstance(b, Plane)
    assert (b.width, b.height) == pytest.approx((a.width * length, a.height * length), rel=1e-6)  # type: ignore[operator]
    assert b.z == pytest.approx(a.z * length + move, abs=1e-6 * length)
    assert b.centre == pytest.approx([c * length + move for c in a.centre], abs=1e-6 * length)  # type: ignore[union-attr]


@pytest.fixture(scope="module")
def quick_choice() -> SurfaceChoice:
    return choose_surface(rays_of(*led_lines(5000)), settings=QUICK)


@pytest.mark.slow
def test_the_unit_of_length_does_not_matter(quick_choice: SurfaceChoice) -> None:
    position, direction = led_lines(5000)
    assert_alike(quick_choice, choose_surface(rays_of(position * 1e-3, direction), settings=QUICK), length=1e-3)


@pytest.mark.slow
def test_the_number_of_threads_does_not_matter_nor_the_unit_of_flux(quick_choice: SurfaceChoice) -> None:
    other = choose_surface(rays_of(*led_lines(5000), flux_unit="W"), threads=1, settings=QUICK)
    assert (other.surface, other.table, other.depths) == (quick_choice.surface, quick_choice.table, quick_choice.depths)


@pytest.mark.slow
def test_where_the_source_is_does_not_matter(led_choice: SurfaceChoice) -> None:
    """So far off that coordinates have no more than ten digits for the source."""
    move = 1e6
    position, direction = led_lines()
    choice = choose_surface(rays_of(position + move, direction), settings=QUICK)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.z == pytest.approx(MOVE[2] + move, abs=2e-3)
    assert choice.surface.area == pytest.approx(led_choice.surface.area, rel=0.01)


@pytest.mark.slow
def test_where_on_their_lines_rays_start_does_not_matter(led_choice: SurfaceChoice) -> None:
    choice = choose_surface(rays_of(*scattered(*led_lines(), 1000.0)), settings=QUICK)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.z == pytest.approx(MOVE[2], abs=2e-3)
    assert choice.surface.area == pytest.approx(led_choice.surface.area, rel=0.01)


@pytest.mark.slow
def test_start_points_on_a_plane_of_any_depth_do_not_hide_the_source() -> None:
    """Rays stopped at an exit plane, far above what shines."""
    position, direction = led_lines()
    at_plane = position + ((5.0 - position[:, 2]) / direction[:, 2])[:, None] * direction
    choice = choose_surface(rays_of(at_plane, direction), settings=QUICK)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.z == pytest.approx(MOVE[2], abs=2e-3)


@pytest.mark.slow
def test_strays_far_off_do_not_matter(led_choice: SurfaceChoice) -> None:
    position, direction = (values.copy() for values in led_lines(MANY))
    rng = np.random.default_rng(3)
    position[:400], direction[:400] = rng.normal(size=(400, 3)) * 100, rng.normal(size=(400, 3))
    choice = choose_surface(rays_of(position, direction / np.linalg.norm(direction, axis=1)[:, None]), settings=QUICK)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.z == pytest.approx(MOVE[2], abs=4e-3)
    assert choice.surface.area == pytest.approx(led_choice.surface.area, rel=0.02)
    (row,) = (row for row in choice.table if row.surface == choice.surface)
    assert 0.001 < row.unmet < 0.011  # the strays


@pytest.mark.slow
def test_rays_without_a_place_do_not_matter() -> None:
    position, direction = (values.copy() for values in led_lines())
    broken = np.arange(0, N, 2500)
    position[broken, 1] = np.nan
    rays = rays_of(position, direction)
    with pytest.warns(RayFileWarning, match="8 of 20,000 rays have a coordinate.*not finite"):
        assert rays.complaints
    choice = choose_surface(rays)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.z == pytest.approx(MOVE[2], abs=2e-3)


# --- sources at the edge of what can be told ---------------------------------------------------------------------------


@pytest.mark.slow
def test_a_point_is_where_its_rays_meet() -> None:
    rng = np.random.default_rng(4)
    turn, square = rng.random(1500) * 2 * np.pi, 0.9 * rng.random(1500)
    k = np.stack([np.sqrt(square) * np.cos(turn), np.sqrt(square) * np.sin(turn), np.sqrt(1 - square)], axis=1)
    choice = choose_surface(rays_of(np.array([0.5, 0.3, 2.0]) + 5 * k, k), settings=QUICK)
    middle = np.mean([part.centre for part in choice.surface.parts()], axis=0)
    assert middle == pytest.approx([0.5, 0.3, 2.0], abs=1e-6)
    assert choice.surface.area < 1e-12


@pytest.mark.slow
def test_a_beam_keeps_its_cross_section() -> None:
    """Any depth is as good for it: it stays where the rays start."""
    towards = (0.3, 0.1, 0.9)
    rng = np.random.default_rng(5)
    position = np.column_stack([rng.uniform(-1, 1, (2000, 2)) * [1.0, 0.6], np.full(2000, 4.0)])
    choice = choose_surface(
        rays_of(position, np.tile(np.array(towards) / np.linalg.norm(towards), (2000, 1))), settings=QUICK
    )
    surface = choice.surface
    assert isinstance(surface, Plane)
    assert (surface.width, surface.height, surface.z) == pytest.approx((2.0, 1.2, 4.0), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_glow_about_a_chip_is_no_stray_light(seed: int) -> None:
    """A ring of 3 to 5 mm with 2 % of the light about a chip of 1 mm: far off and faint, but twice what may be left out."""
    rng, n = np.random.default_rng(seed), 4000
    turn, sine, around = 2 * np.pi * rng.random(n), np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    k = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)], axis=1)
    ring = np.sqrt(rng.uniform(9, 25, n))[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1)
    glows = np.arange(n) < 80
    place = np.where(glows[:, None], ring, rng.uniform(-0.5, 0.5, (n, 2)))
    choice = choose_surface(rays_of(np.column_stack([place, np.zeros(n)]), k), settings=QUICK)
    (row,) = (row for row in choice.table if row.surface == choice.surface)
    assert row.unmet < 0.01


@pytest.mark.slow
def test_light_towards_minus_z_gets_a_closed_surface_and_a_hint() -> None:
    position, direction = led_lines(5000)
    choice = choose_surface(rays_of(position * [1, -1, -1], direction * [1, -1, -1]), settings=QUICK)
    assert not isinstance(choice.surface, Plane | Disk | Hemisphere | Dome)
    assert choice.depths is None
    assert choice.table[0].unmet < 0.01
    assert any("rays.rotated" in note for note in choice.notes)


@pytest.mark.slow
@pytest.mark.parametrize("back", [0.0, 30.0])
def test_a_panel_aslant_gets_a_plane_that_looks_there(back: float) -> None:
    """Of 2 mm × 1 mm, its normal 40° from +Z: exactly there if rays start on it, and if not by their mean direction.

    Where it is exact, the plane predicts held-out rays as well as that of the upright panel does, whose rays these are.
    """
    rng = np.random.default_rng(8)
    turn, sine = 2 * np.pi * rng.random(4000), np.sqrt(rng.random(4000))
    k = np.stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)], axis=1)
    position = np.column_stack([rng.uniform(-1, 1, (4000, 2)) * [1.0, 0.5], np.full(4000, 0.3)])
    upright = rays_of(position - back * k, k)
    choice = choose_surface(upright.rotated((0, 1, 0), 40), settings=QUICK)
    assert isinstance(choice.surface, Plane)
    assert choice.surface.towards is not None
    found, normal = np.array(choice.surface.towards), [np.sin(np.radians(40)), 0.0, np.cos(np.radians(40))]
    off = np.degrees(np.arctan2(np.linalg.norm(np.cross(found, normal)), found @ normal))
    assert off < (3.0 if back else 1e-4)
    box = next(row for row in choice.table if row.surface.NAME == "box")
    assert box.lag > 3 * box.lag_error
    assert (choice.table[0].surface, choice.surface.z) == (choice.surface, pytest.approx(0.3, abs=0.02))
    before = choose_surface(upright, settings=QUICK)
    assert isinstance(before.surface, Plane)
    assert before.surface.towards is None
    if not back:
        assert (choice.surface.width, choice.surface.height) == pytest.approx((2.0, 1.0), rel=2e-3)
        assert choice.table[0].score == pytest.approx(before.table[0].score, abs=0.01)


@pytest.mark.slow
def test_too_few_rays_say_what_to_do() -> None:
    position, direction = led_lines(25)
    with pytest.raises(ArgumentError, match=r"24 rays with flux are too few.*surface.*sphere"):
        choose_surface(rays_of(position[:24], direction[:24]))
    surface = choose_surface(rays_of(position, direction)).surface
    assert surface.area < 20.0  # of a die of 1 mm²: crude, but no nonsense
    with pytest.raises(ArgumentError, match="no flux"):
        choose_surface(et.RaySet(position, direction, np.zeros(25)))


# --- the scorer ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("weighted", [False, True])
def test_no_surface_predicts_better_than_the_truth(weighted: bool) -> None:
    """Gibbs' inequality: the densities add up to one. And the right surface comes close."""
    source = LimbDarkenedDisk()
    position, direction = source.rays(2 * N, seed=3)
    density = source.luminance(points=position, directions=direction) * 1e-6 / source.total_flux
    weights = np.random.default_rng(6).gamma(2.0, 1.0, 2 * N) if weighted else np.ones(2 * N)
    rays = et.RaySet(position, direction, weights)
    scorer = SurfaceScorer.of(rays, 1.0 / (4 * np.pi**2 * source.radius**2), 1, 1)
    out = scorer.fold == 0
    truth = np.log(density[out])
    shares = weights[out] / weights[out].sum()
    surfaces = [
        Disk(radius=source.radius * 1.001, centre=source.centre),
        Disk(radius=2 * source.radius, z=1.0),
        Sphere(radius=15.0),
        Dome(radius=13.0, window=6.0),
        Plane(width=8.0, height=9.0, centre=(0.0, 0.0)),
    ]
    lags = []
    for held_out in scorer.score_all([(surface.parts(), (4, 3)) for surface in surfaces]):
        apart = truth - held_out.score.values
        lag = float(shares @ apart)
        assert lag > -4 * np.sqrt(shares**2 @ (apart - lag) ** 2)
        lags.append(lag)
    assert lags[0] == min(lags)
    assert lags[0] < 0.01


# --- real files --------------------------------------------------------------------------------------------------------

FILES = {
    # A rod of 0.8 × 6 mm along Y: the start points lie on its facets, within 0.004 mm of the circle.
    "speos_pyspeos_Rays.ray": Cylinder(radius=0.4, bottom=-3.0, top=3.0, centre=(0.0, 31.75), axis="y"),
    # Lines from a rod of 1.3 × 4.1 mm about Z; the start points, in a cube of 20 mm, do not show it.
    "Cyl10k.1.tm25ray": Cylinder(radius=0.65, bottom=9.0, top=13.1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(FILES))
def test_a_real_file_gets_the_surface_an_engineer_would_choose(samples: Path, name: str) -> None:
    found, wanted = choose_surface(et.read_rays(samples / "rays" / name)).surface, FILES[name]
    assert type(found) is type(wanted)
    for field in dataclasses.fields(wanted):
        value = getattr(wanted, field.name)
        assert getattr(found, field.name) == (value if isinstance(value, str) else pytest.approx(value, abs=0.01))


@pytest.mark.slow
def test_notes_name_all_that_was_compared(led_choice: SurfaceChoice) -> None:
    choice = led_choice
    assert choice.surface.told in choice.notes[0]
    assert "32,768" in choice.notes[0] or f"{N:,}" in choice.notes[0]
    for row in choice.table:
        assert row.surface.NAME in choice.notes[0]
    assert json.dumps(choice.notes)


@pytest.mark.parametrize("z", [0.0, 1.0, -10_000.0, 3e6])
@pytest.mark.parametrize("apart", [2.0, 0.01, 3e-4])
def test_depths_that_differ_are_told_apart(z: float, apart: float) -> None:
    """The texts, read again, are as far apart as the depths, to one per cent."""
    low, high = map(float, told_apart(z - apart / 3, z + 2 * apart / 3))
    assert high - low == pytest.approx(apart, rel=0.01)


@pytest.mark.slow
def test_the_choice_is_told_in_the_words_of_the_trade() -> None:
    """What was chosen and why; every other surface with its distance, and a reason if it predicts better."""
    choice = choose_surface(et.RingSource(rays=20_000))
    told = choice.notes[0]
    assert told.startswith(f"carrier surface {choice.surface.told}: ")
    assert "better than others" not in told
    for row in choice.table:
        if row.surface == choice.surface:
            continue
        figure = f"{row.surface.NAME} {-row.lag:+.4f} ± {row.lag_error:.4f}".replace("-", "−")
        assert figure in told
        reason = told.split(figure)[1].split(f" {choice.table[0].surface.NAME} ")[0]
        if row.lag <= 0.0:
            assert "not for sure better" in reason or "does not meet it" in reason
