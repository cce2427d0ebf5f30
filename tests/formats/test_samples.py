"""Real files read as their standards say, with the numbers that the reference gives for them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.errors import ArgumentError
from etendue.formats.head import Head
from etendue.formats.rays import RAY_FORMATS, read_rays, write_rays
from etendue.quantities.report import RayFileWarning

# File: format, rays, unit, sum over the rays as stored, total of the header.
# Numbers of the reference; LightTools' sums are larger than its totals by the number of rays traced.
SAMPLES: dict[str, tuple[str, int, str, float, float | None]] = {
    "Cyl10k.1.tm25ray": ("tm25", 10_000, "lm", 10_000.0, 1.0),
    "Cyl10k.1.ray": ("lighttools-text", 10_000, "lm", 10_000.0, 1.0),
    "ThreeRays_PowerOnly.1.ray": ("lighttools", 3, "W", 0.0093198034, 0.0031066011),
    "ThreeRays_Wavelength.1.ray": ("lighttools", 3, "W", 0.0093198034, 0.0031066011),
    "ThreeRays_Wavelength.1.txt": ("lighttools-text", 3, "W", 0.0093198034, 0.0031066011),
    "ThreeRays_Wavelength_ZMX.ray": ("zemax", 3, "W", 0.0093198034, 0.0031066011),
    "ZemaxText.txt": ("zemax-text", 9, "W", 138.865937, None),
    "ZemaxWavelengthText.txt": ("zemax-text", 9, "W", 138.865937, None),
    "pyspeos_RaysWithoutSpectralData.RAY": ("lighttools", 113, "lm", 113 * 55 / 500_000, 55.0),
    "speos_pyspeos_Rays.ray": ("speos", 45_462, "W", 45_461.25, 4.017657),
    "test_08_dat.DAT": ("zemax", 11, "W", 11.0, 1.0),
    "test_08_dat_flux_type_1.dat": ("zemax", 1, "lm", 0.0015, 1.0),
    "test_08_ray.ray": ("speos", 11, "W", 11.0, 1.0),
    "test_08_ray_reference.sdf": ("zemax", 11, "W", 11.0, 1.0),
}
RELATIVE = ("tm25", "lighttools", "lighttools-text", "speos")


@pytest.fixture(autouse=True)
def _disagreements_are_expected() -> Iterator[None]:
    """Nearly every sample contradicts its header; `test_totals` states by how much."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RayFileWarning)
        yield


def sample(samples: Path, name: str) -> et.RaySet:
    return read_rays(samples / "rays" / name)


def test_every_sample_is_listed(samples: Path) -> None:
    assert {path.name for path in (samples / "rays").iterdir()} == set(SAMPLES)


@pytest.mark.parametrize("name", SAMPLES)
def test_recognised_by_one_format_only(samples: Path, name: str) -> None:
    head = Head.of(samples / "rays" / name)
    first, *others = [f.name for f in RAY_FORMATS if f.recognise(head)]
    assert first == SAMPLES[name][0]
    # A first line that is padded to the width of the rows looks like one more row; bare rows are tried last.
    assert others == (["csv"] if name in ("ZemaxText.txt", "ZemaxWavelengthText.txt") else [])


@pytest.mark.parametrize("name", SAMPLES)
def test_totals(samples: Path, name: str) -> None:
    ray_format, count, unit, stored, stated = SAMPLES[name]
    rays = sample(samples, name)
    assert (rays.provenance.format, len(rays), rays.flux_unit) == (ray_format, count, unit)
    assert rays.tally.flux == pytest.approx(stored, rel=1e-6)
    assert rays.tally.unusable == 0
    assert rays.header.get("total_flux") == (None if stated is None else pytest.approx(stated, rel=1e-6))
    kept = stated if ray_format in RELATIVE else stored
    assert rays.total_flux == pytest.approx(kept, rel=1e-6)
    assert rays.flux.sum() == pytest.approx(kept, rel=1e-6)
    disagreement = any(c.place == "total flux" and "the header says" in c.found for c in rays.complaints)
    assert disagreement == (stated is not None and abs(stated / stored - 1) > 1e-3)


