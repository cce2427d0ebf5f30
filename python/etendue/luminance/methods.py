"""`Cone`, `FromField`, `PathTracing`: the methods of estimating luminance, with their options."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal, Self, get_args

from etendue.description.values import is_number
from etendue.errors import ArgumentError, UnknownNameError
from etendue.lightfield.carrier import Surface
from etendue.quantities.arguments import as_whole
from etendue.quantities.ray_stream import checked_seed

MOST_SAMPLES = 2048
"""Points per pixel: more resolve nothing that a light field holds."""

MOST_RAYS_PER_PIXEL = 1 << 24
MOST_FORWARD_RAYS = 1 << 50

PASSES = 16
"""Independent passes of the map of a scene, from whose spread the standard error of each pixel comes."""

FEWEST_PASSES = 4


@dataclasses.dataclass(frozen=True, kw_only=True)
class Method:
    """What the methods share: frozen options that are checked, a shorthand, and the sources that they take."""

    NAME: ClassVar[str]
    """Shorthand: ``method="cone"`` means ``method=Cone()``."""

    SOURCES: ClassVar[str]
    """What it takes, in words."""

    def __new__(cls, *_values: Any, **options: Any) -> Self:
        """Refuse options that the method does not have, and name the method that has them."""
        for name in options:
            if name not in option_names(cls):
                owners = methods_with(name)
                if not owners:
                    raise UnknownNameError(f"option of {cls.__name__}", name, option_names(cls))
                having = " or ".join(owner.__name__ for owner in owners)
                raise ArgumentError(
                    f"{name}: {cls.__name__} has no such option; {having} has it. "
                    f"Options of {cls.__name__}: {', '.join(option_names(cls))}."
                )
        return super().__new__(cls)


ACCEPTANCE = 1.5
"""Half-angle of a cone that nobody states [°]: that of [Audenaert2014]_."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Cone(Method):
    """The method of [Audenaert2014]_ chapter 2 (eqs. 2.2 to 2.4): only rays that head for the observer are counted.

    Parameters
    ----------
    acceptance : float or "auto", optional
        Half-angle α of the cone about the line from each pixel to the observer [°], above 0 and at most 90; ``"auto"``: the
        one of least estimated error, and the map's notes say why. 1.5 unless a radius is stated.
    observer_radius : float, optional
        Instead of an acceptance: the observer is a disk of this radius [mm] that faces the target, as in figure 2.2, and a
        ray counts if it crosses the disk. How far α reaches then differs from pixel to pixel; the étendue between each
        pixel and the disk is integrated, so that the luminance of a Lambertian source is found without a bias.

    Raises
    ------
    ArgumentError
        If both are stated, or the acceptance is out of its domain, or an option is stated that another method has.
    UnknownNameError
        If there is no such option.

    Examples
    --------
    >>> import etendue as et
    >>> rays, observer, screen = et.RingSource(rays=100_000), et.Observer(0, 0, 1000), et.Screen(60, 60, 8, 8)
    >>> lmap = et.luminance_map(rays, observer, screen, method=et.Cone(acceptance=5))
    >>> lmap.provenance.steps[-1]
    'luminance by cone, acceptance 5°'
    """

    acceptance: float | Literal["auto"] | None = None
    observer_radius: float | None = None

    NAME: ClassVar[str] = "cone"
    SOURCES: ClassVar[str] = "rays"

    def __post_init__(self) -> None:
        radius: Any = self.observer_radius
        angle: Any = self.acceptance
        known = isinstance(angle, str) and angle == "auto"
        if angle is not None and not (known or (is_number(angle) and 0.0 < float(angle) <= 90.0)):
            shown = f"{angle}°" if is_number(angle) else repr(angle)
            raise ArgumentError(f"acceptance is {shown}; give a half-angle above 0° and at most 90°, or 'auto'.")
        if radius is None:
            return
        if not (is_number(radius) and 0.0 < float(radius) < math.inf):
            raise ArgumentError(
                f"observer_radius is {radius!r}; give the radius of the observer's disk in mm, above 0."
            )
        if angle is not None:
            raise ArgumentError("an acceptance and an observer of a radius are both stated; use one of them.")

    @property
    def half_angle(self) -> float | Literal["auto"] | None:
        """The acceptance, with that of a cone that nobody states filled in [°]; None if a radius is stated."""
        unstated = self.acceptance is None and self.observer_radius is None
        return ACCEPTANCE if unstated else self.acceptance


@dataclasses.dataclass(frozen=True, kw_only=True)
class FromField(Method):
    """Through the light field: it is fitted to all rays, then its luminance is averaged over each pixel.

    Parameters
    ----------
    surface : Surface or "auto"
        Carrier surface of the field that is fitted to rays; ``"auto"``: the one that predicts held-out rays best. A light
        field as source has its surface already.
    samples : int
        Points per pixel at which the field is read, 1 to 2048. Sixteen times as many where they differ so much that their
        average may be off by half a percent or a quarter of the stated error, as at edges; what is left is in that error.
        Parts of the field that are no larger than pixels are summed up over where they are seen.

    Raises
    ------
    ArgumentError
        If an option is out of its domain, or is stated and another method has it.
    UnknownNameError
        If there is no such option.

    Examples
    --------
    >>> import etendue as et
    >>> rays, observer, screen = et.RingSource(rays=20_000), et.Observer(0, 0, 1000), et.Screen(60, 60, 8, 8)
    >>> lmap = et.luminance_map(rays, observer, screen, method=et.FromField(surface=et.Disk(radius=30), samples=4))
    >>> lmap.provenance.steps[-1]
    'luminance by light field, 4 points per pixel'
    """

    surface: Surface | Literal["auto"] = "auto"
    samples: int = 16

    NAME: ClassVar[str] = "lightfield"
    SOURCES: ClassVar[str] = "rays and light fields"

    def __post_init__(self) -> None:
        surface: Any = self.surface
        if not (isinstance(surface, Surface) or (isinstance(surface, str) and surface == "auto")):
            raise ArgumentError(f"surface is {surface!r}; give a Surface, or 'auto'. For text there is parse_surface.")
        object.__setattr__(self, "samples", as_whole(self.samples, "samples", 1, MOST_SAMPLES))


