"""The page's own modules in Node: they read light fields as the core does."""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
from importlib import resources
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.viewer.field_tables import FieldTables
from etendue.viewer.subjects import map_subject
from oracles.light_fields import SURFACES, make_field
from oracles.packaged_led import PackagedLed
from scipy import ndimage

from viewer.views import page_views

Array = npt.NDArray[np.float64]

ERROR_BOUND = 0.035
"""Of standard errors: half of the step of their logarithm is 0.03, and the value that they are relative to is off too."""


@pytest.fixture(scope="module")
def modules(node: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder from which Node can import them."""
    folder = tmp_path_factory.mktemp("page")
    for file in resources.files("etendue.viewer").joinpath("page").iterdir():
        if file.name.endswith(".js"):
            (folder / file.name).write_text(file.read_text("utf-8"), encoding="utf-8")
    (folder / "node").symlink_to(node)
    (folder / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    return folder


def run(modules: Path, code: str, data: Any) -> Any:
    """What a piece of JavaScript prints, given data as `data`."""
    (modules / "data.json").write_text(json.dumps(data), encoding="utf-8")
    head = 'import { readFileSync } from "node:fs";\nconst data = JSON.parse(readFileSync("data.json", "utf-8"));\n'
    (modules / "try.js").write_text(head + code, encoding="utf-8")
    done = subprocess.run(
        [str(modules / "node"), "try.js"], cwd=modules, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


READ = """
import { Field } from "./field.js";
import { View } from "./view.js";
const field = await Field.read(data.field);
const found = data.views.map((one) => {
  const view = new View({ ...one, columns: data.columns, rows: data.rows });
  const values = [];
  for (let row = 0; row < view.rows; row++) {
    for (let column = 0; column < view.columns; column++) {
      const { value, error } = field.pixel(view, column, row);
      values.push([value, error]);
    }
  }
  return values;
});
console.log(JSON.stringify(found));
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_pixels_are_those_of_the_cores_map(modules: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Value within the bound that the page states, error within that of its steps, on every surface, edges among them.

    No part of the surfaces is thinner than two pixels here: of those that are the core adds up the light over their outline.
    """
    # What a screen misses is told by rays that are drawn for each, and is not looked at here.
    monkeypatch.setattr("etendue.luminance.estimate._with_missed", lambda _, maps, __=None: maps)
    field = make_field(SURFACES[name], seed=8)
    tables = FieldTables.of(field)
    columns, rows = 12, 8
    views = [
        *page_views(count=8, columns=columns, rows=rows, seed=9, closer=6.0),
        *page_views(count=16, columns=columns, rows=rows, seed=10, closer=30.0),
    ]
    data = {"field": tables.packed(), "views": [v.page for v in views], "columns": columns, "rows": rows}
    found = np.array(run(modules, READ, data)).reshape(len(views), rows, columns, 2)
    lit = edges = 0
    for view, pixels in zip(views, found, strict=True):
        lmap = et.luminance_map(field, view.observer, view.screen)
        bright = lmap.values > 0
        assert ((pixels[..., 0] > 0) == bright).all()
        assert np.abs(pixels[..., 0][bright] / lmap.values[bright] - 1).max(initial=0) < tables.bound + 1e-6
        assert np.abs(pixels[..., 1][bright] / lmap.standard_error[bright] - 1).max(initial=0) < ERROR_BOUND
        lit += int(bright.sum())
        edges += int((bright & ~ndimage.binary_erosion(bright, border_value=1)).sum())
    assert lit > 50
    assert edges > 5


REGION = """
import { Field } from "./field.js";
import { measureRegion, measureSection } from "./readings.js";
import { View } from "./view.js";
const field = await Field.read(data.field);
const view = new View({ ...data.view, columns: data.columns, rows: data.rows });
const region = await measureRegion(field, view, data.corners, () => true);
const section = await measureSection(field, view, data.line, () => true);
console.log(JSON.stringify({ region, section }));
"""


@pytest.mark.slow
def test_figures_of_a_region_are_those_of_the_map(modules: Path) -> None:
    """Mean, extremes, percentiles, uniformity and intensity of the pixels whose middles lie in a triangle.

    The flux through it is π times area times the mean over places and directions, here by random numbers.
    """
    field = make_field(SURFACES["plane"], seed=8, cells=(4, 4, 4, 4))
    columns, rows = 40, 30
    view = page_views(count=1, columns=columns, rows=rows, seed=3)[0]
    page = {**view.page, "theta": 25.0, "width": 2.0, "target": [0.1, -0.4, 0.7]}
    observer = et.Observer(25.0, page["phi"], page["distance"], (0.1, -0.4, 0.7))
    screen = et.Screen(2.0, 1.5, columns, rows)
    corners = [[-0.813, -0.307], [0.709, -0.093], [0.117, 0.611]]
    line = [[-0.9, 0.05], [0.8, -0.1]]
    packed = FieldTables.of(field).packed()
    data = {"field": packed, "view": page, "corners": corners, "line": line, "columns": columns, "rows": rows}
    found = run(modules, REGION, data)
    region, section = found["region"], found["section"]

    truth = et.luminance_map(field, observer, screen, samples=4)
    x, y = np.meshgrid(screen.x, screen.y)
    turns = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True)
    ]
    inside = np.all(np.array(turns) > 0, axis=0)
    values = truth.values[inside]
    assert region["pixels"] == inside.sum() > 100
    bound = packed["bound"] + 1e-6
    expected = {
        "mean": values.mean(),
        "minimum": values.min(),
        "maximum": values.max(),
        "uniformity": values.min() / values.mean(),
        "intensity": (values * screen.cosine(observer)[inside]).sum() * screen.pixel_area * 1e-6,
    }
    for name, value in expected.items():
        assert region[name] == pytest.approx(value, rel=2 * bound), name
    assert region["percentiles"] == pytest.approx(np.quantile(values, [0.05, 0.5, 0.95]), rel=2 * bound)
    assert region["area"] == pytest.approx(inside.sum() * screen.pixel_area, rel=1e-9)

    # Points even in the pixels, directions of density cos/π about the screen's normal.
    rng = np.random.default_rng(5)
    right, up, toward = screen.axes(observer)
    n = 200_000
    middles = np.stack([x[inside], y[inside]], axis=1)
    share = middles[rng.integers(0, len(middles), n)] + (rng.random((n, 2)) - 0.5) * (2.0 / columns)
    sine, turn = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    k = (
        np.outer(sine * np.cos(turn), right)
        + np.outer(sine * np.sin(turn), up)
        + np.outer(np.sqrt(1 - sine**2), toward)
    )
    light = (
        field.luminance(np.array(observer.target) + share @ np.array([right, up]), k)[0] * np.pi * region["area"] * 1e-6
    )
    error = np.hypot(light.std() / np.sqrt(n), region["flux"]["error"])
    assert abs(light.mean() - region["flux"]["value"]) < 4 * error  # 6·10⁻⁵ by chance
    assert region["flux"]["error"] < 0.05 * region["flux"]["value"]

    # Each point of the section is the mean over a pixel of its own, at the core's four points of it: {i·3/4}.
    steps = np.arange(4)
    du, dv = (steps + 0.5) / 4 - 0.5, 0.5 - (steps * 3 % 4 + 0.5) / 4
    for point in (section[3], section[120], section[201]):
        place = np.array(line[0]) + point["at"] / np.hypot(1.7, 0.15) * (np.array(line[1]) - line[0])
        seen = place + np.stack([du, dv], axis=1) * (2.0 / columns)
        there = np.array(observer.target) + seen @ np.array([right, up])
        truth_here = field.luminance(there, observer.position - there)[0].mean()
        assert point["value"] == pytest.approx(truth_here, rel=bound)
    assert section[-1]["at"] + section[0]["at"] == pytest.approx(np.hypot(1.7, 0.15))


REGIONS_OF_MAP = """
import { PixelMap } from "./picture.js";
import { measureRegion } from "./readings.js";
import { View } from "./view.js";
const map = PixelMap.read(data.map);
const { height, ...first } = data.view;
let at = new View({ ...first, columns: data.columns, rows: data.rows });
if (data.shift) at = at.shifted(...data.shift);
const found = [];
for (const corners of data.regions) found.push(await measureRegion(map, at, corners, () => true));
console.log(JSON.stringify(found));
"""


def assert_figures_of(found: dict[str, Any], lmap: et.LuminanceMap, region: et.Region | et.PolygonRegion) -> None:
    """Those of `region_statistics`, area and intensity among them, to single precision."""
    truth = et.region_statistics(lmap, region)
    assert (found["pixels"], found["dead"]) == (truth.pixels, truth.dead_pixels)
    inside = region.mask(lmap.screen)
    apparent = lmap.screen.pixel_area * 1e-6 * lmap.screen.cosine(lmap.observer)
    for name, value in {
        "mean": truth.mean,
        "error": truth.mean_error,
        "maximum": truth.maximum,
        "minimum": truth.minimum,
        "uniformity": truth.uniformity,
        "diversity": truth.uniformity_of_extremes,
        "area": truth.area,
        "intensity": np.nansum((lmap.values * apparent)[inside]),
    }.items():
        assert found[name] == pytest.approx(value, rel=3e-7), name
    assert found["percentiles"] == pytest.approx([value for _, value in truth.percentiles], rel=3e-7)


def test_dead_pixels_of_a_map_count_as_in_region_statistics(modules: Path) -> None:
    """Of a map of few rays most pixels are dead: 0 ± 0 each, and what lies beyond the map is no pixel of it."""
    rings = et.RingSource(rays=100_000, seed=3)
    observer, screen = et.Observer(20, 30, 1000), et.Screen(40, 30, 40, 30)
    lmap = et.luminance_map(rings, observer, screen, method=et.Cone(acceptance=2))
    assert lmap.dead_pixels > 300
    subject = map_subject(lmap, "rings", "rings")
    corners = [[-25, -8.2], [11.3, -8.2], [11.3, 9.4], [-25, 9.4]]
    data = {"map": subject["map"], "view": subject["view"], "columns": 50, "rows": 40, "regions": [corners]}
    (found,) = run(modules, REGIONS_OF_MAP, data)
    assert_figures_of(found, lmap, et.Region(-25, 11.3, -8.2, 9.4))
    assert found["cut"]


PENTAGRAM = [(4 * math.sin(0.8 * math.pi * i) + 0.3, 4 * math.cos(0.8 * math.pi * i) - 0.2) for i in range(5)]
SHAPES = {
    "triangle": [(-6.1, -3.3), (5.2, -2.9), (1.1, 4.2)],
    "crosses itself": [(-5, -3), (5, 3), (5, -3), (-5, 3)],
    "pentagram": PENTAGRAM,
    "overhangs": [(-30, -2.1), (3.3, -2.1), (3.3, 40), (-30, 40)],
    "corners on middles": [(-2.5, -1.5), (3.5, -1.5), (3.5, 2.5), (-2.5, 2.5)],
}


@pytest.mark.parametrize("plane", ["view", "xy"])
@pytest.mark.parametrize("shift", [None, [1.75, -0.6]])
def test_figures_of_a_map_are_of_its_own_pixels(modules: Path, plane: str, shift: list[float] | None) -> None:
    """Seen from 40° and near, through a window of other pixels: those of `region_statistics`, and the intensity of the map.

    A screen in the xy plane has the cosine of its own observer, also after the picture was shifted under the region: a shift
    by so much on the page is one by so much on the map.
    """
    rng = np.random.default_rng(2)
    observer, screen = et.Observer(40, 65, 60, (0.4, -1, 2)), et.Screen(16, 10, 16, 10, plane)
    values = rng.uniform(10, 1000, screen.shape)
    values[rng.random(screen.shape) < 0.1] = np.nan
    lmap = et.LuminanceMap(values, values / 10, np.full(screen.shape, 7), observer, screen)
    subject = map_subject(lmap, "map", "map")
    data: dict[str, Any] = {"map": subject["map"], "view": subject["view"], "columns": 37, "rows": 31, "shift": shift}
    right, up = shift or (0.0, 0.0)
    whole = [(-9, -6), (9, -6), (9, 6), (-9, 6)]
    # What lies at a place of the page lies so much farther to the right and up on the map.
    data["regions"] = [[(x - right, y - up) for x, y in corners] for corners in (*SHAPES.values(), whole)]
    *found, all_of_it = run(modules, REGIONS_OF_MAP, data)
    for (name, corners), one in zip(SHAPES.items(), found, strict=True):
        assert_figures_of(one, lmap, et.PolygonRegion(corners))
        assert one["cut"] == (name == "overhangs"), name
    assert all_of_it["intensity"] == pytest.approx(lmap.intensity, rel=3e-7)
    assert all_of_it["area"] == pytest.approx(160)


REGIONS_OF_FIELD = """
import { Field } from "./field.js";
import { measureRegion } from "./readings.js";
import { View } from "./view.js";
const field = await Field.read(data.field);
const view = new View({ ...data.view, columns: data.columns, rows: data.rows });
const found = [];
for (const corners of data.regions) found.push(await measureRegion(field, view, corners, () => true));
console.log(JSON.stringify(found));
"""


def test_all_figures_of_a_region_are_of_the_same_pixels(modules: Path) -> None:
    """Area, mean, intensity and flux of a region that crosses itself, and of one that reaches beyond the picture.

    A plane of luminance L everywhere, in all directions: mean L, intensity L Σ A cos θ and flux π L A of the pixels that
    `PolygonRegion` holds. The bow tie's shoelace area is 0.
    """
    rough = make_field(et.Plane(z=0.7, width=6, height=5, centre=(0, 0)), cells=(1, 1, 1, 1), factors=None)
    (part,) = rough.parts
    one = np.ones((1, 1, 1, 1), dtype=np.float32)
    field = rough.replace(parts=(dataclasses.replace(part, ratio=one, deviation=0.02 * one),))
    level = part.level * 1e6
    view = {"theta": 0, "phi": 0, "distance": 30, "target": [0.2, -0.1, 0.7], "width": 4}
    screen, observer = et.Screen(4, 3, 40, 30), et.Observer(0, 0, 30, (0.2, -0.1, 0.7))
    shapes = {"bow tie": [(-1.03, -0.6), (1.03, 0.6), (1.03, -0.6), (-1.03, 0.6)]}
    shapes["overhangs"] = [(0.8, -0.9), (9.0, -0.9), (9.0, 0.4), (0.8, 0.4)]
    data = {"field": FieldTables.of(field).packed(), "view": view, "columns": 40, "rows": 30}
    found = run(modules, REGIONS_OF_FIELD, {**data, "regions": list(shapes.values())})
    for corners, figures in zip(shapes.values(), found, strict=True):
        inside = et.PolygonRegion(corners).mask(screen)
        area = inside.sum() * screen.pixel_area
        assert figures["pixels"] == inside.sum() > 100
        assert figures["area"] == pytest.approx(area, rel=1e-9)
        assert figures["mean"] == pytest.approx(level, rel=1e-9)
        assert figures["flux"]["value"] == pytest.approx(math.pi * level * area * 1e-6, rel=1e-9)
        apparent = (screen.cosine(observer) * screen.pixel_area * 1e-6)[inside].sum()
        assert figures["intensity"] == pytest.approx(level * apparent, rel=1e-9)
    assert [figures["cut"] for figures in found] == [False, True]


@pytest.mark.slow
def test_the_error_of_a_flux_is_that_of_the_rays(modules: Path) -> None:
    """Of fields of 20 000 rays of an LED, whose flux through a plane is known by quadrature, in regions large and small.

    The root mean square of z is below 1.3, of 3 fields and 4 regions, whose light is partly the same: of 6 independent
    ones it would be 1.9 by 10⁻³. The error is not many times too large either: it is the counting error, which a field
    undercuts where it smooths, here by up to some six times.
    """
    led, z, cells = PackagedLed(), -0.2368, 40
    around = et.Plane(
        z=z, width=2.8, height=2.5, centre=(0.2, -0.12), focus=(-0.272, 0.196, 0.15, -0.073), frames=2, rest=11
    )
    truth = led.exitance(z=z, side=led.side, cells=cells, directions=16)
    # In columns from the left and rows from below.
    boxes = {"half": (6, 33, 5, 34), "part": (10, 17, 12, 21), "beside": (1, 4, 1, 30), "small": (24, 27, 21, 23)}
    step = led.side / cells
    regions = []
    for left, right, bottom, top in boxes.values():
        xs, ys = ([end * step - led.side / 2 for end in ends] for ends in ((left, right), (bottom, top)))
        regions.append([(xs[0], ys[0]), (xs[1], ys[0]), (xs[1], ys[1]), (xs[0], ys[1])])
    view = {"theta": 0, "phi": 0, "distance": 500, "target": [*led.centre, z], "width": led.side}
    scores = []
    for seed in range(1, 4):
        position, direction = led.rays(20_000, seed=seed)
        rays = et.RaySet(position, direction, np.full(len(position), led.total_flux / len(position)))
        packed = FieldTables.of(et.LightField.fit(rays, around, depths=(4, 4, 3, 3), seed=seed)).packed()
        data = {"field": packed, "view": view, "columns": cells, "rows": cells, "regions": regions}
        for (left, right, bottom, top), one in zip(boxes.values(), run(modules, REGIONS_OF_FIELD, data), strict=True):
            assert one["pixels"] == (right - left) * (top - bottom)
            flux = truth[bottom:top, left:right].sum()
            scores.append((one["flux"]["value"] - flux) / one["flux"]["error"])
    z_scores = np.array(scores).reshape(-1, len(boxes))
    assert np.sqrt((z_scores**2).mean()) < 1.3
    assert np.sqrt((z_scores**2).mean(axis=0)).min() > 0.1


NUMBERS = """
import { measured, plain, prefixed, ticks, typed, withUnit } from "./numbers.js";
console.log(JSON.stringify([
  measured(3041234, 22345, "cd/m²"), measured(0.0123, 0.0004, "cd/m²"), measured(5, 0, "lx"), measured(NaN, 1, "lx"),
  withUnit(999.97, "cd"), withUnit(0, "cd"), plain(-12.345, 3), plain(123456789, 3), prefixed(2e9, "cd/m²"),
  ticks(0, 3.3, 6, false), ticks(0.02, 30, 4, true), typed(" 1,5 "), String(typed("x")),
]));
"""


def test_numbers_have_the_digits_that_are_known(modules: Path) -> None:
    assert run(modules, NUMBERS, {}) == [
        "3.041 ± 0.022 Mcd/m²",
        "12.30 ± 0.40 mcd/m²",
        "5.000 lx",
        "no value",
        "1.000 kcd",
        "0.000 cd",
        "−12.3",
        "1.23e+8",
        [1e9, "Gcd/m²"],
        pytest.approx([0, 1, 2, 3]),
        pytest.approx([0.1, 1, 10]),
        1.5,
        "NaN",
    ]


COLOURS = """
import { COLOUR_MAPS, coloursOf } from "./colours.js";
console.log(JSON.stringify(Object.fromEntries(COLOUR_MAPS.map((name) => [name, coloursOf(name)]))));
"""


def test_colours_are_those_of_the_pictures(modules: Path) -> None:
    """Mixed between 33 stops, they differ from matplotlib's 256 by less than can be told apart: 5 of 255."""
    matplotlib = pytest.importorskip("matplotlib")
    found = run(modules, COLOURS, {})
    assert {"inferno", "viridis", "cividis"} <= set(found)
    t = np.linspace(0, 1, 256)
    for name, stops in found.items():
        mixed = np.stack([np.interp(t, np.linspace(0, 1, len(stops)), np.array(stops)[:, i]) for i in range(3)], axis=1)
        assert np.abs(mixed - 255 * matplotlib.colormaps[name](t)[:, :3]).max() < 5


ORBIT = """
import { View } from "./view.js";
import { projected } from "./geometry.js";
const view = new View({ ...data, columns: 40, rows: 30 });
const turned = view.orbited(7, -4);
const point = [0.3, 1.1, -0.4];
const seen = projected(view, ...point);
console.log(JSON.stringify({
  axes: [view.right, view.up, view.toward], eye: view.eye, turned: [turned.theta, turned.phi, turned.toward],
  seen,
  line: view.line((seen[0] / view.width + 0.5) * 40, (0.5 - seen[1] / view.height) * 30),
  behind: projected(view, ...view.toward.map((x) => 2000 * x)),
}));
"""


def test_views_are_observers_and_screens(modules: Path) -> None:
    """Axes and eye of the core's conventions; a point is seen where the line of sight through that place meets it."""
    page, observer, screen = page_views(count=3, columns=40, rows=30, seed=6)[2]
    found = run(modules, ORBIT, page)
    np.testing.assert_allclose(found["axes"], screen.axes(observer), atol=1e-12)
    np.testing.assert_allclose(found["eye"], observer.position, atol=1e-9)
    point, direction = np.array(found["line"])
    np.testing.assert_allclose(np.cross(np.array([0.3, 1.1, -0.4]) - point, direction), 0.0, atol=1e-9)
    assert found["behind"] is None
    theta, phi, toward = found["turned"]
    np.testing.assert_allclose(et.Observer(theta, phi, 1).direction, toward, atol=1e-12)
    right, up, before = screen.axes(observer)
    angle = np.radians(np.hypot(7, 4))
    assert np.dot(toward, before) == pytest.approx(np.cos(angle))
    assert np.dot(toward, right) == pytest.approx(np.sin(angle) * 7 / np.hypot(7, 4))
    assert np.dot(toward, up) == pytest.approx(-np.sin(angle) * 4 / np.hypot(7, 4))


UPRIGHT = """
import { View } from "./view.js";
console.log(JSON.stringify(data.map((one) => {
  const view = new View({ ...one, columns: 40, rows: 30 });
  const turned = view.orbited(7, -4);
  const axes = ({ right, up, toward }) => [right, up, toward];
  return { axes: axes(view), turned: axes(turned), place: [turned.theta, turned.phi], kept: [turned.upright, turned.roll] };
})));
"""


def test_what_is_upright_and_a_tilted_head_are_those_of_observers(modules: Path) -> None:
    """Axes of the core with `up`, `roll` and both, at the side and behind; and both are kept when the source is turned."""
    cases = [
        {"theta": theta, "phi": phi, "up": up, "roll": roll}
        for theta, phi in ((90, 0), (65, -130), (140, 25))
        for up, roll in ((None, 33), ([0, 0, 2], 0), ([0.3, -1, 0.2], -20))
    ]
    shape = {"distance": 900, "target": [0.5, -2, 3], "width": 4}
    found = run(modules, UPRIGHT, [{**case, **shape} for case in cases])
    for case, one in zip(cases, found, strict=True):
        screen, how = et.Screen(4, 3, 40, 30), {"up": case["up"], "roll": case["roll"]}
        observer = et.Observer(case["theta"], case["phi"], 900, (0.5, -2, 3), **how)
        np.testing.assert_allclose(one["axes"], screen.axes(observer), atol=1e-12)
        turned = et.Observer(*one["place"], 900, (0.5, -2, 3), **how)
        np.testing.assert_allclose(one["turned"], screen.axes(turned), atol=1e-12)
        assert one["kept"] == [case["up"], case["roll"]]


ALONG = """
import { View } from "./view.js";
const shape = { theta: 0, phi: 30, distance: 900, target: [0, 0, 0], width: 4, columns: 40, rows: 30 };
const [plain, along] = [null, [0, 0, 1]].map((up) => new View({ ...shape, up }));
console.log(JSON.stringify([plain.right, plain.up, along.right, along.up]));
"""


def test_along_up_a_view_has_the_axes_of_one_without(modules: Path) -> None:
    """Where `Observer` refuses: in a page that is turned by hand, the picture must not vanish."""
    right, up, right_along, up_along = run(modules, ALONG, {})
    assert (right_along, up_along) == (right, up)


INTENSITY = """
import { Field } from "./field.js";
const field = await Field.read(data.field);
const here = (k, most) => field.intensity(field.intensityPieces(k, most).map((work) => work()));
console.log(JSON.stringify(data.directions.map((k) => [here(k), here(k, 16)])));
"""


def unit_vectors(*, theta: Any, phi: Any) -> Array:
    """Towards polar angles and azimuths [°], shape (n, 3)."""
    t, p = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("name", SURFACES)
def test_intensity_towards_the_observer_is_that_of_the_field(modules: Path, name: str) -> None:
    """The core's sum over 400² points of each part; its error that of a pixel of a map from far that holds the source.

    While the view moves, fewer points tell it within some percent: here of cells that have nothing to do with each other.
    """
    field = make_field(SURFACES[name], seed=8)
    theta, phi = [0.0, 23.1, 61.7, 84.0, 131.0], [0.0, 17.3, -140.0, 95.0, 251.0]
    k = unit_vectors(theta=theta, phi=phi)
    packed = FieldTables.of(field).packed()
    found = run(modules, INTENSITY, {"field": packed, "directions": k.tolist()})
    truth = field.core.intensity(k, 400)
    assert (truth > 0).sum() >= 4
    for (whole, quick), value, t, p in zip(found, truth, theta, phi, strict=True):
        # The edge of what is seen of a round part is left to 1.5·10⁻³ by 64 points.
        assert whole["value"] == pytest.approx(value, rel=packed["bound"] + 1.5e-3, abs=1e-12)
        assert quick["value"] == pytest.approx(value, rel=0.06, abs=1e-12)
        if value > 0:
            lmap = et.luminance_map(field, et.Observer(t, p, 1e6), et.Screen(60, 60, 1, 1))
            error = lmap.standard_error[0, 0] / lmap.values[0, 0] * value
            assert whole["error"] == pytest.approx(error, rel=0.12)  # there, of the points that meet the source
