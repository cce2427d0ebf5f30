"""Ansys Speos ``.scattering``: specular, Lambertian and Gaussian shares by angle and wavelength."""

from __future__ import annotations

from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etendue.formats.bsdf.bsdf_format import BsdfFormat, ShareTables
from etendue.formats.bsdf.speos_shares import (
    gaussian,
    head,
    mixed,
    next_angle,
    per_cent,
    require_end,
    share,
    sizes,
    whole_range,
    width,
    words_after_lines,
)
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_slice import BsdfSlice

START = b"OPTIS - Scattering surface file"

PARTS = ("specular", "diffuse")
WAYS = ("reflectance", "transmittance")


def recognise(head: bytes) -> bool:
    """By the first line."""
    return head.removeprefix(BOM_UTF8).startswith(START)


def read(path: Path) -> BsdfData:
    """Read all angles and wavelengths; Gaussian lobes are those of intensity, about the mirrored or straight direction."""
    tokens, text = words_after_lines(path, 2)
    angles, wavelength = sizes(tokens, 10)
    waves = wavelength.size
    angle = np.zeros(angles)
    shares = np.zeros((3, 2, angles, waves))
    widths = np.zeros((2, 2, angles, waves))
    for i in range(angles):
        angle[i] = next_angle(tokens, angle[i - 1] if i else -1e-300)
        for part in range(5):
            for j in range(waves):
                for way in range(2):
                    if part < 3:
                        shares[part, way, i, j] = share(tokens, "share")
                    else:
                        widths[part - 3, way, i, j] = width(tokens, "full width at half maximum")
        if (total := float(shares[:, :, i].sum(axis=(0, 1)).max())) > 1.0 + 1e-9:
            tokens.refuse(f"shares at {angle[i]:g}° add up to {100.0 * total:.6g} %")
    require_end(path, tokens)
    names = {f"{part}_{way}": shares[p, w] for p, part in enumerate(PARTS) for w, way in enumerate(WAYS)}
    slices: list[BsdfSlice] = []
    for way in (0, 1):
        if shares[2, way].any():
            even = not np.ptp(shares[2, way], axis=1).any() and not np.ptp(widths[:, way], axis=2).any()
            slices += [
                gaussian(
                    float(angle[i]),
                    float(shares[2, way, i, j]),
                    (float(widths[0, way, i, j]), float(widths[1, way, i, j])),
                    transmitted=bool(way),
                    wavelength=None if even else float(wavelength[j]),
                )
                for i in range(angles)
                for j in range(1 if even else waves)
                if angle[i] < 90.0 or angles == 1
            ]
    name = text[1].strip() if len(text) > 1 and text[1].strip() else path.stem
    return BsdfData(tuple(slices), tuple(mixed(angle, wavelength, names)), name=name)


def write_shares(shares: ShareTables, stream: BinaryIO) -> None:
    """Write specular and Lambertian light, and Gaussian lobes."""
    whole = whole_range(shares)
    lines = [*head(START, "v1.0", shares.name), f"{whole.angle.size} {whole.wavelength.size}"]
    lines.append("\t" + "\t\t".join(f"{nm:.12g}" for nm in whole.wavelength))
    none = np.zeros_like(whole.specular)
    lobe, widths = (none if whole.lobe is None else whole.lobe), ((none, none) if whole.width is None else whole.width)
    for i, angle in enumerate(whole.angle):
        parts = (whole.specular[:, i], whole.diffuse[:, i], lobe[:, i])
        lines += [(f"{angle:.12g}" if k == 0 else "") + "\t" + per_cent(part.T) for k, part in enumerate(parts)]
        lines += ["\t" + "\t".join(f"{value:.12g}" for value in each[:, i].T.ravel()) for each in widths]
    stream.write(("\n".join(lines) + "\n").encode())


FORMAT = BsdfFormat(
    "speos-scattering", "Speos scattering surface", (".scattering",), recognise, read, write_shares=write_shares
)
