"""Maps of a scene: lines of sight followed from the eye through the optics to the sources."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.luminance.gathering import CHECKS, FIRST_CHECK, blocks, comparison_note, survey_notes
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import Progress, checked_threads
from etendue.scene import Compiled, Scene, compile_scene
from etendue.scene.dealing import CellSums, Dealing, added
from etendue.scene.placement import Placement
from etendue.scene.sources.from_files import Field, Rays
from etendue.scene.sources.gridded import Gridded
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]
Left = Literal["nothing", "caustics", "scattered"]
"""Light that lines of sight leave to rays traced forwards."""

DEFAULT_RAYS_PER_PIXEL = 256
MOST_RAYS_PER_PIXEL = 1 << 24
MOST_SEED = (1 << 64) - 1

PASSES = 16
"""Independent passes of a map, from whose spread the standard error of each pixel comes."""

FEWEST_PASSES = 4

MOST_TIMES = 64
"""How many times `rays_per_pixel` are followed at most to reach `until`."""

MOST_EVENTS = 10_000
"""Surfaces that a line of sight may meet."""

MOST_FORWARD_RAYS = 1 << 50

ROUND = 16
"""Batches of rays traced forwards at a time."""


@dataclasses.dataclass(frozen=True)
class Looking:
    """How maps of a scene are computed; the parameters are those of `luminance_map`."""

    rays_per_pixel: int = DEFAULT_RAYS_PER_PIXEL
    until: float | None = None
    seed: int = 1
    forward_rays: float | None = None
    gather: bool = False
    cache: bool = True
    threads: int | None = None

    def __post_init__(self) -> None:
        n = self.rays_per_pixel
        if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= MOST_RAYS_PER_PIXEL:
            raise ArgumentError(f"rays_per_pixel is {n!r}; give a whole number from 1 to {MOST_RAYS_PER_PIXEL:,}.")
        if self.until is not None and not (math.isfinite(self.until) and self.until > 0.0):
            raise ArgumentError(f"until is {self.until!r}; give the relative error to be reached, e.g. 0.01.")
        if not (isinstance(self.seed, int) and 0 <= self.seed <= MOST_SEED):
            raise ArgumentError(f"seed is {self.seed!r}; give a whole number from 0 to 2⁶⁴ − 1.")
        rays = self.forward_rays
        if rays is not None and not (1 <= rays <= MOST_FORWARD_RAYS and int(rays) == rays):
            raise ArgumentError(f"forward_rays is {rays!r}; give a whole number from 1 to {MOST_FORWARD_RAYS:,}.")
        checked_threads(self.threads)

    @property
    def passes(self) -> int:
        """Passes that are made in any case."""
        return min(PASSES, max(FEWEST_PASSES, self.rays_per_pixel))

    @property
    def paths(self) -> int:
        """Lines of sight per pixel and pass."""
        return -(-self.rays_per_pixel // self.passes)


@dataclasses.dataclass(frozen=True, eq=False)
class Forward:
    """What rays traced forwards send to the eye of an observer.

    Parameters
    ----------
    values, error : array, shape (rows, columns)
        Luminance and its standard error [flux unit/(mm² sr)].
    rays : array of int64, shape (rows, columns)
        Rays that each pixel rests on.
    note : str
        What it is.
    """

    values: Array
    error: Array
    rays: npt.NDArray[np.int64]
    note: str

    @classmethod
    def of(
        cls, sums: CellSums, shape: tuple[int, ...], dealing: Dealing, rays: int, scale: float, note: str
    ) -> Forward:
        """From the sums of each pixel over the first `rays` rays of a run; each w stands for `scale` w."""
        error = np.sqrt(dealing.variance(sums, rays)).reshape(shape)
        sum_, count = (row.sum(axis=0).reshape(shape) for row in (sums[0], sums[2]))
        return cls(sum_ * scale, error * scale, count.astype(np.int64), note)


def look_at_scene(
    scene: Scene,
    pairs: Sequence[tuple[Observer, Screen]],
    how: Looking,
    progress: Progress | None = None,
    scattered: Sequence[Forward] | None = None,
) -> list[LuminanceMap]:
    """The maps of a scene for observers with their screens; see `luminance_map`.

    `scattered`, if given, has all light that reaches each observer directly from diffuse surfaces; only the rest is looked
    for.

    Raises
    ------
    SceneError
        If the scene has mistakes.
    ArgumentError
        If it has no sources, or a screen has no apparent area.
    """
    views = [screen.core_view(observer) for observer, screen in pairs]
    seeable, notes = with_fields(scene, how.threads, cache=how.cache)
    compiled = compile_scene(seeable)
    if not compiled.record["sources"]:
        raise ArgumentError(f"{scene.name or 'the scene'} has no source: there is nothing to see.")
    core = _core.Scene({**compiled.record, "detectors": []})
    survey = _core.Survey(core, how.seed, MOST_EVENTS, how.threads) if how.gather else None
    forwards = scattered is not None or how.forward_rays is not None
    notes = [*compiled.notes, *notes, *_unseen(compiled, forwards=forwards)]
    notes += [] if survey is None else survey_notes(survey)
    rest = _light_images(compiled, views, how) if scattered is None else scattered
    left: Left = "scattered" if scattered is not None else "caustics" if forwards else "nothing"
    origin = Provenance(scene.name or "scene", "traced scene", fingerprint(compiled.record))
    maps, done = [], 0
    for (observer, screen), view, image in zip(pairs, views, rest, strict=True):
        passes, gathered = _Passes(screen.shape), []

        def look(number: int, known: _core.Survey | None, view: _core._View = view) -> list[Array]:
            passes = number, number + 1
            return _core.look_at_scene(core, view, how.paths, how.seed, MOST_EVENTS, left, *passes, how.threads, known)

        wanted, most = how.passes, how.passes * (1 if how.until is None else MOST_TIMES)
        while passes.done < wanted:
            sum_, _, deviation = look(passes.done, survey)
            passes.add(sum_, deviation)
            gathered.append(blocks(sum_))
            done += how.paths * screen.columns * screen.rows
            if progress is not None:
                progress(done)
            if passes.done == wanted and how.until is not None:
                wanted = passes.wanted(how.until, most)
        paths = how.paths * passes.done
        told = [f"{paths:,} lines of sight per pixel, in {passes.done} independent passes", *passes.notes(how.until)]
        if survey is not None and survey.patches()[0]:
            told.append(comparison_note(gathered, [look(FIRST_CHECK + i, None)[0] for i in range(CHECKS)]))
        if image is None and not passes.lit:
            told.append("the map is dark")
        values, error = passes.mean, passes.standard_error
        if image is not None:
            values, error = values + image.values, np.hypot(error, image.error)
            told.append(image.note)
        maps.append(
            LuminanceMap(
                values * MM2_PER_M2,
                error * MM2_PER_M2,
                np.full(screen.shape, paths),
                observer,
                screen,
                compiled.flux_unit,
                origin.then(f"luminance by {paths:,} lines of sight per pixel, seed {how.seed}"),
                (*told, *notes),
            )
        )
    return maps


def _light_images(compiled: Compiled, views: list[_core._View], how: Looking) -> Sequence[Forward | None]:
    """What each observer sees of light that lines of sight do not find: luminance of the pixels and its standard error.

    It reaches a diffuse surface through smooth ones, or comes from a beam; from the surface, or over other diffuse ones,
    it gets to the eye directly.
    """
    if how.forward_rays is None:
        return [None] * len(views)
    detectors = [{"kind": "image", "view": view, "complement": True} for view in views]
    core = _core.Scene({**compiled.record, "detectors": detectors})
    rays = int(how.forward_rays)
    batches = -(-rays // _core.batch_size())
    dealing = Dealing.of(compiled.record["sources"], rays)
    sums: list[CellSums] = []
    begun = None
    for first in range(0, batches, ROUND):
        last = min(first + ROUND, batches)
        harvest = _core.trace_batches(core, rays, how.seed, MOST_EVENTS, first, last, how.threads, begun)
        cells, begun = harvest["cells"], harvest["open_units"]
        sums = [added(*pair) for pair in zip(sums, cells, strict=True)] if sums else cells
    note = f"{rays:,} rays forwards, for light that smooth surfaces or beams send to diffuse ones"
    found = zip(sums, views, strict=True)
    return [Forward.of(s, (v["rows"], v["columns"]), dealing, rays, 1.0, note) for s, v in found]


class _Passes:
    """Mean and spread of independent passes, updated pass by pass (Welford): no difference of large numbers."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self.done = 0
        self.mean = np.zeros(shape)
        self._spread = np.zeros(shape)
        self._deviation = np.zeros(shape)

    def add(self, values: Array, deviation: Array) -> None:
        """One pass more: its mean luminances, and the deviation that sources state of theirs."""
        self.done += 1
        off = values - self.mean
        self.mean = self.mean + off / self.done
        self._spread = self._spread + off * (values - self.mean)
        self._deviation = self._deviation + (deviation - self._deviation) / self.done

    @property
    def sampling_error(self) -> Array:
        """Standard error of the mean, from the spread of the passes."""
        error: Array = np.sqrt(self._spread / ((self.done - 1) * self.done))
        return error

    @property
    def standard_error(self) -> Array:
        """With what the sources do not know of themselves."""
        return np.hypot(self.sampling_error, self._deviation)

    def relative_error(self) -> float:
        """Median of the sampling error over the value, of pixels with light; 0 if there are none."""
        lit = self.mean > 0.0
        return float(np.median(self.sampling_error[lit] / self.mean[lit])) if lit.any() else 0.0

    def wanted(self, until: float, most: int) -> int:
        """Passes that should be made to reach a relative error: as many as its fall with 1/√n asks for, twice at most."""
        error = self.relative_error()
        if error < until:
            return self.done
        return min(most, 2 * self.done, max(self.done + 1, math.ceil(1.1 * self.done * (error / until) ** 2)))

    @property
    def lit(self) -> bool:
        """Whether any line of sight met light."""
        return bool((self.mean > 0.0).any())

    def notes(self, until: float | None) -> list[str]:
        """How sure the map is."""
        lit = self.mean > 0.0
        if not lit.any():
            return ["no line of sight met light"]
        total = float(np.median(self.standard_error[lit] / self.mean[lit]))
        notes = [f"median relative standard error {total:.2%} of the pixels with light"]
        if until is not None and self.relative_error() >= until:
            notes.append(f"stopped before {until:.2%} was reached, at {MOST_TIMES} times rays_per_pixel")
        return notes


