"""Moving pictures as files: GIF, MP4 and a page of its own, with the same bytes for the same frames."""

from __future__ import annotations

import base64
import dataclasses
import html
import io
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.extras import require
from etendue.formats.output import atomic_output

Frame = npt.NDArray[np.uint8]
"""A picture, shape (rows, columns, 3)."""

COLOURS = 256
"""Of a GIF, the same for all frames."""

LOOKED_AT = 24
"""Frames, evenly over all, from which these are chosen."""


@dataclasses.dataclass(frozen=True, eq=False)
class Writing:
    """What is to be written.

    Parameters
    ----------
    frames : sequence of Frame
        All of one size.
    labels : sequence of str
        What each frame shows.
    title : str
    seconds : float
        That a frame stays.
    palette : array of uint8, shape (n, 3), optional
        256 colours at most of which a GIF is made; chosen from the frames if not given.

    Examples
    --------
    >>> Writing([np.zeros((4, 6, 3), np.uint8)], ["dark"], "Nothing", 0.1).labels
    ['dark']
    """

    frames: Sequence[Frame]
    labels: Sequence[str]
    title: str
    seconds: float
    palette: Frame | None = None


Writer = Callable[[Writing, str | os.PathLike[str]], None]


def writer_for(path: str | os.PathLike[str]) -> Writer:
    """What writes a file of this extension.

    Raises
    ------
    UnknownNameError
        If nothing does.
    ArgumentError
        If it is .mp4, and ffmpeg is not installed.

    Examples
    --------
    >>> writer_for("orbit.gif").__name__
    'write_gif'
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise UnknownNameError("extension of a moving picture", suffix, WRITERS)
    if suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise ArgumentError(
            f"{os.fspath(path)}: the program ffmpeg is not installed, which makes .mp4. Install it, or give .gif or .html."
        )
    return WRITERS[suffix]


def _pillow() -> Any:
    """Pillow, which matplotlib brings."""
    require("matplotlib")
    from PIL import Image

    return Image


def write_gif(writing: Writing, path: str | os.PathLike[str]) -> None:
    """An animated GIF that starts again at its end: one palette, no dithering, times in hundredths of a second.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> frames = [np.full((4, 6, 3), level, np.uint8) for level in (0, 255)]
    >>> with TemporaryDirectory() as folder:
    ...     write_gif(Writing(frames, ["dark", "light"], "", 0.5), Path(folder) / "two.gif")
    ...     (Path(folder) / "two.gif").read_bytes()[:6]
    b'GIF89a'
    """
    image = _pillow()
    palette = _chosen(writing.frames) if writing.palette is None else writing.palette
    indexed = []
    for numbers in _nearest(writing.frames, palette):
        indexed.append(image.fromarray(numbers))
        indexed[-1].putpalette(palette.tobytes())
    with atomic_output(path) as temporary:
        indexed[0].save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=indexed[1:],
            duration=max(20, 10 * round(100.0 * writing.seconds)),
            loop=0,
            optimize=False,
            disposal=1,
        )


def _chosen(frames: Sequence[Frame]) -> Frame:
    """A palette for all frames, shape (n, 3), from some of them."""
    image = _pillow()
    some = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, LOOKED_AT).astype(int))]
    chosen = image.fromarray(np.concatenate(some)).quantize(COLOURS, method=image.Quantize.MAXCOVERAGE)
    return np.array(chosen.getpalette("RGB"), dtype=np.uint8).reshape(-1, 3)


def _nearest(frames: Sequence[Frame], palette: Frame) -> Iterator[npt.NDArray[np.uint8]]:
    """The number of the nearest colour of a palette at each pixel, shape (rows, columns); Pillow's own search is coarse."""
    known: dict[int, int] = {}
    weights = np.array([1 << 16, 1 << 8, 1])
    for frame in frames:
        codes, places = np.unique(frame.astype(np.int64) @ weights, return_inverse=True)
        for code in set(codes.tolist()) - known.keys():
            colour = np.array([code >> 16, code >> 8 & 255, code & 255])
            known[code] = int(((palette.astype(np.int64) - colour) ** 2).sum(axis=1).argmin())
        numbers = np.array([known[code] for code in codes.tolist()], dtype=np.uint8)
        yield numbers[places.reshape(frame.shape[:2])]


