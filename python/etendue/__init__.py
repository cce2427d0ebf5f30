"""What a luminaire looks like before it exists: luminance maps from ray files, with an error bar in every pixel.

>>> import etendue as et
>>> rays = et.RingSource(rays=20_000)                    # or et.read_rays("led.tm25ray")
>>> lmap = et.luminance_map(rays, et.Observer(theta=30, phi=0, distance=1000), et.Screen(80, 80, 16, 16))
>>> lmap.values.shape, lmap.unit
((16, 16), 'cd/m²')
"""

import importlib
import importlib.util
from typing import Any

from etendue.quantities.notebook import InNotebook, Pages
from etendue.quantities.outlets import GoesOut, MapOutlets

PUBLIC = {
    "etendue.errors": (
        "ArgumentError",
        "EtendueError",
        "FormatError",
        "MemoryLimitError",
        "MissingLibraryError",
        "OutputError",
        "SceneError",
        "SceneWarning",
        "UnitError",
        "UnknownNameError",
        "UnsupportedFormatError",
    ),
    "etendue.formats.input": ("WaitingWarning",),
    "etendue.formats.intensity": ("read_intensity", "write_intensity"),
    "etendue.formats.maps": ("read_illuminance_map", "read_map"),
    "etendue.formats.rays": ("read_rays", "write_rays"),
    "etendue.formats.rays.ray_index": ("RayIndex",),
    "etendue.goniophotometry.far_field": ("intensity_distribution",),
    "etendue.goniophotometry.threshold_sweep": ("threshold_sweep",),
    "etendue.instruments.agreement": ("Agreement", "agreement"),
    "etendue.instruments.deconvolution": ("Deconvolution", "deconvolve"),
    "etendue.instruments.detectors": ("Baffle", "Detector"),
    "etendue.instruments.directional_deconvolution": ("DirectionalDeconvolution", "deconvolve_directions"),
    "etendue.instruments.directional_scan": ("DirectionalScan", "read_directional_scan"),
    "etendue.instruments.goniometer_scan": ("GoniometerScan", "read_goniometer_scan"),
    "etendue.instruments.lobe_table": ("bsdf_table",),
    "etendue.instruments.near_field.goniophotometer": ("NearFieldGoniophotometer",),
    "etendue.instruments.near_field.run": ("NearFieldRun",),
    "etendue.instruments.revolved": ("revolved",),
    "etendue.instruments.scatter_goniometer": ("ScatterGoniometer",),
    "etendue.lightfield.carrier": (
        "Box",
        "Cylinder",
        "Disk",
        "Dome",
        "Hemisphere",
        "Plane",
        "Sphere",
        "parse_surface",
    ),
    "etendue.lightfield.diagnostics": ("diagnose",),
    "etendue.lightfield.fit_cache": ("cache_content", "clear_cache"),
    "etendue.lightfield.gridded.gridded_source": ("GriddedSource",),
    "etendue.lightfield.light_field": ("LightField",),
    "etendue.luminance.combination": ("combine_maps",),
    "etendue.luminance.comparison": ("compare", "cross_section"),
    "etendue.luminance.denoising": ("denoise_map",),
    "etendue.luminance.estimate": ("luminance_map",),
    "etendue.luminance.filters": ("filter_map",),
    "etendue.luminance.region_statistics": ("RegionStatistics", "region_statistics"),
    "etendue.luminance.regions": ("PolygonRegion", "Region"),
    "etendue.luminance.source_report": ("SourceReport", "report_source"),
    "etendue.luminance.methods": ("Cone", "FromField", "PathTracing"),
    "etendue.plot": (
        "draw_scene",
        "plot_animation",
        "plot_bsdf",
        "plot_characteristic",
        "plot_comparison",
        "plot_cross_sections",
        "plot_deconvolution",
        "plot_directions",
        "plot_intensity",
        "plot_map",
        "plot_near_field",
        "plot_report",
        "plot_sweep",
        "plot_threshold_sweep",
    ),
    "etendue.quantities.beam_angle": ("BeamAngle", "beam_angle", "cut_off_angle"),
    "etendue.quantities.data_sheet": ("DataSheet", "data_sheet"),
    "etendue.quantities.illuminance_map": ("IlluminanceMap",),
    "etendue.quantities.intensity": ("Intensity",),
    "etendue.quantities.luminance_map": ("LuminanceMap",),
    "etendue.quantities.observer": ("Observer", "Screen"),
    "etendue.quantities.ray_set": ("RaySet",),
    "etendue.quantities.report": ("ChangedFileWarning", "RayFileWarning"),
    "etendue.quantities.spectrum": ("Spectrum",),
    "etendue.quantities.zonal_flux": ("zonal_flux",),
    "etendue.scatter.files": ("read_bsdf", "write_bsdf"),
    "etendue.scatter.model_fit": ("BsdfFit", "fit_bsdf"),
    "etendue.scatter.scans.files": ("read_scans",),
    "etendue.scatter.scans.scans": ("Scans",),
    # `Bsdf.from_scans` makes tables: where those are made, `Bsdf` knows of them.
    "etendue.scatter.table": ("Bsdf", "BsdfTable"),
    "etendue.scene": ("Scene",),
    "etendue.scene.scatter_events": ("ScatterEvents",),
    "etendue.sources.ring_source": ("RingSource",),
    "etendue.sweeps.running": ("sweep", "sweep_steps"),
    "etendue.sweeps.table": ("SweepTable",),
    "etendue.tracing": ("TraceResult", "TraceWork", "trace", "trace_rounds", "trace_work"),
    "etendue.tracing.ledger": ("TraceWarning",),
    "etendue.viewer.notebook": ("view",),
}
"""Public names by the module that has them, which is imported when one of them is asked for (PEP 562): all of them together
take four times as long as numpy. `__init__.pyi` says the same to type checkers and editors."""

MODULES = {"bsdf": "etendue.scatter.models", "scene": "etendue.scene"}
"""Public names of whole modules."""

HOMES = {name: module for module, names in PUBLIC.items() for name in names}

__all__ = sorted([*HOMES, *MODULES])  # noqa: PLE0605 - the stub has the names in so many words


def __getattr__(name: str) -> Any:
    if name in HOMES:
        found = getattr(importlib.import_module(HOMES[name]), name)
    elif name in MODULES:
        found = importlib.import_module(MODULES[name])
    elif name == "__version__":
        found = importlib.import_module("etendue.quantities.provenance").version()
    elif not name.startswith("_") and importlib.util.find_spec(f"etendue.{name}"):
        found = importlib.import_module(f"etendue.{name}")
    else:
        raise AttributeError(f"module 'etendue' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])


def _later(module: str, name: str) -> Any:
    """A function of a higher floor, imported when it is called."""

    def call(*args: Any, **options: Any) -> Any:
        return getattr(importlib.import_module(module), name)(*args, **options)

    return call


# Maps are quantities, which cannot import the files and pictures above them; values in notebooks neither.
GoesOut.outlets = MapOutlets(save=_later("etendue.formats.maps", "save_map"), plot=_later("etendue.plot", "plot_map"))
InNotebook.pages = Pages(of=_later("etendue.plot.notebook", "notebook_page"))
