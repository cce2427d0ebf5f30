"""Light fields as HDF5 files; docs/formats/light-fields.md describes them field by field.

Files hold what the field is worth and no more: the ratio to a sixteenth of its standard deviation, which leaves long
runs of zero bits.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, FormatError
from etendue.formats.hdf5 import LIBRARY, Node, begins_as_hdf5, put, reading
from etendue.formats.input import as_path
from etendue.formats.other_kind import foreign
from etendue.formats.output import atomic_output
from etendue.formats.own_kind import LIGHT_FIELD
from etendue.formats.strict_json import strict_json
from etendue.lightfield.carrier import SURFACES, Part, Surface
from etendue.lightfield.counting import MOST_CELLS
from etendue.lightfield.etendue_density import EtendueDensity, FineErrors, FitReport, PartField
from etendue.lightfield.rounding import digits_for, rounded
from etendue.lightfield.symmetry import SYMMETRIES
from etendue.quantities.memory import require_memory
from etendue.quantities.provenance import Provenance
from etendue.quantities.spectral_lines import SpectralLines
from etendue.quantities.spectrum import Spectrum
from etendue.units import LUMINANCE_UNIT, FluxUnit

Density = TypeVar("Density", bound=EtendueDensity)

VERSION = 1

STEPS = 16.0
"""The ratio is rounded to at least so many steps per standard deviation: it adds 1/3072 to the loss to be expected."""

FEWEST_DIGITS = 4
"""Binary digits of the ratio after the leading one, however uncertain it is: it is off by 3 % at most."""

DEVIATION_DIGITS = 3
"""Of the standard deviation: it is off by 6 % at most, far less than it is known to."""

FACTOR_DIGITS = 10
"""Of the factors, whose error the file does not hold: they are off by 0.05 % at most."""

CHUNK_SIDE = 16
"""Cells of a chunk along each coordinate. Trees are constant over boxes, and blocks cut fewer boxes than slices do."""

CONTINUOUS, LINES = "continuous", "lines"
"""Kinds of spectra in files."""

MOST_WAVELENGTHS = 1 << 20

LATER = ("focus", "hole", "beam", "taken")
"""Attributes of a part that files of before they were kept lack."""

FACTORS = ("space", "direction")
"""Datasets that a part may have beside its ratio and deviation."""

ERRORS = ("space_error", "direction_error")
"""Likewise: errors within cells."""

LEFT = ("cells_left", "within_left")
"""Attributes of a part, absent in files of before they were kept: what averaging leaves of errors."""

DEFLATE = 9
SAME_FLUX = 1e-9
"""Relative difference between the stated flux of a part and the one worked out that rounding may make."""

DAMAGED = "The file is damaged or cut short: copy it again, or fit and save the field again."
FOREIGN = "Give a file that `etendue fit` or LightField.save wrote."


def is_field_file(path: str | Path) -> bool:
    """Whether a file is a light field, by its content.

    An HDF5 file that cannot be opened counts as one, so that `load_field` tells what is wrong with it.

    Raises
    ------
    OSError
        If there is no such file.
    """
    import h5py  # noqa: PLC0415 - only who has such a file needs the library

    path = as_path(path)
    if not begins_as_hdf5(path):
        return False
    with contextlib.suppress(FormatError), reading(path, "HDF5", DAMAGED), h5py.File(path, "r") as file:
        return Node(path, file, DAMAGED).has_text("format", LIGHT_FIELD)
    return True


def save_field(field: EtendueDensity, path: Path) -> None:
    """See `LightField.save`.

    What is saved is `as_stored`: a field that was loaded gives the same file again, bit by bit.
    """
    import h5py  # noqa: PLC0415

    stored = as_stored(field)
    with atomic_output(path) as temporary:
        # Made in memory and written in one go: an HDF5 library whose disk is full cannot even close its file.
        image = io.BytesIO()
        with h5py.File(image, "w", libver=LIBRARY) as file:
            _write(file, stored)
        temporary.write_bytes(image.getbuffer())


def load_field(path: Path) -> EtendueDensity:
    """See `LightField.load`."""
    import h5py  # noqa: PLC0415

    if not begins_as_hdf5(path):
        raise foreign(path, "a light field", FOREIGN)
    with reading(path, "HDF5", DAMAGED), h5py.File(path, "r") as file:
        return _read(Node(path, file, DAMAGED))


def as_stored(field: Density) -> Density:
    """The field as a file holds it: rounded to what it is worth, each part with exactly the flux it had."""
    parts = tuple(rounded_part(part) for part in field.parts)
    flux = field.replace(parts=parts).part_flux
    levels = (
        part.level * (had / has) if has > 0 else part.level
        for part, had, has in zip(parts, field.part_flux, flux, strict=True)
    )
    return field.replace(
        parts=tuple(dataclasses.replace(part, level=level) for part, level in zip(parts, levels, strict=True))
    )


def rounded_part(part: PartField) -> PartField:
    """A part with its numbers rounded to what they are worth; one that is rounded stays as it is.

    Examples
    --------
    >>> third = np.full((1, 1, 1, 1), 1 / 3, dtype=np.float32)
    >>> part = rounded_part(PartField(third, third / 10, np.full((1, 1), 1 / 3), None, 1.0))
    >>> part.ratio.item(), part.space.item(), rounded_part(part).ratio.item()
    (0.333984375, 0.333251953125, 0.333984375)
    """
    ratio, deviation = (np.asarray(values, dtype=np.float32) for values in (part.ratio, part.deviation))
    deviation = rounded(deviation, DEVIATION_DIGITS)
    ratio = rounded(ratio, digits_for(ratio, deviation / np.float32(STEPS), FEWEST_DIGITS))
    space, direction = (None if f is None else rounded(f, FACTOR_DIGITS) for f in (part.space, part.direction))
    own = part.errors
    place, turn = (None if e is None else rounded(e, DEVIATION_DIGITS) for e in (own.space, own.direction))
    errors = FineErrors(place, turn, own.cells_left, own.within_left)
    return PartField(ratio, deviation, space, direction, part.level, errors)


# --- writing ---------------------------------------------------------------------------------------------------------


def _write(file: Any, field: EtendueDensity) -> None:
    unit = f"{field.flux_unit}/(mm2 sr)"
    put(file, format=LIGHT_FIELD, version=VERSION, flux_unit=field.flux_unit, length_unit="mm", level_unit=unit)
    put(file, provenance=json.dumps(field.provenance.to_dict(), sort_keys=True), notes=json.dumps(field.notes))
    surface = {f.name: getattr(field.surface, f.name) for f in dataclasses.fields(field.surface)}
    known = {name: value for name, value in surface.items() if value is not None}
    put(file.create_group("surface"), name=field.surface.NAME, spec=field.surface.spec, **known)
    put(file.create_group("report"), **_report_values(field.report))
    if field.spectrum is not None:
        _put_spectrum(file.create_group("spectrum"), field.spectrum)
    parts = file.create_group("parts")
    for index, (chart, part, flux) in enumerate(zip(field.surface.parts(), field.parts, field.part_flux, strict=True)):
        group = parts.create_group(str(index))
        put(group, **_chart(chart), level=float(part.level), flux=flux)
        put(group, cells_left=part.errors.cells_left, within_left=part.errors.within_left)
        _put_array(group, "ratio", part.ratio, "luminance / (level * space * direction) at the centres of equal cells")
        _put_array(group, "deviation", part.deviation, "standard deviation of ratio")
        for name, factor, meaning in (
            ("space", part.space, "factor of luminance over the place, at the centres of equal cells"),
            ("direction", part.direction, "factor of luminance over the direction, at the centres of equal cells"),
            ("space_error", part.errors.space, "relative standard deviation of space against its mean over a cell"),
            ("direction_error", part.errors.direction, "relative standard deviation of direction, likewise"),
        ):
            if factor is not None:
                _put_array(group, name, factor, meaning)


def _chart(chart: Part) -> dict[str, Any]:
    return {f.name: getattr(chart, f.name) for f in dataclasses.fields(Part)}


def _report_values(report: FitReport) -> dict[str, Any]:
    """The report's fields as attributes: lists of texts as JSON."""
    hints = get_type_hints(FitReport)
    values = {name: getattr(report, name) for name in hints}
    return {name: json.dumps(v) if hints[name] == tuple[str, ...] else v for name, v in values.items()}


