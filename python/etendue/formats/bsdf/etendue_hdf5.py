"""étendue's own file of a BSDF: HDF5 with all that is known, described field by field in docs/formats/bsdf-files.md."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from etendue.errors import ArgumentError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.hdf5 import LIBRARY, SIGNATURE, Node, put, reading
from etendue.formats.strict_json import strict_json
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import GRID_FRAMES, PolarGrid
from etendue.quantities.report import Complaint

KIND, VERSION = "etendue BSDF", 1
DAMAGED = "The file is damaged or cut short, or no BSDF of étendue; write it again."
ARRAYS = {"values": None, "points": 2, "projected": 1, "standard_error": None}
"""Datasets of a slice with their axes; None: two on a grid, one at points."""


def recognise(head: bytes) -> bool:
    """Whether it is an HDF5 file; which one is seen when it is read."""
    return head.startswith(SIGNATURE)


def read(path: Path) -> BsdfData:
    """Read everything."""
    import h5py

    with reading(path, "HDF5 structure", DAMAGED), h5py.File(path, "r") as file:
        top = Node(path, file, DAMAGED)
        if not top.has_text("kind", KIND):
            raise top.error("attribute 'kind'", f"this is no file of kind {KIND!r}", "étendue reads its own BSDFs.")
        if (version := top.integer("version")) != VERSION:
            raise top.error("attribute 'version'", f"version {version}", "A newer étendue wrote it; update this one.")
        count = top.integer("slices")
        if not 0 <= count <= len(file):
            raise top.error("attribute 'slices'", f"{count} slices are announced, {len(file)} are there")
        slices = [_slice(top.group(f"slice{i:06}")) for i in range(count)]
        components = strict_json(top.text("components"))
        facts = strict_json(top.text("facts"))
        complaints = strict_json(top.text("complaints"))
        return BsdfData(
            tuple(slices),
            tuple(components),
            isotropic=top.truth("isotropic"),
            mirrored=top.truth("mirrored"),
            both_sides=top.truth("both_sides"),
            name=top.text("name"),
            complaints=tuple(Complaint(**one) for one in complaints),
            facts=facts,
        )


def _slice(node: Node) -> BsdfSlice:
    gridded = "frame" in node.node.attrs
    arrays: dict[str, Any] = {}
    for name, axes in ARRAYS.items():
        if name in node.node:
            stored = node.dataset(name, np.dtype("<f8"), axes or (2 if gridded else 1))
            arrays[name] = node.values(stored)
    grid = None
    if gridded:
        frame = node.text("frame")
        if frame not in GRID_FRAMES:
            raise node.error("attribute 'frame'", f"{frame!r}")
        radial, azimuth = (node.values(node.dataset(name, np.dtype("<f8"), 1)) for name in ("radial", "azimuth"))
        grid = PolarGrid(frame, radial, azimuth)  # type: ignore[arg-type] # one of them, as was looked at
    optional: dict[str, Any] = {name: node.number(name) for name in ("wavelength", "stated") if name in node.node.attrs}
    # Files of earlier versions do not say.
    optional["interpolated"] = "interpolated" in node.node.attrs and node.truth("interpolated")
    incident = node.numbers("incident", (3,))
    return BsdfSlice(incident, arrays.pop("values"), node.truth("transmitted"), grid=grid, **arrays, **optional)


def fits(data: BsdfData) -> bool:  # noqa: ARG001 - the contract of formats
    """Whatever it is."""
    return True


def tabulate(bsdf: Tabulated) -> BsdfData:
    """All ways and sides on polar grids in direction cosines."""
    slices = []
    radial = np.concatenate([[0.0], np.geomspace(1e-3, 2.0, 60)])
    grid = PolarGrid("cosines", radial, np.arange(0.0, 360.0, 5.0))
    ways = [way for way, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)) if is_there]
    phis = (0.0,) if bsdf.isotropic else tuple((180.0 + turn) % 360.0 for turn in bsdf.turns)
    backs = (False,) if bsdf.both_sides else (False, True)
    colours: tuple[float | None, ...] = bsdf.wavelengths or (None,)
    for behind, way, phi, theta, colour in itertools.product(backs, ways, phis, bsdf.incidences, colours):
        incident = light_from(theta, phi, behind=behind)
        d = grid.directions(incident, transmitted=way)
        there = ~np.isnan(d[..., 0])
        values = np.full(grid.shape, np.nan)
        values[there] = bsdf.evaluate(incident, d[there], wavelength=colour)
        slices.append(BsdfSlice(incident, values, way, grid=grid, wavelength=colour))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, both_sides=bsdf.both_sides, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write everything; nothing is lost."""
    import h5py

    with h5py.File(stream, "w", libver=LIBRARY) as file:
        put(
            file,
            kind=KIND,
            version=VERSION,
            slices=len(data.slices),
            name=data.name,
            isotropic=data.isotropic,
            mirrored=data.mirrored,
            both_sides=data.both_sides,
            components=_json([dict(part) for part in data.components]),
            facts=_json(dict(data.facts)),
            complaints=_json([one.to_dict() for one in data.complaints]),
        )
        for i, one in enumerate(data.slices):
            node = file.create_group(f"slice{i:06}")
            put(node, incident=one.incident, transmitted=one.transmitted, interpolated=one.interpolated)
            for name in ("wavelength", "stated"):
                if (value := getattr(one, name)) is not None:
                    put(node, **{name: value})
            arrays = {name: getattr(one, name) for name in ARRAYS}
            if one.grid is not None:
                put(node, frame=one.grid.frame)
                arrays |= {"radial": one.grid.radial, "azimuth": one.grid.azimuth}
            for name, values in arrays.items():
                if values is not None:
                    node.create_dataset(
                        name, data=values, dtype="<f8", chunks=values.shape, compression="gzip", fletcher32=True
                    )
    return ()


def _json(value: list[dict[str, Any]] | Mapping[str, Any]) -> str:
    try:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"a component holds what no file can: {error}") from None


FORMAT = BsdfFormat("etendue", "étendue BSDF", (".h5",), recognise, read, fits, tabulate, write, holds_errors=True)
