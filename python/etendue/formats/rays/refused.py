"""Files that étendue refuses by name: formats without a public layout, and files that are no ray files at all.

Only asked about files that no reader recognised, so a wrong extension on a readable file does no harm.
"""

from __future__ import annotations

import dataclasses
from pathlib import PurePath

from etendue.errors import UnsupportedFormatError
from etendue.formats.head import STEP_SIGNATURE, Head

OTHER_EXPORT = (
    "Its layout is not public. Ask for the same rays as TM-25 (.tm25ray), LightTools (.ray) or Zemax (.dat, .sdf); LED "
    "makers offer them on the same download page."
)
INTENSITY = (
    "An intensity distribution has no start points, so it has no luminance. Ask the maker for ray files (TM-25, "
    "LightTools or Zemax)."
)
INTENSITY_FILE = f"{INTENSITY} `etendue intensity` and, in Python, read_intensity take this file as what it is."
UNPACK = "Unpack it and read the ray file inside."


@dataclasses.dataclass(frozen=True)
class Refusal:
    """A kind of file that is refused.

    Parameters
    ----------
    title : str
        As people call it.
    advice : str
        What to do instead.
    signatures : tuple of bytes
        Any of which the file begins with.
    extensions : tuple of str
        Lower case with the dot.
    names : tuple of str
        Parts of file names, in lower case, by which LED makers tell their packages.
    """

    title: str
    advice: str
    signatures: tuple[bytes, ...] = ()
    extensions: tuple[str, ...] = ()
    names: tuple[str, ...] = ()


REFUSALS = (
    Refusal("a ZIP archive", UNPACK, signatures=(b"PK\x03\x04",), extensions=(".zip",)),
    Refusal("a gzip file", UNPACK, signatures=(b"\x1f\x8b",), extensions=(".gz", ".tgz")),
    Refusal("a 7-Zip archive", UNPACK, signatures=(b"7z\xbc\xaf\x27\x1c",), extensions=(".7z",)),
    Refusal("a RAR archive", UNPACK, signatures=(b"Rar!\x1a\x07",), extensions=(".rar",)),
    Refusal(
        "a Git LFS pointer, not the file itself",
        "Fetch the content with 'git lfs pull'.",
        signatures=(b"version https://git-lfs",),
    ),
    Refusal(
        "a PDF document",
        "LED makers print origin, virtual focus and flux in it; the rays are in the files beside it.",
        signatures=(b"%PDF",),
        extensions=(".pdf",),
    ),
    Refusal(
        "a web page",
        "The download went wrong, perhaps for want of a login; open the link in a browser.",
        signatures=(b"<!DOCTYPE html", b"<!doctype html", b"<html"),
    ),
    Refusal(
        "STEP or IGES geometry",
        "It shows where the rays start; the rays are in another file.",
        signatures=(STEP_SIGNATURE,),
        extensions=(".step", ".stp", ".igs", ".iges"),
    ),
    Refusal("an IES LM-63 intensity file", INTENSITY_FILE, signatures=(b"IESNA", b"IES:LM-63"), extensions=(".ies",)),
    Refusal("an EULUMDAT intensity file", INTENSITY_FILE, extensions=(".ldt",)),
    Refusal(
        "a Speos result map",
        "It holds no rays. Export the rays from Speos (.ray) or as TM-25.",
        signatures=(b"OPTIS - Extended Map file", b"YYZOPTIS - newXMP file"),
        extensions=(".xmp",),
    ),
    Refusal(
        "a spectrum",
        "It belongs to a ray file, which is another file.",
        signatures=(b"OPTIS - Spectrum file",),
        extensions=(".spectrum", ".spcd", ".sre"),
    ),
    Refusal(
        "scatter data of a surface (BSDF)",
        "etendue bsdf info says what it holds; in a scene it is the file of a finish.",
        signatures=(
            b"OPTIS - Anisotropic BSDF",
            b"OPTIS - brdf surface",
            b"OPTIS - Coated surface",
            b"OPTIS - Scattering surface",
            b"OPTIS - Simple scattering surface",
            b"TracePro Surface Property",
            b"type bsdf_data",
        ),
        extensions=(
            ".anisotropicbsdf",
            ".astm",
            ".brdf",
            ".bsdf",
            ".coated",
            ".scattering",
            ".simplescattering",
            ".ssdd",
        ),
    ),
    Refusal(
        "a Zemax ray database (ZRD)",
        "It records whole paths and changes from version to version. Export a source file from OpticStudio: binary .sdf, "
        "or TM-25.",
        signatures=(b"\xd2\x07\x00\x00", b"\xd3\x07\x00\x00"),
        extensions=(".zrd",),
    ),
    Refusal("a Zemax critical ray set", OTHER_EXPORT, extensions=(".crs",)),
    Refusal("a TechnoTeam ray measurement (TTR)", OTHER_EXPORT, extensions=(".ttr",)),
    Refusal("a TechnoTeam intensity measurement (TTL)", INTENSITY, extensions=(".ttl",)),
    Refusal("a Radiant Source Model", OTHER_EXPORT, extensions=(".rsm", ".rs7", ".rs8", ".rsmx")),
    Refusal("a FRED compact ray set", OTHER_EXPORT, extensions=(".fcr",)),
    Refusal("a LucidShape ray file", OTHER_EXPORT, names=("lucidshape",)),
    Refusal("a SimuLux ray file", OTHER_EXPORT, names=("simulux",)),
    Refusal("a ray file packaged for TracePro and Photopia", OTHER_EXPORT, names=("photopia",)),
    Refusal("a Lumicept ray set", OTHER_EXPORT, signatures=(b"Rayset", b"RAYSET")),
)
"""Every kind of file that is refused. Signatures are tried first, since content tells more than a name."""


def refuse(head: Head) -> None:
    """Raise if a file is of a kind that is refused by name; else do nothing.

    Parameters
    ----------
    head : Head
        Of a file that no format recognised.

    Raises
    ------
    UnsupportedFormatError
        With the name of the kind and what to ask for instead.
    """
    name = PurePath(head.path).name.lower()
    extension = PurePath(name).suffix
    by_content = (kind for kind in REFUSALS if head.data.startswith(kind.signatures))
    by_name = (kind for kind in REFUSALS if extension in kind.extensions or any(part in name for part in kind.names))
    for kind, place in ((next(by_content, None), "byte 0"), (next(by_name, None), "file name")):
        if kind is not None:
            raise UnsupportedFormatError(head.path, place, f"this is {kind.title}", kind.advice)
