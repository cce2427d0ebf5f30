"""Pages in a real browser: what stands under the pointer, what the processor draws, and that nothing leaves the file."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.viewer.file_output import write_page
from etendue.viewer.opening import exhibit_of
from oracles.browser import Browser, browsing
from oracles.packaged_led import PackagedLed

from viewer.conftest import FIELDS
from viewer.viewables import spot
from viewer.views import page_views

VIEWS = 20
ERROR_BOUND = 0.035
"""As of the modules."""

OPENS = 2.0
"""Seconds within which a page of an LED shows its picture."""

MOST_BYTES = 6_000_000


@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    """One for all pages: small, since here the processor draws them."""
    with browsing(chromium, width=780, height=380) as found:
        yield found


def opened(browser: Browser, exhibit: Any, path: Path) -> None:
    """Write the page and go there; nothing else may be asked for."""
    write_page(exhibit, path)
    browser.requests.clear()
    browser.complaints.clear()
    browser.open(path.as_uri())
    assert browser.evaluate("etendue.failed()") is None


def quiet(browser: Browser, path: Path) -> None:
    """The file itself was all that was asked for, and nothing went wrong."""
    assert [url.split("#")[0] for url in browser.requests if not url.startswith(("blob:", "data:"))] == [path.as_uri()]
    assert browser.complaints == []


def middle_of(browser: Browser, column: int, row: int) -> tuple[float, float]:
    """Where on the page the middle of a pixel of the map is [CSS pixels]."""
    box = browser.evaluate("(({left, top}) => [left, top])(document.getElementById('picture').getBoundingClientRect())")
    return box[0] + 2 * column + 1, box[1] + 2 * row + 1


@pytest.mark.slow
def test_values_under_the_pointer_are_those_of_the_map(
    browser: Browser, named_field: tuple[str, et.LightField], tmp_path: Path
) -> None:
    """20 views of each of three fields: every pixel that is pointed at has the value and error of `luminance_map`.

    The light of the pixels is also what the graphics processor finds, in single precision and by the same points, wherever
    the four pixels of the canvas in one of the map lie clear of edges.
    """
    name, field = named_field
    path = tmp_path / f"{name}.html"
    opened(browser, exhibit_of(field, name=name), path)
    size = browser.evaluate("[etendue.state.view.columns, etendue.state.view.rows]")
    bound = exhibit_of(field, name=name).subject["field"]["bound"]
    rng = np.random.default_rng(11)
    lit, smooth, agree = 0, 0, 0
    for view in page_views(count=VIEWS, columns=size[0], rows=size[1], seed=12):
        browser.evaluate(f"etendue.setView({view.page})")
        truth = et.luminance_map(field, view.observer, view.screen)
        picks = rng.integers(0, size, (60, 2)).tolist()
        read = "(([c, r]) => { const x = etendue.reading(c, r); return [x.value, x.error]; })"
        found = np.array(browser.evaluate(f"{picks}.map({read})"))
        exact = np.array([[truth.values[r, c], truth.standard_error[r, c]] for c, r in picks])
        bright = exact[:, 0] > 0
        lit += int(bright.sum())
        assert ((found[:, 0] > 0) == bright).all()
        off = np.abs(found[bright] / exact[bright] - 1)
        assert off[:, 0].max(initial=0) < bound + 1e-6
        assert off[:, 1].max(initial=0) < ERROR_BOUND
        # One sample of every pixel of the canvas is there at once; of even neighbours any sample will do.
        browser.wait("etendue.samples() > 0")
        height = browser.evaluate("document.getElementById('picture').height")
        ask = "(([c, r]) => [0, 1].flatMap((i) => [0, 1].map((j) => etendue.painted(2 * c + i, %d - 1 - 2 * r - j).value)))"
        painted = np.array(browser.evaluate(f"{picks}.map({ask % height})"))
        even = (painted.min(axis=1) > 0) & (painted.max(axis=1) < 1.02 * painted.min(axis=1)) & bright
        smooth += int(even.sum())
        agree += int((np.abs(painted.mean(axis=1)[even] / exact[even, 0] - 1) < 0.02).sum())
    assert lit > 100
    assert smooth > 30
    assert agree > 0.97 * smooth
    # What is written beside the pointer is that reading.
    row, column = np.unravel_index(int(truth.values.argmax()), truth.values.shape)
    x, y = middle_of(browser, int(column), int(row))
    browser.mouse("mouseMoved", x=x, y=y)
    browser.wait(f"document.getElementById('place').textContent.includes('pixel {column}, {row}')")
    text = browser.evaluate("document.getElementById('reading').textContent")
    value, _, error, unit = text.split(maxsplit=3)
    factor = {"G": 1e9, "M": 1e6, "k": 1e3}.get(unit[0], 1.0)
    assert float(value) * factor == pytest.approx(truth.values[row, column], abs=0.6 * float(error) * factor)
    quiet(browser, path)


@pytest.mark.slow
def test_the_address_tells_what_is_upright_and_the_command_repeats_it(
    browser: Browser, named_field: tuple[str, et.LightField], tmp_path: Path
) -> None:
    """The pixels are those of an observer with `up` and `roll`, and the command line that the page gives makes that map."""
    name, field = named_field
    path = tmp_path / "upright.html"
    write_page(exhibit_of(field, name=name), path)
    browser.requests.clear()
    browser.complaints.clear()
    browser.open(f"{path.as_uri()}#theta=70&phi=-40&up=0,0,1&roll=12")
    view = browser.evaluate("({...etendue.state.view, height: etendue.state.view.height})")
    command = browser.evaluate("document.getElementById('command').textContent")
    assert "--observer=70,-40 " in command
    assert " --up=0,0,1 --roll=12 " in command
    observer = et.Observer(70, -40, view["distance"], tuple(view["target"]), up=(0, 0, 1), roll=12)
    screen = et.Screen(view["width"], view["height"], view["columns"], view["rows"])
    truth = et.luminance_map(field, observer, screen)
    bound = exhibit_of(field, name=name).subject["field"]["bound"] + 1e-6
    picks = np.random.default_rng(5).integers(0, screen.shape[::-1], (80, 2)).tolist()
    found = np.array(browser.evaluate(f"{picks}.map(([c, r]) => etendue.reading(c, r).value)"))
    exact = np.array([truth.values[r, c] for c, r in picks])
    assert (exact > 0).sum() > 3
    assert np.abs(found - exact).max() <= bound * exact.max()
    assert np.abs(found[exact > 0] / exact[exact > 0] - 1).max() < bound


@pytest.mark.slow
def test_an_address_that_names_no_view_changes_nothing(browser: Browser, tmp_path: Path) -> None:
    """What is out of its domain or no number is passed over; a map, which has an observer, is not turned."""
    screen = et.Screen(4, 3, 8, 6)
    lmap = et.LuminanceMap(np.ones((6, 8)), np.ones((6, 8)), np.ones((6, 8)), et.Observer(20, 30, 500), screen)
    for value, name in ((FIELDS["lamp"], "lamp"), (lmap, "map")):
        path = tmp_path / f"{name}.html"
        write_page(exhibit_of(value, name=name), path)
        browser.open(f"{path.as_uri()}#width=3")
        first = browser.evaluate("({...etendue.state.view})")
        wrong = "theta=200&phi=x&distance=-5&width=3&columns=2.5&rows=0&target=1,2&up=0,0,0&roll=Infinity"
        browser.open(f"{path.as_uri()}?again#{wrong}")
        assert browser.evaluate("({...etendue.state.view})") == first, name
        browser.open(f"{path.as_uri()}?turned#theta=50&phi=10&distance=90&width=3&target=0,0.5,0")
        found = browser.evaluate("({...etendue.state.view})")
        turned = [50, 10, 90] if name == "lamp" else [20, 30, 500]
        assert [found["theta"], found["phi"], found["distance"]] == turned
        assert (found["width"], found["target"]) == (3, [0, 0.5, 0])


@pytest.mark.slow
def test_the_command_of_indexed_rays_makes_the_map_that_is_seen(browser: Browser, tmp_path: Path) -> None:
    """By the light field that was fitted to them, and not by the cone, which maps of an index are made by otherwise."""
    index = tmp_path / "rings.etd"
    et.RayIndex.build(et.RingSource(rays=4000).ray_set(), index)
    exhibit = exhibit_of(et.RayIndex.open(index), name="rings", file=str(index))
    opened(browser, exhibit, tmp_path / "rings.html")
    browser.wait("document.getElementById('command').textContent")
    words = shlex.split(browser.evaluate("document.getElementById('command').textContent"))
    assert words[0] == "etendue"
    subprocess.run([sys.executable, "-m", *words], cwd=tmp_path, check=True, capture_output=True)
    truth = et.read_map(tmp_path / "map.exr")
    picks = np.random.default_rng(5).integers(0, truth.values.shape[::-1], (50, 2)).tolist()
    found = np.array(browser.evaluate(f"{picks}.map(([c, r]) => etendue.reading(c, r).value)"))
    exact = np.array([truth.values[r, c] for c, r in picks])
    assert (exact > 0).sum() > 5
    np.testing.assert_allclose(found, exact, rtol=exhibit.subject["field"]["bound"] + 1e-3, atol=0)


@pytest.mark.slow
def test_the_intensity_of_the_view_is_that_of_the_field(browser: Browser, tmp_path: Path) -> None:
    """A spot of 7° in an oblique direction: at its top and on its side, between the nodes of any table of round angles."""
    field = spot(width=7.0, theta=23.7, phi=33.3)
    path = tmp_path / "spot.html"
    opened(browser, exhibit_of(field, name="spot"), path)
    for theta, phi in ((23.7, 33.3), (21.4, 36.1), (28.6, 33.3)):
        browser.evaluate(f"etendue.setView({{theta: {theta}, phi: {phi}}})")
        browser.wait(f"!etendue.state.here.quick && etendue.state.here.theta === {theta} && etendue.finished()")
        text = browser.evaluate("document.getElementById('intensity').textContent")
        value, _, _, unit, here = text.split()
        found = float(value) * {"kcd": 1e3, "cd": 1.0}[unit]
        truth = field.core.intensity(et.Observer(theta, phi, 1).direction[None], 256)[0]
        assert here == "here"
        assert found == pytest.approx(truth, rel=0.01)  # as many digits as its error has
        assert browser.evaluate("etendue.state.here.value") == pytest.approx(truth, rel=2e-3 + 1.5e-3)
    quiet(browser, path)


@pytest.fixture(scope="module")
def led() -> et.LightField:
    """A packaged LED with structure, glow and strays: 10⁵ rays."""
    source = PackagedLed()
    position, direction = source.rays(100_000, seed=1)
    return et.LightField.fit(et.RaySet(position, direction, np.full(len(position), source.total_flux / len(position))))


@pytest.mark.slow
def test_an_led_is_a_small_file_that_opens_at_once_and_can_be_handled(
    chromium: str, led: et.LightField, tmp_path: Path
) -> None:
    """At most 6 MB; the picture stands within 2 s; mouse, wheel and keys move it; regions and sections have figures."""
    path = tmp_path / "led.html"
    with browsing(chromium, width=780, height=380) as browser:
        opened(browser, exhibit_of(led, name="led.h5"), path)
        assert path.stat().st_size < MOST_BYTES
        browser.wait("document.body.dataset.painted")
        assert browser.evaluate("Number(document.body.dataset.painted)") < 1000 * OPENS
        start = browser.evaluate("({...etendue.state.view})")
        assert start["theta"] == 0
        x, y = middle_of(browser, 60, 60)
        browser.drag((x, y), (x + 20, y), (x + 40, y + 12))
        turned = browser.evaluate("({...etendue.state.view})")
        assert turned["theta"] == pytest.approx(0.25 * np.hypot(40, 12), rel=1e-2)  # a quarter degree a pixel
        browser.mouse("mouseWheel", x=x, y=y, deltaX=0, deltaY=-200)
        browser.wait(f"etendue.state.view.width < 0.8 * {turned['width']}")
        browser.key("g")
        assert browser.evaluate("etendue.state.look.logarithmic")
        browser.key("e")
        assert browser.evaluate("etendue.state.look.errors")
        browser.key("e")
        browser.key("0")
        assert browser.evaluate("etendue.state.view.theta") == 0
        browser.key("r")
        browser.drag(middle_of(browser, 70, 50), middle_of(browser, 90, 70), middle_of(browser, 100, 80))
        browser.wait("etendue.state.regions[0]?.figures?.pixels > 0")
        figures = browser.evaluate("etendue.state.regions[0].figures")
        screen = et.Screen(
            start["width"], start["width"] / start["columns"] * start["rows"], start["columns"], start["rows"]
        )
        truth = et.luminance_map(
            led, et.Observer(0, start["phi"], start["distance"], start["target"]), screen, samples=4
        )
        inside = truth.values[50:81, 70:101]  # corners lie in the middle of pixels, whose middles lie on the border
        assert figures["pixels"] in {30 * 30, 30 * 31, 31 * 31}
        assert figures["maximum"] <= inside.max() * 1.003
        assert figures["mean"] == pytest.approx(inside.mean(), rel=0.1)
        browser.key("l")
        browser.drag(middle_of(browser, 40, 60), middle_of(browser, 90, 62), middle_of(browser, 130, 65))
        browser.wait("etendue.state.section?.length > 100")
        command = browser.evaluate("document.getElementById('command').textContent")
        assert command.startswith("etendue luminance led.h5 --observer=0,")
        quiet(browser, path)


@pytest.mark.slow
def test_a_map_shows_its_own_pixels(browser: Browser, tmp_path: Path) -> None:
    """Each pixel of the map where the screen has it, also those without a value."""
    rng = np.random.default_rng(4)
    values = rng.uniform(1, 100, (20, 30))
    values[4, 7] = np.nan
    lmap = et.LuminanceMap(
        values, values / 10, np.full(values.shape, 5), et.Observer(20, 30, 500, (1, 2, 3)), et.Screen(6, 4, 30, 20)
    )
    path = tmp_path / "map.html"
    opened(browser, exhibit_of(lmap, name="map.exr"), path)
    view = browser.evaluate("({...etendue.state.view})")
    grid = np.array(browser.evaluate(
        "[...Array(etendue.state.view.rows).keys()].map((r) => [...Array(etendue.state.view.columns).keys()].map("
        "(c) => etendue.reading(c, r).value))"
    ), dtype=float)  # fmt: skip
    step = view["width"] / view["columns"]
    x = (np.arange(view["columns"]) + 0.5) * step - view["width"] / 2
    y = view["rows"] * step / 2 - (np.arange(view["rows"]) + 0.5) * step
    column, row = np.floor((x / 6 + 0.5) * 30).astype(int), np.floor((0.5 - y / 4) * 20).astype(int)
    inside = (row[:, None] >= 0) & (row[:, None] < 20) & (column[None] >= 0) & (column[None] < 30)
    expected = np.where(inside, values[np.clip(row, 0, 19)[:, None], np.clip(column, 0, 29)[None]], np.nan)
    # Middles of the page's pixels on the borders of the map's belong to either side.
    clear = [np.abs(t - np.round(t)) > 1e-6 for t in ((0.5 - y / 4) * 20, (x / 6 + 0.5) * 30)]
    clear_of_borders = np.ix_(*clear)
    np.testing.assert_allclose(grid[clear_of_borders], expected[clear_of_borders], rtol=1e-6)
    assert min(one.mean() for one in clear) > 0.9
    assert inside.sum() > 1000
    quiet(browser, path)


NO_FLOAT_TARGETS = """
const whole = WebGL2RenderingContext.prototype.getExtension;
WebGL2RenderingContext.prototype.getExtension = function (name) {
  return name === "EXT_color_buffer_float" ? null : whole.call(this, name);
};
"""


@pytest.mark.slow
def test_processors_without_float_targets_draw_the_same(chromium: str, tmp_path: Path) -> None:
    """With targets of 16 bits the picture is that of 32 bits to their eleven digits (2⁻¹¹, and as much by the mean)."""
    path = tmp_path / "die.html"
    exhibit = exhibit_of(FIELDS["die"], name="die")
    found = []
    for prepared in ("", NO_FLOAT_TARGETS):
        with browsing(chromium, width=620, height=260) as browser:
            browser.call("Page.addScriptToEvaluateOnNewDocument", source=prepared)
            opened(browser, exhibit, path)
            browser.wait("etendue.finished()")
            found.append(
                browser.evaluate("[...Array(150).keys()].map((i) => etendue.painted(2 * i, (7 * i) % 160).value)")
            )
            assert browser.complaints == []
    whole, half = np.array(found)
    assert (whole > 0).sum() > 20
    assert np.abs(half - whole).max() < 2.0**-10 * whole.max()
    assert (half != whole).any()  # otherwise the extension was not taken away


@pytest.mark.slow
def test_fingers_turn_shift_and_zoom(browser: Browser, tmp_path: Path) -> None:
    """One finger turns a quarter of a degree a pixel; two that part zoom in by how much farther apart they are."""
    opened(browser, exhibit_of(FIELDS["lamp"], name="lamp"), tmp_path / "lamp.html")
    browser.evaluate("etendue.setView({theta: 0, phi: 0})")
    x, y = middle_of(browser, 100, 60)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(places)]
        browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    for kind, *places in (
        ("touchStart", (x, y)),
        ("touchMove", (x, y + 20)),
        ("touchMove", (x, y + 40)),
        ("touchEnd",),
    ):
        touch(kind, *places)
    browser.wait("etendue.state.view.theta > 0")
    assert browser.evaluate("etendue.state.view.theta") == pytest.approx(10, rel=0.5)  # a browser may swallow the first
    width = browser.evaluate("etendue.state.view.width")
    theta = browser.evaluate("etendue.state.view.theta")
    touch("touchStart", (x - 30, y), (x + 30, y))
    touch("touchMove", (x - 45, y), (x + 45, y))
    touch("touchMove", (x - 60, y), (x + 60, y))
    touch("touchEnd")
    browser.wait(f"etendue.state.view.width < 0.9 * {width}")
    assert browser.evaluate("etendue.state.view.width") == pytest.approx(width / 2, rel=0.4)
    assert browser.evaluate("etendue.state.view.theta") == theta


@pytest.mark.slow
def test_the_served_page_opens_and_hands_out_maps(browser: Browser, tmp_path: Path) -> None:
    """Through the token, under its policy, in the browser: the map that it fetches is the core's."""
    from viewer.test_server import serving

    for visitor in serving(exhibit_of(FIELDS["lamp"], name="lamp.h5")):
        browser.requests.clear()
        browser.complaints.clear()
        browser.open(visitor.server.url)
        assert browser.evaluate("etendue.failed()") is None
        assert browser.evaluate("document.querySelectorAll('#export button').length") == 3
        view = browser.evaluate("({...etendue.state.view, height: etendue.state.view.height})")
        asked = "({observer: {theta, phi, distance, target}, screen: {width, height, columns, rows}, format: 'csv'})"
        text = browser.evaluate(
            "(({theta, phi, distance, target, width, height, columns, rows}) => fetch('map', {method: 'POST', "
            f"headers: {{'Content-Type': 'application/json'}}, body: JSON.stringify({asked})}}))(etendue.state.view)"
            ".then((r) => r.text())"
        )
        (tmp_path / "map.csv").write_text(text, encoding="utf-8")
        found = et.read_map(tmp_path / "map.csv")
        observer = et.Observer(view["theta"], view["phi"], view["distance"], view["target"])
        screen = et.Screen(view["width"], view["height"], view["columns"], view["rows"])
        np.testing.assert_array_equal(found.values, et.luminance_map(FIELDS["lamp"], observer, screen).values)
        assert all(url.startswith(f"http://{visitor.server.place}/") for url in browser.requests)
        assert browser.complaints == []
