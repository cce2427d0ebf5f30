"""The characteristic curve of a source: how much étendue is how bright."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.light_field import LightField
from etendue.quantities.ray_stream import checked_threads
from etendue.units import MM2_PER_M2

POINTS = 1 << 18
"""Lines at which a field is read. Of five sources their sum is the flux to 5e-4, and the étendue of half of it that of 2²²
lines to 7e-4; the brightest luminances differ by less than a fiftieth of their standard errors."""

BATCH = 1 << 18
"""Lines that are read at a time."""

STEPS = 256
"""Steps of the curve in the logarithm of the étendue, and as many again in the étendue."""

ROOT = np.roots([1, 0, 0, 0, -1, -1]).real.max()
"""The root of x⁵ = x + 1: the points {i / root^k}, k = 1 to 4, are spread evenly however many there are ([Roberts2018]_)."""


@dataclasses.dataclass(frozen=True, eq=False)
class CharacteristicCurve:
    """Lines of a source sorted by their luminance, the brightest first: luminance and flux against étendue.

    At étendue U stands the luminance that U mm² sr of the source's lines reach at least. Lossless optics turn and shift
    lines but leave the curve as it is, so it tells what can be made of a source: the flux within U is the most that any
    optics can send through an aperture of that étendue.

    Parameters
    ----------
    etendue : array, shape (n,)
        Cumulated, at the ends of the steps [mm² sr].
    luminance : array, shape (n,)
        Mean over each step [cd/m² or W/(m² sr)].
    standard_error : array, shape (n,)
        Root mean square over the step of the field's standard errors, same unit. Noise steepens the curve: what is too
        bright by chance is sorted to the front.
    flux : array, shape (n,)
        Cumulated, at the ends of the steps [flux unit].
    total_etendue : float
        Of all lines of the carrier surface, dark ones included [mm² sr].
    """

    etendue: FloatArray
    luminance: FloatArray
    standard_error: FloatArray
    flux: FloatArray
    total_etendue: float

    def etendue_of(self, share: float) -> float:
        """The smallest étendue that holds this share of the flux [mm² sr].

        Raises
        ------
        ArgumentError
            If the share is not from 0 to 1.
        """
        if not 0.0 <= share <= 1.0:
            raise ArgumentError(f"share is {share!r}; give a share of the flux, 0 to 1.")
        flux, etendue = np.append(0.0, self.flux), np.append(0.0, self.etendue)
        return float(np.interp(share * self.flux[-1], flux, etendue))


def characteristic_curve(field: LightField, points: int = POINTS, *, threads: int | None = None) -> CharacteristicCurve:
    """The characteristic curve of a light field as it is read out.

    The field is read along lines that are spread evenly over the étendue of the surface, by a lattice in the charts: what
    lies between the centres of cells, and what the fine factors of a product base do there, counts as it does in a map.

    Parameters
    ----------
    field : LightField
        Any.
    points : int
        Number of lines.
    threads : int, optional
        All cores if None.

    Raises
    ------
    ArgumentError
        If there is no line to read.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> field = LightField.fit(et.RingSource(rays=50_000), Disk(radius=30), depths=(4, 4, 2, 2))
    >>> curve = characteristic_curve(field, points=30_000)
    >>> round(curve.flux[-1]), round(curve.total_etendue)
    (600, 8883)
    """
    if not points >= 1:
        raise ArgumentError(f"points is {points!r}; give at least one line.")
    lines = list(_read(field, points, checked_threads(threads)))
    etendue, luminance, deviation = (np.concatenate(column) for column in zip(*lines, strict=True))
    order = np.argsort(-luminance, kind="stable")
    etendue, luminance, deviation = etendue[order], luminance[order], deviation[order]
    ends = _steps(len(order))
    starts = np.append(0, ends[:-1])

    def per_step(values: FloatArray) -> FloatArray:
        sums: FloatArray = np.add.reduceat(values, starts)
        return sums

    width = per_step(etendue)
    flux = per_step(etendue * luminance)
    return CharacteristicCurve(
        etendue=np.cumsum(width),
        luminance=flux / width * MM2_PER_M2,
        standard_error=np.sqrt(per_step(etendue * deviation**2) / width) * MM2_PER_M2,
        flux=np.cumsum(flux),
        total_etendue=float(width.sum()),
    )


def _read(field: LightField, points: int, threads: int | None) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Étendue [mm² sr] that each line stands for, luminance and standard error there [flux unit/(mm² sr)], in batches.

    A line that leaves several parts is met as often, and stands for as much less each time.
    """
    charts = field.surface.parts()
    whole = sum(chart.etendue for chart in charts)
    for chart in charts:
        # Half of the points go to each part alike: a narrow beam has little étendue and much of the light.
        n = max(round(points * (chart.etendue / whole + 1.0 / len(charts)) / 2.0), 1)
        for start in range(0, n, BATCH):
            coordinates = _lattice(start, min(start + BATCH, n))
            x, k = _core.rays_of_part(chart.core(), coordinates)
            times = np.ones(len(x))
            for other in charts:
                if other is not chart:
                    times += _core.cross_parts([other.core()], x, k)[0] >= 0
            luminance, deviation = field.core.luminance(x, k, threads)
            yield np.full(len(x), chart.etendue / n) / times, luminance, deviation


def _lattice(start: int, stop: int) -> FloatArray:
    """Points `start` to `stop` of a lattice in the unit cube of four dimensions, (n, 4)."""
    # The products lose no digits that matter: 2^53 is far above the number of points.
    points: FloatArray = np.mod(0.5 + np.arange(start, stop)[:, None] * ROOT ** -np.arange(1.0, 5.0), 1.0)
    return points


def _steps(n: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Ends of the steps: even in the étendue and in its logarithm."""
    even, growing = np.linspace(n / STEPS, n, STEPS), np.geomspace(1.0, n, STEPS)
    return np.unique(np.rint(np.concatenate([even, growing])).astype(np.intp).clip(1, n))
