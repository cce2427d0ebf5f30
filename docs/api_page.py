"""Write docs/api.md, the page of everything that `import etendue` gives, from the docstrings.

usage: python docs/api_page.py
"""

from __future__ import annotations

import inspect
from pathlib import Path

import etendue as et

PAGE = Path(__file__).with_name("api.md")

GROUPS = {
    "Rays": ("read_rays", "write_rays", "RaySet", "RayIndex", "RingSource"),
    "Light fields": (
        "LightField", "Plane", "Disk", "Hemisphere", "Sphere", "Cylinder", "Dome", "Box", "parse_surface", "diagnose",
        "cache_content", "clear_cache", "GriddedSource", "threshold_sweep",
    ),
    "Luminance": (
        "luminance_map", "Cone", "FromField", "PathTracing", "Observer", "Screen", "LuminanceMap", "read_map",
        "combine_maps", "compare", "Region", "PolygonRegion", "region_statistics", "RegionStatistics", "cross_section",
        "filter_map", "denoise_map", "report_source", "SourceReport",
    ),
    "Scenes": (
        "scene", "Scene", "trace", "trace_rounds", "trace_work", "TraceWork", "TraceResult", "ScatterEvents",
        "IlluminanceMap", "read_illuminance_map", "sweep", "sweep_steps", "SweepTable",
    ),
    "Scatter": (
        "bsdf", "Bsdf", "BsdfTable", "Scans", "read_bsdf", "read_scans", "write_bsdf", "fit_bsdf", "BsdfFit",
    ),
    "Instruments": (
        "ScatterGoniometer", "GoniometerScan", "read_goniometer_scan", "Detector", "Baffle", "deconvolve", "Deconvolution",
        "revolved", "agreement", "Agreement", "NearFieldGoniophotometer", "NearFieldRun", "DirectionalScan",
        "read_directional_scan", "deconvolve_directions", "DirectionalDeconvolution", "bsdf_table",
    ),
    "Intensity and spectra": (
        "intensity_distribution", "Intensity", "read_intensity", "write_intensity",
        "data_sheet", "DataSheet", "beam_angle", "BeamAngle", "cut_off_angle", "zonal_flux", "Spectrum",
    ),
    "Pictures": (
        "plot_map", "plot_comparison", "plot_cross_sections", "plot_intensity", "plot_characteristic",
        "plot_sweep", "plot_threshold_sweep", "plot_bsdf", "plot_deconvolution", "plot_directions", "plot_near_field",
        "plot_animation", "plot_report", "draw_scene", "view",
    ),
    "Errors and warnings": tuple(name for name in et.__all__ if name.endswith(("Error", "Warning"))),
}  # fmt: skip
"""Every public name stands in one group."""

HEAD = """# Everything that `import etendue as et` gives

Written by `docs/api_page.py` from the docstrings. `help(et.luminance_map)` tells the rest: shapes, units, errors and an
example.
"""


def page() -> str:
    """The page as text."""
    lines = [HEAD]
    for group, names in GROUPS.items():
        lines += [f"## {group}", "", "| name | what it is |", "|---|---|"]
        for name in names:
            text = inspect.getdoc(getattr(et, name)) or ""
            first = " ".join(text.split("\n\n")[0].split())
            lines.append(f"| `et.{name}` | {first.replace('|', chr(92) + '|')} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
