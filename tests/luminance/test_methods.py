"""The methods hold their own options; `luminance_map` and the command line accept the same and refuse the same."""

from __future__ import annotations

import dataclasses
import itertools
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import etendue as et
import numpy as np
import pytest
import typer
from etendue.cli.app import app
from etendue.cli.luminance import _method as method_of_verb
from etendue.errors import ArgumentError, UnknownNameError
from etendue.luminance import estimate
from etendue.luminance.methods import METHODS, AnyMethod, option_names
from oracles.light_fields import make_field
from typer.testing import CliRunner

EYE = et.Observer(20, 30, 400)
SCREEN = et.Screen(70, 60, 7, 6)
VIEW = ("--observer", "20,30", "--distance", "400", "--target", "0,0,0", "--size", "70,60", "--pixels", "7,6")
DISK = et.Disk(radius=30)

LAMP = {
    "kind": "surface",
    "shape": {"kind": "disk", "radius": 3},
    "flux": 100,
    "at": [0, 9, 30],
    "toward": [0, -0.2, -1],
}
PAPER = {
    "name": "paper",
    "shape": {"kind": "rectangle", "width": 60, "height": 40},
    "finish": {"kind": "lambertian", "reflectance": 0.8},
}
WALL = {
    "name": "wall",
    "shape": {"kind": "rectangle", "width": 30, "height": 30},
    "at": [0, 25, 10],
    "toward": [0, -1, 0.3],
    "finish": {"kind": "lambertian", "reflectance": 0.7},
}
BALL = {"name": "ball", "shape": {"kind": "ball", "radius": 4}, "medium": "BK7", "at": [9, 0, 10]}
DETECTORS = [{"kind": "scatter", "name": "events"}]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One source of each kind, as files."""
    place = tmp_path_factory.mktemp("sources")
    rays = et.RingSource(rays=20_000, seed=4).ray_set()
    et.write_rays(place / "rays.tm25ray", rays)
    et.write_rays(place / "index.etd", rays)
    make_field(DISK).save(place / "field.h5")
    scene = et.Scene(sources=[LAMP], surfaces=[PAPER, WALL], solids=[BALL], detectors=DETECTORS)
    scene.save(place / "scene.toml")
    et.trace(scene, rays=4000, seed=2).save(place / "events.h5")
    return place


@pytest.fixture(autouse=True)
def fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """A field for whatever is fitted, which tells its surface: what fits find is tested elsewhere."""

    def fit(_rays: et.RaySet, surface: Any, **_how: Any) -> et.LightField:
        return make_field(DISK).replace(notes=(f"fitted on {surface}",))

    monkeypatch.setattr(estimate, "fit_or_recall", fit)
    # What a screen misses is told by rays that are drawn for each map, whatever the options.
    monkeypatch.setattr(estimate, "_with_missed", lambda _, maps, __=None: maps)


READERS: dict[str, Callable[[Path], Any]] = {
    "rays": lambda place: et.read_rays(place / "rays.tm25ray"),
    "index": lambda place: et.read_rays(place / "index.etd"),
    "field": lambda place: et.LightField.load(place / "field.h5"),
    "scene": lambda place: et.Scene.load(place / "scene.toml"),
    "events": lambda place: et.TraceResult.load(place / "events.h5").events["events"],
}
FILES = {
    "rays": "rays.tm25ray",
    "index": "index.etd",
    "field": "field.h5",
    "scene": "scene.toml",
    "events": "events.h5",
}

VALUES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "acceptance": (8.0, ("--acceptance", "8")),
    "observer_radius": (90.0, ("--observer-radius", "90")),
    "surface": (DISK, ("--surface", "disk:radius=30")),
    "samples": (4, ("--samples", "4")),
    "rays_per_pixel": (8, ("--rays-per-pixel", "8")),
    "until": (0.02, ("--until", "0.02")),
    "seed": (5, ("--seed", "5")),
    "forward_rays": (3000.0, ("--forward-rays", "3000")),
    "gather": (True, ("--gather",)),
}
"""A value of every option, in Python and on the command line."""

FAST = {"cone": (), "lightfield": (), "pathtracing": ("rays_per_pixel",)}
"""Options that are always stated, so that a map takes no time."""

TAKEN: dict[str, dict[str, tuple[str, ...]]] = {
    "rays": {"cone": ("acceptance", "observer_radius"), "lightfield": ("surface", "samples")},
    "index": {"cone": ("acceptance", "observer_radius"), "lightfield": ("surface", "samples")},
    "field": {"lightfield": ("samples",)},
    "scene": {"pathtracing": ("rays_per_pixel", "until", "seed", "forward_rays", "gather")},
    "events": {"pathtracing": ("rays_per_pixel", "until", "seed", "gather")},
}
"""What goes together: by source and method the options. Everything else is refused."""


def run(*arguments: Any) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def spelt(option: str) -> str:
    return f"--{option.replace('_', '-')}"


def same(one: et.LuminanceMap, other: et.LuminanceMap) -> bool:
    """Bit by bit, and the notes that tell how."""
    arrays = all(
        np.asarray(getattr(one, name)).tobytes() == np.asarray(getattr(other, name)).tobytes()
        for name in ("values", "standard_error", "rays")
    )
    return arrays and one.notes == other.notes and one.provenance.steps[-1] == other.provenance.steps[-1]


def combinations() -> list[tuple[str, str, str]]:
    """Source, method, option."""
    return [(s, m, o) for s, methods in TAKEN.items() for m, options in methods.items() for o in options]


def test_the_lists_of_this_test_are_whole() -> None:
    assert set(METHODS.values()) == set(get_args(AnyMethod))
    assert set(VALUES) == {name for kind in METHODS.values() for name in option_names(kind)}
    assert {m for methods in TAKEN.values() for m in methods} == set(METHODS)
    for kind in METHODS.values():
        assert getattr(et, kind.__name__) is kind


UNSUITED = " is for "
"""In messages about a method that does not take the source."""


@pytest.mark.slow
@pytest.mark.parametrize(("source", "method", "option"), combinations())
def test_every_option_gives_the_same_map_through_every_door(
    source: str, method: str, option: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As an option of an object, as a keyword with the shorthand and without it, and on the command line."""
    monkeypatch.chdir(tmp_path)
    light = READERS[source](folder)
    names = dict.fromkeys([*(n for n in FAST[method] if n in TAKEN[source][method]), option])
    options = {name: VALUES[name][0] for name in names}
    how = METHODS[method](**options)
    by_object = et.luminance_map(light, EYE, SCREEN, method=how)  # type: ignore[call-overload]
    assert np.nansum(by_object.values) > 0
    assert same(by_object, et.luminance_map(light, EYE, SCREEN, method=method, **options))  # type: ignore[call-overload]
    assert same(by_object, et.luminance_map(light, EYE, SCREEN, **options))  # type: ignore[call-overload]
    words = [word for name in names for word in VALUES[name][1]]
    for given in (("--method", method), ()):
        outcome = run("luminance", folder / FILES[source], *VIEW, *given, *words, "-o", "a.npz")
        assert outcome.exit_code == 0, outcome.output
        assert same(by_object, et.read_map(tmp_path / "a.npz"))


