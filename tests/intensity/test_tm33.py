"""TM-33 and ATLA S001: every direction, unit and symmetry; several emitters; what is told, refused and survived."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from etendue.errors import FormatError, UnknownNameError, UnsupportedFormatError
from etendue.formats import xml_tree
from etendue.formats.intensity import read_intensity, write_intensity
from etendue.formats.intensity.tm33 import ROOTS
from etendue.quantities.intensity import Intensity
from oracles.intensity import lid
from oracles.luminaire_files import SYMM, emitter, tm33, tm33_of

Read = Callable[..., Intensity]

GAMMA = [0.0, 30, 60, 90]
CIRCLE = [0.0, 90, 180, 270, 360]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def call(content: bytes, photometry: str | None = None) -> Intensity:
        (tmp_path / "a.xml").write_bytes(content)
        return read_intensity(tmp_path / "a.xml", photometry)

    return call


def told(led: Intensity) -> str:
    return "\n".join([*map(str, led.complaints), *led.notes])


def some(h: int, v: int) -> np.ndarray:
    """No two values alike."""
    return 100.0 + 10.0 * np.arange(h)[:, None] + np.arange(v)


@pytest.mark.parametrize("root", [root for root in ROOTS if root != "LuminaireOpticalData"])
def test_every_root(read: Read, root: str) -> None:
    led = read(tm33(emitter(h=CIRCLE, v=GAMMA, values=some(5, 4) - 40.0 * (np.arange(5)[:, None] == 4)), root=root))
    assert led.c.tolist() == [0, 90, 180, 270]
    assert led.values.tolist() == some(4, 4).tolist()
    assert {complaint.place for complaint in led.complaints} == {"intensities at γ = 0°"}
    facts = led.luminaire
    assert (facts["manufacturer"], facts["catalogue_number"], facts["test_report"]) == ("Łampa & Söhne", "№ 7", "R-1")
    assert (facts["housing_x"], facts["housing_y"], facts["housing_z"]) == pytest.approx((1200, 250, 100))
    assert (facts["input_power"], facts["lamps"], facts["lamp"]) == (12.5, 1, "module")
    assert (led.provenance.format, led.flux_unit) == ("tm33", "lm")


@pytest.mark.parametrize("symmetry", SYMM)
@pytest.mark.parametrize("stated", [True, False])
def test_sectors(read: Read, symmetry: str, stated: bool) -> None:
    """The sector that a symmetric file stores, unfolded: the whole function, with its symmetry and no other."""
    whole = lid(symmetry)
    sector = {
        "none": [*range(0, 361, 15)],
        "rotational": [0],
        "both": [*range(0, 91, 15)],
        "C0-C180": [*range(0, 181, 15)],
        "C90-C270": [*range(90, 271, 15)],
    }[symmetry]
    led = read(
        tm33(emitter(h=sector, v=whole.gamma, values=whole.planes(sector), symm=SYMM[symmetry] if stated else ""))
    )
    assert led.symmetry() == symmetry
    assert np.allclose(led.planes(whole.c), whole.values)
    assert not led.complaints


@pytest.mark.parametrize("spelt", ["Symm _ Bi _90", " SYMM_BI_90 "])
def test_spellings_of_a_symmetry(read: Read, spelt: str) -> None:
    led = read(tm33(emitter(h=[90, 180, 270], v=GAMMA, values=some(3, 4), symm=spelt)))
    assert led.at(0, 0) == led.at(180, 0) == 110


@pytest.mark.parametrize(
    ("sector", "symm", "message"),
    [
        ([0, 90], "Symm_None", "Symm says 'Symm_None', the planes run from 0° to 90°"),
        ([0, 90, 180], "Symm_Quad", "Symm says 'Symm_Quad'"),
        ([0, 120], "", "no sector that symmetry completes"),
        ([0, 90], "Symm_Arbitrary", "Known are None, Bi_0"),
    ],
)
def test_symmetries_that_are_not_certain_are_refused(read: Read, sector: list[float], symm: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(tm33(emitter(h=sector, v=GAMMA, values=some(len(sector), 4), symm=symm)))


def test_any_order_of_directions(read: Read) -> None:
    rows = tm33(emitter(h=[0, 90], v=GAMMA, values=some(2, 4))).decode().split("\n")
    data = [n for n, row in enumerate(rows) if "<IntData" in row]
    for n, row in zip(data, [rows[n] for n in reversed(data)], strict=True):
        rows[n] = row
    assert np.array_equal(read("\n".join(rows).encode()).planes([0, 90]), some(2, 4))


def test_multiplier_watts_and_stated_flux(read: Read) -> None:
    content = emitter(h=[0], v=GAMMA, values=some(1, 4), quantity="Radiant", table="<Multiplier>0.01</Multiplier>")
    content = content.replace("</RadiantData>", "<RadiantFlux>99</RadiantFlux></RadiantData>")
    led = read(tm33(content))
    assert led.flux_unit == "W"
    assert np.allclose(led.values, some(1, 4) / 100)
    assert led.luminaire["stated_flux"] == 99
    assert "RadiantFlux: it says 99 W, the table integrates to" in told(led)


def test_relative_photometry_and_rated_lumens(read: Read) -> None:
    content = emitter(h=[0], v=GAMMA, values=some(1, 4), table="<AbsolutePhotometry>false</AbsolutePhotometry>")
    content = content.replace("<InputWattage>", "<RatedLumens>200</RatedLumens><InputWattage>")
    led = read(tm33(content))
    assert np.array_equal(led.values, some(1, 4))
    assert "relative photometry" in told(led)
    assert "RatedLumens: the table integrates to 6" in told(led)


def test_several_emitters_are_added(read: Read) -> None:
    """On different nodes and ranges: the function of the sum is the sum of the functions."""
    a, b = (
        lid("none", c=range(0, 360, 30), gamma=range(0, 91, 10)),
        lid("C0-C180", c=range(0, 360, 45), gamma=range(0, 181, 15)),
    )
    content = [tm33_of(led).decode().split("</Equipment>")[1].removesuffix("</IESTM33-22>\n") for led in (a, b)]
    both = read(tm33(*content))
    rng = np.random.default_rng(1)
    c, gamma = rng.uniform(0, 360, 3000), rng.uniform(0, 180, 3000)
    clear = np.abs(gamma - 90) > 0.01  # the first ends there
    assert np.allclose(both.at(c, gamma)[clear], (a.at(c, gamma) + b.at(c, gamma))[clear], rtol=1e-7)
    assert both.flux == pytest.approx(a.flux + b.flux, rel=1e-4)
    assert both.luminaire["input_power"] == 25
    assert "the sum of 2 emitters" in told(both)
    second = read(tm33(*content), "2")
    assert np.allclose(second.at(c, gamma), b.at(c, gamma), rtol=1e-7)
    with pytest.raises(UnknownNameError, match=r"'3'.*Known: 1, 2"):
        read(tm33(*content), "3")


def test_quantities_that_cannot_be_added(read: Read) -> None:
    lumens, watts = (
        emitter(h=[0], v=GAMMA, values=some(1, 4)),
        emitter(h=[0], v=GAMMA, values=some(1, 4), quantity="Radiant"),
    )
    photons = emitter(h=[0], v=GAMMA, values=some(1, 4), quantity="Photon")
    with pytest.raises(FormatError, match=r"1 \(module, luminous\); 2 \(module, radiant\)"):
        read(tm33(lumens, watts))
    assert read(tm33(lumens, watts), "2").flux_unit == "W"
    with pytest.raises(UnsupportedFormatError, match="micromoles per second"):
        read(tm33(photons))
    of_both = watts.split("<RadiantData>")[1].removesuffix("</Emitter>")
    one = lumens.removesuffix("</Emitter>") + "<RadiantData>" + of_both + "</Emitter>"
    assert read(tm33(one)).flux_unit == "lm"
    assert "1/radiant can be asked for" in told(read(tm33(one)))
    assert read(tm33(one), "1/radiant").flux_unit == "W"


def test_quantity_of_an_emitter_is_told(read: Read) -> None:
    led = read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), number=3)))
    assert np.array_equal(led.values, some(1, 4))
    assert "there are 3 of this emitter; the table was taken as that of all" in told(led)


def test_type_b_and_a(read: Read) -> None:
    h, v = [-20.0, 0, 20], [-30.0, 0, 30]
    values = np.array([[0, 0, 0], [0, 500, 0], [0, 250.0, 0]])
    flood = read(tm33(emitter(h=h, v=v, values=values), equipment="IES_B"))
    assert float(flood.at(270, 20)) == pytest.approx(250, rel=0.01)
    assert float(flood.at(90, 20)) == pytest.approx(0, abs=1)
    assert "largest difference" in told(flood)
    head = read(tm33(emitter(h=h, v=v, values=values), equipment="IES_A"))
    assert float(head.at(340, 90)) == pytest.approx(250)
    with pytest.raises(UnsupportedFormatError, match="whose angles are not certain"):
        read(tm33(emitter(h=h, v=v, values=values), equipment="CIE_B"))
    with pytest.raises(FormatError, match="Symm_None, but horizontal angles begin at 0°"):
        read(tm33(emitter(h=[0, 20], v=v, values=values[1:], symm="Symm_None"), equipment="IES_B"))


def test_a_spectrum_goes_with_the_source(read: Read, tmp_path: Path) -> None:
    from etendue.description.files import Files
    from etendue.scene.sources.from_files import Point

    pairs = "".join(f'<PwrData w="{w}">{p}</PwrData>' for w, p in ((450, 1.0), (650, 0.0), (550, 3.0)))
    data = (
        f"<SpectralData><EmitterSpectral><NumberWavelength>3</NumberWavelength>{pairs}</EmitterSpectral></SpectralData>"
    )
    led = read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), after=data)))
    assert led.luminaire["spectrum"].wavelength.tolist() == [450, 550, 650]
    assert led.luminaire["spectrum"].weight.tolist() == [1, 3, 0]
    (of_source,) = Point(file=tmp_path / "a.xml").emitters(Files())
    assert of_source.spectrum is not None
    assert of_source.spectrum.weight.tolist() == [1, 3, 0]
    assert "the spectrum is not kept" in write_intensity(tmp_path / "a.ies", led)
    bad = read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), after=data.replace("3.0", "-3"))))
    assert "spectrum" not in bad.luminaire
    assert "the spectrum was not kept" in told(bad)


def test_what_is_not_known_or_not_kept_is_told(read: Read) -> None:
    content = emitter(
        h=[0], v=GAMMA, values=some(1, 4), before="<Colour/>", after="<Channels/>", table="<Colour>1</Colour>"
    )
    led = read(tm33(content.replace("12.5", "much"), more="<Colour/>"))
    text = told(led)
    assert text.count("Colour: no element of the format here; it was ignored") == 3
    assert "Channels: not kept" in text
    assert "InputWattage: 'much' is no number" in text
    large = read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4))).replace(b">1.2<", b">1200<"))
    assert "housing_x" not in large.luminaire
    assert "1200 m, which no luminaire has" in told(large)


def test_the_dialect_with_long_names(read: Read) -> None:
    rows = "".join(f'<IntensityData horz="0" vert="{g}">{100 - g}</IntensityData>' for g in (0, 45, 90))
    content = f"""<LuminaireOpticalData version="1.0" xmlns="http://www.ies.org/tm-33"><Header/><Emitter><ID>rb</ID>
    <InputWatts>200</InputWatts><IntensityDistribution><PhotometryType>C</PhotometryType><Metric>Luminous</Metric>
    {rows}</IntensityDistribution></Emitter></LuminaireOpticalData>"""
    led = read(content.encode())
    assert led.values.tolist() == [[100, 55, 10]]
    assert led.luminaire["input_power"] == 200
    assert "a dialect" in told(led)
    assert np.array_equal(read(content.encode(), "rb").values, led.values)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_encodings(read: Read, encoding: str) -> None:
    text = tm33(emitter(h=[0], v=GAMMA, values=some(1, 4))).decode().replace("Ł", "L").replace("№", "N")
    led = read(text.replace("UTF-8", encoding).encode(encoding))
    assert led.luminaire["manufacturer"] == "Lampa & Söhne"


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('<IntData h="0" v="30">101</IntData>', "", "7 intensities at 2 horizontal and 4 vertical angles"),
        ('v="30">101', 'v="30">1_0', "line 12, IntData: value: '1_0' is no number"),
        ('v="30">101', 'v="30">nan', "is no number"),
        ('v="30">101', 'v="60">101', "there twice"),
        ('h="0" v="30"', 'v="30"', "h: '' is no number"),
        ("IntData", "Data", "too few"),
        ("LuminousData", "Data", "no emitter has LuminousData"),
        ("Emitter", "Lamp", "the file has no Emitter"),
        ('v="90"', 'v="190"', "beyond 0° to 180°"),
        ("</Header>", "", "no XML: mismatched tag"),
        ("Downlight", "a & b", "no XML"),
        ("UTF-8", "EBCDIC-XX", "no encoding|no XML"),
    ],
)
def test_what_is_refused(read: Read, old: str, new: str, message: str) -> None:
    content = tm33(emitter(h=[0, 90], v=GAMMA, values=some(2, 4))).decode()
    assert old in content
    with pytest.raises(FormatError, match=message):
        read(content.replace(old, new).encode())


def test_counts_that_disagree_are_told(read: Read) -> None:
    content = tm33(emitter(h=[0, 90], v=GAMMA, values=some(2, 4))).replace(b"<NumberHorz>2", b"<NumberHorz>999999999")
    assert "NumberHorz: it says 999999999, there are 2" in told(read(content))


LAUGHS = "<!DOCTYPE a [<!ENTITY a 'ha'>" + "".join(
    f"<!ENTITY {x} '{f'&{y};' * 10}'>" for x, y in zip("bcdefghij", "abcdefghi", strict=True)
)


@pytest.mark.parametrize(
    "prologue",
    [
        LAUGHS + "]>",
        '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE a SYSTEM "http://127.0.0.1:1/a.dtd">',
        "<!DOCTYPE a>",
    ],
)
def test_a_document_type_is_refused(read: Read, prologue: str) -> None:
    """What can grow or reach outside is declared there."""
    with pytest.raises(FormatError, match="document type declaration"):
        read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4)), prologue=prologue))


def test_depth_and_number_are_bounded(read: Read, monkeypatch: pytest.MonkeyPatch) -> None:
    deep = "<a>" * 100_000 + "</a>" * 100_000
    with pytest.raises(FormatError, match="64 deep"):
        read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), before=deep)))
    monkeypatch.setattr(xml_tree, "MOST_ELEMENTS", 10)
    with pytest.raises(FormatError, match="more than 10 elements"):
        read(tm33(emitter(h=[0], v=GAMMA, values=some(1, 4))))


def test_planes_are_counted_as_in_ies_files(read: Read, tmp_path: Path) -> None:
    led = read(tm33_of(lid("none")))
    assert not any("rotate" in note for note in write_intensity(tmp_path / "a.ies", led))
    assert any("rotate=90 turns" in note for note in write_intensity(tmp_path / "a.ldt", led))


# --- what the file says twice, or beside its table -----------------------------------------------------------------------


def flux_of(values: np.ndarray) -> float:
    return Intensity([0], GAMMA, values).flux


def test_strangers_beside_the_table_are_told(read: Read) -> None:
    content = emitter(h=[0], v=GAMMA, values=some(1, 4))
    more = "<Multiplier>2</Multiplier><Foo/><IllumData/></LuminousData>"
    led = read(tm33(content.replace("</LuminousData>", more)))
    text = told(led)
    assert "Multiplier: no element of the format here; it was ignored" in text
    assert "Foo: no element of the format here; it was ignored" in text
    assert "IllumData: not kept" in text
    assert np.array_equal(led.values, some(1, 4))


@pytest.mark.parametrize(("factor", "count"), [("0.8", 1), ("1", 0), ("much", 1)])
def test_a_ballast_factor_is_not_applied_and_told(read: Read, factor: str, count: int) -> None:
    content = emitter(h=[0], v=GAMMA, values=some(1, 4), before=f"<BallastFactor>{factor}</BallastFactor>")
    led = read(tm33(content))
    assert np.array_equal(led.values, some(1, 4))
    assert told(led).count("BallastFactor") == count


def test_multipliers_that_differ_are_refused(read: Read) -> None:
    def content(first: str, second: str) -> bytes:
        two = f"<Multiplier>{first}</Multiplier><Multiplier>{second}</Multiplier>"
        return tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), table=two))

    led = read(content("2", "2.0"))
    assert np.array_equal(led.values, 2 * some(1, 4))
    assert "Multiplier: 2 stands there 2 times; it was applied once" in told(led)
    for second in ("3", "x"):
        with pytest.raises(FormatError, match=f"there are 2, and they differ: 2, {second}"):
            read(content("2", second))


def test_a_number_of_emitters_that_disagrees_is_told(read: Read) -> None:
    """One of a kind that counts seven, or seven of one kind: either way of counting is right."""
    one = tm33(emitter(h=[0], v=GAMMA, values=some(1, 4)))
    text = told(read(one.replace(b"<NumEmitter>1<", b"<NumEmitter>7<")))
    assert "NumEmitter: it says 7, the file has 1" in text
    seven = tm33(emitter(h=[0], v=GAMMA, values=some(1, 4), number=7))
    assert "NumEmitter" not in told(read(seven))
    assert "NumEmitter" not in told(read(seven.replace(b"<NumEmitter>1<", b"<NumEmitter>7<")))
    assert "NumEmitter: 'x' is no number" in told(read(one.replace(b"<NumEmitter>1<", b"<NumEmitter>x<")))


@pytest.mark.parametrize(("share", "disagrees"), [(1.04, False), (0.3, True)])
def test_measured_lumens_that_the_table_has_not_are_told(read: Read, share: float, disagrees: bool) -> None:
    stated = share * flux_of(some(1, 4))
    content = emitter(h=[0], v=GAMMA, values=some(1, 4), before=f"<MeasuredLumens>{stated:.9g}</MeasuredLumens>")
    led = read(tm33(content))
    assert ("MeasuredLumens: it says" in told(led)) == disagrees
    assert led.luminaire["stated_flux"] == pytest.approx(stated)
