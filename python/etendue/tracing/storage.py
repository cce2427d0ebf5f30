"""Results of traces as HDF5 files; docs/formats/trace-results.md describes them field by field.

A file holds the sums as they are, not the quantities made of them, so that a trace can go on from it to the same bits.
"""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.formats.hdf5 import LIBRARY, Node, begins_as_hdf5, put, reading, states_format
from etendue.formats.other_kind import foreign
from etendue.formats.output import atomic_output, require_room
from etendue.formats.own_kind import TRACE_RESULT
from etendue.formats.strict_json import strict_json
from etendue.quantities.memory import require_memory
from etendue.quantities.spool import MEMORY_LIMIT, Spool
from etendue.scene.dealing import CellSums, Dealing, Units
from etendue.scene.detectors import detection_from_dict
from etendue.scene.scatter_events import EVENT
from etendue.scene.scene import Scene
from etendue.scene.toml import read_toml
from etendue.tracing.plan import Plan, check_cells
from etendue.tracing.scattered import STRETCH, Scattered
from etendue.tracing.sums import ENTRIES, RECORD, Collected, Sums
from etendue.units import FLUX_UNITS

VERSION = 5
"""Illuminance meters and ray collecting surfaces have a cell of all light since version 5, what errors of unequal rays rest
on is held since version 4, far fields are shared by nodes since version 3, and copies of rays are counted together since
version 2."""

CHUNK = 1 << 13
"""Rows of a chunk of rays: half a megabyte."""

IMAGE_LIMIT = 1 << 28
"""Bytes of a file that is made in memory and written in one go; larger ones are written where they stand."""

NAMES = ("source_names", "face_names", "medium_names", "loss_names", "notes")
NUMBERS = ("rays", "seed", "most_events")
SUMS = ("batches", "rays", "segments")
CELLS = {"sum": "<f8", "squares": "<f8", "rays": "<u8", "products": "<f8"}
"""Sums of cells, as of `CellSums`."""

OPEN = {"open_cell": "<u4", "open_unit": "<u8", "open_sum": "<f8", "open_flux": "<f8"}
"""What is kept of units of which more rays may come."""

CELL_BYTES = 32
"""Of a cell in memory: three sums and a count."""

DAMAGED = "The file is damaged or cut short: copy it again, or trace the scene again."
FOREIGN = "Give a file (.h5) that `etendue trace` or TraceResult.save wrote."

MOST_SCENE_BYTES = 1 << 28
"""Of the scene: one that spells out a mesh of a million triangles has a third of it."""

MOST_TEXT_BYTES = 1 << 25
"""Of any other text: names of a hundred thousand parts, or a hundred detectors with all their nodes."""


def is_result_file(path: Path) -> bool:
    """Whether a file is the result of a trace, by its content.

    Raises
    ------
    OSError
        If there is no such file.
    """
    return states_format(path, TRACE_RESULT, DAMAGED)


def save_result(plan: Plan, sums: Sums, path: Path) -> None:
    """See `TraceResult.save`."""
    import h5py  # noqa: PLC0415

    # Rows of 64 bytes, events of 120, three numbers per cell, and room for the rest.
    size = 64 * sum(held.count for held in sums.collected) + CELL_BYTES * sum(c[0].size for c in sums.cells)
    size += EVENT.itemsize * sum(held.count for held in sums.scattered)
    size += len(plan.scene_text.encode()) + (1 << 20)
    with atomic_output(path) as temporary:
        if size <= IMAGE_LIMIT:
            # In one go, because an HDF5 library whose disk is full cannot even close its file.
            image = io.BytesIO()
            with h5py.File(image, "w", libver=LIBRARY) as file:
                _write(file, plan, sums, path.parent)
            temporary.write_bytes(image.getbuffer())
        else:
            require_room(path, size)
            # The temporary file is locked already: that no other process takes it for one that was left behind.
            with h5py.File(temporary, "w", libver=LIBRARY, locking=False) as file:
                _write(file, plan, sums, path.parent)


