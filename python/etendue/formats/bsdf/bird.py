"""The universal BRDF file of the metrologists' project BiRD: JSON with uncertainties [Lanevski2022]_."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero, slices_of
from etendue.formats.bsdf.tokens import ADVICE, LARGEST
from etendue.formats.strict_json import strict_json
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

SCHEMA = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json"

ANGLES = ("theta_i", "phi_i", "theta_r", "phi_r")
DEGREES = {"deg": 1.0, "°": 1.0, "rad": 180.0 / np.pi}
NANOMETRES = {"nm": 1.0, "μm": 1e3, "µm": 1e3, "um": 1e3}
PER_STERADIAN = {"1/sr": 1.0, "sr^-1": 1.0}

THETA = np.concatenate([np.arange(0.0, 80.0, 5.0), np.arange(80.0, 90.0, 3.0)])
PHI_STEP = 10.0
"""Directions of tables that are made to be written [°]."""


def recognise(head: bytes) -> bool:
    """JSON whose metadata name the project's schema, or a type "BRDF" and its variables."""
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return text.startswith(b"{") and (
        b"BRDF_JSON_schema" in text or re.search(rb'"type"\s*:\s*"BRDF"', text) is not None
    )


def read(path: Path) -> BsdfData:
    """Read values with their uncertainty, by wavelength; of two polarisations the mean.

    Angles are of directions away from the sample. Uncertainties are taken as standard ones (k = 1).
    """
    with path.open("rb") as file:
        text = file.read(LARGEST + 1)
    if len(text) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "No measurement of a BRDF is so large.")
    try:
        content = strict_json(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(path, "JSON", str(error)[:120], ADVICE) from None
    content = _object(path, "file", content)
    metadata, data = (_object(path, key, content.get(key)) for key in ("metadata", "data"))
    values = _column(path, data, "BRDF", PER_STERADIAN)
    angles = np.column_stack([_column(path, data, name, DEGREES, values.size) for name in ANGLES])
    if (angles < 0.0).any() or (angles[:, [0, 2]] >= 90.0).any() or (angles > 360.0).any():
        raise FormatError(path, "data", "angles that are not from 0 to 90° and 0 to 360°", ADVICE)
    waves = [key for key in ("wavelength_i", "wavelength_r") if key in data]
    wavelengths = _column(path, data, waves[0], NANOMETRES, values.size) if waves else None
    errors = _uncertainty(path, data, values)
    complaints = below_zero(values)
    slices: list[BsdfSlice] = []
    for wavelength in [None] if wavelengths is None else np.unique(wavelengths).tolist():
        own = np.ones(values.size, bool) if wavelengths is None else wavelengths == wavelength
        known = None if errors is None else errors[own]
        slices += slices_of(angles[own], values[own], complaints, wavelength=wavelength, errors=known)
    sample = metadata.get("sample")
    sample = sample if isinstance(sample, dict) else {}
    turns = {round(one.phi, 3) for one in slices if one.theta > 1e-3}
    name = sample.get("name")
    return BsdfData(
        tuple(slices),
        isotropic=len(turns) <= 1 or sample.get("properties_symmetry") == "isotropic",
        mirrored=False,
        both_sides=True,
        name=name if isinstance(name, str) else path.stem,
        complaints=tuple(complaints),
        facts=_facts(metadata),
    )


def _object(path: Path, what: str, found: object) -> dict[str, Any]:
    if not isinstance(found, dict):
        raise FormatError(path, what, f"{what} is no object", ADVICE)
    return found


def _column(path: Path, data: dict[str, Any], name: str, units: dict[str, float], count: int | None = None) -> Array:
    variable = _object(path, f"data, {name}", data.get(name))
    unit = variable.get("unit")
    if unit not in units:
        raise FormatError(path, f"data, {name}", f"the unit is {str(unit)[:20]!r}", f"It is one of {', '.join(units)}.")
    values = variable.get("values")
    if not isinstance(values, list) or not values or not all(type(value) in (int, float) for value in values):
        raise FormatError(path, f"data, {name}", "no list of numbers", ADVICE)
    if count is not None and len(values) != count:
        raise FormatError(path, f"data, {name}", f"{len(values)} values for {count} of BRDF", ADVICE)
    return np.array(values, np.float64) * units[unit]


def _uncertainty(path: Path, data: dict[str, Any], values: Array) -> Array | None:
    """Of each value [1/sr]: a column of its own, or one number for all."""
    units = {**PER_STERADIAN, "%": 0.01}
    if "uBRDF" in data:
        errors = _column(path, data, "uBRDF", units, values.size)
        unit = data["uBRDF"]["unit"]
    elif isinstance(one := data["BRDF"].get("uncertainty"), dict):
        unit, value = one.get("unit"), one.get("value")
        if unit not in units or not isinstance(value, int | float) or isinstance(value, bool):
            raise FormatError(path, "data, BRDF, uncertainty", "no value with a unit", ADVICE)
        errors = np.full(values.size, float(value) * units[unit])
    else:
        return None
    if errors.min() < 0.0:
        raise FormatError(path, "data", "an uncertainty below 0", ADVICE)
    return errors * np.abs(values) if unit == "%" else errors


def _facts(metadata: dict[str, Any]) -> dict[str, str]:
    """What is said of the instrument: aperture, solid angle and beam."""
    found: dict[str, str] = {
        key: str(metadata[key])[:200] for key in ("method", "timestamp", "description") if key in metadata
    }
    instrument = metadata.get("instrumentation")
    for system, keys in (
        ("illumination_system", ("aperture", "beam")),
        ("detection_system", ("aperture", "solid_angle")),
    ):
        part = instrument.get(system) if isinstance(instrument, dict) else None
        for key in keys:
            if isinstance(part, dict) and key in part:
                found[f"{system}: {key}"] = json.dumps(part[key], ensure_ascii=False)[:300]
    return found


def fits(data: BsdfData) -> bool:
    """Whether the slices are tables of reflected light about the normal, below 90°, in front of the sample."""
    return (
        bool(data.slices)
        and not data.components
        and len({one.wavelength is None for one in data.slices}) == 1
        and len({one.standard_error is None for one in data.slices}) == 1
        and all(
            one.grid is not None
            and one.grid.frame == "normal"
            and one.front
            and not one.transmitted
            and one.grid.radial[-1] < 90.0
            and not np.isnan(one.values).any()
            for one in data.slices
        )
    )


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Reflected light that meets the front, at each wavelength that is known."""
    slices = []
    for turn in bsdf.turns:
        for theta, wave in itertools.product(bsdf.incidences, bsdf.wavelengths or (None,)):
            incident = light_from(theta, (180.0 + turn) % 360.0)
            grid = PolarGrid("normal", THETA, np.arange(0.0, 360.0, PHI_STEP))
            f = bsdf.evaluate(incident, grid.directions(incident, transmitted=False), wavelength=wave)
            slices.append(BsdfSlice(incident, f, grid=grid, wavelength=wave))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write variables, a line for each; what the schema demands of metadata and is not known stands there as "unknown"."""
    columns: dict[str, list[float]] = {name: [] for name in (*ANGLES, "BRDF", "wavelength_i", "uBRDF")}
    for one in data.slices:
        grid = one.grid
        assert grid is not None  # noqa: S101 - `fits` says so
        for k, azimuth in enumerate(grid.azimuth % 360.0):
            for i, polar in enumerate(grid.radial):
                if i == 0 and k > 0 and polar == 0.0:
                    continue
                row = (one.theta, one.phi, float(polar), float(azimuth), float(one.values[k, i]))
                for name, value in zip((*ANGLES, "BRDF"), row, strict=True):
                    columns[name].append(round(value, 9) if name != "BRDF" else value)
                if one.wavelength is not None:
                    columns["wavelength_i"].append(one.wavelength)
                if one.standard_error is not None:
                    columns["uBRDF"].append(float(one.standard_error[k, i]))
    units = {**dict.fromkeys(ANGLES, "deg"), "BRDF": "1/sr", "uBRDF": "1/sr", "wavelength_i": "nm"}
    sample = {"name": data.name or "unknown"}
    if data.isotropic:
        sample["properties_symmetry"] = "isotropic"
    metadata = {
        "schema": SCHEMA,
        "id": "unknown",
        "type": "BRDF",
        "timestamp": "1970-01-01T00:00:00+00",
        "provenance": {"organization": "unknown"},
        "license": {"type": "unknown"},
        "description": "Written by etendue.",
        "method": "unknown",
        "sample": sample,
    }
    # The encoder that puts each number on a line of its own is the slow one.
    lines = [f'  "{name}": {_json({"unit": units[name], "values": v})}' for name, v in columns.items() if v]
    text = f'{{\n "metadata": {_json(metadata)},\n "data": {{\n' + ",\n".join(lines) + "\n }\n}\n"
    stream.write(text.encode("utf-8"))
    lost = []
    if any(one.standard_error is not None and one.interpolated for one in data.slices):
        lost.append("the file does not say that standard errors of neighbouring values go together")
    if not data.both_sides:
        lost.append("only light that meets the front is written")
    return tuple(lost)


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


FORMAT = BsdfFormat("bird", "BiRD JSON", (".json",), recognise, read, fits, tabulate, write, holds_errors=True)
