"""How good a light field is, where it is least certain, and what more rays would bring."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.characteristic import CharacteristicCurve, characteristic_curve
from etendue.lightfield.counting import FloatArray
from etendue.lightfield.etendue_density import FitReport, PartField
from etendue.lightfield.expected_loss import loss_of_gamma
from etendue.lightfield.forecast import Forecast, Predicted, make_forecast
from etendue.lightfield.light_field import LightField
from etendue.lightfield.resolution import Resolution
from etendue.lightfield.trees import Base
from etendue.quantities.arguments import require, require_callable
from etendue.quantities.measured import measured
from etendue.quantities.powers_of_ten import rounded
from etendue.quantities.ray_stream import RayStream, checked_seed, checked_threads
from etendue.units import LUMINANCE_UNIT, MM2_PER_M2, FluxUnit

BOXES = 8
"""Boxes along each coordinate of a part in which uncertainty is summed."""


@dataclasses.dataclass(frozen=True)
class UncertainSpot:
    """A box of places and directions that the field knows badly, by its worst cell.

    Parameters
    ----------
    part : str
        Name of the part of the surface.
    point : tuple of float
        Centre of the cell [mm].
    theta, phi : float
        Direction in which the light travels there [°].
    luminance, standard_error : float
        There [cd/m² or W/(m² sr)].
    share : float
        Of the loss of score that the error bars predict, in the box: an eighth of the part along each coordinate.
    """

    part: str
    point: tuple[float, float, float]
    theta: float
    phi: float
    luminance: float
    standard_error: float
    share: float


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnostics:
    """What is known of the quality of a light field; see `diagnose`.

    Parameters
    ----------
    surface : str
        The carrier surface, as the command line takes it.
    flux : float
        Of the field [`flux_unit`].
    flux_unit : {"lm", "W"}
    report : FitReport
        Of the fit.
    expected_error : float
        Relative error of luminance at a ray as the error bars predict it: √(2 · expected loss of score).
    curve : CharacteristicCurve
    spots : tuple of UncertainSpot
        The worst first.
    forecast : Forecast or None
        None if no rays were given.
    source : str
        Where the rays came from.
    resolution : Resolution
        What the field resolves.
    """

    surface: str
    flux: float
    flux_unit: FluxUnit
    report: FitReport
    expected_error: float
    curve: CharacteristicCurve
    spots: tuple[UncertainSpot, ...]
    forecast: Forecast | None
    source: str
    resolution: Resolution

    @property
    def learning(self) -> Forecast | None:
        """The old name of `forecast`."""
        warnings.warn("Diagnostics.learning is now called forecast.", DeprecationWarning, stacklevel=2)
        return self.forecast

    @property
    def lead(self) -> float:
        """By how much the held-out score lies above that of the equal-étendue histogram [nat per ray]."""
        return self.report.score - self.report.histogram_score

    def summary(self) -> str:
        """The diagnostics in a few lines."""
        unit, report, curve = LUMINANCE_UNIT[self.flux_unit], self.report, self.curve
        half, most = curve.etendue_of(0.5), curve.etendue_of(0.99)
        lines = [
            f"held-out score {report.score_text}",
            f"{self.lead:+.4f} nat per ray against the equal-étendue histogram",
            f"{report.effective_cells:,.0f} effective degrees of freedom",
            f"relative error at a ray by the error bars {self.expected_error:.1%}",
            f"half of the flux in {half:.4g} mm² sr, 99 % in {most:.4g} of {curve.total_etendue:.4g} mm² sr",
            f"brightest lines {measured(curve.luminance[0], curve.standard_error[0], unit)}: picked out, lifted by chance",
            f"resolves {self.resolution.summary()}",
        ]
        if self.forecast is not None:
            lines += _forecast_lines(self.forecast, self.expected_error)
        lines += [
            f"least certain: ({', '.join(f'{c:.4g}' for c in s.point)}) mm towards θ = {s.theta:.0f}°, φ = {s.phi:.0f}° "
            f"on the {s.part}: {measured(s.luminance, s.standard_error, unit)}, {s.share:.1%} of the expected loss"
            for s in self.spots[:3]
        ]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Everything, as plain data; ``learning`` is the old name of ``forecast``."""
        curve = self.curve
        forecast = None if self.forecast is None else _forecast_facts(self.forecast)
        return {
            "surface": self.surface,
            "flux": self.flux,
            "flux_unit": self.flux_unit,
            "luminance_unit": LUMINANCE_UNIT[self.flux_unit],
            "report": dataclasses.asdict(self.report),
            "lead_over_histogram": self.lead,
            "expected_error": self.expected_error,
            "characteristic_curve": {
                "total_etendue": curve.total_etendue,
                "etendue": curve.etendue.tolist(),
                "luminance": curve.luminance.tolist(),
                "standard_error": curve.standard_error.tolist(),
                "flux": curve.flux.tolist(),
            },
            "least_certain": [dataclasses.asdict(spot) for spot in self.spots],
            "forecast": forecast,
            "learning": forecast,  # its name until version 0.2
            "source": self.source,
            "resolution": dataclasses.asdict(self.resolution),
        }


