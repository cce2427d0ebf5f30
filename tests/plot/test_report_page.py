"""A report says what single calls say, shows nothing else, loses nothing, and loads nothing."""

from __future__ import annotations

import dataclasses
import itertools
import re
from html.parser import HTMLParser
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.fit_cache import FOLDER_VARIABLE
from etendue.lightfield.storage import as_stored
from etendue.luminance.source_report import SourceReport
from etendue.plot.report_page import A4, MARGIN, PAGE_TYPES, report_html
from etendue.quantities.measured import measured
from etendue.quantities.powers_of_ten import counted

OBSERVERS = [et.Observer(10, 20, 800, target=(3, -2, 1)), et.Observer(50, 200, 800, target=(3, -2, 1))]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two ring sources of different size side by side: nothing is symmetric."""
    first = et.RingSource(radii=(2.0, 5.0), flux=(80, 30), rays=8_000, seed=3).ray_set().moved((3, -2, 1))
    second = et.RingSource(radii=(1.0,), flux=(25,), rays=4_000, seed=4).ray_set().moved((-6, 1, 1))
    path = tmp_path_factory.mktemp("report") / "two <rings> $x$.tm25ray"
    et.write_rays(path, et.RaySet.merge([first, second]))
    return path


@pytest.fixture(scope="module")
def report(file: Path) -> SourceReport:
    return et.report_source(file, surface=et.Disk(radius=12, z=1), observers=OBSERVERS, forecast=False)


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.images: list[str] = []
        self.addresses: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in {"src", "href", "data"}:
                (self.images if tag == "img" else self.addresses).append(value or "")

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.mark.slow
def test_the_figures_are_those_of_single_calls(report: SourceReport, file: Path) -> None:
    """Field, maps and intensity made one by one; flux, rays and format from the file itself."""
    rays, disk = et.read_rays(file), et.Disk(radius=12, z=1)
    field = as_stored(et.LightField.fit(rays, disk))
    assert [lmap.observer for lmap in report.maps] == OBSERVERS
    for lmap, row in zip(report.maps, report.view_rows(), strict=True):
        alone = et.luminance_map(rays, lmap.observer, lmap.screen, method=et.FromField(surface=disk))
        np.testing.assert_array_equal(lmap.values, alone.values)
        brightest = np.unravel_index(alone.values.argmax(), alone.values.shape)
        said = dict(row)
        assert said["largest pixel"] == measured(alone.values[brightest], alone.standard_error[brightest], "cd/m²")
        assert said["intensity"] == counted(alone.intensity, "cd")
        assert alone.relative_error is not None
        assert said["error, weighted by flux"] == f"{alone.relative_error.flux_weighted:.2%}"
    np.testing.assert_array_equal(report.intensity.values, field.intensity().values)
    facts = dict(report.facts)
    assert (facts["rays"], facts["format"]) == ("12,000", "IES TM-25 ray file")
    assert float(facts["flux"].split()[0]) == pytest.approx(135.0)
    assert report.notes == field.notes
    assert dict(report.provenance)["fingerprint"] == rays.provenance.fingerprint


@pytest.mark.slow
def test_the_page_of_html_has_every_word_and_loads_nothing(report: SourceReport) -> None:
    many = dataclasses.replace(report, complaints=tuple(f"complaint <{n}>" for n in range(9)), title="<b>$x$</b>")
    reader = _Reader()
    reader.feed(report_html(many))
    assert len(reader.images) == len(report.maps) + 1
    assert all(image.startswith("data:image/png;base64,") for image in reader.images)
    assert not reader.addresses
    text = " ".join(reader.text)
    for words in (many.title, *many.complaints, *many.notes, *many.quality_lines, *many.sheet.lines()):
        assert words in text
    for label, value in (*many.facts, *many.provenance, *many.view_rows()[1]):
        assert label in text
        assert value in text
    assert re.search(r"src:|url\(|@import|<script", report_html(many)) is None


@pytest.mark.slow
@pytest.mark.parametrize("crowded", [False, True])
def test_the_page_of_paper_is_whole(report: SourceReport, *, crowded: bool) -> None:
    """Nothing is cut off at its edge, and what has no room is counted."""
    shown = dataclasses.replace(report, facts=report.facts[:12])
    if crowded:
        shown = dataclasses.replace(
            report,
            complaints=tuple(f"warning: line {n}: {'a long complaint ' * 12}" for n in range(20)),
            facts=tuple((f"fact {n}", "a long fact " * 9) for n in range(30)),
            maps=report.maps * 6,
        )
    figure = et.plot_report(shown)
    figure.canvas.draw()
    wide, high = figure.canvas.get_width_height()
    texts = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
    for text in texts:
        box = text.get_window_extent()
        assert 0 <= box.x0 < box.x1 <= wide or not text.get_text(), text
        assert 0 <= box.y0 < box.y1 <= high or not text.get_text(), text
    boxes = [text.get_window_extent().shrunk(0.98, 0.7) for text in figure.texts]
    for number, box in enumerate(boxes):
        assert box.count_overlaps(boxes[number + 1 :]) == 0, figure.texts[number]
    words = " ".join(text.get_text() for text in texts)
    left_out = [int(number) for number in re.findall(r"and (\d+) (?:more|other views)", words)]
    # Facts of two lines, complaints of three, in rooms of 20 and 6 lines; 12 views in a table of six.
    assert left_out == ([20, 18, 6] if crowded else [])
    assert "signature" in words


@pytest.mark.slow
def test_the_page_of_paper_tells_what_is_wrong_with_the_light(report: SourceReport) -> None:
    """Notes stand beside the facts: warnings before how the surface was chosen, as many as there is room for."""
    warning = "luminances in the beam are off by much more than their errors"
    choice = ("carrier surface plane:z=0: the simplest", "depths between -1 and 1 mm cannot be told")

    def words(*notes: str, facts: int) -> str:
        rows = tuple((f"fact {n}", "a fact") for n in range(facts))
        figure = et.plot_report(dataclasses.replace(report, facts=rows, notes=notes))
        return " ".join(text.get_text() for text in figure.texts)

    whole = words(*choice, warning, facts=20)
    assert all(note in " ".join(whole.split()) for note in (*choice, warning))
    assert whole.index("off by much more") < whole.index("carrier surface")
    short = words(*choice, f"{warning}: {'many words ' * 90}", facts=18)
    assert warning in " ".join(short.split())
    assert "…" in short
    assert "and 2 more: see the page of HTML" in short
    assert "notes: 3, in the page of HTML" in words(*choice, warning, facts=3)


@pytest.mark.slow
def test_fluxes_of_zones_have_their_errors(report: SourceReport) -> None:
    """On both pages what `zonal_flux` gives, to the digits that are shown: two of the error's."""
    edges = np.arange(0.0, 181.0, 10.0)
    rows = zip(edges, edges[1:], *et.zonal_flux(report.intensity, edges), strict=False)
    zones = [row for row in rows if row[2] > 1e-4 * report.intensity.flux]
    paper = [text.get_text() for text in et.plot_report(report).texts]
    (heading,) = [number for number, text in enumerate(paper) if text == "Flux by zones of γ [lm]"]
    told = re.findall(r"γ (\d+)° to (\d+)°</th><td>([\d.]+) ± ([\d.]+) lm", report_html(report))
    assert len(told) >= len(zones) > 5
    for number, ((low, high, flux, error), found) in enumerate(zip(zones, told, strict=False)):
        where, figures = paper[heading + 1 + 2 * number : heading + 3 + 2 * number]
        assert where == f"{low:g}–{high:g}°"
        assert (float(found[0]), float(found[1])) == (low, high)
        for value, its_error in (found[2:], figures.split(" ± ")):
            assert float(its_error) == pytest.approx(error, rel=0.06)
            assert float(value) == pytest.approx(flux, abs=0.06 * error)


