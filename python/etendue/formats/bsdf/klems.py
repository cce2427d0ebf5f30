"""Klems matrices in the XML of WINDOW and Radiance: values of patches of the hemisphere, absolute [1/sr]."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.window_xml import DAMAGED, WAYS, azimuth_of, block_of, document, read_window
from etendue.formats.rays.text_rows import number
from etendue.formats.xml_tree import Element
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

ACROSS = 6
"""Midpoints along each coordinate of a patch whose mean is its value."""


@dataclasses.dataclass(frozen=True)
class Basis:
    """Patches of a hemisphere: bands of θ [°], each with so many azimuths, the first of which is centred on 0.

    Parameters
    ----------
    bands : tuple of (lower, upper, count)
    """

    bands: tuple[tuple[float, float, int], ...]

    @property
    def centres(self) -> tuple[Array, Array]:
        """θ and φ of all patches [°]."""
        theta = [0.0 if n == 1 and low == 0.0 else 0.5 * (low + high) for low, high, n in self.bands for _ in range(n)]
        phi = [360.0 * k / n for _, _, n in self.bands for k in range(n)]
        return np.array(theta), np.array(phi)

    @property
    def projected(self) -> Array:
        """Projected solid angle of each patch [sr]."""
        square = [(np.sin(np.radians(high)) ** 2 - np.sin(np.radians(low)) ** 2, n) for low, high, n in self.bands]
        return np.array([np.pi * area / n for area, n in square for _ in range(n)])

    @property
    def size(self) -> int:
        """Number of patches."""
        return sum(n for _, _, n in self.bands)

    def inside(self, k: int) -> tuple[Array, Array]:
        """Angles θ and φ [°] within patch `k`, each of which stands for the same part of its projected solid angle."""
        for low, high, n in self.bands:
            if k < n:
                part = (np.arange(ACROSS) + 0.5) / ACROSS
                squares = np.sin(np.radians([low, high])) ** 2
                theta = np.degrees(np.arcsin(np.sqrt(squares[0] + part * (squares[1] - squares[0]))))
                phi = 360.0 / n * (k - 0.5 + part)
                both = np.meshgrid(theta, phi)
                return both[0].ravel(), both[1].ravel()
            k -= n
        raise IndexError(k)


def _bands(counts: tuple[int, ...], edges: tuple[float, ...]) -> Basis:
    return Basis(tuple(zip(edges[:-1], edges[1:], counts, strict=True)))


BASES = {
    "LBNL/Klems Full": _bands((1, 8, 16, 20, 24, 24, 24, 16, 12), (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)),
    "LBNL/Klems Half": _bands((1, 8, 12, 16, 20, 12, 8), (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90)),
    "LBNL/Klems Quarter": _bands((1, 8, 12, 12, 8), (0, 9, 27, 45, 63, 90)),
}
"""The three bases of Klems, as WINDOW names them."""


def recognise(head: bytes) -> bool:
    """Whether it is an XML of WINDOW that does not announce a tensor tree, which another format reads."""
    return b"<WindowElement" in head and b"TensorTree" not in head


def read(path: Path) -> BsdfData:
    """Read the visible values, of both sides and ways that are there."""
    window = read_window(path)
    if window.structure not in ("Columns", "Rows"):
        found = f"IncidentDataStructure is {window.structure[:40]!r}"
        raise FormatError(path, window.definition.place, found, "Columns or Rows are Klems data.")
    own = dict(_basis(one, path) for one in window.definition.all("AngleBasis"))
    bases = {**BASES, **own}
    slices = [
        one
        for block, way in window.blocks
        for one in _slices(block, path, bases, window.structure, way, window.complaints)
    ]
    return window.data(slices)


def _basis(element: Element, path: Path) -> tuple[str, Basis]:
    bands = []
    for block in element.all("AngleBasisBlock"):
        words = [block.words("ThetaBounds", "LowerTheta") or "0", block.words("ThetaBounds", "UpperTheta")]
        try:
            low, high, count = (number(word) for word in (*words, block.words("nPhis")))
        except ValueError:
            raise FormatError(path, block.place, "a band without bounds and nPhis", DAMAGED) from None
        if not (0.0 <= low < high <= 90.0 and count.is_integer() and 1 <= count <= 4096):
            raise FormatError(path, block.place, f"a band from {low:g} to {high:g}° in {count:g} parts", DAMAGED)
        bands.append((low, high, int(count)))
    edges = [(a[1], b[0]) for a, b in itertools.pairwise(bands)]
    if not bands or any(abs(a - b) > 1e-6 for a, b in edges):
        raise FormatError(path, element.place, "bands that do not join", DAMAGED)
    return element.words("AngleBasisName"), Basis(tuple(bands))


def _slices(
    block: Element,
    path: Path,
    bases: dict[str, Basis],
    structure: str,
    way: tuple[bool, bool],
    complaints: list[Complaint],
) -> list[BsdfSlice]:
    names = [block.words(key) for key in ("ColumnAngleBasis", "RowAngleBasis")]
    if unknown := [name for name in names if name not in bases]:
        raise FormatError(
            path, block.place, f"no angle basis is called {unknown[0][:40]!r}", f"Known: {', '.join(bases)}."
        )
    data = block.first("ScatteringData")
    words = data.text.replace(",", " ").split() if data else []
    incident, outgoing = (bases[name] for name in (names if structure == "Columns" else names[::-1]))
    expected = incident.size * outgoing.size
    if data is None or len(words) != expected:
        place = data.place if data else block.place
        raise FormatError(path, place, f"{len(words)} values; the bases have {expected}", DAMAGED)
    try:
        values = np.array([number(word) for word in words])
    except ValueError as error:
        raise FormatError(path, data.place, str(error), DAMAGED) from None
    if not np.isfinite(values).all():
        raise FormatError(path, data.place, "a value is not finite", DAMAGED)
    complaints += below_zero(values, data.place)
    matrix = values.reshape(
        (outgoing.size, incident.size) if structure == "Columns" else (incident.size, outgoing.size)
    )
    if structure == "Rows":
        matrix = matrix.T
    front, transmitted = way
    points = _points(outgoing, behind=front == transmitted)
    # An index of incidence names where the light goes: it comes from the opposite azimuth.
    thetas, phis = incident.centres
    return [
        BsdfSlice(
            light_from(float(theta), float(azimuth_of(phi + 180.0)), behind=not front),
            column,
            transmitted,
            points=points,
            projected=outgoing.projected,
        )
        for theta, phi, column in zip(thetas, phis, matrix.T, strict=True)
    ]


def _points(basis: Basis, *, behind: bool) -> Array:
    """Centres of the patches as directions in étendue's frame."""
    thetas, phis = basis.centres
    return direction(thetas, azimuth_of(phis), behind=behind)


