"""One new member of each family that strangers add to: what it is, as new files and as lines in files that are there.

`ARCHITECTURE.md` says where a new member goes; this is what one finds who follows it. `counted` are the files that it takes;
pages of the documentation are told of it as well.
"""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Mapping
from pathlib import Path

from etendue import _core

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]

PARTS = ("python", "tests", "docs", "crates", "benchmarks", "examples")
FILES = (
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE",
    "README.md",
    "pyproject.toml",
    "references.bib",
    "rust-toolchain.toml",
    "rustfmt.toml",
)
"""What a copy of the tree needs."""


@dataclasses.dataclass(frozen=True)
class Insertion:
    """A text that goes into a file, behind another one that stands there once."""

    file: str
    behind: str
    text: str

    def apply(self, root: Path) -> None:
        path = root / self.file
        before = path.read_text(encoding="utf-8")
        assert before.count(self.behind) == 1, f"{self.file}: {self.behind!r} stands there {before.count(self.behind)}×"
        path.write_text(before.replace(self.behind, self.behind + self.text), encoding="utf-8")


@dataclasses.dataclass(frozen=True)
class Addition:
    """A new member of a family.

    `files`: new files, and where their text is; `insertions`: lines in files that are there; `pages`: the same in the
    documentation; `unasked`: tests of the tree that hold for the member without being told of it.
    """

    name: str
    files: Mapping[str, str]
    insertions: tuple[Insertion, ...]
    pages: tuple[Insertion, ...]
    unasked: tuple[str, ...]

    @property
    def counted(self) -> set[str]:
        """The files that are made or changed, those of the documentation apart."""
        return {*self.files, *(insertion.file for insertion in self.insertions)}

    def apply(self, root: Path) -> None:
        """Add the member to a copy of the tree."""
        for file, text in self.files.items():
            assert not (root / file).exists(), file
            shutil.copy(HERE / text, root / file)
        for insertion in (*self.insertions, *self.pages):
            insertion.apply(root)


BSDFS, DETECTORS, SCENE = "crates/optics/src/bsdf", "crates/trace/src/detector", "python/etendue/scene"
MODELS = "python/etendue/scatter/models"
FORMATS, VERBS, SCENES_PAGE = "python/etendue/formats/rays", "python/etendue/cli", "docs/scenes.md"

