"""Moving pictures: as many frames as maps, each the picture of its map, and files that need nothing else."""

from __future__ import annotations

import base64
import io
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.plot import animation
from etendue.plot.animation_files import Writing, write_gif, write_mp4, write_page
from etendue.plot.colour_scale import colour_map
from PIL import Image

TOP = 3.0


def make_maps(count: int = 3) -> list[et.LuminanceMap]:
    """Maps without symmetry, each with another brightest pixel; the first one has a dead pixel."""
    found = []
    for k in range(count):
        values = np.array([[0.0, 1.0, 2.0, 0.5], [0.25, 1.5, TOP, 0.75]]) / (k + 1)
        values[0, 0] = np.nan if k == 0 else 0.0
        errors = np.where(np.isnan(values), np.nan, 0.01)
        eye = et.Observer(40, 360 * k / count, 1000, up=(0, 0, 1))
        found.append(et.LuminanceMap(values, errors, np.full((2, 4), 9), eye, et.Screen(8, 4, 4, 2)))
    return found


def frames_of(path: Path) -> list[np.ndarray[Any, Any]]:
    with Image.open(path) as image:
        found = []
        for number in range(getattr(image, "n_frames", 1)):
            image.seek(number)
            found.append(np.asarray(image.convert("RGB")))
    return found


def pixels(frame: np.ndarray[Any, Any], lmap: et.LuminanceMap) -> np.ndarray[Any, Any]:
    """Colours in the middle of each pixel of the map, found by the place of the picture in the frame."""
    layout = animation.MapLayout.around(lmap.screen, captions(), [])
    left, bottom, width, height = layout.picture
    columns = (left + width * (np.arange(4) + 0.5) / 4) * animation.DPI
    rows = (layout.height - bottom - height + height * (np.arange(2) + 0.5) / 2) * animation.DPI
    return frame[np.round(rows).astype(int)[:, None], np.round(columns).astype(int)[None, :]]


def captions() -> list[str]:
    return ["3 observers, one scale", "4 × 2 pixels", "memory"]


def expected(lmap: et.LuminanceMap) -> np.ndarray[Any, Any]:
    colours = colour_map("value")
    seen = colours(np.ma.masked_invalid(lmap.values / TOP))
    return np.round(255 * seen[..., :3])


def test_each_frame_of_a_gif_shows_its_map_on_the_scale_of_all(tmp_path: Path) -> None:
    maps = make_maps()
    et.plot_animation(maps, tmp_path / "a.gif", scale="linear", seconds=0.2)
    frames = frames_of(tmp_path / "a.gif")
    assert len(frames) == len(maps)
    # The nearest of the colours that a GIF has is half of their largest distance away at most, and both are rounded.
    steps = np.diff(255 * colour_map("value")(np.linspace(0, 1, animation.OF_MAP))[:, :3], axis=0)
    furthest = np.linalg.norm(steps, axis=1).max() / 2 + 2
    for frame, lmap in zip(frames, maps, strict=True):
        assert np.linalg.norm(pixels(frame, lmap) - expected(lmap), axis=-1).max() <= furthest
    # A map that is dimmer is darker: the scale is not its own.
    assert pixels(frames[1], maps[1])[1, 2].sum() < pixels(frames[0], maps[0])[1, 2].sum() - 100
    with Image.open(tmp_path / "a.gif") as image:
        assert image.info["duration"] == 200
        assert image.info["loop"] == 0