def _put_spectrum(group: Any, spectrum: Spectrum | SpectralLines) -> None:
    lines = isinstance(spectrum, SpectralLines)
    counted = spectrum.flux_unit if isinstance(spectrum, SpectralLines) else "W"
    put(group, kind=LINES if lines else CONTINUOUS, flux_unit=counted)
    weight = "flux at each wavelength" if lines else "spectral flux per nm, linear between the wavelengths"
    _put_array(group, "wavelength", spectrum.wavelength, "of all the light together", "nm")
    _put_array(group, "weight", spectrum.weight, f"{weight}, on any scale")


def _put_array(group: Any, name: str, values: npt.NDArray[Any], meaning: str, unit: str = "1") -> None:
    chunks = tuple(min(n, CHUNK_SIDE) for n in values.shape) if values.ndim == 4 else values.shape
    dataset = group.create_dataset(
        name, data=values, chunks=chunks, shuffle=True, compression="gzip", compression_opts=DEFLATE, fletcher32=True
    )
    put(dataset, unit=unit, meaning=meaning)


# --- reading ---------------------------------------------------------------------------------------------------------


def _read(file: Node) -> EtendueDensity:
    if not file.has_text("format", LIGHT_FIELD):
        raise foreign(file.path, "a light field", FOREIGN, "attribute 'format'")
    version = file.integer("version")
    if version != VERSION:
        raise file.error("attribute 'version'", f"version {version}", f"This étendue reads {VERSION}; update it.")
    surface = _surface(file.group("surface"))
    parts, flux = _parts(file.group("parts"), surface)
    field = EtendueDensity(
        surface=surface,
        parts=parts,
        flux_unit=_flux_unit(file),
        report=_report(file.group("report")),
        provenance=_provenance(file),
        notes=file.texts("notes"),
        spectrum=_spectrum(file.group("spectrum")) if "spectrum" in file.node else None,
    )
    for index, (stated, found) in enumerate(zip(flux, field.part_flux, strict=True)):
        if not math.isclose(stated, found, rel_tol=SAME_FLUX):
            place = f"/parts/{index}, attribute 'flux'"
            raise file.error(place, f"{stated!r} {field.flux_unit}, but the arrays hold {found!r}")
    return field