@pytest.mark.parametrize("name", SAMPLES)
def test_directions_are_unit_vectors(samples: Path, name: str) -> None:
    assert sample(samples, name).tally.norm_error < 1.5e-6


def test_cylinder_as_tm25_and_as_text_is_the_same_set(samples: Path) -> None:
    """LightTools 8.7 wrote both: per-ray values N_traced = 10 000 times too large, header in lm."""
    binary, text = sample(samples, "Cyl10k.1.tm25ray"), sample(samples, "Cyl10k.1.ray")
    assert np.allclose(binary.position, text.position, atol=2e-6)
    assert np.allclose(binary.direction, text.direction, atol=2e-7)
    assert np.allclose(binary.flux, text.flux, rtol=1e-6)
    assert binary.header["creator"] == "LightTools 8.7.0"
    assert (binary.header["version"], binary.header["creation_method"]) == (2013, "simulation")
    assert binary.header["luminous_flux"] == 1.0
    assert "radiant_flux" not in binary.header  # the file says 0, which is LightTools' unknown


def focus_by_least_squares(rays: et.RaySet) -> Any:
    """The virtual focus by a second route: the distances themselves, minimised by numpy.linalg.lstsq."""
    weight = np.sqrt(rays.flux)[:, None, None]
    projector = (np.eye(3) - rays.direction[:, :, None] * rays.direction[:, None, :]) * weight
    target = np.einsum("nij,nj->ni", projector, rays.position)
    return np.linalg.lstsq(projector.reshape(-1, 3), target.reshape(-1), rcond=None)[0]


@pytest.mark.parametrize("name", ["Cyl10k.1.tm25ray", "speos_pyspeos_Rays.ray", "pyspeos_RaysWithoutSpectralData.RAY"])
def test_virtual_focus(samples: Path, name: str) -> None:
    rays = sample(samples, name)
    assert rays.virtual_focus.determined
    assert np.allclose(rays.virtual_focus.point, focus_by_least_squares(rays), atol=1e-7)


def test_three_rays_in_four_formats(samples: Path) -> None:
    plain = sample(samples, "ThreeRays_PowerOnly.1.ray")
    waves = sample(samples, "ThreeRays_Wavelength.1.ray")
    text = sample(samples, "ThreeRays_Wavelength.1.txt")
    zemax = sample(samples, "ThreeRays_Wavelength_ZMX.ray")
    assert np.allclose(
        plain.position, [[-0.6668399, -1 / 3, 1e-4], [2 / 3, 0.8334215, 1e-4], [1 / 6, -0.6670539, 1e-4]]
    )
    assert np.allclose(plain.direction[:, 2], [0.5, 0.75, 0.25])
    for other in (waves, text, zemax):
        assert np.allclose(other.position, plain.position, atol=2e-6)
        assert np.allclose(other.direction, plain.direction, atol=2e-6)
        assert np.allclose(other.flux / other.total_flux, plain.flux / plain.total_flux, rtol=1e-6)
        assert other.wavelength is not None
        assert np.allclose(other.wavelength, [550.0, 450.0, 620.0], rtol=1e-6)
    assert plain.wavelength is None
    # N_traced = 3, which only LightTools' own formats know to be a scale.
    assert zemax.total_flux == pytest.approx(3 * plain.total_flux, rel=1e-6)
    assert zemax.meaning.single_wavelength is None  # NaN in the header


def test_truncated_lighttools_file(samples: Path) -> None:
    rays = sample(samples, "pyspeos_RaysWithoutSpectralData.RAY")
    (complaint,) = (c for c in rays.complaints if c.severity == "error")
    assert complaint.place == "byte 3215"
    assert "LTRFEND" in complaint.found
    assert "7 bytes after ray 113" in complaint.found
    assert np.allclose(rays.records["flux"], 55 / 500_000, rtol=1e-6)
    assert np.allclose(rays.position[0], [-0.94830602, -0.97969711, 1.16580296])


