"""What files say of the share that is scattered, held against what their tables add up to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from etendue.quantities.bsdf_data import BsdfSlice
from etendue.quantities.report import Complaint

CLOSE = 0.01
"""Relative difference of stated and integrated share that is not worth a word."""


def disagreements(slices: Iterable[BsdfSlice]) -> Iterator[Complaint]:
    """A complaint for each slice whose stated share differs from its integral by more than 1 %."""
    for one in slices:
        if one.stated is None:
            continue
        found = one.integral()
        if abs(found - one.stated) > CLOSE * max(abs(one.stated), 1e-12):
            text = f"the stated share is {one.stated:.6g}, the table adds up to {found:.6g}"
            yield Complaint("note", f"{one.theta:g}° of incidence", text)
