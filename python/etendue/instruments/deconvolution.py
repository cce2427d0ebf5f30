"""`deconvolve`: a scan without the instrument that took it; chapter 5 of the thesis, and better ways."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.formats.output import atomic_output
from etendue.instruments.courses import after, checked_replicates, course_of, rule_of
from etendue.instruments.goniometer_scan import GoniometerScan, full_width, summit, total_scatter
from etendue.instruments.operators import DARK, Operator, OperatorName, folded, middle_of, operator_of, sparse_if_large
from etendue.instruments.penalised_lobe import PenalisedLobe, penalised_lobe
from etendue.instruments.shared_rays import together
from etendue.quantities.arguments import require, require_known, require_number
from etendue.quantities.ray_stream import checked_seed

Array = npt.NDArray[np.float64]
Method = Literal["penalised", "richardson-lucy", "matrix"]

REPLICATES = 32
"""Scans that error bands are made of."""

FURTHEST_MIDDLE = 180.0
"""Angle [°] up to which the middle of a lobe may be stated: that of half a scan may lie beside it."""

FURTHER = 4
"""Times the iterations after which a lobe stands for the truth when errors are estimated."""

FWHM = float(np.sqrt(8.0 * np.log(2.0)))
"""Full widths at half maximum of a Gaussian in its widths."""

ROUND = 0.01
"""By how much a peak may be off without a word, if the lobe is round in direction cosines and not in the angle."""

UNLIKELY = 5.0
"""Standard deviations of the deviance from which on what is left of the scan is not its noise."""


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
        How many; 0 if nothing was iterated.
    stop : str
        The rule, and why it stopped there; or the method, and how it came to its smoothness.
    total_scatter : (float, float)
        Before and after, by eq. 5.2: the same to 1e-6.
    error_function : array
        E(i) of eq. 5.7, from iteration 1 on; empty if nothing was iterated.
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
            f"Deconvolution(peak={self.peak:.4g}, fwhm={self.fwhm:.4g}°, iterations={self.iterations}, stop={rule!r})"
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
    method: Method | None = None,
    stop: str | int | None = None,
    middle: float | None = None,
    replicates: int = REPLICATES,
    seed: int = 1,
) -> Deconvolution:
    """Take the instrument out of a scan: eqs. 5.1, 5.2 and 5.7 of the thesis.

    All work on fluxes; the BSDF follows from eq. 5.1 and is scaled so that the total scatter stays what it is.

    Parameters
    ----------
    scan : GoniometerScan
        Of the sample.
    signature : GoniometerScan
        Of the bare beam by the same instrument; its step need not be that of the scan.
    operator : {"rings", "slice"}
        Of a lobe that is round: its exact image by a round beam and a round aperture on the sphere. Or the slice convolved
        with a slice, as the thesis does it; for lobes that are not symmetrical.
    method : {"penalised", "richardson-lucy", "matrix"}, optional
        A lobe whose logarithm is as smooth as the counts ask for, with error bands of its own [Eilers1996]_; the iteration
        of the thesis; or the inverse of the matrix [Ferrero2011]_, which makes negative values of noise. If left out: the
        first for rings if the noise of the scan is known and no stop is stated, else the second.
    stop : {"held-out", "discrepancy", "plateau", "thesis"} or int, optional
        Of the iteration: the rule, or a number of iterations. If left out: "held-out", or "thesis" if the noise of the scan
        is not known.
    middle : number, optional
        Of the lobe [°]; found by its symmetry if left out.
    replicates : int
        Scans drawn about what was found, which the standard error of an iteration is made of; 0: no standard errors.
    seed : int
        Of them, and of the counts that are kept back.

    Returns
    -------
    Deconvolution

    Raises
    ------
    ArgumentError
        If the scan has less than five positions or no light, the signature is wider than it, a rule or the method needs
        standard errors that it does not have, a stop is stated and nothing is iterated, or there is no such seed.
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
    if method is not None:
        require_known(method, get_args(Method), "method")
    require_known(operator, get_args(OperatorName), "operator")
    replicates = checked_replicates(replicates)
    if stop is not None and method not in {None, "richardson-lucy"}:
        raise ArgumentError(f"a stop is for method='richardson-lucy'; {method!r} does not iterate")
    for name, given in (("scan", scan), ("signature", signature)):
        require(
            given, GoniometerScan, f"deconvolve: {name}", "a GoniometerScan: of a file et.read_goniometer_scan(path)"
        )
    if middle is not None:
        require_number(middle, "deconvolve: middle", "an angle in °, or None")
        if not abs(middle) <= FURTHEST_MIDDLE:
            raise ArgumentError(f"deconvolve: middle is {middle:g}; give an angle in ° from −180 to 180, or None.")
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
    if method is None:
        method = "penalised" if operator == "rings" and gain is not None and stop is None else "richardson-lucy"
    task = _Task(model, full, gain, rule_of(stop, counted=gain is not None), replicates, checked_seed(seed))
    found = _WAYS[method](task)
    notes += found.notes
    spread = found.spread
    if spread is not None and gain is not None and middle is None:
        spread = np.hypot(spread, _error_of_middle(model, found.lobe, full, gain))
    image = model.matrix @ found.lobe
    notes += _of_ends(model, image, method)
    values, error, raw, fitted, totals = _as_bsdf(scan, full, model, found.lobe, spread, image)
    if operator == "rings":
        notes += _of_one_plane(scan, signature, values)
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
        found.iterations,
        found.stop,
        totals,
        found.error_function,
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
    if signature.step > 1.001 * scan.step:
        found.append(
            f"the steps are {scan.step:g}° of the scan and {signature.step:g}° of the instrument function: "
            "the latter is a cubic between its positions"
        )
    for low, high in signature.gaps:
        found.append(f"the instrument function has no positions between {low:g}° and {high:g}°: taken for linear")
    return found