def load_result(path: Path) -> tuple[Plan, Sums]:
    """See `TraceResult.load`."""
    import h5py  # noqa: PLC0415

    if not begins_as_hdf5(path):
        raise foreign(path, "the result of a trace", FOREIGN)
    with reading(path, "HDF5", DAMAGED), h5py.File(path, "r") as file:
        node = Node(path, file, DAMAGED)
        if not node.has_text("format", TRACE_RESULT):
            raise foreign(path, "the result of a trace", FOREIGN, "attribute 'format'")
        if node.integer("version") != VERSION:
            found = f"version {node.integer('version')}"
            older = node.integer("version") < VERSION
            advice = "of an earlier étendue; trace the scene again" if older else "update étendue"
            raise node.error("attribute 'version'", found, f"This étendue reads {VERSION}: {advice}.")
        plan = _plan(node.group("plan"), path)
        return plan, _sums(node.group("sums"), plan)


# --- writing ---------------------------------------------------------------------------------------------------------


def _write(file: Any, plan: Plan, sums: Sums, folder: Path) -> None:
    put(file, format=TRACE_RESULT, version=VERSION, length_unit="mm", wavelength_unit="nm", flux_unit=plan.flux_unit)
    group = file.create_group("plan")
    put(group, scene_name=plan.scene_name, fingerprint=plan.fingerprint, flux_unit=plan.flux_unit)
    put(group, **{name: np.uint64(getattr(plan, name)) for name in NUMBERS})
    # Files that the scene names are found from where the result is.
    _put_text(group, "scene", plan.scene.to_toml(folder) if plan.scene_text and plan.scene else plan.scene_text)
    sets = [(-1, 0) if held is None else held for held in plan.dealing.sets]
    _put_array(group, "source_flux", np.array(plan.dealing.flux, dtype=np.float64))
    _put_array(group, "source_set", np.array([number for number, _ in sets], dtype=np.int64))
    _put_array(group, "source_set_rays", np.array([length for _, length in sets], dtype=np.uint64))
    for name in NAMES:
        _put_text(group, name, json.dumps(getattr(plan, name)))
    _put_text(group, "detectors", json.dumps([detection.to_dict() for detection in plan.detections]))
    group = file.create_group("sums")
    put(group, **{name: np.uint64(getattr(sums, name)) for name in SUMS}, imbalance=sums.imbalance)
    put(group, lost_at=np.array([-1 if at is None else at for at in sums.lost_at], dtype=np.int64))
    for name in ENTRIES:
        entry = group.create_group(name)
        flux, rays = sums.ledger[name]
        _put_array(entry, "flux", flux)
        _put_array(entry, "rays", rays)
    for i, (cells, held, events) in enumerate(zip(sums.cells, sums.collected, sums.scattered, strict=True)):
        detector = group.create_group(f"detector_{i}")
        _put_cells(detector, cells, sums.open_units[i])
        _put_array(detector, "records", held.array().view("<f8").reshape(-1, 8))
        if plan.detections[i].most_events:
            _put_events(detector, events)
    _put_cells(group.create_group("births"), sums.sources, sums.open_units[-1])


def _put_cells(group: Any, cells: CellSums, begun: Units) -> None:
    """Sums of cells, and what they have of rays of which more copies may come."""
    arrays: dict[str, npt.NDArray[Any]] = dict(zip((*CELLS, *OPEN), (*cells, *begun), strict=True))
    for name, array in arrays.items():
        _put_array(group, name, array)


def _put_array(group: Any, name: str, values: npt.NDArray[Any]) -> None:
    if not values.size:
        group.create_dataset(name, data=values)
        return
    # Records are read row by row, sums of cells stratum by stratum.
    records = name == "records"
    chunks = (min(len(values), CHUNK), 8) if records else (*(1,) * (values.ndim - 1), min(values.shape[-1], CHUNK))
    # The digits of rays are as good as random: packing them takes long and saves little.
    packed = {} if records else {"shuffle": True, "compression": "gzip"}
    group.create_dataset(name, data=values, chunks=chunks, fletcher32=True, **packed)


