"""Lobes: over the distance in direction cosines (ABg, Harvey and Shack, Gaussian), and powers of a cosine."""

from __future__ import annotations

import abc
from typing import Annotated, ClassVar, Literal

from annotated_types import Ge, Gt, Le

from etendue.description.files import Files
from etendue.description.values import AsNumber, Finite, NotNegative, Positive
from etendue.errors import ArgumentError
from etendue.scatter.building import built
from etendue.scatter.models.finish import Directed, Finish, Record


class Lobe(Directed, abc.ABC):
    """What lobes have in common.

    Of a lobe at an angle, part would leave the unit circle of direction cosines, where there are no directions.
    `beyond` says whether that light is absorbed, so that the share falls with the angle of incidence, or f is scaled so
    that the share stays what it is at normal incidence.

    A lobe that is not round has an `aspect`: how much wider it is across `axis` than along it. The part of β − β₀ across
    the axis is divided by it before the length is taken.
    """

    way: Literal["reflected", "transmitted"] = "reflected"
    beyond: Literal["absorbed", "renormalised"] = "absorbed"
    aspect: Annotated[float, Finite, Ge(1e-3), Le(1e3), AsNumber] = 1.0

    PARAMETERS: ClassVar[tuple[str, ...]] = ()
    """Names of the numbers that the core takes."""

    def record(self, files: Files) -> Record:
        """The numbers."""
        return _accepted(type(self).__name__, self.unbuilt(files))

    def unbuilt(self, files: Files) -> Record:  # noqa: ARG002 - other finishes have tables
        """The numbers, whatever the core says to them."""
        return {
            "kind": self.kind,  # type: ignore[attr-defined] # each class has one
            "transmitted": float(self.way == "transmitted"),
            "renormalised": float(self.beyond == "renormalised"),
            "aspect": self.aspect,
            **{name: getattr(self, name) for name in self.PARAMETERS},
        }

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """If it transmits."""
        return self.way == "transmitted"


class ABg(Lobe):
    """The ABg model: f = A/(B + |β − β₀|ᵍ).

    β and β₀ are the projections of the scattered and the specular direction on the surface. For g = 0 it is Lambertian, with
    f = A/(B + 1).

    Parameters
    ----------
    a : number
        A [1/sr].
    b : number
        B, more than 0 unless g is 0; f is A/B at the specular direction, and falls from |β − β₀| = B^(1/g) on.
    g : number
        At least 0.
    way : {"reflected", "transmitted"}
        About the mirrored direction, or straight on.
    beyond : {"absorbed", "renormalised"}
        What becomes of light that would leave the unit circle of direction cosines.
    aspect : number
        How much wider the lobe is across the axis than along it; 1 is round.
    axis : three numbers
        Of lobes that are not round, in the coordinates of the solid or surface; it is laid on the surface at every point.

    Examples
    --------
    >>> polish = ABg(a=0.0025, b=0.001, g=1.8)
    >>> polish.reflectance(0).round(6).tolist()
    0.041344
    """

    kind: Literal["abg"] = "abg"
    a: NotNegative
    b: NotNegative
    g: NotNegative

    PARAMETERS = ("a", "b", "g")


class HarveyShack(Lobe):
    """The model of Harvey and Shack with three parameters: f = b₀ (1 + (|β − β₀|/L)²)^(S/2) [Harvey1976]_.

    Parameters
    ----------
    b0 : number
        f at the specular direction [1/sr].
    l : number
        L, the distance in direction cosines at which f begins to fall.
    s : number
        S, the slope of log f over log |β − β₀| far out; at most 0.
    way, beyond, aspect, axis
        As of `ABg`.

    Examples
    --------
    >>> mirror = HarveyShack(b0=2.0, l=0.01, s=-1.5)
    >>> bool(mirror.evaluate([0, 0, 1], [0, 0, 1]) == 2.0)
    True
    """

    kind: Literal["harvey-shack"] = "harvey-shack"
    b0: NotNegative
    l: Positive  # noqa: E741 - the letter of the literature
    s: Annotated[float, Finite, Ge(-100.0), Le(0.0), AsNumber]

    PARAMETERS = ("b0", "l", "s")


class Gaussian(Lobe):
    """A Gaussian in direction cosines: f = peak · exp(−|β − β₀|²/(2 σ²)).

    Parameters
    ----------
    peak : number
        f at the specular direction [1/sr].
    sigma : number
        σ. A holographic diffuser of full width at half maximum w, in air at normal incidence, has
        σ = sin(w/2)/√(2 ln 2).
    way, beyond, aspect, axis
        As of `ABg`.

    Examples
    --------
    >>> diffuser = Gaussian(peak=17.0, sigma=0.09, way="transmitted")
    >>> diffuser.transmittance(0).round(3).tolist()
    0.865
    """

    kind: Literal["gaussian"] = "gaussian"
    peak: NotNegative
    sigma: Annotated[float, Finite, Gt(0.0), AsNumber]

    PARAMETERS = ("peak", "sigma")


class CosinePower(Finish):
    """A power of the cosine of the angle from the specular direction, or from the normal: f = peak · cosⁿ α.

    Beyond 90° from its axis it is 0. About the normal, total scatter is 2π peak/(n + 2) at all angles of incidence.

    Parameters
    ----------
    peak : number
        f along the axis of the lobe [1/sr].
    exponent : number
        n, from 0 to 1,000,000.
    about : {"specular", "normal"}
        The axis: the mirrored direction (straight on, of transmitted light), or the normal of the surface.
    way : {"reflected", "transmitted"}
        To which side.

    Examples
    --------
    >>> opal = CosinePower(peak=0.25, exponent=0.5, about="normal", way="transmitted")
    >>> opal.transmittance([0, 60]).round(4).tolist()
    [0.6283, 0.6283]
    """

    kind: Literal["cosine-power"] = "cosine-power"
    peak: NotNegative
    exponent: Annotated[float, Finite, Ge(0.0), Le(1e6), AsNumber]
    about: Literal["specular", "normal"] = "specular"
    way: Literal["reflected", "transmitted"] = "reflected"

    def record(self, files: Files) -> Record:
        """The numbers."""
        return _accepted("CosinePower", self.unbuilt(files))

    def unbuilt(self, files: Files) -> Record:  # noqa: ARG002 - other finishes have tables
        """The numbers, whatever the core says to them."""
        return {
            "kind": self.kind,
            "peak": self.peak,
            "exponent": self.exponent,
            "about_normal": float(self.about == "normal"),
            "transmitted": float(self.way == "transmitted"),
        }

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """If it transmits."""
        return self.way == "transmitted"


def _accepted(name: str, record: Record) -> Record:
    """A record that the core takes."""
    try:
        built(record)
    except ValueError as error:
        raise ArgumentError(f"{name}: {error}") from None
    return record