@pytest.mark.slow
@pytest.mark.parametrize(("source", "method", "option"), combinations())
def test_no_option_is_without_effect(source: str, method: str, option: str, folder: Path) -> None:
    light = READERS[source](folder)
    names = [n for n in FAST[method] if n in TAKEN[source][method] and n != option]
    options = {name: VALUES[name][0] for name in names}
    kept = {"rays_per_pixel": 4} if option == "rays_per_pixel" else {}
    without = METHODS[method](**options, **kept)
    assert not same(
        et.luminance_map(light, EYE, SCREEN, method=without),  # type: ignore[call-overload]
        et.luminance_map(light, EYE, SCREEN, method=dataclasses.replace(without, **{option: VALUES[option][0]})),  # type: ignore[call-overload]
    )


REFUSED = [
    (source, method, option)
    for source, method, option in itertools.product(TAKEN, ("auto", *METHODS), VALUES)
    if option
    not in (TAKEN[source].get(method, ()) if method != "auto" else {o for t in TAKEN[source].values() for o in t})
]


@pytest.mark.parametrize("source", TAKEN)
def test_every_wrong_combination_is_told(source: str, folder: Path) -> None:
    """As keywords, on the command line, and as the options of an object; nothing is computed."""
    light, told = READERS[source](folder), 0
    for _, method, option in (case for case in REFUSED if case[0] == source):
        value, words = VALUES[option]
        # Either the method is for other sources, or the option belongs to another method, or means nothing here.
        expected = UNSUITED if method not in ("auto", *TAKEN[source]) else option
        with pytest.raises(ArgumentError, match=expected) as caught:
            et.luminance_map(light, EYE, SCREEN, method=method, **{option: value})  # type: ignore[call-overload]
        owner = next(kind for kind in METHODS.values() if option in option_names(kind))
        if expected == option and owner.NAME not in TAKEN[source]:
            assert owner.__name__ in str(caught.value)
        # What the verb asks once it has read the file; one case of each source goes through the program below.
        with pytest.raises(typer.BadParameter, match="--method" if expected == UNSUITED else spelt(option)):
            method_of_verb(light, method, {option: value})
        told += 1
    assert told >= 8
    outcome = run("luminance", folder / FILES[source], *VIEW, "--method", method, *words, "-o", "a.npz")
    assert outcome.exit_code == 2
    assert ("--method" if expected == UNSUITED else spelt(option)) in outcome.output
    for kind in METHODS.values():
        if kind.NAME not in TAKEN[source]:
            with pytest.raises(ArgumentError, match=f"{kind.__name__} is for {kind.SOURCES}"):
                et.luminance_map(light, EYE, SCREEN, method=kind())  # type: ignore[call-overload]


