"""Arguments of the wrong kind are refused in the words of the call, not where something further in stumbles over them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest

TABLE = et.Intensity([0, 90, 180, 270], np.arange(0, 91, 10.0), [np.cos(np.radians(np.arange(0, 91, 10.0)))] * 4)
VALUES = 10.0 + 10.0 * np.arange(16.0).reshape(4, 4)
LMAP = et.LuminanceMap(VALUES, 0.1 * VALUES, np.full((4, 4), 100), et.Observer(30, 0, 1000), et.Screen(8, 8, 4, 4))
SQUARE = et.Region(-2, 2, -2, 2)
NO_NUMBERS = ("0", None, [1.0, 2.0], LMAP)
NO_ARRAYS = (None, "0", "a.csv", ["1", "b"], {"a": 1}, LMAP, [[1.0, 2.0], [3.0]])
NO_POINTS = (None, "123", 5.0, (0, 0), (0, 0, 0, 0), ("a", "b", "c"), (0, 0, np.nan), LMAP)
EMAP = et.IlluminanceMap(VALUES, VALUES, np.full((4, 4), 100), et.Screen(8, 8, 4, 4, "xy"))
SCAN = et.GoniometerScan(np.arange(-5.0, 6.0), np.exp(-(np.arange(-5.0, 6.0) ** 2)), solid_angle=1e-3)
PAINT = et.bsdf.Lambertian(reflectance=0.5)
NOTHING_KNOWN = ("lamp.ies", None, 3.5, [], {}, LMAP)
NAMES_GIVEN = ("no such name", 3, ["ies"], {}, np.eye(2), LMAP)
NO_NAMES = (None, *NAMES_GIVEN)
LAMP = et.Scene(sources=[{"name": "lamp", "kind": "point", "flux": 1}])
RINGS, DISK = et.RingSource(rays=100), et.Disk(radius=30)
VIEW = (et.Observer(0, 0, 1000), et.Screen(60, 60, 2, 2))
UP = [0.0, 0.0, 1.0]
SCANS = et.Scans([UP] * 3, [UP] * 3, [0.1, 0.12, 0.11])
WINDOW = et.DirectionalScan([UP, [0.6, 0.0, 0.8]], [1.0, 0.5], solid_angle=1e-3)
METER = et.Detector(1e9, 1e5, longest=1.0)


@functools.cache
def field() -> et.LightField:
    return et.LightField.fit(RINGS, DISK, depths=(1, 1, 1, 1))


@functools.cache
def patches() -> et.GriddedSource:
    return et.GriddedSource.fit(RINGS, DISK, pixel=30.0, threshold=5.0)


@functools.cache
def run() -> et.NearFieldRun:
    def disk(points: Any, along: Any) -> Any:
        return np.where(np.hypot(*points.T[:2]) < 1.0, along[:, 2] > 0.0, 0.0)

    return et.NearFieldGoniophotometer((30, 90), camera_pixels=8).measure(disk, size=3, samples=1)


CALLS: dict[str, tuple[Callable[[Any], object], tuple[Any, ...]]] = {
    "beam_angle: intensity": (et.beam_angle, NOTHING_KNOWN),
    "beam_angle: c": (lambda wrong: et.beam_angle(TABLE, wrong), NO_NUMBERS),
    "beam_angle: share": (lambda wrong: et.beam_angle(TABLE, share=wrong), NO_NUMBERS),
    "reference": (lambda wrong: et.beam_angle(TABLE, reference=wrong), (None, 3, ("maximum",))),
    "cut_off_angle: intensity": (et.cut_off_angle, NOTHING_KNOWN),
    "cut_off_angle: share": (lambda wrong: et.cut_off_angle(TABLE, wrong), NO_NUMBERS),
    "data_sheet: intensity": (et.data_sheet, NOTHING_KNOWN),
    "zonal_flux: intensity": (lambda wrong: et.zonal_flux(wrong, [0, 90]), NOTHING_KNOWN),
    "zonal_flux: edges": (lambda wrong: et.zonal_flux(TABLE, wrong), ("0,30", [0, "a"], {}, LMAP)),
    "plot_intensity: intensity": (et.plot_intensity, NOTHING_KNOWN),
    "write_intensity: path": (lambda wrong: et.write_intensity(wrong, TABLE), (TABLE, None, 3)),
    "write_intensity: intensity": (lambda wrong: et.write_intensity("a.ies", wrong), NOTHING_KNOWN),
    "intensity_distribution: rays": (et.intensity_distribution, NOTHING_KNOWN),
    "region_statistics: lmap": (lambda wrong: et.region_statistics(wrong, SQUARE), ("a.npz", None, SQUARE)),
    "region_statistics: region": (lambda wrong: et.region_statistics(LMAP, wrong), ((-1, 1, -1, 1), "0,1,0,1", None)),
    "a percentile": (lambda wrong: et.region_statistics(LMAP, SQUARE, wrong), ("50", None, [None], [5, "95"])),
    "rule for dead pixels": (lambda wrong: et.region_statistics(LMAP, SQUARE, dead=wrong), (None, 0)),
    "compare: region": (lambda wrong: et.compare(LMAP, LMAP, wrong), ((-1, 1, -1, 1), "0,1,0,1", 3)),
    "cross_section: x": (lambda wrong: et.cross_section(LMAP, x=wrong), ("0", [1.0], LMAP)),
    "cross_section": (lambda wrong: et.cross_section(wrong, x=0.0), ("a.npz", None, 3)),
    "combine_maps: maps": (et.combine_maps, (LMAP, 3, None)),
    "filter": (lambda wrong: et.filter_map(LMAP, wrong), ("opt", None, 3, ["average"], {})),
    "plot_map: lmap": (et.plot_map, ("a.npz", None, TABLE)),
    "plot_map: region": (lambda wrong: et.plot_map(LMAP, regions=wrong), (SQUARE, [(-1, 1, -1, 1)], None)),
    "plot_map: vmin": (lambda wrong: et.plot_map(LMAP, vmin=wrong), ("0", [1.0])),
    "plot_comparison: comparison": (et.plot_comparison, (LMAP, None)),
    "plot_cross_sections": (et.plot_cross_sections, (LMAP, [LMAP], et.cross_section(LMAP, x=0))),
    "draw_scene: scene": (et.draw_scene, ("a.toml", None, {})),
    "Observer: theta": (lambda wrong: et.Observer(wrong, 0, 1000), NO_NUMBERS),
    "Observer: distance": (lambda wrong: et.Observer(0, 0, wrong), NO_NUMBERS),
    "Screen: width": (lambda wrong: et.Screen(wrong, 8, 4, 4), NO_NUMBERS),
    "Screen: columns": (lambda wrong: et.Screen(8, 8, wrong, 4), NO_NUMBERS),
    "Region: left": (lambda wrong: et.Region(wrong, 1, 0, 1), NO_NUMBERS),
    "PolygonRegion: corners": (
        et.PolygonRegion,
        ([(0, 0, 1), (1, 0, 1), (0, 1, 1)], None, 3, [1, 2, 3], "0/0,1/0,0/1"),
    ),
    "Disk: radius": (lambda wrong: et.Disk(radius=wrong), ("3", LMAP, ["3"])),
    "write_rays: path": (lambda wrong: et.write_rays(wrong, et.RingSource(rays=10)), (et.RingSource(rays=10), None)),
    "write_rays: rays": (lambda wrong: et.write_rays("a.tm25ray", wrong), ("b.tm25ray", None, LMAP)),
    "plot_sweep: table": (et.plot_sweep, ("a.csv", None)),
    "plot_animation": (lambda wrong: et.plot_animation(wrong, "a.gif"), (LMAP, None, ["a.npz", "b.npz"])),
    "deconvolve: scan": (lambda wrong: et.deconvolve(wrong, wrong), ("scan.csv", None, LMAP)),
    "deconvolve_directions: scan": (et.deconvolve_directions, ("scan.csv", None, LMAP)),
    "plot: path": (lambda wrong: et.plot_map(LMAP, wrong), (3, ["a.png"])),
    "LightField.fit: rays": (et.LightField.fit, ("lamp.tm25ray", None, LMAP)),
    "parse_surface: text": (et.parse_surface, (None, 3, et.Disk(radius=3))),
    "path is": (et.read_rays, (None, 3.5, [])),
    # --- arrays of constructors -------------------------------------------------------------------------------------------
    "Intensity: c ": (lambda wrong: et.Intensity(wrong, TABLE.gamma, TABLE.values), NO_ARRAYS),
    "Intensity: gamma ": (lambda wrong: et.Intensity(TABLE.c, wrong, TABLE.values), NO_ARRAYS),
    "Intensity: values ": (lambda wrong: et.Intensity(TABLE.c, TABLE.gamma, wrong), NO_ARRAYS),
    "Intensity: standard_error ": (lambda wrong: et.Intensity(TABLE.c, TABLE.gamma, TABLE.values, wrong), NO_ARRAYS),
    "Intensity: luminaire ": (
        lambda wrong: et.Intensity(TABLE.c, TABLE.gamma, TABLE.values, luminaire=wrong),
        (None, "lamp", 3),
    ),
    "Intensity: C ": (lambda wrong: TABLE.at(wrong, 0), NO_ARRAYS),
    "LuminanceMap: values ": (lambda wrong: LMAP.replace(values=wrong), NO_ARRAYS),
    "LuminanceMap: standard_error ": (lambda wrong: LMAP.replace(standard_error=wrong), NO_ARRAYS),
    "LuminanceMap: rays ": (lambda wrong: LMAP.replace(rays=wrong), NO_ARRAYS),
    "LuminanceMap: screen ": (lambda wrong: LMAP.replace(screen=wrong), (None, (8, 8, 4, 4), "8,8,4,4")),
    "IlluminanceMap: values ": (lambda wrong: EMAP.replace(values=wrong), NO_ARRAYS),
    "IlluminanceMap: screen ": (lambda wrong: EMAP.replace(screen=wrong), (None, (8, 8, 4, 4), LMAP)),
    "IlluminanceMap: centre ": (lambda wrong: EMAP.replace(centre=wrong), NO_POINTS),
    "IlluminanceMap: right ": (lambda wrong: EMAP.replace(right=wrong), NO_POINTS),
    "RaySet: position ": (lambda wrong: et.RaySet(wrong, [[0, 0, 1]], [1]), NO_ARRAYS),
    "RaySet: direction ": (lambda wrong: et.RaySet([[0, 0, 0]], wrong, [1]), NO_ARRAYS),
    "RaySet: flux ": (lambda wrong: et.RaySet([[0, 0, 0]], [[0, 0, 1]], wrong), NO_ARRAYS),
    "RaySet: wavelength ": (
        lambda wrong: et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1], wavelength=wrong),
        tuple(wrong for wrong in NO_ARRAYS if wrong is not None),
    ),
    "spectra": (
        lambda wrong: et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1], spectra=wrong),
        (None, 3, "led.csv", [550.0], et.Spectrum([555.0], [1.0])),
    ),
    "Spectrum: wavelength ": (lambda wrong: et.Spectrum(wrong, [1.0]), NO_ARRAYS),
    "Spectrum: weight ": (lambda wrong: et.Spectrum([500.0], wrong), NO_ARRAYS),
    "GoniometerScan: angle ": (lambda wrong: et.GoniometerScan(wrong, [1.0]), NO_ARRAYS),
    "GoniometerScan: flux ": (lambda wrong: et.GoniometerScan([0.0], wrong), NO_ARRAYS),
    "GoniometerScan: incidence ": (lambda wrong: et.GoniometerScan([0.0], [1.0], incidence=wrong), NO_NUMBERS),
    "GoniometerScan: solid_angle ": (lambda wrong: et.GoniometerScan([0.0], [1.0], solid_angle=wrong), ("1", LMAP)),
    "DirectionalScan: direction ": (lambda wrong: et.DirectionalScan(wrong, [1.0]), NO_ARRAYS),
    "DirectionalScan: flux ": (lambda wrong: et.DirectionalScan([[0, 0, 1.0]], wrong), NO_ARRAYS),
    # --- settings ---------------------------------------------------------------------------------------------------------
    **{
        f"ScatterGoniometer: {name} ": (
            lambda wrong, name=name: et.ScatterGoniometer(**{name: wrong}),
            NO_NUMBERS if name != "photons" else ("0", [1.0, 2.0], LMAP),
        )
        for name in ("beam_diameter", "aperture_diameter", "distance", "wavelength", "divergence", "drift", "photons")
    },
    "profile of a beam ": (lambda wrong: et.ScatterGoniometer(profile=wrong), ("flat", None, {}, [1, "b"], LMAP)),
    **{
        f"NearFieldGoniophotometer: {name} ": (
            lambda wrong, name=name: et.NearFieldGoniophotometer(**{name: wrong}),
            NO_NUMBERS,
        )
        for name in ("step", "camera_pixels", "bits", "full_well", "level", "photometer_error", "arm_error")
    },
    "NearFieldGoniophotometer: distance ": (lambda wrong: et.NearFieldGoniophotometer(30, wrong), ("0", [1.0, 2.0])),
    "NearFieldGoniophotometer: misalignment ": (
        lambda wrong: et.NearFieldGoniophotometer(misalignment=wrong),
        tuple(wrong for wrong in NO_POINTS if wrong is not None),
    ),
    "Detector: rate ": (lambda wrong: et.Detector(wrong, 1e5), NO_NUMBERS),
    "Detector: filters ": (lambda wrong: et.Detector(1e9, 1e5, filters=wrong), NO_ARRAYS),
    "Baffle: length ": (lambda wrong: et.Baffle(24.0, wrong), NO_NUMBERS),
    "RingSource: radii ": (et.RingSource, (*NO_ARRAYS, 30.0)),
    "RingSource: flux ": (lambda wrong: et.RingSource(flux=wrong), (*NO_ARRAYS, 100.0)),
    **{
        f"RingSource: {name} ": (lambda wrong, name=name: et.RingSource(**{name: wrong}), (*NO_NUMBERS, 1.5))
        for name in ("rays", "runs", "seed")
    },
    "Observer: target ": (lambda wrong: et.Observer(0, 0, 1000, target=wrong), NO_POINTS),
    "Observer: up ": (
        lambda wrong: et.Observer(90, 0, 1000, up=wrong),
        (*(wrong for wrong in NO_POINTS if wrong is not None), (0, 0, 0)),
    ),
    # --- functions --------------------------------------------------------------------------------------------------------
    "beam_angle: about": (lambda wrong: et.beam_angle(TABLE, about=wrong), ("0", [1.0], LMAP)),
    "agreement: lobes": (et.agreement, (None, 3, SCAN)),
    "agreement: one of the lobes": (et.agreement, (["a.csv", "b.csv"], [LMAP, LMAP], "ab")),
    "agreement: floor": (lambda wrong: et.agreement([SCAN, SCAN], floor=wrong), NO_NUMBERS),
    "bsdf_table: lobes": (et.bsdf_table, (None, 3, LMAP)),
    "bsdf_table: one of the lobes": (et.bsdf_table, ("scan.csv", ["scan.csv"], [SCAN])),
    "revolved: scan": (et.revolved, ("scan.csv", None, LMAP)),
    "revolved: values": (lambda wrong: et.revolved(SCAN, wrong), ("x", [1, "b"], {})),
    "revolved: middle": (lambda wrong: et.revolved(SCAN, middle=wrong), ("0", LMAP)),
    "deconvolve: middle": (lambda wrong: et.deconvolve(SCAN, SCAN, middle=wrong), ("0", LMAP)),
    "stop is": (lambda wrong: et.deconvolve(SCAN, SCAN, stop=wrong), ([3], {}, 2.5)),
    "diagnose: field": (et.diagnose, ("lamp.tm25ray", None, LMAP, et.RingSource(rays=10))),
    "threshold_sweep: rays": (lambda wrong: et.threshold_sweep(wrong, et.Disk(radius=30)), ("a.tm25ray", None, LMAP)),
    "threshold_sweep: surface": (lambda wrong: et.threshold_sweep(et.RingSource(rays=10), wrong), ("auto", None, 30.0)),
    "threshold_sweep: thresholds": (
        lambda wrong: et.threshold_sweep(et.RingSource(rays=10), et.Disk(radius=30), 10.0, wrong),
        ("5", None, ["5", "x"]),
    ),
    "pixel is": (lambda wrong: et.threshold_sweep(et.RingSource(rays=10), et.Disk(radius=30), wrong), ("1", None)),
    "gamma_step is": (lambda wrong: et.intensity_distribution(et.RingSource(rays=10), 4, wrong), ("5", [5.0], LMAP)),
    "LightField.fit: surface": (lambda wrong: et.LightField.fit(et.RingSource(rays=10), wrong), (None, 30.0, LMAP)),
    "GriddedSource.fit: rays": (lambda wrong: et.GriddedSource.fit(wrong, et.Disk(radius=30)), ("a.tm25ray", None)),
    "report_source: observers": (
        lambda wrong: et.report_source(et.RingSource(rays=10).ray_set(), observers=wrong),
        (3, et.Observer(0, 0, 1000)),
    ),
    "sweep: parameters": (lambda wrong: et.sweep(et.Scene(), wrong, "flux"), (None, "lamp.flux", ["lamp.flux"])),
    "sweep: measure": (lambda wrong: et.sweep(LAMP, {"lamp.flux": [1, 2]}, wrong), (None, 3)),
    "sweep: one of the measures": (lambda wrong: et.sweep(LAMP, {"lamp.flux": [1, 2]}, wrong), ([3], ["flux", None])),
    "sweep: observer": (
        lambda wrong: et.sweep(LAMP, {"lamp.flux": [1, 2]}, "flux", wrong, et.Screen(8, 8, 4, 4)),
        (3, "front", [LMAP]),
    ),
    "resume is": (
        lambda wrong: et.trace(et.Scene(sources=[{"kind": "point", "flux": 1}]), 10, resume=wrong),
        (3, LMAP, [1]),
    ),
    "total flux is": (lambda wrong: et.RingSource(rays=10).ray_set().with_total_flux(wrong), NO_NUMBERS),
    "scale factor is": (lambda wrong: et.RingSource(rays=10).ray_set().scaled(wrong), NO_NUMBERS),
    "subset: the number of rays is": (
        lambda wrong: et.RingSource(rays=10).ray_set().subset(wrong, 1),
        (*NO_NUMBERS, 1.5),
    ),
    "merge: sets": (et.RaySet.merge, (None, 3, LMAP)),
    "merge: one of the sets": (et.RaySet.merge, (["a.tm25ray"], "a.tm25ray", [LMAP])),
    "bsdf is": (et.ScatterGoniometer().measure, ("paint.bsdf", None, LMAP)),
    "theta is": (lambda wrong: et.ScatterGoniometer().measure(PAINT, wrong, way="reflected"), NO_NUMBERS),
    "step is": (lambda wrong: et.ScatterGoniometer().measure(PAINT, step=wrong), NO_NUMBERS),
    # --- pictures ---------------------------------------------------------------------------------------------------------
    "unknown side ": (lambda wrong: et.plot_bsdf(PAINT, side=wrong), NO_NAMES),
    "plot_bsdf: bsdf": (et.plot_bsdf, NOTHING_KNOWN),
    "plot_bsdf: incidence": (lambda wrong: et.plot_bsdf(PAINT, incidence=wrong), NO_NUMBERS),
    "plot_deconvolution: found": (et.plot_deconvolution, (*NOTHING_KNOWN, SCAN)),
    "plot_directions: found": (et.plot_directions, (*NOTHING_KNOWN, SCAN)),
    "plot_characteristic: diagnostics": (et.plot_characteristic, NOTHING_KNOWN),
    "plot_near_field: run": (et.plot_near_field, NOTHING_KNOWN),
    "plot_report: report": (et.plot_report, NOTHING_KNOWN),
    "plot_threshold_sweep: sweep": (et.plot_threshold_sweep, NOTHING_KNOWN),
    "plot_animation: path": (lambda wrong: et.plot_animation([LMAP, LMAP], wrong), (None, 3, LMAP)),
    "plot_animation: vmax": (lambda wrong: et.plot_animation([LMAP, LMAP], "a.gif", vmax=wrong), ("0", [1.0])),
    "plot: cmap": (lambda wrong: et.plot_map(LMAP, cmap=wrong), (3, ("red", "blue"), LMAP)),
    "plot_comparison: ": (
        lambda wrong: et.plot_comparison(et.compare(LMAP, LMAP), labels=wrong),
        (None, "ab", 3, ("one",), (1, 2)),
    ),
    "plot_cross_sections: labels": (
        lambda wrong: et.plot_cross_sections([et.cross_section(LMAP, x=0)], labels=wrong),
        (3, "a", LMAP),
    ),
    # --- scans and BSDFs --------------------------------------------------------------------------------------------------
    "fit_bsdf: scans": (lambda wrong: et.fit_bsdf(wrong, "lambertian"), (*NOTHING_KNOWN, ["a.csv"])),
    "model to fit": (lambda wrong: et.fit_bsdf(SCANS, wrong), NO_NAMES),
    "scans is": (et.Bsdf.from_scans, (*NOTHING_KNOWN, ["a.csv"])),
    "method of interpolation": (lambda wrong: et.Bsdf.from_scans(SCANS, wrong), NO_NAMES),
    **{
        f"Scans: {name} ": (
            lambda wrong, name=name: et.Scans(
                **({"incident": [UP], "scattered": [UP], "values": [1.0]} | {name: wrong})
            ),
            tuple(wrong for wrong in NO_ARRAYS if name != "standard_error" or wrong is not None),
        )
        for name in ("incident", "scattered", "values", "standard_error")
    },
    "Scans: reflectance ": (lambda wrong: et.Scans([UP], [UP], [1.0], None, wrong), ("0.5", [0.5], LMAP)),
    "Scans.from_stages: stages ": (
        lambda wrong: et.Scans.from_stages(wrong, [1.0], 1.0, solid_angle=1e-3),
        NO_ARRAYS,
    ),
    "Scans.from_stages: solid_angle ": (
        lambda wrong: et.Scans.from_stages([[0.0, 0.0, 30.0, 0.0]], [1.0], 1.0, solid_angle=wrong),
        NO_NUMBERS,
    ),
    "read_scans: paths ": (et.read_scans, (None, 3, "a.csv", LMAP, Path("a.csv"))),
    "read_scans: one of the paths ": (et.read_scans, ([None], [3], np.eye(2), [["a.csv"]])),
    "read_scans: blank ": (lambda wrong: et.read_scans(["a.csv"], blank=wrong), (3, ["a.csv"], LMAP)),
    "read_scans: solid_angle ": (lambda wrong: et.read_scans(["a.csv"], solid_angle=wrong), ("1", [1.0])),
    "no file of scans": (et.read_scans, ([], (), iter(()))),
    "read_bsdf: path ": (et.read_bsdf, (None, 3, LMAP, "a\0b")),
    "read_bsdf: one of the paths ": (et.read_bsdf, ([None], [3], np.eye(2))),
    "read_bsdf: there is no file": (et.read_bsdf, ([], {})),
    "write_bsdf: path ": (lambda wrong: et.write_bsdf(wrong, PAINT), (None, 3, PAINT, ["a.h5"])),
    "write_bsdf: bsdf ": (lambda wrong: et.write_bsdf("a.h5", wrong), NOTHING_KNOWN),
    "BSDF format": (lambda wrong: et.write_bsdf("a.h5", PAINT, wrong), NAMES_GIVEN),
    "BsdfTable: data ": (et.BsdfTable, (*NOTHING_KNOWN, PAINT)),
    "incident is": (lambda wrong: PAINT.evaluate(wrong, UP), NO_ARRAYS),
    "scattered is": (lambda wrong: PAINT.pdf(UP, wrong), NO_ARRAYS),
    "theta is ": (PAINT.reflectance, NO_ARRAYS),
    "phi is ": (lambda wrong: PAINT.transmittance(10.0, wrong), NO_ARRAYS),
    "wavelength is": (lambda wrong: PAINT.reflectance(10.0, wavelength=wrong), NO_NUMBERS),
    "media is": (lambda wrong: PAINT.reflectance(10.0, media=wrong), (*NO_ARRAYS, 1.5, [1.0], [1.0, 0.0])),
    "unknown side": (lambda wrong: PAINT.known_to(side=wrong), NO_NAMES),
    "n is": (lambda wrong: PAINT.sample(UP, wrong), (*NO_NUMBERS, -1, 1.5, True)),
    # --- instruments ------------------------------------------------------------------------------------------------------
    "unknown operator": (lambda wrong: et.deconvolve(SCAN, SCAN, operator=wrong), NO_NAMES),
    "unknown method": (lambda wrong: et.deconvolve(SCAN, SCAN, method=wrong), NAMES_GIVEN),
    "replicates is": (lambda wrong: et.deconvolve(SCAN, SCAN, replicates=wrong), (*NO_NUMBERS, -1, 1, 2.5, 10**9)),
    "deconvolve: middle is": (lambda wrong: et.deconvolve(SCAN, SCAN, middle=wrong), (np.nan, np.inf, 1e9)),
    "stop: the number of iterations is": (lambda wrong: et.deconvolve(SCAN, SCAN, stop=wrong), (True, 0, -1)),
    "the middle of the lobe, nan": (lambda wrong: et.revolved(SCAN, middle=wrong), (np.nan,)),
    "deconvolve_directions: models ": (
        lambda wrong: et.deconvolve_directions(WINDOW, models=wrong),
        (None, 3, "gaussian", LMAP),
    ),
    "a solid angle of inf": (lambda wrong: dataclasses.replace(SCAN, solid_angle=wrong), (np.inf,)),
    "a background of inf": (lambda wrong: dataclasses.replace(WINDOW, background=wrong), (np.inf,)),
    "DirectionalScan.extent: cell ": (WINDOW.extent, NO_NUMBERS),
    "DirectionalScan: bench ": (lambda wrong: dataclasses.replace(WINDOW, bench=wrong), (3, "bench", METER)),
    "Detector.exposures: flux ": (METER.exposures, (*NO_ARRAYS, 1.0, np.eye(2))),
    "seed is": (lambda wrong: METER.read([1.0], wrong), (*NO_NUMBERS, -1, 1.5, True)),
    "Baffle.field: aperture ": (lambda wrong: et.Baffle(24, 200).field(wrong, 500.0), NO_NUMBERS),
    "Baffle.field: distance ": (lambda wrong: et.Baffle(24, 200).field(25.0, wrong), NO_NUMBERS),
    "Baffle.etendue: aperture ": (et.Baffle(24, 200).etendue, (*NO_NUMBERS, 0, np.nan, np.inf)),
    "rays is": (lambda wrong: et.ScatterGoniometer().measure(PAINT, rays=wrong), (*NO_NUMBERS, 0, 1.5, 10**30)),
    "span is": (lambda wrong: et.ScatterGoniometer().instrument_function(span=wrong), ("6", [6.0], LMAP)),
    "turn is": (lambda wrong: et.ScatterGoniometer().measure_window(PAINT, turn=wrong), NO_NUMBERS),
    "the step over a hemisphere is": (
        lambda wrong: et.ScatterGoniometer().measure_hemisphere(PAINT, step=wrong),
        NO_NUMBERS,
    ),
    "directions ": (
        lambda wrong: et.ScatterGoniometer().measure_directions(PAINT, wrong),
        (*NO_ARRAYS, 1.0, [0.0, 0.0, 1.0]),
    ),
    "size is": (
        lambda wrong: et.NearFieldGoniophotometer().measure(len, size=wrong),
        ("3", [3.0], LMAP, 0.0, -1.0, np.nan, np.inf),
    ),
    # --- sources and light fields -----------------------------------------------------------------------------------------
    "unknown symmetry": (lambda wrong: et.LightField.fit(RINGS, DISK, symmetry=wrong), NO_NAMES),
    "LightField.fit: depths": (
        lambda wrong: et.LightField.fit(RINGS, DISK, depths=wrong),
        ("2222", 2, (2, 2), (2, 2, 2, 2.5), (2, 2, 2, -1), (2, 2, 2, 17), [[2, 2], [2, 2]], [[2], [2, 2]], {}, LMAP),
    ),
    "FieldRays: the number of rays is": (lambda wrong: field().rays(wrong), (*NO_NUMBERS, 0, 1.5)),
    "points is": (lambda wrong: field().luminance(wrong, [UP]), NO_ARRAYS),
    "directions is": (lambda wrong: field().pdf([UP], wrong), NO_ARRAYS),
    "c_planes is": (lambda wrong: field().intensity(wrong, 30.0), ("4", [4], 1.5, 0, LMAP)),
    "gamma_step is ": (lambda wrong: patches().intensity(4, wrong), (*NO_NUMBERS, 7.0, np.nan)),
    "give the path of a file": (lambda wrong: field().save(wrong), (None, 3, LMAP, ["a.h5"], "a\0b")),
    "coarsest bins": (
        lambda wrong: et.GriddedSource.fit(RINGS, DISK, coarsest_bins=wrong),
        (None, 30, "30", (), (30, 90, 1), np.eye(2), (31, 90), LMAP),
    ),
    "place of the lattice": (lambda wrong: et.GriddedSource.fit(RINGS, DISK, centre_on=wrong), NO_NAMES),
    "sample: n ": (lambda wrong: patches().sample(wrong, 1), (*NO_NUMBERS, 0, 1.5, 10**30)),
    "flux is ": (lambda wrong: patches().emitting(wrong), (*NO_NUMBERS, 0.0, np.nan)),
    "luminance: points": (lambda wrong: patches().luminance(wrong, [UP]), NO_ARRAYS),
    "folder is": (et.GriddedSource.load, (None, 3, LMAP)),
    "scenes is": (lambda wrong: patches().save_patches("a", scenes=wrong), (None, 3, LMAP)),
    "format of patches": (lambda wrong: patches().save_patches("a", wrong), NO_NAMES),
    "rays is ": (et.Disk().sized_for, NOTHING_KNOWN),
    "RayIndex.build: rays ": (et.RayIndex.build, NOTHING_KNOWN),
    "RingSource.luminance: x ": (lambda wrong: RINGS.luminance(wrong, 0.0), NO_ARRAYS),
    "RingSource: observer ": (lambda wrong: RINGS.pixel_luminance(wrong, VIEW[1]), NOTHING_KNOWN),
    "RingSource: subdivision ": (lambda wrong: RINGS.pixel_luminance(*VIEW, wrong), (*NO_NUMBERS, 0, -1, 1.5, 10**9)),
    "batches: size ": (lambda wrong: next(RINGS.batches(wrong)), (*NO_NUMBERS, 0, 1.5)),
    "offset is": (RINGS.ray_set().moved, (*NO_ARRAYS, (1.0, 2.0))),
    "rotated: angle ": (lambda wrong: RINGS.ray_set().rotated(UP, wrong), NO_NUMBERS),
    "propagated_to_sphere: radius ": (lambda wrong: RINGS.ray_set().propagated_to_sphere(UP, wrong), NO_NUMBERS),
    "flux unit": (lambda wrong: RINGS.ray_set().with_total_flux(1.0, wrong), ("", 0, [], {}, np.eye(2), "lx")),
    # --- scenes, maps and tables ------------------------------------------------------------------------------------------
    "trace_work: before ": (lambda wrong: et.trace_work(LAMP, 10, before=wrong), (3, "a.h5", LMAP, LAMP)),
    "TraceWork: the number": (et.trace_work(LAMP, 10), NO_NUMBERS),
    "TraceWork.join: units ": (et.trace_work(LAMP, 10).join, (None, 3, LMAP)),
    "TraceWork.join: one of the units ": (et.trace_work(LAMP, 10).join, ("abc", [None], [LMAP])),
    "TraceWork.join: start ": (lambda wrong: et.trace_work(LAMP, 10).join([], wrong), ("a.h5", 3, LMAP)),
    "unknown detector": (lambda wrong: et.trace(LAMP, 10).quantity_of(wrong), NO_NAMES),
    "Scene.from_dict: data ": (et.Scene.from_dict, (None, 3, "a.toml", LAMP, [("name", "a")])),
    "compile_scene: scene ": (et.scene.compile_scene, NOTHING_KNOWN),
    "section is": (lambda wrong: et.draw_scene(LAMP, section=wrong), ([3], [None], [["y=0"]])),
    "Screen: observer ": (VIEW[1].axes, NOTHING_KNOWN),
    "Region: screen ": (SQUARE.mask, NOTHING_KNOWN),
    "LuminanceMap: observer ": (lambda wrong: LMAP.replace(observer=wrong), NOTHING_KNOWN),
    "LuminanceMap: provenance ": (lambda wrong: LMAP.replace(provenance=wrong), NOTHING_KNOWN),
    "Intensity: C": (TABLE.between_planes, (*NO_ARRAYS, np.nan)),
    "Intensity.largest_between: low ": (lambda wrong: TABLE.largest_between(wrong, 90.0), NO_NUMBERS),
    "Intensity.symmetry: tolerance ": (TABLE.symmetry, NO_NUMBERS),
    "Intensity.scaled: factor ": (TABLE.scaled, NO_NUMBERS),
    "Intensity: provenance ": (lambda wrong: TABLE.replace(provenance=wrong), NOTHING_KNOWN),
    "RaySet: provenance ": (lambda wrong: RINGS.ray_set().replace(provenance=wrong), NOTHING_KNOWN),
    "acceptance is": (lambda wrong: et.Cone(acceptance=wrong), (np.eye(2), "wide", [1.0], LMAP)),
    "surface is": (lambda wrong: et.FromField(surface=wrong), (np.eye(2), "disk", None, LMAP)),
    "intensity format that can be written": (lambda wrong: et.write_intensity("a.ies", TABLE, wrong), NAMES_GIVEN),
    "write_intensity: rotate ": (lambda wrong: et.write_intensity("a.ies", TABLE, rotate=wrong), NO_NUMBERS),
    "path is ": (LMAP.save, (None, 3, LMAP, ["a.npz"], "a\0.npz")),
    "SweepTable: parameters ": (lambda wrong: et.SweepTable(wrong, {}, {}, {}, 0), (None, 3, "a", [1.0])),
    "SweepTable: done ": (lambda wrong: et.SweepTable({"a": [1.0]}, {}, {}, {}, wrong), NO_NUMBERS),
    "plot_cross_sections: one of the labels": (
        lambda wrong: et.plot_cross_sections([et.cross_section(LMAP, x=0)], labels=wrong),
        ([None], [3]),
    ),
    "plot_near_field: c is": (lambda wrong: et.plot_near_field(run(), c=wrong), (*NO_NUMBERS, np.nan, np.inf)),
    "NearFieldRun.luminance_map: gamma is": (lambda wrong: run().luminance_map(wrong), (*NO_NUMBERS, np.nan)),
    "NearFieldRun.ray_set: rays ": (lambda wrong: run().ray_set(wrong), ("9", [9], 0, 1.5, np.nan, 1e12, LMAP)),
    "NearFieldRun.using: exposures ": (lambda wrong: run().using(wrong), (*NO_NUMBERS, 0, 2)),
    "exposures_needed: error ": (lambda wrong: run().exposures_needed(wrong), NO_NUMBERS),
    "sees_light: position ": (lambda wrong: run().sees_light(wrong), (*NO_NUMBERS, -1, 10**6)),
}
"""By what the message begins with or names: a call, and what it refuses."""


@pytest.mark.parametrize("name", CALLS)
def test_the_message_names_the_argument(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, wrong = CALLS[name]
    for given in wrong:
        with pytest.raises(et.EtendueError) as refused:
            call(given)
        assert isinstance(refused.value, ValueError)
        assert name in str(refused.value), given
    assert not list(tmp_path.iterdir())


WITH_PROGRESS: dict[str, Callable[[Any], object]] = {
    "luminance_map": lambda wrong: et.luminance_map(RINGS, *VIEW, progress=wrong),
    "intensity_distribution": lambda wrong: et.intensity_distribution(RINGS, progress=wrong),
    "threshold_sweep": lambda wrong: et.threshold_sweep(RINGS, DISK, progress=wrong),
    "LightField.fit": lambda wrong: et.LightField.fit(RINGS, DISK, progress=wrong),
    "GriddedSource.fit": lambda wrong: et.GriddedSource.fit(RINGS, DISK, progress=wrong),
    "report_source": lambda wrong: et.report_source(RINGS.ray_set(), progress=wrong),
    "trace": lambda wrong: et.trace(LAMP, 10, progress=wrong),
    "sweep": lambda wrong: et.sweep(LAMP, {"lamp.flux": [1, 2]}, "flux", progress=wrong),
    "NearFieldGoniophotometer.measure": lambda wrong: et.NearFieldGoniophotometer().measure(LAMP, progress=wrong),
}


@pytest.mark.parametrize("name", WITH_PROGRESS)
def test_progress_is_called_or_none(name: str) -> None:
    for given in ("bar", 3, True, [], LMAP):
        with pytest.raises(et.ArgumentError, match=r"^progress is .*; give a function"):
            WITH_PROGRESS[name](given)


def test_what_is_meant_is_said() -> None:
    with pytest.raises(et.ArgumentError, match=r"et\.denoise_map\(lmap\)"):
        et.filter_map(LMAP, "opt")
    with pytest.raises(et.ArgumentError, match=r"et\.Region\(left, right, bottom, top\)"):
        et.region_statistics(LMAP, (-1, 1, -1, 1))  # type: ignore[arg-type]
    with pytest.raises(et.ArgumentError, match=r"et\.read_intensity\(path\)"):
        et.beam_angle("lamp.ies")  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers() -> None:
    """Scalars, and arrays without axes, as they come out of computations."""
    zero = np.array(0.0)
    assert et.beam_angle(TABLE, zero).angle == et.beam_angle(TABLE, np.float32(0.0)).angle == et.beam_angle(TABLE).angle
    assert et.Disk(radius=np.int64(3)) == et.Disk(radius=3)
    assert et.Observer(np.float64(30.0), 0, np.int32(1000)) == et.Observer(30, 0, 1000)
    assert et.cross_section(LMAP, x=np.float64(1.0)).values.tolist() == VALUES[::-1, 2].tolist()


COUNTS: dict[str, Callable[[Any], object]] = {
    "rings": lambda n: et.RingSource(rays=n, seed=3).ray_set().flux,
    "subset": lambda n: et.RingSource(rays=200).ray_set().subset(n, 1).direction,
    "field": lambda n: field().sample(n).direction,
    "patches": lambda n: patches().sample(n, 1).direction,
    "BSDF": lambda n: PAINT.sample(UP, n),
    "trace": lambda n: str(et.trace(LAMP, rays=n).ledger),
    "near field": lambda n: run().ray_set(n).direction,
    "lines of sight": lambda n: repr(et.PathTracing(rays_per_pixel=n)),
    "points": lambda n: repr(et.FromField(samples=n)),
}


@pytest.mark.parametrize("door", COUNTS)
def test_counts_may_be_powers_of_ten(door: str) -> None:
    """1e2 and 100 are the same number of rays wherever rays are counted."""
    count = COUNTS[door]
    np.testing.assert_array_equal(count(1e2), count(100))  # NaN where a ray is absorbed


def test_one_percentile_is_one() -> None:
    """50 and [50] are the same: the median of 60, 70, 100 and 110."""
    one = et.region_statistics(LMAP, SQUARE, 50)
    assert one.percentiles == ((50.0, 85.0),)
    assert one == et.region_statistics(LMAP, SQUARE, [50])


@pytest.mark.slow
def test_the_intensity_of_a_light_field_is_its_own() -> None:
    """By rays of the field, drawn at random, as a second route: all of the flux, and four nodes within four errors
    (by chance once in 4000 times)."""
    field = et.LightField.fit(et.RingSource(rays=20_000, seed=1).ray_set(), et.Disk(radius=30), depths=(2, 2, 2, 2))
    found = et.intensity_distribution(field, 4, 10)
    np.testing.assert_array_equal(found.values, field.intensity(4, 10).values)
    drawn = et.intensity_distribution(field.rays(200_000, seed=3), 4, 10)
    assert drawn.flux == pytest.approx(found.flux)
    row = 3
    assert abs(drawn.values[:, row] - found.values[:, row]).max() < 4 * drawn.standard_error[:, row].max()


@pytest.mark.parametrize("value", [RINGS.ray_set(), LMAP, EMAP, TABLE], ids=lambda value: type(value).__name__)
def test_fields_that_are_not_there_are_not_replaced(value: Any) -> None:
    kind = type(value).__name__
    assert value.replace(notes=("new",)).notes == ("new",) if kind != "RaySet" else value.replace(flux_unit="W")
    with pytest.raises(et.UnknownNameError, match=rf"field of a {kind} 'provenence'\. Did you mean 'provenance'"):
        value.replace(provenence=None)
    if kind == "RaySet":
        with pytest.raises(et.UnknownNameError, match=r"field of a RaySet 'flux'\. Did you mean 'flux_unit'"):
            value.replace(flux=3.0)
