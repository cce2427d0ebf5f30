"""Files of a sample without symmetry that was turned about its normal, written by hand format by format.

The sample is a lobe that stands beside the specular direction, on the same side of the *sample* wherever the light comes
from; so a turn by half a turn, or a mirror image, is another function. Each writer counts angles as the page of its format
says, with vectors of its own; none of étendue's grids or writers is used.
"""

from __future__ import annotations

import io
import itertools
import json
import math
from collections.abc import Iterator, Sequence
from typing import Protocol

import h5py
import numpy as np
import numpy.typing as npt

from oracles.bsdf_files import tensors
from oracles.tracepro_files import row, section, surface_property

Array = npt.NDArray[np.float64]

FLOOR, PEAK = 0.02, 1.2
"""f [1/sr] far from the lobe, and what its middle has more than that."""

WIDTHS = (0.3, 0.18)
"""Standard deviations of the lobe in direction cosines: along its long axis, which lies at azimuth 100°, and across."""

BESIDE = {False: (0.25, 40.0), True: (0.2, 250.0)}
"""Distance from β₀ and azimuth [°] of the middle of the lobe, of reflected and of transmitted light."""


def f(*, incident: npt.ArrayLike, scattered: npt.ArrayLike) -> Array:
    """F [1/sr] in the frame of the sample, of directions away from it that broadcast: g(β − β₀ − c)."""
    i, s = np.broadcast_arrays(np.asarray(incident, float), np.asarray(scattered, float))
    through = i[..., 2] * s[..., 2] < 0.0
    off = s[..., :2] + i[..., :2]
    for transmitted, (distance, azimuth) in BESIDE.items():
        middle = distance * np.array([math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
        off = np.where((through == transmitted)[..., None], off - middle, off)
    c, n = math.cos(math.radians(100.0)), math.sin(math.radians(100.0))
    along, across = c * off[..., 0] + n * off[..., 1], -n * off[..., 0] + c * off[..., 1]
    return np.asarray(FLOOR + PEAK * np.exp(-0.5 * ((along / WIDTHS[0]) ** 2 + (across / WIDTHS[1]) ** 2)))


def direction(*, theta: npt.ArrayLike, phi: npt.ArrayLike, behind: bool = False) -> Array:
    """Unit vectors at angles from the normal of a side and azimuths from x towards y [°]."""
    t, p = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), (-1.0 if behind else 1.0) * np.cos(t)], axis=-1)


