"""Surface scattering distribution data (SSDD): scatter and specular shares in one file [Kimura2023]_."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError, UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.functions import AZIMUTH_STEP, RADIAL, sampled, values_on
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.regular import KEYS, regular_of
from etendue.formats.bsdf.tokens import ADVICE, LARGEST
from etendue.formats.encodings import decoded
from etendue.formats.rays.text_rows import number
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import photopic_efficiency

Array = npt.NDArray[np.float64]

TYPES = ("brdf", "btdf", "specular_reflectance", "specular_transmittance")
MODELS = {"monochrome": 1, "rgb": 3, "xyz": 3, "spectrum": 0}
SYSTEMS = {
    "spherical_coordinate_system": "normal",
    "specular_coordinate_system": "specular",
    "half_difference_coordinate_system": "half",
}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear RGB with the primaries of ITU-R BT.709; the format does not say which they are."""

HALF_INCIDENCES = (*np.arange(0.0, 81.0, 10.0), 85.0)
"""Angles [°] at which values over half vectors are tabled."""

RIGHT_ANGLE, TURN = 90.0, 45.0


@dataclasses.dataclass
class Block:
    """One data block: its keys, lists of parameters, and values of shape (param3, param2, param1, param0, colours)."""

    line: int
    kind: str
    colours: str
    keys: dict[str, str]
    lists: list[Array]
    values: Array


def recognise(head: bytes) -> bool:
    """By the version and the first key of a block."""
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return re.match(rb"(#[^\n]*\n|\s)*VERSION\s", text) is not None and b"DATA_TYPE" in text


