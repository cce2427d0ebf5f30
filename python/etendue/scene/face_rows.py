"""Faces of a scene as columns: ten thousand blocks have sixty thousand, and to write a record of each takes a second."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from etendue.scene.bodies.body import Face
from etendue.scene.placement import Frame

Array = npt.NDArray[np.float64]
Numbers = npt.NDArray[np.int64]
Record = dict[str, Any]
Vector = tuple[float, float, float]


@dataclasses.dataclass(frozen=True, eq=False)
class FaceRows(Sequence[Record]):
    """The faces of a scene as the tracer takes them: arrays of what each has of its own, and the forms that they share.

    As a sequence it gives the record of each face, made when it is asked for: ``shape``, ``trims`` and ``flip`` of its form,
    ``frame`` (12 numbers), the number of its ``solid`` or None, that of its ``finish``, and its ``axis`` or None. A slice is
    again of this kind.

    Parameters
    ----------
    forms : tuple of mappings
        What faces are, wherever they stand: ``shape``, ``trims`` and ``flip``.
    form : array of int64, shape (n,)
        Which of the forms each face has.
    frames : array, shape (n, 12)
        Where it stands: origin [mm], x, y and z axis; see `etendue.scene.placement.Frame.record`.
    solids : array of int64, shape (n,)
        Which solid it is a part of; -1: none.
    finishes : array of int64, shape (n,)
        Which finish it has.
    axes : array, shape (n, 3)
        Where the x axis of its sample points in the world; NaN: that does not matter.

    Examples
    --------
    >>> here = [0.0, 0.0, 5.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    >>> disk = {"shape": {"kind": "flat", "outline": {"kind": "whole"}}, "frame": here, "trims": [], "solid": None,
    ...         "flip": False, "finish": 2, "axis": None}
    >>> faces = FaceRows.of([disk])
    >>> len(faces), faces.finishes.tolist(), faces[0] == disk
    (1, [2], True)
    """

    forms: tuple[Record, ...]
    form: Numbers
    frames: Array
    solids: Numbers
    finishes: Numbers
    axes: Array

    @classmethod
    def of(cls, records: Sequence[Record]) -> FaceRows:
        """Columns of a few faces that are given as records.

        Parameters
        ----------
        records : sequence of mappings
            With all keys that the faces of a scene have.

        Examples
        --------
        >>> len(FaceRows.of([]))
        0
        """
        nowhere = [np.nan] * 3
        return cls(
            tuple({key: record[key] for key in ("shape", "trims", "flip")} for record in records),
            np.arange(len(records)),
            np.array([record["frame"] for record in records], dtype=np.float64).reshape(-1, 12),
            np.array([-1 if record["solid"] is None else record["solid"] for record in records], dtype=np.int64),
            np.array([record["finish"] for record in records], dtype=np.int64),
            np.array([record["axis"] or nowhere for record in records], dtype=np.float64).reshape(-1, 3),
        )

    def __len__(self) -> int:
        """Number of faces."""
        return len(self.form)

    @overload
    def __getitem__(self, at: int) -> Record: ...
    @overload
    def __getitem__(self, at: slice) -> FaceRows: ...
    def __getitem__(self, at: int | slice) -> Record | FaceRows:
        """The record of one face, or some faces."""
        if isinstance(at, slice):
            return self.chosen(np.arange(len(self))[at])
        number = range(len(self))[at]
        return next(self._records(slice(number, number + 1)))

    def __iter__(self) -> Iterator[Record]:
        """The records of all faces."""
        return self._records(slice(None))

    def chosen(self, which: Numbers | npt.NDArray[np.bool_]) -> FaceRows:
        """Some of the faces, with no forms but theirs.

        Parameters
        ----------
        which : array
            Their numbers, or for each face whether it is one of them.

        Examples
        --------
        >>> disk = {"shape": {"kind": "flat", "outline": {"kind": "whole"}}, "frame": [0.0] * 12, "trims": [],
        ...         "solid": None, "flip": False, "finish": 0, "axis": None}
        >>> few = FaceRows.of([disk, {**disk, "finish": 1}]).chosen(np.array([False, True]))
        >>> len(few.forms), few.finishes.tolist()
        (1, [1])
        """
        form = self.form[which]
        used = np.zeros(len(self.forms), dtype=bool)
        used[form] = True
        return FaceRows(
            tuple(self.forms[number] for number in np.flatnonzero(used).tolist()),
            (np.cumsum(used, dtype=np.int64) - 1)[form],
            self.frames[which],
            self.solids[which],
            self.finishes[which],
            self.axes[which],
        )

    def _records(self, which: slice) -> Iterator[Record]:
        columns = (self.form, self.frames, self.solids, self.finishes, self.axes)
        for number, frame, solid, finish, axis in zip(*(column[which].tolist() for column in columns), strict=True):
            form = self.forms[number]
            yield {
                "shape": form["shape"],
                "frame": frame,
                "trims": form["trims"],
                "solid": None if solid < 0 else solid,
                "flip": form["flip"],
                "finish": finish,
                "axis": None if np.isnan(axis[0]) else axis,
            }


class BodyFaces:
    """The faces of a body, wherever it stands.

    Parameters
    ----------
    faces : tuple of Face
        In the coordinates of the body.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scene.bodies.round import Rod
    >>> BodyFaces(Rod(radius=3, height=2).faces(Files())).names
    ['side', 'bottom', 'top']
    """

    def __init__(self, faces: tuple[Face, ...]) -> None:
        self.faces = faces
        self.names = [face.name for face in faces]
        self.doubts = [doubt for face in faces for doubt in face.doubts]
        self.forms = [{"shape": face.shape, "trims": [], "flip": face.flip} for face in faces]
        self._origins = np.array([face.frame.origin for face in faces])
        # Transposed: the axes of a face are the rows.
        self._axes = np.array([face.frame.axes.T for face in faces])

    def placed(self, frames: Sequence[Frame]) -> Array:
        """Where the faces stand if the body stands in several places, shape (places, faces, 12); see `FaceRows`."""
        turned = np.array([frame.axes for frame in frames]).swapaxes(1, 2)
        origins = np.array([frame.origin for frame in frames])[:, None] + self._origins @ turned
        axes = self._axes @ turned[:, None]
        return np.concatenate([origins, axes.reshape(*origins.shape[:2], 9)], axis=2)


class FaceGathering:
    """The faces of a scene while it is put together.

    Examples
    --------
    >>> faces = FaceGathering()
    >>> faces.add_sheet({"shape": {"kind": "torus"}, "trims": [], "flip": False}, Frame.shifted(0, 0, 2), 3, None)
    >>> faces.rows()[0]["frame"][:3], faces.rows()[0]["finish"]
    ([0.0, 0.0, 2.0], 3)
    """

    def __init__(self) -> None:
        self._sheets: list[tuple[int, Record, Frame]] = []
        # Of each body the first faces of all that are like it, and their places.
        self._bodies: dict[BodyFaces, tuple[list[int], list[Frame]]] = {}
        self._solids: list[int] = []
        self._counts: list[int] = []
        self._finishes: list[Sequence[int]] = []
        self._axes: list[tuple[Numbers, list[float]]] = []
        self._length = 0

    def add_body(
        self, body: BodyFaces, frame: Frame, solid: int, finishes: Sequence[int], axes: Iterable[tuple[Vector, Numbers]]
    ) -> None:
        """The faces of a solid.

        Parameters
        ----------
        body : BodyFaces
            Equal solids share it.
        frame : Frame
            Where it stands.
        solid : int
            Its number.
        finishes : sequence of int
            Of its faces.
        axes : iterable of pairs
            Directions in the coordinates of the body, and the numbers of the faces whose axes they are.
        """
        firsts, frames = self._bodies.setdefault(body, ([], []))
        firsts.append(self._length)
        frames.append(frame)
        self._axes += [(self._length + faces, _turned(axis, frame)) for axis, faces in axes]
        self._add(solid, finishes)

    def add_sheet(self, form: Record, frame: Frame, finish: int, axis: Vector | None) -> None:
        """The one face of a surface.

        Parameters
        ----------
        form : mapping
            See `FaceRows`.
        frame : Frame
            Where it stands.
        finish : int
            Its number.
        axis : 3 numbers, optional
            In the coordinates of the surface.
        """
        self._sheets.append((self._length, form, frame))
        if axis is not None:
            self._axes.append((np.array([self._length]), _turned(axis, frame)))
        self._add(-1, [finish])

    def _add(self, solid: int, finishes: Sequence[int]) -> None:
        self._solids.append(solid)
        self._counts.append(len(finishes))
        self._finishes.append(finishes)
        self._length += len(finishes)

    def rows(self) -> FaceRows:
        """All faces, in the order in which they came."""
        forms: list[Record] = []
        form = np.zeros(self._length, dtype=np.int64)
        frames, axes = np.zeros((self._length, 12)), np.full((self._length, 3), np.nan)
        for body, (firsts, places) in self._bodies.items():
            faces = np.array(firsts)[:, None] + np.arange(len(body.faces))
            form[faces] = len(forms) + np.arange(len(body.faces))
            frames[faces] = body.placed(places)
            forms += body.forms
        for face, sheet, frame in self._sheets:
            form[face], frames[face] = len(forms), frame.record()
            forms.append(sheet)
        for which, axis in self._axes:
            axes[which] = axis
        solids = np.repeat(np.array(self._solids, dtype=np.int64), self._counts)
        finishes = np.array([finish for own in self._finishes for finish in own], dtype=np.int64)
        return FaceRows(tuple(forms), form, frames, solids, finishes, axes)


def _turned(axis: Vector, frame: Frame) -> list[float]:
    """A direction of a frame in the world."""
    turned: list[float] = (frame.axes @ np.asarray(axis)).tolist()
    return turned
