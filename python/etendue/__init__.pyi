"""What `import etendue` gives, for type checkers and editors; `__init__.py` imports each name when it is asked for."""

from etendue import scene
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
from etendue.formats.maps import read_illuminance_map, read_map
from etendue.formats.rays import read_rays, write_rays
from etendue.formats.rays.ray_index import RayIndex
from etendue.goniophotometry.far_field import intensity_distribution
from etendue.goniophotometry.threshold_sweep import threshold_sweep
from etendue.instruments.agreement import Agreement, agreement
from etendue.instruments.deconvolution import Deconvolution, deconvolve
from etendue.instruments.detectors import Baffle, Detector
from etendue.instruments.directional_deconvolution import DirectionalDeconvolution, deconvolve_directions
from etendue.instruments.directional_scan import DirectionalScan, read_directional_scan
from etendue.instruments.goniometer_scan import GoniometerScan, read_goniometer_scan
from etendue.instruments.lobe_table import bsdf_table
from etendue.instruments.near_field.goniophotometer import NearFieldGoniophotometer
from etendue.instruments.near_field.run import NearFieldRun
from etendue.instruments.revolved import revolved
from etendue.instruments.scatter_goniometer import ScatterGoniometer
from etendue.lightfield.carrier import Box, Cylinder, Disk, Dome, Hemisphere, Plane, Sphere, parse_surface
from etendue.lightfield.diagnostics import diagnose
from etendue.lightfield.fit_cache import cache_content, clear_cache
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.light_field import LightField
from etendue.luminance.combination import combine_maps
from etendue.luminance.comparison import compare, cross_section
from etendue.luminance.denoising import denoise_map
from etendue.luminance.estimate import luminance_map
from etendue.luminance.filters import filter_map
from etendue.luminance.methods import Cone, FromField, PathTracing
from etendue.luminance.region_statistics import RegionStatistics, region_statistics
from etendue.luminance.regions import PolygonRegion, Region
from etendue.luminance.source_report import SourceReport, report_source
from etendue.plot import (
    draw_scene,
    plot_animation,
    plot_bsdf,
    plot_characteristic,
    plot_comparison,
    plot_cross_sections,
    plot_deconvolution,
    plot_directions,
    plot_intensity,
    plot_map,
    plot_near_field,
    plot_report,
    plot_sweep,
    plot_threshold_sweep,
)
from etendue.quantities.beam_angle import BeamAngle, beam_angle, cut_off_angle
from etendue.quantities.data_sheet import DataSheet, data_sheet
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import ChangedFileWarning, RayFileWarning
from etendue.quantities.spectrum import Spectrum
from etendue.quantities.zonal_flux import zonal_flux
from etendue.scatter import models as bsdf
from etendue.scatter.files import read_bsdf, write_bsdf
from etendue.scatter.model_fit import BsdfFit, fit_bsdf
from etendue.scatter.scans.files import read_scans
from etendue.scatter.scans.scans import Scans
from etendue.scatter.table import Bsdf, BsdfTable
from etendue.scene import Scene
from etendue.scene.scatter_events import ScatterEvents
from etendue.sources.ring_source import RingSource
from etendue.sweeps.running import sweep, sweep_steps
from etendue.sweeps.table import SweepTable
from etendue.tracing import TraceResult, TraceWork, trace, trace_rounds, trace_work
from etendue.tracing.ledger import TraceWarning
from etendue.viewer.notebook import view

__all__ = [
    "Agreement",
    "ArgumentError",
    "Baffle",
    "BeamAngle",
    "Box",
    "Bsdf",
    "BsdfFit",
    "BsdfTable",
    "ChangedFileWarning",
    "Cone",
    "Cylinder",
    "DataSheet",
    "Deconvolution",
    "Detector",
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
    "NearFieldGoniophotometer",
    "NearFieldRun",
    "Observer",
    "OutputError",
    "PathTracing",
    "Plane",
    "PolygonRegion",
    "RayFileWarning",
    "RayIndex",
    "RaySet",
    "Region",
    "RegionStatistics",
    "RingSource",
    "Scans",
    "ScatterEvents",
    "ScatterGoniometer",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Screen",
    "SourceReport",
    "Spectrum",
    "Sphere",
    "SweepTable",
    "TraceResult",
    "TraceWarning",
    "TraceWork",
    "UnitError",
    "UnknownNameError",
    "UnsupportedFormatError",
    "WaitingWarning",
    "agreement",
    "beam_angle",
    "bsdf",
    "bsdf_table",
    "cache_content",
    "clear_cache",
    "combine_maps",
    "compare",
    "cross_section",
    "cut_off_angle",
    "data_sheet",
    "deconvolve",
    "deconvolve_directions",
    "denoise_map",
    "diagnose",
    "draw_scene",
    "filter_map",
    "fit_bsdf",
    "intensity_distribution",
    "luminance_map",
    "parse_surface",
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
    "read_bsdf",
    "read_directional_scan",
    "read_goniometer_scan",
    "read_illuminance_map",
    "read_intensity",
    "read_map",
    "read_rays",
    "read_scans",
    "region_statistics",
    "report_source",
    "revolved",
    "scene",
    "sweep",
    "sweep_steps",
    "threshold_sweep",
    "trace",
    "trace_rounds",
    "trace_work",
    "view",
    "write_bsdf",
    "write_intensity",
    "write_rays",
    "zonal_flux",
]

__version__: str
