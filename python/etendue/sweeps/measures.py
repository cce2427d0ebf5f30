"""What a sweep measures at each step: one noun, one registration, each with its unit and standard error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance.regions import AnyRegion
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap, errors_parted
from etendue.scene import Scene
from etendue.scene.sources.from_files import Field, Rays
from etendue.scene.sources.gridded import Gridded
from etendue.tracing.result import TraceResult
from etendue.units import INTENSITY_UNIT, MM2_PER_M2

Array = npt.NDArray[np.float64]
Reads = Literal["ledger", "detector", "map", "observer"]


ROUNDING = 1e-9
"""By which a flux may exceed that of all rays because it was added up in another order: 10⁻¹⁶ of each of 10⁷ terms."""


class Found(NamedTuple):
    """A number, its standard error (NaN where unknown) and its unit (empty if it has none).

    Examples
    --------
    >>> Found(31.8, 0.2, "cd").unit
    'cd'
    """

    value: float
    error: float
    unit: str


@dataclasses.dataclass(frozen=True)
class Step:
    """What was computed of a scene.

    Parameters
    ----------
    scene : Scene
    result : TraceResult or None
        None: no measure needs a trace.
    maps : mapping
        Luminance maps by the name of the observer.
    region : Region, PolygonRegion or None
        What of these maps counts.

    Examples
    --------
    >>> import etendue as et
    >>> scene = et.Scene(sources=[{"name": "lamp", "kind": "point", "flux": 5}])
    >>> round(NOUNS["escaped"].read(Step(scene, et.trace(scene, rays=1000), {}), "").value, 9)
    5.0
    """

    scene: Scene
    result: TraceResult | None
    maps: Mapping[str, LuminanceMap]
    region: AnyRegion | None = None

    @property
    def traced(self) -> TraceResult:
        """The trace, which there is for all that read it."""
        assert self.result is not None  # noqa: S101 - `Measure.traces` asked for it
        return self.result

    def quantity(self, name: str) -> Any:
        """The luminance map of an observer, or what a detector measured."""
        return self.maps[name] if name in self.maps else self.traced.quantity_of(name)


@dataclasses.dataclass(frozen=True)
class Noun:
    """A kind of measure.

    Parameters
    ----------
    name : str
    words : str
        What it is.
    reads : {"ledger", "detector", "map", "observer"}
        The flux ledger of a trace; a detector, which has to be named; a map, which is that of an observer or of a detector;
        or the map of an observer.
    read : callable
        From a step and the name after the colon, which is empty for a whole ledger.

    Examples
    --------
    >>> NOUNS["uniformity"].words
    'minimum over mean'
    """

    name: str
    words: str
    reads: Reads
    read: Callable[[Step, str], Found]


NOUNS: dict[str, Noun] = {}
"""Everything that can be measured, by its name."""


def _noun(
    name: str, words: str, reads: Reads
) -> Callable[[Callable[[Step, str], Found]], Callable[[Step, str], Found]]:
    def register(read: Callable[[Step, str], Found]) -> Callable[[Step, str], Found]:
        NOUNS[name] = Noun(name, words, reads, read)
        return read

    return register


@dataclasses.dataclass(frozen=True)
class Measure:
    """A noun, and what it is measured of.

    Parameters
    ----------
    noun : str
        A key of `NOUNS`.
    of : str
        Name of a detector, an observer, a source or what absorbs; empty: all the light, or the one observer.
    label : str
        The heading of its column.

    Examples
    --------
    >>> [measure.label for measure in measures_of(["escaped", "flux:desk"], ["desk"], [])]
    ['escaped', 'flux:desk']
    >>> measures_of(["maximun"], [], [""])
    Traceback (most recent call last):
    etendue.errors.UnknownNameError: unknown measure 'maximun'. Did you mean 'maximum'? Known: absorbed, efficiency, ...
    """

    noun: str
    of: str
    label: str

    @property
    def reads(self) -> Reads:
        """What it needs."""
        return NOUNS[self.noun].reads

    def at(self, step: Step) -> Found:
        """The measure of a step."""
        return NOUNS[self.noun].read(step, self.of)


def measures_of(names: Iterable[str], detectors: Iterable[str], observers: Iterable[str]) -> tuple[Measure, ...]:
    """Measures by the names that users give them: ``noun`` or ``noun:name``.

    Parameters
    ----------
    names : iterable of str
        ``maximum``, ``flux:desk`` and so on. What is seen by an observer, and names none, is measured of each of them.
    detectors, observers : iterable of str
        Names of those that there are.

    Raises
    ------
    UnknownNameError
        If there is no such noun, detector or observer.
    ArgumentError
        If a name is needed and missing, given and not wanted, or that of a detector and of an observer; or no observer
        looks; or a measure is given twice.

    Examples
    --------
    >>> [measure.label for measure in measures_of(["mean", "peak:far"], ["far"], ["front", "side"])]
    ['mean:front', 'mean:side', 'peak:far']
    """
    seen, recorded = list(observers), list(detectors)
    found: list[Measure] = []
    for text in names:
        word, _, of = (part.strip() for part in text.partition(":"))
        if word not in NOUNS:
            raise UnknownNameError("measure", word, NOUNS)
        found += _of_noun(NOUNS[word], of, recorded, seen)
    labels = [measure.label for measure in found]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice or not found:
        raise ArgumentError(f"the measure {twice[0]} is given twice." if twice else "give a measure, e.g. maximum.")
    return tuple(found)


def _of_noun(noun: Noun, of: str, detectors: list[str], observers: list[str]) -> list[Measure]:
    if noun.reads == "ledger":
        return [Measure(noun.name, of, f"{noun.name}:{of}" if of else noun.name)]
    known = {"detector": detectors, "map": [*observers, *detectors], "observer": observers}[noun.reads]
    if of:
        if of not in known:
            raise UnknownNameError(f"{_subjects(noun)} of the measure {noun.name}", of, known)
        if noun.reads == "map" and of in observers and of in detectors:
            raise ArgumentError(f"{noun.name}:{of}: an observer and a detector are called {of!r}; rename one of them.")
        return [Measure(noun.name, of, f"{noun.name}:{of}")]
    if noun.reads == "detector":
        names = ", ".join(f"{noun.name}:{name}" for name in detectors) or "the scene has none"
        raise ArgumentError(f"{noun.name}: of which detector? {names}.")
    if not observers:
        others = f", or a detector, e.g. {noun.name}:{detectors[0]}" if noun.reads == "map" and detectors else ""
        raise ArgumentError(f"{noun.name}: nobody looks at the scene; give an observer{others}.")
    alone = len(observers) == 1
    return [Measure(noun.name, name, noun.name if alone else f"{noun.name}:{name}") for name in observers]


def _subjects(noun: Noun) -> str:
    return {"detector": "detector", "map": "observer or detector", "observer": "observer"}[noun.reads]


# --- the ledger --------------------------------------------------------------------------------------------------------


def share_error(flux: float, result: TraceResult) -> float:
    """Standard error of a flux that each ray carries whole or not at all.

    That of a share of independent rays, √(p (1 − p)/n), n the number of equal rays that are as good as those of the sources
    (`TraceResult.effective_rays`), and that of what was emitted, if it is by some rays of a set only. Rays are dealt to
    sources, and over sources, more evenly than by chance; so the error is at most this. NaN of more flux than there is: then
    rays were counted several times; and of none: no ray tells how little.

    Examples
    --------
    >>> import etendue as et
    >>> result = et.trace(et.Scene(sources=[{"kind": "point", "flux": 50}]), rays=10_000)
    >>> round(share_error(25.0, result), 6)               # 50 lm · √(0.5 · 0.5/10 000)
    0.25
    """
    share, error = _share(flux, result)
    return math.hypot(result.ledger.total.flux * error, share * emitted_error(result))


def _share(flux: float, result: TraceResult) -> tuple[float, float]:
    """A flux over that of all rays, and the standard error of this share."""
    total = result.ledger.total.flux
    if not flux > 0.0 or not result.effective_rays > 0.0 or flux > total * (1.0 + ROUNDING):
        return math.nan, math.nan
    share = min(flux / total, 1.0)
    return share, math.sqrt(share * (1.0 - share) / result.effective_rays)


def emitted_error(result: TraceResult, source: int = -1) -> float:
    """Standard error of the flux of a source, by its number, or of all sources [flux unit].

    0 but where a set gave out some of its rays only, and these have unequal flux.

    Examples
    --------
    >>> import etendue as et
    >>> emitted_error(et.trace(et.Scene(sources=[{"kind": "point", "flux": 50}]), rays=1000))
    0.0
    """
    variance = result.plan.dealing.emitted_variance(result.sums.sources)[:, source].sum()
    return math.sqrt(float(variance)) * result.scale


def _flux(flux: float, result: TraceResult) -> Found:
    return Found(flux, share_error(flux, result), result.ledger.flux_unit)


@_noun("emitted", "flux of all sources, or of the one named", "ledger")
def _emitted(step: Step, of: str) -> Found:
    ledger = step.traced.ledger
    if of and of not in ledger.emitted:
        raise UnknownNameError("source", of, ledger.emitted)
    number = list(ledger.emitted).index(of) if of else -1
    flux = ledger.emitted[of].flux if of else ledger.total.flux
    return Found(flux, emitted_error(step.traced, number), ledger.flux_unit)


@_noun("escaped", "flux that left the scene", "ledger")
def _escaped(step: Step, of: str) -> Found:
    _whole("escaped", of)
    return _flux(step.traced.ledger.escaped.flux, step.traced)


@_noun("efficiency", "flux that left the scene over that emitted", "ledger")
def _efficiency(step: Step, of: str) -> Found:
    _whole("efficiency", of)
    total, flux = step.traced.ledger.total.flux, step.traced.ledger.escaped.flux
    return Found(flux / total if total > 0.0 else math.nan, _share(flux, step.traced)[1], "")


@_noun("absorbed", "flux that was absorbed, by everything or by the solid, surface, face or medium named", "ledger")
def _absorbed(step: Step, of: str) -> Found:
    ledger, plan = step.traced.ledger, step.traced.plan
    if not of:
        return _flux(ledger.absorbed.flux, step.traced)
    # The faces of detectors, which stand behind those of the scene, absorb nothing.
    detectors = [detection.name for detection in plan.detections if detection.HAS_FACE]
    faces = plan.face_names[: len(plan.face_names) - len(detectors)]
    # A surface and a medium may have one name: then both are meant.
    entries = [*((name, ledger.by_surface[name]) for name in faces), *ledger.by_medium.items()]
    parts = [entry.flux for name, entry in entries if name == of or name.startswith(f"{of}.")]
    medium = _medium_of(step.scene, of)
    if medium not in ("", of):
        parts.append(ledger.by_medium[medium].flux)
    if not parts and of in (detection.name for detection in plan.detections):
        raise ArgumentError(
            f"absorbed:{of}: {of} is a detector, which absorbs nothing; write flux:{of} for what meets it."
        )
    if not parts:
        names = {name for name, _ in entries}
        raise UnknownNameError("solid, surface, face or medium", of, {*names, *(n.partition(".")[0] for n in names)})
    return _flux(math.fsum(parts), step.traced)


def _medium_of(scene: Scene, of: str) -> str:
    """The named medium that absorbs in a solid, and in that one alone; empty if it is no solid, or nothing absorbs in it.

    The ledger counts what is absorbed by media, not by the solids that they fill.

    Raises
    ------
    ArgumentError
        If something else is filled with it too.
    """
    filled = [(solid.name or f"solids[{i}]", solid.medium) for i, solid in enumerate(scene.solids)]
    medium = dict(filled).get(of)
    if not isinstance(medium, str) or medium not in scene.media or scene.media[medium].absorption == 0.0:
        return ""
    others = [name for name, held in filled if held == medium and name != of]
    if scene.surroundings == medium:
        others.append("the surroundings")
    if others and medium != of:
        raise ArgumentError(
            f"absorbed:{of}: {of} and {others[0]} are of the medium {medium!r}, and what it absorbs in each is not known "
            f"apart; give {of} a medium of its own, or measure absorbed:{medium}."
        )
    return medium


def _whole(noun: str, of: str) -> None:
    if of:
        raise ArgumentError(f"{noun}:{of}: {noun} is of all the light; leave ':{of}' out.")


# --- detectors ---------------------------------------------------------------------------------------------------------


@_noun("flux", "flux on a detector, or in a far field", "detector")
def _flux_of(step: Step, of: str) -> Found:
    return Found(*step.traced.flux_of(of), step.traced.plan.flux_unit)


@_noun("peak", "peak intensity of a far field", "detector")
def _peak(step: Step, of: str) -> Found:
    found = step.traced.quantity_of(of)
    if not isinstance(found, Intensity):
        raise ArgumentError(f"peak:{of}: name a detector of the kind intensity.")
    return Found(found.peak_intensity, found.peak_error, found.unit)


# --- maps --------------------------------------------------------------------------------------------------------------


@_noun("mean", "mean luminance or illuminance; a dead pixel counts as 0", "map")
def _mean(step: Step, of: str) -> Found:
    found, inside = _map(step, of, "mean")
    value = float(np.nan_to_num(found.values[inside]).mean())
    if isinstance(found, IlluminanceMap):
        # A region is of observers' maps: all cells count.
        return Found(value, found.mean_error, found.unit)
    values, errors = (array[inside] / int(inside.sum()) for array in (found.values, found.standard_error))
    return Found(value, _sum_error(step, found, values, errors), found.unit)


@_noun("maximum", "luminance or illuminance of the brightest pixel", "map")
def _maximum(step: Step, of: str) -> Found:
    return _extreme(step, of, "maximum", lambda values: int(values.argmax()))


@_noun("minimum", "luminance or illuminance of the darkest pixel", "map")
def _minimum(step: Step, of: str) -> Found:
    return _extreme(step, of, "minimum", lambda values: int(values.argmin()))


@_noun("uniformity", "minimum over mean", "map")
def _uniformity(step: Step, of: str) -> Found:
    low, mean = _minimum(step, of), _mean(step, of)
    if not mean.value > 0.0:
        return Found(math.nan, math.nan, "")
    ratio = low.value / mean.value
    return Found(ratio, math.hypot(low.error, ratio * mean.error) / mean.value, "")


@_noun("intensity", "luminous intensity towards the observer", "observer")
def _intensity(step: Step, of: str) -> Found:
    found = step.maps[of]
    apparent = found.screen.pixel_area / MM2_PER_M2 * found.screen.cosine(found.observer)
    values, errors = apparent * found.values, apparent * found.standard_error
    return Found(found.intensity, _sum_error(step, found, values, errors), INTENSITY_UNIT[found.flux_unit])


def _map(step: Step, of: str, noun: str) -> tuple[LuminanceMap | IlluminanceMap, npt.NDArray[np.bool_]]:
    """A map, and which of its pixels count."""
    found = step.quantity(of)
    if not isinstance(found, LuminanceMap | IlluminanceMap):
        raise ArgumentError(f"{noun}:{of}: name an observer, or a detector of illuminance or of a light image.")
    whole = np.ones(found.values.shape, dtype=np.bool_)
    return found, whole if step.region is None or of not in step.maps else step.region.mask(found.screen)


def _extreme(step: Step, of: str, noun: str, choose: Callable[[Array], int]) -> Found:
    found, inside = _map(step, of, noun)
    values = np.nan_to_num(found.values[inside])
    at = choose(values)
    return Found(float(values[at]), float(found.standard_error[inside][at]), found.unit)


def _sum_error(step: Step, found: LuminanceMap, terms: Array, errors: Array) -> float:
    """Standard error of a sum over pixels, from its terms and their errors.

    Lines of sight of different pixels are independent, but for what the map says that its pixels have in common. What a
    light field does not know is common to many pixels: where there is one, errors are added up as if all of them erred
    together, which is the most that they can.
    """
    known = np.nan_to_num(errors)
    if any(isinstance(source, Rays | Field | Gridded) for source in step.scene.sources):
        return float(known.sum())
    shared, own = errors_parted(np.nan_to_num(terms), known, found.common_error)
    return math.hypot(math.sqrt(float((own**2).sum())), float(shared.sum()))
