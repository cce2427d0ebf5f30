"""The methods of estimating luminance, their options, and which of them suit which source.

`luminance_map` and the command line both ask here, so that they accept and refuse the same.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal, Self, get_args

from etendue.description.values import is_number
from etendue.errors import ArgumentError, UnknownNameError
from etendue.formats.rays.ray_index import RayIndex
from etendue.lightfield.carrier import Surface
from etendue.lightfield.light_field import LightField
from etendue.quantities.ray_stream import RayStream, checked_seed
from etendue.scene import Scene
from etendue.scene.scatter_events import ScatterEvents

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
                owners = _owners(name)
                if not owners:
                    raise UnknownNameError(f"option of {cls.__name__}", name, option_names(cls))
                raise ArgumentError(
                    f"{name}: {cls.__name__} has no such option; {_either(owners, PYTHON)} has it. "
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
        if angle is not None and not (angle == "auto" or (is_number(angle) and 0.0 < float(angle) <= 90.0)):
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
        if not (surface == "auto" or isinstance(surface, Surface)):
            raise ArgumentError(f"surface is {surface!r}; give a Surface, or 'auto'. For text there is parse_surface.")
        samples: Any = self.samples
        if isinstance(samples, bool) or not isinstance(samples, int) or not 1 <= samples <= MOST_SAMPLES:
            raise ArgumentError(
                f"samples is {samples!r}; give a whole number of points per pixel, 1 to {MOST_SAMPLES}."
            )


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
        traced forwards already.
    gather : bool, optional
        Whether lines of sight end at the second diffuse surface, whose light is then known from rays traced forwards, as a
        mean over small patches; of finishes that are not Lambertian a part of it is known, and lines go on for the rest.
        Many times as fast where light goes to and fro between diffuse surfaces. Patches that light does not reach evenly
        are not used. The map's notes tell how it compares with lines that go on, and its errors hold what that leaves open.
        If None, a pilot of a map of half a million lines or more tells whether it is better; not beside rays forwards,
        with more than eight wavelengths or 10 000 faces, or where a ray meets more than a hundred surfaces.

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
        n: Any = self.rays_per_pixel
        if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MOST_RAYS_PER_PIXEL:
            raise ArgumentError(f"rays_per_pixel is {n!r}; give a whole number from 1 to {MOST_RAYS_PER_PIXEL:,}.")
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


@dataclasses.dataclass(frozen=True)
class SourceKind:
    """What a kind of source can be looked at by.

    Parameters
    ----------
    words : str
        What it is, with its article.
    methods : tuple of type
        Those that take it; the first one is meant by ``"auto"`` if no option tells.
    without : mapping
        Options that mean nothing for this kind, with the reason.
    only_if : str, optional
        Option that has to be stated with others under ``"auto"``: without any the source is looked at by no method, but
        shows what it holds.
    """

    words: str
    methods: tuple[type[AnyMethod], ...]
    without: Mapping[str, str] = dataclasses.field(default_factory=dict)
    only_if: str | None = None


RAYS = SourceKind("a ray set", (FromField, Cone))
# An index was built for the cone alone, which it makes a matter of milliseconds.
INDEX = SourceKind("an index of rays", (Cone, FromField))
FIELD = SourceKind("a light field", (FromField,), {"surface": "a light field has its carrier surface already"})
SCENE = SourceKind("a scene", (PathTracing,))
EVENTS = SourceKind(
    "scatter events",
    (PathTracing,),
    {"forward_rays": "scatter events are rays traced forwards already"},
    only_if="rays_per_pixel",
)


def kind_of_source(source: RayStream | LightField | Scene | ScatterEvents) -> SourceKind:
    """What a source can be looked at by.

    Raises
    ------
    ArgumentError
        If it is none.

    Examples
    --------
    >>> import etendue as et
    >>> kind_of_source(et.RingSource()).words
    'a ray set'
    """
    if isinstance(source, Scene):
        return SCENE
    if isinstance(source, ScatterEvents):
        return EVENTS
    if isinstance(source, LightField):
        return FIELD
    if not isinstance(source, RayStream):
        raise ArgumentError(
            f"a {type(source).__name__} is no source of light that can be looked at; give rays, a light field, a scene, the "
            "scatter events of a trace, or the path of a file."
        )
    return INDEX if isinstance(source, RayIndex) else RAYS


@dataclasses.dataclass(frozen=True)
class Spelling:
    """How messages call options and methods: as Python or as the command line does.

    Parameters
    ----------
    option : callable
        From the name of an option to what the user wrote.
    method : callable
        From a method to what the user wrote.
    """

    option: Callable[[str], str]
    method: Callable[[type[Method]], str]


PYTHON = Spelling(option=str, method=lambda kind: kind.__name__)


def option_names(kind: type[Method]) -> tuple[str, ...]:
    """The options of a method.

    Examples
    --------
    >>> option_names(FromField)
    ('surface', 'samples')
    """
    return tuple(field.name for field in dataclasses.fields(kind))


def mismatch(
    method: AnyMethod | str, stated: Mapping[str, object], source: SourceKind, spelling: Spelling = PYTHON
) -> str | None:
    """What does not go together of a method, options that are stated beside it, and a source; None if all does.

    Parameters
    ----------
    method : Cone, FromField, PathTracing or str
        The method, or its shorthand; ``"auto"``: the one that has the options, or that suits the source.
    stated : mapping
        Options by name, without those that were left out.
    source : SourceKind
        What is looked at.
    spelling : Spelling
        How options and methods are called.

    Returns
    -------
    str or None
        A sentence that names the method which has the option.

    Raises
    ------
    UnknownNameError
        If there is no such method, or no method has an option.

    Examples
    --------
    >>> mismatch("auto", {"acceptance": 3}, RAYS)
    >>> mismatch("lightfield", {"acceptance": 3}, RAYS)
    'acceptance: FromField has no such option (it has surface, samples); Cone has it. Leave it out.'
    >>> mismatch("auto", {"acceptance": 3}, SCENE)
    'acceptance: an option of Cone, which is for rays, and the source is a scene; leave it out.'
    """
    if isinstance(method, str) and method not in METHOD_NAMES:
        raise UnknownNameError("method", method, METHOD_NAMES)
    given: Any = method
    if not isinstance(given, str | Method):
        found = f"the class {given.__name__}, not an object of it" if isinstance(given, type) else repr(given)
        choices = ", ".join(f"{kind.__name__}(…)" for kind in METHODS.values())
        raise ArgumentError(f"method is {found}; give {choices}, or a name: {', '.join(METHOD_NAMES)}.")
    for name in stated:
        if not _owners(name):
            raise UnknownNameError("option", name, [n for kind in METHODS.values() for n in option_names(kind)])
    if isinstance(method, Method):
        return _beside(method, stated) or _unsuitable(type(method), source, spelling) or _idle(method, source)
    if method == "auto":
        return _of_several(stated, source, spelling)
    kind = METHODS[method]
    return (
        _unsuitable(kind, source, spelling)
        or _foreign(kind, stated, spelling)
        or _meaningless(stated, source, spelling)
    )


def choose_method(method: AnyMethod | str, stated: Mapping[str, Any], source: SourceKind) -> AnyMethod | None:
    """The method with its options.

    Parameters
    ----------
    method, stated, source
        As of `mismatch`.

    Returns
    -------
    Cone, FromField, PathTracing or None
        One of `source.methods`; None: scatter events by themselves.

    Raises
    ------
    ArgumentError
        If something does not go together, or an option is out of its domain.
    UnknownNameError
        As `mismatch`.

    Examples
    --------
    >>> choose_method("auto", {"acceptance": 3}, RAYS)
    Cone(acceptance=3, observer_radius=None)
    >>> choose_method("auto", {}, INDEX), choose_method("auto", {}, EVENTS)
    (Cone(acceptance=None, observer_radius=None), None)
    """
    complaint = mismatch(method, stated, source)
    if complaint is not None:
        raise ArgumentError(complaint)
    if not isinstance(method, str):
        return method
    if method != "auto":
        return METHODS[method](**stated)
    if source.only_if is not None and not stated:
        return None
    (kind, *_) = _having(stated, source)
    return kind(**stated)


def _owners(name: str) -> list[type[Method]]:
    """The methods that have an option."""
    return [kind for kind in METHODS.values() if name in option_names(kind)]


def _having(stated: Mapping[str, object], source: SourceKind) -> list[type[AnyMethod]]:
    """The methods for a source that have all the options."""
    return [kind for kind in source.methods if set(stated) <= set(option_names(kind))]


def _either(kinds: list[type[Method]] | tuple[type[Method], ...], spelling: Spelling) -> str:
    return " or ".join(spelling.method(kind) for kind in kinds)


def _listed(names: list[str], spelling: Spelling) -> str:
    return ", ".join(spelling.option(name) for name in names)


def _beside(method: Method, stated: Mapping[str, object]) -> str | None:
    """What is wrong with options beside a method that holds its own; only Python has such methods."""
    if not stated:
        return None
    kind = type(method)
    own = [name for name in stated if name in option_names(kind)]
    if own:
        return (
            f"{', '.join(own)}: the method {method!r} holds its options; state it there, or give method={kind.NAME!r}."
        )
    return _foreign(kind, stated, PYTHON)


def _foreign(kind: type[Method], stated: Mapping[str, object], spelling: Spelling) -> str | None:
    """Options that another method has."""
    foreign = [name for name in stated if name not in option_names(kind)]
    if not foreign:
        return None
    return (
        f"{_listed(foreign, spelling)}: {spelling.method(kind)} has no such option "
        f"(it has {_listed(list(option_names(kind)), spelling)}); {_either(_owners(foreign[0]), spelling)} has it. "
        "Leave it out."
    )


def _unsuitable(kind: type[Method], source: SourceKind, spelling: Spelling) -> str | None:
    """A method that does not take the source."""
    if kind in source.methods:
        return None
    return (
        f"{spelling.method(kind)} is for {kind.SOURCES}, and the source is {source.words}; "
        f"leave it out, or give {_either(source.methods, spelling)}."
    )


def _meaningless(stated: Mapping[str, object], source: SourceKind, spelling: Spelling) -> str | None:
    """Options that mean nothing for the source."""
    idle = [name for name in stated if name in source.without]
    return f"{_listed(idle, spelling)}: {source.without[idle[0]]}; leave it out." if idle else None


def _idle(method: Method, source: SourceKind) -> str | None:
    """Options of an object, other than their defaults, that mean nothing for the source."""
    plain = type(method)()
    given = {name: getattr(method, name) for name in option_names(type(method))}
    return _meaningless({n: value for n, value in given.items() if value != getattr(plain, n)}, source, PYTHON)


def _of_several(stated: Mapping[str, object], source: SourceKind, spelling: Spelling) -> str | None:
    """What is wrong with options if they tell the method."""
    strangers = [name for name in stated if not set(_owners(name)) & set(source.methods)]
    if strangers:
        (owner, *_) = _owners(strangers[0])
        return (
            f"{_listed(strangers, spelling)}: an option of {spelling.method(owner)}, which is for {owner.SOURCES}, "
            f"and the source is {source.words}; leave it out."
        )
    if not _having(stated, source):
        shares = [(kind, [name for name in stated if name in option_names(kind)]) for kind in source.methods]
        told = ", ".join(f"{_listed(names, spelling)} of {spelling.method(kind)}" for kind, names in shares if names)
        return f"{told}: no method has options of both; leave those of one out."
    if source.only_if is not None and stated and source.only_if not in stated:
        needed = spelling.option(source.only_if)
        lines = f"{_listed(list(stated), spelling)}: for lines of sight; give {needed} too, or leave it out."
        return _meaningless(stated, source, spelling) or lines
    return _meaningless(stated, source, spelling)
