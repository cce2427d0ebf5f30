"""What files say of the share that is scattered, held against what their tables add up to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.report import Complaint

CLOSE = 0.01
"""Relative difference of stated and integrated share that is not worth a word."""

ROUNDING = 1e-6
"""Relative difference that values of some seven digits make: below it nothing was scaled."""


def disagreements(slices: Iterable[BsdfSlice]) -> Iterator[Complaint]:
    """A complaint for each slice whose stated share differs from its integral by more than 1 %."""
    for one in slices:
        if one.stated is None:
            continue
        found = one.integral()
        if abs(found - one.stated) > CLOSE * max(abs(one.stated), 1e-12):
            text = f"the stated share is {one.stated:.6g}, the table adds up to {found:.6g}"
            yield Complaint("note", f"{one.theta:g}° of incidence", text)


def scaled(tables: Sequence[tuple[str, float, float]]) -> Iterator[Complaint]:
    """A note on tables that hold f in proportion alone, and were scaled to what their file states.

    Parameters
    ----------
    tables : sequence of (place, stated share, share that its values add up to as they stand)
        Of tables that do not add up to 0.

    Yields
    ------
    Complaint
        One for all of them, at the place where the factor is farthest from 1; none if nothing was scaled.

    Examples
    --------
    >>> [str(one) for one in scaled([("15° of incidence", 0.1345, 0.269)])]
    ['note: 15° of incidence: the stated share is 0.1345, the table adds up to 0.269: values are scaled by 0.5']
    """

    def off(table: tuple[str, float, float]) -> float:
        _, stated, found = table
        return abs(math.log(stated / found)) if stated > 0.0 else math.inf

    if not tables or max(map(off, tables)) < ROUNDING:
        return
    place, stated, found = max(tables, key=off)
    factors = sorted(each / whole for _, each, whole in tables)
    text = (
        f"the stated share is {stated:.6g}, the table adds up to {found:.6g}: values are scaled by {stated / found:.6g}"
    )
    if factors[-1] - factors[0] > ROUNDING * factors[-1]:
        text += f"; at other places by {factors[0]:.6g} to {factors[-1]:.6g}"
    yield Complaint("note", place, text)
