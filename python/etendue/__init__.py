"""What a luminaire looks like before it exists: luminance maps from ray files, with an error bar in every pixel.

>>> import etendue as et
>>> rays = et.RingSource(rays=20_000)                    # or et.read_rays("led.tm25ray")
>>> lmap = et.luminance_map(rays, et.Observer(theta=30, phi=0, distance=1000), et.Screen(80, 80, 16, 16))
>>> lmap.values.shape, lmap.unit
((16, 16), 'cd/m²')
"""

import importlib
from typing import TYPE_CHECKING, Any

from etendue.errors import (
    ArgumentError,
    EtendueError,
    FormatError,
    MemoryLimitError,
    MissingLibraryError,
    OutputError,
    SceneError,
    SceneWarning,
    UnitError,
    UnknownNameError,
    UnsupportedFormatError,
)
from etendue.formats.input import WaitingWarning
from etendue.formats.intensity import read_intensity, write_intensity
from etendue.formats.maps import read_illuminance_map, read_map, save_map
from etendue.formats.rays import read_rays, write_rays
from etendue.formats.rays.ray_index import RayIndex
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.goniophotometry.threshold_sweep import threshold_sweep
from etendue.lightfield.diagnostics import diagnose
from etendue.lightfield.fit_cache import cache_content, clear_cache
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.light_field import LightField
from etendue.lightfield.surfaces import Box, Cylinder, Disk, Dome, Hemisphere, Plane, Sphere, parse_surface
from etendue.luminance.combination import combine_maps
from etendue.luminance.comparison import Region, compare, cross_section
from etendue.luminance.denoising import denoise_map
from etendue.luminance.estimate import luminance_map
from etendue.luminance.filters import filter_map
from etendue.luminance.methods import Cone, FromField, PathTracing
from etendue.plot import (
    draw_scene,
    plot_bsdf,
    plot_characteristic,
    plot_comparison,
    plot_cross_sections,
    plot_deconvolution,
    plot_directions,
    plot_intensity,
    plot_map,
    plot_threshold_sweep,
)
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.notebook import InNotebook, Pages
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.pixel_map import MapOutlets, PixelMap
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import ChangedFileWarning, RayFileWarning
from etendue.quantities.spectrum import Spectrum
from etendue.scene.scatter_events import ScatterEvents
from etendue.sources.ring_source import RingSource
from etendue.tracing import TraceResult, TraceWork, trace, trace_rounds, trace_work
from etendue.tracing.ledger import TraceWarning

if TYPE_CHECKING:
    from etendue import scene
    from etendue.instruments.deconvolution import Deconvolution, deconvolve
    from etendue.instruments.directional_deconvolution import DirectionalDeconvolution, deconvolve_directions
    from etendue.instruments.directional_scan import DirectionalScan, read_directional_scan
    from etendue.instruments.goniometer_scan import GoniometerScan, read_goniometer_scan
    from etendue.instruments.lobe_table import bsdf_table
    from etendue.instruments.scatter_goniometer import ScatterGoniometer
    from etendue.scatter import models as bsdf
    from etendue.scatter.bsdf import Bsdf
    from etendue.scatter.files import read_bsdf, write_bsdf
    from etendue.scatter.scans.files import read_scans
    from etendue.scatter.scans.scans import Scans
    from etendue.scatter.table import BsdfTable
    from etendue.scene import Scene

__all__ = [
    "ArgumentError",
    "Box",
    "Bsdf",
    "BsdfTable",
    "ChangedFileWarning",
    "Cone",
    "Cylinder",
    "Deconvolution",
    "DirectionalDeconvolution",
    "DirectionalScan",
    "Disk",
    "Dome",
    "EtendueError",
    "FormatError",
    "FromField",
    "GoniometerScan",
    "GriddedSource",
    "Hemisphere",
    "IlluminanceMap",
    "Intensity",
    "LightField",
    "LuminanceMap",
    "MemoryLimitError",
    "MissingLibraryError",
    "Observer",
    "OutputError",
    "PathTracing",
    "Plane",
    "RayFileWarning",
    "RayIndex",
    "RaySet",
    "Region",
    "RingSource",
    "Scans",
    "ScatterEvents",
    "ScatterGoniometer",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Screen",
    "Spectrum",
    "Sphere",
    "TraceResult",
    "TraceWarning",
    "TraceWork",
    "UnitError",
    "UnknownNameError",
    "UnsupportedFormatError",
    "WaitingWarning",
    "bsdf",
    "bsdf_table",
    "cache_content",
    "clear_cache",
    "combine_maps",
    "compare",
    "cross_section",
    "deconvolve",
    "deconvolve_directions",
    "denoise_map",
    "diagnose",
    "draw_scene",
    "filter_map",
    "intensity_distribution",
    "luminance_map",
    "parse_surface",
    "plot_bsdf",
    "plot_characteristic",
    "plot_comparison",
    "plot_cross_sections",
    "plot_deconvolution",
    "plot_directions",
    "plot_intensity",
    "plot_map",
    "plot_threshold_sweep",
    "read_bsdf",
    "read_directional_scan",
    "read_goniometer_scan",
    "read_illuminance_map",
    "read_intensity",
    "read_map",
    "read_rays",
    "read_scans",
    "scene",
    "threshold_sweep",
    "trace",
    "trace_rounds",
    "trace_work",
    "write_bsdf",
    "write_intensity",
    "write_rays",
]


def _page(value: object) -> str:
    # Pages are made where all kinds of values are known, which nobody needs before a notebook shows one.
    page: str = importlib.import_module("etendue.plot.notebook").notebook_page(value)
    return page


# Maps are quantities, which cannot import the files and pictures above them.
PixelMap.outlets = MapOutlets(save=save_map, plot=plot_map)
InNotebook.pages = Pages(of=_page)


# Scenes and models are checked by pydantic, which takes as long to import as all the rest: only when somebody asks for one.
LAZY = {
    "Bsdf": "etendue.scatter.table:Bsdf",
    "BsdfTable": "etendue.scatter.table:BsdfTable",
    "Deconvolution": "etendue.instruments.deconvolution:Deconvolution",
    "DirectionalDeconvolution": "etendue.instruments.directional_deconvolution:DirectionalDeconvolution",
    "DirectionalScan": "etendue.instruments.directional_scan:DirectionalScan",
    "GoniometerScan": "etendue.instruments.goniometer_scan:GoniometerScan",
    "Scans": "etendue.scatter.scans.scans:Scans",
    "ScatterGoniometer": "etendue.instruments.scatter_goniometer:ScatterGoniometer",
    "Scene": "etendue.scene:Scene",
    "bsdf": "etendue.scatter.models",
    "bsdf_table": "etendue.instruments.lobe_table:bsdf_table",
    "deconvolve": "etendue.instruments.deconvolution:deconvolve",
    "deconvolve_directions": "etendue.instruments.directional_deconvolution:deconvolve_directions",
    "read_bsdf": "etendue.scatter.files:read_bsdf",
    "read_directional_scan": "etendue.instruments.directional_scan:read_directional_scan",
    "read_goniometer_scan": "etendue.instruments.goniometer_scan:read_goniometer_scan",
    "read_scans": "etendue.scatter.scans.files:read_scans",
    "scene": "etendue.scene",
    "write_bsdf": "etendue.scatter.files:write_bsdf",
}


def __getattr__(name: str) -> Any:
    if name in LAZY:
        module, _, attribute = LAZY[name].partition(":")
        found = importlib.import_module(module)
        return getattr(found, attribute) if attribute else found
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("etendue")
    raise AttributeError(f"module 'etendue' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
