"""Tensor trees of Radiance: values of cells that are as fine as the BSDF needs, absolute [1/sr]."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, Tabulated
from etendue.formats.bsdf.points import below_zero
from etendue.formats.bsdf.window_xml import DAMAGED, WAYS, block_of, document, read_window
from etendue.formats.xml_tree import Element
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice

Array = npt.NDArray[np.float64]

BASIS = "LBNL/Shirley-Chiu"

DEEPEST = 10
"""Halvings of the square of directions: cells of 0.1°."""

COARSEST = 4
"""Cells are cut at least so often, so that each point stands for what is near to it."""

INCIDENT, INCIDENT_ROUND = 4, 6
"""Halvings of incident directions of anisotropic and of isotropic trees: those at which they are read."""

ACROSS = 3
"""Midpoints along each side of a scattered cell whose mean is its value, of trees that are made to be written."""


def recognise(head: bytes) -> bool:
    """Whether it is an XML of WINDOW that announces a tensor tree."""
    return b"<WindowElement" in head and b"TensorTree" in head


def disk_of(square: Array) -> Array:
    """Points of the unit disk, shape (…, 2), of points of the unit square: the concentric map, which keeps areas."""
    a, b = np.moveaxis(2.0 * square - 1.0, -1, 0)
    wide = np.abs(a) > np.abs(b)
    r = np.where(wide, a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.where(wide, 0.25 * np.pi * b / a, 0.5 * np.pi - 0.25 * np.pi * a / b)
    turn = np.where(r == 0.0, 0.0, turn)
    return np.stack([r * np.cos(turn), r * np.sin(turn)], axis=-1)


class _Tree:
    """Cells of the unit cube: a branch with a child for each corner, or a grid of values.

    Of the corners, bit i of the number says whether coordinate i is in its upper half; of grids the last coordinate runs
    fastest.
    """

    def __init__(self, rank: int, grid: Array | None = None, children: tuple[_Tree, ...] = ()) -> None:
        self.rank, self.grid, self.children = rank, grid, children

    def at(self, place: tuple[float, ...]) -> tuple[Array, Array, Array]:
        """Of all cells over a point of incident directions: centres on the square of scattered ones, widths, values."""
        if self.grid is not None:
            n = self.grid.shape[0]
            values = self.grid[tuple(min(int(x * n), n - 1) for x in place)].ravel()
            centres = np.stack(np.meshgrid(*2 * [(np.arange(n) + 0.5) / n], indexing="ij"), axis=-1).reshape(-1, 2)
            return centres, np.full(values.size, 1.0 / n), values
        own = sum((x >= 0.5) << i for i, x in enumerate(place))
        inner = tuple(2.0 * x % 1.0 for x in place)
        parts = []
        first = len(place)
        for k in range(4):
            child = self.children[own | (k & 1) << first | (k >> 1) << (first + 1)]
            centres, widths, values = child.at(inner)
            parts.append((0.5 * (centres + np.array([k & 1, k >> 1])), 0.5 * widths, values))
        centres, widths, values = (np.concatenate(column) for column in zip(*parts, strict=True))
        return centres, widths, values

    def depth(self) -> int:
        """Halvings to its finest cells."""
        if self.grid is not None:
            return int(np.log2(self.grid.shape[0]))
        return 1 + max(child.depth() for child in self.children)


def _parsed(data: Element, path: Path, rank: int) -> tuple[_Tree, Array]:
    """The tree of a text of nested braces, and all of its values."""
    text = data.text
    open_branches: list[list[_Tree]] = []
    leaf_from: int | None = None
    root: _Tree | None = None
    leaves: list[Array] = []

    def refuse(found: str) -> FormatError:
        return FormatError(path, data.place, found, DAMAGED)

    def close(tree: _Tree) -> None:
        nonlocal root
        if open_branches:
            open_branches[-1].append(tree)
        elif root is None:
            root = tree
        else:
            raise refuse("a second tree")

    for brace in re.finditer(r"[{}]", text):
        if brace.group() == "{":
            if leaf_from is not None and text[leaf_from : brace.start()].strip(" \t\r\n,"):
                raise refuse("values beside branches")
            open_branches.append([])
            leaf_from = brace.end()
            if len(open_branches) > DEEPEST + 1:
                raise refuse(f"braces nested more than {DEEPEST} deep")
            continue
        if not open_branches:
            raise refuse("a brace too many")
        children = open_branches.pop()
        if children:
            if len(children) != 1 << rank:
                raise refuse(f"a branch of {len(children)}; it has {1 << rank}")
            close(_Tree(rank, None, tuple(children)))
        else:
            grid = _grid(text[leaf_from : brace.start()], rank)
            if grid is None:
                raise refuse("a leaf that is no grid of finite numbers")
            leaves.append(grid.ravel())
            close(_Tree(rank, grid))
        leaf_from = None
    if open_branches or root is None:
        raise refuse("braces that do not close")
    return root, np.concatenate(leaves)


def _grid(text: str, rank: int) -> Array | None:
    try:
        values = np.array(text.replace(",", " ").split(), np.float64)
    except ValueError:
        return None
    n = round(max(values.size, 1) ** (1.0 / rank))
    power = n > 0 and n & (n - 1) == 0 and n <= 1 << DEEPEST
    if n**rank != values.size or not power or not np.isfinite(values).all():
        return None
    return values.reshape((n,) * rank)


def read(path: Path) -> BsdfData:
    """Read the visible trees of both sides and ways that are there, at the centres of cells of incidence.

    Each slice holds all scattered cells over its incident direction. Of trees of rank 3 (isotropic) light goes on towards
    the first axis of the square.
    """
    window = read_window(path)
    rank = {"TensorTree3": 3, "TensorTree4": 4}.get(window.structure)
    if rank is None:
        found = f"IncidentDataStructure is {window.structure[:40]!r}"
        raise FormatError(path, window.definition.place, found, "It is TensorTree3 or TensorTree4.")
    slices: list[BsdfSlice] = []
    for block, (front, transmitted) in window.blocks:
        data = block.first("ScatteringData")
        basis = block.words("AngleBasis")
        if data is None or (basis and basis.casefold() != BASIS.casefold()):
            found = f"the angle basis is {basis[:40]!r}" if data else "there is no ScatteringData"
            raise FormatError(path, block.place, found, f"It is {BASIS}.")
        tree, values = _parsed(data, path, rank)
        window.complaints += below_zero(values, data.place)
        for place, beta in _incidences(tree):
            slices.append(_slice(tree, place, beta, front=front, transmitted=transmitted))
    return window.data(slices, isotropic=rank == 3)


def _incidences(tree: _Tree) -> list[tuple[tuple[float, ...], Array]]:
    """Places on the incident coordinates, and where on the disk the light goes."""
    if tree.rank == 3:
        n = 1 << min(max(tree.depth(), 1), INCIDENT_ROUND)
        x = (np.arange(n // 2)[::-1] + 0.5) / n
        return [((float(one),), np.array([1.0 - 2.0 * one, 0.0])) for one in x]
    n = 1 << min(max(tree.depth(), 1), INCIDENT)
    places = np.stack(np.meshgrid(*2 * [(np.arange(n) + 0.5) / n], indexing="ij"), axis=-1).reshape(-1, 2)
    return [((float(x), float(y)), disk) for (x, y), disk in zip(places, disk_of(places), strict=True)]


def _directions(beta: Array, *, behind: bool) -> Array:
    """Directions of étendue's frame: see `window_xml.azimuth_of`."""
    height = np.sqrt(np.maximum(1.0 - np.sum(beta * beta, axis=-1), 0.0))
    return np.stack([-beta[..., 0], beta[..., 1], -height if behind else height], axis=-1)