@dataclasses.dataclass(frozen=True, kw_only=True)
class PathTracing(Method):
    """Lines of sight followed from the observer through the optics of a scene to its sources.

    Of scatter events it adds what these leave out: sources that are seen directly, in mirrors or through lenses, and diffuse
    surfaces seen so.

    Parameters
    ----------
    rays_per_pixel : int
        Lines of sight per pixel, in 16 independent passes (at least 4) whose spread gives the standard error.
    until : float, optional
        More passes are made until the sampling error, weighted by flux (`RelativeError`), is below it, by both routes
        together, up to 64 times `rays_per_pixel`. What light fields do not know of themselves does not count here, but in
        the map's errors.
    seed : int
        Of the random numbers, 0 to 2⁶⁴ - 1.
    forward_rays : float, optional
        So many rays are traced forwards besides, and what they send to the observer from diffuse surfaces is added: light
        that reaches these through lenses and mirrors (caustics), which lines of sight find by chance only, or not at all
        if it comes from points, and that of beams. No light is counted twice. If None, a pilot finds out whether there is
        such light, and how many rays balance its error with that of the rest; 0: none, and the map's notes say that it may
        be too low. With `until` their number grows with that of the lines of sight. Not of scatter events, which are rays
        traced forwards already. Unless it is 0, a few more find small bright places, as of a wall close to a lamp, at which
        lines of sight then look.
    gather : bool, optional
        Whether lines of sight end at the second diffuse surface, whose light is then known from rays traced forwards, as a
        mean over small patches; of finishes that are not Lambertian a part of it is known, and lines go on for the rest.
        Many times as fast where light goes to and fro between diffuse surfaces. Patches that light does not reach evenly
        are not used. The map's notes tell how it compares with lines that go on, and its errors hold what that leaves open.
        If None, a pilot of a map of half a million lines or more tells whether it is better; not beside rays forwards,
        with more than 10 000 faces, or where a ray meets more than a hundred surfaces.

    Raises
    ------
    ArgumentError
        If an option is out of its domain, or is stated and another method has it.
    UnknownNameError
        If there is no such option.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    >>> scene = et.Scene(sources=[lamp])
    >>> how = et.PathTracing(rays_per_pixel=16, seed=7)
    >>> lmap = et.luminance_map(scene, et.Observer(0, 0, 1000), et.Screen(1, 1, 2, 2), method=how)
    >>> bool(abs(lmap.values[0, 0] / (100 / 3.14159265**2 * 1e6) - 1) < 1e-6)     # Φ/(πA)
    True
    """

    rays_per_pixel: int = 256
    until: float | None = None
    seed: int = 1
    forward_rays: float | None = None
    gather: bool | None = None

    NAME: ClassVar[str] = "pathtracing"
    SOURCES: ClassVar[str] = "scenes and scatter events"

    def __post_init__(self) -> None:
        lines = as_whole(self.rays_per_pixel, "rays_per_pixel", 1, MOST_RAYS_PER_PIXEL)
        object.__setattr__(self, "rays_per_pixel", lines)
        least: Any = self.until
        if least is not None and not (is_number(least) and 0.0 < float(least) < math.inf):
            raise ArgumentError(f"until is {self.until!r}; give the relative error to be reached, e.g. 0.01.")
        checked_seed(self.seed)
        rays: Any = self.forward_rays
        whole = is_number(rays) and 0 <= float(rays) <= MOST_FORWARD_RAYS and float(rays).is_integer()
        if rays is not None and not whole:
            raise ArgumentError(
                f"forward_rays is {rays!r}; give a whole number up to {MOST_FORWARD_RAYS:,}, 0 for none, or leave it out."
            )
        if self.gather is not None and not isinstance(self.gather, bool):
            raise ArgumentError(f"gather is {self.gather!r}; give True or False, or leave it out.")

    @property
    def passes(self) -> int:
        """Passes that are made in any case."""
        return min(PASSES, max(FEWEST_PASSES, self.rays_per_pixel))

    @property
    def paths(self) -> int:
        """Lines of sight per pixel and pass."""
        return -(-self.rays_per_pixel // self.passes)


AnyMethod = Cone | FromField | PathTracing
MethodName = Literal["auto", "cone", "lightfield", "pathtracing"]

METHODS: Mapping[str, type[AnyMethod]] = MappingProxyType({kind.NAME: kind for kind in get_args(AnyMethod)})
"""Every method by its shorthand."""

METHOD_NAMES: tuple[str, ...] = get_args(MethodName)


def option_names(kind: type[Method]) -> tuple[str, ...]:
    """The options of a method.

    Examples
    --------
    >>> option_names(FromField)
    ('surface', 'samples')
    """
    return tuple(field.name for field in dataclasses.fields(kind))


def methods_with(name: str) -> list[type[Method]]:
    """The methods that have an option.

    Examples
    --------
    >>> [kind.__name__ for kind in methods_with("samples")]
    ['FromField']
    """
    return [kind for kind in METHODS.values() if name in option_names(kind)]
