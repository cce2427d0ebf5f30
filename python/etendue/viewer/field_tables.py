"""A light field as the page holds it: tables of codes in equal steps of the logarithm, and a bound of their error."""

from __future__ import annotations

import base64
import dataclasses
import math
import zlib
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Part
from etendue.lightfield.etendue_density import EtendueDensity, PartField, core_part
from etendue.units import MM2_PER_M2

FloatArray = npt.NDArray[np.float64]

STEPS = ((0.002, 0.06), (0.002, 0.2), (0.005, 0.2), (0.01, 0.2), (0.02, 0.2))
"""Steps of ln r and of the logarithm of its standard deviation, finest first: each is off by half of its step at most. A
field is kept in the first that is as small as is wanted. How large an error is is known less well than to a tenth."""

FACTOR_SHARE = 0.5
"""Step of the factors over place and over direction, as a share of the ratio's."""

LARGEST_CODE = 0xFFFF


@dataclasses.dataclass(frozen=True, eq=False)
class LogTable:
    """Numbers as codes: 0 stands for 0, code c for ``lowest · exp((c - 1) · step)``.

    Parameters
    ----------
    codes : array of uint16
    lowest : float
        The least number above 0.
    step : float
        Of the natural logarithm; a number is off by half of it at most.

    Examples
    --------
    >>> LogTable.of(np.array([0.0, 1.0, 2.0]), 0.01).codes.tolist()
    [0, 1, 70]
    """

    codes: npt.NDArray[np.uint16]
    lowest: float
    step: float

    @classmethod
    def of(cls, values: npt.ArrayLike, step: float) -> Self:
        """The table of numbers that are not negative.

        Raises
        ------
        ArgumentError
            If they span more than the codes do.
        """
        numbers = np.asarray(values, dtype=np.float64)
        above = numbers > 0.0
        lowest = float(numbers[above].min()) if above.any() else 1.0
        steps = np.round(np.log(np.where(above, numbers, lowest) / lowest) / step)
        if steps.max(initial=0.0) >= LARGEST_CODE:
            raise ArgumentError(
                f"numbers from {lowest:g} to {numbers.max():g} do not fit into steps of {step:g}: the light field is "
                "brighter in some cells than in others by more than any source is; fit it again."
            )
        return cls(np.where(above, steps + 1.0, 0.0).astype(np.uint16), lowest, step)

    def values(self) -> FloatArray:
        """The numbers that the codes stand for."""
        numbers: FloatArray = self.lowest * np.exp((self.codes - 1.0) * self.step)
        return np.where(self.codes > 0, numbers, 0.0)

    def packed(self) -> dict[str, Any]:
        """For the page, whose `tables.js` reads it: differences of the codes, folded, low bytes before high ones."""
        flat = self.codes.ravel()
        steps = np.diff(flat, prepend=np.uint16(0)).astype(np.int16)
        folded = ((steps << 1) ^ (steps >> 15)).astype("<u2")
        planes = folded.view(np.uint8).reshape(-1, 2).T
        deflated = zlib.compress(np.ascontiguousarray(planes).tobytes(), 9)
        return {
            "shape": list(self.codes.shape),
            "lowest": self.lowest,
            "step": self.step,
            "data": base64.b64encode(deflated).decode("ascii"),
        }


