"""TracePro surface properties made by hand, with formulas and shares that know nothing of the reader."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Function = Callable[[Array, Array], Array]
"""f [1/sr] over x and y of β − β₀ along the local axes."""

NAMES = [
    "Temperature", "Wavelength", "IncAngle", "AziAngle", "Abso_S", "Abso_P", "Refl_S", "Refl_P", "Tran_S", "Tran_P",
    "PhaseRefl", "PhaseTran", "BRDF_A", "BRDF_B", "BRDF_By", "BRDF_g", "BRDF_gy", "BTDF_A", "BTDF_B", "BTDF_By", "BTDF_g",
    "BTDF_gy",
]  # fmt: skip
TABLE = ["Temperature", "Wavelength", "IncAngle", "AziAngle", "ScatterBeta", "ScatterAzimuth", "BRDF", "BTDF"]

Row = Sequence[float]


def share(*, f: Function, beta0: tuple[float, float], cells: int = 600) -> float:
    """∫ f over the unit disk of β, by midpoints of a square grid about it."""
    side = (np.arange(cells) + 0.5) * (2.0 / cells) - 1.0
    x, y = np.meshgrid(side, side)
    inside = x * x + y * y < 1.0
    return float(np.sum(f(x - beta0[0], y - beta0[1])[inside]) * (2.0 / cells) ** 2)


def floating(*, theta: float) -> tuple[float, float]:
    """β₀ along the local axes where x stands at right angles to the plane of incidence: forwards is y."""
    return 0.0, math.sin(math.radians(theta))


def fixed(*, theta: float, phi: float) -> tuple[float, float]:
    """β₀ along the axes of the sample, of light that goes on towards azimuth φ."""
    sine = math.sin(math.radians(theta))
    return sine * math.cos(math.radians(phi)), sine * math.sin(math.radians(phi))


def row(
    *,
    theta: float,
    left: float,
    reflected: Row = (0, 0, 0, 0, 0),
    transmitted: Row = (0, 0, 0, 0, 0),
    phi: float = 0.0,
    micrometres: float = 0.55,
    mirrored: float = 0.0,
) -> list[float]:
    """Shares that leave so much for scatter, and numbers A, B, By, g, gy of both ways."""
    absorbed = 1.0 - left - mirrored
    return [300, micrometres, theta, phi, absorbed, absorbed, mirrored, mirrored, 0, 0, 0, 0, *reflected, *transmitted]


def section(*, rows: Sequence[Row], table: Sequence[Row] = ()) -> str:
    """Rows of shares, and a table below."""
    lines = ["\t".join(NAMES), *("\t\t".join(f"{value:.12g}" for value in one) for one in rows)]
    if table:
        lines += [
            "",
            "[Table_BSDF_Data]",
            "\t".join(TABLE),
            *(" ".join(f"{value:.12g}" for value in one) for one in table),
        ]
    return "\n".join([*lines, ""])


def abg_side(*, a: float, mirrored: float = 0.0, way: str = "reflected") -> str:
    """Shares of one side with ABg (a, 0.1, 2) at two angles."""
    rows = [row(theta=t, left=0.1, mirrored=mirrored, **{way: (a, 0.1, 0, 2, 0)}) for t in (0, 50)]  # type: ignore[arg-type]
    return section(rows=rows)


def surface_property(
    *,
    scatter: int,
    sections: Sequence[str],
    coating: int = 1,
    interaction: int = 0,
    polarization: int = 0,
) -> str:
    """A property of one side, or of two."""
    head = [
        "TracePro Surface Property Data", "File Name\tC:\\x.txt", "TracePro Release: 19 6 0", "Database Version: 4 1 0",
        "", "Name\tby hand", "Catalog\tnone", "Description\t", f"Coating {coating}", f"Scatter {scatter}",
        f"Interaction {interaction}", f"Polarization {polarization}", "User_Data 1", "Solve ABSORP", "", "",
    ]  # fmt: skip
    if len(sections) == 1:
        return "\n".join(head) + sections[0]
    return "\n".join(head) + "\n".join(f"[Side{k}_Data]\n{one}" for k, one in enumerate(sections, 1))


def ellipse(*, peak: float, b: tuple[float, float], g: tuple[float, float]) -> Function:
    """Elliptical ABg with one peak: B and g are radii of ellipses over the azimuth of β − β₀."""

    def f(x: Array, y: Array) -> Array:
        phi = np.arctan2(y, x)

        def radius(pair: tuple[float, float]) -> Array:
            return np.asarray(1.0 / np.sqrt((np.cos(phi) / pair[0]) ** 2 + (np.sin(phi) / pair[1]) ** 2))

        at = radius(b)
        return np.asarray(peak * at / (at + np.hypot(x, y) ** radius(g)))

    return f


def gaussian(*, peak: float, s: tuple[float, float]) -> Function:
    """With half widths at 1/e²."""
    return lambda x, y: np.asarray(peak * np.exp(-2.0 * (x * x / s[0] ** 2 + y * y / s[1] ** 2)))


def streak(*, a: float, b: float, g: float, sigma: float) -> Function:
    """ABg along x times a Gaussian of that standard deviation along y."""
    return lambda x, y: np.asarray(a / (b + np.abs(x) ** g) * np.exp(-y * y / (2.0 * sigma**2)))


def listed(*, beta: Sequence[float], values: Sequence[float], sigma: float) -> Function:
    """Values along x, linear in between, times a Gaussian along y."""
    return lambda x, y: np.asarray(np.interp(x, beta, values) * np.exp(-y * y / (2.0 * sigma**2)))


LOBE: Row = (0.05, 0.1, 0.2, 1.5, 1.0)
PROFILE = {-0.4: 0.0, -0.1: 0.3, 0.0: 1.0, 0.2: 0.1, 0.5: 0.2}


def _both(f: Function, numbers: Row, table: Sequence[Row] = ()) -> str:
    rows = [row(theta=t, left=share(f=f, beta0=floating(theta=t), cells=400), reflected=numbers) for t in (0, 40)]
    return section(rows=rows, table=table)


@functools.cache
def small_files() -> dict[str, bytes]:
    """A small file of each kind of scatter, and of a coating with two sides."""
    along = streak(a=0.05, b=0.1, g=1.5, sigma=0.2)
    profile = listed(beta=list(PROFILE), values=list(PROFILE.values()), sigma=0.2)
    polar = [[300, 0.55, t, 0, b, a, 0.1, 0.02] for t in (0, 40) for b in (0, 0.5) for a in (0, 120, 240)]
    lines = [[300, 0.55, t, 0, b, 0, value, 0] for t in (0, 40) for b, value in PROFILE.items()]
    abg = section(rows=[row(theta=t, left=0.3, reflected=(0.01 + t / 1e3, 0.1, 0, 2, 0)) for t in (0, 40)])
    plain = section(rows=[row(theta=t, left=0.3) for t in (0, 40)], table=polar)
    texts = {
        "ABg": (1, [abg]),
        "elliptical ABg": (2, [_both(ellipse(peak=0.5, b=(0.1, 0.2), g=(1.5, 1.0)), LOBE)]),
        "elliptical Gaussian": (3, [_both(gaussian(peak=2, s=(0.3, 0.2)), (2, 0.3, 0.2, 0, 0))]),
        "table": (4, [plain]),
        "asymmetric table": (5, [plain]),
        "1D ABg": (6, [_both(along, (0.05, 0.1, 0.2, 1.5, 0))]),
        "1D table": (7, [_both(profile, (0, 0, 0.2, 0, 0), lines)]),
        "two sides": (5, [plain, plain]),
    }
    return {
        name: surface_property(scatter=scatter, sections=parts, coating=7 if len(parts) > 1 else 1).encode()
        for name, (scatter, parts) in texts.items()
    }