def _put_events(group: Any, events: Scattered) -> None:
    """Scatter events, a column after the other; all but places and directions say the same over and over."""
    put(group, level=np.uint64(events.level))
    for name in EVENT.names or ():
        dtype, shape = EVENT[name].base, (events.count, *EVENT[name].shape)
        packed = {} if name in {"position", "direction"} else {"shuffle": True, "compression": "gzip"}
        chunks = {"chunks": (min(events.count, CHUNK), *shape[1:]), "fletcher32": True} | packed
        column = group.create_dataset(name, shape, dtype, **(chunks if events.count else {}))
        for number, rows in enumerate(events.stretches()):
            start = number * STRETCH
            column[start : start + len(rows)] = rows[name]


def _put_text(group: Any, name: str, text: str) -> None:
    """A text of any length, as its bytes in UTF-8: an attribute holds 64 kB at most."""
    _put_array(group, name, np.frombuffer(text.encode("utf-8"), dtype=np.uint8))


# --- reading ---------------------------------------------------------------------------------------------------------


def _plan(group: Node, path: Path) -> Plan:
    unit = group.text("flux_unit")
    if unit not in FLUX_UNITS:
        raise group.error("attribute 'flux_unit'", f"{unit!r} is none of {', '.join(FLUX_UNITS)}")
    detections = tuple(detection_from_dict(data) for data in strict_json(_text(group, "detectors")))
    check_cells(detections)
    text = _text(group, "scene", MOST_SCENE_BYTES)
    return Plan(
        scene_name=group.text("scene_name"),
        scene_text=text,
        fingerprint=group.text("fingerprint"),
        flux_unit="W" if unit == "W" else "lm",
        dealing=_dealing(group),
        detections=detections,
        rays=group.integer("rays"),
        seed=group.integer("seed"),
        most_events=group.integer("most_events"),
        source_names=_texts(group, "source_names"),
        face_names=_texts(group, "face_names"),
        medium_names=_texts(group, "medium_names"),
        loss_names=_texts(group, "loss_names"),
        notes=_texts(group, "notes"),
        scene=_scene(text, path) if any(detection.most_events for detection in detections) else None,
    )


def _scene(text: str, path: Path) -> Scene | None:
    """The scene that scatter events are looked at in."""
    return Scene.from_dict(read_toml(path, text.encode()), folder=path.parent, source=path) if text else None


def _sums(group: Node, plan: Plan) -> Sums:
    lengths = {
        "emitted": len(plan.source_names),
        "escaped": 1,
        "on_face": len(plan.face_names),
        "in_medium": len(plan.medium_names),
        "terminated": 1,
        "lost": len(plan.loss_names),
    }
    entries = {}
    for name, length in lengths.items():
        entry = group.group(name)
        entries[name] = (_row(entry, "flux", "<f8", length), _row(entry, "rays", "<u8", length))
    numbers = {name: group.integer(name) for name in SUMS}
    if not 0 < numbers["rays"] <= plan.rays:
        raise group.error("attribute 'rays'", f"{numbers['rays']} of {plan.rays} rays are done")
    lost_at = group.numbers("lost_at", (lengths["lost"],)).astype(np.int64).tolist()
    count = sum(detection.cells for detection in plan.detections) + len(plan.source_names) + 1
    held = f"{group.path}: sums of {count:,} cells from {plan.dealing.strata:,} strata of rays"
    require_memory(CELL_BYTES * count * plan.dealing.strata, held)
    cells, begun, collected, scattered = [], [], [], []
    for i, detection in enumerate(plan.detections):
        detector = group.group(f"detector_{i}")
        cells.append(_cells(detector, plan.dealing.strata, detection.cells))
        begun.append(_open(detector))
        spool, count = Spool(RECORD), 0
        for part in _records(detector):
            spool.append(part)
            count += len(part)
        collected.append(Collected(spool, count))
        scattered.append(_events(detector, detection.most_events))
    births = group.group("births")
    begun.append(_open(births))
    return Sums(
        **numbers,
        imbalance=group.number("imbalance"),
        ledger=entries,
        lost_at=tuple(None if at < 0 else at for at in lost_at),
        cells=tuple(cells),
        sources=_cells(births, plan.dealing.strata, len(plan.source_names) + 1),
        open_units=tuple(begun),
        collected=tuple(collected),
        scattered=tuple(scattered),
    )


