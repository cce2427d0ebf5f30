"""`deconvolve`: a scan without the instrument that took it; chapter 5 of the thesis, and better ways."""

from __future__ import annotations

import dataclasses
import os
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.extras import require
from etendue.formats.output import atomic_output
from etendue.instruments.courses import after, course_of, rule_of
from etendue.instruments.goniometer_scan import GoniometerScan, full_width, summit, total_scatter
from etendue.instruments.operators import Operator, OperatorName, middle_of, operator_of

Array = npt.NDArray[np.float64]
Method = Literal["richardson-lucy", "matrix"]

REPLICATES = 32
"""Scans that error bands are made of."""

FURTHER = 4
"""Times the iterations after which a lobe stands for the truth when errors are estimated."""

LARGE = 200
"""Positions from which on the matrix, most of which is 0, is kept as a sparse one if SciPy is there."""


@dataclasses.dataclass(frozen=True, eq=False)
class Deconvolution:
    """What `deconvolve` found.

    Parameters
    ----------
    angle : array, shape (n,)
        Positions of the scan [°].
    values : array, shape (n,)
        F cosθ over the solid angle, as a BSDF [1/sr] if the scan knows its solid angle, else in units of its flux.
    standard_error : array, shape (n,), optional
        Of the values: spread and bias of scans drawn about what was found; None if the noise of the scan is not known.
    raw : array, shape (n,)
        The same of the scan as it was measured.
    residuals : array, shape (n,)
        Measured flux less that which the values would give, over its standard error if that is known.
    fitted : array, shape (n,)
        The flux that the values would give.
    middle : float
        Of the lobe [°].
    iterations : int
        How many; 0 for matrix inversion.
    stop : str
        The rule, and why it stopped there.
    total_scatter : (float, float)
        Before and after, by eq. 5.2: the same to 1e-6.
    error_function : array
        E(i) of eq. 5.7, from iteration 1 on.
    operator : {"rings", "slice"}
        How the instrument was described.
    notes : tuple of str
        What is worth knowing.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer(photons=1e7)
    >>> sample = et.bsdf.CosinePower(peak=2897, exponent=18204, way="transmitted")
    >>> scan = goniometer.measure(sample, step=0.2, span=3, method="quadrature")
    >>> found = et.deconvolve(scan, goniometer.instrument_function(), replicates=8)
    >>> bool(scan.bsdf.max() < 1300 and found.peak > 2500)
    True
    """

    angle: Array
    values: Array
    standard_error: Array | None
    raw: Array
    residuals: Array
    fitted: Array
    middle: float
    iterations: int
    stop: str
    total_scatter: tuple[float, float]
    error_function: Array
    operator: str
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Peak, width and stop."""
        rule = self.stop.partition(":")[0]
        return (
            f"Deconvolution(peak={self.peak:.5g}, fwhm={self.fwhm:.4g}°, iterations={self.iterations}, stop={rule!r})"
        )

    @property
    def peak(self) -> float:
        """Largest value, between positions too."""
        return summit(self.angle, self.values)

    @property
    def fwhm(self) -> float:
        """Full width at half maximum [°]."""
        return full_width(self.angle, self.values)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV file: angle, value, its standard error, the measured value and the residual.

        Raises
        ------
        OSError
            If it cannot be written; it appears whole or not at all.
        """
        names = ["angle", "bsdf", *(["standard_error"] if self.standard_error is not None else []), "raw", "residual"]
        error = [self.standard_error] if self.standard_error is not None else []
        columns = [self.angle, self.values, *error, self.raw, self.residuals]
        rows = [",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True)]
        before, after = self.total_scatter
        head = [
            f"# operator = {self.operator}",
            f"# iterations = {self.iterations}",
            f"# stop = {self.stop}",
            f"# total_scatter_before = {before!r}",
            f"# total_scatter_after = {after!r}",
        ]
        with atomic_output(path) as temporary:
            temporary.write_text("\n".join([*head, ",".join(names), *rows]) + "\n", encoding="utf-8")


def deconvolve(
    scan: GoniometerScan,
    signature: GoniometerScan,
    *,
    operator: OperatorName = "rings",
    method: Method = "richardson-lucy",
    stop: str | int | None = None,
    middle: float | None = None,
    replicates: int = REPLICATES,
    seed: int = 1,
) -> Deconvolution:
    """Take the instrument out of a scan: eqs. 5.1, 5.2 and 5.7 of the thesis.

    The iteration works on fluxes; the BSDF follows from eq. 5.1 and is scaled so that the total scatter stays what it is.

    Parameters
    ----------
    scan : GoniometerScan
        Of the sample.
    signature : GoniometerScan
        Of the bare beam by the same instrument; its step need not be that of the scan.
    operator : {"rings", "slice"}
        Of a lobe that is round: its exact image by a round beam and a round aperture on the sphere. Or the slice convolved
        with a slice, as the thesis does it; for lobes that are not symmetrical.
    method : {"richardson-lucy", "matrix"}
        Or the inverse of the matrix [Ferrero2011]_, which makes negative values of noise.
    stop : {"held-out", "discrepancy", "plateau", "thesis"} or int, optional
        The rule, or a number of iterations. If left out: "held-out", or "thesis" if the noise of the scan is not known.
    middle : number, optional
        Of the lobe [°]; found by its symmetry if left out.
    replicates : int
        Scans drawn about what was found, which the standard error is made of; 0: none.
    seed : int
        Of them, and of the counts that are kept back.

    Returns
    -------
    Deconvolution

    Raises
    ------
    ArgumentError
        If the scan has less than five positions or no light, the signature is wider than it, or a rule needs standard
        errors that it does not have.
    UnknownNameError
        If there is no such operator, method or rule.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer()
    >>> sample = et.bsdf.CosinePower(peak=598.5, exponent=3761, way="transmitted")
    >>> scan = goniometer.measure(sample, step=0.2, span=5, rays=50_000)
    >>> found = et.deconvolve(scan, goniometer.instrument_function(), replicates=8)
    >>> before, after = found.total_scatter
    >>> bool(abs(after / before - 1) < 1e-6)
    True
    """
    if method not in get_args(Method):
        raise UnknownNameError("method", method, get_args(Method))
    notes = list(scan.notes)
    if scan.angle.size < 5:
        raise ArgumentError(f"a scan of {scan.angle.size} positions; five are needed at least")
    if not (scan.flux > 0.0).any():
        raise ArgumentError("the scan holds no light")
    notes += _doubts(scan, signature)
    full = _without_gaps(scan) if operator == "slice" and scan.gaps else scan
    at = middle_of(full.angle, np.maximum(full.flux, 0.0)) if middle is None else float(middle)
    model = operator_of(full, signature, operator, at)
    gain = _gain(full)
    rule = rule_of(stop, counted=gain is not None)
    flux = np.asarray(full.flux)
    if method == "matrix":
        found, course, count, why = _inverted(model, flux), None, 0, "matrix inversion needs no stop"
    else:
        measured = flux + full.background
        course, count, why = course_of(_sparse(model), measured, full.background, gain, model.start, rule, seed)
        found = _after(model, measured, full.background, count)
    image = model.matrix @ found
    spread = None
    if replicates and gain is not None:
        # The lobe that was found is too wide by what the stop leaves out. One that is less so stands for the truth.
        truth = found if method == "matrix" else _after(model, flux + full.background, full.background, FURTHER * count)
        spread = _spread(model, truth, full, gain, count, method, replicates, seed)
    values, error, raw, fitted, totals = _as_bsdf(scan, full, model, found, spread, image)
    residuals = np.asarray(scan.flux - fitted)
    if gain is not None and scan.standard_error is not None:
        lit = scan.standard_error > 0.0
        residuals = np.divide(residuals, scan.standard_error, out=np.zeros_like(residuals), where=lit)
    if not totals[1] > 0.0:
        notes.append("the values add up to less than nothing, so that the total scatter could not be kept")
    if (values < 0.0).any():
        notes.append(f"{int((values < 0.0).sum())} values are below 0, down to {values.min():.3g}")
    return Deconvolution(
        scan.angle,
        values,
        error,
        raw,
        residuals,
        fitted,
        at,
        count,
        f"{rule if method == 'richardson-lucy' else method}: {why}",
        totals,
        np.zeros(0) if course is None else course.error,
        operator,
        tuple(notes),
    )


def _doubts(scan: GoniometerScan, signature: GoniometerScan) -> list[str]:
    found = []
    for low, high in scan.gaps:
        found.append(f"no positions between {low:g}° and {high:g}°: the lobe there rests on its other side")
    below = scan.flux + scan.background < 0.0
    if below.any():
        found.append(
            f"{int(below.sum())} fluxes are below 0 by {-scan.flux[below].sum() / np.abs(scan.flux).sum():.2%} of all flux: "
            "the iteration takes them for 0, the total scatter counts them; state the background to keep them"
        )
    if abs(signature.step - scan.step) > 1e-3 * scan.step:
        found.append(
            f"the steps are {scan.step:g}° of the scan and {signature.step:g}° of the instrument function: "
            "the latter is taken for linear between its positions"
        )
    for low, high in signature.gaps:
        found.append(f"the instrument function has no positions between {low:g}° and {high:g}°: taken for linear")
    return found


def _without_gaps(scan: GoniometerScan) -> GoniometerScan:
    """With positions in even steps, linear between those there are: a convolution needs them."""
    count = round(float(np.ptp(scan.angle)) / scan.step)
    even = np.linspace(scan.angle[0], scan.angle[-1], count + 1)
    error = None if scan.standard_error is None else np.interp(even, scan.angle, scan.standard_error)
    return dataclasses.replace(scan, angle=even, flux=np.interp(even, scan.angle, scan.flux), standard_error=error)


def _gain(scan: GoniometerScan) -> float | None:
    """The flux that one count stands for: the variance of a count is itself."""
    if scan.standard_error is None or not (scan.standard_error > 0.0).any():
        return None
    total = float(np.sum(np.maximum(scan.flux + scan.background, 0.0)))
    return float(np.sum(scan.standard_error**2)) / total if total > 0.0 else None


def _after(model: Operator, measured: Array, background: float, count: int) -> Array:
    return after(_sparse(model), measured, model.start(measured - background), count, background)


def _sparse(model: Operator) -> Any:
    if model.angle.size < LARGE:
        return model.matrix
    try:
        return require("scipy.sparse").csr_array(model.matrix)
    except ImportError:
        return model.matrix


def _inverted(model: Operator, flux: Array) -> Array:
    return np.asarray(np.linalg.lstsq(model.matrix, flux, rcond=1e-10)[0])


def _spread(
    model: Operator,
    truth: Array,
    scan: GoniometerScan,
    gain: float,
    count: int,
    method: str,
    replicates: int,
    seed: int,
) -> Array:
    """Standard errors of the values at the positions: spread, and what the stop costs."""
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 1))))
    expected = np.maximum(model.matrix @ truth + scan.background, 0.0) / gain
    drawn = np.asarray(gain * rng.poisson(expected[:, None], (expected.size, replicates)), np.float64)
    if method == "matrix":
        again = np.stack([_inverted(model, one - scan.background) for one in drawn.T], axis=1)
    else:
        again = _after(model, drawn, scan.background, count)
    at, here = model.at_positions(again), model.at_positions(truth)
    return np.asarray(np.sqrt(at.var(axis=1, ddof=1) + (at.mean(axis=1) - here) ** 2))


def _as_bsdf(
    scan: GoniometerScan, full: GoniometerScan, model: Operator, found: Array, spread: Array | None, image: Array
) -> tuple[Array, Array | None, Array, Array, tuple[float, float]]:
    """Values, errors, raw values, fitted flux at the positions of the scan, and the total scatter before and after."""

    def back(values: Array) -> Array:
        return values if full is scan else np.interp(scan.angle, full.angle, values)

    cosine = np.maximum(scan.cosine, 1e-9)
    per = 1.0 if scan.solid_angle is None else scan.solid_angle
    at = back(model.at_positions(found)) / per
    turned = scan.angle - (scan.angle - back(model.angle))
    before = total_scatter(turned, scan.flux / per)
    after = total_scatter(turned, at)
    scale = before / after if after > 0.0 and before > 0.0 else 1.0
    error = None if spread is None else back(spread) / per * scale / cosine
    return at * scale / cosine, error, scan.flux / per / cosine, back(image), (before, after * scale)
