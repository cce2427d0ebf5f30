"""From a scene to the one record that the tracer takes: names become numbers, files are opened, angles become radians."""

from __future__ import annotations

import contextlib
import dataclasses
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.description.files import no_such_file
from etendue.description.mistakes import join
from etendue.errors import EtendueError, SceneError, SceneWarning, UnknownNameError
from etendue.quantities.arguments import SCENE, require
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.spectrum import photopic_efficiency
from etendue.scatter.members import same_when_turned
from etendue.scene.bodies.body import Body
from etendue.scene.colour_dependence import VISIBLE, telling_absorption, telling_finishes, telling_media, told_beyond
from etendue.scene.face_rows import BodyFaces, FaceGathering, FaceRows
from etendue.scene.finishes import BUILT_IN, Finish, Interface
from etendue.scene.media import Medium
from etendue.scene.media_library import MEDIA
from etendue.scene.overlaps import Kind, doubts_about
from etendue.scene.scene import Scene
from etendue.scene.shapes.shape import WHOLE
from etendue.scene.stated_transmission import unrefracted
from etendue.scene.things import Solid, Surface
from etendue.units import FluxUnit

Record = dict[str, Any]
Axis = tuple[float, float, float] | None
"""Where the x axis of a sample points, if that matters."""


@dataclasses.dataclass(frozen=True, eq=False)
class Compiled:
    """A scene as the tracer takes it, and the names of what it counts.

    Parameters
    ----------
    record : mapping
        ``media``, ``finishes``, ``solids``, ``faces``, ``sources``, ``detectors``: rows of plain values and arrays; those
        of the faces are `etendue.scene.face_rows.FaceRows`. Lengths are in mm, angles in radians, wavelengths in nm.
    medium_names, finish_names, solid_names, face_names, source_names, detector_names : tuple of str
        One for each entry of the rows, in their order. What has no name is called by its place, as ``solids[0]``.
    flux_unit : {"lm", "W"}
        Of all sources.
    notes : tuple of str
        What the user should know.
    doubts : tuple of str
        Those of the notes that make one doubt that the scene is what was meant; each was a `SceneWarning`.

    Examples
    --------
    >>> ball = {"shape": {"kind": "ball", "radius": 1}, "medium": "BK7"}
    >>> compile_scene(Scene(solids=[ball])).face_names
    ('solids[0].surface',)
    """

    record: Record
    medium_names: tuple[str, ...]
    finish_names: tuple[str, ...]
    solid_names: tuple[str, ...]
    face_names: tuple[str, ...]
    source_names: tuple[str, ...]
    detector_names: tuple[str, ...]
    flux_unit: FluxUnit
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()


def compile_scene(scene: Scene) -> Compiled:
    """The record of a scene.

    Parameters
    ----------
    scene : Scene
        With the folder of its files.

    Raises
    ------
    SceneError
        With every mistake: a name that stands for nothing, a solid without a medium, a file that is missing or damaged,
        units of flux that do not agree, a medium without an index at a wavelength of the sources.

    Warns
    -----
    SceneWarning
        Of what is probably not meant, which is in the notes as well: solids that are open, overlap or lie in later ones,
        sources that start partly in a solid, or in one that no light leaves.

    Examples
    --------
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}
    >>> compiled = compile_scene(Scene(sources=[disk]))
    >>> compiled.record["sources"][0]["wavelengths"].tolist(), compiled.flux_unit
    ([555.0], 'lm')
    """
    require(scene, Scene, "compile_scene: scene", SCENE)
    return _Compiler(scene).compiled()


@dataclasses.dataclass(frozen=True, eq=False)
class _Dressed:
    """What a body has by its finishes, wherever it stands and whatever it is called."""

    finishes: list[int]
    """Number of that of each face."""
    axes: list[tuple[tuple[float, float, float], npt.NDArray[np.int64]]]
    """Axes of finishes, and the faces that have them."""
    lets_in: bool
    """Whether light enters by any face."""
    notes: list[str]


