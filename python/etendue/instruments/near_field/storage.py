"""Near-field measurements as HDF5 files; docs/formats/near-field-runs.md describes them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.formats.hdf5 import LIBRARY, Node, begins_as_hdf5, put, reading, states_format
from etendue.formats.other_kind import foreign
from etendue.formats.output import atomic_output
from etendue.formats.own_kind import NEAR_FIELD
from etendue.formats.strict_json import strict_json
from etendue.instruments.near_field.camera import Camera
from etendue.instruments.near_field.positions import ArmPositions
from etendue.instruments.near_field.setting import Setting, counts_dtype
from etendue.quantities.memory import require_memory
from etendue.quantities.provenance import Provenance
from etendue.units import FLUX_UNITS, FluxUnit

VERSION = 1

CHUNK = 1 << 16
"""Pixels of a chunk."""

DAMAGED = "The file is damaged or cut short: copy it again, or measure again."
FOREIGN = "Give a file (.h5) that `etendue goniophotometer` or NearFieldRun.save wrote."

LENGTHS = ("distance", "photometer_distance", "field_of_view", "lamp_size")
STEPS = ("step_gamma", "step_c")
FLUX_ERROR = "flux_error"
"""Files of before it was kept lack it."""

Array = npt.NDArray[np.float64]
Parts = tuple[
    Setting,
    Array,
    Array,
    npt.NDArray[np.intp],
    npt.NDArray[np.void],
    FluxUnit,
    Provenance,
    tuple[str, ...],
    float | None,
]


def is_run_file(path: Path) -> bool:
    """Whether a file is a near-field measurement, by its content.

    Raises
    ------
    OSError
        If there is no such file.
    """
    return states_format(path, NEAR_FIELD, DAMAGED)


def write_run(
    path: Path,
    setting: Setting,
    illuminance: Array,
    illuminance_error: Array,
    start: npt.NDArray[np.intp],
    records: npt.NDArray[np.void],
    flux_unit: FluxUnit,
    provenance: Provenance,
    notes: tuple[str, ...],
    flux_error: float | None,
) -> Path:
    """See `NearFieldRun.save`, which shows it."""
    import h5py  # noqa: PLC0415

    # The temporary file is locked already: that no other process takes it for one that was left behind.
    with atomic_output(path) as temporary, h5py.File(temporary, "w", libver=LIBRARY, locking=False) as file:
        put(file, format=NEAR_FIELD, version=VERSION, flux_unit=flux_unit)
        put(file, provenance=json.dumps(provenance.to_dict()), notes=json.dumps(list(notes)))
        put(file, **({} if flux_error is None else {FLUX_ERROR: flux_error}))
        put(file, centre=np.array(setting.centre), **{name: getattr(setting, name) for name in LENGTHS})
        put(file, **{name: getattr(setting.positions, name) for name in STEPS})
        put(file.create_group("camera"), **{f.name: float(getattr(setting.camera, f.name)) for f in _camera_fields()})
        for name, values in (
            ("illuminance", illuminance),
            ("illuminance_error", illuminance_error),
            ("start", start.astype("<u8")),
            ("pixel", records["pixel"]),
            ("counts", records["counts"]),
        ):
            chunks = (min(CHUNK, max(len(values), 1)), *values.shape[1:]) if len(values) else None
            packed = {} if chunks is None else {"compression": 4, "shuffle": True, "fletcher32": True}
            file.create_dataset(name, data=values, chunks=chunks, **packed)
    return path


def read_run(path: Path) -> Parts:
    """See `NearFieldRun.load`, which shows it."""
    import h5py  # noqa: PLC0415

    if not begins_as_hdf5(path):
        raise foreign(path, "a near-field measurement", FOREIGN)
    with reading(path, "HDF5", DAMAGED), h5py.File(path, "r") as file:
        node = Node(path, file, DAMAGED)
        if not node.has_text("format", NEAR_FIELD):
            raise foreign(path, "a near-field measurement", FOREIGN, "attribute 'format'")
        if node.integer("version") != VERSION:
            found = f"version {node.integer('version')}"
            raise node.error("attribute 'version'", found, f"This étendue reads {VERSION}: update étendue.")
        setting = _setting(node)
        unit = node.text("flux_unit")
        if unit not in FLUX_UNITS:
            raise node.error("attribute 'flux_unit'", repr(unit))
        light, start, records = _recorded(node, setting)
        provenance = Provenance.from_dict(strict_json(node.text("provenance")))
        notes = strict_json(node.text("notes"))
        if not (isinstance(notes, list) and all(isinstance(note, str) for note in notes)):
            raise node.error("attribute 'notes'", "no list of texts")
        flux_error = node.number(FLUX_ERROR) if FLUX_ERROR in node.node.attrs else None
        if flux_error is not None and flux_error < 0.0:
            raise node.error(f"attribute {FLUX_ERROR!r}", f"{flux_error:g}, below 0")
        return setting, *light, start, records, unit, provenance, tuple(notes), flux_error


def _setting(node: Node) -> Setting:
    camera = {f.name: node.group("camera").number(f.name) for f in _camera_fields()}
    values: dict[str, Any] = {
        f.name: int(camera[f.name]) if f.type == "int" else camera[f.name] for f in _camera_fields()
    }
    lengths: dict[str, float] = {name: node.number(name) for name in LENGTHS}
    if min(lengths.values()) <= 0.0:
        raise node.error("lengths", f"{lengths}; all are above 0")
    x, y, z = node.numbers("centre", (3,)).tolist()
    return Setting(
        ArmPositions(*(node.number(name) for name in STEPS)),
        Camera(**values),
        centre=(x, y, z),
        **lengths,
    )


def _camera_fields() -> tuple[dataclasses.Field[Any], ...]:
    return dataclasses.fields(Camera)


def _recorded(node: Node, setting: Setting) -> tuple[tuple[Array, Array], npt.NDArray[np.intp], npt.NDArray[np.void]]:
    """Illuminance with its error, where each position begins, and the pixels; all of them possible."""
    exposures, stops = setting.camera.exposures, len(setting.positions)
    light = []
    for name in ("illuminance", "illuminance_error"):
        values = node.values(node.dataset(name, np.dtype("<f8"), 1))
        if values.shape != (stops,) or not (np.isfinite(values) & (values >= 0.0)).all():
            raise node.error(f"dataset {name!r}", f"shape {values.shape} for {stops} positions, or a value below 0")
        light.append(values)
    start = node.values(node.dataset("start", np.dtype("<u8"), 1)).astype(np.intp)
    pixel, counts = node.dataset("pixel", np.dtype("<u4"), 1), node.dataset("counts", np.dtype("<u2"), 2)
    whole = start.shape == (stops + 1,) and start[0] == 0 and start[-1] == len(pixel) and (np.diff(start) >= 0).all()
    if not whole:
        raise node.error("dataset 'start'", f"it does not divide {len(pixel):,} pixels among {stops} positions")
    if counts.shape != (len(pixel), exposures):
        raise node.error("dataset 'counts'", f"shape {counts.shape} for {len(pixel):,} pixels of {exposures} exposures")
    dtype = counts_dtype(exposures)
    require_memory(dtype.itemsize * len(pixel), f"{node.path}: {len(pixel):,} pixels")
    records = np.zeros(len(pixel), dtype=dtype)
    records["pixel"], records["counts"] = node.values(pixel), node.values(counts)
    if len(records) and int(records["pixel"].max()) >= setting.camera.pixels**2:
        raise node.error("dataset 'pixel'", f"pixel {int(records['pixel'].max())} of {setting.camera.pixels**2}")
    return (light[0], light[1]), start, records
