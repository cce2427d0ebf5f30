"""The XML of WINDOW and Radiance: what matrices of Klems and tensor trees have in common."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.xml_tree import Element, parse_xml
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.report import Complaint

LARGEST = 1 << 28
DAMAGED = "The file is damaged or cut short; ask for it again."

WAYS = {
    "Transmission Front": (True, True),
    "Transmission Back": (False, True),
    "Reflection Front": (True, False),
    "Reflection Back": (False, False),
}
"""Whether light meets the front, and whether it is transmitted. The front of the file is étendue's."""


def azimuth_of(phi: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Azimuths [°] of the file in étendue's frame, and back.

    The file's are those of Radiance, whose third axis points out of the file's *back*; y, its upwards direction, stays. The
    sample is turned by half a turn about it, so that x changes its sign with z.
    """
    return (180.0 - np.asarray(phi, np.float64)) % 360.0


@dataclasses.dataclass
class Window:
    """The visible data of a file.

    Parameters
    ----------
    path : Path
    layer, definition : Element
        The first layer, and the definition of its data.
    blocks : list of (Element, (front, transmitted))
    complaints : list of Complaint
        Readers of blocks add theirs.
    """

    path: Path
    layer: Element
    definition: Element
    blocks: list[tuple[Element, tuple[bool, bool]]]
    complaints: list[Complaint]

    @property
    def structure(self) -> str:
        """What the data are: Columns, Rows, TensorTree3 or TensorTree4."""
        return self.definition.words("IncidentDataStructure")

    def data(self, slices: Sequence[BsdfSlice], *, isotropic: bool = False) -> BsdfData:
        """The slices with what the file says besides."""
        both = {one.front for one in slices} == {True, False}
        return BsdfData(
            tuple(slices),
            isotropic=isotropic,
            mirrored=False,
            both_sides=not both,
            name=self.layer.words("Material", "Name"),
            complaints=tuple(self.complaints),
        )


def read_window(path: Path) -> Window:
    """The visible blocks of the first layer.

    Raises
    ------
    FormatError
        If it is no such file, or holds no visible values.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise FormatError(path, "length", "more than 256 MiB", "No BSDF of a window is so large.")
    root = parse_xml(data, path)
    layer = root.first("Optical", "Layer")
    definition = layer.first("DataDefinition") if layer else None
    if root.name != "WindowElement" or layer is None or definition is None:
        raise FormatError(path, root.place, "there is no Optical, Layer, DataDefinition", DAMAGED)
    found = Window(path, layer, definition, [], [])
    seen = set()
    for wavelength in layer.all("WavelengthData"):
        colour = wavelength.words("Wavelength")
        if colour != "Visible":
            found.complaints.append(Complaint("note", wavelength.place, f"values for {colour!r} are left out"))
            continue
        for block in wavelength.all("WavelengthDataBlock"):
            way = block.words("WavelengthDataDirection")
            if way not in WAYS or way in seen:
                again = "stands there twice" if way in seen else "is no direction of data"
                raise FormatError(path, block.place, f"{way[:40]!r} {again}", f"Known: {', '.join(WAYS)}.")
            seen.add(way)
            found.blocks.append((block, WAYS[way]))
    if not found.blocks:
        raise FormatError(path, layer.place, "there are no visible values", "Ask for values weighted by V(λ).")
    return found


def block_of(way: str, basis: Sequence[str], data: Sequence[str]) -> list[str]:
    """Lines of one block of visible data."""
    return [
        "<WavelengthData><LayerNumber>System</LayerNumber>",
        '<Wavelength unit="Integral">Visible</Wavelength>',
        f"<WavelengthDataBlock><WavelengthDataDirection>{way}</WavelengthDataDirection>",
        *basis,
        f"<ScatteringDataType>{'BTDF' if WAYS[way][1] else 'BRDF'}</ScatteringDataType>",
        "<ScatteringData>",
        *data,
        "</ScatteringData></WavelengthDataBlock></WavelengthData>",
    ]


def document(name: str, layer: Sequence[str]) -> bytes:
    """A whole file around the lines of its layer."""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<WindowElement xmlns="http://windows.lbl.gov">',
        "<WindowElementType>System</WindowElementType>",
        "<Optical><Layer>",
        f"<Material><Name>{escape(name)}</Name><Manufacturer>-</Manufacturer></Material>",
        *layer,
        "</Layer></Optical>",
        "</WindowElement>",
    ]
    return ("\n".join(lines) + "\n").encode("utf-8")