@dataclasses.dataclass(frozen=True, eq=False)
class PartTables:
    """The tables of one part, as `etendue.lightfield.etendue_density.PartField` has them; deviations are relative."""

    chart: Part
    level: float
    ratio: LogTable
    deviation: LogTable
    space: LogTable | None
    direction: LogTable | None
    space_error: LogTable | None
    direction_error: LogTable | None
    cells_left: tuple[float, ...]
    within_left: tuple[float, ...]

    @classmethod
    def of(cls, chart: Part, part: PartField, step: float, error_step: float) -> Self:
        """The tables of a part, its ratio in steps of `step`, errors in steps of `error_step`."""
        ratio, deviation = (np.asarray(values, dtype=np.float64) for values in (part.ratio, part.deviation))
        relative = deviation / np.where(ratio > 0.0, ratio, 1.0)

        def table(values: FloatArray | None, step: float) -> LogTable | None:
            return None if values is None else LogTable.of(values, step)

        return cls(
            chart=chart,
            level=part.level,
            ratio=LogTable.of(ratio, step),
            deviation=LogTable.of(relative, error_step),
            space=table(part.space, step * FACTOR_SHARE),
            direction=table(part.direction, step * FACTOR_SHARE),
            space_error=table(part.errors.space, error_step),
            direction_error=table(part.errors.direction, error_step),
            cells_left=part.errors.cells_left,
            within_left=part.errors.within_left,
        )

    def packed(self) -> dict[str, Any]:
        """For the page, whose `field.js` reads it."""
        tables = {
            name: None if table is None else table.packed()
            for name in ("ratio", "deviation", "space", "direction", "space_error", "direction_error")
            for table in [getattr(self, name)]
        }
        chart = dataclasses.asdict(self.chart)
        left = {"cells_left": list(self.cells_left), "within_left": list(self.within_left)}
        return {"chart": chart, "level": self.level * MM2_PER_M2, **left, **tables}

    def core(self) -> _core._FieldPart:
        """What the page reads, as the compiled core takes it."""
        ratio = self.ratio.values()
        part = PartField(
            ratio=ratio.astype(np.float32),
            deviation=(np.where(ratio > 0.0, ratio, 1.0) * self.deviation.values()).astype(np.float32),
            space=None if self.space is None else self.space.values(),
            direction=None if self.direction is None else self.direction.values(),
            level=self.level,
        )
        return core_part(self.chart.core(), part)


@dataclasses.dataclass(frozen=True, eq=False)
class FieldTables:
    """A light field in tables.

    Parameters
    ----------
    parts : tuple of PartTables
    step, error_step : float
        Of the logarithms of the ratios and of the errors.
    ray_flux : float
        Of each of as many equal rays as the field rests on [flux unit]; NaN if that is not known.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=2000), et.Disk(radius=30), depths=(3, 3, 2, 2))
    >>> tables = FieldTables.of(field)
    >>> round(tables.bound, 4)
    0.002
    >>> lines = [[0, 0, 0], [12, 5, 0]], [[0, 0.6, 0.8], [0.1, 0, 1]]
    >>> bool(np.all(np.abs(tables.luminance(*lines) / field.luminance(*lines)[0] - 1) < tables.bound))
    True
    """

    parts: tuple[PartTables, ...]
    step: float
    error_step: float
    ray_flux: float

    @classmethod
    def of(cls, field: EtendueDensity, step: float = STEPS[0][0], error_step: float = STEPS[0][1]) -> Self:
        """The tables of a field, whose ratios are kept in steps of `step`."""
        pairs = zip(field.surface.parts(), field.parts, strict=True)
        parts = tuple(PartTables.of(chart, part, step, error_step) for chart, part in pairs)
        report = field.report
        # Not of the images that a symmetry gives: they tell nothing new of a region that lies over them.
        rests = (
            report.effective_rays if math.isfinite(report.effective_rays) else float(report.rays - report.unmet_rays)
        )
        return cls(parts, step, error_step, field.total_flux / rests if rests > 0.0 else math.nan)

    @classmethod
    def within(cls, field: EtendueDensity, most_bytes: int) -> tuple[Self, dict[str, Any]]:
        """The finest tables whose packed form has at most so many letters of JSON, or the coarsest; and that form."""
        for steps in STEPS:
            tables = cls.of(field, *steps)
            packed = tables.packed()
            if sum(_letters(part) for part in packed["parts"]) <= most_bytes:
                break
        return tables, packed

    @property
    def bound(self) -> float:
        """Largest relative error of a luminance: the product of those of the ratio and of both factors.

        Between cells a field is a mean of theirs with weights that are not negative, which is off by no more than the worst.
        """
        return math.expm1(self.step / 2 * (1 + 2 * FACTOR_SHARE))

    def packed(self) -> dict[str, Any]:
        """For the page."""
        ray_flux = None if math.isnan(self.ray_flux) else self.ray_flux
        return {"parts": [part.packed() for part in self.parts], "bound": self.bound, "ray_flux": ray_flux}

    def luminance(self, points: npt.ArrayLike, directions: npt.ArrayLike) -> FloatArray:
        """What the page reads along lines, by the core [cd/m² or W/(m² sr)], shape (n,)."""
        core = _core.LightField([part.core() for part in self.parts])
        x, k = (np.ascontiguousarray(v, dtype=np.float64) for v in (points, directions))
        values: FloatArray = core.luminance(x, k)[0] * MM2_PER_M2
        return values


def _letters(part: dict[str, Any]) -> int:
    return sum(len(table["data"]) for table in part.values() if isinstance(table, dict) and "data" in table)