def _slice(tree: _Tree, place: tuple[float, ...], towards: Array, *, front: bool, transmitted: bool) -> BsdfSlice:
    centres, widths, values = tree.at(place)
    while (wide := widths > 1.01 / (1 << COARSEST)).any():
        quarters = [centres[wide] + 0.25 * widths[wide, None] * np.array([i, j]) for i in (-1, 1) for j in (-1, 1)]
        centres = np.concatenate([centres[~wide], *quarters])
        values = np.concatenate([values[~wide], *4 * [values[wide]]])
        widths = np.concatenate([widths[~wide], *4 * [0.5 * widths[wide]]])
    return BsdfSlice(
        _directions(-towards, behind=not front),
        values,
        transmitted,
        points=_directions(disk_of(centres), behind=front == transmitted),
        projected=np.pi * widths * widths,
    )


def fits(data: BsdfData) -> bool:
    """Whether the slices are the cells of whole even trees, as `tabulate` makes them."""
    ways: dict[tuple[bool, bool], list[BsdfSlice]] = {}
    for one in data.slices:
        ways.setdefault((one.front, one.transmitted), []).append(one)
    n, incident = _sizes(isotropic=data.isotropic)
    if not ways or data.components:
        return False
    for (front, transmitted), own in ways.items():
        points = _directions(disk_of(_centres(n)), behind=front == transmitted)
        for one, towards in zip(own, incident, strict=False):
            if len(own) != len(incident) or one.points is None or one.points.shape != points.shape:
                return False
            same = np.allclose(one.points, points, atol=1e-9) and one.wavelength is None
            if not same or not np.allclose(one.incident, _directions(-towards, behind=not front), atol=1e-9):
                return False
            if np.isnan(one.values).any():
                return False
    return True


