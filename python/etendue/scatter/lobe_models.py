"""Models of the scatter package as lobes with a few parameters, which can be fitted through an instrument."""

from __future__ import annotations

import abc
import dataclasses
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from etendue.quantities.arguments import require_known
from etendue.scatter.models import MODELS, CosinePower, Lambertian, Mirror, Mixture, Transmitter

Array = npt.NDArray[np.float64]

STEEPEST = float(np.log(99.0))
"""Largest ln of an exponent: further out a lobe is a Gaussian, or ends in a step."""

LARGEST_LOG = 30.0
"""Of parameters on the way: e³⁰ is beyond all that a lobe could be."""


class LobeModel(abc.ABC):
    """A lobe over |β − β₀|, wider across an axis than along it.

    Its parameters, all free: ln of the value at the specular direction, ln of the width along the axis, ln of the aspect,
    azimuth of the axis [rad], ln of the Lambertian floor [1/sr], and what else the shape has.
    """

    name: ClassVar[str]
    extra: ClassVar[tuple[float, ...]] = ()
    """Where further parameters of the shape start."""

    @abc.abstractmethod
    def shape(self, distance: Array, extra: Array) -> Array:
        """F over its largest value, at distances in units of the width."""

    @abc.abstractmethod
    def keys(self, peak: float, width: float, extra: Array) -> dict[str, Any]:
        """The keys of the finish."""

    def start(self, peak: float, width: float, aspect: float, azimuth: float, floor: float) -> Array:
        """Parameters of a lobe of which this much is known."""
        return np.array([np.log(peak), np.log(width), np.log(aspect), azimuth, np.log(floor), *self.extra])

    def start_from(self, other: Array) -> Array:
        """Parameters near those of another model."""
        return np.array([*other[:5], *self.extra])

    def normal_form(self, parameters: Array) -> Array:
        """The same lobe, wider across its axis than along it: axis and aspect can be told in two ways.

        Examples
        --------
        >>> model = lobe_model("gaussian")
        >>> flat = model.start(peak=60.0, width=0.016, aspect=0.5, azimuth=0.3, floor=0.1)
        >>> np.exp(model.normal_form(flat)[1:3]).round(6).tolist()
        [0.008, 2.0]
        """
        if parameters[2] >= 0.0:
            return parameters
        result = parameters.copy()
        result[1:4] = parameters[1] + parameters[2], -parameters[2], parameters[3] + 0.5 * np.pi
        return result

    def f(self, parameters: Array, off: Array) -> Array:
        """F [1/sr] at β − β₀ of shape (…, 2)."""
        peak, width, aspect = np.exp(np.clip(parameters[:3], -LARGEST_LOG, LARGEST_LOG))
        c, s = np.cos(parameters[3]), np.sin(parameters[3])
        along, across = off[..., 0] * c + off[..., 1] * s, off[..., 1] * c - off[..., 0] * s
        distance = np.hypot(along, across / aspect) / width
        floor = np.exp(np.clip(parameters[4], -LARGEST_LOG, LARGEST_LOG))
        return np.asarray(peak * self.shape(distance, parameters[5:]) + floor)

    def bsdf(self, parameters: Array, *, behind: bool, regular: float) -> Fitted:
        """The same as a finish, with what is mirrored in a single direction.

        Raises
        ------
        ArgumentError
            If more light leaves than arrives.
        """
        peak, width, aspect = np.exp(parameters[:3])
        way = "transmitted" if behind else "reflected"
        keys = self.keys(peak, width, parameters[5:]) | {"aspect": float(aspect), "way": way}
        lobe: Any = MODELS[self.name](**keys)
        share = float(np.pi * np.exp(parameters[4]))
        floor: Any = Lambertian(reflectance=share)
        if behind:
            floor = CosinePower(peak=share / np.pi, exponent=0.0, about="normal", way="transmitted")
        parts: Any = [lobe, floor]
        if regular > 0.0:
            parts.append(Transmitter(transmittance=regular) if behind else Mirror(reflectance=regular))
        # Built now, so that what is impossible is told now.
        made = Mixture(parts=parts)
        made.reflectance(0.0)
        return Fitted(made, float(np.degrees(parameters[3])) % 180.0)


@dataclasses.dataclass(frozen=True)
class Fitted:
    """A finish, and how the sample stood.

    Parameters
    ----------
    bsdf : Mixture
        A lobe on a floor; its axis is that along which the lobe is measured.
    turn : float
        Azimuth of the axis against the light that comes from azimuth 180° [°].
    """

    bsdf: Mixture
    turn: float


@dataclasses.dataclass(frozen=True)
class GaussianLobe(LobeModel):
    """exp(−t²/2)."""

    name = "gaussian"

    def shape(self, distance: Array, extra: Array) -> Array:  # noqa: ARG002 - it has no more
        """F over its largest value."""
        return np.exp(-0.5 * distance**2)

    def keys(self, peak: float, width: float, extra: Array) -> dict[str, Any]:  # noqa: ARG002 - it has no more
        """The keys of the finish."""
        return {"peak": peak, "sigma": width}


@dataclasses.dataclass(frozen=True)
class AbgLobe(LobeModel):
    """1/(1 + tᵍ)."""

    name = "abg"
    extra = (float(np.log(2.0)),)

    def shape(self, distance: Array, extra: Array) -> Array:
        """F over its largest value."""
        # Far outside of a steep lobe the power is beyond all numbers, and F is 0.
        with np.errstate(over="ignore"):
            return np.asarray(1.0 / (1.0 + distance ** np.exp(min(extra[0], STEEPEST))))

    def keys(self, peak: float, width: float, extra: Array) -> dict[str, Any]:
        """The keys of the finish."""
        b = width ** float(np.exp(min(extra[0], STEEPEST)))
        return {"a": peak * b, "b": b, "g": float(np.exp(min(extra[0], STEEPEST)))}


@dataclasses.dataclass(frozen=True)
class HarveyShackLobe(LobeModel):
    """(1 + t²)^(S/2)."""

    name = "harvey-shack"
    extra = (float(np.log(3.0)),)

    def shape(self, distance: Array, extra: Array) -> Array:
        """F over its largest value."""
        return np.asarray((1.0 + distance**2) ** (-0.5 * np.exp(min(extra[0], STEEPEST))))

    def keys(self, peak: float, width: float, extra: Array) -> dict[str, Any]:
        """The keys of the finish."""
        return {"b0": peak, "l": width, "s": -float(np.exp(min(extra[0], STEEPEST)))}


LOBE_MODELS: dict[str, LobeModel] = {one.name: one for one in (GaussianLobe(), AbgLobe(), HarveyShackLobe())}
"""By the kind of the finish."""


def lobe_model(name: str) -> LobeModel:
    """The model of a name.

    Raises
    ------
    UnknownNameError
        If there is none.
    """
    require_known(name, LOBE_MODELS, "model of a lobe")
    return LOBE_MODELS[name]