def test_options_of_an_object_that_mean_nothing_for_the_source(folder: Path) -> None:
    field, events = READERS["field"](folder), READERS["events"](folder)
    with pytest.raises(ArgumentError, match="surface: a light field has its carrier surface already"):
        et.luminance_map(field, EYE, SCREEN, method=et.FromField(surface=DISK))
    with pytest.raises(ArgumentError, match="forward_rays: scatter events are rays traced forwards already"):
        et.luminance_map(events, EYE, SCREEN, method=et.PathTracing(forward_rays=100))


@pytest.mark.parametrize("kind", METHODS.values())
def test_an_object_and_an_option_beside_it(kind: type[Any]) -> None:
    rays = et.RingSource(rays=100)
    for option, (value, _) in VALUES.items():
        with pytest.raises(ArgumentError, match=option) as caught:
            et.luminance_map(rays, EYE, SCREEN, method=kind(), **{option: value})
        if kind.NAME in TAKEN["rays"]:
            own = option in option_names(kind)
            assert ("state it there" if own else f"{kind.__name__} has no such option") in str(caught.value)


@pytest.mark.parametrize("kind", METHODS.values())
def test_options_of_other_methods_and_misspelt_ones(kind: type[Any]) -> None:
    for option, (value, _) in VALUES.items():
        if option in option_names(kind):
            misspelt = option[:2] + option[3:]
            with pytest.raises(UnknownNameError, match=f"Did you mean '{option}'"):
                kind(**{misspelt: value})
        else:
            owner = next(other.__name__ for other in METHODS.values() if option in option_names(other))
            with pytest.raises(ArgumentError, match=f"{option}: {kind.__name__} has no such option; {owner} has it"):
                kind(**{option: value})