def _sizes(*, isotropic: bool) -> tuple[int, Array]:
    """Cells along each side, and where on the disk the light of each incidence goes, in the order in which they are read."""
    n = 1 << (INCIDENT_ROUND if isotropic else INCIDENT)
    even = _Tree(3 if isotropic else 4, np.zeros((n,) * (3 if isotropic else 4)))
    incident = np.array([towards for _, towards in _incidences(even)])
    return n, incident


def _centres(n: int) -> Array:
    return np.stack(np.meshgrid(*2 * [(np.arange(n) + 0.5) / n], indexing="ij"), axis=-1).reshape(-1, 2)


def tabulate(bsdf: Tabulated) -> BsdfData:
    """Even trees: each value the mean of f over its scattered cell, at the centre of the other.

    Of light from both sides, or from the front if the back is alike.
    """
    n, incident = _sizes(isotropic=bsdf.isotropic)
    part = (np.arange(ACROSS) + 0.5) / ACROSS - 0.5
    inside = _centres(n)[:, None, :] + np.stack(np.meshgrid(part, part), axis=-1).reshape(-1, 2) / n
    slices = []
    for front in (True,) if bsdf.both_sides else (True, False):
        for transmitted, is_there in ((False, bsdf.reflects), (True, bsdf.transmits)):
            behind = front == transmitted
            points = _directions(disk_of(_centres(n)), behind=behind)
            scattered = _directions(disk_of(inside), behind=behind)
            for towards in incident if is_there else ():
                light = _directions(-towards, behind=not front)
                values = bsdf.evaluate(light, scattered).mean(axis=1)
                projected = np.full(values.size, np.pi / (n * n))
                slices.append(BsdfSlice(light, values, transmitted, points=points, projected=projected))
    return BsdfData(tuple(slices), isotropic=bsdf.isotropic, mirrored=False, both_sides=bsdf.both_sides, name=bsdf.name)


def write(data: BsdfData, stream: BinaryIO) -> tuple[str, ...]:
    """Write even trees, nine digits each; of rank 3 the second half of the incident coordinate repeats the first."""
    n, _ = _sizes(isotropic=data.isotropic)
    rank = 3 if data.isotropic else 4
    lines = [f"<DataDefinition><IncidentDataStructure>TensorTree{rank}</IncidentDataStructure></DataDefinition>"]
    for name, way in WAYS.items():
        own = [one for one in data.slices if (one.front, one.transmitted) == way]
        if not own:
            continue
        # In the order of `_sizes`: near the normal first, or along the first coordinate of the square.
        cells = np.stack([one.values for one in own]) if rank == 4 else np.stack([one.values for one in own[::-1]])
        if rank == 3:
            cells = np.concatenate([cells, cells[::-1]])
        rows = [" ".join(f"{value:.9g}" for value in row) for row in cells]
        lines += block_of(name, [f"<AngleBasis>{BASIS}</AngleBasis>"], ["{", *rows, "}"])
    stream.write(document(data.name, lines))
    return (f"values are means over {n} × {n} cells of scattered directions",)


FORMAT = BsdfFormat("tensor-tree", "tensor tree XML", (".tt.xml",), recognise, read, fits, tabulate, write)
