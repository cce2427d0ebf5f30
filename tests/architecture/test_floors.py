"""The plan of the house, read out of the source: imports go down, floors do not mix, and what is public is explained."""

from __future__ import annotations

import ast
import dataclasses
import functools
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue
import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "etendue"
CRATES = ROOT / "crates"


@functools.cache
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


@dataclasses.dataclass(frozen=True)
class Module:
    """A module of the package as its syntax tree."""

    name: str
    path: Path
    tree: ast.Module

    @functools.cached_property
    def calls(self) -> tuple[tuple[str, int], ...]:
        """What is called, as it is written, with the line."""
        calls = (node for node in ast.walk(self.tree) if isinstance(node, ast.Call))
        return tuple((ast.unparse(node.func), node.lineno) for node in calls)

    def names(self) -> Iterator[tuple[str, int]]:
        """Everything of the package that the module imports, as dotted names, with the line."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                yield from ((alias.name, node.lineno) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{self.path}:{node.lineno}: a relative import hides where it leads"
                yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


@pytest.fixture(scope="module")
def modules() -> tuple[Module, ...]:
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found.append(Module(name, path, ast.parse(path.read_text(), filename=str(path))))
    return tuple(found)


def is_within(name: str, place: str) -> bool:
    return name == place or name.startswith(f"{place}.")


# --- Python floors ---------------------------------------------------------------------------------------------------


@functools.cache
def layers() -> list[list[str]]:
    """The layers of the import contract, top first; the compiled core stands beside the lowest."""
    (contract,) = (c for c in project()["tool"]["importlinter"]["contracts"] if c["type"] == "layers")
    floors = [[part.strip() for part in layer.split("|")] for layer in contract["layers"]]
    floors[-1] = sorted({*floors[-1], "etendue._core"})
    return floors


@functools.cache
def place(name: str) -> tuple[int, str] | None:
    """Number of the floor (0 is the top) and part of it that a dotted name belongs to."""
    found = [(floor, part) for floor, parts in enumerate(layers()) for part in parts if is_within(name, part)]
    assert len(found) <= 1, f"{name} stands on several floors: {found}"
    return found[0] if found else None


def test_the_contract_is_the_plan() -> None:
    order = ["cli", "plot", "luminance", "formats", "quantities", "units"]
    floors = [place(f"etendue.{name}") for name in order]
    assert [floor for floor, _ in filter(None, floors)] == sorted({floor for floor, _ in filter(None, floors)})
    assert None not in floors


@pytest.mark.slow
def test_every_module_stands_on_one_floor(modules: tuple[Module, ...]) -> None:
    assert len(modules) > 20
    homeless = [m.name for m in modules if place(m.name) is None]
    assert homeless == ["etendue", "etendue.__main__"]  # the front doors, through which users come in at the top


@pytest.mark.slow
def test_imports_go_down_only(modules: tuple[Module, ...]) -> None:
    known = {m.name for m in modules} | {"etendue._core"}
    imports = 0
    for module in modules:
        here = place(module.name)
        if here is None:
            continue
        for name, line in module.names():
            if not is_within(name, "etendue"):
                continue
            target = max((k for k in known if is_within(name, k)), key=len)
            there = place(target)
            where = f"{module.path.relative_to(ROOT)}:{line}: {name}"
            assert there is not None, f"{where}: the front door is for users; import from the module itself"
            assert there[0] > here[0] or there == here, f"{where}: an import upwards or sideways"
            imports += 1
    assert imports > 100


@pytest.mark.slow
def test_only_the_command_line_prints(modules: tuple[Module, ...]) -> None:
    looked = 0
    for module in modules:
        if is_within(module.name, "etendue.cli"):
            continue
        looked += 1
        for called, line in module.calls:
            assert called != "print", f"{module.path}:{line}"
            assert not called.startswith(("sys.stdout", "sys.stderr")), f"{module.path}:{line}"
    assert looked > 20


@pytest.mark.slow
def test_no_memory_is_used_before_it_is_filled(modules: tuple[Module, ...]) -> None:
    banned = {f"{package}.{name}" for package in ("np", "numpy") for name in ("empty", "empty_like", "ndarray")}
    seen = 0
    for module in modules:
        assert not {"numpy.empty", "numpy.empty_like"} & {name for name, _ in module.names()}
        for called, line in module.calls:
            seen += called.startswith("np.")
            assert called not in banned, f"{module.path}:{line}: {called} is filled with what was there before"
    assert seen > 100


# --- words -----------------------------------------------------------------------------------------------------------

WITHOUT_EXAMPLE = {
    "etendue.cli": "a verb explains itself by --help, and docs/how-to.md runs it",
    "etendue.errors": "raised by the package, never called by users",
    "etendue.instruments.penalised_lobe.PenalisedLobe": "what penalised_lobe returns, shown in its example",
    "etendue.plot.colour_scale.ChosenScale": "what choose_scale returns, shown in its example",
    "etendue.plot.region_marks": "a step of plot_map",
    "etendue.plot.style": "how pictures are put together; plot_map, plot_comparison and plot_cross_sections are the door",
    "etendue.plot.map_picture": "likewise",
    "etendue.plot.labels.Label": "what LabelPlacer.place returns, shown in its example",
    "etendue.plot.scene_drawing": "a step of plot_layout",
    "etendue.plot.scene_layout.SceneLayout": "what lay_out_scene returns, shown in its example",
    "etendue.plot.scene_parts.Glow": "a part of a View",
    "etendue.plot.scene_parts.Part": "within shows one",
    "etendue.plot.scene_parts.View": "a part of a SceneLayout",
    "etendue.scatter.scans.interpolations": "tabulated shows how all are used",
    "etendue.scatter.models.rough.Rough": "what its kinds share; each has an example",
    "etendue.formats": "formats live on files: docs/how-to.md writes and reads them, the tests take them apart",
    "etendue.instruments.operators": "steps of deconvolve; tests/instruments/test_deconvolution.py shows them",
    "etendue.instruments.stopping": "rules that deconvolve names; tests/instruments/test_deconvolution.py shows them",
    "etendue.lightfield.etendue_density": "what LightField is made of, which shows it",
    "etendue.lightfield.selection.bounding": "a step of choose_surface",
    "etendue.lightfield.selection.scorer": "a step of choose_surface",
    "etendue.lightfield.selection.search.SurfaceChoice": "what choose_surface returns, shown in its example",
    "etendue.lightfield.selection.search.SurfaceScore": "a row of it",
    "etendue.lightfield.calibration": "how LightField.fit finds its error bars; docs/theory.md explains it",
    "etendue.lightfield.candidate": "how LightField.fit chooses a base measure; docs/theory.md explains it",
    "etendue.lightfield.characteristic.CharacteristicCurve": "a part of what diagnose returns",
    "etendue.lightfield.counting": "count_rays shows what the others hold",
    "etendue.lightfield.diagnostics": "diagnose shows what the others hold",
    "etendue.lightfield.fitting": "LightField.fit is the door",
    "etendue.lightfield.gridded.fitting": "GriddedSource.fit is the door",
    "etendue.lightfield.gridded.pixels.Cells": "likewise",
    "etendue.lightfield.gridded.pixels.Pixelation": "what its kinds share; each has an example",
    "etendue.lightfield.gridded.sampling": "GriddedSource.sample is the door",
    "etendue.lightfield.gridded.summing": "GriddedSource.intensity is the door",
    "etendue.lightfield.forecast": "diagnose is the door",
    "etendue.denoising": "smooth_counts shows what the others hold",
    "etendue.lightfield.storage": "LightField.save and load are the doors; docs/formats/light-fields.md reads a file",
    "etendue.lightfield.carrier.surface.Surface": "what its kinds share; each has an example",
    "etendue.lightfield.symmetry.proven_symmetry": "what LightField.fit does with symmetry='auto'",
    "etendue.lightfield.trees": "the optional Pólya tree over counts; docs/theory.md explains it",
    "etendue.formats.hdf5": "how files of light fields and of traces are written and read",
    "etendue.luminance.looking": "luminance_map is the door",
    "etendue.luminance.scatter_map": "luminance_map is the door",
    "etendue.luminance.caustics": "luminance_map is the door",
    "etendue.luminance.scene_map": "luminance_map is the door",
    "etendue.tracing.ledger.Entry": "Ledger shows it",
    "etendue.tracing.ledger.Loss": "a row of a Ledger",
    "etendue.tracing.ledger.TraceWarning": "raised by trace",
    "etendue.tracing.plan": "what trace makes of its arguments",
    "etendue.tracing.recorded": "how TraceResult makes quantities of sums; its properties are the door",
    "etendue.tracing.running.Rounds": "trace_rounds shows it",
    "etendue.tracing.scattered": "what TraceResult is made of",
    "etendue.tracing.storage": "TraceResult.save and load are the doors; docs/formats/trace-results.md reads a file",
    "etendue.tracing.sums": "what TraceResult is made of",
    "etendue.luminance.acceptance": "what luminance_map does with acceptance='auto'; its notes show the result",
    "etendue.luminance.cone": "what luminance_map does with method='cone'",
    "etendue.luminance.cone_map": "luminance_map is the door",
    "etendue.luminance.comparison.MapStatistics": "a part of what compare returns, shown in its example",
    "etendue.luminance.comparison.Comparison": "what compare returns, shown in its example",
    "etendue.luminance.comparison.CrossSection": "what cross_section returns, shown in its example",
    "etendue.luminance.framing": "how luminance_map finds screens; framed and centre_of_light show it",
    "etendue.luminance.filters.FilterKind": "a row of the registry of filter_map",
    "etendue.scene.scatter_events.geometry_of": "how ScatterEvents knows its scene",
    "etendue.scene.bodies.body.Body": "what its kinds share; each has an example",
    "etendue.description.keys.Description": "likewise",
    "etendue.scene.detectors.detector": "likewise",
    "etendue.scene.detectors.illuminance.GridIlluminance": "how TraceResult.illuminance is made",
    "etendue.scene.detectors.image.DiffuseLuminance": "how TraceResult.images is made",
    "etendue.scene.detectors.intensity.FarFieldIntensity": "how TraceResult.intensity is made",
    "etendue.scene.detectors.rays.IncidentRays": "how TraceResult.rays is made",
    "etendue.scene.detectors.scatter.ScatteredLight": "how TraceResult.events is made",
    "etendue.scatter.resampling": "BsdfTable is the door",
    "etendue.scatter.models.finish.Finish": "what its kinds share; each has an example",
    "etendue.scatter.models.lobes.Lobe": "likewise",
    "etendue.scatter.models.shares.Scattering": "likewise",
    "etendue.description.mistakes": "what messages are made of; docs/scenes.md shows one",
    "etendue.scene.shapes.conics.Mirror": "what its kinds share; each has an example",
    "etendue.scene.shapes.conics.Revolved": "likewise",
    "etendue.scene.shapes.flat.Flat": "likewise",
    "etendue.scene.shapes.round.Quadric": "likewise",
    "etendue.scene.shapes.shape.Shape": "likewise",
    "etendue.scene.sources.source.Source": "likewise",
    "etendue.luminance.gathering.survey_notes": "words about what the core found",
    "etendue.quantities.pixel_map": "LuminanceMap and IlluminanceMap show it",
    "etendue.quantities.observer.observer_from_dict": "for readers of files",
    "etendue.quantities.provenance.version": "the version, whatever it is",
    "etendue.quantities.ray_merge.merged": "RaySet.merge is the door",
    "etendue.quantities.ray_colours": "RaySet is the door; its methods have the examples",
    "etendue.quantities.ray_operations": "RaySet is the door; its methods have the examples",
    "etendue.quantities.ray_rewriting": "what the operations share",
    "etendue.quantities.ray_units": "RaySet is the door; its methods have the examples",
    "etendue.quantities.ray_operations.VirtualFocus": "what RaySet.virtual_focus returns",
    "etendue.quantities.ray_records": "RaySet shows it; RaySetMeaning is for readers of files",
    "etendue.quantities.ray_stream": "what ray sets and sources share; RaySet and RingSource show it",
    "etendue.quantities.report.RayFileWarning": "a category of warnings",
    "etendue.quantities.report.ChangedFileWarning": "a category of warnings",
    "etendue.luminance.methods.Method": "what Cone, FromField and PathTracing share, which show it",
    "etendue.luminance.source_kinds.SourceKind": "a row of a table; tests/luminance/test_methods.py shows it",
    "etendue.luminance.method_choice.Spelling": "how messages name options; tests/luminance/test_methods.py shows both",
    "etendue.quantities.hat_sums.HatSums": "what Hats.sums returns, shown in its example",
    "etendue.quantities.node_choice.Choice": "what choose_nodes returns",
    "etendue.tracing.far_fields.far_field_nodes": "a step of trace_rounds, which shows it",
    "etendue.instruments.near_field.storage": "NearFieldRun.save and load are the door; tests/instruments shows them",
    "etendue.viewer.field_tables.PartTables": "a part of FieldTables, which shows it",
    "etendue.viewer.opening.Exhibit": "what exhibit_of returns",
    "etendue.viewer.refining": "a thread; tests/viewer/test_server.py shows it",
    "etendue.viewer.server.ViewerServer": "a server; tests/viewer/test_server.py shows it",
    "etendue.viewer.subjects": "plain data for the page; exhibit_of is the door",
    "etendue.instruments.bench.Sight": "lines of sight, as Bench.sights yields them",
    "etendue.instruments.courses.course_of": "deconvolve is the door",
    "etendue.instruments.courses.halves_of": "likewise",
    "etendue.instruments.counted_scan": "what the ways of deconvolve_directions share",
    "etendue.instruments.directional_bands": "a step of deconvolve_directions, which shows it",
    "etendue.instruments.directional_operator": "likewise; its tests show it",
    "etendue.instruments.directional_scan.read_scan": "read_goniometer_scan or read_directional_scan, which show it",
    "etendue.instruments.goniometer_scan.known_of": "for readers of files",
    "etendue.scatter.lobe_models": "what deconvolve_directions fits; its tests show it",
    "etendue.instruments.lobe_splines": "what deconvolve_directions makes lobes of; its tests show it",
    "etendue.instruments.lobe_table.Lobe": "what bsdf_table takes",
    "etendue.instruments.lobe_table.polar_slice": "a step of bsdf_table, which shows it",
    "etendue.instruments.parametric_lobe": "a way of deconvolve_directions, which shows it",
    "etendue.instruments.regular_share": "a step of deconvolve_directions; its tests show it",
    "etendue.formats.input": "about files that change and pipes that wait; its tests show it",
}
"""Public things whose docstring may do without an example, with the reason."""


def public_things(modules: tuple[Module, ...]) -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef]]:
    for module in modules:
        for node in module.tree.body:
            if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
                continue
            if any(ast.unparse(decorator) == "overload" for decorator in node.decorator_list):
                continue
            yield f"{module.name}.{node.name}", node


@pytest.mark.slow
def test_everything_public_is_explained_and_shown(modules: tuple[Module, ...]) -> None:
    things = dict(public_things(modules))
    assert len(things) > 100
    shown, excused = set(), set()
    for name, node in things.items():
        text = ast.get_docstring(node)
        assert text, f"{name} has no docstring"
        if ">>>" in text:
            shown.add(name)
            continue
        reasons = {excuse for excuse in WITHOUT_EXAMPLE if is_within(name, excuse)}
        assert reasons, f"{name}: give an example in the docstring, or a reason here"
        excused |= reasons
    assert excused == set(WITHOUT_EXAMPLE), "an excuse that nobody needs any more"
    assert len(shown) > 25


def test_whatever_users_import_is_explained() -> None:
    for name in etendue.__all__:
        thing = getattr(etendue, name)
        assert (thing.__doc__ or "").strip(), name
        for member, value in vars(thing).items() if isinstance(thing, type) else ():
            if callable(value) and not member.startswith("_"):
                assert value.__doc__, f"{name}.{member}"
            if isinstance(value, property):
                assert value.__doc__, f"{name}.{member}"


# --- Rust floors -----------------------------------------------------------------------------------------------------

FLOORS = ("math", "sampling", "geometry", "lightfield", "optics", "trace", "bindings")
"""Lowest first. A crate may name crates of lower floors only."""


def crates() -> dict[str, dict[str, Any]]:
    return {path.parent.name: tomllib.loads(path.read_text()) for path in sorted(CRATES.glob("*/Cargo.toml"))}


def dependencies(manifest: dict[str, Any]) -> dict[str, Any]:
    kinds = ("dependencies", "dev-dependencies", "build-dependencies")
    tables = [manifest, *manifest.get("target", {}).values()]
    return {name: value for table in tables for kind in kinds for name, value in table.get(kind, {}).items()}


def test_every_crate_names_crates_of_lower_floors_only() -> None:
    assert len(crates()) >= 6
    assert set(crates()) <= set(FLOORS)
    named = 0
    for folder, manifest in crates().items():
        assert manifest["package"]["name"] == f"etendue-{folder}"
        for name in dependencies(manifest):
            if name.startswith("etendue-"):
                below = name.removeprefix("etendue-")
                assert FLOORS.index(below) < FLOORS.index(folder), f"{folder} names {below}"
                named += 1
    assert named >= 10


def test_only_the_bindings_know_python() -> None:
    for folder, manifest in crates().items():
        knows = {"pyo3", "numpy"} & set(dependencies(manifest))
        assert bool(knows) == (folder == "bindings"), f"{folder}: {knows}"


def test_every_crate_takes_the_lints_of_the_workspace() -> None:
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]
    assert workspace["lints"]["rust"]["unsafe_code"] in ("deny", "forbid")
    for folder, manifest in crates().items():
        assert manifest["lints"] == {"workspace": True}, folder


def without_comments(source: str) -> str:
    """Rust without comments and strings, as far as looking for a word needs it."""
    source = re.sub(r"//[^\n]*", "", source)
    source = re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
    return re.sub(r'"(?:\\.|[^"\\])*"', '""', source)


def test_no_crate_is_unsafe_prints_or_opens_files() -> None:
    # Examples are programs of their own, which report what they measured.
    sources = sorted(path for path in CRATES.rglob("*.rs") if "examples" not in path.parts)
    assert len(sources) > 10
    for path in sources:
        code = without_comments(path.read_text())
        words = [r"\bunsafe\b", r"\bunsafe_code\b", r"\be?println!", r"\bdbg!", r"\bstatic mut\b"]
        if path.name == "stored.rs":  # one of them opens files of rays, the other reads what is open
            assert re.search(r"\bstd::fs\b", code), path
        else:
            words.append(r"\bstd::fs\b")
        if path.parent.parent.name != "bindings":
            assert not re.search(r"\bFile::\w", code.partition("#[cfg(test)]")[0]), (
                f"{path.relative_to(ROOT)}: opens a file"
            )
        for word in words:
            assert not re.search(word, code), f"{path.relative_to(ROOT)}: {word}"


PARTS_OF_BSDFS = (
    "albedo",
    "drawn",
    "examples",
    "facet_lattice",
    "facets",
    "gauss",
    "monotone_cubic",
    "profile",
    "shares",
)
"""What several kinds of BSDF are made of."""


def test_every_kind_of_bsdf_is_in_the_list_of_their_tests() -> None:
    folder = CRATES / "optics" / "src" / "bsdf"
    found = [path.stem for path in folder.glob("*.rs")] + [path.parent.name for path in folder.glob("*/mod.rs")]
    kinds = {*found} - {"mod", "contract", "tests", *PARTS_OF_BSDFS}
    assert len(kinds) > 3
    assert set(re.findall(r'::named\("(\w+)"\)', (folder / "mod.rs").read_text())) == kinds


@pytest.mark.parametrize(
    "source", ["let x = 1; // unsafe\n", "/* unsafe\n unsafe */ fn f() {}", 'let s = "unsafe \\" x";']
)
def test_comments_and_strings_are_not_code(source: str) -> None:
    assert "unsafe" not in without_comments(source)