def test_misspelt_keywords_and_methods() -> None:
    rays: Any = et.RingSource(rays=100)
    with pytest.raises(UnknownNameError, match="Did you mean 'acceptance'"):
        et.luminance_map(rays, EYE, SCREEN, aceptance=3)  # type: ignore[call-overload]
    with pytest.raises(UnknownNameError, match="Did you mean 'samples'"):
        et.luminance_map(rays, EYE, SCREEN, sample=None)  # type: ignore[call-overload]
    with pytest.raises(UnknownNameError, match="Did you mean 'pathtracing'"):
        et.luminance_map(rays, EYE, SCREEN, method="path-tracing")  # type: ignore[call-overload]
    with pytest.raises(ArgumentError, match="the class Cone, not an object of it"):
        et.luminance_map(rays, EYE, SCREEN, method=et.Cone)  # type: ignore[call-overload]
    with pytest.raises(ArgumentError, match="method is 3; give Cone"):
        et.luminance_map(rays, EYE, SCREEN, method=3)  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        *((et.Cone, {"acceptance": bad}) for bad in (0.0, -1.0, 90.1, float("nan"), "wide", True)),
        *((et.Cone, {"observer_radius": bad}) for bad in (0.0, float("inf"), "wide", True)),
        *((et.FromField, {"samples": bad}) for bad in (0, 1 << 20, 2.5, True)),
        *((et.FromField, {"surface": bad}) for bad in ("plane", None, 3)),
        *((et.PathTracing, {"rays_per_pixel": bad}) for bad in (0, 1 << 30, 2.5, True)),
        *((et.PathTracing, {"until": bad}) for bad in (0.0, -1.0, float("nan"), "0.01", True)),
        *((et.PathTracing, {"seed": bad}) for bad in (-1, 1 << 64, 0.5, True)),
        *((et.PathTracing, {"forward_rays": bad}) for bad in (-1, 1 << 51, 2.5, "many", float("nan"), True)),
        *((et.PathTracing, {"gather": bad}) for bad in ("yes", 2, 0.0)),
    ],
)
def test_values_out_of_their_domain(make: Any, wrong: dict[str, Any]) -> None:
    (name,) = wrong
    with pytest.raises(ArgumentError, match=f"{name} is "):
        make(**wrong)


@pytest.mark.parametrize("method", [et.Cone(), et.FromField(surface=DISK), et.PathTracing(until=0.1)])
def test_methods_are_values(method: Any) -> None:
    assert pickle.loads(pickle.dumps(method)) == method  # noqa: S301 - our own
    assert len({method, dataclasses.replace(method)}) == 1
    assert repr(method).startswith(f"{type(method).__name__}(")
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(method, option_names(type(method))[0], 1)


def test_an_observer_of_the_scene_goes_by_his_name() -> None:
    """Alone, among others, or on another screen: the bits of the observer that the name stands for."""
    keys = {"theta": 20, "phi": 30, "distance": 400}
    eyes = [
        {"name": name, **keys, "roll": roll, "screen": {"width": 70, "height": 60, "columns": 7, "rows": 6}}
        for name, roll in (("first", 10), ("eye", 0))
    ]
    scene = et.Scene(sources=[LAMP], surfaces=[PAPER, WALL], observers=eyes)
    expected = et.luminance_map(scene, EYE, SCREEN, rays_per_pixel=4)
    assert same(et.luminance_map(scene, "eye", rays_per_pixel=4), expected)
    smaller = et.Screen(30, 30, 3, 3)
    assert same(
        et.luminance_map(scene, "eye", smaller, rays_per_pixel=4),
        et.luminance_map(scene, EYE, smaller, rays_per_pixel=4),
    )
    named, other, framed = et.luminance_map(scene, ["eye", "first", EYE], rays_per_pixel=4)
    assert same(named, expected)
    assert other.observer.roll == 10
    assert same(framed, et.luminance_map(scene, EYE, rays_per_pixel=4))
    with pytest.raises(UnknownNameError, match="Did you mean 'eye'"):
        et.luminance_map(scene, "eyes")


def test_what_is_no_source_observer_or_screen() -> None:
    rays: Any = et.RingSource(rays=100)
    scene: Any = et.Scene(sources=[LAMP])
    for source in (rays, scene):
        for nobody in ((30, 0), 30, "eye", [EYE, None], None):
            with pytest.raises(ArgumentError, match="observer"):
                et.luminance_map(source, nobody, SCREEN)
        for nowhere in ((30, 30), 30, "small"):
            with pytest.raises(ArgumentError, match="give a Screen"):
                et.luminance_map(source, EYE, nowhere)
    for nothing, called in (({"sources": []}, "dict"), (3, "int"), (None, "NoneType")):
        with pytest.raises(ArgumentError, match=f"a {called} is no source of light"):
            et.luminance_map(nothing, EYE, SCREEN)  # type: ignore[call-overload]


def test_without_options_each_source_has_its_method(folder: Path) -> None:
    ends = {
        "rays": "light field, 16 points",
        "index": "cone, acceptance 1.5",
        "field": "light field, 16 points",
        "scene": "256 lines of sight",
        "events": "scatter events",
    }
    for source, end in ends.items():
        assert end in et.luminance_map(READERS[source](folder), EYE, SCREEN).provenance.steps[-1]
