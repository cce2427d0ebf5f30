"""GLDF (Global Lighting Data Format): a ZIP whose product.xml names the photometry files in it. The reader.

https://gldf.io, versions 0.9 to 1.0. See docs/formats/intensity.md.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from etendue.errors import FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.archive import Archive
from etendue.formats.head import Head, file_provenance
from etendue.formats.intensity import eulumdat, lm63, tm33
from etendue.formats.intensity.intensity_format import DAMAGED, MOST_BYTES, IntensityFormat
from etendue.formats.xml_tree import Element, parse_xml
from etendue.quantities.intensity import Intensity
from etendue.quantities.report import Complaint

PRODUCT = "product.xml"
INNER = (lm63.FORMAT, eulumdat.FORMAT, tm33.FORMAT)
"""Formats of the files that a photometry may name, found by content as everywhere."""

CONTENT = {"ldc/eulumdat": "eulumdat", "ldc/ies": "lm63", "ldc/iesxml": "tm33"}
"""Formats by the type of content that a container states."""

MOST_PRODUCT_BYTES = 1 << 24
LISTED = 20
"""Choices that a message names."""


def recognise(head: Head) -> bool:
    """A ZIP archive with a member product.xml."""
    if not head.is_zip:
        return False
    try:
        return _product(Archive(head.path)) is not None
    except FormatError:
        # Cut short or damaged; the name of the first member is all that is left to tell.
        return head.path.suffix.lower() == ".gldf" or head.data[30:41].lower() == PRODUCT.encode()


def read(path: Path) -> Intensity:
    """Read the only photometry of a container."""
    return _Reader(path).intensity(None)


def pick(path: Path, photometry: str) -> Intensity:
    """Read one photometry of a container, by its own name, or that of an emitter or a variant that has one only."""
    return _Reader(path).intensity(photometry)


def _product(archive: Archive) -> str | None:
    return next((name for name in archive.members if name.lower() == PRODUCT), None)


@dataclasses.dataclass(frozen=True)
class _File:
    """One entry of Files."""

    name: str
    content: str
    is_url: bool
    place: str


class _Reader:
    """One container on its way to a distribution."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complaints: list[Complaint] = []
        self.archive = Archive(path)
        product = _product(self.archive)
        if product is None:
            raise FormatError(path, PRODUCT, "it is not in the archive", DAMAGED)
        self.root = parse_xml(self.archive.read(product, MOST_PRODUCT_BYTES), path, product)
        self.definitions = self.root.first("GeneralDefinitions")
        if self.definitions is None:
            raise FormatError(path, f"{product}, {self.root.place}", "it has no GeneralDefinitions", DAMAGED)
        self.files = self._files(self.definitions)
        self.photometries = self._photometries(self.definitions)

    def _files(self, definitions: Element) -> dict[str, _File]:
        files = definitions.first("Files")
        return {
            file.attributes.get("id", ""): _File(
                file.text,
                file.attributes.get("contentType", ""),
                file.attributes.get("type", "").lower() == "url",
                f"{PRODUCT}, {file.place}",
            )
            for file in (files.all("File") if files is not None else [])
        }

    def _photometries(self, definitions: Element) -> dict[str, Element]:
        parent = definitions.first("Photometries")
        found = parent.all("Photometry") if parent is not None else []
        if not found:
            advice = "Sensors and mere accessories have none; give the container of a luminaire."
            raise FormatError(self.path, PRODUCT, "the product has no photometry", advice)
        return {photometry.attributes.get("id", ""): photometry for photometry in found}

    # --- which one -------------------------------------------------------------------------------------------------------

    def emitters(self) -> dict[str, list[str]]:
        """Photometries of each emitter; versions differ in how deep the reference lies."""
        parent = self.definitions.first("Emitters") if self.definitions is not None else None
        return {
            emitter.attributes.get("id", ""): list(_references(emitter, "photometryId"))
            for emitter in (parent.all("Emitter") if parent is not None else [])
        }

    def variants(self) -> dict[str, list[str]]:
        """Photometries of each variant, through its emitters."""
        parent = self.root.first("ProductDefinitions", "Variants")
        emitters = self.emitters()
        return {
            variant.attributes.get("id", ""): [
                photometry for emitter in _references(variant, "emitterId") for photometry in emitters.get(emitter, ())
            ]
            for variant in (parent.all("Variant") if parent is not None else [])
        }

    def described(self) -> str:
        """What can be chosen, for a message."""
        rows = []
        emitters, variants = self.emitters(), self.variants()
        for name, photometry in self.photometries.items():
            used = [e for e, found in emitters.items() if name in found]
            used += [f"{v} {self._title(v)}".strip() for v, found in variants.items() if name in found]
            file = self.files.get(_file_of(photometry))
            whose = f"{', '.join(used[:4])}: " if used else ""
            rows.append(f"{name} ({whose}{file.name if file else 'no file'})")
        return "; ".join(rows[:LISTED]) + (f"; and {len(rows) - LISTED} more" if len(rows) > LISTED else "")

    def _title(self, variant: str) -> str:
        """A variant's name in the first language that it has."""
        parent = self.root.first("ProductDefinitions", "Variants")
        for element in parent.all("Variant") if parent is not None else []:
            if element.attributes.get("id") == variant:
                text = element.words("Name", "Locale") or element.words("VariantName", "Locale")
                return f"{text[:60]!r}" if text else ""
        return ""

    def _chosen(self, photometry: str | None) -> str:
        if photometry is None:
            if len(self.photometries) > 1:
                found = f"{len(self.photometries)} photometries: {self.described()}"
                raise FormatError(self.path, PRODUCT, found, "Name one as photometry (--photometry).")
            return next(iter(self.photometries))
        if photometry in self.photometries:
            return photometry
        through = {**self.variants(), **self.emitters()}
        names = list(dict.fromkeys(through.get(photometry, ())))
        if not names:
            raise UnknownNameError(f"photometry of {self.path.name}", photometry, {*self.photometries, *through})
        if len(names) > 1:
            found = f"{photometry} has {len(names)} photometries: {', '.join(names[:LISTED])}"
            raise FormatError(self.path, PRODUCT, found, "Name one of them.")
        if names[0] not in self.photometries:
            raise FormatError(self.path, PRODUCT, f"{photometry} names {names[0]!r}, which is not defined", DAMAGED)
        return names[0]

    # --- its file ----------------------------------------------------------------------------------------------------------

    def intensity(self, photometry: str | None) -> Intensity:
        name = self._chosen(photometry)
        element = self.photometries[name]
        place = f"{PRODUCT}, {element.place} {name}"
        file = self.files.get(_file_of(element))
        if file is None:
            raise FormatError(
                self.path, place, f"it names the file {_file_of(element)!r}, which is not listed", DAMAGED
            )
        if file.is_url:
            raise UnsupportedFormatError(
                self.path, file.place, f"the photometry is elsewhere, at {file.name[:200]}",
                "étendue fetches nothing; download that file and give it instead.",
            )  # fmt: skip
        member = self._member(file)
        result = self._of_member(member, file)
        turn = element.words("Rotation-G0")
        notes = list(result.notes)
        if turn not in ("", "0"):
            notes.append(
                f"the container says that this photometry is turned by {turn[:20]} (Rotation-G0), which was not applied"
            )
        notes.append(
            f"photometry {name} of the container, {member}; geometry, pictures and sensors in it were not read"
        )
        flux = dict.fromkeys(told for told, found in self._rated() if name in found)
        if flux:
            notes.append(f"the container states {', '.join(flux)}; nothing was scaled to it")
        # The format is that of the file inside: it tells how planes are counted.
        steps = (f"photometry {name} of a GLDF container, {member}", *result.provenance.steps)
        provenance = dataclasses.replace(file_provenance(self.path, result.provenance.format), steps=steps)
        complaints = tuple(dataclasses.replace(c, place=f"{member}: {c.place}") for c in result.complaints)
        return result.replace(notes=tuple(notes), provenance=provenance, complaints=(*self.complaints, *complaints))

    def _rated(self) -> Iterator[tuple[str, list[str]]]:
        """Rated fluxes that emitters state, with the photometries that they are about."""
        parent = self.definitions.first("Emitters") if self.definitions is not None else None
        for emitter in parent.all("Emitter") if parent is not None else []:
            for element in emitter.everything():
                text = element.words("RatedLuminousFlux")
                if text:
                    told = f"a rated luminous flux of {text[:20]} lm for emitter {emitter.attributes.get('id', '')}"
                    yield told, list(_references(element, "photometryId"))

    def _member(self, file: _File) -> str:
        """The member that a file name stands for: in the folder of its kind, whatever its capitals."""
        folder = file.content.partition("/")[0]
        members = {name.replace("\\", "/").lower(): name for name in self.archive.members}
        for wanted in (f"{folder}/{file.name}", file.name):
            if wanted.lower() in members:
                return members[wanted.lower()]
        found = f"it names {file.name[:100]!r}, which is not in the folder {folder}/ of the archive"
        raise FormatError(self.path, file.place, found, "Ask for a complete container.")

    def _of_member(self, member: str, file: _File) -> Intensity:
        """The distribution of a file in the archive; its readers take files, so it becomes one, under a name of ours."""
        data = self.archive.read(member, MOST_BYTES)
        with TemporaryDirectory(prefix="etendue-") as folder:
            path = Path(folder) / "photometry"
            path.write_bytes(data)
            head = Head.of(path)
            found = next((inner for inner in INNER if inner.recognise(head)), None)
            if found is None:
                known = ", ".join(inner.title for inner in INNER)
                raise FormatError(self.path, member, "this is no intensity distribution", f"Known formats: {known}.")
            if CONTENT.get(file.content.strip().lower()) != found.name:
                said = f"contentType is {file.content[:40]!r}, and {member} is {found.title}; it was read as that"
                self.complaints.append(Complaint("warning", file.place, said))
            try:
                return found.read(path)
            except FormatError as error:
                raise type(error)(self.path, f"{member}: {error.place}", error.found, error.advice) from None


def _references(element: Element, attribute: str) -> Iterator[str]:
    """Names that an element, or anything in it, refers to."""
    seen = (found.attributes[attribute] for found in element.everything() if attribute in found.attributes)
    return iter(dict.fromkeys(seen))


def _file_of(photometry: Element) -> str:
    reference = photometry.first("PhotometryFileReference")
    return reference.attributes.get("fileId", "") if reference is not None else ""


FORMAT = IntensityFormat("gldf", "GLDF", ".gldf", recognise, read, pick=pick)
