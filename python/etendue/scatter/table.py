"""`BsdfTable`: a BSDF from slices, measured or computed."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.errors import ArgumentError
from etendue.quantities.arguments import require
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import NORMAL
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.mirror_images import unfolded, unlike_its_image
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint
from etendue.scatter.balance import CLOSE, MOST, balanced
from etendue.scatter.bsdf import Bsdf as Bsdf  # noqa: PLC0414 - handed on to `etendue`
from etendue.scatter.bsdf import Side
from etendue.scatter.building import built
from etendue.scatter.members import components_of, members_of, same_when_turned
from etendue.scatter.scans.interpolations import tabulated
from etendue.scatter.scans.scans import Scans

EXTRAPOLATED = 0.02
"""Part of what a slice scatters that may lie beyond its directions without a word: Lambertian light beyond 82°."""

FAINT = 1e-4
"""Share of the light that may as well."""

LARGE_HOLES, MANY_HOLES = 0.1, 0.25
"""Parts of the light of a slice, and of its values, that may lie in holes before they are a warning and no note."""

UNLIKE = 0.1
"""Part of its light by which a slice may differ from its mirror image without a word, if it is said to be that."""


class BsdfTable(Bsdf):
    """A BSDF as a table of slices, with the components that a file describes by models.

    Between incidences the lobe moves with the specular direction and keeps its energy, below the first as well; beyond the
    last its share goes on as it does there: docs/scatter.md. Samples are exact.

    Parameters
    ----------
    data : BsdfData
        Slices and components.

    Raises
    ------
    ArgumentError
        If there is nothing in it, light of one direction is in several slices, or more than 101 % of the light leaves, in
        both ways and by components together.

    Examples
    --------
    >>> import numpy as np
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.quantities.bsdf_slice import BsdfSlice
    >>> from etendue.quantities.polar_grid import PolarGrid
    >>> grid = PolarGrid("normal", [0.0, 90.0], [0.0])
    >>> half = BsdfTable(BsdfData([BsdfSlice(direction(30.0, 0.0), [[0.5 / np.pi] * 2], grid=grid)]))
    >>> half.reflectance([0, 30, 80]).round(6).tolist()
    [0.5, 0.5, 0.5]
    """

    def __init__(self, data: BsdfData) -> None:
        require(data, BsdfData, "BsdfTable: data", "a BsdfData; of a file et.read_bsdf(path) makes a table")
        if not data.slices and not data.components:
            raise ArgumentError("a BSDF has slices or components; these data hold neither")
        _require_one_of_each(data)
        if data.mirrored:
            data = dataclasses.replace(data, slices=tuple(map(unfolded, data.slices)))
        self.data = data
        told = tuple(_told(data))
        self._balanced, self._weight, more = balanced(data, [share_of(one) for one in data.slices])
        self.complaints: tuple[Complaint, ...] = (*data.complaints, *told, *more)

    @classmethod
    def from_scans(cls, scans: Scans, method: str = "automatic") -> BsdfTable:
        """See `Bsdf.from_scans`."""
        return cls(tabulated(scans, method))

    def __getstate__(self) -> dict[str, Any]:
        """For pickle: what was asked of the core is asked again."""
        return {key: value for key, value in self.__dict__.items() if key not in ("_compiled", "_record")}

    def __repr__(self) -> str:
        """Name, slices and angles."""
        angles = sorted({round(one.theta, 3) for one in self.data.slices})
        held = f"{len(self.data.slices)} slices" + (f" at {angles[0]:g} to {angles[-1]:g}°" if angles else "")
        return f"BsdfTable({self.data.name!r}, {held}, {len(self.data.components)} components)"

    @property
    def name(self) -> str:
        """What its file calls it."""
        return self.data.name

    @property
    def isotropic(self) -> bool:
        """Whether turning the sample about its normal changes nothing."""
        return self.data.isotropic and all(map(same_when_turned, components_of(self.data)))

    @property
    def both_sides(self) -> bool:
        """Whether light that meets the back is treated as light that meets the front."""
        return self.data.both_sides

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """At which it is known [nm]; empty: it is the same at all."""
        return self.data.wavelengths

    @property
    def incidences(self) -> tuple[float, ...]:
        """Angles of incidence at which it is known [°], in order."""
        return tuple(sorted({round(one.theta, 6) for one in self.data.slices}))

    def _last(self, side: Side, transmitted: bool) -> float:
        thetas = [
            one.theta
            for one in self.data.slices
            if one.transmitted is transmitted and (self.both_sides or one.front is (side == "front"))
        ]
        return round(max(thetas, default=90.0), 6)

    def record(self, files: Files) -> dict[str, Any]:  # noqa: ARG002 - nothing in it comes from files
        """As the core takes it."""
        return self._record

    @functools.cached_property
    def _record(self) -> dict[str, Any]:
        found = self._balanced
        if found is None:
            found = members_of(self.data, [share_of(one) for one in self.data.slices])
        members = [(self._weight, part) for part in found]
        if len(members) == 1 and self._weight == 1.0:
            return members[0][1]
        record = {"kind": "sum", "members": members}
        try:
            built(record)
        except ValueError as error:
            raise ArgumentError(f"the table {self.name!r}: {error}") from None
        return record


Bsdf.table = BsdfTable


def _require_one_of_each(data: BsdfData) -> None:
    """Refuse several slices of the same light, of which one alone would count."""
    known: dict[tuple[object, ...], BsdfSlice] = {}
    for one in data.slices:
        if one.theta < NORMAL:
            continue
        phi = 0.0 if data.isotropic else round(one.phi, 6) % 360.0
        other = known.setdefault((one.front, one.transmitted, one.wavelength, round(one.theta, 6), phi), one)
        if other is not one:
            raise ArgumentError(
                f"there are two slices of light at {one.theta:g}° of incidence, from azimuths {other.phi:g}° and "
                f"{one.phi:g}°{', of an isotropic sample' if data.isotropic else ''}: give one, or their mean"
            )


def share_of(one: BsdfSlice) -> float:
    """What a slice scatters of the flux: its integral, no less than 0 and no more than 1.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.quantities.polar_grid import PolarGrid
    >>> grid = PolarGrid("normal", [0.0, 90.0], [0.0])
    >>> round(share_of(BsdfSlice(direction(20.0, 0.0), [[0.1, 0.1]], grid=grid)), 6)
    0.314159
    """
    return min(max(one.integral(), 0.0), 1.0)


def _told(data: BsdfData) -> Iterable[Complaint]:
    for one in data.slices:
        share = one.integral()
        way = "transmits" if one.transmitted else "reflects"
        if share > MOST:
            raise ArgumentError(
                f"at {one.theta:g}° of incidence the table {way} {share:.4g} of the light, more than it receives"
            )
        # Noise below 0 is no light that could be drawn.
        lifted = share
        if (one.values < 0.0).any():
            lifted = dataclasses.replace(one, values=np.maximum(one.values, 0.0)).integral()
        place = f"{one.theta:g}° of incidence"
        if share < 0.0:
            yield Complaint("warning", place, f"values add up to {share:.4g} of the light: nothing is scattered")
        elif lifted > share * MOST:
            found = f"values below 0 become 0, and the others are scaled by {share / lifted:.3g} to the same share"
            yield Complaint("warning", place, found)
        if share > 1.0 + CLOSE:
            yield Complaint("warning", place, f"{way} {share:.6g} of the light; scaled to 1")
    if data.slices:
        yield from _holes(data)
        yield from _beyond(data)
    mirrored = data.slices if data.mirrored else ()
    unlike = max(((unlike_its_image(one), one.theta) for one in mirrored), default=(0.0, 0.0))
    if unlike[0] > UNLIKE:
        yield Complaint(
            "warning",
            f"{unlike[1]:g}° of incidence",
            f"both sides of the plane of incidence differ by {unlike[0]:.0%} of the light, and are made equal, as the data "
            "are said to be mirrored; with mirrored=False they stay as they are",
        )


def _holes(data: BsdfData) -> Iterable[Complaint]:
    """What was not measured between what was, of the slice with most light there."""
    told = [one for one in data.slices if one.grid is not None and one.holes.any()]
    if not told:
        return
    light = [_light_of(one, one.holes) / max(one.integral(), FAINT) for one in told]
    worst = int(np.argmax(light))
    one, part = told[worst], light[worst]
    count, all_ = int(one.holes.sum()), int((one.holes | ~np.isnan(one.values)).sum())
    also = f" (and {len(told) - 1} more slice{'s' if len(told) > 2 else ''})" if len(told) > 1 else ""
    grave = part > LARGE_HOLES or count > MANY_HOLES * all_
    found = (
        f"{count} of {all_} values were not measured and are interpolated between those that were, ln f linear in angle and "
        f"azimuth: {part:.2g} of the light of the slice lies there"
    )
    yield Complaint(
        "warning" if grave else "note",
        f"{one.theta:g}° of incidence{also}",
        found + (", which is as uncertain as the rule" if grave else ""),
    )


def _light_of(one: BsdfSlice, which: npt.NDArray[np.bool_]) -> float:
    """The share of the flux in values of a slice on a grid."""
    return dataclasses.replace(one, values=np.where(which, one.held, 0.0), standard_error=None).integral()


def _beyond(data: BsdfData) -> Iterable[Complaint]:
    """What of the light is in no value, where that is most of it."""
    beyond = [_extrapolated(one) for one in data.slices]
    told = [k for k, one in enumerate(data.slices) if beyond[k] > max(EXTRAPOLATED * one.integral(), FAINT)]
    if told:
        worst = max(told, key=beyond.__getitem__)
        one, more = data.slices[worst], len(told) - 1
        share, way = one.integral(), "transmits" if one.transmitted else "reflects"
        also = f" (and {more} more slice{'s' if more > 1 else ''})" if more else ""
        yield Complaint(
            "warning",
            f"{one.theta:g}° of incidence{also}",
            f"of the {share:.4g} of the light that the table {way}, {beyond[worst]:.4g} lies beyond the directions of its "
            "values, where f is taken for that of the last: the share is as uncertain as that",
        )


def _extrapolated(one: BsdfSlice) -> float:
    """What a slice on a grid scatters beyond its last values: its integral less that of the same values, 0 behind them."""
    if one.grid is None:
        return 0.0
    unknown = np.isnan(one.values) & ~one.holes
    behind = np.logical_and.accumulate(unknown[:, ::-1], axis=1)[:, ::-1]
    radial = np.append(one.grid.radial, one.grid.radial[-1] + 1e-6)
    values = np.pad(np.where(behind, 0.0, np.where(one.holes, one.held, one.values)), ((0, 0), (0, 1)))
    grid = PolarGrid(one.grid.frame, radial, one.grid.azimuth)
    return one.integral() - dataclasses.replace(one, grid=grid, values=values, standard_error=None).integral()
