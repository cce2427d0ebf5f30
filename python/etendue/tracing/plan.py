"""What is to be traced: a scene with its names, how many rays, and a fingerprint that tells it from others."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from etendue import _core
from etendue.description.values import is_number
from etendue.errors import ArgumentError, SceneError
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.intensity_nodes import MOST_CELLS, Nodes
from etendue.quantities.node_choice import Choice
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import checked_seed
from etendue.scene import Compiled, Scene
from etendue.scene.dealing import Dealing
from etendue.scene.detectors.detector import Detection, Setting
from etendue.scene.detectors.intensity import FarFieldIntensity
from etendue.scene.scatter_events import geometry_of
from etendue.units import FluxUnit

DEFAULT_RAYS = 10**7
MOST_RAYS = 1 << 50
MOST_EVENTS = 10**9

NAMED = 3
"""Sources that a note names."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """What a trace is a trace of. Two traces with equal plans have the same bits.

    Parameters
    ----------
    scene_name : str
    scene_text : str
        The scene as TOML; empty if parts of it live in memory only.
    fingerprint : str
        SHA-256 of the scene as the tracer takes it, files included (of ray sets, the rays at both ends).
    rays, seed, most_events : int
    flux_unit : {"lm", "W"}
    dealing : Dealing
        Which source gives out which ray.
    source_names, face_names, medium_names, loss_names : tuple of str
        Of the rows of the ledger.
    detections : tuple of Detection
    notes : tuple of str
        What the user should know.
    scene : Scene or None
        What is traced; None if it is known by its text only.
    """

    scene_name: str
    scene_text: str
    fingerprint: str
    rays: int
    seed: int
    most_events: int
    flux_unit: FluxUnit
    dealing: Dealing
    source_names: tuple[str, ...]
    face_names: tuple[str, ...]
    medium_names: tuple[str, ...]
    loss_names: tuple[str, ...]
    detections: tuple[Detection[Any], ...]
    notes: tuple[str, ...] = ()
    scene: Scene | None = dataclasses.field(default=None, compare=False, repr=False)

    @property
    def provenance(self) -> Provenance:
        """Origin of what the trace finds."""
        step = f"traced with {self.rays:,} rays, seed {self.seed}, at most {self.most_events:,} surfaces met by each"
        return Provenance(self.scene_name or "scene", "traced scene", self.fingerprint, (step,))

    @property
    def far_fields(self) -> tuple[Nodes, ...]:
        """The nodes of each far field."""
        return tuple(detection.nodes for detection in self.detections if isinstance(detection, FarFieldIntensity))

    def check_same(self, other: Plan) -> None:
        """Refuse to go on with a trace of something else.

        Raises
        ------
        ArgumentError
            If so; says what differs.
        """
        differences = [
            f"{what} is {getattr(other, name)!r} there and {getattr(self, name)!r} here"
            for name, what in (("rays", "the number of rays"), ("seed", "the seed"), ("most_events", "most_events"))
            if getattr(self, name) != getattr(other, name)
        ]
        if self.fingerprint != other.fingerprint:
            differences.append("the scene, or a file that it names, is another one")
        if differences:
            raise ArgumentError(f"this result cannot be continued: {'; '.join(differences)}.")


LookAround = Callable[[int], Iterable[Choice]]
"""From a number of rays to the nodes of each far field, in the order of the detectors."""


def make_plan(
    scene: Scene,
    compiled: Compiled,
    rays: float | None,
    seed: int,
    most_events: int,
    look_around: LookAround,
    before: Plan | None = None,
) -> Plan:
    """The plan of a trace.

    Parameters
    ----------
    scene, compiled
        What is traced.
    rays, seed, most_events
        As of `etendue.trace`.
    look_around : callable
        Chooses the nodes of far fields, if there are any.
    before : Plan, optional
        Of a trace that shall be gone on with: if it is one of the same scene, far fields keep their nodes.

    Raises
    ------
    ArgumentError
        If a number is out of its range, or the detectors have too many cells.
    """
    if not compiled.record["sources"]:
        raise ArgumentError(f"{scene.called}: there is no source, and nothing to trace; add one under [[sources]].")
    count, notes = _rays(compiled, rays)
    seed = checked_seed(seed)
    if isinstance(most_events, bool) or not (isinstance(most_events, int) and 1 <= most_events <= MOST_EVENTS):
        raise ArgumentError(f"most_events is {most_events!r}; give a whole number from 1 to {MOST_EVENTS:,}.")
    mark = fingerprint(compiled.record)
    choices: Iterable[Choice] = ()
    if before is not None and before.fingerprint == mark:
        choices = [Choice(d.nodes, d.told) for d in before.detections if isinstance(d, FarFieldIntensity)]
    elif any(record["kind"] == "intensity" for record in compiled.record["detectors"]):
        choices = look_around(count)
    observers = {observer.name: observer for observer in scene.observers}
    setting = Setting(observers, iter(choices), lambda: geometry_of(compiled))
    named = zip(_unique(compiled.detector_names), scene.detectors, strict=True)
    detections = tuple(detector.detection(name, setting) for name, detector in named)
    check_cells(detections)
    # The faces of detectors stand behind those of the scene.
    detector_faces = [detection.name for detection in detections if detection.HAS_FACE]
    dealing, source_names = Dealing.of(compiled.record["sources"], count), _unique(compiled.source_names)
    return Plan(
        scene.name,
        _text(scene),
        mark,
        count,
        seed,
        most_events,
        compiled.flux_unit,
        dealing,
        source_names,
        _unique([*compiled.face_names, *detector_faces]),
        _unique(compiled.medium_names),
        tuple(_core.losses()),
        detections,
        (*compiled.notes, *notes, *_left_out(dealing, source_names, compiled.flux_unit)),
        scene,
    )


def _rays(compiled: Compiled, rays: float | None) -> tuple[int, list[str]]:
    """Number of rays, and what is to be said about them."""
    sets = [source["rays"] for source in compiled.record["sources"] if source["kind"] == "rays"]
    notes: list[str] = []
    if rays is None:
        alone = len(sets) == len(compiled.record["sources"])
        count = sum(map(len, sets)) if alone else DEFAULT_RAYS
        if alone and len(sets) > 1:
            notes.append(
                f"{len(sets)} ray sets share {count:,} rays by their flux: each is gone through evenly, its rays used more "
                "or less than once"
            )
    elif not (is_number(rays) and 1 <= rays <= MOST_RAYS and int(rays) == rays):
        raise ArgumentError(f"rays is {rays!r}; give a whole number from 1 to {MOST_RAYS:,}.")
    else:
        count = int(rays)
    return count, notes


def _left_out(dealing: Dealing, names: tuple[str, ...], unit: FluxUnit) -> Iterator[str]:
    """Sources so faint beside the others that none of the rays is theirs."""
    faint = [(name, flux) for name, flux, rays in zip(names, dealing.flux, dealing.given, strict=True) if not rays]
    if faint:
        first = ", ".join(name for name, _ in faint[:NAMED]) + (
            f" and {len(faint) - NAMED:,} more" if faint[NAMED:] else ""
        )
        lost, total = (counted(math.fsum(of), unit) for of in ((flux for _, flux in faint), dealing.flux))
        yield (
            f"{first}: none of {dealing.rays:,} rays, which are shared out by flux; {lost} of {total} are missing from the "
            "result: trace more rays, or what is faint by itself"
        )


def _text(scene: Scene) -> str:
    try:
        return scene.to_toml()
    except SceneError:
        return ""


def _unique(names: Iterable[str]) -> tuple[str, ...]:
    """Names of rows, of which no two are the same."""
    taken: dict[str, int] = {}
    result = []
    for name in names:
        taken[name] = taken.get(name, 0) + 1
        result.append(name if taken[name] == 1 else f"{name} ({taken[name]})")
    return tuple(result)


def check_cells(detections: tuple[Detection[Any], ...]) -> None:
    """Refuse detectors with more cells than memory is meant for.

    Raises
    ------
    ArgumentError
        If so.
    """
    total = sum(detection.judged for detection in detections)
    if total > MOST_CELLS:
        raise ArgumentError(f"the detectors have {total:,} cells together; {MOST_CELLS:,} are the most. Use fewer.")
