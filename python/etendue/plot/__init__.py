"""Pictures of maps, comparisons, intensities and scenes; matplotlib is imported when the first one is drawn."""

from __future__ import annotations

from etendue.plot.animation import plot_animation
from etendue.plot.bsdf_picture import plot_bsdf
from etendue.plot.characteristic_picture import plot_characteristic
from etendue.plot.comparison_picture import plot_comparison
from etendue.plot.cross_section_picture import plot_cross_sections
from etendue.plot.deconvolution_picture import plot_deconvolution
from etendue.plot.directional_picture import plot_directions
from etendue.plot.intensity_picture import plot_intensity
from etendue.plot.map_picture import plot_map
from etendue.plot.near_field_picture import plot_near_field
from etendue.plot.report_page import plot_report
from etendue.plot.scene_picture import draw_scene
from etendue.plot.sweep_picture import plot_sweep
from etendue.plot.threshold_picture import plot_threshold_sweep

__all__ = [
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
]