@pytest.mark.slow
@pytest.mark.parametrize("flux", [3e-4, 0.9, 2e4, 6e7])
def test_fluxes_of_zones_stand_side_by_side(report: SourceReport, flux: float) -> None:
    """Of a source that shines all around, whatever its flux: no text on another, none beyond the margins or on the end."""
    gamma = np.arange(0.0, 181.0, 5.0)
    values = flux / 10.0 * (1.0 + 0.9 * np.cos(np.radians(2.0 * gamma)))
    around = et.Intensity([0.0], gamma, [values], 0.03 * values[None])
    figure = et.plot_report(dataclasses.replace(report, intensity=around))
    figure.canvas.draw()
    texts = [text for text in figure.texts if text.get_text()]
    (first,) = [number for number, text in enumerate(texts) if text.get_text().startswith("Flux by zones of γ")]
    end = next(number for number, text in enumerate(texts) if text.get_text().startswith("source: "))
    zones = texts[first:end]
    angles = [text.get_text() for text in zones if "–" in text.get_text()]
    hidden = sum(int(text.get_text().split()[1]) for text in zones if text.get_text().startswith("and "))
    assert len(angles) + hidden == 18
    boxes = [text.get_window_extent() for text in zones]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    assert max(box.x1 for box in boxes) < figure.bbox.width * (1.0 - MARGIN / A4[0] + 0.005)
    assert min(box.y0 for box in boxes) > texts[end].get_window_extent().y1
    # Heading and numbers together give the flux.
    power = (
        zones[0].get_text().partition("[10")[2].partition(" ")[0].translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    )
    value = float(zones[2].get_text().split(" ± ")[0]) * 10.0 ** int(power or "0")
    assert value == pytest.approx(et.zonal_flux(around, [0.0, 10.0])[0][0], rel=0.01)