ADDITIONS: dict[str, Addition] = {
    "BSDF": Addition(
        "minnaert",
        {f"{BSDFS}/minnaert.rs": "minnaert.rs", f"{MODELS}/minnaert.py": "minnaert_finish.py"},
        (
            Insertion(f"{BSDFS}/mod.rs", "mod lobe;\n", "mod minnaert;\n"),
            Insertion(f"{BSDFS}/mod.rs", "pub use lobe::Lobe;\n", "pub use minnaert::Minnaert;\n"),
            Insertion(
                f"{BSDFS}/mod.rs",
                '            Lobe::named("lobe"),\n',
                '            Minnaert::named("minnaert"),\n',
            ),
            Insertion(
                f"{BSDFS}/mod.rs",
                '        "scatter" => Some(Mixture::described(by)),\n',
                '        "minnaert" => Some(Minnaert::described(by)),\n',
            ),
            Insertion(
                f"{MODELS}/__init__.py",
                "from etendue.scatter.models.lobes import ABg, CosinePower, Gaussian, HarveyShack\n",
                "from etendue.scatter.models.minnaert import Minnaert\n",
            ),
            Insertion(f"{MODELS}/__init__.py", '{**SIMPLE, "mixture": Mixture', ', "minnaert": Minnaert'),
        ),
        (
            Insertion(
                SCENES_PAGE,
                "| `transmitter` | `transmittance` | light goes straight on; between media of unlike index by Snell's law, "
                "with total reflection |\n",
                "| `minnaert` | `reflectance`, `exponent` | diffuse reflection, the weaker the more along the surface |\n",
            ),
        ),
        (
            "tests/scene/test_core.py::test_the_core_takes_every_finish[minnaert]",
            "tests/docs/test_docs.py::test_the_page_of_scenes_names_every_kind_and_every_key[Finishes]",
            "tests/architecture/test_floors.py::test_every_kind_of_bsdf_is_in_the_list_of_their_tests",
        ),
    ),
    "detector": Addition(
        "flux_meter",
        {f"{DETECTORS}/flux_meter.rs": "flux_meter.rs", f"{SCENE}/detectors/flux_meter.py": "flux_meter.py"},
        (
            Insertion(f"{DETECTORS}/mod.rs", "mod exitance;\n", "mod flux_meter;\n"),
            Insertion(f"{DETECTORS}/mod.rs", "pub use exitance::Exitance;\n", "pub use flux_meter::FluxMeter;\n"),
            Insertion(
                f"{DETECTORS}/mod.rs",
                '    Rays = "rays",\n',
                '    /// Flux of all rays that pass a face.\n    FluxMeter = "flux",\n',
            ),
            Insertion(
                f"{SCENE}/detectors/__init__.py",
                "from etendue.scene.detectors.detector import Detection, Detector\n",
                "from etendue.scene.detectors.flux_meter import FluxMeter\n",
            ),
            Insertion(f"{SCENE}/detectors/__init__.py", "for cls in (RayCollector,", " FluxMeter,"),
        ),
        (
            Insertion(
                SCENES_PAGE,
                "| `rays` | `shape`, `trim` | every ray that passes the surface: a ray collecting surface (thesis section "
                "2.2.1) |\n",
                "| `flux` | `shape`, `trim` | the flux of all light that passes the surface |\n",
            ),
        ),
        (
            "tests/scene/test_core.py::test_every_detector_measures_and_is_kept[flux]",
            "tests/docs/test_docs.py::test_the_page_of_scenes_names_every_kind_and_every_key[Detectors]",
            "tests/architecture/test_floors.py::test_everything_public_is_explained_and_shown",
        ),
    ),
    "source": Addition(
        "tube",
        {f"{SCENE}/sources/tube.py": "tube.py"},
        (
            Insertion(
                f"{SCENE}/sources/__init__.py",
                "from etendue.scene.sources.surfaces import Beam, Rings, Surface\n",
                "from etendue.scene.sources.tube import Tube\n",
            ),
            Insertion(f"{SCENE}/sources/__init__.py", "Rings, Point, Beam", ", Tube"),
        ),
        (
            Insertion(
                SCENES_PAGE,
                "| `rings` | `radii`, `flux`, `flux_unit` | concentric Lambertian rings in z = 0 towards +z, as in thesis "
                "section 2.3; one flux for each ring |\n",
                "| `tube` | `diameter`, `length`, `flux`, `flux_unit` | the side of a fluorescent lamp |\n",
            ),
            Insertion(
                "ARCHITECTURE.md",
                "| `etendue.scene.sources.surfaces` | luminous surfaces, rings, beams |\n",
                "| `etendue.scene.sources.tube` | tubes that shine all around |\n",
            ),
        ),
        (
            "tests/scene/test_core.py::test_the_core_takes_every_source_with_its_flux[tube]",
            "tests/docs/test_docs.py::test_the_page_of_scenes_names_every_kind_and_every_key[Sources]",
            "tests/docs/test_docs.py::test_architecture_names_every_crate_and_module",
        ),
    ),
    "ray format": Addition(
        "plain_text",
        {f"{FORMATS}/plain_text.py": "plain_text.py"},
        (
            Insertion(f"{FORMATS}/__init__.py", "    lighttools_text,\n", "    plain_text,\n"),
            Insertion(f"{FORMATS}/__init__.py", "    lighttools_text.FORMAT,\n", "    plain_text.FORMAT,\n"),
        ),
        (
            Insertion(
                "docs/formats/ray-files.md",
                "| `csv` | ray table | `.csv` | absolute | lm or W |\n",
                "| `plain-text` | plain text | `.rays` | absolute | lm or W |\n",
            ),
        ),
        (
            "tests/formats/test_ray_formats.py::test_the_registry_is_complete",
            "tests/formats/test_ray_formats.py::test_round_trip[plain-text]",
            "tests/formats/test_ray_formats.py::test_written_by_one_and_read_through_another[plain-text-tm25]",
            "tests/formats/test_ray_formats.py::test_recognised_by_content_and_by_no_other_format[.ray-plain-text]",
            "tests/formats/test_ray_formats.py::test_cut_at_every_byte[plain-text]",
            "tests/formats/test_ray_formats.py::test_damaged_bytes[plain-text]",
            "tests/formats/test_planted_numbers.py::test_no_planted_number_becomes_a_ray[plain-text]",
            "tests/docs/test_docs.py::test_the_page_of_ray_files_lists_every_format_with_its_extensions",
        ),
    ),
    "verb": Addition(
        "peak",
        {f"{VERBS}/peak.py": "peak.py"},
        (
            Insertion(
                f"{VERBS}/verbs.py",
                '    "cache": "etendue.cli.cache:cache",\n',
                '    "peak": "etendue.cli.peak:peak",\n',
            ),
            Insertion(
                "tests/cli/test_cli_notes.py",
                '    yield Case(("demo", "--rays", 100_000, "-o", "out.png"), lmap.notes)\n',
                """

def peak(place: Path) -> Iterator[Case]:
    yield Case(("peak", place / "map.npz"), et.read_map(place / "map.npz").notes)
""",
            ),
            Insertion("tests/cli/test_cli_notes.py", '    "compare": compare,\n', '    "peak": peak,\n'),
        ),
        (
            Insertion(
                "docs/how-to.md",
                "$ etendue compare smooth.npz reference.npz --region=-0.4,0.4,-0.3,0.3 -o difference.png\n",
                "$ etendue peak smooth.npz\n",
            ),
        ),
        (
            "tests/cli/test_cli_notes.py::test_every_verb_is_here",
            "tests/cli/test_cli_notes.py::test_what_python_knows_is_printed[peak]",
            "tests/docs/test_docs.py::test_every_verb_is_run_by_a_page",
        ),
    ),
}
"""By the family, as `ARCHITECTURE.md` calls it."""


def copy_tree(root: Path) -> Path:
    """The parts of the tree that programs and tests need, in a new folder."""
    # What Python has compiled stays valid: copies keep the times of files.
    unwanted = shutil.ignore_patterns(".*_cache", "target")
    for part in PARTS:
        shutil.copytree(ROOT / part, root / part, ignore=unwanted)
    for file in FILES:
        shutil.copy(ROOT / file, root / file)
    # The built core stands in the tree only where it was built for development.
    core = Path(_core.__file__)
    shutil.copy(core, root / "python" / "etendue" / core.name)
    return root
