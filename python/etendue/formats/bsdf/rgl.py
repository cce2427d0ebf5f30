"""Tensor files of RGL [Dupuy2018]_: measurements on a warped grid that follows the visible normals."""

from __future__ import annotations

import dataclasses
import itertools
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.formats.bsdf.functions import sampled
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.tokens import ADVICE, LARGEST
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.report import Complaint
from etendue.quantities.spectrum import photopic_efficiency

Array = npt.NDArray[np.float64]

MAGIC = b"tensor_file\0"
TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8")
"""Types of values, by their number from 1 on."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

STEEPEST = 89.0
"""Incidences beyond this [°] are left out."""

STEP = 5.0
"""Incidences that lie farther apart [°] get others in between, interpolated as by the authors of the format."""

ISOTROPIC = 2
"""Azimuths of incidence up to which a sample is isotropic, as its authors have it."""

SAME = 1e-3
"""Azimuths that differ by less are one [°]."""


def recognise(head: bytes) -> bool:
    """By the first bytes."""
    return head.startswith(MAGIC)


def read(path: Path) -> BsdfData:
    """Read the BRDF at incidences that were measured and at others in between, as the authors of the format interpolate it.

    f cosθ of the scattered direction is tabled; it is divided by the cosine. Of spectra the mean weighted by V(λ) is taken,
    under light of equal energy, of RGB the luminance. A sample that was measured over a part of the turn is taken to be its
    own image in the rest, as by its authors: see `_images`.
    """
    fields = _fields(path)
    theta_i, phi_i = (np.degrees(_array(path, fields, name, 1).astype(np.float64)) for name in ("theta_i", "phi_i"))
    ndf, sigma = (_array(path, fields, name, 2) for name in ("ndf", "sigma"))
    vndf = _array(path, fields, "vndf", 4)
    values, said = _luminance(path, fields)
    expected = (phi_i.size, theta_i.size)
    if vndf.shape[:2] != expected or values.shape[:2] != expected or min(*ndf.shape, *sigma.shape, *vndf.shape[2:]) < 2:
        raise FormatError(path, "fields", "tables that do not fit the angles of incidence", ADVICE)
    # Densities of visible normals are normalised before they are interpolated.
    vndf = vndf / np.maximum(_integrals(vndf), np.finfo(np.float64).tiny)[..., None, None]
    jacobian = bool(np.any(fields["jacobian"])) if "jacobian" in fields else False
    isotropic = phi_i.size <= ISOTROPIC
    slices = []
    for (j, phi), (i, part, theta) in itertools.product(enumerate(phi_i), _incidences(theta_i)):
        if theta > STEEPEST or (isotropic and j):
            continue
        level, density = (_between(tables[j], i, part) for tables in (values, vndf))
        table = _Table(level, _Warp(density), ndf, sigma, jacobian=jacobian, isotropic=isotropic)
        for azimuth, signs in [(float(phi), (1.0, 1.0))] if isotropic else _images(phi_i, j):
            slices += sampled(table.image(*signs), [(float(theta), azimuth)])
    if not slices:
        raise FormatError(path, "theta_i", "no incidence below 89°", ADVICE)
    text = bytes(fields["description"].ravel().astype("u1").tolist()) if "description" in fields else b""
    name = text.decode("utf-8", "replace").strip("\0 \n")[:100]
    note = "sampled at the measured incidences and in steps of 5° at most; light is scattered by the table made of it"
    return BsdfData(
        tuple(slices),
        isotropic=isotropic,
        mirrored=False,
        name=name or path.stem,
        complaints=(Complaint("note", "values", said), Complaint("note", "grid", note), *below_zero(values)),
    )


def _incidences(theta_i: Array) -> list[tuple[int, float, float]]:
    """Angles of incidence [°]: the number of the measured one below, how far on to the next one, and the angle."""
    found = []
    for i, theta in enumerate(theta_i):
        step = float(theta_i[i + 1] - theta) if i + 1 < theta_i.size else 0.0
        parts = max(int(np.ceil(step / STEP)), 1)
        found += [(i, k / parts, float(theta + step * k / parts)) for k in range(parts)]
    return found


def _between(tables: Array, i: int, part: float) -> Array:
    """Between two incidences, linear in the angle."""
    return np.asarray(tables[i] if part == 0.0 else (1.0 - part) * tables[i] + part * tables[i + 1])


def _images(phi_i: Array, j: int) -> list[tuple[float, tuple[float, float]]]:
    """Azimuths of incidence [°] that a measured one stands for, itself first, by the signs of x and y that lead there.

    Over a quarter of a turn the sample is its own mirror image at x and at y, over a half its own after half a turn.
    """
    span = float(phi_i[-1] - phi_i[0])
    parts = round(360.0 / span) if span > 0.0 else 1
    signs = {1: [], 4: [(1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]}.get(parts, [(-1.0, -1.0)])
    found, taken = [(float(phi_i[j]), (1.0, 1.0))], phi_i.tolist()
    c, s = np.cos(np.radians(phi_i[j])), np.sin(np.radians(phi_i[j]))
    for x, y in signs:
        azimuth = float(np.degrees(np.arctan2(y * s, x * c)))
        if all(abs((azimuth - other + 180.0) % 360.0 - 180.0) > SAME for other in taken):
            found.append((azimuth, (x, y)))
            taken.append(azimuth)
    return found


def _fields(path: Path) -> dict[str, npt.NDArray[np.generic]]:
    """The arrays of a tensor file by name."""
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "Ask for the file with fewer wavelengths.")
    found: dict[str, npt.NDArray[np.generic]] = {}
    at = len(MAGIC)

    def take(form: str) -> tuple[int, ...]:
        nonlocal at
        size = struct.calcsize("<" + form)
        if at + size > len(data):
            raise FormatError(path, f"byte {at}", "the file ends within the list of fields", ADVICE)
        at += size
        return struct.unpack_from("<" + form, data, at - size)

    version = take("2B")
    if version != (1, 0):
        raise FormatError(path, "version", f"{version[0]}.{version[1]}", "étendue reads version 1.0.")
    (count,) = take("I")
    for _ in range(count):
        (length,) = take("H")
        if at + length > len(data):
            raise FormatError(path, f"byte {at}", "the file ends within the name of a field", ADVICE)
        name = data[at : at + length].decode("utf-8", "replace")
        at += length
        dimensions, kind, offset = take("HBQ")
        shape = take(f"{dimensions}Q")
        if not 1 <= kind <= len(TYPES):
            raise FormatError(path, f"field {name[:40]!r}", f"values of type {kind}", ADVICE)
        dtype = np.dtype("<" + TYPES[kind - 1])
        size = 1
        for one in shape:
            size *= one
        if offset + size * dtype.itemsize > len(data):
            raise FormatError(path, f"field {name[:40]!r}", "it goes beyond the end of the file", ADVICE)
        try:
            found[name] = np.frombuffer(data, dtype, size, offset).reshape(shape)
        except (ValueError, OverflowError):
            text = f"{dimensions} dimensions, {size} values"
            raise FormatError(path, f"field {name[:40]!r}", text, ADVICE) from None
    return found


def _array(path: Path, fields: dict[str, npt.NDArray[np.generic]], name: str, dimensions: int) -> Array:
    if name not in fields or fields[name].ndim != dimensions or not fields[name].size:
        raise FormatError(path, f"field {name!r}", f"there is no array of {dimensions} dimensions", ADVICE)
    values = fields[name].astype(np.float64)
    if not np.isfinite(values).all():
        raise FormatError(path, f"field {name!r}", "a value that is not finite", ADVICE)
    return values


def _luminance(path: Path, fields: dict[str, npt.NDArray[np.generic]]) -> tuple[Array, str]:
    if "spectra" in fields:
        spectra = _array(path, fields, "spectra", 5)
        waves = _array(path, fields, "wavelengths", 1)
        weights = photopic_efficiency(waves) * (np.gradient(waves) if waves.size > 1 else 1.0)
        if waves.size != spectra.shape[2] or not weights.sum() > 0.0:
            raise FormatError(path, "wavelengths", "they do not fit the spectra, or none is visible", ADVICE)
        said = f"{waves.size} wavelengths are weighted with V(λ)"
        return np.einsum("l,pilyx->piyx", weights / weights.sum(), spectra), said
    rgb = _array(path, fields, "rgb", 5)
    if rgb.shape[2] != LUMINANCE.size:
        raise FormatError(path, "rgb", f"{rgb.shape[2]} colours", ADVICE)
    return np.einsum("l,pilyx->piyx", LUMINANCE, rgb), "of red, green and blue the luminance is read"


def _integrals(tables: Array) -> Array:
    """Over the unit square of functions that are bilinear on grids, the last two axes."""
    return np.asarray(
        np.trapezoid(np.trapezoid(tables, axis=-1), axis=-1) / ((tables.shape[-1] - 1) * (tables.shape[-2] - 1))
    )


class _Warp:
    """A density that is bilinear on a grid of the unit square, as its distribution function along x, then y."""

    def __init__(self, density: Array) -> None:
        self.density = density
        cells = 0.5 * (density[:, 1:] + density[:, :-1]) / (density.shape[1] - 1)
        self.along = np.concatenate([np.zeros((len(density), 1)), np.cumsum(cells, axis=1)], axis=1)
        rows = self.along[:, -1]
        steps = 0.5 * (rows[1:] + rows[:-1]) / (len(density) - 1)
        self.up = np.concatenate([[0.0], np.cumsum(steps)])

    def distribution(self, x: Array, y: Array) -> tuple[Array, Array]:
        """The share of the density below y, and of that at y the share on the left of x."""
        (i, u), (j, v) = _cell(x, self.density.shape[1]), _cell(y, len(self.density))
        rows = self.along[:, -1]
        step = 1.0 / (len(self.density) - 1)
        below = self.up[j] + step * v * (rows[j] + 0.5 * v * (rows[j + 1] - rows[j]))
        left, at = [], 1.0 / (self.density.shape[1] - 1)
        for k in (j, j + 1):
            first, second = self.density[k, i], self.density[k, i + 1]
            left.append(self.along[k, i] + at * u * (first + 0.5 * u * (second - first)))
        beside = (1.0 - v) * left[0] + v * left[1]
        all_of_it = (1.0 - v) * rows[j] + v * rows[j + 1]
        return beside / np.maximum(all_of_it, 1e-300), below / max(self.up[-1], 1e-300)


def _cell(x: Array, n: int) -> tuple[npt.NDArray[np.intp], Array]:
    place = np.clip(x, 0.0, 1.0) * (n - 1)
    i = np.minimum(place.astype(np.intp), n - 2)
    return i, place - i


def _bilinear(table: Array, x: Array, y: Array) -> Array:
    (i, u), (j, v) = _cell(x, table.shape[1]), _cell(y, len(table))
    low = (1.0 - u) * table[j, i] + u * table[j, i + 1]
    high = (1.0 - u) * table[j + 1, i] + u * table[j + 1, i + 1]
    return np.asarray((1.0 - v) * low + v * high)


@dataclasses.dataclass
class _Table:
    """The tables of one incidence."""

    values: Array
    warp: _Warp
    ndf: Array
    sigma: Array
    _: dataclasses.KW_ONLY
    jacobian: bool
    isotropic: bool

    def image(self, x: float, y: float) -> Callable[[Array, Array], Array]:
        """`f` of the sample mirrored by the signs of x and y."""
        signs = np.array([x, y, 1.0])
        return lambda incident, scattered: self.f(signs * incident, signs * scattered)

    def f(self, incident: Array, scattered: Array) -> Array:
        half = incident + scattered
        half = half / np.linalg.norm(half, axis=-1, keepdims=True)
        theta, phi = np.arccos(np.clip(half[:, 2], -1.0, 1.0)), np.arctan2(half[:, 1], half[:, 0])
        light = np.arctan2(incident[:, 1], incident[:, 0])
        x = np.sqrt(theta * (2.0 / np.pi))
        y = ((phi - light if self.isotropic else phi) + np.pi) / (2.0 * np.pi) % 1.0
        across, up = self.warp.distribution(x, y)
        found = _bilinear(self.values, across, up)
        if self.jacobian:
            from_light = np.sqrt(np.arccos(np.clip(incident[:, 2], -1.0, 1.0)) * (2.0 / np.pi))
            sigma = _bilinear(self.sigma, from_light, (light + np.pi) / (2.0 * np.pi))
            found = found * _bilinear(self.ndf, x, y) / np.maximum(4.0 * sigma, 1e-300)
        cosine = scattered[:, 2]
        return np.where(cosine > 1e-3, found / np.maximum(cosine, 1e-3), np.nan)


FORMAT = BsdfFormat("rgl", "RGL tensor file", (".rgl.bsdf",), recognise, read)
