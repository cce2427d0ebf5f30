"""What a luminaire looks like before it exists: luminance maps from ray files, with an error bar in every pixel.

>>> import etendue as et
>>> source = et.RingSource(rays=200_000)
>>> round(source.total_flux)
600
"""

from etendue.luminance.combination import combine_maps
from etendue.luminance.comparison import Region, compare, cross_section
from etendue.luminance.estimate import luminance_map
from etendue.luminance.filters import filter_map
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_set import RaySet
from etendue.quantities.spectrum import Spectrum
from etendue.sources.ring_source import RingSource

__all__ = [
    "LuminanceMap",
    "Observer",
    "RaySet",
    "Region",
    "RingSource",
    "Screen",
    "Spectrum",
    "combine_maps",
    "compare",
    "cross_section",
    "filter_map",
    "luminance_map",
]