def _spectrum(group: Node) -> Spectrum | SpectralLines:
    kind, unit = group.text("kind"), _flux_unit(group)
    if kind not in (CONTINUOUS, LINES):
        raise group.error("attribute 'kind'", f"{kind!r} is neither {CONTINUOUS!r} nor {LINES!r}")
    arrays = [group.dataset(name, np.dtype("<f8"), 1) for name in ("wavelength", "weight")]
    if any(array.size > MOST_WAVELENGTHS for array in arrays):
        raise group.error("dataset 'wavelength'", f"more than {MOST_WAVELENGTHS:,} wavelengths")
    wavelength, weight = (group.values(array) for array in arrays)
    try:
        return SpectralLines(wavelength, weight, unit) if kind == LINES else Spectrum(wavelength, weight)
    except ArgumentError as error:
        raise group.error("datasets 'wavelength' and 'weight'", str(error)) from error


def _flux_unit(file: Node) -> FluxUnit:
    stored = file.text("flux_unit")
    for known in LUMINANCE_UNIT:
        if stored == known:
            return known
    raise file.error("attribute 'flux_unit'", f"{stored!r} is none of {', '.join(LUMINANCE_UNIT)}")


def _surface(group: Node) -> Surface:
    kind = SURFACES[group.text("name")]
    hints = get_type_hints(kind)
    known = [f.name for f in dataclasses.fields(kind) if f.name in group.node.attrs]
    sizes = kind.SIZES
    dimensions = {
        name: group.truth(name)
        if hints[name] is bool
        else group.text(name)
        if hints[name] is str
        else group.numbers(name, (sizes[name],)).tolist()
        if name in sizes
        else group.number(name)
        for name in known
    }
    surface = kind(**dimensions)
    if surface.spec != group.text("spec"):
        raise group.error("attribute 'spec'", f"the dimensions are those of {surface.spec}")
    return surface