def write_mp4(writing: Writing, path: str | os.PathLike[str]) -> None:
    """A video in H.264, by ffmpeg.

    Raises
    ------
    ArgumentError
        If ffmpeg is not there or fails, with what it says; or the directory of `path` does not exist.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> frames = [np.full((16, 16, 3), level, np.uint8) for level in (0, 255)]
    >>> with TemporaryDirectory() as folder:
    ...     if shutil.which("ffmpeg"):
    ...         write_mp4(Writing(frames, ["dark", "light"], "", 0.5), Path(folder) / "two.mp4")
    """
    writer_for(path)
    rows, columns, _ = writing.frames[0].shape
    # The encoder halves the resolution of colours.
    even = [np.pad(frame, ((0, rows % 2), (0, columns % 2), (0, 0)), mode="edge") for frame in writing.frames]
    size = f"{columns + columns % 2}x{rows + rows % 2}"
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{1.0 / writing.seconds:.6g}", "-i", "-"]
    # Neither dates nor versions, and one thread, so that the bytes are the same each time.
    steady = ["-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-threads", "1"]
    coding = ["-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
    with atomic_output(path) as temporary:
        command = ["ffmpeg", "-loglevel", "error", "-y", *source, *coding, *steady, "-f", "mp4", str(temporary)]
        made = subprocess.run(  # noqa: S603 - our own words and the path of a temporary file
            command, input=b"".join(frame.tobytes() for frame in even), capture_output=True, check=False
        )
        if made.returncode:
            why = (made.stderr.decode("utf-8", "replace").strip().splitlines() or ["it does not say why"])[-1]
            raise ArgumentError(f"{os.fspath(path)}: ffmpeg did not make it: {why}. Give .gif or .html instead.")


def write_page(writing: Writing, path: str | os.PathLike[str]) -> None:
    """A page of one file with all frames in it, a slider, and a button that plays them; it asks nothing of any network.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> frames = [np.full((4, 6, 3), level, np.uint8) for level in (0, 255)]
    >>> with TemporaryDirectory() as folder:
    ...     write_page(Writing(frames, ["dark", "light"], "A & B", 0.5), Path(folder) / "two.html")
    ...     page = (Path(folder) / "two.html").read_text(encoding="utf-8")
    >>> page.count("data:image/png;base64,"), "<title>A &amp; B</title>" in page
    (2, True)
    """
    rows, columns, _ = writing.frames[0].shape
    images = "\n".join(
        f'<img width="{columns}" height="{rows}" alt="{html.escape(label)}" src="data:image/png;base64,{_png(frame)}"'
        f"{'' if number == 0 else ' hidden'}>"
        for number, (frame, label) in enumerate(zip(writing.frames, writing.labels, strict=True))
    )
    text = (
        PAGE.replace("@TITLE", html.escape(writing.title))
        .replace("@LAST", str(len(writing.frames) - 1))
        .replace("@MILLISECONDS", json.dumps(round(1000.0 * writing.seconds)))
        .replace("@IMAGES", images)
    )
    with atomic_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _png(frame: Frame) -> str:
    stream = io.BytesIO()
    _pillow().fromarray(frame).save(stream, format="PNG", optimize=True)
    return base64.b64encode(stream.getvalue()).decode("ascii")


WRITERS: dict[str, Writer] = {".gif": write_gif, ".mp4": write_mp4, ".html": write_page}
"""By extension."""

ANIMATION_EXTENSIONS = tuple(WRITERS)

PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>@TITLE</title>
<style>
body { margin: 1.5rem auto; max-width: 60rem; padding: 0 1rem; font: 15px system-ui, sans-serif; color: #1c1c22; }
#frames img { max-width: 100%; height: auto; }
#frames img[hidden] { display: none; }
#hands { display: flex; gap: 0.8rem; align-items: center; max-width: 40rem; }
#place { flex: 1; }
button { font: inherit; min-width: 5rem; padding: 0.3rem 0.8rem; }
</style>
<div id="frames">
@IMAGES
</div>
<div id="hands">
<button id="play" type="button">Play</button>
<input id="place" type="range" min="0" max="@LAST" value="0" step="1" aria-label="Observer">
<output id="number" for="place">1</output>
</div>
<script>
"use strict";
const images = [...document.querySelectorAll("#frames img")];
const [play, place, number] = ["play", "place", "number"].map((id) => document.getElementById(id));
let timer = 0;
function show() {
  const shown = Number(place.value);
  images.forEach((image, i) => { image.hidden = i !== shown; });
  place.setAttribute("aria-valuetext", images[shown].alt);
  number.textContent = `${shown + 1} / ${images.length}`;
}
function stop() {
  clearInterval(timer);
  timer = 0;
  play.textContent = "Play";
}
play.addEventListener("click", () => {
  if (timer) { stop(); return; }
  play.textContent = "Pause";
  timer = setInterval(() => { place.value = (Number(place.value) + 1) % images.length; show(); }, @MILLISECONDS);
});
place.addEventListener("input", () => { stop(); show(); });
show();
</script>
</html>
"""
