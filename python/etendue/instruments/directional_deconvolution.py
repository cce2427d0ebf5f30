"""`deconvolve_directions`: a scan in two dimensions without the instrument that took it, at any incidence."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, EtendueError
from etendue.extras import scipy_part
from etendue.formats.output import atomic_output
from etendue.formats.scans_csv import ERROR
from etendue.instruments.bench import Bench
from etendue.instruments.counted_scan import CountedScan, Shrink
from etendue.instruments.courses import checked_replicates, rule_of
from etendue.instruments.directional_bands import error_of
from etendue.instruments.directional_operator import ForwardModel, Instrument, forward_model
from etendue.instruments.directional_scan import DirectionalScan, angles_of
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.instruments.lobe_splines import SplineLobe
from etendue.instruments.lobe_table import polar_slice
from etendue.instruments.parametric_lobe import ModelLobe, parametric_lobe
from etendue.instruments.regular_share import RegularShare, regular_share
from etendue.instruments.round_blur import RoundBlur
from etendue.instruments.scatter_goniometer import ScatterGoniometer
from etendue.instruments.total_variation import STRENGTHS, total_variation
from etendue.quantities.arguments import described, require, require_known, require_number
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.ray_stream import checked_seed
from etendue.scatter.bsdf import unit_vectors
from etendue.scatter.lobe_models import LOBE_MODELS, Fitted

Array = npt.NDArray[np.float64]
DirectionalMethod = Literal["richardson-lucy", "total-variation", "parametric", "matrix"]

REPLICATES = 24
"""Scans that error bands are made of."""

SAME_ANGLE = 1e-3
"""By which the solid angles of a scan and of its instrument may differ, relative to it."""

FEWEST = 9
"""Positions that are needed."""

LARGEST_INVERSE = 4000
"""Positions of a matrix that is inverted: more take minutes."""

WRONG = 4.0
"""Standard deviations by which residuals are more than noise before it is told."""


@dataclasses.dataclass(frozen=True, eq=False)
class DirectionalDeconvolution:
    """What `deconvolve_directions` found.

    Parameters
    ----------
    scan : DirectionalScan
        As it was measured.
    values : array, shape (n,)
        F [1/sr] at its positions, without the instrument.
    standard_error : array, shape (n,), optional
        Of the values; None if the noise of the scan is not known.
    fitted : array, shape (n,)
        The flux that the values would give.
    residuals : array, shape (n,)
        Measured flux less this one, over its standard error if that is known.
    regular : RegularShare
        What of the light is mirrored in a single direction, or goes straight on; it is not in the values.
    method : str
        The way.
    iterations : int
        How many; 0 where there are none.
    stop : str
        The rule, and why it stopped there; or which model was chosen, and why.
    cell : number
        Width of the finest splines [°].
    lobe : callable
        F [1/sr] at directions of shape (k, 3).
    model : Fitted, optional
        The finish, if one was fitted.
    notes : tuple of str
        What is worth knowing.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer(photons=1e6)
    >>> sample = et.bsdf.Gaussian(peak=200.0, sigma=0.012, aspect=2.0)
    >>> scan = goniometer.measure_window(sample, 60, step=0.75, span=6, turn=30, method="quadrature")
    >>> found = et.deconvolve_directions(scan)
    >>> bool(scan.bsdf.max() < 180 and 190 < found.peak < 210)
    True
    """

    scan: DirectionalScan
    values: Array
    standard_error: Array | None
    fitted: Array
    residuals: Array
    regular: RegularShare
    method: str
    iterations: int
    stop: str
    cell: float
    lobe: Callable[[Array], Array]
    model: Fitted | None = None
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Peak, and how it was found."""
        what = f"peak={self.peak:.4g}, regular={self.regular.share:.4g}"
        return f"DirectionalDeconvolution({what}, method={self.method!r}, iterations={self.iterations})"

    @property
    def peak(self) -> float:
        """Largest value at a position."""
        return float(self.values.max())

    @property
    def regular_share(self) -> float:
        """What of the light is mirrored in a single direction, or goes straight on."""
        return self.regular.share

    @property
    def total_flux(self) -> tuple[float, float]:
        """Of all positions together, as measured and as the values would give: the same to 1e-9 without a model."""
        return float(self.scan.flux.sum()), float(self.fitted.sum())

    def evaluate(self, directions: npt.ArrayLike) -> Array:
        """F [1/sr] at directions of shape (…, 3) on the side of the scan; NaN where it says nothing."""
        d = unit_vectors("directions", directions)
        return np.asarray(self.lobe(d.reshape(-1, 3)).reshape(d.shape[:-1]))

    def slice(self) -> BsdfSlice:
        """As a slice of a table, on a polar grid about the regular direction; errors are those of the nearest position."""
        nearest = scipy_part("spatial").cKDTree(self.scan.direction)

        def f(to: Array) -> tuple[Array, Array | None]:
            error = None if self.standard_error is None else self.standard_error[nearest.query(to)[1]]
            return self.lobe(to), error

        return polar_slice(f, self.scan.incident, behind=self.scan.behind, **self.scan.extent(self.cell))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV file: directions, f, its standard error, f as it was measured, and the residual.

        It can be read again as a scan of f.

        Raises
        ------
        OSError
            If it cannot be written; it appears whole or not at all.
        """
        theta, phi = angles_of(self.scan.direction)
        names = ["theta_i", "phi_i", "theta_s", "phi_s", "bsdf"]
        columns = [np.full(theta.shape, self.scan.incidence), np.full(theta.shape, 180.0), theta, phi, self.values]
        if self.standard_error is not None:
            names, columns = [*names, ERROR], [*columns, self.standard_error]
        rows = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
        head = [
            f"# method = {self.method}",
            f"# iterations = {self.iterations}",
            f"# stop = {self.stop}",
            f"# regular_share = {self.regular.share!r}",
            f"# regular_share_error = {self.regular.error!r}",
        ]
        with atomic_output(path) as temporary:
            temporary.write_text("\n".join([*head, ",".join(names), *rows]) + "\n", encoding="utf-8")


def deconvolve_directions(
    scan: DirectionalScan,
    instrument: ScatterGoniometer | Bench | GoniometerScan | None = None,
    *,
    method: DirectionalMethod = "richardson-lucy",
    stop: str | int | None = None,
    regular: bool | float = True,
    models: Sequence[str] = tuple(LOBE_MODELS),
    cell: float | None = None,
    replicates: int = REPLICATES,
    seed: int = 1,
) -> DirectionalDeconvolution:
    """Take the instrument out of a scan in two dimensions: section 6.2 of the thesis.

    f is a sum of B-splines in direction cosines, finer than the aperture where positions are dense. What an aperture sees of
    each is integrated over beam and aperture, at any incidence; light that is mirrored in a single direction is told apart
    first; then a lobe is sought from which the counts would have come.

    Parameters
    ----------
    scan : DirectionalScan
        Of the sample; positions that the bench shadows are left out.
    instrument : ScatterGoniometer, Bench or GoniometerScan, optional
        That took it; a scan of its bare beam if its geometry is not known; the scan's own bench if left out.
    method : {"richardson-lucy", "total-variation", "parametric", "matrix"}
        The iteration; the same with a prior of small total variation whose strength held-out counts choose [Dey2006]_; a
        model of the scatter package fitted through the instrument; or the inverse of the matrix [Ferrero2011]_, which makes
        negative values of noise.
    stop : {"held-out", "discrepancy", "plateau", "thesis"} or int, optional
        The rule, or a number of iterations. If left out: "held-out", or "thesis" if the noise of the scan is not known.
    regular : bool or number
        Whether light that is mirrored in a single direction (or goes straight on) is looked for; or its share, if known.
    models : sequence of str
        Of `method="parametric"`: those to choose from, "gaussian", "abg" and "harvey-shack".
    cell : number, optional
        Width of the finest splines [°]; from the step of the scan and the instrument function if left out.
    replicates : int
        Scans drawn about what was found, which the standard error is made of; 0: none.
    seed : int
        Of them, and of the counts that are kept back.

    Returns
    -------
    DirectionalDeconvolution

    Raises
    ------
    ArgumentError
        If the instrument is not known, the scan has less than nine positions or no light, the instrument function is wider
        than it, a way needs standard errors that it does not have, or there is no such seed.
    UnknownNameError
        If there is no such method, rule or model.
    MissingLibraryError
        If SciPy is not installed.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer(photons=1e6)
    >>> sample = et.bsdf.ABg(a=0.003, b=1e-4, g=2.2)
    >>> scan = goniometer.measure_window(sample, 45, step=1, span=6, method="quadrature")
    >>> found = et.deconvolve_directions(scan, goniometer, method="parametric")
    >>> bool(27 < found.peak < 33)                                             # a/b = 30
    True
    """
    require_known(method, get_args(DirectionalMethod), "method")
    replicates = checked_replicates(replicates)
    wanted = f"a list of {', '.join(LOBE_MODELS)}"
    if isinstance(models, str):
        raise ArgumentError(f"deconvolve_directions: models is {described(models)}; give {wanted}.")
    require(models, Iterable, "deconvolve_directions: models", wanted)
    seed = checked_seed(seed)
    require(scan, DirectionalScan, "deconvolve_directions: scan", "a DirectionalScan: et.read_directional_scan(path)")
    if instrument is not None:
        wanted = "a ScatterGoniometer, or a scan of the bare beam: of a file et.read_goniometer_scan(path)"
        kinds = (ScatterGoniometer, Bench, GoniometerScan)
        require(instrument, kinds, "deconvolve_directions: instrument", wanted)
    require_number(regular, "deconvolve_directions: regular", "True, False, or a share from 0 to 1")
    of = _instrument(scan, instrument)
    notes = [*scan.notes, *_doubts(scan, of)]
    model = forward_model(of, scan, cell)
    counted = CountedScan.of(scan, model)
    rule = rule_of(stop, counted=counted.counted)
    if isinstance(regular, bool):
        share = regular_share(counted, seed) if regular else RegularShare(0.0, 0.0, "not looked for")
    elif 0.0 <= regular <= 1.0:
        share = RegularShare(float(regular), 0.0, "stated")
    else:
        raise ArgumentError(f"a regular share of {regular:g}; give 0 to 1")
    counted = counted.with_regular(share.share)
    fitted = _WAYS[method](_Task(scan, of, counted, share, rule, tuple(models), replicates, seed))
    share = fitted.share or share
    if share.share > 0.0:
        notes.append(f"{share.share:.4g} of the light goes on in a single direction, and is not in f: {share.why}")
    flux = fitted.expected * counted.per_count - scan.background
    residuals = scan.flux - flux
    if scan.standard_error is not None and counted.counted:
        lit = scan.standard_error > 0.0
        residuals = np.divide(residuals, scan.standard_error, out=np.zeros_like(residuals), where=lit)
    if (fitted.values < 0.0).any():
        notes.append(f"{int((fitted.values < 0.0).sum())} values are below 0, down to {fitted.values.min():.3g}")
    return DirectionalDeconvolution(
        scan,
        fitted.values,
        fitted.error,
        flux,
        residuals,
        share,
        method,
        fitted.iterations,
        fitted.stop,
        model.cell,
        fitted.lobe,
        fitted.model,
        (*notes, *fitted.notes),
    )


def _instrument(scan: DirectionalScan, given: ScatterGoniometer | Bench | GoniometerScan | None) -> Instrument:
    if isinstance(given, ScatterGoniometer):
        return given.bench
    if isinstance(given, GoniometerScan):
        return RoundBlur.of(given, scan.solid_angle)
    known = given or scan.bench
    if known is None:
        raise ArgumentError(
            "the instrument is not known: state beam, aperture and distance as a ScatterGoniometer, or give a scan of its "
            "bare beam"
        )
    return known


def _doubts(scan: DirectionalScan, instrument: Instrument) -> list[str]:
    if scan.flux.size < FEWEST:
        raise ArgumentError(f"a scan of {scan.flux.size} positions; {FEWEST} are needed at least")
    if not (scan.flux > 0.0).any():
        raise ArgumentError("the scan holds no light")
    for name, spread in zip(("along", "across"), scan.spread, strict=True):
        if spread < 2.0 * instrument.reach:
            raise ArgumentError(
                f"the instrument function is {2.0 * instrument.reach:.3g}° wide, the scan {spread:.3g}° {name} the plane of "
                "incidence: scan to larger angles"
            )
    found = []
    if isinstance(instrument, RoundBlur):
        found.append("of the instrument its instrument function alone is known: exact about the regular direction only")
    stated, known = scan.solid_angle, instrument.solid_angle
    if stated is not None and abs(stated - known) > SAME_ANGLE * known:
        found.append(
            f"the scan states a solid angle of {stated:.4g} sr, its instrument has {known:.4g} sr: f is by the latter, the "
            f"scan's own values are {known / stated:.3g} times as large"
        )
    below = scan.flux + scan.background < 0.0
    if below.any():
        found.append(
            f"{int(below.sum())} fluxes are below 0 by {-scan.flux[below].sum() / np.abs(scan.flux).sum():.2%} of all flux: "
            "the iteration takes them for 0; state the background to keep them"
        )
    step = float(np.quantile(scan.spacing, 0.1))
    sparse = int((scan.spacing > 2.0 * instrument.reach).sum())
    if sparse:
        found.append(
            f"{sparse} positions are farther from others than the aperture sees: f there is as it was measured"
        )
    if step > instrument.reach:
        found.append(
            f"steps of {step:.3g}° are wider than half of the instrument function: a lobe between them is missed"
        )
    gaps = scan.gaps
    if gaps:
        found.append(f"{gaps} positions are missing in the window: f there rests on what is around them")
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class _Task:
    scan: DirectionalScan
    instrument: Instrument
    counted: CountedScan
    share: RegularShare
    rule: str
    models: tuple[str, ...]
    replicates: int
    seed: int


@dataclasses.dataclass(frozen=True, eq=False)
class _Found:
    values: Array
    error: Array | None
    expected: Array
    iterations: int
    stop: str
    lobe: Callable[[Array], Array]
    model: Fitted | None = None
    notes: tuple[str, ...] = ()
    share: RegularShare | None = None


def _richardson_lucy(task: _Task, shrink: Shrink = None, told: str = "") -> _Found:
    counted = task.counted
    _, count, why = counted.course(task.rule, task.seed, shrink)
    weights = counted.after(count, shrink)
    if shrink is not None:
        # Without a prior each step keeps the sum of all counts.
        lobe = counted.matrix @ weights
        weights *= (counted.counts - counted.background).sum() / lobe.sum()
    error = None
    if task.replicates and counted.counted:
        reach = task.instrument.reach
        error = error_of(counted, task.scan.direction, reach, count, shrink, task.replicates, task.seed)
        if task.share.error > 0.0:
            less = counted.with_regular(-task.share.error).after(count, shrink)
            error = np.hypot(error, counted.model.at_positions @ (less - counted.after(count, shrink)))
    return _of_weights(counted.model, weights, error, counted.expected(weights), count, f"{task.rule}: {why}{told}")


def _total_variation(task: _Task) -> _Found:
    splines = task.counted.model.splines
    if not task.counted.counted:
        raise ArgumentError("the strength of total variation is chosen by held-out counts: state standard errors")
    scored = []
    for strength in STRENGTHS:
        shrink = total_variation(splines, strength)
        course, _, _ = task.counted.course("held-out", task.seed, shrink)
        assert course.held_out is not None  # noqa: S101 - there are counts
        scored.append((float(course.held_out.sum(axis=1).min()), strength, shrink))
    _, strength, shrink = min(scored, key=lambda one: one[:2])
    return _richardson_lucy(task, shrink, f"; strength {strength:g}, with which held-out counts are predicted best")


def _parametric(task: _Task) -> _Found:
    free = task.share.error > 0.0
    fit = parametric_lobe(task.instrument, task.scan, task.counted, task.models, task.seed, regular=free)
    share = (
        RegularShare(fit.regular, fit.regular_error, f"fitted with the lobe; {task.share.why}") if free else task.share
    )
    origin = task.scan.regular[:2]
    off = task.scan.direction[:, :2] - origin
    notes = []
    n = task.scan.flux.size
    wrong = (fit.deviance - 1.0) / np.sqrt(2.0 / n)
    if wrong > WRONG:
        notes.append(
            f"the residuals of the {fit.model.name} are more than noise by {wrong:.0f} standard deviations: the sample is "
            "none, and its errors are larger than told"
        )
    made = None
    try:
        made = fit.model.bsdf(fit.parameters, behind=task.scan.behind, regular=share.share)
    except EtendueError as error:
        notes.append(f"the model is no finish: {error}")
    told = ", ".join(f"{name} {score:.4g}" for name, score in fit.scores.items())
    return _Found(
        fit.f(off),
        fit.error(off),
        fit.expected,
        0,
        f"{fit.model.name}: mean deviance of held-out counts: {told}",
        ModelLobe(fit.model, fit.parameters, origin),
        made,
        tuple(notes),
        share,
    )


def _matrix(task: _Task) -> _Found:
    counted = task.counted
    n = counted.counts.size
    if n > LARGEST_INVERSE:
        raise ArgumentError(f"{n} positions; a matrix is inverted up to {LARGEST_INVERSE}")
    # Each row in units of the noise of its count would weigh; the method has none.
    flux = (counted.counts - counted.background) * counted.per_count
    inverse = np.linalg.pinv(counted.model.matrix.toarray(), rcond=1e-10)
    weights = inverse @ flux
    error = None
    if counted.counted and task.scan.standard_error is not None:
        passed = counted.model.at_positions @ inverse
        error = np.sqrt((passed**2) @ task.scan.standard_error**2)
    expected = counted.expected(weights)
    return _of_weights(counted.model, weights, error, expected, 0, "matrix inversion needs no stop")


def _of_weights(
    model: ForwardModel, weights: Array, error: Array | None, expected: Array, count: int, stop: str
) -> _Found:
    values = np.asarray(model.at_positions @ weights)
    return _Found(values, error, expected, count, stop, SplineLobe(model.splines, weights))


_WAYS: dict[str, Callable[[_Task], _Found]] = {
    "richardson-lucy": _richardson_lucy,
    "total-variation": _total_variation,
    "parametric": _parametric,
    "matrix": _matrix,
}