def test_speos_file(samples: Path) -> None:
    """Rays on a cylinder of radius 0.4 mm and length 6 mm; wavelengths from 350.6 nm to 850 nm."""
    rays = sample(samples, "speos_pyspeos_Rays.ray")
    assert rays.header["luminous_flux"] == pytest.approx(450.08, abs=0.005)
    assert set(np.unique(rays.records["flux"])) == {0.25, 1.0}
    assert rays.wavelength is not None
    assert rays.wavelength.min() == pytest.approx(350.6, abs=0.05)
    assert rays.wavelength.max() == pytest.approx(850.0, abs=0.05)
    # Watts, wavelengths and lumens of the header agree, through V(λ).
    assert rays.in_unit("lm").total_flux == pytest.approx(450.08, rel=2e-3)


def test_zemax_units(samples: Path) -> None:
    """Unit 4 is mm, unit 2 is cm; wavelengths are micrometres."""
    mm, cm = sample(samples, "ZemaxText.txt"), sample(samples, "ZemaxWavelengthText.txt")
    assert np.allclose(mm.position[0], [-0.118104, -5.434330, 0.0])
    assert np.allclose(cm.position, 10 * mm.position)
    assert np.allclose(mm.flux[:2], [45.576770, 12.103610])
    assert cm.wavelength is not None
    assert cm.wavelength[0] == pytest.approx(510.0)
    assert mm.wavelength is None


def test_hand_made_zemax_and_speos_files(samples: Path) -> None:
    """Eleven parallel rays of 1 at y = -5 mm … 5 mm; the converted file forgot to scale them to 1 W."""
    for name, nm in (("test_08_dat.DAT", 550.0), ("test_08_ray.ray", 550.0), ("test_08_ray_reference.sdf", 550.0)):
        rays = sample(samples, name)
        assert rays.position.tolist() == [[0.0, float(y), 0.0] for y in range(-5, 6)]
        assert rays.direction.tolist() == [[0.0, 0.0, 1.0]] * 11
        assert rays.records["flux"].tolist() == [1.0] * 11
        assert rays.wavelength is not None
        assert np.allclose(rays.wavelength, nm)
        assert not rays.virtual_focus.determined
    one = sample(samples, "test_08_dat_flux_type_1.dat")
    assert one.position.tolist() == [[1.0, 1.0, 1.0]]
    assert one.header["source_flux"] == pytest.approx(0.0015, rel=1e-6)
    assert sample(samples, "test_08_ray.ray").header["luminous_flux"] == pytest.approx(686.415, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("ray_format", [f.name for f in RAY_FORMATS])
@pytest.mark.parametrize("name", ["Cyl10k.1.tm25ray", "ThreeRays_Wavelength.1.ray", "test_08_ray_reference.sdf"])
def test_samples_convert_to_every_format(samples: Path, tmp_path: Path, name: str, ray_format: str) -> None:
    rays = sample(samples, name)
    path = tmp_path / "a"
    if rays.wavelength is None and ray_format in ("speos", "speos-text"):
        with pytest.raises(ArgumentError, match="wavelength"):
            write_rays(path, rays, ray_format)
        return
    write_rays(path, rays, ray_format)
    back = read_rays(path)
    position, direction, flux = rays.position, rays.direction, rays.flux
    if ray_format == "etd":
        # An index puts rays in an order of its own, and keeps their bytes.
        there, here = (np.lexsort(np.column_stack([r.position, r.direction]).T) for r in (rays, back))
        order = np.zeros(len(rays), np.intp)
        order[here] = there
        position, direction, flux = position[order], direction[order], flux[order]
    assert np.allclose(back.position, position, atol=2e-6)
    assert np.allclose(back.direction, direction, atol=2e-7)
    scale = rays.total_flux / back.total_flux if ray_format == "speos-text" else 1.0
    assert np.allclose(back.flux * scale, flux, rtol=1e-6)
    assert math.isfinite(back.total_flux)