def _parts(group: Node, surface: Surface) -> tuple[tuple[PartField, ...], list[float]]:
    """The fields of all parts, and the fluxes that the file states for them."""
    charts = surface.parts()
    if len(group.node) != len(charts):
        raise group.error("members", f"{len(group.node)} parts, expected {len(charts)} of {surface.spec}")
    held: list[tuple[Node, dict[str, Any]]] = []
    flux = []
    for index, chart in enumerate(charts):
        part = group.group(str(index))
        for name, value in _chart(chart).items():
            if name in LATER and name not in part.node.attrs:
                continue
            stored = part.text(name) if isinstance(value, str) else part.numbers(name, np.shape(value))
            agrees = stored == value if isinstance(value, str) else np.allclose(stored, value, rtol=1e-12, atol=1e-12)
            if not agrees:
                raise part.error(f"attribute {name!r}", f"{stored!r}, but {surface.spec} has {value!r}")
        held.append((part, _arrays(part)))
        flux.append(part.number("flux"))
    cells = sum(arrays["ratio"].size for _, arrays in held)
    if cells > MOST_CELLS:
        raise group.error("datasets 'ratio'", f"{cells:,} cells together; {MOST_CELLS:,} are the most")
    # The core keeps arrays of its own beside those that are read.
    needed = 2 * sum(array.nbytes for _, arrays in held for array in arrays.values())
    require_memory(needed, f"{group.path}: a light field of {cells:,} cells")
    return tuple(_part(part, arrays) for part, arrays in held), flux


def _report(group: Node) -> FitReport:
    readers: Mapping[Any, Callable[[str], Any]] = {
        int: group.integer,
        float: lambda name: group.number(name, finite=False),
        str: group.text,
        tuple[str, ...]: group.texts,
        tuple[float, ...]: lambda name: tuple(group.numbers(name, None).tolist()),
    }
    hints = get_type_hints(FitReport)
    for name in ("symmetry", "effective_rays"):
        if name not in group.node.attrs:  # files of before it was kept
            del hints[name]
    report = FitReport(**{name: readers[hint](name) for name, hint in hints.items()})
    if report.symmetry not in {"none", *SYMMETRIES}:
        raise group.error("attribute 'symmetry'", f"{report.symmetry!r} is none of {', '.join(SYMMETRIES)}")
    return report


def _provenance(file: Node) -> Provenance:
    provenance = Provenance.from_dict(strict_json(file.text("provenance")))
    texts = (provenance.source, provenance.format, provenance.fingerprint, provenance.software, *provenance.steps)
    if not all(isinstance(text, str) for text in texts):
        raise file.error("attribute 'provenance'", "something else than texts")
    return provenance


def _arrays(group: Node) -> dict[str, Any]:
    """The datasets of a part, with 2^k cells along each of their axes; not read yet."""
    arrays = {name: group.dataset(name, np.dtype("<f4"), 4) for name in ("ratio", "deviation")}
    arrays |= {name: group.dataset(name, np.dtype("<f8"), 2) for name in (*FACTORS, *ERRORS) if name in group.node}
    for name, data in arrays.items():
        if not all(n > 0 and n & (n - 1) == 0 for n in data.shape) or data.size > MOST_CELLS:
            raise group.error(f"dataset {name!r}", f"shape {data.shape}, expected powers of two, {MOST_CELLS} at most")
    ratio, deviation = arrays["ratio"].shape, arrays["deviation"].shape
    if ratio != deviation:
        raise group.error("dataset 'deviation'", f"shape {deviation}, but 'ratio' has {ratio}")
    return arrays


def _part(group: Node, arrays: Mapping[str, Any]) -> PartField:
    """The field of a part, whose values are finite and not negative."""
    values = {name: group.values(data) for name, data in arrays.items()}
    for name, array in values.items():
        if not (np.isfinite(array).all() and (array >= 0).all()):
            raise group.error(f"dataset {name!r}", "a value that is negative or not finite")
    space, direction, of_space, of_direction = (values.get(name) for name in (*FACTORS, *ERRORS))
    cells_left, within_left = (_left(group, name) for name in LEFT)
    errors = FineErrors(of_space, of_direction, cells_left, within_left)
    return PartField(values["ratio"], values["deviation"], space, direction, group.number("level"), errors)


def _left(group: Node, name: str) -> tuple[float, ...]:
    """What averaging leaves of errors: shares."""
    if name not in group.node.attrs:
        return (1.0,)
    left: tuple[float, ...] = tuple(group.numbers(name, None).tolist())
    if not left or not all(0.0 <= share <= 1.0 for share in left):
        raise group.error(f"attribute {name!r}", f"{left}, expected shares from 0 to 1")
    return left
