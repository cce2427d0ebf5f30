"""A sample without symmetry that was turned about its normal, in every format: azimuths come out right, at 0° as at 40°.

Along the normal light comes from no azimuth, but a file says of it what was measured with the sample turned. What is read is
held against the function itself, which is fixed to the sample.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue.formats.bsdf import BSDF_FORMATS, read_bsdf_data
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.quantities.bsdf_slice import BsdfSlice
from formats.slanted import coarsen
from oracles import rotated_samples as by_hand

Array = npt.NDArray[np.float64]

THETAS, PHIS = (0.0, 40.0), (200.0, 240.0, 320.0)
"""Angles and azimuths of incidence [°]; none is an azimuth from which angles are counted."""

BOTH = (False, True)
WRITERS: dict[str, tuple[by_hand.Writer, tuple[bool, ...]]] = {
    "astm": (by_hand.astm, BOTH),
    "bird": (by_hand.bird, (False,)),
    "etendue": (by_hand.etendue, BOTH),
    "fred": (by_hand.fred, BOTH),
    "klems": (by_hand.klems, BOTH),
    "lighttools": (by_hand.lighttools, BOTH),
    "pab": (by_hand.pab, BOTH),
    "rgl": (by_hand.rgl, (False,)),
    "speos": (by_hand.speos, BOTH),
    "speos-brdf": (by_hand.speos_brdf, BOTH),
    "ssdd": (by_hand.ssdd, BOTH),
    "ssdd, about the normal": (by_hand.ssdd_about_the_normal, BOTH),
    "tensor-tree": (by_hand.tensor_tree, BOTH),
    "tracepro": (by_hand.tracepro, BOTH),
    "zemax": (by_hand.zemax, BOTH),
}
"""By hand, with the ways of light that a format holds."""

SYMMETRIC = {
    "merl": "light goes back as it came, and φd turns back on itself after half a turn: no lobe stands to one side",
    "speos-coated": "nothing is scattered",
    "speos-scattering": "Gaussians about the specular direction",
    "speos-simple": "Gaussians about the specular direction",
}
"""Formats that hold no such sample."""

ISOTROPIC = ("speos-brdf",)
"""Formats of samples that were not turned."""

ALL_AROUND = ("klems", "tensor-tree")
"""Formats that have light from all azimuths, and so are never of a sample that was not turned."""

ROTATED = [(name, way) for name, (_, ways) in WRITERS.items() for way in ways if name not in ISOTROPIC]
IN_ONE_PLANE = [(name, way) for name, (_, ways) in WRITERS.items() for way in ways if name not in ALL_AROUND]


def test_every_format_is_looked_at() -> None:
    assert {name.split(",")[0] for name in WRITERS} | set(SYMMETRIC) == set(BSDF_FORMATS)


def written(tmp_path: Path, name: str, *, transmitted: bool, phis: tuple[float, ...] = PHIS) -> list[Path]:
    files = WRITERS[name][0](thetas=THETAS, phis=phis, transmitted=transmitted)
    paths = [tmp_path / f"part{k}" for k in range(len(files))]
    for path, content in zip(paths, files, strict=True):
        path.write_bytes(content)
    return paths


def around(table: et.Bsdf, *, theta: float, phi: float, transmitted: bool) -> Array:
    """Directions about the middle of the lobe, and about where it would be after half a turn; or the nearest points."""
    beta0 = -by_hand.direction(theta=theta, phi=phi)[:2]
    distance, azimuth = by_hand.BESIDE[transmitted]
    middle = distance * np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
    turn = np.arange(0.0, 2.0 * math.pi, math.pi / 4.0)
    ring = 0.15 * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    beta = np.concatenate([beta0 + middle + ring, beta0 - middle + ring, [beta0 + middle, beta0]])
    beta = beta[np.hypot(*beta.T) < 0.97]
    found = np.column_stack([beta, (-1.0 if transmitted else 1.0) * np.sqrt(1.0 - np.sum(beta * beta, axis=-1))])
    points = table.data.slices[0].points if isinstance(table, et.BsdfTable) else None
    return found if points is None else points[np.argmax(found @ points.T, axis=1)]


def off(table: et.Bsdf, *, theta: float, phi: float, transmitted: bool, seen: float = 0.0) -> float:
    """The largest difference from f in parts of its peak, all directions turned by `seen` [°] before the table is asked."""
    incident = by_hand.direction(theta=theta, phi=phi)
    to = around(table, theta=theta, phi=phi, transmitted=transmitted)
    turned = [by_hand.turned(vectors=vectors, by=seen) for vectors in (incident, to)]
    difference = table.evaluate(*turned) - by_hand.f(incident=incident, scattered=to)
    return float(np.abs(difference).max()) / by_hand.PEAK


CLOSE = 0.1
"""In parts of the peak: what f may be off between the directions of a file."""


def test_a_sample_that_is_turned_or_mirrored_is_seen() -> None:
    """Of f itself, turned by half a turn and by 40°, and mirrored: each is off by more than twice what is allowed."""
    plain = et.bsdf.Lambertian(reflectance=0.5)
    for theta, transmitted in itertools.product((0.0, 40.0), BOTH):
        incident = by_hand.direction(theta=theta, phi=200.0)
        to = around(plain, theta=theta, phi=200.0, transmitted=transmitted)
        right = by_hand.f(incident=incident, scattered=to)
        images = [[by_hand.turned(vectors=one, by=by) for one in (incident, to)] for by in (180.0, 40.0, -40.0)]
        images += [[one * [*flip, 1.0] for one in (incident, to)] for flip in ([1.0, -1.0], [-1.0, 1.0])]
        for incident_there, to_there in images:
            wrong = by_hand.f(incident=incident_there, scattered=to_there)
            assert np.abs(wrong - right).max() > 2.0 * CLOSE * by_hand.PEAK


def fits(slices: Sequence[BsdfSlice], *, within: float) -> None:
    """Whether each value stands at the direction of the sample at which f is just that."""
    for one in slices:
        known = (np.abs(one.directions[..., 2]) > 1e-6) & ~np.isnan(one.values)
        right = by_hand.f(incident=one.incident, scattered=one.directions[known])
        assert np.abs(one.values[known] - right).max() < within, (one.theta, one.phi)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "transmitted"), [case for case in ROTATED if case[0] != "tensor-tree"])
def test_a_rotated_sample(tmp_path: Path, name: str, transmitted: bool) -> None:
    table = et.read_bsdf(written(tmp_path, name, transmitted=transmitted))
    assert not table.isotropic
    assert {round(one.theta, 3) for one in table.data.slices} >= set(THETAS)
    if name != "rgl":  # whose values are f cosθ, interpolated by the reader
        # Speos' are scaled to a share between two angles of incidence.
        fits(table.data.slices, within=5e-3 if name == "speos" else 1e-6)
    for theta, phi in ((0.0, 0.0), (40.0, 200.0), (40.0, 240.0)):
        assert off(table, theta=theta, phi=phi, transmitted=transmitted) < CLOSE, (theta, phi)


@pytest.mark.slow
def test_a_rotated_sample_in_a_tensor_tree(tmp_path: Path) -> None:
    """Of its 256 incidences those next to the normal, where it holds none, and those of one angle near 40°."""
    for transmitted in BOTH:
        (path,) = written(tmp_path, "tensor-tree", transmitted=transmitted)
        data = read_bsdf_data(path)
        fits(data.slices, within=1e-6)
    thetas = np.array([one.theta for one in data.slices])
    near = float(thetas[np.argmin(np.abs(thetas - 40.0))])
    own = [one for one in data.slices if abs(one.theta - near) < 1e-6]
    table = et.BsdfTable(dataclasses.replace(data, slices=[*own, *(one for one in data.slices if one.theta < 4.0)]))
    # The four at 3.6°, and cells of 1/16 of the square, stand for light along the normal.
    assert off(table, theta=0.0, phi=0.0, transmitted=True) < 1.5 * CLOSE
    for one in own[:: len(own) // 3]:
        assert off(table, theta=near, phi=one.phi, transmitted=True) < CLOSE


@pytest.mark.slow
@pytest.mark.parametrize(("name", "transmitted"), IN_ONE_PLANE)
def test_a_sample_that_was_not_turned(tmp_path: Path, name: str, transmitted: bool) -> None:
    """It counts as isotropic: the lobe stays where it was to the plane of incidence, down to the normal."""
    table = et.read_bsdf(written(tmp_path, name, transmitted=transmitted, phis=(200.0,)))
    assert table.isotropic
    # Light along the normal exactly counts as from azimuth 0.
    for theta, seen in ((1e-3, 0.0), (1e-3, 110.0), (40.0, 110.0), (0.0, -200.0)):
        assert off(table, theta=theta, phi=200.0, transmitted=transmitted, seen=seen) < CLOSE, (theta, seen)


TABLES = [form for form in BSDF_FORMATS.values() if form.write is not None and form.name not in ALL_AROUND]


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> tuple[et.BsdfTable, et.BsdfTable]:
    """Of a sample that was turned, at azimuths that the writers take but for 0; and of one that was not."""
    phis = tuple(np.arange(45.0, 360.0, 45.0).tolist())
    folder = tmp_path_factory.mktemp("sources")
    turned = et.read_bsdf(written(folder, "etendue", transmitted=False, phis=phis))
    return turned, et.read_bsdf(written(folder, "ssdd", transmitted=False, phis=(200.0,)))


@pytest.mark.slow
@pytest.mark.parametrize("form", TABLES, ids=lambda form: form.name)
def test_written_and_read_again(
    tmp_path: Path, sources: tuple[et.BsdfTable, et.BsdfTable], form: BsdfFormat, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What matrices of Klems and tensor trees hold is looked at in test_bsdf_formats.py, at the normal too."""
    coarsen(monkeypatch, 10.0)
    turned, plain = sources
    if form.name not in ISOTROPIC:
        et.write_bsdf(tmp_path / "turned", turned, form.name)
        again = et.read_bsdf(tmp_path / "turned")
        assert not again.isotropic
        for theta, phi in ((0.0, 0.0), (40.0, 90.0), (40.0, 225.0)):
            assert off(again, theta=theta, phi=phi, transmitted=False) < CLOSE, (theta, phi)
    et.write_bsdf(tmp_path / "plain", plain, form.name)
    again = et.read_bsdf(tmp_path / "plain")
    assert again.isotropic
    for theta, seen in ((1e-3, 30.0), (40.0, 110.0)):
        assert off(again, theta=theta, phi=200.0, transmitted=False, seen=seen) < CLOSE, (theta, seen)