def _of_one_plane(scan: GoniometerScan, signature: GoniometerScan, values: Array) -> list[str]:
    """By how much a peak is off if the lobe is as wide in direction cosines on all sides, and not in the angle.

    Seen from the sample such a lobe is 1/cosθ times as wide in the plane of incidence as across it. Of a Gaussian lobe of
    widths σ and σ′ behind a Gaussian blur of width b the scan holds σσ′/√((σ² + b²)(σ′² + b²)) of the peak, of which rings
    undo σ²/(σ² + b²).
    """
    width = full_width(scan.angle, values) / FWHM
    if not scan.sample or not scan.incidence > 0.0 or not width > 0.0:
        return []
    radius, seen = folded(signature)
    blur = float(np.sqrt(0.5 * np.sum(radius**3 * seen) / np.sum(radius * seen)))
    cosine = float(np.cos(np.radians(scan.incidence)))
    across = width * (cosine if scan.plane == "in-plane" else 1.0 / cosine)
    part = np.hypot(width, blur) / width * across / np.hypot(across, blur)
    if abs(part - 1.0) < ROUND:
        return []
    said = f"at {scan.incidence:g}° of incidence the rings take the lobe for round in the angle"
    surfaces = "round in direction cosines, as polished and rough surfaces have it"
    return [f"{said}; of one that is {surfaces}, the peak found is about {part:.2f} of the true one"]


def _ends(image: Array) -> tuple[float, float]:
    """Fitted flux at the first and the last position over the largest."""
    largest = max(float(image.max()), np.finfo(np.float64).tiny)
    return float(image[0]) / largest, float(image[-1]) / largest


def _of_ends(model: Operator, image: Array, method: Method) -> list[str]:
    """What is to be said of a scan that ends on the lobe."""
    ends = [
        f"at {share:.2g} of its largest flux, {abs(float(at)):.3g}° from the middle"
        for share, at in zip(_ends(image), (model.angle[0], model.angle[-1]), strict=True)
        if share > DARK
    ]
    if not ends:
        return []
    beyond = f"the scan ends on the lobe, {' and '.join(ends)}: the total scatter is what lies between its ends, and"
    within = f"values within {model.reach:.3g}° of an end"
    if model.name == "slice":
        return [f"{beyond} {within} are too high or too low, as the slice takes all beyond for dark"]
    if method == "penalised":
        return [f"{beyond} {within} rest on a lobe that goes on as smoothly as it came"]
    return [f"{beyond} {within} rest on light beyond that nothing measured, and are off by more than they state"]


def _without_gaps(scan: GoniometerScan) -> GoniometerScan:
    """With positions in even steps, linear between those there are: a convolution needs them."""
    count = round(float(np.ptp(scan.angle)) / scan.step)
    even = np.linspace(scan.angle[0], scan.angle[-1], count + 1)
    error = None if scan.standard_error is None else np.interp(even, scan.angle, scan.standard_error)
    return dataclasses.replace(scan, angle=even, flux=np.interp(even, scan.angle, scan.flux), standard_error=error)


def _gain(scan: GoniometerScan) -> float | None:
    """The flux that one count stands for: the variance of a count is itself.

    Where positions count the same rays, what is smooth over the aperture sees fewer counts (`together`).
    """
    if scan.standard_error is None or not (scan.standard_error > 0.0).any():
        return None
    total = float(np.sum(np.maximum(scan.flux + scan.background, 0.0)))
    return float(np.sum(scan.standard_error**2 * together(scan))) / total if total > 0.0 else None


def _after(model: Operator, measured: Array, background: float, count: int) -> Array:
    return after(sparse_if_large(model.matrix), measured, model.start(measured - background), count, background)


