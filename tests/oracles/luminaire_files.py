"""Files of luminaires that étendue reads and does not write: TM-33 and GLDF, put together from their schemas."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from etendue.formats.intensity import INTENSITY_FORMATS, write_intensity
from etendue.quantities.intensity import Intensity

SYMM = {
    "none": "Symm_None",
    "rotational": "Symm_Full",
    "both": "Symm_Quad",
    "C0-C180": "Symm_Bi_0",
    "C90-C270": "Symm_Bi_90",
}


def grid(*, h: Iterable[float], v: Iterable[float], values: np.ndarray, tag: str = "IntData", names: str = "hv") -> str:
    a, b = names if len(names) == 2 else names.split()
    return "\n".join(
        f'<{tag} {a}="{x:.10g}" {b}="{y:.10g}">{values[i, j]:.9g}</{tag}>'
        for i, x in enumerate(h)
        for j, y in enumerate(v)
    )


def emitter(
    *,
    h: Iterable[float],
    v: Iterable[float],
    values: np.ndarray,
    symm: str = "",
    quantity: str = "Luminous",
    before: str = "",
    after: str = "",
    table: str = "",
    number: int = 1,
) -> str:
    h, v = list(h), list(v)
    symmetry = f"<Symm>{symm}</Symm>" if symm else ""
    limits = "" if quantity == "Luminous" else "<MinWavelength>400</MinWavelength><MaxWavelength>700</MaxWavelength>"
    return f"""<Emitter><Quantity>{number}</Quantity><Description>module</Description><InputWattage>12.5</InputWattage>
{before}<{quantity}Data>{limits}<{quantity}Intensity>{symmetry}{table}<NumberMeasured>{len(h) * len(v)}</NumberMeasured>
<NumberHorz>{len(h)}</NumberHorz><NumberVert>{len(v)}</NumberVert>
{grid(h=h, v=v, values=values)}
</{quantity}Intensity></{quantity}Data>{after}</Emitter>"""


def tm33(
    *emitters: str, root: str = "IESTM33-22", equipment: str = "IES_C", prologue: str = "", more: str = ""
) -> bytes:
    return f"""<?xml version="1.0" encoding="UTF-8"?>{prologue}
<{root}><Version>1.1</Version>
<Header><Manufacturer>Łampa &amp; Söhne</Manufacturer><CatalogNumber>№ 7</CatalogNumber><Description>Downlight</Description>
<Laboratory>Lab</Laboratory><ReportNumber>R-1</ReportNumber><ReportDate>2024-01-02</ReportDate></Header>
<Luminaire><Dimensions><Length>1.2</Length><Width>0.25</Width><Height>0.1</Height></Dimensions>
<NumEmitter>{len(emitters)}</NumEmitter></Luminaire>
<Equipment><Gonioradiometer><Type>{equipment}</Type></Gonioradiometer></Equipment>
{"".join(emitters)}{more}</{root}>
""".encode()


def whole_circle(led: Intensity) -> tuple[list[float], list[float], np.ndarray]:
    """Angles and values of a table over 0 to 360, as files have it; a plane at 0° is interpolated if there is none."""
    c = [0.0] if led.c.size == 1 else [*np.union1d([0.0], led.c).tolist(), 360.0]
    return c, led.gamma.tolist(), led.planes(c)


def tm33_of(led: Intensity) -> bytes:
    h, v, values = whole_circle(led)
    return tm33(emitter(h=h, v=v, values=values, quantity="Luminous" if led.flux_unit == "lm" else "Radiant"))


def product(
    files: Mapping[str, tuple[str, str, str]], photometries: Mapping[str, str], *, body: str = "", variants: str = ""
) -> str:
    """product.xml: files as id → (contentType, type, name), photometries as id → file id."""
    rows = "".join(f'<File id="{i}" contentType="{c}" type="{t}">{n}</File>' for i, (c, t, n) in files.items())
    found = "".join(
        f'<Photometry id="{i}"><PhotometryFileReference fileId="{f}"/></Photometry>' for i, f in photometries.items()
    )
    return f"""<?xml version="1.0" encoding="utf-8"?>
<Root xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:noNamespaceSchemaLocation="https://gldf.io/xsd/gldf/1.0.0-rc.2/gldf.xsd">
<Header><Manufacturer>M</Manufacturer><FormatVersion major="1" minor="0" pre-release="2"/></Header>
<GeneralDefinitions><Files>{rows}</Files><Photometries>{found}</Photometries>{body}</GeneralDefinitions>
<ProductDefinitions><Variants>{variants}</Variants></ProductDefinitions></Root>"""


def archive(members: Mapping[str, bytes | str], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", compression) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return data.getvalue()


def ies_of(led: Intensity, folder: Path) -> bytes:
    write_intensity(folder / "inner.ies", led)
    data = (folder / "inner.ies").read_bytes()
    (folder / "inner.ies").unlink()
    return data


def gldf_of(led: Intensity, folder: Path) -> bytes:
    xml = product({"f": ("ldc/ies", "localFileName", "led.ies")}, {"p": "f"})
    return archive({"product.xml": xml, "ldc/led.ies": ies_of(led, folder), "geo/body.l3d": b"mesh"})


def write_any(name: str, path: Path, led: Intensity) -> None:
    """A file of any format of the registry: with its writer, or, if it has none, as put together here."""
    if INTENSITY_FORMATS[name].write is not None:
        write_intensity(path, led, name)
    else:
        path.write_bytes({"tm33": lambda: tm33_of(led), "gldf": lambda: gldf_of(led, path.parent)}[name]())
