"""Media that scenes may name without describing them, each with its source.

Indices are those relative to air, as catalogues give them, so that air has index 1.
"""

from __future__ import annotations

import dataclasses

from etendue.scene.media import Medium, Sellmeier


@dataclasses.dataclass(frozen=True)
class LibraryMedium:
    """A medium, where its numbers come from, and the wavelengths [nm] for which they hold.

    Examples
    --------
    >>> MEDIA["BK7"].range
    (300.0, 2500.0)
    """

    medium: Medium
    source: str
    range: tuple[float, float] = (0.0, float("inf"))


AIR_INDEX = 1.000272
"""n of air at 589 nm, 20 °C, 101 325 Pa against vacuum [Ciddor1996]_: from indices against vacuum to those against air."""


def _against_air(b: tuple[float, ...], c: tuple[float, ...]) -> Sellmeier:
    """n²/n_air² in Sellmeier's form: every b over n_air², and a constant, which is a term with c = 0."""
    squared = AIR_INDEX**2
    return Sellmeier(b=(1.0 / squared - 1.0, *(value / squared for value in b)), c=(0.0, *c))


MEDIA: dict[str, LibraryMedium] = {
    "vacuum": LibraryMedium(
        Medium(index=1.0), "by definition; indices count from air, from which vacuum differs by 3e-4"
    ),
    "air": LibraryMedium(Medium(index=1.0), "by definition: catalogues state indices relative to air"),
    "BK7": LibraryMedium(
        Medium(
            sellmeier=Sellmeier(b=(1.03961212, 0.231792344, 1.01046945), c=(0.00600069867, 0.0200179144, 103.560653))
        ),
        "N-BK7, [Schott2014]_",
        (300.0, 2500.0),
    ),
    "fused-silica": LibraryMedium(
        Medium(sellmeier=Sellmeier(b=(0.6961663, 0.4079426, 0.8974794), c=(0.0684043**2, 0.1162414**2, 9.896161**2))),
        "[Malitson1965]_, 20 °C",
        (210.0, 3710.0),
    ),
    "PMMA": LibraryMedium(
        Medium(sellmeier=Sellmeier(b=(1.1819,), c=(0.011313,))),
        "fit to the measurements of [Sultanova2009]_, 20 °C",
        (436.8, 1052.0),
    ),
    "PC": LibraryMedium(
        Medium(sellmeier=Sellmeier(b=(1.4182,), c=(0.021304,))),
        "polycarbonate: fit to the measurements of [Sultanova2009]_, 20 °C",
        (436.8, 1052.0),
    ),
    "silicone": LibraryMedium(
        Medium(index=1.42),
        "optical liquid silicone rubber, a manufacturer's typical figure without dispersion [Protolabs2017]_",
    ),
    "water": LibraryMedium(
        Medium(
            sellmeier=_against_air(
                (5.684027565e-1, 1.726177391e-1, 2.086189578e-2, 1.130748688e-1),
                (5.101829712e-3, 1.821153936e-2, 2.620722293e-2, 1.069792721e1),
            )
        ),
        "[DaimonMasumura2007]_, 20 °C, turned from vacuum to air",
        (182.0, 1129.0),
    ),
}
"""Every built-in medium by its name."""
