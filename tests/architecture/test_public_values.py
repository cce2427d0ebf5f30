"""Every public value can be pickled, for pools of processes, and says in a line what it is."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.file_records import FileRecords
from etendue.quantities.spool import Spool
from oracles.light_fields import SURFACES, make_field
from oracles.map_files import make_map

LAMP = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100, "toward": [0.3, 0, 1]}
PAPER = {
    "name": "paper",
    "shape": {"kind": "rectangle", "width": 60, "height": 40},
    "at": [0, 0, 30],
    "finish": {"kind": "lambertian", "reflectance": 0.8},
}
DETECTORS = [{"kind": kind, "name": kind} for kind in ("scatter", "intensity")]


def rays() -> et.RaySet:
    return et.RingSource(rays=2000, seed=5).ray_set()


def scene() -> et.Scene:
    return et.Scene(name="paper", sources=[LAMP], surfaces=[PAPER], detectors=DETECTORS)


def result() -> et.TraceResult:
    return et.trace(scene(), rays=5000, seed=2)


def illuminance() -> et.IlluminanceMap:
    return et.IlluminanceMap(np.eye(2), np.ones((2, 2)), np.ones((2, 2), dtype=np.int64), et.Screen(2, 1, 2, 2, "xy"))


def scan() -> et.GoniometerScan:
    angle = np.linspace(-5.0, 5.0, 41)
    return et.GoniometerScan(angle, np.exp(-(angle**2)), notes=("by hand",))


def wide_scan() -> et.DirectionalScan:
    sample = et.bsdf.Gaussian(peak=200.0, sigma=0.012)
    return et.ScatterGoniometer(photons=1e6).measure_window(sample, 60, step=1, span=3, method="quadrature")


def lobe() -> et.GoniometerScan:
    return dataclasses.replace(scan(), solid_angle=1e-3)


def near_field() -> et.NearFieldRun:
    gonio = et.NearFieldGoniophotometer((30, 90), camera_pixels=16)
    return gonio.measure(lambda points, k: np.where(np.hypot(*points.T[:2]) < 1, k[:, 2] > 0, 0), size=3, samples=1)


MAKERS: dict[str, Callable[[], Any]] = {
    **{type(surface).__name__: lambda surface=surface: surface for surface in SURFACES.values()},
    "Agreement": lambda: et.agreement([lobe(), lobe()]),
    "Baffle": lambda: et.Baffle(24, 200),
    "Cone": lambda: et.Cone(acceptance="auto"),
    "Deconvolution": lambda: et.deconvolve(scan(), et.GoniometerScan(scan().angle, scan().flux ** 4), stop=5),
    "DirectionalDeconvolution": lambda: et.deconvolve_directions(wide_scan(), stop=5, regular=False, replicates=2),
    "DirectionalScan": wide_scan,
    "Detector": lambda: et.Detector(1e9, 1e5, filters=[1, 0.1], longest=2.0),
    "FromField": lambda: et.FromField(surface=et.Disk(radius=30), samples=4),
    "GoniometerScan": scan,
    "GriddedSource": lambda: et.GriddedSource.fit(rays(), et.Disk(radius=30), pixel=20, threshold=5),
    "IlluminanceMap": illuminance,
    "Intensity": lambda: et.intensity_distribution(rays()),
    "BeamAngle": lambda: et.beam_angle(et.intensity_distribution(rays())),
    "DataSheet": lambda: et.data_sheet(et.intensity_distribution(rays())),
    "LightField": lambda: make_field(SURFACES["dome"]),
    "LuminanceMap": make_map,
    "NearFieldGoniophotometer": lambda: et.NearFieldGoniophotometer((10, 15), exposures=3),
    "NearFieldRun": near_field,
    "Observer": lambda: et.Observer(30, 10, 500, target=(1, 2, 3)),
    "PathTracing": lambda: et.PathTracing(rays_per_pixel=64, until=0.01, seed=3, forward_rays=1e6, gather=True),
    "RayIndex": lambda: et.RayIndex.build(rays()),
    "RaySet": rays,
    "Region": lambda: et.Region(left=-1, right=0, bottom=-2, top=2),
    "PolygonRegion": lambda: et.PolygonRegion([(-1, -2), (1, -2), (0, 2)]),
    "RegionStatistics": lambda: et.region_statistics(make_map(), et.Region(left=-1e3, right=1e3, bottom=-1e3, top=1e3)),
    "RingSource": lambda: et.RingSource(rays=77, runs=3, seed=9),
    "Scans": lambda: et.Scans([[-0.6, 0, 0.8]] * 50, [[0.6, 0, 0.8]] * 50, [2.5] * 50),
    "Scene": scene,
    "BsdfFit": lambda: et.fit_bsdf(
        et.Scans([[-0.6, 0, 0.8]] * 3, [[0.6, 0, 0.8]] * 3, [0.1, 0.12, 0.11]), "lambertian"
    ),
    "Bsdf": lambda: et.BsdfTable(BsdfData(components=({"kind": "lambertian", "reflectance": 0.2},))),
    "BsdfTable": lambda: et.BsdfTable(BsdfData(components=({"kind": "gaussian", "peak": 3.0, "sigma": 0.2},))),
    "ScatterGoniometer": lambda: et.ScatterGoniometer(profile=(1, 0.5), photons=1e6),
    "ScatterEvents": lambda: result().events["scatter"],
    "Screen": lambda: et.Screen(2, 1, 8, 4),
    "SourceReport": lambda: et.report_source(
        rays(), surface=et.Disk(radius=30), observers=[et.Observer(10, 0, 500)], forecast=False
    ),
    "Spectrum": lambda: et.Spectrum([450.0, 650.0], [1.0, 0.5]),
    "SweepTable": lambda: et.sweep(scene(), {"paper.at.2": [20, 30]}, ["escaped", "absorbed:paper"], rays=1000),
    "TraceResult": result,
    "TraceWork": lambda: et.trace_work(scene(), rays=5000, seed=2),
}
"""A value of each public class."""

ERRORS = {
    "ArgumentError": et.ArgumentError("radius is -1; give one above 0."),
    "EtendueError": et.EtendueError("told"),
    "FormatError": et.FormatError("led.ray", "byte 3", "nothing", "Copy it again."),
    "MemoryLimitError": et.MemoryLimitError("1 TB for a map"),
    "MissingLibraryError": et.MissingLibraryError("xarray", "datasets of xarray", "xarray"),
    "OutputError": et.OutputError(28, "no room", "map.exr"),
    "SceneError": et.SceneError("lamp.toml", [("sources[0]", "no flux"), ("", "dark")]),
    "UnitError": et.UnitError("W cannot become lm"),
    "UnknownNameError": et.UnknownNameError("format", "tm52", ["tm25", "zemax"]),
    "UnsupportedFormatError": et.UnsupportedFormatError("led.xyz", "byte 0", "a secret", "Ask for TM-25."),
}


def public_classes() -> dict[str, type]:
    return {name: thing for name in et.__all__ if inspect.isclass(thing := getattr(et, name))}


def same(one: Any, other: Any) -> bool:
    """Equality through arrays, mappings and values that hold them."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    if isinstance(one, et.RaySet):
        return same(np.asarray(one.records), np.asarray(other.records)) and same(one.meaning, other.meaning)
    if isinstance(one, Spool):
        return same(np.asarray(one.array()), np.asarray(other.array()))
    if dataclasses.is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in dataclasses.fields(one) if f.compare)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or repr(one) == repr(other)  # NaN


