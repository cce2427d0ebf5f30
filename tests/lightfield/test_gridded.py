"""The gridded algorithm of the thesis: every ray in its pixel and bin, every equation as printed, nothing lost unsaid."""

from __future__ import annotations

import dataclasses
import math

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.errors import ArgumentError
from etendue.lightfield.carrier import Box, Cylinder, Disk, Dome, Hemisphere, Plane, Sphere, Surface
from etendue.lightfield.gridded import angular, fitting
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.lightfield.gridded.pixelated import PixelatedSurface
from etendue.quantities.patches import AngularGrid, interpolated
from oracles import gridded as thesis
from oracles.sources import DieUnderDome, PrismaticFilm
from scipy.interpolate import RegularGridInterpolator
from scipy.stats import chi2, kstest, norm

Array = npt.NDArray[np.float64]


def unit(vectors: npt.ArrayLike) -> Array:
    vectors = np.asarray(vectors, dtype=np.float64)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def slanted(n: int, seed: int, spread: float = 1.0) -> tuple[Array, Array, Array]:
    """Rays from the plane z = 0 about (0.3, -0.2), leaning to one side, of unequal flux."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([rng.normal(0.3, 0.6, n), rng.normal(-0.2, 0.4, n), np.zeros(n)])
    direction = unit(rng.normal(size=(n, 3)) * spread + np.array([0.5, -0.3, 0.8]))
    direction[:, 2] = np.abs(direction[:, 2])
    return position, direction, rng.random(n) + 0.1


def from_sphere(n: int, seed: int, radius: float, downwards: bool = False) -> tuple[Array, Array]:
    """Rays that leave a sphere about the origin outwards, all over it and in all directions."""
    rng = np.random.default_rng(seed)
    normal = unit(rng.normal(size=(n, 3)))
    if not downwards:
        normal[:, 2] = np.abs(normal[:, 2])
    direction = unit(normal + unit(rng.normal(size=(n, 3))) * 0.999)
    return radius * normal, direction


# --- how many pixels -------------------------------------------------------------------------------------------------


def test_the_thesis_counts() -> None:
    """368 planar pixels of 0.125 mm on a disk of 1.264 mm; 49, 169 and 961 spherical ones (section 3.3.3)."""
    rng = np.random.default_rng(1)
    r, turn = 1.264 * np.sqrt(1 - rng.random(150_000) ** 3), rng.random(150_000) * 2 * np.pi
    position = np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * r])
    rays = et.RaySet(position, np.tile([0.1, 0.2, 1.0], (len(r), 1)), np.ones(len(r)))
    source = GriddedSource.fit(rays, Disk(radius=1.264), pixel=0.125, threshold=2.0)
    assert len(source.patches) == 368
    assert set(source.patches.shapes) == {"square"}
    for parallels, cells in ((4, 49), (7, 169), (16, 961)):
        x, d = from_sphere(20_000, parallels, 1.264)
        dome = GriddedSource.fit(et.RaySet(x, d, np.ones(len(x))), Hemisphere(radius=1.264), 1.0, 5.0, parallels)
        assert len(dome.patches) == cells
        assert dome.patches.area.sum() == pytest.approx(2 * math.pi * 1.264**2, rel=1e-12)


@pytest.mark.parametrize("pixel", [0.05, 0.125, 0.3, 1.0, 9.0])
def test_without_parallels_cells_are_as_large_as_squares(pixel: float) -> None:
    surface = PixelatedSurface.cut(Hemisphere(radius=1.264), pixel, None)
    n = surface.parallels
    assert n is not None
    area = 2 * math.pi * 1.264**2
    off = {m: abs(area / (2 * m - 1) ** 2 - pixel**2) for m in range(max(1, n - 3), n + 4)}
    assert off[n] == min(off.values())


def test_only_pixels_with_light_are_kept() -> None:
    position = np.array([[0.2, 0.3, 0], [-2.5, 1.2, 0], [-2.4, 1.9, 0], [0.7, -1.5, 0]])
    rays = et.RaySet(position, np.tile([0.0, 0, 1], (4, 1)), [1.0, 2, 3, 0])
    source = GriddedSource.fit(rays, Plane(z=0, width=8, height=6, centre=(0, 0)), pixel=1)
    assert source.patches.centre.tolist() == [[-2.5, 1.5, 0], [0.5, 0.5, 0]]
    assert source.patches.flux.tolist() == [5.0, 1.0]
    assert len(source.surface.pixels) == 1
    assert source.surface.count == 48


# --- pixels and axes -------------------------------------------------------------------------------------------------


def test_spherical_cells_are_those_of_the_oracle() -> None:
    cells = thesis.spherical_cells(5)
    pixels = PixelatedSurface.cut(Hemisphere(radius=2.0, centre=(1, -1, 0.5)), 1.0, 5)
    found = pixels.cells(np.arange(81))
    assert len(cells) == 81
    for i, (top, bottom, left, right) in enumerate(cells):
        area = 4 * (math.cos(top) - math.cos(bottom)) * (right - left)
        assert found.area[i] == pytest.approx(area, rel=1e-12)
        # ∫ normal dA by a midpoint rule
        theta, phi = (low + (np.arange(60) + 0.5) / 60 * (high - low) for low, high in ((top, bottom), (left, right)))
        t, p = np.meshgrid(theta, phi, indexing="ij")
        normals = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
        mean = (normals * np.sin(t)[..., None]).sum(axis=(0, 1)) * 4 * (bottom - top) * (right - left) / 3600
        assert found.projected_area[i] == pytest.approx(np.linalg.norm(mean), rel=1e-3)
        z = unit(mean)
        axes = thesis.sphere_pixel(z) if i else np.eye(3)
        assert np.allclose(found.axes[i], axes, atol=2e-3)
        assert np.allclose(found.centre[i] - [1, -1, 0.5], 2 * mean / area, atol=2e-3)
        # Points of the cell, just within its bounds, are found in it.
        inner = np.array([[0.01, 0.01], [0.99, 0.01], [0.5, 0.5], [0.01, 0.99], [0.99, 0.99]])
        t, p = top + inner[:, 0] * (bottom - top), left + inner[:, 1] * (right - left)
        normals = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
        assert (pixels.owner(np.array([1, -1, 0.5]) + 7 * normals, normals) == i).all()


@pytest.mark.parametrize(
    "surface",
    [
        Disk(radius=2, centre=(1, 2), z=3),
        Box(2, 3, 4, centre=(1, 1, 1)),
        Sphere(radius=2, centre=(1, 0, 0)),
        Cylinder(radius=1.5, bottom=-1, top=3, centre=(0.5, 0)),
        Cylinder(radius=1.5, bottom=-1, top=3, centre=(0.5, 0), axis="x"),
        Cylinder(radius=1.5, bottom=-1, top=3, centre=(0.5, 0), axis="y"),
        Dome(radius=2, z=0.3, centre=(0.2, 0.1), window=1.0),
    ],
)
def test_axes_are_right_handed_and_outlines_fit(surface: Surface) -> None:
    pixels = PixelatedSurface.cut(surface, 0.7, None)
    every = np.arange(pixels.count)
    cells = pixels.cells(every)
    assert np.allclose(np.einsum("nij,nkj->nik", cells.axes, cells.axes), np.eye(3), atol=1e-12)
    assert np.allclose(np.linalg.det(cells.axes), 1.0)
    for outline, centre, axes, area, extent in zip(
        cells.outline, cells.centre, cells.axes, cells.projected_area, cells.extent, strict=True
    ):
        local = (outline - centre) @ axes.T
        assert np.allclose(local[:, 2], 0.0, atol=1e-12)
        x, y = local[:, 0], local[:, 1]
        assert (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2 == pytest.approx(area, rel=1e-9)
        assert np.allclose(np.ptp(local[:, :2], axis=0), extent)
    # What is looked at along its normal is found in its middle, squares beyond the edge of their part too.
    passed = list(pixels.passed(cells.centre + 9 * cells.axes[:, 2], cells.axes[:, 2]))
    part = pixels.part_of(every)
    for i, found in enumerate(passed):
        assert (found[part == i] == every[part == i]).all()
    assert sum(pixelation.count for pixelation in pixels.pixels) == pixels.count


def test_a_cylinder_is_unrolled() -> None:
    surface = PixelatedSurface.cut(Cylinder(radius=2, bottom=1, top=4, centre=(0, 1)), 1.0, None)
    side = surface.pixels[0]
    assert side.count == 13 * 3
    assert [p.SHAPE for p in surface.pixels] == ["cylindrical cell", "square", "square"]
    turn, height = np.meshgrid((np.arange(13) + 0.5) / 13 * 2 * np.pi, [1.5, 2.5, 3.5], indexing="ij")
    outward = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1).reshape(-1, 3)
    point = 2 * outward + np.column_stack([np.zeros(39), np.ones(39), height.ravel()])
    assert surface.owner(point - 0.3 * outward, outward).tolist() == list(range(39))
    axes = surface.cells(np.arange(39)).axes
    assert np.allclose(axes[:, 2], outward)
    assert np.allclose(axes[:, 0], [0, 0, -1])
    lid = surface.owner(np.array([[0.5, 1.5, 2.0], [0.5, 1.5, 2.0]]), np.array([[0.0, 0, 1], [0, 0, -1]]))
    assert surface.part_of(lid).tolist() == [1, 2]


def test_a_ray_of_the_window_belongs_to_it_the_rest_to_the_dome() -> None:
    """Section 3.3.2, with the rays given on the measurement sphere."""
    surface = PixelatedSurface.cut(Dome(radius=1.264, window=1.0), 0.125, 16)
    start = np.array([[0.3, -0.4, 0], [1.1, 0, 0], [0.3, -0.4, 0], [-1.2, 0.1, 0.3], [0, 0, 5.0]])
    direction = unit([[0.2, 0.1, 1], [0, 0, 1], [-0.9, 0.1, 0.2], [-1, 0.1, -0.1], [1, 0, -1]])
    owner = surface.owner(start + 300 * direction, direction)
    assert (surface.part_of(owner[:4])).tolist() == [0, 1, 0, 1]
    assert owner[4] == -1  # comes in from above
    assert surface.cells(owner[:1]).centre[0] == pytest.approx([0.3125, -0.4375, 0], abs=1e-12)


# --- bins and equations ------------------------------------------------------------------------------------------------


def test_the_sequence_is_that_of_the_divisors() -> None:
    assert [(g.theta_step, g.phi_step) for g in angular.SEQUENCE] == thesis.DIVISORS
    assert AngularGrid(30, 90).theta.tolist() == [0, 30, 60, 82.5, 90]
    assert angular.SEQUENCE[-1].bins == 91 * 360


@pytest.mark.parametrize("pair", thesis.DIVISORS)
def test_bins_and_solid_angles(pair: tuple[int, int]) -> None:
    grid = AngularGrid(*pair)
    thetas, phis = thesis.bin_ranges(theta_step=pair[0], phi_step=pair[1])
    assert (len(thetas), len(phis)) == (grid.shape[0] - 1, grid.shape[1])
    omega = [math.radians(pair[1]) * (math.cos(math.radians(a)) - math.cos(math.radians(b))) for a, b in thetas]
    assert np.allclose(angular.solid_angles(grid), omega, rtol=1e-12)
    # Directions beside the edges of the bins, and in the middle.
    k, m, a, b = np.meshgrid(np.arange(len(thetas)), np.arange(len(phis)), [1e-6, 0.5, 1 - 1e-6], [1e-6, 0.5, 1 - 1e-6])
    low, high = np.array(thetas).T
    left, right = np.array(phis).T
    theta, phi = np.radians(low[k] + a * (high - low)[k]), np.radians(left[m] + b * (right - left)[m])
    direction = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    ring, sector = angular.rings_and_sectors(direction.reshape(-1, 3))
    assert np.array_equal(angular.bin_of(grid, ring, sector), (k * len(phis) + m).ravel())


def test_every_number_of_the_algorithm() -> None:
    """Against the oracle, which takes one ray at a time: pixels, steps, errors, tables."""
    position, direction, flux = slanted(160, 4, spread=0.5)
    threshold = 1.5
    source = GriddedSource.fit(
        et.RaySet(position - 3 * direction, direction, flux), Plane(0, 6, 6, (0, 0)), pixel=1.5, threshold=threshold
    )
    expected = thesis.square_pixels(position=position, direction=direction, flux=flux, side=1.5)
    patches = source.patches
    keys = [tuple(np.floor(c[:2] / 1.5).astype(int)) for c in patches.centre]
    assert keys == sorted(expected)
    for i, key in enumerate(keys):
        pixel = expected[key]
        grid = patches.grid(i)
        assert patches.flux[i] == pytest.approx(sum(f for *_, f in pixel.rays), rel=1e-12)
        if grid.bins < 5000:
            assert (grid.theta_step, grid.phi_step) == thesis.chosen_step(pixel, threshold)
            assert patches.error[i] == pytest.approx(
                thesis.flux_error(pixel, theta_step=grid.theta_step, phi_step=grid.phi_step), rel=1e-9
            )
            centres, table = thesis.table(pixel, theta_step=grid.theta_step, phi_step=grid.phi_step)
            assert np.allclose(grid.theta, centres)
            assert np.allclose(patches.table(i), table, rtol=1e-9, atol=0)
    assert len({(t, p) for t, p in zip(patches.theta_step, patches.phi_step, strict=True)}) > 2


def integrated_flux(grid: angular.AngularGrid, table: npt.NDArray[np.float64]) -> float:
    """Step 4f: the flux of a table of intensities by eq. 3.2."""
    mean = (table[:-1] + table[1:]) / 2.0
    return float(np.radians(grid.phi_step) * (mean * -np.diff(np.cos(np.radians(grid.theta)))[:, None]).sum())


def test_the_error_of_every_step() -> None:
    """E does not depend on Δφ, so that only ten of the 21 steps differ, and rings are enough."""
    _, direction, flux = slanted(40, 7, spread=0.4)
    pixel = thesis.Pixel(np.eye(3))
    for d, f in zip(direction, flux, strict=True):
        pixel.add(d, f)
    ring, _ = angular.rings_and_sectors(direction)
    rings = np.bincount(ring, flux, angular.RINGS)
    found = angular.quadrature_errors(rings[None])[0]
    expected = [thesis.flux_error(pixel, theta_step=pair[0], phi_step=pair[1]) for pair in thesis.DIVISORS[:14]]
    assert np.allclose(found[:14], expected, rtol=1e-9)
    assert np.array_equal(found[14:], np.full(7, found[13]))
    for grid in angular.SEQUENCE[:12]:
        table = angular.intensities(grid, np.bincount(
            angular.bin_of(grid, *angular.rings_and_sectors(direction)), flux, grid.bins)[None])  # fmt: skip
        error = abs(integrated_flux(grid, table[0]) / flux.sum() - 1) * 100
        assert error == pytest.approx(found[angular.SEQUENCE.index(grid)], rel=1e-9)


def test_the_first_step_within_the_threshold_is_taken() -> None:
    position, direction, flux = slanted(30_000, 5)
    rays = et.RaySet(position, direction, flux)
    bins = []
    for threshold in (50, 5, 2.1, 0.5, 0.1, 0.021, 0.0):
        source = GriddedSource.fit(rays, Plane(), 0.5, threshold)
        within = source.patches.error <= threshold
        assert (source.patches.bins[~within] == 91 * 360).all()
        bins.append(source.patches.bins.mean())
    assert bins == sorted(bins)
    assert bins[0] < 40
    assert bins[-1] > 10_000


def test_spherical_pixels_against_the_oracle() -> None:
    """Local axes and bins of every spherical pixel (eqs. 3.7, 3.8), with rays below their horizon accounted for."""
    x, d = from_sphere(3000, 3, 1.5)
    flux = np.random.default_rng(5).random(3000) + 0.5
    source = GriddedSource.fit(et.RaySet(x + 50 * d, d, flux), Hemisphere(radius=1.5), 1.0, 40.0, parallels=3)
    cells = thesis.spherical_cells(3)
    theta, phi = np.arccos(x[:, 2] / 1.5), np.arctan2(x[:, 1], x[:, 0]) % (2 * np.pi)
    hidden = 0
    for i, cell in enumerate(cells):
        inside = (cell[0] <= theta) & (theta < cell[1]) & (cell[2] <= phi) & (phi < cell[3])
        axes = source.patches.axes[i]
        assert np.allclose(axes, thesis.sphere_pixel(axes[2]) if i else np.eye(3), atol=1e-9)
        pixel = thesis.Pixel(axes)
        front = inside & (d @ axes[2] > 0)
        hidden += int((inside & ~front).sum())
        for direction, f in zip(d[front], flux[front], strict=True):
            pixel.add(direction, f)
        grid = source.patches.grid(i)
        assert (grid.theta_step, grid.phi_step) == thesis.chosen_step(pixel, 40.0)
        assert np.allclose(
            source.patches.table(i),
            thesis.table(pixel, theta_step=grid.theta_step, phi_step=grid.phi_step)[1],
            rtol=1e-9,
        )
    assert source.account.hidden == hidden > 20
    assert source.account.missed == 0
    assert source.account.hidden_flux + source.total_flux == pytest.approx(flux.sum(), rel=1e-12)


# --- the account -------------------------------------------------------------------------------------------------------


def test_no_ray_is_lost_unsaid() -> None:
    position, direction, flux = slanted(20_000, 6)
    direction[::7] *= -1
    position[3], flux[5], direction[11] = np.nan, -1.0, 0.0
    rays = et.RaySet(position, direction, flux)
    source = GriddedSource.fit(rays, Disk(radius=0.8), pixel=0.2)
    account = source.account
    usable = np.ones(20_000, dtype=bool)
    usable[[3, 5, 11]] = False
    within = usable & (np.hypot(*position[:, :2].T) <= 0.8) & (direction[:, 2] > 0)
    assert (account.rays, account.missed, account.hidden) == (19_997, int((usable & ~within).sum()), 0)
    assert account.missed_flux == pytest.approx(flux[usable & ~within].sum(), rel=1e-12)
    assert source.total_flux == pytest.approx(flux[within].sum(), rel=1e-12)
    on_patches = account.flux - account.missed_flux - account.hidden_flux
    assert on_patches == pytest.approx(source.total_flux, rel=1e-12)
    assert any("never cross" in note and f"{account.missed:,}" in note for note in source.notes)


def test_batches_and_order_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    position, direction, flux = slanted(3000, 8)
    flux = np.round(flux * 1024) / 1024  # sums are exact in any order
    whole = GriddedSource.fit(et.RaySet(position, direction, flux), Plane(0, 9, 9, (0, 0)), 0.5)
    order = np.random.default_rng(2).permutation(3000)
    monkeypatch.setattr(et.RaySet.batches, "__defaults__", (97,))
    seen: list[int] = []
    rays = et.RaySet(position[order], direction[order], flux[order])
    again = GriddedSource.fit(rays, Plane(0, 9, 9, (0, 0)), 0.5, progress=seen.append)
    for name in ("pixel", "flux", "theta_step", "error"):
        assert np.allclose(getattr(whole.patches, name), getattr(again.patches, name), rtol=1e-12)
    assert np.array_equal(whole.patches.values, again.patches.values)
    assert seen == sorted(seen)
    assert seen[-1] == 3000
    assert len(seen) == 2 * math.ceil(3000 / 97)


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        ({"pixel": 0.0}, "above 0"),
        ({"pixel": math.nan}, "above 0"),
        ({"pixel": 1e-5}, "give a larger pixel"),
        ({"pixel": 5e-324}, "give a larger pixel"),
        ({"threshold": -1.0}, "percent"),
        ({"threshold": math.nan}, "percent"),
        ({"parallels": 3}, "has none"),
        ({"surface": Hemisphere(radius=2), "parallels": 0}, "1 or more"),
        ({"surface": Hemisphere(radius=2), "parallels": 10**9}, "larger pixel"),
        ({"surface": Disk(radius=2, z=-1, centre=(500, 500))}, "no light crosses"),
    ],
)
def test_refusals(change: dict[str, object], hint: str) -> None:
    position, direction, flux = slanted(100, 9)
    arguments: dict[str, object] = {"surface": Disk(radius=2), "pixel": 1.0} | change
    with pytest.raises(ArgumentError, match=hint):
        GriddedSource.fit(et.RaySet(position, direction, flux), **arguments)  # type: ignore[arg-type]


def test_rays_without_positions_are_refused() -> None:
    records = np.zeros(10, dtype=[("direction", "<f8", (3,)), ("flux", "<f8")])
    records["direction"][:, 2], records["flux"] = 1, 1
    rays = et.RaySet.from_records(records, et.RaySet([[0, 0, 0]], [[0, 0, 1]], [1]).meaning)
    with pytest.raises(ArgumentError, match="far-field"):
        GriddedSource.fit(rays, Disk(radius=1))


def test_too_much_is_refused_before_memory_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    position, direction, flux = slanted(2000, 9)
    rays = et.RaySet(position, direction, flux)
    monkeypatch.setattr(fitting, "MOST_BINS", 100_000)
    with pytest.raises(ArgumentError, match="higher threshold"):
        GriddedSource.fit(rays, Plane(), 0.5, 0.0)
    monkeypatch.setattr(fitting, "MOST_PATCHES", 10)
    with pytest.raises(ArgumentError, match="more than 10 pixels"):
        GriddedSource.fit(rays, Plane(), 0.1)


# --- reading out ---------------------------------------------------------------------------------------------------------


def by_scipy(source: GriddedSource, i: int, direction: Array) -> Array:
    """I(θ, φ) of patch i by another interpolator."""
    grid, table = source.patches.grid(i), source.patches.table(i)
    wrapped = np.concatenate([table, table[:, :1]], axis=1)
    function = RegularGridInterpolator((grid.theta, np.append(grid.phi, 360.0)), wrapped)
    local = direction @ source.patches.axes[i].T
    theta, phi = np.degrees(np.arccos(local[:, 2])), np.degrees(np.arctan2(local[:, 1], local[:, 0])) % 360
    return np.where(theta <= 90, function((np.minimum(theta, 90), phi)), 0.0)


def test_interpolation_is_bilinear_and_periodic() -> None:
    rng = np.random.default_rng(11)
    for grid in (AngularGrid(30, 90), AngularGrid(18, 72), AngularGrid(1, 15), AngularGrid(9, 40)):
        table = rng.random(grid.shape)
        table[-1] = 0
        theta = np.append(np.degrees(np.arccos(rng.random(400))), [1e-6, 90, 89.9999, 90 - grid.theta_step / 4])
        phi = rng.uniform(-180, 180, len(theta))
        a, b = np.radians(theta), np.radians(phi)
        direction = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=1)
        wrapped = np.concatenate([table, table[:, :1]], axis=1)
        expected = RegularGridInterpolator((grid.theta, np.append(grid.phi, 360.0)), wrapped)((theta, phi % 360))
        found = interpolated(table.ravel(), 0, grid.theta_step, grid.phi_step, direction)
        assert np.allclose(found, expected, atol=1e-9)
    assert (interpolated(table.ravel(), 0, 9, 40, -direction[:400]) == 0).all()


def test_luminance_is_intensity_over_projected_area() -> None:
    position, direction, flux = slanted(40_000, 12)
    rays = et.RaySet(position, direction, flux)
    source = GriddedSource.fit(
        rays, Plane(z=0.0, width=8, height=8, centre=(0, 0)), pixel=0.5, threshold=0.5
    ).as_printed
    rng = np.random.default_rng(1)
    x = np.column_stack([rng.uniform(-4.2, 4.2, (500, 2)), np.zeros(500)])
    d = unit(np.column_stack([rng.normal(size=(500, 2)), rng.uniform(0.01, 1, 500)]))
    found = source.luminance(points=x + 400 * d, directions=3 * d)
    expected = np.zeros(500)
    for i, centre in enumerate(source.patches.centre):
        here = (np.abs(x - centre)[:, :2] <= 0.25).all(axis=1)
        expected[here] = by_scipy(source, i, d[here]) / (0.25 * d[here, 2]) * 1e6
    assert np.allclose(found, expected, rtol=1e-6)
    assert (found > 0).sum() > 50
    assert (found == 0).sum() > 50
    assert not source.luminance(points=x, directions=-d).any()
    assert source.luminance(points=np.zeros((0, 3)), directions=np.zeros((0, 3))).shape == (0,)
    for bad in (np.nan, np.inf):
        with pytest.raises(ArgumentError, match="finite"):
            source.luminance(points=[[bad, 0, 0]], directions=[[0, 0, 1]])
    with pytest.raises(ArgumentError, match="no length"):
        source.luminance(points=[[0, 0, 0]], directions=[[0, 0, 0]])


def test_light_of_the_window_passes_the_dome() -> None:
    """Both parts of a dome are added up, each in its own pixel."""
    source_rays = DieUnderDome(floor=0.2)
    position, direction = source_rays.rays(60_000, seed=3)
    rays = et.RaySet(position, direction, np.full(60_000, source_rays.total_flux / 60_000))
    source = GriddedSource.fit(rays, Dome(radius=1.264, window=0.8), pixel=0.2, threshold=2, parallels=6).as_printed
    x, d = position[:3000] + 20 * direction[:3000], direction[:3000]
    found, expected = source.luminance(points=x, directions=d), np.zeros(3000)
    on_plane = x - (x[:, 2] / d[:, 2])[:, None] * d
    nearest = x - np.einsum("ij,ij->i", x, d)[:, None] * d
    on_dome = nearest + np.sqrt(1.264**2 - np.sum(nearest**2, axis=1))[:, None] * d
    both = 0
    for i in range(len(source.patches)):
        if source.patches.part[i] == 0:
            here = (np.abs(on_plane - source.patches.centre[i])[:, :2] <= 0.1).all(axis=1) & (d[:, 2] > 0)
        else:
            here = source.surface.pixels[1].index(on_dome) == source.patches.pixel[i] - source.surface.offsets[1]
            here &= on_dome[:, 2] >= 0
        cosine = d[here] @ source.patches.axes[i, 2]
        seen = by_scipy(source, i, d[here]) / (source.patches.projected_area[i] * np.where(cosine > 0, cosine, np.inf))
        both += int(((expected[here] > 0) & (seen > 0)).sum())
        expected[here] += seen * 1e6
    assert np.allclose(found, expected, rtol=1e-6)
    assert both > 100


def lambertian_table(source: GriddedSource) -> Array:
    """Tables of cosines in place of those that were found."""
    values = np.zeros_like(source.patches.values)
    for i in range(len(source.patches)):
        grid = source.patches.grid(i)
        cosine = np.cos(np.radians(grid.theta))[:, None] * np.ones(grid.shape[1])
        cosine[-1] = 0
        values[source.patches.start[i] : source.patches.start[i + 1]] = cosine.ravel()
    return values


def with_values(source: GriddedSource, values: Array) -> GriddedSource:
    return dataclasses.replace(source, patches=dataclasses.replace(source.patches, values=values)).as_printed


@pytest.mark.slow
@pytest.mark.parametrize("surface", [Hemisphere(radius=2), Cylinder(radius=2, bottom=0, top=3, ends=False)])
def test_curved_patches_show_what_they_send(surface: Surface) -> None:
    """A surface of equal Lambertian patches looks the same from everywhere, and sends L · (its projected area)."""
    n = 20_000
    x, d = from_sphere(n, 3, 2.0, downwards=False)
    if isinstance(surface, Cylinder):
        x = np.column_stack([2 * unit(x[:, :2]), 3 * np.random.default_rng(1).random(n)])
        d = unit(x * [1, 1, 0] / 2 + 0.5 * unit(np.random.default_rng(2).normal(size=(n, 3))))
    source = GriddedSource.fit(et.RaySet(x, d, np.ones(n)), surface, pixel=0.25, threshold=0.0)
    source = with_values(source, lambertian_table(source) * np.repeat(
        source.patches.projected_area, np.diff(source.patches.start)))  # fmt: skip
    seen = source.luminance(points=x, directions=d) / 1e6
    local = source.patches.local(np.searchsorted(source.patches.pixel, source.surface.owner(x, d)), d)
    clear = local[:, 2] > 0.2
    assert np.allclose(seen[clear], 1.0, atol=2e-4)
    towards = unit([0.6, 0.5, 1.2])
    far = source.intensity(360, 1).in_direction(towards[None])[0]
    if isinstance(surface, Hemisphere):
        projected = math.pi * 4 * (1 + towards[2]) / 2
    else:
        projected = 2 * 2 * 3 * math.sqrt(1 - towards[2] ** 2)
    assert far == pytest.approx(projected, rel=4e-3)


def test_summed_intensity() -> None:
    """Against the sum of the functions in single directions, and the exact flux of the tables."""
    position, direction, flux = slanted(20_000, 14)
    source = GriddedSource.fit(et.RaySet(position, direction, flux), Plane(), pixel=0.5, threshold=5).as_printed
    led = source.intensity(72, 1.25)
    rng = np.random.default_rng(3)
    d = unit(np.column_stack([rng.normal(size=(200, 2)), rng.uniform(0.2, 1.5, 200)]))
    expected = sum(by_scipy(source, i, d) for i in range(len(source.patches)))
    assert np.allclose(led.in_direction(d), expected, rtol=0.02, atol=0.01 * expected.max())
    assert led.flux == pytest.approx(source.table_flux, rel=2e-4)
    assert led.values[:, led.gamma > 91].max() == 0
    assert led.unit == "cd"
    cells = et.intensity_distribution(et.RaySet(position, direction, flux), 72, 1.25)
    assert led.flux == pytest.approx(cells.flux, rel=0.05)
    for arguments in ((0, 5), (4, 0), (4, 7), (4, math.nan)):
        with pytest.raises(ArgumentError):
            source.intensity(*arguments)


@pytest.mark.slow
def test_summed_intensity_of_curved_patches() -> None:
    x, d = from_sphere(20_000, 15, 1.0)
    flux = 1 + 0.5 * d[:, 0]
    source = GriddedSource.fit(et.RaySet(x, d, flux), Hemisphere(radius=1), threshold=5, parallels=5).as_printed
    led = source.intensity(36, 2.5)
    towards = unit([[0.3, 0.5, 0.8], [-0.7, 0.1, -0.2], [0, -0.2, 0.9]])
    expected = sum(by_scipy(source, i, towards) for i in range(len(source.patches)))
    assert np.allclose(led.in_direction(towards), expected, rtol=0.03)
    assert led.flux == pytest.approx(source.table_flux, rel=2e-3)


# --- samples -----------------------------------------------------------------------------------------------------------


def sampled(surface: Surface, n: int = 200_000, **options: float) -> tuple[GriddedSource, et.RaySet]:
    if isinstance(surface, Disk | Plane):
        position, direction, flux = slanted(30_000, 16)
    else:
        position, direction = from_sphere(30_000, 16, 1.0, downwards=not isinstance(surface, Dome | Hemisphere))
        flux = 1.2 + direction[:, 0]
    source = GriddedSource.fit(et.RaySet(position, direction, flux), surface, **options)  # type: ignore[arg-type]
    return source, source.sample(n, seed=5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("surface", "options"),
    [
        (Disk(radius=1.0), {"pixel": 0.5, "threshold": 3.0}),
        (Dome(radius=1.0, window=0.6), {"pixel": 0.4, "threshold": 3.0, "parallels": 4}),
        (Cylinder(radius=0.8, bottom=-0.5, top=0.5), {"pixel": 0.6, "threshold": 3.0}),
    ],
)
def test_sample_and_tables_agree(surface: Surface, options: dict[str, float]) -> None:
    """χ² over the cells between the nodes of all patches, exact from the bilinear function; 1 in 10⁴."""
    source, rays = sampled(surface, **options)
    n, patches = len(rays), source.patches
    assert rays.total_flux == pytest.approx(source.emitted_flux, rel=1e-9)
    # Squares reach over the edge of a round part: what starts there belongs to no part, but to its pixel nevertheless.
    owner = next(iter_pixels(source, rays))
    patch = np.searchsorted(patches.pixel, owner)
    local = patches.local(patch, rays.direction)
    theta, phi = np.degrees(np.arccos(local[:, 2])), np.degrees(np.arctan2(local[:, 1], local[:, 0])) % 360
    statistic, freedom = 0.0, -1
    share = patches.table_flux / source.table_flux
    for i in range(len(patches)):
        grid, mine = patches.grid(i), patch == i
        if n * share[i] < 500:
            continue
        row = np.searchsorted(grid.theta, theta[mine], side="right") - 1
        column = np.floor(phi[mine] / grid.phi_step).astype(int)
        counts = np.bincount(row * grid.shape[1] + column, minlength=(grid.shape[0] - 1) * grid.shape[1])
        expected = cell_flux(grid, patches.table(i)).ravel() / source.table_flux * n
        large = expected > 8
        statistic += ((counts[large] - expected[large]) ** 2 / expected[large]).sum()
        freedom += int(large.sum())
    assert freedom > 100
    assert chi2.sf(statistic, freedom) > 1e-4
    counts = np.bincount(patch, minlength=len(patches))
    assert chi2.sf(((counts - n * share) ** 2 / (n * share))[n * share > 8].sum(), len(patches) - 1) > 1e-4


def iter_pixels(source: GriddedSource, rays: et.RaySet):  # type: ignore[no-untyped-def]
    """The pixel each ray starts on: the part whose surface its start point lies on."""
    owner = np.full(len(rays), -1)
    for offset, pixels in zip(source.surface.offsets, source.surface.pixels, strict=False):
        x, d = pixels.to_local(rays.position, rays.direction)
        point, _ = pixels.crossing(x, d)
        here = (np.linalg.norm(np.where(np.isfinite(point), point, 1e9) - x, axis=1) < 1e-9) & (owner < 0)
        owner[here] = offset + pixels.index(point[here])
    assert (owner >= 0).all()
    yield owner


def cell_flux(grid: AngularGrid, table: Array) -> Array:
    """∫ of the bilinear function over each rectangle between nodes, by Gauss-Legendre points."""
    x, w = np.polynomial.legendre.leggauss(8)
    low, high = np.radians(grid.theta[:-1])[:, None], np.radians(grid.theta[1:])[:, None]
    t = (low + high) / 2 + (high - low) / 2 * x
    up = (t - low) / (high - low)
    weight = w * (high - low) / 2 * np.sin(t)
    mean = (table + np.roll(table, -1, axis=1)) / 2
    rows = (weight * (1 - up)).sum(axis=1)[:, None] * mean[:-1] + (weight * up).sum(axis=1)[:, None] * mean[1:]
    return rows * math.radians(grid.phi_step)


def test_sampled_directions_follow_the_function_within_cells() -> None:
    """PIT of θ over all rays of the largest patch: the distribution function by quadrature; 1 in 10⁴."""
    source, rays = sampled(Disk(radius=1.0), 300_000, pixel=1.0, threshold=40.0)
    patches = source.patches
    i = int(np.argmax(patches.table_flux))
    mine = next(iter_pixels(source, rays)) == patches.pixel[i]
    theta = np.degrees(np.arccos(rays.direction[mine, 2]))
    fine = np.linspace(0, 90, 20_001)
    rows = np.interp(fine, patches.grid(i).theta, patches.table(i).mean(axis=1)) * np.sin(np.radians(fine))
    cumulative = np.concatenate([[0], np.cumsum((rows[1:] + rows[:-1]) / 2)])
    assert mine.sum() > 20_000
    assert kstest(np.interp(theta, fine, cumulative / cumulative[-1]), "uniform").pvalue > 1e-4
    phi = np.degrees(np.arctan2(rays.direction[mine, 1], rays.direction[mine, 0])) % 360
    weights = (patches.table(i) * patches.grid(i).solid_angle).sum(axis=0)
    nodes = np.arange(361.0)
    density = np.interp(nodes, np.append(patches.grid(i).phi, 360), np.append(weights, weights[0]))
    around = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    # Linear between whole degrees is off by less than the test can see.
    assert kstest(np.interp(phi, nodes, around / around[-1]), "uniform").pvalue > 1e-4
    x = rays.position[mine, :2] - patches.centre[i, :2] + 0.5
    for k in (0, 1):
        assert kstest(x[:, k], "uniform").pvalue > 1e-4


def test_points_on_curved_pixels_follow_the_cosine() -> None:
    """Positions given the direction: density ∝ n · d on the cell, tested by the mean of n · d and by the cell itself."""
    surface = PixelatedSurface.cut(Hemisphere(radius=1.0), 1.0, 3)
    rng = np.random.default_rng(8)
    for pixel in (0, 5, 20):
        cell = surface.cells(np.array([pixel]))
        direction = unit(cell.axes[0, 2] + 1.5 * cell.axes[0, 0] + 0.4 * cell.axes[0, 1])
        n = 40_000
        many = np.tile(direction, (n, 1))
        found = surface.points_on(np.full(n, pixel), many, np.tile(cell.axes[0, 2], (n, 1)), rng)
        assert (surface.pixels[0].index(found) == pixel).all()
        top, bottom, left, right = thesis.spherical_cells(3)[pixel]
        c, p = np.meshgrid(
            math.cos(bottom) + (np.arange(400) + 0.5) / 400 * (math.cos(top) - math.cos(bottom)),
            left + (np.arange(400) + 0.5) / 400 * (right - left),
        )
        s = np.sqrt(1 - c * c)
        cosine = np.maximum(np.stack([s * np.cos(p), s * np.sin(p), c], axis=-1) @ direction, 0)
        mean, square = ((cosine ** (k + 1)).sum() / cosine.sum() for k in (1, 2))
        off = (found @ direction).mean() - mean
        assert abs(off) < norm.isf(0.5e-4) * math.sqrt((square - mean**2) / n)


@pytest.mark.slow
def test_a_refit_of_the_sample_agrees() -> None:
    """Fit, draw, fit again on the same bins: fluxes of all patches within the noise, 1 in 10⁴."""
    film = PrismaticFilm(radius=2.0, centre=(0.1, -0.2))
    x, d = film.rays(100_000, seed=2)
    surface = Plane(0, 6, 6, (0, 0))
    source = GriddedSource.fit(et.RaySet(x, d, np.full(len(x), film.total_flux / len(x))), surface, 0.5, 0.5)
    n = 400_000
    again = GriddedSource.fit(source.sample(n, 9), surface, 0.5, 0.5)
    assert again.account.missed == 0
    expected = n * source.patches.table_flux / source.table_flux
    where = np.searchsorted(again.patches.pixel, source.patches.pixel)
    found = again.patches.flux[where] / source.emitted_flux * n
    assert chi2.sf(((found - expected) ** 2 / expected).sum(), len(expected) - 1) > 1e-4


def test_samples_repeat_and_refuse() -> None:
    source, _ = sampled(Disk(radius=1.0), 10, pixel=0.5, threshold=3.0)
    a, b, c = source.sample(1000, 4), source.sample(1000, 4), source.sample(1000, 5)
    assert np.array_equal(a.position, b.position)
    assert not np.array_equal(a.direction, c.direction)
    assert a.total_flux == pytest.approx(c.total_flux)
    assert source.sample(2**18 + 5, 2**64 - 1).position.shape == (2**18 + 5, 3)
    with pytest.raises(ArgumentError, match="sample: n is 0; give a whole number from 1"):
        source.sample(0, 1)
    with pytest.raises(ArgumentError, match="seed"):
        source.sample(5, -1)


def test_watts_stay_watts() -> None:
    position, direction, flux = slanted(3000, 17)
    source = GriddedSource.fit(et.RaySet(position, direction, flux, flux_unit="W"), Plane(), 0.5)
    assert (source.flux_unit, source.intensity().unit, source.sample(10, 1).flux_unit) == ("W", "W/sr", "W")
    assert source.patches.intensity(0).unit == "W/sr"
    assert any(" W" in note for note in source.notes)


def test_the_noise_of_the_mean_luminance_is_that_of_the_rays() -> None:
    """A constant source is found constant: the mean over lines of all pixels within its error, 1 in 10⁴."""
    rng = np.random.default_rng(21)
    n = 200_000
    x = np.column_stack([rng.uniform(-1, 1, n), rng.uniform(-0.5, 0.5, n), np.zeros(n)])
    sine, turn = np.sqrt(rng.random(n)), rng.random(n) * 2 * np.pi
    d = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), np.sqrt(1 - sine**2)])
    source = GriddedSource.fit(et.RaySet(x, d, np.full(n, 2.0 / n)), Plane(0, 2, 1, (0, 0)), 0.5, threshold=1.2)
    assert (source.patches.theta_step == 18).all() or (source.patches.theta_step <= 18).all()
    theta = np.radians(40.0)
    m = 20_000
    start = np.column_stack([rng.uniform(-1, 1, m), rng.uniform(-0.5, 0.5, m), np.zeros(m)])
    turn = rng.random(m) * 2 * np.pi
    towards = np.column_stack([np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.full(m, np.cos(theta))])
    seen = source.luminance(points=start, directions=towards).mean() / (1e6 / np.pi)
    # Bins up to 30° wide flatten the cosine a little; its curvature over Δθ²/8 + Δθ²/24 bounds that.
    step = math.radians(float(source.patches.theta_step.max()))
    rays_behind = n * 2 * math.sin(theta) * math.cos(theta) * step
    assert abs(seen - 1) < norm.isf(0.5e-4) / math.sqrt(rays_behind) + step**2 / 6


@pytest.mark.parametrize(
    "surface",
    [
        Plane(0.2, 3, 2, (0.4, 0)),
        Disk(radius=1.5, centre=(0.2, 0.3)),
        Box(2, 3, 1.5, centre=(0.1, 0.2, 0.3)),
        Sphere(radius=1.8, centre=(0.1, 0, 0)),
        Cylinder(radius=1.5, bottom=-1, top=1.3, centre=(0.5, 0)),
        Cylinder(radius=1.5, bottom=-1, top=1.3, ends=False),
        Cylinder(radius=1.5, bottom=-1, top=1.3, centre=(0.5, 0), axis="x"),
        Cylinder(radius=1.5, bottom=-1, top=1.3, centre=(0.5, 0), axis="y"),
        Dome(radius=2, z=0.3, centre=(0.2, 0.1), window=1.0),
    ],
)
def test_the_compiled_core_deals_rays_to_the_same_parts(surface: Surface) -> None:
    """Two routes to the rule of a surface: this one in numpy, that of the light field in Rust."""
    rng = np.random.default_rng(31)
    position = rng.normal(size=(20_000, 3)) * 1.2
    direction = unit(rng.normal(size=(20_000, 3)))
    direction[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    pixels = PixelatedSurface.cut(surface, 0.3, None)
    owner = pixels.owner(position + 40 * direction, direction)
    found = np.where(owner < 0, -1, pixels.part_of(owner))
    part, _ = _core.cross_parts([part.core() for part in surface.parts()], position, direction)
    assert np.array_equal(found, part)
    assert len(np.unique(found)) == len(surface.parts()) + 1