def turned(*, vectors: npt.ArrayLike, by: float) -> Array:
    """Vectors turned about the normal, counter-clockwise seen from the front [°]."""
    c, s = math.cos(math.radians(by)), math.sin(math.radians(by))
    return np.asarray(np.asarray(vectors, float) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


class Writer(Protocol):
    """Files of the sample under light from the front."""

    def __call__(self, *, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
        """One or more files of light from angles `thetas` and azimuths `phis` [°] of the sample, as étendue counts them."""


POLAR = np.arange(0.0, 86.0, 5.0)
AZIMUTH = np.arange(0.0, 360.0, 10.0)
"""Directions about the normal [°] at which most files hold values."""


def _blocks(thetas: Sequence[float], phis: Sequence[float]) -> Iterator[tuple[float, float]]:
    return ((theta, phi) for phi in phis for theta in thetas)


def _about_the_normal(*, theta: float, phi: float, transmitted: bool, azimuth: Array = AZIMUTH) -> Array:
    """Of shape (azimuths, polar angles), azimuths being those of the sample."""
    to = direction(theta=POLAR[None, :], phi=azimuth[:, None], behind=transmitted)
    return f(incident=direction(theta=theta, phi=phi), scattered=to)


def _points(thetas: Sequence[float], phis: Sequence[float], *, transmitted: bool) -> Iterator[tuple[float, ...]]:
    """θ and φ of light and of scattered light [°], beyond 90° behind the sample, and f; one point along the normal."""
    for theta, phi in _blocks(thetas, phis):
        values = _about_the_normal(theta=theta, phi=phi, transmitted=transmitted)
        for (k, a), (i, t) in ((x, y) for x in enumerate(AZIMUTH) for y in enumerate(POLAR)):
            if i or not k:
                yield theta, phi, 180.0 - t if transmitted else t, a, values[k, i]


def _lines(values: Array) -> list[str]:
    return [" ".join(f"{value:.9g}" for value in one) for one in values]


def astm(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """All directions away from the sample, azimuths from its x axis, in radians."""
    rows = [
        ",".join([*(f"{math.radians(angle):.12g}" for angle in point[:4]), f"{point[4]:.9g}"])
        for point in _points(thetas, phis, transmitted=transmitted)
    ]
    head = [f"NUM_POINTS {len(rows)}", "VARS theta_i,phi_i,theta_s,phi_s,BSDF"]
    return ["\n".join([*head, *rows, ""]).encode()]


def bird(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """As ASTM's, reflected, in degrees, column by column."""
    columns = np.array(list(_points(thetas, phis, transmitted=transmitted))).T
    names = {"theta_i": "deg", "phi_i": "deg", "theta_r": "deg", "phi_r": "deg", "BRDF": "1/sr"}
    units = zip(names.items(), columns, strict=True)
    data = {name: {"unit": unit, "values": column.tolist()} for (name, unit), column in units}
    return [json.dumps({"metadata": {"type": "BRDF"}, "data": data}).encode()]


def pab(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """A file for each incidence; directions as ASTM's, in degrees, but upwards, which is y, is at azimuth 130°."""
    files = []
    for theta, phi in _blocks(thetas, phis):
        head = ["#format: theta phi BSDF", f"#intheta {theta:g}", f"#inphi {(phi + 40.0) % 360.0:g}", "#upphi 130"]
        points = _points([theta], [phi], transmitted=transmitted)
        rows = (f"{t:g} {(a + 40.0) % 360.0:g} {v:.9g}" for _, _, t, a, v in points)
        files.append("\n".join([*head, *rows, ""]).encode())
    return files


def fred(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """The azimuth of an incidence is that towards which the light goes on; scattered ones count from the same axis."""
    lines = ["type bsdf_data", "format angles=deg bsdf=value scale=1"]
    for theta, phi in _blocks(thetas, phis):
        lines.append(f"{theta:g} {(phi + 180.0) % 360.0:g}")
        lines += [f"{t:g} {a:g} {v:.9g}" for _, _, t, a, v in _points([theta], [phi], transmitted=transmitted)]
    return ["\n".join([*lines, ""]).encode()]


def lighttools(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """Light comes from azimuth 90° + POI; θ is from the normal of the side where light leaves."""
    lines = ["Symmetry Asymmetric", "SpectralContent Monochrome"]
    for key, listed in (("ScatterAzimuth", AZIMUTH), ("ScatterRadial", POLAR)):
        lines += [f"{key} {listed.size}", " ".join(f"{angle:g}" for angle in listed)]
    lines.append("DataBegin")
    for theta, phi in _blocks(thetas, phis):
        lines += [
            f"AOI {theta:g} POI {phi - 90.0:g} Side Front ScatterType {'BTDF' if transmitted else 'BRDF'} TIS 0.3"
        ]
        lines += _lines(_about_the_normal(theta=theta, phi=phi, transmitted=transmitted))
    return ["\n".join([*lines, "DataEnd", ""]).encode()]


RADIAL = np.concatenate([np.arange(0.0, 60.0, 4.0), np.arange(60.0, 151.0, 10.0)])
"""Angles from the specular direction [°]."""


def _about_the_specular(*, theta: float, phi: float, transmitted: bool, sense: float) -> Array:
    """Of shape (azimuths, radial angles): 0 points to the normal, and `sense` turns about the specular direction.

    In the plane of incidence the specular direction is s at angle θ on the far side of the normal; e is what it moves by
    when that angle gets smaller. All is done at azimuth 180° of the light, and turned to where it comes from.
    """
    t = math.radians(theta)
    side = -1.0 if transmitted else 1.0
    s, e = np.array([math.sin(t), 0.0, side * math.cos(t)]), np.array([-math.cos(t), 0.0, side * math.sin(t)])
    r, a = np.radians(RADIAL)[None, :, None], np.radians(AZIMUTH)[:, None, None]
    across = sense * np.cross(s, e)
    to = np.cos(r) * s + np.sin(r) * (np.cos(a) * e + np.sin(a) * across)
    there = to[..., 2] * side > -1e-9
    to = turned(vectors=to, by=phi - 180.0)
    return np.where(there, f(incident=direction(theta=theta, phi=phi), scattered=to), 0.0)


def zemax(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """Counter-clockwise seen against the light; a sample turned by ρ sees light of azimuth 180° from 180° − ρ."""
    rotations = [(180.0 - phi) % 360.0 for phi in phis]
    lines = ["Source Measured", "Symmetry ASymmetrical4D", "SpectralContent Monochrome"]
    lines.append(f"ScatterType {'BTDF' if transmitted else 'BRDF'}")
    for key, listed in (
        ("SampleRotation", rotations), ("AngleOfIncidence", thetas), ("ScatterAzimuth", AZIMUTH), ("ScatterRadial", RADIAL),
    ):  # fmt: skip
        lines += [f"{key} {len(listed)}", " ".join(f"{value:g}" for value in listed)]
    lines += ["Monochrome", "DataBegin"]
    for theta, phi in _blocks(thetas, phis):
        # Who looks against the light sees turns about its direction s as those from e towards s × e.
        lines += ["TIS 0.3", *_lines(_about_the_specular(theta=theta, phi=phi, transmitted=transmitted, sense=1.0))]
    return ["\n".join([*lines, "DataEnd", ""]).encode()]


def _ssdd(
    *, system: str, thetas: Sequence[float], phis: Sequence[float], lists: Sequence[Array], table: Array
) -> bytes:
    """`table` of shape (phis, thetas, azimuths, polar angles)."""
    kind, values = system.split(), table.transpose(2, 3, 0, 1)
    lines = ["VERSION 0.2", f"DATA_TYPE {kind[0]}", "COLOR_MODEL monochrome", f"PARAM_TYPE {kind[1]}_coordinate_system"]
    lines += [
        f"PARAM{k}_LIST " + " ".join(f"{value:g}" for value in listed)
        for k, listed in enumerate([thetas, phis, *lists])
    ]
    return "\n".join([*lines, "DATA ascii", *(f"{value:.9g}" for value in values.ravel()), ""]).encode()


def ssdd(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """About the specular direction: transmitted light is that of the hemisphere mirrored at the surface."""
    kind = "btdf specular" if transmitted else "brdf specular"
    sense = -1.0 if transmitted else 1.0
    table = np.array([
        [_about_the_specular(theta=theta, phi=phi, transmitted=transmitted, sense=sense) for theta in thetas]
        for phi in sorted(phis)
    ])  # fmt: skip
    return [_ssdd(system=kind, thetas=thetas, phis=sorted(phis), lists=[RADIAL, AZIMUTH], table=table)]


def ssdd_about_the_normal(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """Azimuths of both directions count from one axis."""
    kind = "btdf spherical" if transmitted else "brdf spherical"
    table = np.array(
        [[_about_the_normal(theta=t, phi=p, transmitted=transmitted) for t in thetas] for p in sorted(phis)]
    )
    return [_ssdd(system=kind, thetas=thetas, phis=sorted(phis), lists=[POLAR, AZIMUTH], table=table)]


def _optis(values: Array, *, transmitted: bool) -> list[str]:
    """A table of shape (azimuths, polar angles): both angles, azimuths up to 360°; light that is transmitted beyond 90°."""
    around = np.vstack([values, values[:1]])
    head = [f"{POLAR.size} {AZIMUTH.size + 1}", " ".join(f"{angle:g}" for angle in [*AZIMUTH, 360.0])]
    polar = 180.0 - POLAR if transmitted else POLAR
    rows = [f"{t:g} {one}" for t, one in zip(polar, _lines(around.T), strict=True)]
    return [*head, *(rows[::-1] if transmitted else rows)]


def speos(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """The anisotropy angle turns the plane of incidence; azimuths count in it, from where the light goes on.

    Values are in arbitrary units; the spectrum is that of a reference between two angles, at the last anisotropy angle.
    """
    turns = sorted((phi + 180.0) % 360.0 for phi in phis)
    lines = ["OPTIS - Anisotropic BSDF surface file v8.0", "0", "by hand", "0", "", "1 0 0"]
    lines += [f"{1 - transmitted:d} {transmitted:d}", "1", str(len(turns)), " ".join(f"{turn:g}" for turn in turns)]
    for _ in turns:
        lines += [str(len(thetas)), " ".join(f"{theta:g}" for theta in thetas)]
    shares = [share(theta=theta, phi=(turns[-1] + 180.0) % 360.0, transmitted=transmitted) for theta in thetas]
    lines += [f"{np.mean(thetas):g} {turns[-1]:g}", "mean", "1", f"555 {100.0 * np.mean(shares):.9g}"]
    for turn in turns:
        for theta in thetas:
            values = 7.0 * _about_the_normal(
                theta=theta, phi=turn + 180.0, transmitted=transmitted, azimuth=AZIMUTH + turn
            )
            lines += _optis(values, transmitted=transmitted)
    return ["\n".join([*lines, "End of file", ""]).encode()]


def speos_brdf(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """Of a sample that is not turned: azimuths count from where the light goes on."""
    (phi,) = phis
    lines = ["OPTIS - brdf surface file v8.0", "0", "by hand", "0", "", f"{1 - transmitted:d} {transmitted:d}", "1"]
    lines += [f"{len(thetas)} 1", " ".join(f"{theta:g}" for theta in thetas), "555"]
    for theta in thetas:
        values = _about_the_normal(theta=theta, phi=phi, transmitted=transmitted, azimuth=AZIMUTH + phi + 180.0)
        lines.append(f"{100.0 * share(theta=theta, phi=phi, transmitted=transmitted):.9g}")
        lines += _optis(values, transmitted=transmitted)
    return ["\n".join([*lines, "End of file", ""]).encode()]


def share(*, theta: float, phi: float, transmitted: bool, cells: int = 400) -> float:
    """∫ f cosθ dΩ by midpoints over the disk of direction cosines."""
    side = (np.arange(cells) + 0.5) * (2.0 / cells) - 1.0
    x, y = np.meshgrid(side, side)
    inside = x * x + y * y < 1.0
    x, y = x[inside], y[inside]
    to = np.stack([x, y, (-1.0 if transmitted else 1.0) * np.sqrt(1.0 - x * x - y * y)], axis=-1)
    return float(f(incident=direction(theta=theta, phi=phi), scattered=to).sum() * (2.0 / cells) ** 2)


def tracepro(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """The azimuth of an incidence is that towards which light goes on, that of β − β₀ counts from the x axis of the sample.

    Of a sample that was not turned it counts from the axis on the right of the light, so that forwards is at 90°.
    """
    beta = np.concatenate([np.arange(0.0, 1.0, 0.08), [1.2, 1.7]])
    r, a = np.meshgrid(beta, np.radians(AZIMUTH[::2]))
    rows, table = [], []
    for theta, phi in _blocks(thetas, phis):
        incident, turn = direction(theta=theta, phi=phi), (phi + 180.0) % 360.0
        axis = 0.0
        if len(phis) == 1:
            axis, turn = math.radians(turn - 90.0), 0.0
        off = np.stack([r * np.cos(a + axis), r * np.sin(a + axis), np.zeros(r.shape)], axis=-1)
        to = off - [incident[0], incident[1], 0.0]
        to[..., 2] = -1.0 if transmitted else 1.0  # f asks for the side alone
        values = f(incident=incident, scattered=to)
        left = share(theta=theta, phi=phi, transmitted=transmitted)
        rows.append(row(theta=theta, phi=turn, left=left))
        both = (0.0 * values, values) if transmitted else (values, 0.0 * values)
        columns = [one.ravel() for one in (r, np.degrees(a), *both)]
        table += np.column_stack([np.tile([300, 0.55, theta, turn], (r.size, 1)), *columns]).tolist()
    return [surface_property(scatter=5, sections=[section(rows=rows, table=table)]).encode()]


def _window(*, structure: Sequence[str], basis: Sequence[str], data: Sequence[str], transmitted: bool) -> bytes:
    way = "Transmission Front" if transmitted else "Reflection Front"
    return "\n".join([
        '<?xml version="1.0" encoding="UTF-8"?>', '<WindowElement xmlns="http://windows.lbl.gov"><Optical><Layer>',
        "<Material><Name>by hand</Name></Material><DataDefinition>", *structure, "</DataDefinition><WavelengthData>",
        '<Wavelength unit="Integral">Visible</Wavelength><WavelengthDataBlock>',
        f"<WavelengthDataDirection>{way}</WavelengthDataDirection>", *basis, "<ScatteringData>", *data,
        "</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>", "",
    ]).encode()  # fmt: skip


def _of_radiance(vectors: Array) -> Array:
    """Directions of Radiance, whose normal is that of the file's back, in étendue's frame, and back: y stays."""
    return vectors * [-1.0, 1.0, -1.0]


def klems(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """Two bases of the file's own: few incidences, every 40° around, and many scattered directions.

    An index of incidence names where the light goes. The angles have to be 0° and 40°, azimuths multiples of 40°.
    """
    assert sorted(thetas) == [0.0, 40.0]
    assert not any(phi % 40.0 for phi in phis)
    few = [(0.0, 20.0, 1), (20.0, 60.0, 9), (60.0, 90.0, 1)]
    edges = np.degrees(np.arcsin(np.sqrt(np.linspace(0.01, 1.0, 16))))
    many = [(0.0, edges[0], 1), *((low, high, 36) for low, high in itertools.pairwise(edges))]
    structure = ["<IncidentDataStructure>Columns</IncidentDataStructure>"]
    for name, bands in (("few", few), ("many", many)):
        structure.append(f"<AngleBasis><AngleBasisName>{name}</AngleBasisName>")
        for low, high, n in bands:
            bounds = f"<ThetaBounds><LowerTheta>{low:.9g}</LowerTheta><UpperTheta>{high:.9g}</UpperTheta></ThetaBounds>"
            structure.append(f"<AngleBasisBlock><nPhis>{n}</nPhis>{bounds}</AngleBasisBlock>")
        structure.append("</AngleBasis>")
    patches = {
        name: [(0.5 * (low + high) if n > 1 or low else 0.0, 360.0 * k / n) for low, high, n in bands for k in range(n)]
        for name, bands in (("few", few), ("many", many))
    }
    # The light goes to (x, y) of the file, which is (−x, y) of étendue; it comes from the opposite side, in front.
    towards = _of_radiance(direction(theta=[t for t, _ in patches["few"]], phi=[p for _, p in patches["few"]]))
    incident = np.column_stack([-towards[:, :2], np.abs(towards[:, 2])])
    to = direction(theta=[t for t, _ in patches["many"]], phi=[p for _, p in patches["many"]], behind=not transmitted)
    values = f(incident=incident[None, :, :], scattered=_of_radiance(to)[:, None, :])
    basis = ["<ColumnAngleBasis>few</ColumnAngleBasis><RowAngleBasis>many</RowAngleBasis>"]
    rows = [",".join(f"{value:.9g}" for value in one) for one in values]
    return [_window(structure=structure, basis=basis, data=[",\n".join(rows)], transmitted=transmitted)]


def disk(*, square: Array) -> Array:
    """The concentric map of Shirley and Chiu: squares about the middle become circles, their sides quarters of them."""
    x, y = np.moveaxis(2.0 * square - 1.0, -1, 0)
    r = np.maximum(np.abs(x), np.abs(y))
    # Which side of its square a point is on, and how far along it, counter-clockwise, −1 to 1.
    sides = [(x == r), (y == r), (x == -r), (y == -r)]
    quarter, along = np.select(sides, [0, 1, 2, 3]), np.select(sides, [y, -x, -y, x]) / r
    turn = 0.5 * np.pi * quarter + 0.25 * np.pi * along
    return np.stack([r * np.cos(turn), r * np.sin(turn)], axis=-1)


CELLS = 16
"""Along each side of the squares of a tensor tree."""


def tensor_tree(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """A grid of values over where light goes and where scattered light goes; there are incidences all over."""
    assert {*thetas, *phis}
    middles = (np.arange(CELLS) + 0.5) / CELLS
    at = disk(square=np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(-1, 2))
    z = np.sqrt(1.0 - np.sum(at * at, axis=-1))
    incident = np.column_stack([at[:, 0], -at[:, 1], z])  # light goes to (x, y) of the file
    to = _of_radiance(np.column_stack([at, z if transmitted else -z]))
    values = f(incident=incident[:, None, :], scattered=to[None, :, :])
    structure = ["<IncidentDataStructure>TensorTree4</IncidentDataStructure>"]
    data = ["{", *_lines(values), "}"]
    basis = ["<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"]
    return [_window(structure=structure, basis=basis, data=data, transmitted=transmitted)]


def rgl(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """f cosθ over the half vector h, by √(2θₕ/π) and φₕ/2π + ½: the density of its warp is even. Azimuths from −π."""
    assert not transmitted
    n = (61, 121)
    theta_h = 0.5 * np.pi * np.linspace(0.0, 1.0, n[0]) ** 2
    phi_h = np.linspace(-np.pi, np.pi, n[1])
    half = direction(theta=np.degrees(theta_h)[None, :], phi=np.degrees(phi_h)[:, None])
    wrapped = sorted((phi + 180.0) % 360.0 - 180.0 for phi in phis)
    several = len(wrapped) > 2
    tables = np.zeros((len(wrapped), len(thetas), 1, n[1], n[0]), np.float32)
    for j, phi in enumerate(wrapped):
        for k, theta in enumerate(thetas):
            incident = direction(theta=theta, phi=phi)
            # Of a sample that was not turned, azimuths of h count from the light.
            h = half if several else turned(vectors=half, by=phi)
            to = 2.0 * (h @ incident)[..., None] * h - incident
            tables[j, k, 0] = f(incident=incident, scattered=to) * to[..., 2]
    plain = np.ones((2, 2), np.float32)
    return [
        tensors({
            "theta_i": np.radians(thetas).astype(np.float32), "phi_i": np.radians(wrapped).astype(np.float32),
            "ndf": plain, "sigma": plain, "vndf": np.ones((len(wrapped), len(thetas), 2, 2), np.float32),
            "spectra": tables, "wavelengths": np.array([550.0], np.float32), "jacobian": np.zeros(1, np.uint8),
        })
    ]  # fmt: skip


def etendue(*, thetas: Sequence[float], phis: Sequence[float], transmitted: bool) -> list[bytes]:
    """HDF5: directions are vectors, azimuths about the normal those of the sample."""
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        plain = {
            "kind": "etendue BSDF",
            "version": 1,
            "name": "by hand",
            "isotropic": len(phis) == 1,
            "mirrored": False,
        }
        texts = {"components": "[]", "facts": "{}", "complaints": "[]"}
        blocks = list(_blocks(thetas, phis))
        file.attrs.update({**plain, **texts, "both_sides": True, "slices": len(blocks)})
        for k, (theta, phi) in enumerate(blocks):
            group = file.create_group(f"slice{k:06}")
            incident = direction(theta=theta, phi=phi)
            group.attrs.update({"incident": incident, "transmitted": transmitted, "frame": "normal"})
            values = _about_the_normal(theta=theta, phi=phi, transmitted=transmitted)
            for name, array in {"radial": POLAR, "azimuth": AZIMUTH, "values": values}.items():
                group.create_dataset(name, data=array)
    return [stream.getvalue()]
