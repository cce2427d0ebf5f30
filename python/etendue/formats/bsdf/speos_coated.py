"""Ansys Speos ``.coated``: specular reflection and transmission by angle and wavelength."""

from __future__ import annotations

from codecs import BOM_UTF8
from pathlib import Path
from typing import BinaryIO

import numpy as np

from etendue.errors import ArgumentError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, ShareTables
from etendue.formats.bsdf.speos_shares import (
    head,
    mixed,
    next_angle,
    per_cent,
    require_end,
    share,
    sizes,
    whole_range,
    words_after_lines,
)
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.report import Complaint

START = b"OPTIS - Coated surface file"


def recognise(head: bytes) -> bool:
    """By the first line."""
    return head.removeprefix(BOM_UTF8).startswith(START)


def read(path: Path) -> BsdfData:
    """Read the mean of both polarisations, which stand on two lines for each angle."""
    tokens, text = words_after_lines(path, 2)
    angles, wavelength = sizes(tokens, 4)
    waves = wavelength.size
    angle = np.zeros(angles)
    shares = np.zeros((2, angles, waves))
    for i in range(angles):
        angle[i] = next_angle(tokens, angle[i - 1] if i else -1e-300)
        both = np.array([share(tokens, "share") for _ in range(2 * 2 * waves)]).reshape(2, waves, 2)
        if (total := float(both.sum(axis=2).max())) > 1.0 + 1e-9:
            tokens.refuse(f"shares at {angle[i]:g}° add up to {100.0 * total:.6g} %")
        shares[:, i] = both.mean(axis=0).T
    require_end(path, tokens)
    names = {"specular_reflectance": shares[0], "specular_transmittance": shares[1]}
    complaints = []
    if shares[1].any():
        said = "transmitted light goes straight on: refraction between media is not part of the surface"
        complaints.append(Complaint("note", "transmission", said))
    name = text[1].strip() if len(text) > 1 and text[1].strip() else path.stem
    components = mixed(angle, wavelength, names) or [{"kind": "absorber"}]
    return BsdfData((), tuple(components), name=name, complaints=tuple(complaints))


def write_shares(shares: ShareTables, stream: BinaryIO) -> None:
    """Write mirrored and transmitted light, the same for both polarisations."""
    if shares.diffuse.any() or shares.lobe is not None:
        raise ArgumentError("a Speos coated surface holds no scattered light: write it as .scattering")
    whole = whole_range(shares)
    lines = [*head(START, "v1.0", shares.name), f"{whole.angle.size} {whole.wavelength.size}"]
    lines.append("\t" + "\t\t".join(f"{nm:.12g}" for nm in whole.wavelength))
    for i, angle in enumerate(whole.angle):
        both = per_cent(whole.specular[:, i].T)
        lines += [f"{angle:.12g}\t{both}", f"\t{both}"]
    stream.write(("\n".join(lines) + "\n").encode())


FORMAT = BsdfFormat("speos-coated", "Speos coated surface", (".coated",), recognise, read, write_shares=write_shares)
