"""The luminaire of section 5.6 of the thesis: an LED in the focus of a parabola, under a diffuser."""

from __future__ import annotations

import math

import etendue as et

FLUX, REFLECTANCE = 30.0, 0.8
DISTANCE = 2000.0
"""Of the observer, on the axis [mm]."""

SIDE, FOCUS, RADIUS = 0.722, 2.28, 8.48
"""Of the LED, of the parabola and of its opening [mm]. Not stated: the maximum and the mean of L_H, and by how much the mean
is below that of L_W, are those of the thesis with them, and three numbers determine three sizes."""

HEIGHT = RADIUS**2 / (4.0 * FOCUS)
"""Of the opening over the vertex [mm]."""

WIDTH = 20.0
"""Of the screen, 100 × 100 pixels of 0.2 mm."""

EYE = et.Observer(theta=0, phi=0, distance=DISTANCE, target=(0, 0, HEIGHT))

TRANSMITTANCE = 0.92
"""Of the stand-ins for the holographic diffusers."""


def holographic(fwhm: float) -> et.Bsdf:
    """A Gaussian lobe, its full width at half maximum in degrees."""
    sigma = math.sin(math.radians(fwhm / 2)) / math.sqrt(2 * math.log(2))
    return et.bsdf.Gaussian(peak=TRANSMITTANCE / (2 * math.pi * sigma**2), sigma=sigma, way="transmitted")


def luminaire(diffuser: et.Bsdf) -> et.Scene:
    """The vertex stands in the origin, light leaves along +z; the diffuser is thin, its front towards the LED."""
    return et.Scene(
        name="luminaire of section 5.6",
        sources=[
            {
                "name": "LED",
                "kind": "surface",
                "shape": {"kind": "rectangle", "width": SIDE, "height": SIDE},
                "flux": FLUX,
                "at": [0, 0, FOCUS],
            }
        ],
        surfaces=[
            {
                "name": "reflector",
                "shape": {"kind": "paraboloid", "focal_length": FOCUS, "radius": RADIUS},
                "finish": {"kind": "mirror", "reflectance": REFLECTANCE},
            },
            {
                "name": "diffuser",
                "shape": {"kind": "disk", "radius": RADIUS},
                "at": [0, 0, HEIGHT],
                "toward": [0, 0, -1],
                "finish": {"kind": "bsdf", "bsdf": diffuser},
            },
        ],
    )


def look(diffuser: et.Bsdf, pixels: int, lines: int, seed: int = 1) -> et.LuminanceMap:
    """What the observer sees. Lines of sight find the LED by chance, behind a diffuser that spreads them so little."""
    screen = et.Screen(WIDTH, WIDTH, pixels, pixels)
    method = et.PathTracing(rays_per_pixel=lines, forward_rays=0, seed=seed)
    return et.luminance_map(luminaire(diffuser), EYE, screen, method=method)