def diagnose(
    field: LightField,
    rays: RayStream | None = None,
    *,
    spots: int = 12,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Diagnostics:
    """Judge a light field: its characteristic curve, where it is least certain, and what more rays would bring.

    Parameters
    ----------
    field : LightField
        Any.
    rays : RayStream, optional
        The rays it was fitted to; without them nothing can be said about more rays.
    spots : int
        How many places and directions of least certainty are named.
    seed : int
        Deals the rays into the parts that are fitted again.
    threads : int, optional
        All cores if None.
    progress : callable, optional
        Called with the number of fits done, of `etendue.lightfield.forecast.REFITS`.

    Raises
    ------
    ArgumentError
        If `spots` is below 0, or the rays are not those of the fit, or fewer than 4000.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.lightfield.carrier import Disk
    >>> rays = et.RingSource(rays=20_000)
    >>> field = LightField.fit(rays, Disk(radius=30), depths=(4, 4, 2, 2))
    >>> diagnostics = diagnose(field, rays)
    >>> bool(diagnostics.lead > 0), len(diagnostics.spots), diagnostics.forecast.factor(0.5).value > 4
    (True, 12, True)
    """
    require(field, LightField, "diagnose: field", "a LightField: et.LightField.fit(rays)")
    if rays is not None:
        require(rays, RayStream, "diagnose: rays", "the rays of the fit, of a file et.read_rays(path), or None")
    require_callable(progress)
    if not (isinstance(spots, int) and spots >= 0):
        raise ArgumentError(f"spots is {spots!r}; give a whole number, 0 or more.")
    if rays is not None and rays.flux_unit != field.flux_unit:
        raise ArgumentError(
            f"the field is in {field.flux_unit}, the rays are in {rays.flux_unit}; give the rays of the fit, in its unit."
        )
    threads, seed = checked_threads(threads), checked_seed(seed)
    forecast = None
    if rays is not None:
        forecast = make_forecast(field, rays, seed=seed, threads=threads, progress=progress)
    fluxes = field.part_flux
    flux = math.fsum(fluxes)
    losses = [share / flux * _losses(part) for part, share in zip(field.parts, fluxes, strict=True)]
    return Diagnostics(
        surface=field.surface.spec,
        flux=flux,
        flux_unit=field.flux_unit,
        report=field.report,
        expected_error=math.sqrt(2.0 * sum(float(loss.sum()) for loss in losses)),
        curve=characteristic_curve(field, threads=threads),
        spots=tuple(_spots(field, losses, spots)),
        forecast=forecast,
        source=field.provenance.source,
        # By its own seed: what else is said of this field states the same.
        resolution=field.resolution(threads=threads),
    )


def _losses(part: PartField) -> FloatArray:
    """What each cell adds to the expected loss of score on this part [nat per ray]."""
    ratio, deviation = part.ratio.astype(np.float64), part.deviation.astype(np.float64)
    mass = ratio * Base(part.space, part.direction).cells(ratio.shape)
    total = float(mass.sum())
    if total == 0.0:
        return np.zeros_like(mass)
    certainty = np.divide(ratio, deviation, out=np.full_like(ratio, np.inf), where=deviation > 0) ** 2
    losses: FloatArray = mass / total * loss_of_gamma(certainty)
    return losses


def _spots(field: LightField, losses: list[FloatArray], count: int) -> Iterator[UncertainSpot]:
    """The boxes of greatest loss, the worst first."""
    whole = sum(float(loss.sum()) for loss in losses)
    if whole == 0.0:
        return
    found = []
    for index, loss in enumerate(losses):
        sums = _boxes(loss).sum(axis=(1, 3, 5, 7)) / whole
        largest = np.argsort(sums, axis=None)[::-1][:count]
        found += [(float(sums.flat[n]), index, np.unravel_index(n, sums.shape)) for n in largest]
    for share, index, place in sorted(found, reverse=True)[:count]:
        if share > 0.0:
            yield _spot(field, index, _worst_cell(losses[index], place), share)


def _boxes(loss: FloatArray) -> FloatArray:
    """The cells by box and by place in the box, along each coordinate."""
    shape = []
    for n in loss.shape:
        boxes = min(n, BOXES)
        shape += [boxes, n // boxes]
    return loss.reshape(shape)


def _worst_cell(loss: FloatArray, place: tuple[np.intp, ...]) -> FloatArray:
    """Coordinates of the centre of the cell of greatest loss in a box."""
    boxes = _boxes(loss)
    a, b, c, d = place
    inside = boxes[a, :, b, :, c, :, d, :]
    within = np.unravel_index(int(inside.argmax()), inside.shape)
    cell = np.array(place) * inside.shape + within
    centre: FloatArray = (cell + 0.5) / loss.shape
    return centre


def _spot(field: LightField, index: int, coordinates: FloatArray, share: float) -> UncertainSpot:
    chart = field.surface.parts()[index]
    x, k = _core.rays_of_part(chart.core(), coordinates[None, :])
    (luminance,), (deviation,) = field.core.luminance(x, k)
    px, py, pz = (float(c) for c in x[0])
    kx, ky, kz = (float(c) for c in k[0])
    return UncertainSpot(
        part=chart.name,
        point=(px, py, pz),
        theta=math.degrees(math.atan2(math.hypot(kx, ky), kz)),
        phi=math.degrees(math.atan2(ky, kx)) % 360.0,
        luminance=float(luminance) * MM2_PER_M2,
        standard_error=float(deviation) * MM2_PER_M2,
        share=share,
    )


def _forecast_lines(forecast: Forecast, expected_error: float) -> list[str]:
    """What the forecast says, for people."""
    if not forecast.measurable:
        gain, spread = forecast.gains[-1], forecast.gain_errors[-1]
        return [
            f"no gain from more rays is measurable: the {expected_error:.1%} of the error bars is an upper bound",
            f"in fits to parts of the rays, twice as many changed the score by {gain:.1e} ± {spread:.1e} nat per ray",
        ]
    error, factor, gain = forecast.error(), forecast.factor(0.5), forecast.gain(4.0)
    return [
        f"relative error at a ray by fits to parts of the rays {_between(error, '{:.1%}')}, and what the grid blurs",
        f"half of it would take {_factor(factor)} times the rays on the cells of this field",
        f"four times the rays would raise the score by {_between(gain, '{:.4f}')} nat per ray, or by more on finer cells",
    ]


def _between(predicted: Predicted, form: str) -> str:
    value, low, high = (form.format(v) for v in predicted)
    return f"{value} ({low} to {high})"


def _factor(predicted: Predicted) -> str:
    value, low, high = (rounded(v, 3) for v in predicted)
    return f"{value} ({low} to {high})"


def _forecast_facts(forecast: Forecast) -> dict[str, Any]:
    """As plain data; without a measurable gain no number of rays is known to halve the error."""
    return {
        "measurable": forecast.measurable,
        "rays": forecast.rays.tolist(),
        "gains": forecast.gains.tolist(),
        "gain_errors": forecast.gain_errors.tolist(),
        "exponent": forecast.exponent._asdict(),
        "error": forecast.error()._asdict(),
        "rays_factor_to_halve_error": forecast.factor(0.5)._asdict() if forecast.measurable else None,
    }
