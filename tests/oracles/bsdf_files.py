"""Files made by hand of the formats that are read and not written."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def merl(f: Callable[[Array, Array, Array], Array]) -> bytes:
    """A table of three equal colours of f(θh, θd, φd) [rad] at the middles of its cells."""
    theta_h = np.radians(90.0) * ((np.arange(90) + 0.5) / 90.0) ** 2
    theta_d = np.radians(np.arange(90) + 0.5)
    phi_d = np.radians(np.arange(180) + 0.5)
    values = np.broadcast_to(f(theta_h[:, None, None], theta_d[:, None], phi_d), (90, 90, 180))
    scales = np.array([1.0, 1.15, 1.66]) / 1500.0
    return struct.pack("<3i", 90, 90, 180) + (values / scales[:, None, None, None]).astype("<f8").tobytes()


def tensors(fields: dict[str, npt.NDArray[np.generic]]) -> bytes:
    """A tensor file of these arrays."""
    numbers = {"u1": 1, "f4": 10, "f8": 11}
    size = 18 + sum(2 + len(name) + 11 + 8 * array.ndim for name, array in fields.items())
    head = b"tensor_file\0" + struct.pack("<2BI", 1, 0, len(fields))
    body = b""
    for name, array in fields.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", array.ndim, numbers[array.dtype.str[1:]], size + len(body))
        head += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += array.tobytes()
    return head + body


def rgl(
    *,
    vndf: Array,
    values: Array,
    theta_i: tuple[float, ...] = (0.0, 30.0, 60.0),
    ndf: Array | None = None,
    sigma: Array | None = None,
) -> bytes:
    """An isotropic sample: tables of shape (y, x), the same at all angles of incidence [°]; two equal wavelengths."""
    n = len(theta_i)
    single = np.float32

    def repeated(table: Array, *between: int) -> npt.NDArray[np.float32]:
        shape = (1, n, *between, *table.shape)
        return np.ascontiguousarray(np.broadcast_to(table, shape), single)

    plain = np.ones((2, 2))
    return tensors(
        {
            "description": np.frombuffer(b"made by hand", np.uint8),
            "phi_i": np.zeros(1, single),
            "theta_i": np.radians(theta_i).astype(single),
            "ndf": (plain if ndf is None else ndf).astype(single),
            "sigma": (plain if sigma is None else sigma).astype(single),
            "vndf": repeated(vndf),
            "luminance": repeated(vndf),
            "spectra": repeated(values, 2),
            "wavelengths": np.array([500.0, 600.0], single),
            "jacobian": np.array([int(ndf is not None)], np.uint8),
        }
    )


def pab(
    quantity: str = "BRDF", *, theta: float = 30.0, phi: float = 0.0, up: str = "#upphi 90", end: str = "\n"
) -> bytes:
    """A mirrored lobe at scattered places, with values that tell θ and φ; upwards, which is y, is at azimuth 90°."""
    rng = np.random.default_rng(3)
    to, around = rng.uniform(0.0, 85.0, 200), rng.uniform(0.0, 360.0, 200)
    values = 0.1 + to / 1000.0 + around / 10000.0
    if quantity == "DSF":
        values = values * np.cos(np.radians(to))
    lines = [
        '#sample_name "brushed sheet"',
        f"#format: theta phi {quantity}",
        f"#intheta {theta:g}",
        f"#inphi {phi:g}",
        up,
        f"#datapoints_in_file: {to.size}",
        *(f"{t:.6f}\t{a:.6f}\t{v:.9g}" for t, a, v in zip(to, around, values, strict=True)),
    ]
    return ("\n".join(lines) + end).encode()


SCATTERING = """OPTIS - Scattering surface file v1.0
made by hand
3 2
\t400\t\t600\t\t
0\t30\t20\t0\t0\t
\t20\t10\t0\t0\t
\t0\t0\t20\t0\t
\t0\t0\t10\t0\t
\t0\t0\t10\t0\t
45\t0\t0\t0\t0\t
\t0\t0\t0\t0\t
\t0\t0\t20\t20\t
\t0\t0\t30\t5\t
\t0\t0\t5\t30\t
90\t0\t0\t0\t0\t
\t0\t0\t0\t0\t
\t0\t0\t0\t0\t
\t0\t0\t0\t0\t
\t0\t0\t0\t0\t
"""

SIMPLE = """OPTIS - Simple scattering surface file v2.0
white
Reflection
10 60 30 12
"""

COATED = """OPTIS - Coated surface file v1.0
Coating File Example
4 3
\t480\t\t580\t\t780\t\t
0\t31.9\t68.1\t1.5\t98.5\t25.7\t74.3\t
\t31.9\t68.1\t1.5\t98.5\t25.7\t74.3\t
50\t11.3\t88.7\t11.4\t88.6\t23.3\t76.7\t
\t13.3\t86.7\t11.4\t88.6\t23.3\t76.7\t
70\t15\t85\t15.2\t84.8\t26.3\t73.7\t
\t15\t85\t15.2\t84.8\t26.3\t73.7\t
90\t100\t0\t100\t0\t100\t0\t
\t100\t0\t100\t0\t100\t0\t
"""

READ_ONLY: dict[str, Callable[[], bytes]] = {
    "merl": lambda: merl(lambda h, d, p: 0.2 + 0.0 * h * d * p),
    "pab": pab,
    "rgl": lambda: rgl(vndf=np.ones((4, 4)), values=np.full((4, 4), 0.1)),
    "speos-coated": COATED.encode,
    "speos-scattering": SCATTERING.encode,
    "speos-simple": SIMPLE.encode,
}
"""A file of each format that étendue writes no table in."""