def test_frames_are_what_a_whole_drawing_gives() -> None:
    """What changes is drawn over what stays, and that must not show."""
    maps = make_maps()
    scale = ("linear", None, None, "Luminance", colour_map("value"))
    together = list(animation._frames(maps, *scale))
    backwards = list(animation._frames(maps[::-1], *scale))[::-1]
    # A frame does not hang on those before it.
    for one, other in zip(together, backwards, strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_angle_is_named_in_each_frame(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told: list[str] = []
    monkeypatch.setattr(
        animation.style, "describe_observer", lambda observer: told.append(f"φ = {observer.phi:g}°") or told[-1]
    )
    et.plot_animation(make_maps(), tmp_path / "a.html")
    assert told[:3] == ["φ = 0°", "φ = 120°", "φ = 240°"]
    assert "φ = 120°" in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.gif", "a.html"])
def test_the_same_maps_give_the_same_bytes(name: str, tmp_path: Path) -> None:
    for copy in ("one", "two"):
        (tmp_path / copy).mkdir()
        et.plot_animation(make_maps(), tmp_path / copy / name)
    assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


class Page(HTMLParser):
    """What a page is made of."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.images: list[dict[str, str | None]] = []
        self.addresses: list[str] = []
        self.policy = ""
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if tag == "img":
            self.images.append(found)
        self.addresses += [value or "" for key, value in attrs if key in ("src", "href", "action", "data")]
        if found.get("http-equiv") == "Content-Security-Policy":
            self.policy = found["content"] or ""
        if tag not in ("img", "meta", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_a_page_holds_all_pictures_and_asks_for_nothing(tmp_path: Path) -> None:
    maps = make_maps()
    title = '<LED> & "lamp"'
    et.plot_animation(maps, tmp_path / "a.html", scale="linear", title=title)
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    page = Page(text)
    assert not page.open
    assert "<title>&lt;LED&gt; &amp; &quot;lamp&quot;</title>" in text
    assert len(page.images) == len(maps)
    assert all(address.startswith("data:image/png;base64,") for address in page.addresses)
    assert page.policy.startswith("default-src 'none'")
    assert not re.search(r"https?://|fetch|XMLHttpRequest|import", text.split("<style>")[1].replace("data:", ""))
    for image, lmap in zip(page.images, maps, strict=True):
        coded = (image["src"] or "").partition(",")[2]
        with Image.open(io.BytesIO(base64.b64decode(coded))) as shown:
            assert np.abs(pixels(np.asarray(shown.convert("RGB")), lmap) - expected(lmap)).max() <= 1
    assert ["hidden" in image for image in page.images] == [False, True, True]


@pytest.mark.slow
def test_many_frames_stay_small(tmp_path: Path) -> None:
    """36 noisy maps of 128 × 128 pixels, the worst that a light field may give."""
    rng = np.random.default_rng(3)
    disk = np.hypot(*np.mgrid[-64:64, -64:64]) < 50
    maps = [
        et.LuminanceMap(
            np.where(disk, 1e6 * (1 + 0.05 * rng.normal(size=disk.shape)), 0.0),
            np.full(disk.shape, 1e4),
            np.full(disk.shape, 9),
            et.Observer(40, 10 * k, 1000),
            et.Screen(3, 3, 128, 128),
        )
        for k in range(36)
    ]
    et.plot_animation(maps, tmp_path / "a.gif")
    assert (tmp_path / "a.gif").stat().st_size < 3e6


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="the program ffmpeg is not installed")
def test_a_video_has_all_frames_and_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.mp4", "b.mp4"):
        et.plot_animation(make_maps(), tmp_path / name, scale="linear")
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    program = shutil.which("ffmpeg")
    assert program is not None
    subprocess.run([program, "-i", tmp_path / "a.mp4", tmp_path / "%d.png"], check=True, capture_output=True)
    assert len(list(tmp_path.glob("*.png"))) == 3


def test_without_ffmpeg_a_video_is_refused_at_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(et.ArgumentError, match=r"ffmpeg is not installed, which makes \.mp4.*\.gif or \.html"):
        et.plot_animation(make_maps(), tmp_path / "a.mp4")
    with pytest.raises(et.ArgumentError, match="ffmpeg"):
        write_mp4(Writing([np.zeros((4, 4, 3), np.uint8)], [""], "", 0.1), tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_what_ffmpeg_says_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 1\n", encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(et.ArgumentError, match=r"Unknown encoder libx264\. Give \.gif or \.html"):
        et.plot_animation(make_maps(), tmp_path / "a.mp4")
    assert [path.name for path in tmp_path.iterdir()] == ["ffmpeg"]


def test_a_page_and_a_gif_of_plain_frames(tmp_path: Path) -> None:
    frames = [np.full((4, 6, 3), level, np.uint8) for level in (0, 120, 255)]
    written = Writing(frames, ["a", "b", "c"], "", 0.1)
    write_gif(written, tmp_path / "a.gif")
    write_page(written, tmp_path / "a.html")
    assert [int(frame[0, 0, 0]) for frame in frames_of(tmp_path / "a.gif")] == pytest.approx([0, 120, 255], abs=4)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda maps: maps[:1], "two or more"),
        (lambda maps: [maps[0], maps[1].replace(screen=et.Screen(9, 4, 4, 2))], "differ in size"),
        (lambda maps: [maps[0], maps[1].replace(flux_unit="W")], "cannot share a scale"),
    ],
)
def test_maps_that_do_not_go_together_are_refused(change: Any, told: str, tmp_path: Path) -> None:
    with pytest.raises(et.ArgumentError, match=told):
        et.plot_animation(change(make_maps()), tmp_path / "a.gif")


def test_other_mistakes_are_told(tmp_path: Path) -> None:
    with pytest.raises(et.UnknownNameError, match=r"'\.gif'"):
        et.plot_animation(make_maps(), tmp_path / "a.gff")
    with pytest.raises(et.ArgumentError, match="seconds"):
        et.plot_animation(make_maps(), tmp_path / "a.gif", seconds=0)
