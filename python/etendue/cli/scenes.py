"""What stands in a scene, as ``etendue info`` tells it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from etendue.cli.terminal import say
from etendue.quantities.powers_of_ten import counted
from etendue.scene import Compiled, Scene

MOST_NAMED = 12
"""Things of a kind that are listed for people; the JSON has all."""


def describe_scene(scene: Scene, compiled: Compiled) -> dict[str, Any]:
    """Sources with their flux [`flux_unit`], solids, surfaces, detectors and observers with what they are, as plain data.

    Sources go by the names of the ledger: each ring of a source of rings is one.
    """
    kinds = {_name("sources", i, source): _kind(source) for i, source in enumerate(scene.sources)}
    sources = [
        {"name": name, "kind": kinds.get(name) or kinds[name.rpartition(".")[0]], "flux": record["flux"]}
        for name, record in zip(compiled.source_names, compiled.record["sources"], strict=True)
    ]
    return {
        "scene": scene.name,
        "flux_unit": compiled.flux_unit,
        "flux": sum(source["flux"] for source in sources),
        "sources": sources,
        "solids": [
            {"name": _name("solids", i, solid), "kind": _kind(solid.shape), "medium": _called(solid.medium)}
            for i, solid in enumerate(scene.solids)
        ],
        "surfaces": [
            {"name": _name("surfaces", i, surface), "kind": _kind(surface.shape), "finish": _called(surface.finish)}
            for i, surface in enumerate(scene.surfaces)
        ],
        "detectors": [
            {"name": name, "kind": _kind(detector)}
            for name, detector in zip(compiled.detector_names, scene.detectors, strict=True)
        ],
        "observers": [
            {
                "name": _name("observers", i, observer),
                "theta": observer.theta,
                "phi": observer.phi,
                "distance": observer.distance,
                "pixels": [observer.screen.columns, observer.screen.rows],
            }
            for i, observer in enumerate(scene.observers)
        ],
        "files": [str(path) for path in scene.read_files()],
        "notes": list(compiled.notes),
    }


def print_scene(facts: dict[str, Any], doubts: tuple[str, ...]) -> None:
    """The same for people; of the notes, those that were no warnings."""
    unit = facts["flux_unit"]
    if facts["sources"]:
        say(f"  {'flux':<10} {counted(facts['flux'], unit)}")
    _list("sources", (f"{s['name']} ({s['kind']}, {counted(s['flux'], unit)})" for s in facts["sources"]), facts)
    _list("solids", (f"{s['name']} ({s['kind']}, {s['medium'] or 'opaque'})" for s in facts["solids"]), facts)
    _list("surfaces", (f"{s['name']} ({s['kind']}, {s['finish']})" for s in facts["surfaces"]), facts)
    _list("detectors", (f"{d['name']} ({d['kind']})" for d in facts["detectors"]), facts)
    _list("observers", (_standing(observer) for observer in facts["observers"]), facts)
    _list("files", iter(facts["files"]), facts)
    for note in facts["notes"]:
        if note not in doubts:
            say(f"  {note}")


def _standing(observer: dict[str, Any]) -> str:
    """Where an observer stands, and his pixels."""
    columns, rows = observer["pixels"]
    where = f"θ {observer['theta']:g}°, φ {observer['phi']:g}°, {observer['distance']:g} mm"
    return f"{observer['name']} ({where}, {columns} × {rows} pixels)"


def _list(what: str, told: Iterator[str], facts: dict[str, Any]) -> None:
    """The first things of a kind, a line each, and how many more there are."""
    for number, line in zip(range(MOST_NAMED), told, strict=False):
        say(f"  {what if number == 0 else '':<10} {line}")
    more = len(facts[what]) - MOST_NAMED
    if more > 0:
        say(f"  {'':<10} and {more:,} more")


def _name(family: str, number: int, thing: Any) -> str:
    return thing.name or f"{family}[{number}]"


def _kind(thing: Any) -> str:
    """The key ``kind`` of a thing: every member of a family has one."""
    return str(thing.kind)


def _called(given: Any) -> str | None:
    """The name of a medium or a finish; of one that is described, its kind."""
    return given if given is None or isinstance(given, str) else str(getattr(given, "kind", "described"))