class _Compiler:
    """The rows under construction, and the mistakes found so far."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.files = scene.files
        self.mistakes: list[tuple[str, str]] = []
        self.notes: list[str] = []
        self.doubts: list[str] = []
        self.rows: dict[str, list[Record]] = {
            key: [] for key in ("media", "finishes", "solids", "sources", "detectors")
        }
        self.faces = FaceGathering()
        self.names: dict[str, list[str]] = {key: [] for key in (*self.rows, "faces")}
        self.media: list[tuple[str, str, Medium]] = []
        self.numbers: dict[tuple[str, str], int] = {}
        self.kinds: list[Kind] = []
        self.sets: list[Any] = []
        self.used: list[npt.NDArray[np.float64]] = []
        self.means: dict[str, npt.NDArray[np.float64]] = {}
        self.colourless: list[str] = []
        self.bodies: dict[Body, BodyFaces] = {}
        self.dressed: dict[tuple[object, ...], _Dressed] = {}
        self.named_finishes: dict[str, tuple[int, bool, Axis]] = {}
        self.letting_in: set[tuple[str, str]] = set()
        self.axes: dict[tuple[str, str], Axis] = {}

    def compiled(self) -> Compiled:
        """Everything, or all mistakes."""
        count, most = len(self.scene.solids), _core.most_solids()
        if count > most:
            text = (
                f"there are {count:,} of them, and {most:,} are the most; join those of one medium and finish that do not "
                "touch to the shells of one mesh, which may be any number"
            )
            raise SceneError(self.scene.called, [("solids", text)])
        unit = self._sources()
        self._medium("surroundings", "surroundings", self.scene.surroundings)
        for i, solid in enumerate(self.scene.solids):
            self._solid(_place("solids", i, solid.name), solid.name or f"solids[{i}]", solid)
        for i, surface in enumerate(self.scene.surfaces):
            self._surface(_place("surfaces", i, surface.name), surface.name or f"surfaces[{i}]", surface)
        self._detectors()
        self._check_indices()
        self._check_colours()
        self._check_far_fields()
        if self.mistakes:
            raise SceneError(self.scene.called, self.mistakes)
        record = {**self.rows, "faces": self.faces.rows()}
        for doubt in doubts_about(record, self.kinds, self.names["sources"]):
            self._doubt(doubt, 4)
        self.notes += unrefracted(
            record, [kind.name for kind in self.kinds], self.names["finishes"], self._wavelengths()
        )
        names = {key: tuple(held) for key, held in self.names.items()}
        return Compiled(
            record,
            names["media"],
            names["finishes"],
            names["solids"],
            names["faces"],
            names["sources"],
            names["detectors"],
            unit,
            tuple(dict.fromkeys(self.notes)),
            tuple(dict.fromkeys(self.doubts)),
        )

    def _doubt(self, text: str, stacklevel: int) -> None:
        """Tell what is probably not meant."""
        warnings.warn(text, SceneWarning, stacklevel=stacklevel)
        self.notes.append(text)
        self.doubts.append(text)

    @contextlib.contextmanager
    def _at(self, place: str) -> Iterator[None]:
        """What goes wrong here is a mistake at this place, and the rest is looked at all the same."""
        try:
            yield
        except SceneError as error:
            self.mistakes += [(join(place, inner), text) for inner, text in error.mistakes]
        except EtendueError as error:
            self.mistakes.append((place, str(error)))
        except FileNotFoundError as error:
            self.mistakes.append((place, no_such_file(error.filename)))
        except OSError as error:
            self.mistakes.append((place, f"{error.filename} cannot be read: {error.strerror}"))

    # --- media and finishes --------------------------------------------------------------------------------------------

    def _medium(self, place: str, owner: str, given: Medium | str) -> int:
        """Number of a medium, which is written down when it is first met."""
        if isinstance(given, str):
            key, name, stated_at = ("media", given), given, f"media.{given}" if given in self.scene.media else place
            medium = self.scene.media.get(given) or (MEDIA[given].medium if given in MEDIA else None)
            if medium is None:
                self.mistakes.append((place, str(UnknownNameError("medium", given, [*self.scene.media, *MEDIA]))))
                return 0
        else:
            # Known by its place: a name made of the owner's may be that of another one.
            key, name, medium, stated_at = ("medium at", place), f"{owner}.medium", given, place
        if key not in self.numbers:
            self.numbers[key] = len(self.rows["media"])
            with self._at(stated_at):
                self.rows["media"].append(medium.record(self.files))
                self.names["media"].append(name)
                self.media.append((place, name, medium))
        return self.numbers[key]

    def _finish(self, place: str, owner: str, given: Finish | str) -> tuple[int, bool, Axis]:
        """Number of a finish, written down when it is first met; whether it lets light in; its axis, if it has one."""
        if isinstance(given, str):
            if given in self.named_finishes:
                return self.named_finishes[given]
            key, name, stated_at = (
                ("finishes", given),
                given,
                f"finishes.{given}" if given in self.scene.finishes else place,
            )
            finish = self.scene.finishes.get(given) or BUILT_IN.get(given)
            if finish is None:
                known = [*self.scene.finishes, *BUILT_IN]
                self.mistakes.append((place, str(UnknownNameError("finish", given, known))))
                return 0, False, None
        else:
            key, name, finish, stated_at = ("finish at", place), f"{owner}.finish", given, place
        if key not in self.numbers:
            self.numbers[key] = len(self.rows["finishes"])
            with self._at(stated_at):
                record = finish.record(self.files)
                self.rows["finishes"].append(record)
                # An axis that changes nothing would cost time at each surface that a ray meets.
                if not same_when_turned(record):
                    self.axes[key] = getattr(finish, "axis", None)
                self.names["finishes"].append(name)
                if finish.lets_light_in(self.files):
                    self.letting_in.add(key)
        # Of a finish whose file cannot be read nothing more is asked: that would be the same mistake again.
        found = self.numbers[key], key in self.letting_in, self.axes.get(key)
        if isinstance(given, str):
            self.named_finishes[given] = found
        return found

    def _wavelengths(self) -> npt.NDArray[np.float64]:
        """Those of the sources [nm]; that of the scene if there are none."""
        return np.unique(np.concatenate(self.used)) if self.used else np.array([self.scene.wavelength])

    def _check_indices(self) -> None:
        """Every medium has an index at every wavelength of the sources; a library's range is a note."""
        wavelength = self._wavelengths()
        for place, name, medium in self.media:
            with self._at(place):
                index = medium.index_at(wavelength, self.files)
                bad = ~(np.isfinite(index) & (index >= 1.0) & (index <= 10.0))
                if bad.any():
                    at = wavelength[bad][0]
                    n = index[bad][0]
                    text = f"the refractive index of {name!r} is {n:.4g} at {at:g} nm; it must lie between 1 and 10"
                    self.mistakes.append((place, text))
            if name in MEDIA and name not in self.scene.media:
                low, high = MEDIA[name].range
                outside = wavelength[(wavelength < low) | (wavelength > high)]
                if outside.size:
                    known = f"{name}: its index was measured from {low:g} to {high:g} nm"
                    self.notes.append(f"{known} and is extrapolated to {outside[0]:g} nm")

    def _check_colours(self) -> None:
        """Light beyond the wavelengths of tables; and such as is treated by colours that are known of all of it together."""
        if self.mistakes:
            return
        self.notes += told_beyond(self.rows, self.names)
        things = [*telling_absorption(self.rows["media"], self.names["media"], VISIBLE),
                  *telling_finishes(self.rows["finishes"], self.names["finishes"], VISIBLE)]  # fmt: skip
        if things and "wavelength" not in self.scene.model_fields_set:
            self.notes += [
                f"{name}: the colours of its light are not known, and {', '.join(things)} "
                f"treat{'s' if len(things) == 1 else ''} wavelengths differently; {self.scene.wavelength:g} nm is taken: "
                "state its 'spectrum' or 'wavelength', or the scene's 'wavelength'"
                for name in self.colourless
            ]
        for name, wavelengths in self.means.items():
            things = [*telling_media(self.rows["media"], self.names["media"], wavelengths),
                      *telling_finishes(self.rows["finishes"], self.names["finishes"], wavelengths)]  # fmt: skip
            if things:
                self.notes.append(
                    f"{name}: every place and direction of it has the spectrum of all its rays together, and "
                    f"{', '.join(things)} treat{'s' if len(things) == 1 else ''} its wavelengths differently; where colour "
                    "changes with place or direction, only the rays themselves, traced forwards, keep it"
                )

    def _check_far_fields(self) -> None:
        """Far fields behind surroundings that absorb: whatever they absorb is absorbed on a way without end."""
        kinds = zip(self.names["detectors"], self.rows["detectors"], strict=True)
        far = [name for name, row in kinds if row["kind"] == "intensity"]
        if self.mistakes or not (far and self.used):
            return
        absorption = self.rows["media"][0]["absorption"]  # the surroundings are the first that is met
        if np.interp(np.concatenate(self.used), absorption["wavelength"], absorption["per_mm"]).any():
            self.notes.append(
                f"{', '.join(far)}: the surroundings absorb, and of light that they absorb nothing gets to a far field; "
                "fill a solid with what absorbs, or put a detector of rays where light shall be counted"
            )

    def _assumed(self, name: str) -> list[str]:
        if "wavelength" in self.scene.model_fields_set:
            return []
        at = self.scene.wavelength
        return [
            f"{name}: its watts have no known wavelength; {at:g} nm is taken, which decides what they are in lumens"
        ]

    # --- what stands in the scene --------------------------------------------------------------------------------------

    def _solid(self, place: str, name: str, solid: Solid) -> None:
        number = len(self.rows["solids"])
        lets_in = closed = False
        with self._at(join(place, "shape")):
            body = self._body(solid.shape)
            closed = not body.doubts
            for doubt in body.doubts:
                self._doubt(f"{place}: {doubt}", 5)
            dressed = self._dressed(place, name, solid, body)
            lets_in = dressed.lets_in
            self.notes += [f"{name}: {note}" for note in dressed.notes]
            self.faces.add_body(body, solid.frame(), number, dressed.finishes, dressed.axes)
            self.names["faces"] += [f"{name}.{face}" for face in body.names]
        if solid.medium is None and lets_in:
            text = "is missing; light enters this solid, so its refractive index is needed"
            self.mistakes.append((join(place, "medium"), text))
        medium = 0 if solid.medium is None else self._medium(join(place, "medium"), name, solid.medium)
        self.rows["solids"].append({"medium": medium})
        self.kinds.append(Kind(name, not lets_in, closed))
        self.names["solids"].append(name)

    def _body(self, body: Body) -> BodyFaces:
        """The faces of a body; equal ones share theirs, so that a file is read once and its numbers are worked out once."""
        try:
            found = self.bodies.get(body)
        except TypeError:  # it holds arrays, which have no hash
            return BodyFaces(body.faces(self.files))
        if found is None:
            found = self.bodies[body] = BodyFaces(body.faces(self.files))
        return found

    def _dressed(self, place: str, name: str, solid: Solid, body: BodyFaces) -> _Dressed:
        """What a body has by its finishes; equal ones share it if all their finishes have names and nothing is wrong."""
        key = (body, solid.finish, *solid.finishes.items())
        # Finishes without names are called by their solids.
        named = all(isinstance(given, str) for given in (solid.finish, *solid.finishes.values()))
        if named and key in self.dressed:
            return self.dressed[key]
        before = len(self.mistakes)
        self.mistakes += [(join(place, inner), text) for inner, text in solid.check_names(body.faces)]
        # By the key that states it: faces with one finish share it.
        finishes: dict[str | None, tuple[int, bool, Axis]] = {}
        with_axis: dict[str | None, list[int]] = {}
        numbers, notes = [], []
        for i, face in enumerate(body.faces):
            stated, given = solid.finish_of(face)
            if stated not in finishes:
                where, owner = ("finish", name) if stated is None else (f"finishes.{stated}", f"{name}.{stated}")
                finishes[stated] = self._finish(join(place, where), owner, given)
            finish, lets_in, axis = finishes[stated]
            numbers.append(finish)
            notes += [*face.notes, *(face.facet_notes if lets_in else ())]
            if axis is not None:
                with_axis.setdefault(stated, []).append(i)
        axes = [(axis, np.array(with_axis[stated])) for stated, (_, _, axis) in finishes.items() if axis is not None]
        dressed = _Dressed(numbers, axes, any(lets_in for _, lets_in, _ in finishes.values()), notes)
        if named and len(self.mistakes) == before:
            self.dressed[key] = dressed
        return dressed

    def _surface(self, place: str, name: str, surface: Surface) -> None:
        with self._at(join(place, "shape")):
            sheet = surface.shape.sheet(surface.trim, self.files)
            self.notes += [f"{name}: {note}" for note in sheet.notes]
            finish, _, axis = self._finish(join(place, "finish"), name, surface.finish)
            if surface.finish in ("interface", Interface()):
                self.notes.append(f"{name}: an interface changes nothing on a surface that is no solid's")
            form = {"shape": sheet.shape, "trims": sheet.trims, "flip": False}
            self.faces.add_sheet(form, surface.frame(), finish, axis)
            self.names["faces"].append(name)

    # --- light and what becomes of it ----------------------------------------------------------------------------------

    def _sources(self) -> FluxUnit:
        units: dict[FluxUnit, str] = {}
        for i, source in enumerate(self.scene.sources):
            place, name = _place("sources", i, source.name), source.name or f"sources[{i}]"
            with self._at(place):
                for emitter in source.emitters(self.files):
                    wavelengths, shares = source.colours(emitter, self.scene.wavelength)
                    self.used += [wavelengths, np.array(emitter.range or ())]
                    units.setdefault(emitter.flux_unit, name)
                    if "rays" in emitter.record:
                        emitter.record["rays"] = self._one_set(emitter.record["rays"])
                    row = {
                        **emitter.record,
                        "wavelengths": wavelengths,
                        "shares": shares,
                        "frame": source.frame().record(),
                    }
                    if getattr(source, "trim", WHOLE) != WHOLE:
                        self._check_cut(join(place, "trim"), row)
                    self.rows["sources"].append(row)
                    self.names["sources"].append(f"{name}.{emitter.name}" if emitter.name else name)
                    self.notes += [f"{name}: {note}" for note in (*emitter.flux_notes, *emitter.notes)]
                    if emitter.mean:
                        self.means[name] = wavelengths
                    if emitter.spectrum is None and not source.states_colours:
                        self.colourless.append(name)
                    if emitter.flux_unit == "lm":
                        self.notes += _no_lumens(name, wavelengths[shares > 0.0])
                    elif emitter.spectrum is None and not source.states_colours:
                        self.notes += self._assumed(name)
        if len(units) > 1:
            text = " and ".join(f"{name!r} is in {unit}" for unit, name in units.items())
            self.mistakes.append(("sources", f"{text}; give all of them in one unit, by flux and flux_unit"))
        return next(iter(units), "lm")

    def _check_cut(self, place: str, row: Record) -> None:
        """A mistake if the tracer cannot draw from what is left of a surface: nothing, or not what it can cut."""
        nothing: Record = {**{key: [] for key in self.rows}, "faces": FaceRows.of([])}
        try:
            _core.Scene({**nothing, "media": [Medium(index=1.0).record(self.files)], "sources": [row]})
        except ValueError as error:
            self.mistakes.append((place, str(error)))

    def _one_set(self, rays: Any) -> Any:
        """The same set for the same rays, however often their file is read: light drawn from it is not independent."""
        for known in self.sets:
            if known is rays or (len(known) == len(rays) and fingerprint({"": known}) == fingerprint({"": rays})):
                return known
        self.sets.append(rays)
        return rays

    def _detectors(self) -> None:
        observers = {observer.name: observer for observer in self.scene.observers if observer.name}
        for i, detector in enumerate(self.scene.detectors):
            with self._at(_place("detectors", i, detector.name)):
                self.rows["detectors"].append(detector.record(self.files, observers, self.names["faces"]))
                self.names["detectors"].append(detector.name or f"detectors[{i}]")


def _no_lumens(name: str, wavelengths: npt.NDArray[np.float64]) -> list[str]:
    """What is to be said of light in lumens at wavelengths that the eye does not see."""
    dark = wavelengths[photopic_efficiency(wavelengths) == 0.0]
    if not dark.size:
        return []
    return [
        f'{name}: at {dark[0]:g} nm light has no lumens, since V(λ) is 0 there; state its flux in W, by flux_unit = "W"'
    ]


def _place(family: str, i: int, name: str) -> str:
    return f'{family}[{i}] "{name}"' if name else f"{family}[{i}]"
