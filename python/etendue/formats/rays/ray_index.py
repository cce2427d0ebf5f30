"""Rays in an order in which those that an observer may see stand together: cone maps in milliseconds."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError, FormatError, UnknownNameError
from etendue.formats.input import as_path
from etendue.formats.output import atomic_output
from etendue.formats.rays.index_building import Counted, IndexTables, Records, count_rays, fill_index
from etendue.formats.rays.index_file import DAMAGED, HEADER, map_new, read_index, text_of, write_tables
from etendue.quantities.arguments import require, require_callable, require_fields
from etendue.quantities.file_records import AnyRecords
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, RayStream, Tally, checked_threads
from etendue.quantities.repeated_rays import Repeats
from etendue.quantities.report import Complaint

STRETCH = 1 << 11
"""Rays in a row that are compared with each other."""


class RayIndex(RaySet):
    """A ray set sorted by direction and position, which answers cone maps for any observer without a pass over all rays.

    The rays are those of the source, each with its record byte by byte, in another order. `luminance_map` counts the same
    rays as it does for the source, and looks only at those that the observer may see: of 10⁸ rays from a Lambertian source
    some 10⁵ for a distant observer. All else that a ray set can do, an index can, too; what makes other rays of it
    (`subset`, `moved`, `in_unit`) gives a plain ray set.

    Make one with `RayIndex.build`, or open the file of one with `RayIndex.open` or `read_rays`.

    Examples
    --------
    >>> import etendue as et
    >>> rays = et.RingSource(rays=200_000, seed=1)
    >>> index = et.RayIndex.build(rays)
    >>> observer, screen = et.Observer(10, 45, 1000), et.Screen(70, 70, 8, 8)
    >>> lmap = et.luminance_map(index, observer, screen)
    >>> bool((lmap.rays == et.luminance_map(rays, observer, screen, method="cone").rays).all())
    True
    """

    def __init__(self, records: AnyRecords, meaning: RaySetMeaning, tables: IndexTables, tally: Tally) -> None:
        self._adopt(records, meaning)
        self._tables = tables
        self._tally = tally

    @classmethod
    def build(
        cls,
        rays: RayStream,
        path: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> RayIndex:
        """Index rays: two passes over them, and one over the cells they fall into.

        Parameters
        ----------
        rays : RayStream
            A ray set or a source that draws its rays. Rays that cannot be used are left out, and complained about.
        path : path, optional
            File to write (``.etd``), whole or not at all; memory then holds some batches of rays, whatever their number.
            None: the index stays in memory.
        threads : int, optional
            All cores if None. The index has the same bytes for any number.
        progress : callable, optional
            Called with a number of rays that rises to all of them over the three passes.

        Raises
        ------
        ArgumentError
            If the rays have no position, not one can be used, or the path cannot be written.
        OSError
            If the disk has no room.

        Examples
        --------
        >>> import etendue as et
        >>> index = et.RayIndex.build(et.RingSource(rays=1000))
        >>> len(index), round(index.total_flux, 9)
        (1000, 600.0)
        """
        require(rays, RayStream, "RayIndex.build: rays", "rays, of a file et.read_rays(path)")
        require_callable(progress)
        if path is None:
            counted = count_rays(rays, threads, progress)
            records: Records = np.zeros(counted.rays, counted.dtype)
            tables = fill_index(rays, counted, records, threads, progress)
            records.setflags(write=False)
            meaning = _meaning(rays, counted)
            steps = meaning.provenance.then("indexed by direction and position")
            return cls(records, dataclasses.replace(meaning, provenance=steps), tables, _usable(counted.tally))
        with atomic_output(path) as temporary:
            write_index(rays, temporary, threads, progress)
        return cls.open(path)

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> RayIndex:
        """The index in a file. Its rays are not read: 10⁸ of them open in some milliseconds.

        Raises
        ------
        FormatError
            If the file is no index, of another version, cut short or damaged.
        OSError
            If it cannot be opened.

        Examples
        --------
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> import etendue as et
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder) / "rings.etd"
        ...     _ = et.RayIndex.build(et.RingSource(rays=1000), path)
        ...     print(et.RayIndex.open(path))
        <RayIndex of 1,000 rays in lm from rings.etd>
        """
        path = as_path(path)
        records, meaning, tables, tally = read_index(path)
        try:
            return cls(records, meaning, tables, tally)
        except (ArgumentError, UnknownNameError) as error:
            place, found = f"byte {HEADER.size}", f"the JSON text is not that of an index: {error}"
            raise FormatError(path, place, found, DAMAGED) from error

    @classmethod
    def from_records(cls, records: AnyRecords, meaning: RaySetMeaning) -> RaySet:  # type: ignore[override]
        """A plain ray set: records that were made of an index's rays stand in no order that its tables know."""
        return RaySet.from_records(records, meaning)

    def replace(self, **changes: Any) -> RaySet:  # type: ignore[override]
        """The index over the same rays with some fields of its meaning changed; a plain set if lengths are among them."""
        if changes.get("length_scale", self.meaning.length_scale) != self.meaning.length_scale:
            return super().replace(**changes)
        require_fields(changes, RaySetMeaning, "RaySet")
        return RayIndex(self.records, dataclasses.replace(self.meaning, **changes), self._tables, self.tally)

    def __repr__(self) -> str:
        """Say what a person wants to know, without a pass over the rays."""
        return f"<RayIndex of {len(self):,} rays in {self.flux_unit} from {self.provenance.source}>"

    def _compared(self) -> Repeats:
        # Copies of a ray stand together, so that a few short stretches tell of them.
        return Repeats.of(self, STRETCH)

    @property
    def tables(self) -> IndexTables:
        """Cells and boxes, for those who look into an index by other means."""
        return self._tables

    def cone_sums(
        self, cones: Sequence[_core._Cone], threads: int | None = None, progress: Progress | None = None
    ) -> list[tuple[_core._ConeCells, int]]:
        """For each cone the sums over the rays that it sees, as `_core.cone_sums` gives them, and the rays looked at.

        Examples
        --------
        >>> import etendue as et
        >>> index = et.RayIndex.build(et.RingSource(rays=500_000))
        >>> view = et.Screen(70, 70, 4, 4).core_view(et.Observer(0, 0, 1000))
        >>> [((flux, squares, rays), looked)] = index.cone_sums([{"view": view, "acceptances": [0.026], "disk": None}])
        >>> rays.shape, looked < len(index) / 4
        ((1, 4, 4), True)
        """
        tables = self._tables
        return _core.index_sums(
            self.core_source(), tables.side, tables.starts, tables.bounds, tables.centre, cones,
            checked_threads(threads), progress,
        )  # fmt: skip


