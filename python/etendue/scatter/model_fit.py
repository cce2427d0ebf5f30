"""Models of the BSDF fitted to goniometer scans: weighted least squares over all incidences at once."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, SceneError
from etendue.extras import scipy_part
from etendue.quantities.arguments import SCANS, require, require_known
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.measured import measured
from etendue.scatter.error_law import ErrorLaw, error_law
from etendue.scatter.lobe_models import LARGEST_LOG, LOBE_MODELS, LobeModel
from etendue.scatter.models import MODELS, Finish, Lambertian, Mixture
from etendue.scatter.scans.scans import Scans
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]

FLOOR = "lambertian"
"""A model of its own, and the floor under a lobe."""

FITTED_MODELS: tuple[str, ...] = (FLOOR, *LOBE_MODELS, *(f"{FLOOR}+{name}" for name in LOBE_MODELS))
"""What can be fitted: a Lambertian surface, a lobe, a lobe on a Lambertian floor."""

UNITS = {"a": "/sr", "b0": "/sr", "peak": "/sr"}
"""Of parameters that have one; a of ABg has it since β is a number."""

WIDTHS = (0.02, 0.05, 0.15, 0.4)
"""Widths in |β − β₀| that the search starts at: a start that is off by a factor of 2 finds the same lobe."""

LEAST_PART = 0.25
"""Of a value: residuals are relative to f of the model, but to no less than this part of the value, so that a value far
above the model counts as at most 3 and does not decide the fit alone."""

ROUNDS, SETTLED = 50, 1e-7
"""Of relative residuals, whose weights follow the model: how often at most, and changes of ln f by which it has settled."""

SINGULAR = 1e-6
"""Of the singular values of derivatives, which are exact to about 1e-9: combinations of parameters that change nothing."""

VAGUE = 0.5
"""Relative standard errors above which a parameter is hardly determined."""

STEPS = 1000
"""Of the distance from the specular direction, on either side of where rings leave the unit circle: shares to 1e-5."""

MISFIT = 2.0
"""χ² per degree of freedom above which the errors of parameters mean little."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BsdfFit:
    """A model fitted to scans, with standard errors and how well it fits.

    Parameters
    ----------
    kind : str
        One of `FITTED_MODELS`.
    model : Finish
        The fitted model: a BSDF, and a finish of scenes.
    parameters, standard_errors : dict of str to float
        Of the model, by its own names; ``reflectance`` is that of the Lambertian part.
    covariance : array, shape (p, p)
        Of the parameters, in that order. Those of a lobe hang together: errors alone do not give that of f.
    chi2_per_dof : float
        Sum of the squares of (value − f)/standard error over the degrees of freedom: about 1 if the model fits. NaN if the
        scans have no standard errors.
    rms_residual : float
        Root mean square of (value − f)/f. Where a value is more than 4 f, it is divided by a quarter of the value instead.
    degrees_of_freedom : int
        Values less parameters.
    thetas, shares, share_errors : array, shape (m,)
        Angles of incidence of the scans [°], what the model reflects there, and the standard error of that.
    notes : tuple of str
        What is to be known of the fit, one sentence each.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> to = direction(np.arange(0.0, 80.0, 5.0), 0.0)
    >>> flat = Scans(np.tile(direction(30.0, 180.0), (16, 1)), to, np.full(16, 0.2), standard_error=np.full(16, 0.004))
    >>> found = fit_bsdf(flat, "lambertian")
    >>> measured(found.parameters["reflectance"], found.standard_errors["reflectance"], "").rstrip()
    '0.6283 ± 0.0031'
    """

    kind: str
    model: Finish
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    covariance: Array
    chi2_per_dof: float
    rms_residual: float
    degrees_of_freedom: int
    thetas: Array
    shares: Array
    share_errors: Array
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Model and parameters."""
        return f"BsdfFit({self.kind}: {_listed(self.parameters, self.standard_errors)})"

    @property
    def table(self) -> BsdfTable:
        """The model as files hold it, with parameters and their errors among its facts."""
        facts = {name: _told(name, value, self.standard_errors[name]) for name, value in self.parameters.items()}
        if math.isfinite(self.chi2_per_dof):
            facts["chi2_per_dof"] = f"{self.chi2_per_dof:.4g}"
        facts["rms_residual"] = f"{self.rms_residual:.4g}"
        data = BsdfData(components=(self.model.to_dict(),), name=f"{self.kind} fitted to scans", facts=facts)
        return BsdfTable(data)

    def lines(self) -> list[str]:
        """Parameters with their errors and how well the model fits, as people read them."""
        found = [f"{name}: {_told(name, value, self.standard_errors[name])}" for name, value in self.parameters.items()]
        for theta, share, error in zip(self.thetas, self.shares, self.share_errors, strict=True):
            found.append(f"{theta:.4g}°: the model reflects {measured(share, error, '').rstrip()}")
        freedom = f"{self.degrees_of_freedom} degrees of freedom"
        if math.isfinite(self.chi2_per_dof):
            found.append(f"χ² per degree of freedom: {self.chi2_per_dof:.3g} ({freedom})")
        else:
            found.append(f"no χ²: the scans have no standard errors ({freedom})")
        return [*found, f"root mean square of relative residuals: {self.rms_residual:.1%}"]


def _told(name: str, value: float, error: float) -> str:
    return measured(value, error, UNITS.get(name, "")).rstrip()


def _listed(parameters: Mapping[str, float], errors: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {_told(name, value, errors[name])}" for name, value in parameters.items())


@dataclasses.dataclass(frozen=True)
class _Form:
    """A model over the distance |β − β₀|: its numbers are ln peak, ln width and what else the lobe has, and the floor."""

    lobe: LobeModel | None
    floor: bool

    def f(self, x: Array, distance: Array) -> Array:
        """F [1/sr]."""
        found = np.zeros(distance.shape)
        if self.lobe is not None:
            end = 2 + len(self.lobe.extra)
            peak, width = np.exp(np.clip(x[:2], -LARGEST_LOG, LARGEST_LOG))
            with np.errstate(over="ignore", under="ignore"):  # on the way; far out a lobe is 0
                found = peak * self.lobe.shape(distance / width, x[2:end])
        return found + x[-1] / math.pi if self.floor else found

    def keys(self, x: Array) -> dict[str, float]:
        """The parameters by the names of the finishes."""
        found: dict[str, float] = {}
        if self.lobe is not None:
            found |= self.lobe.keys(math.exp(x[0]), math.exp(x[1]), x[2 : 2 + len(self.lobe.extra)])
        return found | {"reflectance": float(x[-1])} if self.floor else found

    def finish(self, x: Array) -> Finish:
        """The model as a finish."""
        keys = self.keys(x)
        parts: list[Any] = [Lambertian(reflectance=keys.pop("reflectance"))] if self.floor else []
        if self.lobe is not None:
            parts.append(MODELS[self.lobe.name](**keys))
        return parts[0] if len(parts) == 1 else Mixture(parts=tuple(parts))

    def shares(self, x: Array, thetas: Array) -> Array:
        """What it reflects at angles of incidence [°]: ∫ f dβ over the part of each ring about β₀ within the unit circle."""
        found = np.full(thetas.shape, float(x[-1]) if self.floor else 0.0)
        if self.lobe is None:
            return found
        lobe, width = dataclasses.replace(self, floor=False), math.exp(x[1])
        for k, sine in enumerate(np.sin(np.radians(thetas)).tolist()):
            for low, high in ((0.0, 1.0 - sine), (1.0 - sine, 1.0 + sine)):
                # Steps that are even close to the specular direction, and logarithmic far out.
                edges = width * np.sinh(np.linspace(np.arcsinh(low / width), np.arcsinh(high / width), STEPS + 1))
                r = 0.5 * (edges[1:] + edges[:-1])
                # |β₀|² + r² + 2 |β₀| r cos φ is below 1.
                cosine = (1.0 - sine**2 - r * r) / np.maximum(2.0 * sine * r, 1e-300)
                within = 2.0 * (np.pi - np.arccos(np.clip(cosine, -1.0, 1.0)))
                found[k] += float(np.sum(lobe.f(x, r) * within * r * np.diff(edges)))
        return found

    def starts(self, distance: Array, values: Array) -> list[Array]:
        """Where the search begins."""
        low = float(np.quantile(values, 0.05))
        if self.lobe is None:
            return [np.array([math.pi * float(values.mean())])]
        top = float(values[distance <= np.quantile(distance, 0.05)].mean())
        top = top if top > 0.0 else float(values.max())
        floor = [math.pi * low] if self.floor else []
        return [np.array([math.log(top), math.log(width), *self.lobe.extra, *floor]) for width in WIDTHS]


def fit_bsdf(scans: Scans, model: str) -> BsdfFit:
    """Fit a model to all incidences of scans of reflected light at once.

    Lobes are round in direction cosines and the same at all incidences, f being a function of |β − β₀|. The squares of
    (value − f)/standard error are made least. Errors that rise with the values by a law, as those of counts do, are taken at
    f and not at the value, as weights made of counts prefer those that are low by chance.

    Without standard errors residuals are relative to f, and the errors of the parameters come from the scatter of the values
    about the model. Either way values count as independent of each other.

    Parameters
    ----------
    scans : Scans
        At least one value more than the model has parameters.
    model : {"lambertian", "gaussian", "abg", "harvey-shack", "lambertian+gaussian", "lambertian+abg", …}
        One of `FITTED_MODELS`. A floor that comes out below 0 is left out, with a note.

    Returns
    -------
    BsdfFit

    Raises
    ------
    UnknownNameError
        If there is no such model.
    ArgumentError
        If there are too few values, all are 0, a standard error is 0, a value is below 0 and no errors are known, the scans
        do not determine the parameters, the fitted model reflects more light than arrives, or a reflectance is stated, which
        is for tables.
    MissingLibraryError
        If SciPy is not installed.

    Examples
    --------
    >>> from etendue.quantities.bsdf_directions import direction
    >>> from etendue.scatter.models import ABg
    >>> incident = np.tile(direction(20.0, 180.0), (36, 1))
    >>> to = direction(np.arange(-88.0, 88.0, 4.9), 0.0)
    >>> scans = Scans(incident, to, ABg(a=0.02, b=0.01, g=1.8).evaluate(incident, to))
    >>> {name: round(value, 4) for name, value in fit_bsdf(scans, "abg").parameters.items()}
    {'a': 0.02, 'b': 0.01, 'g': 1.8}
    """
    require_known(model, FITTED_MODELS, "model to fit")
    require(scans, Scans, "fit_bsdf: scans", SCANS)
    if (scans.scattered[:, 2] < 0.0).any():
        at = int(np.argmax(scans.scattered[:, 2] < 0.0))
        raise ArgumentError(
            f"scattered[{at}] is {scans.scattered[at].tolist()}, behind the sample: models are fitted to reflected light; "
            "leave transmitted light out, or make a table"
        )
    if scans.reflectance is not None:
        raise ArgumentError(
            "a reflectance scales tables; a model is fitted to the values as they are: leave the reflectance out"
        )
    if not (scans.values > 0.0).any():
        raise ArgumentError("no value of the scans is above 0: there is nothing to fit a model to")
    if scans.standard_error is not None and not (scans.standard_error > 0.0).all():
        at = int(np.argmin(scans.standard_error))
        raise ArgumentError(f"standard_error[{at}] is 0: state how far each value may be off, or leave all errors out")
    if scans.standard_error is None and (below := int((scans.values < 0.0).sum())):
        raise ArgumentError(
            f"{below} of {scans.values.size} values are below 0, as noise about a dark level may be, and without standard "
            "errors residuals count relative to f, which would prefer low values: state how far each value may be off "
            "(standard_error), or make a table of the scans (Bsdf.from_scans), which takes such values"
        )
    first, _, second = model.partition("+")
    form = _Form(LOBE_MODELS.get(second or first), FLOOR in (first, second))
    # |β − β₀|: β₀ is the projection of the specular direction, −i.
    distance = np.hypot(*(scans.scattered[:, :2] + scans.incident[:, :2]).T)
    x, covariance = _least_squares(form, distance, scans)
    notes: list[str] = []
    if form.floor and form.lobe is not None and x[-1] < 0.0:
        told = measured(float(x[-1]), math.sqrt(covariance[-1, -1]), "").rstrip()
        notes.append(f"the Lambertian floor came out below 0, at {told}, and is left out")
        form = dataclasses.replace(form, floor=False)
        model = form.lobe.name if form.lobe is not None else FLOOR
        x, covariance = _least_squares(form, distance, scans)
    return _summary(model, form, x, covariance, distance, scans, notes)


def _law(scans: Scans) -> ErrorLaw | None:
    if scans.standard_error is None:
        return None
    scan = np.zeros(scans.values.size, np.intp)
    for k, (_, own) in enumerate(scans.by_incidence()):
        scan[own] = k
    return error_law(scans.values, scans.standard_error, np.abs(scans.scattered[:, 2]), scan)


def _units(form: _Form, x: Array, distance: Array, scans: Scans, law: ErrorLaw | None) -> Array:
    """What residuals are counted in: standard errors, those of a law at the model; without any, f."""
    if law is not None:
        least = 1e-3 * float(scans.values[scans.values > 0.0].min())
        return law.at(np.maximum(form.f(x, distance), least))
    return _scale(form, x, distance, scans.values) if scans.standard_error is None else scans.standard_error


def _residuals(form: _Form, x: Array, distance: Array, scans: Scans, units: Array) -> Array:
    return np.asarray((form.f(x, distance) - scans.values) / units)


def _scale(form: _Form, x: Array, distance: Array, values: Array) -> Array:
    """What residuals are relative to."""
    least = 1e-3 * float(values[values > 0.0].min())
    return np.maximum(np.maximum(form.f(x, distance), LEAST_PART * values), least)


def _least_squares(form: _Form, distance: Array, scans: Scans) -> tuple[Array, Array]:
    """Numbers of the form with their covariance."""
    optimize, values = scipy_part("optimize"), scans.values
    least = 1e-3 * float(values[values > 0.0].min())
    logs = np.log(np.maximum(values, least))

    def rough(x: Array) -> Array:
        return np.log(np.maximum(form.f(x, distance), least)) - logs

    def fitted(x: Array, scale: Array) -> Any:
        residuals = lambda x: _residuals(form, x, distance, scans, scale)  # noqa: E731 - a function of a line
        return optimize.least_squares(residuals, x, jac="3-point", x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)

    starts = form.starts(distance, values)
    if values.size <= starts[0].size:
        raise ArgumentError(f"{values.size} values do not determine {starts[0].size} parameters: scan more directions")
    # Logarithms of f first: from a bad start the values about the specular direction alone would decide.
    near = [optimize.least_squares(rough, x, loss="soft_l1", x_scale="jac").x for x in starts]
    law = _law(scans)
    best = min((fitted(x, _units(form, x, distance, scans, None)) for x in near), key=lambda one: one.cost)
    for _ in range(ROUNDS if scans.standard_error is None or law is not None else 0):
        last = form.f(best.x, distance)
        best = fitted(best.x, _units(form, best.x, distance, scans, law))
        if np.abs(form.f(best.x, distance) - last).max() <= SETTLED * np.abs(last).max():
            break
    return best.x, _covariance(form, best, scans)


def _covariance(form: _Form, best: Any, scans: Scans) -> Array:
    """(JᵀJ)⁻¹, times the mean square of the residuals where no errors are known."""
    size = np.linalg.norm(best.jac, axis=0)
    _, singular, rows = np.linalg.svd(best.jac / np.where(size > 0.0, size, 1.0), full_matrices=False)
    if not singular[-1] > SINGULAR * singular[0]:
        names = list(form.keys(best.x))
        free = [name for name, part in zip(names, np.abs(rows[-1]), strict=True) if part > 0.1]
        raise ArgumentError(
            f"the scans do not determine {' and '.join(free)} of this model: fit one with fewer parameters, or scan more "
            "directions about the specular one"
        )
    inverse = rows.T / singular / size[:, None]
    covariance = inverse @ inverse.T
    if scans.standard_error is None:
        covariance = covariance * (2.0 * best.cost / (scans.values.size - best.x.size))
    return np.asarray(covariance)


def _derivatives(of: Callable[[Array], Array], x: Array, errors: Array) -> Array:
    """Of a vector by each of the numbers, from steps of a hundredth of their standard errors."""
    columns = []
    for k, error in enumerate(errors):
        step = np.zeros(x.size)
        step[k] = max(0.01 * min(error, 1.0), 1e-7)
        columns.append((of(x + step) - of(x - step)) / (2.0 * step[k]))
    return np.stack(columns, axis=1)


def _summary(
    model: str, form: _Form, x: Array, covariance: Array, distance: Array, scans: Scans, notes: list[str]
) -> BsdfFit:
    errors = np.sqrt(np.diag(covariance))
    parameters = form.keys(x)
    turned = _derivatives(lambda x: np.array([*form.keys(x).values()]), x, errors)
    of_keys = turned @ covariance @ turned.T
    known = dict(zip(parameters, np.sqrt(np.diag(of_keys)).tolist(), strict=True))
    told = _listed(parameters, known)
    thetas = np.array(scans.thetas)
    shares = form.shares(x, thetas)
    slopes = _derivatives(lambda x: form.shares(x, thetas), x, errors)
    try:
        finish = form.finish(x)
        finish.reflectance(thetas)
    except (ArgumentError, SceneError) as error:
        raise ArgumentError(
            f"{model} fitted to the scans ({told}) reflects more light than arrives: {error}. Fit another model, or look "
            "at the scale of the values"
        ) from error
    freedom = scans.values.size - x.size
    scale = _scale(form, x, distance, scans.values)
    relative = (form.f(x, distance) - scans.values) / scale
    units = _units(form, x, distance, scans, _law(scans))
    chi2 = math.nan
    if scans.standard_error is not None:
        chi2 = float(np.sum(_residuals(form, x, distance, scans, units) ** 2)) / freedom
        if chi2 > MISFIT:
            notes.append(
                f"χ² per degree of freedom is {chi2:.3g}: {model} does not describe these scans, or their errors are too "
                "small; the errors of the parameters hold only if it does"
            )
    else:
        notes.append(
            "the scans have no standard errors: residuals count relative to f, and errors come from their spread"
        )
    vague = [name for name, value in parameters.items() if known[name] > VAGUE * abs(value)]
    if vague:
        notes.append(f"the scans hardly determine {' and '.join(vague)}: a model with fewer parameters may do as well")
    return BsdfFit(
        model,
        finish,
        parameters,
        known,
        of_keys,
        chi2,
        float(np.sqrt(np.mean(relative**2))),
        freedom,
        thetas,
        shares,
        np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes)),
        tuple(notes),
    )
