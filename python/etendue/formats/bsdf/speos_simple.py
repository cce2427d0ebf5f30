"""Ansys Speos ``.simplescattering``: one share each of absorbed, specular, Lambertian and Gaussian light."""

from __future__ import annotations

from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etendue.errors import ArgumentError, UnsupportedFormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, ShareTables
from etendue.formats.bsdf.speos_shares import (
    gaussian,
    head,
    mixed,
    per_cent,
    require_end,
    share,
    width,
    words_after_lines,
)
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice

START = b"OPTIS - Simple scattering surface file"
MODES = ("Reflection", "Transmission", "Both")

INCIDENCES = (0.0, 20.0, 40.0, 55.0, 70.0, 80.0, 85.0)
"""Angles [°] at which the lobe, the same at all, is tabled."""


def recognise(head: bytes) -> bool:
    """By the first line."""
    return head.removeprefix(BOM_UTF8).startswith(START)


def read(path: Path) -> BsdfData:
    """Read shares of what is not absorbed; what is neither Lambertian nor Gaussian is specular."""
    tokens, text = words_after_lines(path, 2)
    mode = tokens.choice("mode", MODES)
    absorbed = share(tokens, "absorption")
    sides: dict[int, tuple[float, float, float, float]] = {}
    if mode == "Both":
        lambertian = [share(tokens, "Lambertian share") for _ in range(2)]
        lobes = [share(tokens, "Gaussian share") for _ in range(2)]
        widths = [width(tokens, "full width at half maximum") for _ in range(2)]
        if tokens.number("whether reflection follows Fresnel") != 0.0:
            advice = "State the reflected share in its place, or describe the surface as rough-interface."
            raise UnsupportedFormatError(path, "last line", "reflection and transmission that follow Fresnel", advice)
        reflected = share(tokens, "reflected share")
        for way, part in enumerate((reflected, 1.0 - reflected)):
            sides[way] = (part, lambertian[way], lobes[way], widths[way])
    else:
        values = [share(tokens, "Lambertian share"), share(tokens, "Gaussian share")]
        sides[MODES.index(mode)] = (1.0, values[0], values[1], width(tokens, "full width at half maximum"))
    require_end(path, tokens)
    shares: dict[str, float] = {}
    slices: list[BsdfSlice] = []
    for way, (part, lambertian_share, lobe, fwhm) in sides.items():
        specular = 1.0 - lambertian_share - lobe
        if specular < -1e-9:
            tokens.refuse("Lambertian and Gaussian shares add up to more than 100 %")
        kept = part * (1.0 - absorbed)
        name = ("reflectance", "transmittance")[way]
        shares[f"specular_{name}"] = kept * max(specular, 0.0)
        shares[f"diffuse_{name}"] = kept * lambertian_share
        if kept * lobe > 0.0:
            slices += [
                gaussian(theta, kept * lobe, (fwhm, fwhm), transmitted=bool(way), wavelength=None)
                for theta in INCIDENCES
            ]
    one = np.zeros(1)
    components = mixed(one, one, {name: np.full((1, 1), value) for name, value in shares.items()})
    stated = text[1].strip() if len(text) > 1 and text[1].strip() else path.stem
    return BsdfData(tuple(slices), tuple(components) or _absorber(slices), name=stated)


def _absorber(slices: list[BsdfSlice]) -> tuple[dict[str, str], ...]:
    return () if slices else ({"kind": "absorber"},)


def write_shares(shares: ShareTables, stream: BinaryIO) -> None:
    """Write shares that are the same at all angles and wavelengths."""
    if shares.lobe is not None:
        raise ArgumentError("lobes of a Speos simple scattering surface are not written: write it as .scattering")
    parts = np.array([shares.specular, shares.diffuse]).reshape(2, 2, -1)
    if np.ptp(parts, axis=2).any():
        raise ArgumentError(
            "a Speos simple scattering surface has the same shares at all angles: write it as .scattering"
        )
    specular, diffuse = parts[..., 0]
    ways = specular + diffuse
    total = float(ways.sum())
    lambertian = [part / way if way > 0.0 else 0.0 for part, way in zip(diffuse, ways, strict=True)]
    lines = head(START, "v2.0", shares.name)
    if ways.all():
        values = per_cent([1.0 - total, *lambertian, 0.0, 0.0])
        lines += [MODES[2], values, "0 0", "0", per_cent(ways[0] / total)]
    else:
        way = int(ways[1] > 0.0)
        lines += [MODES[way], per_cent([1.0 - total, lambertian[way], 0.0]) + "\t0"]
    stream.write(("\n".join(lines) + "\n").encode())


FORMAT = BsdfFormat(
    "speos-simple",
    "Speos simple scattering surface",
    (".simplescattering",),
    recognise,
    read,
    write_shares=write_shares,
)