def fits(data: BsdfData) -> bool:
    """Whether the slices are matrices of the full basis, each of them whole."""
    basis = BASES["LBNL/Klems Full"]
    ways: dict[tuple[bool, bool], int] = {}
    for one in data.slices:
        if one.points is None or len(one.points) != basis.size or one.wavelength is not None:
            return False
        expected = _points(basis, behind=one.front == one.transmitted)
        if not np.allclose(one.points, expected, atol=1e-9) or np.isnan(one.values).any():
            return False
        ways[one.front, one.transmitted] = ways.get((one.front, one.transmitted), 0) + 1
    return bool(ways) and not data.components and all(count == basis.size for count in ways.values())


def tabulate(bsdf: Tabulated) -> BsdfData:
    """The full basis: each value is the mean of f over both of its patches."""
    basis = BASES["LBNL/Klems Full"]
    ways = [way for way, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)) if is_there]
    slices = []
    thetas, phis = basis.centres
    for front in (True, False):
        for transmitted in ways:
            behind = front == transmitted
            inside = [basis.inside(k) for k in range(basis.size)]
            scattered = np.stack([direction(theta, azimuth_of(phi), behind=behind) for theta, phi in inside])
            for k in range(basis.size):
                theta, phi = inside[k]
                # Where the light comes from within its patch, one for each point of the others.
                order = np.arange(theta.size) * 7 % theta.size
                incident = direction(theta[order], azimuth_of(phi[order] + 180.0), behind=not front)
                values = bsdf.evaluate(incident, scattered).mean(axis=1)
                centre = light_from(float(thetas[k]), float(azimuth_of(phis[k] + 180.0)), behind=not front)
                points = _points(basis, behind=behind)
                slices.append(BsdfSlice(centre, values, transmitted, points=points, projected=basis.projected))
    return BsdfData(tuple(slices), isotropic=False, mirrored=False, both_sides=False, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write matrices of the full basis, incidence in columns; nine digits each."""
    basis = BASES["LBNL/Klems Full"]
    lines = [
        "<DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure>",
        "<AngleBasis><AngleBasisName>LBNL/Klems Full</AngleBasisName>",
    ]
    for low, high, n in basis.bands:
        bounds = f"<ThetaBounds><LowerTheta>{low:g}</LowerTheta><UpperTheta>{high:g}</UpperTheta></ThetaBounds>"
        theta = 0.0 if n == 1 else 0.5 * (low + high)
        lines.append(f"<AngleBasisBlock><Theta>{theta:g}</Theta><nPhis>{n}</nPhis>{bounds}</AngleBasisBlock>")
    lines.append("</AngleBasis></DataDefinition>")
    thetas, phis = basis.centres
    for name, (front, transmitted) in WAYS.items():
        own = [one for one in data.slices if (one.front, one.transmitted) == (front, transmitted)]
        if not own:
            continue
        wanted = direction(thetas, azimuth_of(phis + 180.0), behind=not front)
        apart = np.abs(np.array([one.incident for one in own]) - wanted[:, None]).max(axis=2)
        order = apart.argmin(axis=1)
        matrix = np.stack([own[k].values for k in order], axis=1)
        lines += block_of(
            name,
            ["<ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Full</RowAngleBasis>"],
            [",".join(f"{value:.9g}" for value in row) + "," for row in matrix],
        )
    stream.write(document(data.name, lines))
    return ()


FORMAT = BsdfFormat("klems", "Klems XML", (".xml",), recognise, read, fits, tabulate, write)