def _misfit(lobe: PenalisedLobe) -> tuple[str, ...]:
    if (lobe.deviance - 1.0) / np.sqrt(2.0 / lobe.left) < UNLIKELY:
        return ()
    why = "the lobe is not round about its middle, or the instrument function is another one or has too wide steps"
    return (
        f"what is left of the scan is {lobe.deviance:.3g} times its noise: {why}; the standard errors are too small",
    )


def _error_of_middle(model: Operator, found: Array, scan: GoniometerScan, gain: float) -> Array:
    """What the values owe to the middle: where both sides differ least in the mean square, with the noise of each.

    Of a scan that ends on the lobe the last pair is not looked at, and one side may tell most: what it says of the other is
    off by twice as much as the middle.
    """
    image = model.matrix @ found + scan.background
    cut = max(_ends(image)) > DARK
    # Only positions with a counterpart on the other side tell of it.
    paired = np.abs(model.angle) <= min(-model.angle[0], model.angle[-1]) - (scan.step if cut else 0.0)
    squares = np.where(paired, np.gradient(image, model.angle) ** 2, 0.0)
    known = float(squares.sum())
    shift = np.sqrt(gain * float(squares @ np.maximum(image, 0.0))) / known if known > 0.0 else 0.0
    return np.asarray(np.abs(np.gradient(model.at_positions(found), model.angle)) * shift * (2.0 if cut else 1.0))


class _Task(NamedTuple):
    """What each way starts from."""

    model: Operator
    scan: GoniometerScan
    gain: float | None
    rule: str
    replicates: int
    seed: int

    @property
    def measured(self) -> Array:
        """With the background in it."""
        return np.asarray(self.scan.flux + self.scan.background)


class _Found(NamedTuple):
    """Values at the nodes, their standard errors at the positions, and how they were found."""

    lobe: Array
    spread: Array | None
    stop: str
    iterations: int = 0
    error_function: Array = np.zeros(0)
    notes: tuple[str, ...] = ()


def _penalised(task: _Task) -> _Found:
    if task.gain is None:
        raise ArgumentError("method='penalised' needs the standard errors of the scan; 'richardson-lucy' does not")
    lobe = penalised_lobe(task.model, task.measured, task.scan.background, task.gain)
    stop = f"penalised: {lobe.freedom:.3g} degrees of freedom, the smoothness of ln f by marginal likelihood"
    return _Found(lobe.values, np.sqrt(lobe.variance) if task.replicates else None, stop, notes=_misfit(lobe))


def _by_matrix(task: _Task) -> _Found:
    lobe = _inverted(task.model, np.asarray(task.scan.flux))
    return _Found(lobe, _spread(task, lobe, 0), "matrix: matrix inversion needs no stop")


def _iterated(task: _Task) -> _Found:
    model, background = task.model, task.scan.background
    matrix = sparse_if_large(model.matrix)
    course, count, why = course_of(matrix, task.measured, background, task.gain, model.start, task.rule, task.seed)
    lobe = _after(model, task.measured, background, count)
    spread = None
    if task.replicates and task.gain is not None:
        # The lobe that was found is too wide by what the stop leaves out. One that is less so stands for the truth.
        spread = _spread(task, _after(model, task.measured, background, FURTHER * count), count)
    return _Found(lobe, spread, f"{task.rule}: {why}", count, course.error)


_WAYS: dict[Method, Callable[[_Task], _Found]] = {
    "penalised": _penalised,
    "richardson-lucy": _iterated,
    "matrix": _by_matrix,
}


def _inverted(model: Operator, flux: Array) -> Array:
    return np.asarray(np.linalg.lstsq(model.matrix, flux, rcond=1e-10)[0])


def _spread(task: _Task, truth: Array, count: int) -> Array | None:
    """Standard errors of the values at the positions: spread, and what the stop after `count` iterations costs."""
    model, gain, background = task.model, task.gain, task.scan.background
    if not task.replicates or gain is None:
        return None
    rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((task.seed, 1))))
    expected = np.maximum(model.matrix @ truth + background, 0.0) / gain
    drawn = np.asarray(gain * rng.poisson(expected[:, None], (expected.size, task.replicates)), np.float64)
    if count:
        again = _after(model, drawn, background, count)
    else:
        again = np.stack([_inverted(model, one - background) for one in drawn.T], axis=1)
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
    # What blur takes across an end is not known: of a scan that ends on the lobe the total of the fitted flux is kept.
    kept = total_scatter(turned, back(image) / per) if max(_ends(image)) > DARK else after
    scale = before / kept if kept > 0.0 and before > 0.0 else 1.0
    error = None if spread is None else back(spread) / per * scale / cosine
    return at * scale / cosine, error, scan.flux / per / cosine, back(image), (before, after * scale)
