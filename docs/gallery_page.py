"""Make docs/gallery.md from the docstrings of the examples.

usage: python docs/gallery_page.py [NAME …]      NAME: an example whose thumbnail is made again, by running it
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "gallery.md"
FIGURES = ROOT / "docs" / "figures"
WIDTH = 720
"""Of thumbnails [pixels]."""

SHOWN = {
    "first_picture": "first-picture.png",
    "error_bars": "gallery-error-bars.png",
    "many_observers": "gallery-many-observers.png",
    "half_against_half": "half-against-half.png",
    "white_led": "gallery-white-led.png",
    "dome_led": "dome-led.png",
    "remote_phosphor": "remote-phosphor.png",
    "narrow_beam": "narrow-beam.png",
    "collimator": "gallery-collimator.png",
    "reflector_spot": "gallery-reflector-spot.png",
    "sweep": "gallery-sweep.png",
    "integrating_sphere": "gallery-integrating-sphere.png",
    "opal_diffuser": "gallery-opal-diffuser.png",
    "light_guide": "gallery-light-guide.png",
    "prism": "gallery-prism.png",
    "ray_file_audit": "gallery-ray-file-audit.png",
    "ies_round_trip": "gallery-ies-round-trip.png",
    "radiance_mitsuba": "gallery-radiance-mitsuba.png",
    "how_many_rays": "how-many-rays.png",
    "chapter_4": "chapter-4-images.png",
    "deconvolution_2d": "deconvolution-2d-cuts.png",
    "near_field": "near-field-round-trip.png",
}
"""Examples in the order of the page, each with a picture that it makes."""

HEAD = """# Gallery

Each picture is made by a script of `examples/`, which says so if what it computes is not what it must be. Run one with
`python examples/NAME.py`, in a folder for its pictures.
"""


def page() -> str:
    """The text of the page."""
    parts = [HEAD]
    for name, picture in SHOWN.items():
        text = ast.get_docstring(ast.parse((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8"))) or ""
        paragraphs = text.split("\n\n")
        title, colon, rest = " ".join(paragraphs[0].split()).rstrip(".").partition(": ")
        title = title if colon and len(title) < 60 else title.partition(",")[0]
        said = in_markdown([f"{rest[:1].upper()}{rest[1:]}." if rest else "", *paragraphs[1:]])
        parts.append(f"## {title}\n\n![{title}](figures/{picture})\n\n{said} [{name}.py](../examples/{name}.py)\n")
    return "\n".join(parts)


def in_markdown(paragraphs: list[str]) -> str:
    """Paragraphs of a docstring run on as one, but for lists, whose items stay lines; usage and blocks are left out."""
    said = ""
    for one in paragraphs:
        if one.startswith((" ", "usage", "``")):
            continue
        items = re.split(r"^- ", one, flags=re.MULTILINE)
        words = [" ".join(item.split()) for item in items]
        said = f"{said} {words[0]}".strip() if words[0] else said
        if words[1:]:
            said = "\n".join([f"{said}\n", *(f"- {item}" for item in words[1:]), "\n"])
    return re.sub(r"\n\n +", "\n\n", said).strip()


def make_thumbnail(name: str) -> None:
    """Run an example, and keep a small copy of its picture."""
    with tempfile.TemporaryDirectory() as folder:
        script = str(ROOT / "examples" / f"{name}.py")
        subprocess.run([sys.executable, script], cwd=folder, check=True)  # noqa: S603 - our own script
        (picture,) = Path(folder).rglob("*.png")
        image = Image.open(picture).convert("RGB")
        size = (WIDTH, round(image.height * WIDTH / image.width))
        image.resize(size, Image.Resampling.LANCZOS).quantize(256, kmeans=3).save(FIGURES / SHOWN[name], optimize=True)


if __name__ == "__main__":
    for asked in sys.argv[1:]:
        make_thumbnail(asked)
    PAGE.write_text(page(), encoding="utf-8")