def with_fields(scene: Scene, threads: int | None = None, *, cache: bool = True) -> tuple[Scene, list[str]]:
    """The scene with a light field in the place of each ray set, which has no luminance that could be seen; and notes.

    Raises
    ------
    SceneError, ArgumentError, FormatError, OSError
        If rays cannot be read or fitted.
    """
    sources, notes = [], []
    for i, source in enumerate(scene.sources):
        if not isinstance(source, Rays | Gridded):
            sources.append(source)
            continue
        name = source.name or f"sources[{i}]"
        rays = source.as_rays(scene.files) if isinstance(source, Gridded) else source
        field, surface, share = _fitted(rays, scene, threads, cache=cache)
        sources.append(field)
        lost = f"; {share:.2%} of the flux does not come from it" if share > 1e-4 else ""
        notes.append(f"{name}: a light field on {surface} was fitted to its rays{lost}")
        notes += [f"{name}: {note}" for note in (rays.rays.notes if rays.rays is not None else ())]
    return scene.replace(sources=tuple(sources)), notes


def _fitted(source: Rays, scene: Scene, threads: int | None, *, cache: bool) -> tuple[Field, str, float]:
    """The light field of a ray source in its place, its carrier surface, and the share of the flux it does not hold."""
    rays = source.ray_stream(scene.files)
    unit = source.flux_unit if source.flux_unit is not None else rays.flux_unit
    (emitter,) = source.emitters(scene.files)
    field = fit_or_recall(rays, cache=cache, threads=threads)
    scale = emitter.record["flux"] / rays.total_flux
    place = {key: getattr(source, key) for key in Placement.model_fields}
    seen = Field(
        name=source.name,
        field=field.replace(flux_unit=unit),
        flux=field.total_flux * scale,
        wavelength=source.wavelength,
        spectrum=source.spectrum,
        **place,
    )
    return seen, field.surface.spec, 1.0 - field.total_flux / rays.total_flux


def _unseen(compiled: Compiled, *, forwards: bool) -> list[str]:
    """What the eye cannot see of the sources, though they shine."""
    names: dict[str, list[str]] = {"point": [], "beam": []}
    for name, source in zip(compiled.source_names, compiled.record["sources"], strict=True):
        if source["kind"] in names:
            names[source["kind"]].append(name)
    notes = []
    if names["point"]:
        notes.append(
            f"{', '.join(names['point'])}: a point has no finite luminance and is not seen itself"
            + ("" if forwards else "; what it lights through lenses and mirrors is seen with forward_rays only")
        )
    if names["beam"]:
        notes.append(
            f"{', '.join(names['beam'])}: parallel light is met by no line of sight and is not seen itself"
            + ("" if forwards else "; what it lights is seen with forward_rays only")
        )
    return notes