def test_there_is_a_value_of_every_public_class() -> None:
    errors = {name for name, kind in public_classes().items() if issubclass(kind, Exception)}
    assert set(public_classes()) - errors == set(MAKERS)
    assert {name for name in errors if not name.endswith("Warning")} == set(ERRORS)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(MAKERS))
def test_it_can_be_pickled_and_says_what_it_is_in_a_line(name: str) -> None:
    value = MAKERS[name]()
    again = pickle.loads(pickle.dumps(value))  # noqa: S301 - our own
    assert same(value, again)
    line = repr(value)
    assert "\n" not in line
    assert len(line) < 250
    assert name in line


def test_a_pickled_field_and_source_still_work() -> None:
    field = make_field(SURFACES["box"])
    source = et.RingSource(rays=77, runs=3, seed=9)
    for stream in (field.rays(50, seed=3), source):
        again = pickle.loads(pickle.dumps(stream))  # noqa: S301 - our own
        assert again.ray_set().records.tobytes() == stream.ray_set().records.tobytes()


def test_rays_of_a_file_are_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They stay in their file, by whatever name it was read: pickled is where it is, for processes that start elsewhere. The
    oracle is the set that was written. Scenes that hold such rays, and traces of them, come along."""
    monkeypatch.chdir(tmp_path)
    written = rays()
    et.write_rays("led.tm25ray", written)
    held = et.read_rays("led.tm25ray")
    assert isinstance(held.records, FileRecords)
    lit = et.Scene(sources=[{"kind": "rays", "rays": held}])
    work = et.trace_work(lit, seed=2)
    stored = [pickle.dumps(value) for value in (held, lit, work)]
    assert max(map(len, stored)) < written.records.nbytes / 4
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again, scene_again, work_again = [pickle.loads(data) for data in stored]  # noqa: S301 - our own
    copies = copy.copy(held), copy.deepcopy(held), copy.deepcopy(lit).sources[0].rays
    for one in (again, scene_again.sources[0].rays, *copies):
        assert same(one, held)
        assert np.array_equal(one.records["direction"], np.asarray(written.records["direction"], "<f4"))
    assert work.join([work_again(0)]).ledger == et.trace(lit, seed=2).ledger
    path = tmp_path / "led.tm25ray"
    os.utime(path, ns=(0, 0))
    with pytest.raises(et.FormatError, match=r"led\.tm25ray: pickled rays: size or time of change"):
        pickle.loads(stored[0])  # noqa: S301 - our own
    path.unlink()
    with pytest.raises(FileNotFoundError, match=r"led\.tm25ray"):
        pickle.loads(stored[0])  # noqa: S301 - our own
    assert copy.deepcopy(held).records is held.records


@pytest.mark.parametrize("name", sorted(ERRORS))
def test_an_error_can_be_pickled(name: str) -> None:
    error = ERRORS[name]
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_the_top_shows_public_names_only() -> None:
    assert dir(et) == sorted([*et.__all__, "__version__"])
    assert et.__version__.count(".") >= 1