@pytest.mark.slow
def test_a_long_title_stays_on_the_page(report: SourceReport) -> None:
    """Beside the subtitle at the right margin, its middle left out."""
    figure = et.plot_report(dataclasses.replace(report, title="a lamp of many words " * 8))
    figure.canvas.draw()
    title, subtitle = (text.get_window_extent() for text in figure.texts[:2])
    assert "…" in figure.texts[0].get_text()
    assert title.x1 < subtitle.x0
    short = et.plot_report(dataclasses.replace(report, title="my lamp"))
    assert short.texts[0].get_text() == "my lamp"


@pytest.mark.slow
def test_files_repeat_their_bytes_and_unknown_ones_are_told(report: SourceReport, tmp_path: Path) -> None:
    for suffix in PAGE_TYPES:
        for name in ("a", "b"):
            et.plot_report(report, tmp_path / f"{name}{suffix}")
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    assert len((tmp_path / "a.html").read_bytes()) < 1_500_000
    with pytest.raises(UnknownNameError, match=r"\.htlm.*\.html"):
        et.plot_report(report, tmp_path / "a.htlm")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"{n}{s}" for n in "ab" for s in PAGE_TYPES)


@pytest.mark.slow
def test_the_standard_views_stand_about_the_light(file: Path) -> None:
    found = et.report_source(et.read_rays(file), surface=et.Disk(radius=12, z=1), forecast=False, title="Mine")
    assert [(lmap.observer.theta, lmap.observer.phi) for lmap in found.maps] == [(0, 0), (30, 0), (60, 0), (60, 90)]
    assert len({(lmap.screen.width, lmap.screen.height) for lmap in found.maps}) == 1
    assert found.maps[0].screen.width > 14  # from -7 to 8 mm
    assert found.title == "Mine"


@pytest.mark.slow
def test_a_source_that_shines_down_is_looked_at_from_below_and_dark_views_are_black(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Lambertian source that is turned over has the intensity Φ/π seen from below, within the error that it has if
    all pixels err together; from above it is dark."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))  # three reports on one fit
    rings = et.RingSource(rays=6_000)
    turned = rings.ray_set().rotated((1, 0, 0), 180)
    found = et.report_source(turned, surface=et.Sphere(radius=40), forecast=False)
    assert [lmap.observer.theta for lmap in found.maps] == [180, 150, 120, 120]
    assert 60 < found.maps[0].screen.width < 80
    some = [et.Observer(0, 0, 1000), et.Observer(180, 0, 1000)]
    above, below = et.report_source(turned, surface=et.Sphere(radius=40), observers=some, forecast=False).maps
    known = below.relative_error
    assert known is not None
    assert abs(below.intensity / (rings.total_flux / np.pi) - 1) < known.flux_weighted
    assert above.intensity < 0.02 * below.intensity
    with pytest.raises(ArgumentError, match="no ray"):
        et.report_source(turned, surface=et.Sphere(radius=40), observers=some[:1], forecast=False)


@pytest.mark.slow
@pytest.mark.parametrize("number", [3_000, 6_000])
def test_what_more_rays_would_bring_is_told_or_why_not(number: int) -> None:
    told: list[int] = []
    rays = et.RingSource(rays=number).ray_set()
    found = et.report_source(rays, surface=et.Disk(radius=30), observers=OBSERVERS[:1], progress=told.append)
    few = [note for note in found.notes if "too few to forecast" in note]
    assert (found.diagnostics.forecast is None) == (number < 4_000) == bool(few)
    assert told == sorted(told)
    assert told[-1] == (number if few else 2 * number)


def test_no_observers_are_refused(file: Path) -> None:
    with pytest.raises(ArgumentError, match="observers is empty"):
        et.report_source(file, observers=[])