def read(path: Path) -> BsdfData:
    """Read all blocks; of RGB the luminance, of X, Y, Z the second, of spectra the mean weighted by V(λ).

    Directions are away from the surface, light coming from azimuth 0 (or that of the block); of transmitted light the
    third coordinate is reversed, which turns the sense of azimuths about the straight direction.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "No table of a BSDF is so large.")
    blocks = _blocks(path, data)
    complaints: list[Complaint] = []
    slices: list[BsdfSlice] = []
    components: list[Mapping[str, Any]] = []
    isotropic = True
    for block in blocks:
        values, said = _one_colour(path, block)
        complaints += said
        isotropic &= block.lists[1].size <= 1
        if block.kind.startswith("specular"):
            components.append(_specular(path, block, values, complaints))
            continue
        complaints += below_zero(values, f"below line {block.line}")
        if SYSTEMS[block.keys["PARAM_TYPE"]] == "half":
            slices += _half(path, block, values)
        else:
            slices += _polar(path, block, values)
    if len({block.kind for block in blocks}) < len(blocks):
        raise FormatError(path, "DATA_TYPE", "a type of data stands there twice", ADVICE)
    return BsdfData(
        tuple(slices),
        tuple(components),
        isotropic=isotropic,
        mirrored=False,
        name=next((block.keys["NAME"] for block in blocks if "NAME" in block.keys), path.stem),
        complaints=tuple(complaints),
    )


def _blocks(path: Path, data: bytes) -> list[Block]:
    """The blocks of the file; values in ASCII or as float32, little-endian."""
    found: list[Block] = []
    keys: dict[str, str] = {}
    at, line = 0, 0
    while at < len(data):
        end = data.find(b"\n", at)
        if end < 0:
            raise FormatError(path, f"line {line + 1}", "the last line has no end", ADVICE)
        text, at, line = decoded(path, data[at:end]), end + 1, line + 1
        key, _, value = text.partition("#")[0].strip().partition(" ")
        if not key:
            continue
        if key == "DATA_TYPE":
            keys = {}
        keys[key] = value.strip()
        if key != "DATA":
            continue
        if keys.get("DATA_TYPE") not in TYPES or keys.get("COLOR_MODEL") not in MODELS:
            found_text = f"DATA_TYPE {keys.get('DATA_TYPE')!r}, COLOR_MODEL {keys.get('COLOR_MODEL')!r}"
            raise FormatError(path, f"line {line}", found_text[:100], ADVICE)
        if not keys["DATA_TYPE"].startswith("specular") and keys.get("PARAM_TYPE") not in SYSTEMS:
            found_text = f"PARAM_TYPE {keys.get('PARAM_TYPE')!r}"
            raise FormatError(path, f"line {line}", found_text[:100], f"It is one of {', '.join(SYSTEMS)}.")
        begin = line
        lists = [_list(path, line, keys, f"PARAM{k}_LIST") for k in range(5)]
        waves = _list(path, line, keys, "WAVELENGTH_LIST")
        colours = MODELS[keys["COLOR_MODEL"]] or waves.size
        sizes = [max(one.size, 1) for one in lists[:4]][::-1]
        if not lists[0].size or not colours:
            raise FormatError(path, f"line {line}", "no angles of incidence, or no wavelengths", ADVICE)
        count = int(np.prod([*map(float, sizes), colours]))
        if count > LARGEST // 2:
            raise FormatError(path, f"line {line}", f"{count} values are announced", ADVICE)
        if keys["DATA"] == "binary":
            values = np.frombuffer(data, "<f4", count, at) if at + 4 * count <= len(data) else None
            at += 4 * count
        elif keys["DATA"] == "ascii":
            values, at, line = _numbers(data, at, line, count, path)
        else:
            raise FormatError(path, f"line {line}", f"DATA is {keys['DATA'][:20]!r}", "It is ascii or binary.")
        if values is None or not np.isfinite(values).all():
            raise FormatError(path, f"line {line}", f"not {count} finite values", ADVICE)
        shaped = values.astype(np.float64).reshape(*sizes, colours)
        found.append(Block(begin, keys["DATA_TYPE"], keys["COLOR_MODEL"], dict(keys), [*lists, waves], shaped))
        keys = {}
    if not found or "DATA_TYPE" in keys:
        raise FormatError(path, f"line {line}", "a block of data is missing", ADVICE)
    return found


def _numbers(data: bytes, at: int, line: int, count: int, path: Path) -> tuple[Array | None, int, int]:
    """So many numbers from there on, to the next block, and where they end."""
    end = data.find(b"DATA_TYPE", at)
    end = data.rfind(b"\n", at, end) + 1 if end >= 0 else len(data)
    text = decoded(path, data[at:end])
    if text and not text.endswith("\n"):
        return None, at, line + text.count("\n")
    values: list[float] = []
    for at_line, row in enumerate(text.split("\n"), line + 1):
        for word in row.partition("#")[0].split():
            try:
                value = number(word)
            except ValueError:
                value = np.nan
            if not math.isfinite(value):
                raise FormatError(path, f"line {at_line}", f"{word[:40]!r} is no finite number", ADVICE)
            values.append(value)
    return (np.array(values) if len(values) == count else None), end, line + text.count("\n")


def _list(path: Path, line: int, keys: dict[str, str], name: str) -> Array:
    try:
        values = np.array([number(word) for word in keys.get(name, "").split()])
    except ValueError:
        values = np.array([np.nan])
    rises = name == "PARAM4_LIST" or not (np.diff(values) <= 0.0).any()
    if not np.isfinite(values).all() or not rises:
        raise FormatError(path, f"line {line}", f"{name} is no list of rising numbers", ADVICE)
    return values


def _one_colour(path: Path, block: Block) -> tuple[Array, list[Complaint]]:
    if block.colours == "monochrome":
        return block.values[..., 0], []
    place = f"line {block.line}"
    if block.colours == "rgb":
        return block.values @ LUMINANCE, [Complaint("note", place, "of red, green and blue the luminance is read")]
    if block.colours == "xyz":
        return block.values[..., 1], [Complaint("note", place, "of X, Y, Z the second is read")]
    waves = block.lists[5]
    weights = photopic_efficiency(waves) * (np.gradient(waves) if waves.size > 1 else 1.0)
    if not weights.sum() > 0.0:
        raise UnsupportedFormatError(path, place, "a spectrum without visible light", "Ask for visible wavelengths.")
    text = f"{waves.size} wavelengths are weighted with V(λ)"
    return block.values @ (weights / weights.sum()), [Complaint("note", place, text)]


def _specular(path: Path, block: Block, values: Array, complaints: list[Complaint]) -> Mapping[str, Any]:
    """Shares by angle; of several azimuths the mean. Below 0 they are none: a mirror that takes light away is no finish."""
    share = values[0, 0].mean(axis=0)
    if share.max() > 1.0 + 1e-6:
        raise FormatError(path, f"line {block.line}", f"a specular share of {share.max():.6g}", "Shares are at most 1.")
    angle = block.lists[0]
    if angle[0] < 0.0 or angle[-1] > RIGHT_ANGLE:
        raise FormatError(path, f"line {block.line}", "angles of incidence that are not from 0 to 90°", ADVICE)
    if (share < 0.0).any():
        found = f"{(share < 0.0).sum()} of {share.size} specular shares are below 0 and became 0, which adds up to"
        complaints.append(Complaint("warning", f"below line {block.line}", f"{found} {-share.min():.3g} of the light"))
    clipped = np.clip(share, 0.0, 1.0)
    table: Any = float(clipped[0]) if angle.size == 1 else {"angle": angle.tolist(), "values": clipped.tolist()}
    return {"kind": "mixed", block.kind: table}


def _around(path: Path, block: Block, azimuth: Array, values: Array) -> tuple[Array, Array]:
    """Azimuths all around; the first axis of values belongs to them."""
    reduced = "bilateral_symmetry" in block.keys.get("REDUCTION_TYPE", "")
    if azimuth.size == 0:
        return np.zeros(1), values
    if azimuth[0] < 0.0 or azimuth[-1] > (2 * RIGHT_ANGLE if reduced else 4 * RIGHT_ANGLE):
        raise FormatError(path, f"line {block.line}", "azimuths beyond their range", ADVICE)
    if reduced:
        inner = (azimuth > 0.0) & (azimuth < 180.0)
        azimuth = np.concatenate([azimuth, 360.0 - azimuth[inner][::-1]])
        values = np.concatenate([values, values[inner][::-1]])
    if np.ptp(azimuth) == 360.0:
        return azimuth[:-1], values[:-1]
    return azimuth, values


def _polar(path: Path, block: Block, values: Array) -> list[BsdfSlice]:
    """Values about the normal or the specular direction."""
    transmitted = block.kind == "btdf"
    system = SYSTEMS[block.keys["PARAM_TYPE"]]
    thetas, phis, radial, azimuth, offsets = block.lists[:5]
    limit = RIGHT_ANGLE if system == "normal" else 2 * RIGHT_ANGLE
    radial = radial if radial.size else np.zeros(1)
    if thetas[0] < 0.0 or thetas[-1] > RIGHT_ANGLE or radial[0] < 0.0 or radial[-1] > limit:
        raise FormatError(path, f"line {block.line}", "polar angles beyond their range", ADVICE)
    if offsets.size and offsets.size != thetas.size:
        raise FormatError(path, f"line {block.line}", "not as many offsets as angles of incidence", ADVICE)
    found = []
    for j, phi in enumerate(phis if phis.size else np.zeros(1)):
        for i, theta in enumerate(thetas):
            if theta >= RIGHT_ANGLE - 1e-6:
                continue
            around, table = _around(path, block, azimuth, values[:, :, j, i])
            if system == "normal":
                # Counted from where the light comes from, unless the azimuth of incidence is stated.
                found.append(
                    BsdfSlice(light_from(theta, phi), table, transmitted, grid=PolarGrid("normal", radial, around))
                )
                continue
            if transmitted:
                # Mirrored at the surface, the table turns the other way round.
                around = -around[::-1]
                table = table[::-1]
                around = around % 360.0
                order = np.argsort(around)
                around, table = around[order], table[order]
            grid = PolarGrid("specular", radial, around)
            offset = float(offsets[i]) if offsets.size else 0.0
            if offset == 0.0:
                found.append(BsdfSlice(light_from(theta, phi), table, transmitted, grid=grid))
            else:
                found.append(_beside(float(theta), float(phi), offset, grid, table, transmitted=transmitted))
    if not found:
        raise FormatError(path, f"line {block.line}", "no incidence below 90°", ADVICE)
    return found


def _beside(theta: float, phi: float, offset: float, grid: PolarGrid, table: Array, *, transmitted: bool) -> BsdfSlice:
    """A table about a direction in the plane of incidence that lies beside the specular one."""
    # Across the normal light comes from the opposite azimuth, from which azimuths of the grid would count.
    turn = 180.0 if theta + offset < 0.0 else 0.0
    around = PolarGrid("specular", grid.radial, grid.azimuth + turn)
    lobe = BsdfSlice(light_from(abs(theta + offset), phi + turn), table, transmitted, grid=around)
    (one,) = sampled(lambda _, s: lobe.at(s), [(theta, phi)], transmitted=transmitted)
    return one


def _half(path: Path, block: Block, values: Array) -> list[BsdfSlice]:
    """Values over half and difference vectors, at incidences of ours."""
    if block.kind == "btdf":
        advice = "Export it about the normal or the specular direction."
        raise UnsupportedFormatError(path, f"line {block.line}", "transmitted light over half vectors", advice)
    theta_h, phi_h, theta_d, phi_d = (one if one.size else np.zeros(1) for one in block.lists[:4])
    phi_d, table = _around(path, block, phi_d, values)
    if "reciprocity" in block.keys.get("REDUCTION_TYPE", "") and phi_d.size > 1:
        # Light going back: φd half a turn on.
        both = np.concatenate([phi_d % 180.0, phi_d % 180.0 + 180.0])
        around, first = np.unique(np.round(both, 9), return_index=True)
        phi_d, table = around, np.concatenate([table, table])[first]

    def evaluate(incident: Array, scattered: Array) -> Array:
        half = incident + scattered
        half = half / np.linalg.norm(half, axis=-1, keepdims=True)
        height, turn = np.arccos(np.clip(half[:, 2], -1.0, 1.0)), np.arctan2(half[:, 1], half[:, 0])
        c, s = np.cos(turn), np.sin(turn)
        x, y = c * incident[:, 0] + s * incident[:, 1], -s * incident[:, 0] + c * incident[:, 1]
        z = np.sin(height) * x + np.cos(height) * incident[:, 2]
        x = np.cos(height) * x - np.sin(height) * incident[:, 2]
        return _linear(
            table,
            [
                _places(phi_d, np.degrees(np.arctan2(y, x)), around=True),
                _places(theta_d, np.degrees(np.arccos(np.clip(z, -1.0, 1.0)))),
                _places(phi_h, np.degrees(turn), around=True),
                _places(theta_h, np.degrees(height)),
            ],
        )

    turns = (0.0,) if phi_h.size == 1 else tuple(np.arange(0.0, 360.0, TURN))
    return sampled(evaluate, itertools.product(HALF_INCIDENCES, turns))


def _places(nodes: Array, x: Array, *, around: bool = False) -> list[tuple[npt.NDArray[np.intp], Array]]:
    """The two nodes beside each x, with their parts."""
    if nodes.size == 1:
        return [(np.zeros(x.shape, np.intp), np.ones(x.shape))]
    if around:
        nodes, x = np.append(nodes, nodes[0] + 360.0), (x - nodes[0]) % 360.0 + nodes[0]
    low = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.size - 2)
    part = np.clip((x - nodes[low]) / (nodes[low + 1] - nodes[low]), 0.0, 1.0)
    last = nodes.size - 1 if around else nodes.size
    return [(low, 1.0 - part), ((low + 1) % last, part)]


def _linear(table: Array, places: list[list[tuple[npt.NDArray[np.intp], Array]]]) -> Array:
    total = np.zeros(places[0][0][0].shape)
    for corner in itertools.product(*places):
        weight = np.prod([part for _, part in corner], axis=0)
        total += weight * table[tuple(at for at, _ in corner)]
    return np.asarray(total)


def fits(data: BsdfData) -> bool:
    """Whether the slices are one table about the specular direction for each way, from the front, without gaps.

    Beside them, or instead of them, there may be light that is mirrored or goes straight on.
    """
    if not (data.slices or data.components) or regular_of(data.components) is None:
        return False
    for transmitted in (False, True):
        own = [one for one in data.slices if one.transmitted == transmitted]
        first = own[0].grid if own else None
        incidences = {(round(one.phi, 6), round(one.theta, 9)) for one in own}
        if len(incidences) != len(own) or len(own) != len({p for p, _ in incidences}) * len({t for _, t in incidences}):
            return False
        for one in own:
            grid = one.grid
            same = grid is not None and first is not None and np.array_equal(grid.radial, first.radial)
            same = same and grid is not None and first is not None and np.array_equal(grid.azimuth, first.azimuth)
            if not same or grid is None or grid.frame != "specular" or not one.front or one.wavelength is not None:
                return False
            if np.isnan(one.values).any() or np.ptp(grid.azimuth) >= 360.0 or grid.azimuth[0] < 0.0:
                return False
    return True


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Light that meets the front, reflected and transmitted, about the specular direction."""
    grid = PolarGrid("specular", RADIAL, np.arange(0.0, 360.0, AZIMUTH_STEP))
    slices = []
    for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
        for turn in bsdf.turns if is_there else ():
            for theta in bsdf.incidences:
                incident = light_from(theta, turn)
                values = values_on(grid, bsdf, incident, transmitted=transmitted)
                slices.append(BsdfSlice(incident, values, transmitted, grid=grid))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write a block for each way, and for light that is mirrored or goes straight on, in ASCII; nine digits each."""
    name = " ".join(data.name.encode("ascii", "replace").decode("ascii").replace("#", " ").split())
    lines = ["VERSION 0.2", "SOFTWARE etendue"]
    for transmitted in (False, True):
        own = [one for one in data.slices if one.transmitted == transmitted]
        if not own:
            continue
        grid = own[0].grid
        assert grid is not None  # noqa: S101 - `fits` says so
        thetas = sorted({round(one.theta, 9) for one in own})
        phis = sorted({round(one.phi, 6) for one in own})
        lines += ["", f"DATA_TYPE {'btdf' if transmitted else 'brdf'}", "COLOR_MODEL monochrome"]
        lines.append("PARAM_TYPE specular_coordinate_system")
        azimuth = grid.azimuth
        order = np.arange(azimuth.size)
        if transmitted:
            mirrored = -azimuth % 360.0
            order = np.argsort(mirrored)
            azimuth = mirrored[order]
        several = not data.isotropic or len(phis) > 1
        if azimuth[0] == 0.0 and azimuth.size > 1:
            azimuth, order = np.append(azimuth, 360.0), np.append(order, order[0])
        lists = (thetas, phis if several else [], grid.radial.tolist(), azimuth.tolist())
        for k, listed in enumerate(lists):
            if listed:
                lines.append(f"PARAM{k}_LIST " + " ".join(f"{value:.9g}" for value in listed))
        lines += [f"NAME {name}", "DATA ascii"] if name else ["DATA ascii"]
        by_place = {(round(one.phi, 6), round(one.theta, 9)): one.values for one in own}
        table = np.stack([[by_place[phi, theta] for theta in thetas] for phi in phis])[:, :, order]
        lines += [f"{value:.9g}" for value in table.transpose(2, 3, 0, 1).ravel()]
    regular = regular_of(data.components)
    assert regular is not None  # noqa: S101 - `fits` says so
    for kind, share in zip(KEYS, regular.shares, strict=True):
        if share.any():
            lines += ["", f"DATA_TYPE {kind}", "COLOR_MODEL monochrome"]
            lines.append("PARAM0_LIST " + " ".join(f"{angle:.9g}" for angle in regular.angle))
            lines += [f"NAME {name}", "DATA ascii"] if name else ["DATA ascii"]
            lines += [f"{value:.9g}" for value in share]
    stream.write(("\n".join(lines) + "\n").encode("ascii"))
    return () if data.both_sides else ("only light that meets the front is written",)


FORMAT = BsdfFormat("ssdd", "SSDD", (".ssdd",), recognise, read, fits, tabulate, write, holds_regular=True)