def write_index(
    rays: RayStream, path: Path, threads: int | None = None, progress: Progress | None = None
) -> tuple[str, ...]:
    """Write the index of some rays to an empty file that is there.

    Returns
    -------
    tuple of str
        What is not in the file, one sentence each.
    """
    counted = count_rays(rays, threads, progress)
    meaning = _meaning(rays, counted)
    text = text_of(meaning, counted.dtype, _usable(counted.tally), counted.centre)
    records = map_new(path, counted, text)
    tables = fill_index(rays, counted, records, threads, progress)
    records.flush()  # type: ignore[attr-defined]
    del records
    write_tables(path, counted, tables, text)
    lost = counted.tally.unusable
    if not lost:
        return ()
    why = "a value is not finite, the direction is missing or the flux is negative"
    return (f"{lost:,} of {counted.tally.rays:,} rays are not written: {why}.",)


def _usable(tally: Tally) -> Tally:
    """The account of the rays that are left when those that cannot be used are gone."""
    return dataclasses.replace(tally, rays=tally.usable, not_finite=0, no_direction=0, negative_flux=0)


def _meaning(rays: RayStream, counted: Counted) -> RaySetMeaning:
    """What the records mean: what they meant."""
    if not isinstance(rays, RaySet):
        return RaySetMeaning(flux_unit=rays.flux_unit, stored_flux_scale=rays.flux_scale, provenance=rays.provenance)
    lost = counted.tally.unusable
    if not lost:
        return rays.meaning
    found = f"{lost:,} of {counted.tally.rays:,} rays could not be used and are not in the index"
    return dataclasses.replace(rays.meaning, complaints=(*rays.meaning.complaints, Complaint("error", "rays", found)))
