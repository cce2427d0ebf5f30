"""Moving pictures as files: GIF, MP4 and a page of its own, with the same bytes for the same frames."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from etendue.extras import require
from etendue.formats.output import atomic_output

Frame = npt.NDArray[np.uint8]
"""A picture, shape (rows, columns, 3)."""

COLOURS = 256
"""Of a GIF, the same for all frames."""

LOOKED_AT = 24
"""Frames, evenly over all, from which the colours are chosen."""


def write_gif(frames: Sequence[Frame], path: str | os.PathLike[str], seconds: float) -> None:
    """Write an animated GIF that starts again at its end, in one palette and without dithering.

    Parameters
    ----------
    frames : sequence of array of uint8, shape (rows, columns, 3)
        All of one size.
    path : path
        The file.
    seconds : float
        That a frame stays, rounded to hundredths.

    Raises
    ------
    ArgumentError
        If the directory of `path` does not exist.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> frames = [np.full((4, 6, 3), level, np.uint8) for level in (0, 255)]
    >>> with TemporaryDirectory() as folder:
    ...     write_gif(frames, Path(folder) / "two.gif", 0.5)
    ...     (Path(folder) / "two.gif").read_bytes()[:6]
    b'GIF89a'
    """
    require("matplotlib")  # which brings Pillow
    from PIL import Image

    some = [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, LOOKED_AT).astype(int))]
    palette = Image.fromarray(np.concatenate(some)).quantize(COLOURS, method=Image.Quantize.MEDIANCUT)
    indexed = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    with atomic_output(path) as temporary:
        indexed[0].save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=indexed[1:],
            duration=max(20, 10 * round(100.0 * seconds)),
            loop=0,
            optimize=False,
            disposal=1,
        )
