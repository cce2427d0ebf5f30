"""Rows of numbers in text ray files, written with the 17 digits that give every double back."""

from __future__ import annotations

from collections.abc import Callable
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.formats.rays.shared import Written
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayBatch, RayStream

FloatArray = npt.NDArray[np.float64]

STRETCH = 1 << 15
"""Rays formatted at a time: some 10 MB of text and Python numbers."""


def usable_rays(rays: RayStream) -> int:
    """Number of rays that will be written; costs one pass if the stream was not passed over yet.

    Raises
    ------
    ArgumentError
        If there are none.
    """
    tally = rays.tally if isinstance(rays, RaySet) else rays.pass_over()
    count = tally.usable
    if count == 0:
        raise ArgumentError(
            f"{rays.provenance.source}: not one of {len(rays):,} rays is usable; there is nothing to write."
        )
    return count


def write_rows(
    file: BinaryIO,
    rays: RayStream,
    columns: Callable[[RayBatch], list[FloatArray]],
    *,
    separator: str = " ",
    end_of_line: str = "\r\n",
) -> Written:
    """Write one row for each usable ray.

    Parameters
    ----------
    file : binary file
        At the beginning of the first row.
    rays : RayStream
        Their unusable rays are left out.
    columns : callable
        The columns of a batch's rows, each of shape (k,) or (k, m).
    separator, end_of_line : str
        Between numbers, and after each row.

    Returns
    -------
    Written
        Numbers of rays and of rays without flux.
    """
    written = Written()
    for batch in rays.batches(STRETCH):
        table = np.column_stack(columns(batch))
        row = separator.join(["%.17g"] * table.shape[1]) + end_of_line
        # One formatting operation for all rows is four times as fast as numpy.savetxt, which has one per row.
        file.write((row * len(table) % tuple(table.ravel().tolist())).encode("ascii"))
        written.rays += len(table)
        written.dark_rays += int((batch.flux == 0).sum())
    return written


def geometry(rays: RayStream, batch: RayBatch) -> list[FloatArray]:
    """Position [mm], if the rays have one, and direction."""
    return [batch.position, batch.direction] if rays.has_position else [batch.direction]
