"""Faces as columns are the faces that solids and surfaces have, one by one."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest
from etendue import _core
from etendue.description.files import Files
from etendue.errors import SceneError
from etendue.quantities.fingerprint import fingerprint
from etendue.scene import Compiled, Scene, compile_scene
from etendue.scene.face_rows import FaceRows

BRUSHED = {"kind": "gaussian", "peak": 1.0, "sigma": 0.2, "aspect": 2.0, "axis": [0.0, 1.0, 2.0]}
BLOCK = {"kind": "block", "width": 2, "height": 3, "depth": 4}
ROD = {"kind": "rod", "radius": 1, "height": 2}
TILTED = {"axis": [1.0, 2.0, -0.5], "angle": 40.0, "spin": 15.0}
SCENE = Scene(
    finishes={"brushed": BRUSHED},
    solids=[
        {"name": "a", "shape": BLOCK, "medium": "BK7", "at": [1, -2, 3], "finishes": {"top": "brushed"}},
        {"name": "b", "shape": ROD, "medium": "BK7", "at": [9, 0, 1], "finish": "brushed", "rotation": [20, 30, 40]},
        {"name": "c", "shape": BLOCK, "medium": "PMMA", "at": [0, 9, 2], "finishes": {"top": "brushed"}, **TILTED},
        {"name": "d", "shape": BLOCK, "medium": "BK7", "at": [0, 0, -9], "finish": {"kind": "mirror", "reflectance": 0.5}},
        {"name": "e", "shape": BLOCK, "medium": "BK7", "at": [0, 0, 20], "finishes": {"left": "absorber", "top": "mirror"}},
    ],
    surfaces=[
        {"name": "s", "shape": {"kind": "sphere", "radius": 4}, "trim": {"half_spaces": [{"normal": [0, 0, 2]}]},
         "finish": "brushed", "at": [30, -0.0, 0], "toward": [1, 1, 0]},
        {"name": "t", "shape": {"kind": "disk", "radius": 1}, "finish": "absorber", "at": [40, 0, 0]},
    ],
)  # fmt: skip
"""Equal bodies with equal and with other finishes, moved and turned; axes on one face, on all, and on a surface."""


def expected(scene: Scene, compiled: Compiled) -> list[dict[str, Any]]:
    """The records that the solids and surfaces of a scene ask for, each worked out by itself: p in a face is
    o_b + A_b (o_f + A_f p) in the world, with the frames b of the body and f of the face."""
    names = {name: i for i, name in enumerate(compiled.finish_names)}
    records = []
    for number, solid in enumerate(scene.solids):
        body = solid.frame()
        for face in solid.shape.faces(Files()):
            given = solid.finishes.get(face.name, solid.finish)
            finish = given if isinstance(given, str) else f"{solid.name}.finish"
            points = [
                body.origin + body.axes @ (face.frame.origin + face.frame.axes @ p) for p in (np.zeros(3), *np.eye(3))
            ]
            frame = [points[0], *(point - points[0] for point in points[1:])]
            axis = body.axes @ BRUSHED["axis"] if finish == "brushed" else None
            own = {"solid": number, "flip": face.flip, "finish": names[finish], "axis": axis}
            records.append({"shape": face.shape, "frame": np.concatenate(frame), "trims": [], **own})
    for surface in scene.surfaces:
        sheet, place = surface.shape.sheet(surface.trim, Files()), surface.frame()
        axis = place.axes @ BRUSHED["axis"] if surface.finish == "brushed" else None
        own = {"solid": None, "flip": False, "finish": names[str(surface.finish)], "axis": axis}
        records.append({"shape": sheet.shape, "frame": place.record(), "trims": sheet.trims, **own})
    return records


def test_columns_hold_the_faces_that_solids_and_surfaces_have() -> None:
    """In their order, with the place, the finish and the axis of each (`expected`)."""
    compiled = compile_scene(SCENE)
    found, wanted = compiled.record["faces"], expected(SCENE, compiled)
    assert isinstance(found, FaceRows)
    assert len(found) == len(wanted) == 4 * 6 + 3 + 2
    for face, row in zip(wanted, found, strict=True):
        assert list(row) == ["shape", "frame", "trims", "solid", "flip", "finish", "axis"]
        for key in ("shape", "trims", "solid", "flip", "finish"):
            assert row[key] == face[key], key
        assert type(row["frame"]) is list
        assert row["frame"] == pytest.approx(face["frame"], abs=2e-14)
        assert (row["axis"] is None) == (face["axis"] is None)
        assert row["axis"] is None or row["axis"] == pytest.approx(face["axis"], abs=1e-15)
    assert compiled.face_names[:7] == ("a.front", "a.right", "a.back", "a.left", "a.bottom", "a.top", "b.side")
    assert compiled.face_names[-2:] == ("s", "t")


def test_equal_bodies_share_their_forms() -> None:
    """Four blocks, a rod and two surfaces: six forms, three, and one each."""
    faces = compile_scene(SCENE).record["faces"]
    assert len(faces.forms) == 6 + 3 + 2
    assert faces.form[:6].tolist() == faces.form[9:15].tolist() == faces.form[-8:-2].tolist()


def test_the_sequence_and_its_parts_give_the_same_records() -> None:
    """By number from either end, in slices, by choice, made from records, and out of a pickle."""
    faces = compile_scene(SCENE).record["faces"]
    records = list(faces)
    assert [faces[i] for i in range(len(faces))] == records
    assert [faces[i] for i in range(-len(faces), 0)] == records
    with pytest.raises(IndexError):
        faces[len(faces)]
    assert list(faces[3:20:4]) == records[3:20:4]
    assert list(faces[::-1]) == records[::-1]
    some = faces.chosen(np.array([28, 6, 6, 0]))
    assert list(some) == [records[i] for i in (28, 6, 6, 0)]
    assert len(some.forms) == 3
    assert list(faces.chosen(faces.solids == 1)) == records[6:9]
    assert list(FaceRows.of(records)) == records
    assert list(pickle.loads(pickle.dumps(faces))) == records  # noqa: S301 - its own
    assert list(faces[:0]) == list(FaceRows.of([])) == list(compile_scene(Scene()).record["faces"]) == []


def test_the_fingerprint_is_that_of_the_records() -> None:
    """Files of scatter events hold it."""
    faces = compile_scene(SCENE).record["faces"]
    assert fingerprint({"faces": faces}) == fingerprint({"faces": list(faces)})


def test_the_core_sees_one_scene_whether_forms_are_shared_or_not() -> None:
    """Lines meet the same faces at the same distances, to the last bit."""
    record = compile_scene(SCENE).record
    rng = np.random.default_rng(4)
    along = rng.normal(size=(2000, 3))
    along /= np.linalg.norm(along, axis=1)[:, None]
    starts = rng.uniform(-5, 12, (2000, 3))
    shared = _core.scene_crossings(_core.Scene(record), starts, along)
    alone = _core.scene_crossings(_core.Scene({**record, "faces": FaceRows.of(list(record["faces"]))}), starts, along)
    assert len(set(shared[1].tolist())) > 20, "few faces were met"
    for a, b in zip(shared, alone, strict=True):
        assert a.tolist() == b.tolist()


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("form", np.array([0, 1, 2, 3, 4, 6])),
        ("form", np.array([0, 1, 2, 3, 4, -1])),
        ("finishes", np.array([0, 0, 0, 0, 0, -1])),
        ("finishes", np.array([0, 0, 0, 0, 0, 7])),
        ("solids", np.array([0, 0, 0, 0, 0, 1])),
        ("solids", np.zeros(5, dtype=np.int64)),
        ("frames", np.zeros((6, 9))),
        ("axes", np.zeros((6, 2))),
    ],
)
def test_the_core_refuses_columns_that_do_not_fit(column: str, value: np.ndarray[Any, Any]) -> None:
    """Numbers of what does not exist, and columns of another length or width."""
    record = compile_scene(Scene(solids=[{"shape": BLOCK, "medium": "BK7"}])).record
    _core.Scene(record)
    with pytest.raises(ValueError, match=r"face|shape|number"):
        _core.Scene({**record, "faces": dataclasses.replace(record["faces"], **{column: value})})


def test_equal_solids_are_told_apart() -> None:
    """A finish without a name is called by its solid, and a mistake is told at every solid that makes it."""
    half = {"kind": "mirror", "reflectance": 0.5}
    twins = [{"shape": BLOCK, "medium": "BK7", "at": [x, 0, 0], "finish": half} for x in (0, 9)]
    compiled = compile_scene(Scene(solids=twins))
    assert compiled.finish_names == ("solids[0].finish", "solids[1].finish")
    assert compiled.record["faces"].finishes.tolist() == [0] * 6 + [1] * 6
    wrong = [{"shape": BLOCK, "medium": "BK7", "at": [x, 0, 0], "finishes": {"lid": "absorber"}} for x in (0, 9)]
    with pytest.raises(SceneError) as told:
        compile_scene(Scene(solids=wrong))
    assert [place for place, _ in told.value.mistakes] == [f"solids[{i}].finishes.lid" for i in (0, 1)]