def _cells(group: Node, strata: int, cells: int) -> CellSums:
    sum_, squares, rays, products = (_row(group, name, dtype, strata, cells) for name, dtype in CELLS.items())
    return sum_, squares, rays, products


def _open(group: Node) -> Units:
    length = group.dataset("open_cell", np.dtype(OPEN["open_cell"]), 1).shape[0]
    cell, unit, sum_, flux = (_row(group, name, dtype, length) for name, dtype in OPEN.items())
    return cell, unit, sum_, flux


def _dealing(group: Node) -> Dealing:
    """Which source gives out which ray."""
    n = len(_texts(group, "source_names"))
    flux, rays = _row(group, "source_flux", "<f8", n), group.integer("rays")
    pairs = zip(
        *(_row(group, name, dtype, n) for name, dtype in (("source_set", "<i8"), ("source_set_rays", "<u8"))),
        strict=True,
    )
    if not (n and np.isfinite(flux).all() and (flux > 0.0).all() and rays > 0):
        raise group.error("dataset 'source_flux'", "it is not a positive flux of each source")
    sets = tuple(None if number < 0 else (int(number), int(length)) for number, length in pairs)
    return Dealing(tuple(flux.tolist()), sets, rays)


def _row(group: Node, name: str, dtype: str, *shape: int) -> npt.NDArray[Any]:
    data = group.dataset(name, np.dtype(dtype), len(shape))
    if data.shape != shape:
        raise group.error(f"dataset {name!r}", f"shape {data.shape}, expected {shape}")
    return group.values(data)


def _records(group: Node) -> Iterator[npt.NDArray[Any]]:
    """The rays of a detector, some megabytes at a time."""
    data = group.dataset("records", np.dtype("<f8"), 2)
    if data.shape[1] != RECORD.itemsize // 8:
        raise group.error("dataset 'records'", f"shape {data.shape}, expected 8 columns")
    _require_spool(group, "records", data.nbytes)
    for start in range(0, len(data), 16 * CHUNK):
        yield np.ascontiguousarray(data[start : start + 16 * CHUNK]).view(RECORD).reshape(-1)


def _events(group: Node, most: int) -> Scattered:
    """The scatter events of a detector, if it keeps any."""
    events = Scattered.nothing(most)
    if not most:
        return events
    level = group.integer("level")
    if not 0 <= level <= _core.deepest():
        raise group.error("attribute 'level'", f"{level} is not from 0 to {_core.deepest()}")
    columns = {name: group.dataset(name, EVENT[name].base, 1 + len(EVENT[name].shape)) for name in EVENT.names or ()}
    count = len(columns["ray"])
    for name, column in columns.items():
        if column.shape != (count, *EVENT[name].shape):
            raise group.error(f"dataset {name!r}", f"shape {column.shape}, expected {(count, *EVENT[name].shape)}")
    if count > most:
        raise group.error("dataset 'ray'", f"{count:,} scatter events, but {most:,} are kept at most")
    _require_spool(group, "scatter events", count * EVENT.itemsize)
    for start in range(0, count, STRETCH):
        rows = np.zeros(min(STRETCH, count - start), EVENT)
        for name, column in columns.items():
            rows[name] = column[start : start + len(rows)]
        events.spool.append(rows)
    return Scattered(events.spool, count, level, most)


def _require_spool(group: Node, what: str, size: int) -> None:
    """Refuse records that go to a temporary file for which there is no room."""
    if size > MEMORY_LIMIT:
        require_room(Path(tempfile.gettempdir()), size, f"for the {what} of {group.path}")


def _text(group: Node, name: str, most: int = MOST_TEXT_BYTES) -> str:
    data = group.dataset(name, np.dtype("u1"), 1)
    if data.size > most:
        raise group.error(f"dataset {name!r}", f"a text of {data.size:,} bytes; {most:,} are allowed")
    return group.values(data).tobytes().decode("utf-8")


def _texts(group: Node, name: str) -> tuple[str, ...]:
    texts = strict_json(_text(group, name))
    if not (isinstance(texts, list) and all(isinstance(text, str) for text in texts)):
        raise group.error(f"dataset {name!r}", "it is not a list of texts")
    return tuple(texts)
