"""ANSI/IES TM-33-18 and -23, and ATLA S001, from which they come: the reader. See docs/formats/intensity.md."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from etendue.errors import ArgumentError, FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats.head import Head, file_provenance
from etendue.formats.intensity.goniometer import in_c_gamma
from etendue.formats.intensity.intensity_format import DAMAGED, IntensityFormat, number, read_bytes, scaled
from etendue.formats.intensity.symmetry import Array, from_sector, sum_of
from etendue.formats.xml_tree import Element, parse_xml
from etendue.quantities.intensity import UNTURNED, Intensity
from etendue.quantities.report import Complaint, Severity
from etendue.quantities.spectrum import Spectrum
from etendue.units import INTENSITY_UNIT, MM_PER_LENGTH_UNIT, FluxUnit

ROOTS = {
    "IESTM33": "TM-33-18, which is ATLA S001",
    "IESTM33-18": "TM-33-18",
    "IESTM33-22": "TM-33-23",
    "ATLA_S001": "ATLA S001",
    "ATLA_S001_A": "ATLA S001-A",
    "LuminaireOpticalData": "a dialect of ATLA S001 that no edition knows",
}
"""Names of the root element, and what they stand for."""

_ROOT = re.compile(rf"<(?:[\w.-]+:)?({'|'.join(sorted(ROOTS, key=len, reverse=True))})[\s>/]")

ORIENTATION = f"C planes are the file's own: C0 lies along the luminaire's length, as in IES files; {UNTURNED}"
ORIENTATION_CIE = f"C planes are the file's own, counted as CIE does: C0 lies across a linear luminaire; {UNTURNED}"
LARGEST_LUMINAIRE = 100.0
"""Metres; what is larger was written in millimetres, and its unit is not certain."""

HEADER = {
    "Manufacturer": "manufacturer",
    "CatalogNumber": "catalogue_number",
    "Description": "luminaire",
    "Laboratory": "laboratory",
    "ReportNumber": "test_report",
    "ReportDate": "issue_date",
}

Quantity = Literal["luminous", "radiant", "photon"]
DATA: dict[Quantity, tuple[str, str, str]] = {
    "luminous": ("LuminousData", "LuminousIntensity", "LuminousFlux"),
    "radiant": ("RadiantData", "RadiantIntensity", "RadiantFlux"),
    "photon": ("PhotonData", "PhotonIntensity", "PhotonFlux"),
}
"""Elements of an emitter, of its table, and of the flux that it states."""

NOT_KEPT = {
    "AngularColor", "Channels", "CustomData", "IllumData", "IrradData", "PFDData", "SpecIrradData", "TiltAngles",
}  # fmt: skip
"""What a distribution has no place for, and a file may hold."""

KNOWN = {
    "root": {"Version", "Header", "Luminaire", "Equipment", "Emitter", "CustomData"},
    "emitter": NOT_KEPT | {element for names in DATA.values() for element in names[:1]} | {
        "BallastFactor", "CCT", "CatalogNumber", "ColorRendering", "ColorTemperature", "DataGeneration", "Description",
        "Duv", "EmissionAreas", "EmitterCenter", "ID", "Id", "InputWattage", "InputWatts", "IntensityDistribution",
        "MeasuredLumens", "PowerFactor", "Quantity", "RatedLumens", "Regulatory", "SPRatio", "SpectralData",
        "SpectralDistribution",
    },
    "data": NOT_KEPT | {element for names in DATA.values() for element in names[1:]} | {"MaxWavelength", "MinWavelength"},
    "table": {
        "Absolute", "AbsolutePhotometry", "HorizontalAngles", "IntData", "IntensityData", "Metric", "Multiplier",
        "NumberHorz", "NumberMeasured", "NumberVert", "PhotometryType", "Symm", "Units", "VerticalAngles",
    },
}  # fmt: skip

SYMMETRIES = {"FULL": "rotational", "BI_0": "C0-C180", "BI_90": "C90-C270", "QUAD": "both", "NONE": "none"}


def recognise(head: Head) -> bool:
    """A text that begins with a tag and has one of the root elements."""
    data = head.data
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    text = data.decode("utf-16", errors="ignore") if wide else data.decode("latin-1").removeprefix("ï»¿")
    return text.lstrip().startswith("<") and bool(_ROOT.search(text))


def read(path: Path) -> Intensity:
    """Read all emitters of a file, added up."""
    return _Reader(path).intensity(None)


def pick(path: Path, photometry: str) -> Intensity:
    """Read one emitter, by its number, its name, or ``number/radiant`` if it has both quantities."""
    return _Reader(path).intensity(photometry)


class _Reader:
    """One file on its way to a distribution."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complaints: list[Complaint] = []
        self.root = parse_xml(read_bytes(path), path)
        if self.root.name not in ROOTS:
            raise FormatError(path, self.root.place, "no root element of TM-33 or ATLA S001", DAMAGED)
        if self.root.name == "LuminaireOpticalData":
            self.complain("note", self.root.place, ROOTS[self.root.name])
        self._name_strangers(self.root, "root")
        self.emitters = self.root.all("Emitter")
        self._check_number()
        if not self.emitters:
            raise FormatError(path, self.root.place, "the file has no Emitter", DAMAGED)

    def complain(self, severity: Severity, place: str, found: str) -> None:
        self.complaints.append(Complaint(severity, place, found))

    def _name_strangers(self, element: Element, where: str) -> None:
        seen = set(KNOWN[where])
        for child in element.children:
            if child.name not in seen:
                seen.add(child.name)
                self.complain("warning", child.place, "no element of the format here; it was ignored")

    def _check_number(self) -> None:
        """Whether there are as many emitters as the luminaire is said to have, whether it counts all of a kind or not."""
        luminaire = self.root.first("Luminaire")
        stated = self._aside(luminaire, "NumEmitter") if luminaire is not None else None
        each = [number(emitter.words("Quantity")) for emitter in self.emitters]
        if luminaire is not None and stated not in (None, len(each), sum(1.0 if n is None else n for n in each)):
            found = f"it says {stated:g}, the file has {len(each)}; the emitters of the file were taken"
            self.complain("warning", f"{luminaire.place}, NumEmitter", found)

    # --- which table -----------------------------------------------------------------------------------------------------

    def choices(self) -> dict[str, tuple[int, Quantity]]:
        """What can be read, by the name under which it is asked for."""
        found: dict[str, tuple[int, Quantity]] = {}
        for n, emitter in enumerate(self.emitters):
            there = [quantity for quantity in get_args(Quantity) if _table(emitter, quantity) is not None]
            for place, quantity in enumerate(there):
                found[str(n + 1) if place == 0 else f"{n + 1}/{quantity}"] = (n, quantity)
        return found

    def described(self) -> str:
        """The choices for a message."""
        rows = [
            f"{name} ({self.emitters[n].words('Description')[:40] or 'no description'}, {quantity})"
            for name, (n, quantity) in self.choices().items()
        ]
        return "; ".join(rows[:20]) + ("; …" if len(rows) > 20 else "")

    def intensity(self, photometry: str | None) -> Intensity:
        choices = self.choices()
        if not choices:
            found = "no emitter has LuminousData, RadiantData or PhotonData"
            raise FormatError(self.path, self.emitters[0].place, found, "Ask for a file with intensities.")
        if photometry is not None:
            result = self._one(*choices[self._named(photometry, choices)])
        else:
            wanted = [choices[str(n + 1)] for n in range(len(self.emitters)) if str(n + 1) in choices]
            for n, emitter in enumerate(self.emitters):
                if str(n + 1) not in choices:
                    self.complain("warning", emitter.place, f"emitter {n + 1} has no intensities; it is not in the sum")
            if len({quantity for _, quantity in wanted}) > 1:
                found = f"emitters of several quantities, which cannot be added: {self.described()}"
                raise FormatError(self.path, "Emitter", found, "Name one as photometry (--photometry).")
            others = [name for name in choices if "/" in name]
            if others:
                self.complain("note", "Emitter", f"{wanted[0][1]} data was taken; {', '.join(others)} can be asked for")
            result = self._sum([self._one(*one) for one in wanted])
        return result.replace(complaints=tuple(self.complaints))

    def _named(self, photometry: str, choices: dict[str, tuple[int, Quantity]]) -> str:
        if photometry in choices:
            return photometry
        names = [
            str(n + 1)
            for n, emitter in enumerate(self.emitters)
            if photometry and photometry in (emitter.words("ID"), emitter.words("Id"), emitter.words("Description"))
        ]
        if len(names) == 1 and names[0] in choices:
            return names[0]
        raise UnknownNameError(f"photometry of {self.path.name}", photometry, choices)

    def _sum(self, parts: Sequence[Intensity]) -> Intensity:
        if len(parts) == 1:
            return parts[0]
        power = {"input_power": sum(float(part.luminaire.get("input_power", 0.0)) for part in parts)}
        drop = (
            "lamp",
            "lamps",
            "lamp_flux",
            "stated_flux",
            "spectrum",
            "opening_shape",
            "opening_x",
            "opening_y",
            "opening_z",
        )
        facts = {key: value for key, value in parts[0].luminaire.items() if key not in drop}
        notes = dict.fromkeys(note for part in parts for note in part.notes)
        added = f"the sum of {len(parts)} emitters, each as often as its table says; one alone: {self.described()}"
        return sum_of(parts).replace(luminaire=facts | power, notes=(*notes, added), provenance=parts[0].provenance)

    # --- one emitter -------------------------------------------------------------------------------------------------------

    def _one(self, n: int, quantity: Quantity) -> Intensity:
        emitter = self.emitters[n]
        table = _table(emitter, quantity)
        assert table is not None  # noqa: S101 - `choices` lists only tables that are there
        if quantity == "photon":
            raise UnsupportedFormatError(
                self.path, table.place, "photon intensity, in micromoles per second and steradian",
                "étendue knows lumens and watts; ask for luminous or radiant intensity.",
            )  # fmt: skip
        data = emitter.first(DATA[quantity][0])
        inner = data.children if data is not None else []
        self._name_strangers(emitter, "emitter")
        if data is not None:
            self._name_strangers(data, "data")
        self._name_strangers(table, "table")
        for child in (*emitter.children, *inner):
            if child.name in NOT_KEPT:
                self.complain("note", child.place, "not kept: a distribution of intensity has no place for it")
        unit: FluxUnit = "lm" if quantity == "luminous" else "W"
        horizontal, vertical, values = self._grid(table)
        factor = self._multiplier(table)
        values = scaled(self.path, table.place, values, factor)
        if (values < 0.0).any():
            self.complain("warning", table.place, f"{int((values < 0.0).sum())} intensities are below 0")
        c, gamma, values, notes = self._in_c_gamma(table, horizontal, vertical, values, INTENSITY_UNIT[unit])
        result = Intensity(
            c,
            gamma,
            values,
            flux_unit=unit,
            luminaire=self._facts(emitter),
            provenance=file_provenance(self.path, "tm33"),
            notes=notes,
        )
        return self._with_flux(result, emitter, table, quantity)

    def _multiplier(self, table: Element) -> float:
        """What multiplies the table: one number, however often it stands there."""
        texts = [" ".join(element.text.split()) for element in table.all("Multiplier")]
        place = f"{table.place}, Multiplier"
        if len({number(text) for text in texts}) > 1:
            found = f"there are {len(texts)}, and they differ: {', '.join(text[:20] for text in texts[:5])}"
            raise FormatError(self.path, place, found, "Which one holds is not certain; ask for a file with one.")
        factor = self._value(table, "Multiplier") if texts else 1.0
        if not factor > 0.0:
            raise FormatError(self.path, place, f"found {factor:g}", DAMAGED)
        if len(texts) > 1:
            self.complain("warning", place, f"{factor:g} stands there {len(texts)} times; it was applied once")
        return factor

    def _grid(self, table: Element) -> tuple[Array, Array, Array]:
        """Angles and values of shape (n_h, n_v), from one element for each direction in any order."""
        data = table.all("IntData") + table.all("IntensityData")
        rows = np.zeros((len(data), 3))
        for row, element in zip(rows, data, strict=True):
            names = (("h", "horz", "horizontal"), ("v", "vert", "vertical"))
            words = [next((element.attributes[n] for n in known if n in element.attributes), "") for known in names]
            for k, word in enumerate((*words, element.text)):
                value = number(word.strip())
                if value is None:
                    what = ("h", "v", "value")[k]
                    raise FormatError(self.path, element.place, f"{what}: {word[:40]!r} is no number", DAMAGED)
                row[k] = value
        horizontal, vertical = np.unique(rows[:, 0]), np.unique(rows[:, 1])
        if len(data) < 2 or vertical.size < 2:
            raise FormatError(self.path, table.place, f"{len(data)} intensities, too few for a distribution", DAMAGED)
        if horizontal.size * vertical.size != len(data):
            found = f"{len(data):,} intensities at {horizontal.size:,} horizontal and {vertical.size:,} vertical angles"
            raise FormatError(self.path, table.place, f"{found}, which are no complete grid", DAMAGED)
        values = np.full((horizontal.size, vertical.size), np.nan)
        values[np.searchsorted(horizontal, rows[:, 0]), np.searchsorted(vertical, rows[:, 1])] = rows[:, 2]
        if np.isnan(values).any():
            raise FormatError(self.path, table.place, "a direction is there twice, and another is missing", DAMAGED)
        counts = {"NumberMeasured": len(data), "NumberHorz": horizontal.size, "NumberVert": vertical.size}
        for name, count in counts.items():
            if table.first(name) is not None and self._value(table, name) != count:
                self.complain(
                    "warning", f"{table.place}, {name}", f"it says {table.words(name)[:20]}, there are {count}"
                )
        return horizontal, vertical, values

    def _in_c_gamma(
        self, table: Element, horizontal: Array, vertical: Array, values: Array, unit: str
    ) -> tuple[Array, Array, Array, tuple[str, ...]]:
        kind = self.root.words("Equipment", "Gonioradiometer", "Type") or table.words("PhotometryType") or "IES_C"
        kind = re.sub(r"[\s_]", "", kind).upper().removeprefix("TYPE")
        symmetry = re.sub(r"\s", "", table.words("Symm")).upper().removeprefix("SYMM_")
        if symmetry and symmetry not in SYMMETRIES:
            found = f"the symmetry is {table.words('Symm')[:40]!r}"
            raise UnsupportedFormatError(
                self.path, f"{table.place}, Symm", found, "Known are None, Bi_0, Bi_90, Quad and Full."
            )
        if kind in ("IESC", "CIEC", "C"):
            if vertical[0] < 0.0 or vertical[-1] > 180.0:
                found = f"vertical angles run from {vertical[0]:g}° to {vertical[-1]:g}°, beyond 0° to 180°"
                raise FormatError(self.path, table.place, found, DAMAGED)
            if vertical[0] not in (0.0, 90.0) or vertical[-1] not in (90.0, 180.0):
                found = f"vertical angles run from {vertical[0]:g}° to {vertical[-1]:g}°; beyond them it is taken as 0"
                self.complain("warning", table.place, found)
            c, values = self._whole_circle(table, horizontal, values, SYMMETRIES.get(symmetry))
            return c, vertical, values, (ORIENTATION_CIE if kind == "CIEC" else ORIENTATION,)
        letter: Literal["A", "B"] | None = {"IESA": "A", "A": "A", "IESB": "B", "B": "B"}.get(kind)  # type: ignore[assignment]
        if letter is None:
            raise UnsupportedFormatError(
                self.path, "Gonioradiometer Type", f"the goniometer is {kind[:40]!r}, whose angles are not certain",
                "Ask for data of type IES_C, CIE_C, IES_B or IES_A.",
            )  # fmt: skip
        try:
            converted = in_c_gamma(letter, horizontal, vertical, values, unit)
        except ArgumentError as error:
            raise FormatError(self.path, table.place, str(error), DAMAGED) from None
        if symmetry == "NONE" and converted.assumed:
            raise FormatError(self.path, table.place, f"Symm_None, but {converted.assumed[0]}", DAMAGED)
        for what in converted.assumed:
            self.complain("note", table.place, what)
        return converted.c, converted.gamma, converted.values, converted.notes

    def _whole_circle(self, table: Element, c: Array, values: Array, symmetry: str | None) -> tuple[Array, Array]:
        known = from_sector(c, values)
        if known is None:
            found = f"planes from {c[0]:g}° to {c[-1]:g}° are no sector that symmetry completes"
            raise FormatError(self.path, table.place, found, "Known are 0 to 0, 90, 180 or 360, and 90 to 270.")
        whole, all_values, implied = known
        if symmetry is not None and symmetry != implied:
            found = f"Symm says {table.words('Symm')[:40]!r}, the planes run from {c[0]:g}° to {c[-1]:g}°"
            if implied != "none":
                raise FormatError(self.path, table.place, found, "Ask for a file whose planes and symmetry agree.")
            self.complain("note", table.place, f"{found}; all of them were taken as they are")
        return whole, all_values

    # --- what else is said -------------------------------------------------------------------------------------------------

    def _value(self, element: Element, name: str) -> float:
        value = number(element.words(name))
        if value is None:
            place = f"{element.place}, {name}"
            raise FormatError(self.path, place, f"{element.words(name)[:40]!r} is no number", DAMAGED)
        return value

    def _aside(self, element: Element, *path: str) -> float | None:
        """A number that the table does not rest on: None, and a complaint, if it is something else."""
        text = element.words(*path)
        value = number(text) if text else None
        if text and value is None:
            self.complain("warning", f"{element.place}, {path[-1]}", f"{text[:40]!r} is no number")
        return value

    def _facts(self, emitter: Element) -> dict[str, Any]:
        header = self.root.first("Header")
        facts: dict[str, Any] = {
            fact: header.words(name) for name, fact in HEADER.items() if header is not None and header.words(name)
        }
        if emitter.words("Description"):
            facts["lamp"] = emitter.words("Description")
        power = self._aside(emitter, "InputWattage")
        power = self._aside(emitter, "InputWatts") if power is None else power
        facts |= {} if power is None else {"input_power": power}
        quantity = self._aside(emitter, "Quantity")
        if quantity is not None and quantity.is_integer() and 1.0 <= quantity <= 1e6:
            facts["lamps"] = int(quantity)
            if quantity > 1.0:
                found = f"there are {quantity:g} of this emitter; the table was taken as that of all of them together"
                self.complain("warning", f"{emitter.place}, Quantity", f"{found}, scale it if it is that of one")
        elif quantity is not None:
            self.complain("warning", f"{emitter.place}, Quantity", f"found {quantity:g}; it was ignored")
        facts |= self._extents("housing", self.root.first("Luminaire", "Dimensions"))
        areas = [
            a
            for a in emitter.everything()
            if a.name in ("BottomArea", "TopArea", "C0Area", "C90Area", "C180Area", "C270Area")
        ]
        if len(areas) == 1 and areas[0].name in ("BottomArea", "TopArea"):
            round_ = areas[0].words("Circular").lower() in ("true", "1")
            opening = self._extents("opening", areas[0])
            facts |= opening and opening | {"opening_shape": "circle" if round_ else "rectangle"}
        elif areas:
            self.complain("note", f"{emitter.place}, EmissionAreas", f"{len(areas)} luminous areas were not kept")
        spectrum = self._spectrum(emitter)
        return facts | ({} if spectrum is None else {"spectrum": spectrum})

    def _extents(self, what: str, element: Element | None) -> dict[str, float]:
        """Length along C0-C180, width across, height; metres in the file, mm here."""
        if element is None:
            return {}
        mm, found = MM_PER_LENGTH_UNIT["m"], {}
        for name, axis in (("Length", "x"), ("Width", "y"), ("Height", "z")):
            value = self._aside(element, name)
            if value is not None and not 0.0 <= value <= LARGEST_LUMINAIRE:
                said = f"{value:g} m, which no luminaire has; sizes were not kept"
                self.complain("warning", f"{element.place}, {name}", said)
                return {}
            if value is not None:
                found[f"{what}_{axis}"] = value * mm
        return found

    def _spectrum(self, emitter: Element) -> Spectrum | None:
        """The one spectrum of an emitter; what it cannot be is complained about, since the table does not rest on it."""
        data = emitter.first("SpectralData")
        if data is not None and data.first("AngularSpectral") is not None:
            self.complain("note", data.place, "spectra that change with direction were not kept")
        tables = data.all("EmitterSpectral") if data is not None else []
        other = emitter.first("SpectralDistribution")
        if len(tables) > 1:
            self.complain(
                "note", tables[1].place, f"{len(tables)} spectra; none was kept, since their shares are not told"
            )
            return None
        if tables:
            pairs = [(number(p.attributes.get("w", "")), number(p.text)) for p in tables[0].all("PwrData")]
            place = tables[0].place
        elif other is not None:
            wavelengths, powers = (other.words(name).split() for name in ("Wavelengths", "Values"))
            pairs = (
                [(number(w), number(p)) for w, p in zip(wavelengths, powers, strict=False)]
                if len(wavelengths) == len(powers)
                else []
            )
            place = other.place
        else:
            return None
        known = sorted((w, p) for w, p in pairs if w is not None and p is not None)
        if len(known) != len(pairs):
            self.complain("warning", place, "the spectrum was not kept: a wavelength or a power is no number")
            return None
        try:
            return Spectrum(np.array([w for w, _ in known]), np.array([p for _, p in known]))
        except ArgumentError as error:
            self.complain("warning", place, f"the spectrum was not kept: {error}")
            return None

    def _with_flux(self, intensity: Intensity, emitter: Element, table: Element, quantity: Quantity) -> Intensity:
        """The fluxes that are stated, and whether the table agrees."""
        facts = dict(intensity.luminaire)
        data, _, flux = DATA[quantity]
        told = {flux: self._aside(emitter, data, flux)}
        told |= {"MeasuredLumens": self._aside(emitter, "MeasuredLumens")} if quantity == "luminous" else {}
        for name, stated in told.items():
            if stated is None or not stated > 0.0:
                continue
            facts.setdefault("stated_flux", stated)
            if abs(intensity.flux - stated) > 0.05 * stated:
                unit = intensity.flux_unit
                found = f"it says {stated:.6g} {unit}, the table integrates to {intensity.flux:.6g} {unit}"
                self.complain("warning", f"{emitter.place}, {name}", f"{found}; the table was taken")
        ballast = self._aside(emitter, "BallastFactor")
        if ballast not in (None, 1.0):
            found = f"it is {ballast:g}; it was not applied, since it is not certain that the table lacks it"
            self.complain("warning", f"{emitter.place}, BallastFactor", found)
        rated = self._aside(emitter, "RatedLumens")
        relative = table.words("AbsolutePhotometry").lower() in ("false", "0") or table.words("Absolute").lower() in (
            "false",
            "0",
        )
        if relative:
            taken = "relative photometry: the values were taken as they are, for the rated lumens"
            self.complain("note", table.place, f"{taken} {rated:g}" if rated else taken)
        if rated is not None and rated > 0.0 and quantity == "luminous":
            facts["lamp_flux"] = rated
            if intensity.flux > 1.05 * rated:
                found = f"the table integrates to {intensity.flux:.6g} lm, more than {rated:.6g} lm"
                self.complain("warning", f"{emitter.place}, RatedLumens", f"{found}; the table was taken")
        return intensity.replace(luminaire=facts)


def _table(emitter: Element, quantity: Quantity) -> Element | None:
    data, name, _ = DATA[quantity]
    found = emitter.first(data, name)
    other = emitter.first("IntensityDistribution")
    if found is None and other is not None and (other.words("Metric").lower() or "luminous") == quantity:
        return other
    return found


FORMAT = IntensityFormat("tm33", "IES TM-33 / ATLA S001", ".xml", recognise, read, pick=pick)
