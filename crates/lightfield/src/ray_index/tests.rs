//! The index against a pass over all rays: the same rays for every observer, however near, oblique or behind.

use std::ops::ControlFlow;

use etendue_geometry::RaySource;
use etendue_geometry::table::{Float, Layout, RayTable};
use etendue_math::Vec3;

use super::{Bounds, Cells, DRAWN, LEAF, RayIndex, arrange, count, index_sums, leaves, place};
use crate::cone::{Cone, Sums, cone_sums};
use crate::view::View;

fn go(_: u64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Numbers in 0..1 without a pattern (a Weyl sequence mixed by the finaliser of `SplitMix64`).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Rays of a lopsided cloud: four in five head about (0.3, −0.2, 1), the others anywhere; every 97th is unusable, and
/// every 89th starts far away along its own line.
fn cloud(n: usize) -> Vec<u8> {
    let mut numbers = Numbers(7);
    let mut bytes = Vec::new();
    for i in 0..n {
        let spread = if i % 5 == 0 { 30.0 } else { 0.8 };
        let around = |x: f64, numbers: &mut Numbers| x + spread * numbers.between(-1.0, 1.0);
        let k = Vec3::new(
            around(0.3, &mut numbers),
            around(-0.2, &mut numbers),
            around(1.0, &mut numbers),
        )
        .normalized();
        let mut x = Vec3::new(
            numbers.between(-8.0, 5.0),
            numbers.between(-3.0, 4.0),
            numbers.between(-1.0, 2.0),
        );
        if i % 89 == 0 {
            x = x - k * numbers.between(0.0, 1e6);
        }
        let flux = if i % 97 == 0 { -1.0 } else { numbers.between(0.1, 2.0) };
        for value in [x.x, x.y, x.z, k.x, k.y, k.z, flux] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// All parallel: one cell, and no box has an extent in direction.
fn beam(n: usize) -> Vec<u8> {
    let mut numbers = Numbers(3);
    let values = (0..n).flat_map(|_| {
        [
            numbers.between(-4.0, 4.0),
            numbers.between(-4.0, 4.0),
            0.0,
            0.1,
            0.2,
            1.0,
            numbers.next(),
        ]
    });
    values.flat_map(f64::to_le_bytes).collect()
}

struct Built {
    records: Vec<u8>,
    layout: Layout,
    cells: Cells,
    centre: Vec3,
    starts: Vec<u64>,
    bounds: Vec<Bounds>,
}

impl Built {
    fn of(bytes: &[u8], layout: Layout, side: u32, centre: Vec3, threads: usize) -> Self {
        let table = RayTable::new(bytes, layout).expect("whole records");
        let cells = Cells::new(side).expect("a power of two");
        let (counts, tally) = count(&table, cells, threads, go);
        let mut starts = vec![0];
        starts.extend(counts.iter().scan(0, |sum, n| {
            *sum += n;
            Some(*sum)
        }));
        assert_eq!(tally.rays, table.len());
        let rays = usize::try_from(starts[cells.count()]).expect("few rays");
        let mut records = vec![0; rays * layout.stride];
        assert!(place(&table, Some(&table), cells, &starts, &mut records, threads, go));
        let bounds = arrange(&mut records, &layout, cells, &starts, centre, threads, go).expect("they fit");
        Self {
            records,
            layout,
            cells,
            centre,
            starts,
            bounds,
        }
    }

    fn index(&self) -> RayIndex<'_> {
        let rays = RayTable::new(&self.records, self.layout).expect("whole records");
        let bounds = bytemuck::cast_slice(&self.bounds);
        RayIndex::new(rays, self.cells, self.centre, &self.starts, bounds).expect("tables that fit")
    }
}

/// Near and far, face-on, oblique, from behind, from within the cloud; screens in view and tilted; narrow and wide cones.
fn cones() -> Vec<Cone> {
    let mut cones = Vec::new();
    for direction in [
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::new(0.5, -0.3, 0.6),
        Vec3::new(-0.9, 0.2, 0.1),
        Vec3::new(0.2, 0.3, -1.0),
    ] {
        for distance in [0.7, 9.0, 80.0, 5000.0] {
            for (acceptances, size) in [
                (vec![0.1_f64], 6.0),
                (vec![1.5, 8.0], 12.0),
                (vec![30.0], 3.0),
                (vec![90.0], 4.0),
            ] {
                for tilted in [false, true] {
                    let towards = direction.normalized();
                    let normal = if tilted { Vec3::new(0.0, 0.0, 1.0) } else { towards };
                    let right = Vec3::new(0.1, 1.0, 0.05).cross(normal).normalized();
                    let target = Vec3::new(0.5, -0.25, 0.3);
                    cones.push(Cone {
                        view: View {
                            observer: target + towards * distance,
                            target,
                            right,
                            up: normal.cross(right),
                            normal,
                            width: size,
                            height: 0.7 * size,
                            columns: 7,
                            rows: 5,
                        },
                        acceptances: acceptances.iter().map(|a| a.to_radians()).collect(),
                        disk: None,
                    });
                }
            }
        }
    }
    cones
}

fn assert_same(found: &Sums, expected: &Sums) {
    assert_eq!(found.rays, expected.rays);
    for (a, b) in [
        (&found.flux, &expected.flux),
        (&found.flux_squared, &expected.flux_squared),
    ] {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-12 * b));
    }
}

#[test]
fn counts_the_rays_that_a_pass_over_all_of_them_counts() {
    let (bytes, cones) = (cloud(150_000), cones());
    let table = RayTable::new(&bytes, DRAWN).expect("whole records");
    let (expected, _) = cone_sums(&table, &cones, 0, go);
    for (side, centre) in [(8, Vec3::new(0.0, 0.0, 0.0)), (32, Vec3::new(-1.5, 0.5, 40.0))] {
        let built = Built::of(&bytes, DRAWN, side, centre, 0);
        let index = built.index();
        let rays = RayTable::new(&built.records, DRAWN).expect("whole records");
        let (reordered, _) = cone_sums(&rays, &cones, 0, go);
        let found = index_sums(&index, &cones, 2, go);
        let mut seen = 0;
        for (((sums, looked), full), same_order) in found.iter().zip(&expected).zip(&reordered) {
            assert_same(sums, full);
            assert_eq!(
                (&sums.flux, &sums.flux_squared),
                (&same_order.flux, &same_order.flux_squared)
            );
            assert!(*looked >= full.rays.iter().max().copied().unwrap_or(0) && *looked <= rays.len());
            seen += usize::from(full.rays.iter().sum::<u64>() > 0);
        }
        assert!(seen > 80, "only {seen} of {} cones see anything", cones.len());
    }
}

#[test]
fn looks_at_few_rays_where_few_can_be_seen() {
    let bytes = cloud(400_000);
    let built = Built::of(&bytes, DRAWN, 32, Vec3::new(0.0, 0.0, 0.0), 0);
    for distance in [20.0, 5000.0] {
        let mut cone = cones().swap_remove(0);
        cone.view.observer = cone.view.target + cone.view.normal * distance;
        let looked: u64 = built.index().candidates(&cone, 1).iter().map(|r| r.end - r.start).sum();
        assert!(looked > 0 && looked < 30_000, "{looked} of 400 000 at {distance} mm");
    }
}

#[test]
fn a_beam_is_told_apart_by_position_alone() {
    let bytes = beam(100_000);
    let built = Built::of(&bytes, DRAWN, 8, Vec3::new(0.0, 0.0, 0.0), 2);
    let mut cone = cones().swap_remove(0);
    cone.view.observer = cone.view.target + Vec3::new(0.1, 0.2, 1.0) * 200.0;
    cone.view.width = 0.8;
    let table = RayTable::new(&bytes, DRAWN).expect("whole records");
    let (expected, _) = cone_sums(&table, std::slice::from_ref(&cone), 1, go);
    let found = index_sums(&built.index(), &[cone], 1, go);
    assert_same(&found[0].0, &expected[0]);
    assert!(expected[0].rays.iter().sum::<u64>() > 100);
    // The cone's foot on the screen is 0.35 mm wide at 200 mm and cut off at 0.8 mm: some 1 % of 8 × 8 mm, and the leaves
    // around it.
    assert!(found[0].1 < 8_000, "{}", found[0].1);
}

#[test]
fn has_the_same_bytes_for_one_two_and_seven_threads() {
    let bytes = cloud(300_000);
    let build = |threads| Built::of(&bytes, DRAWN, 16, Vec3::new(0.1, 0.2, 0.3), threads);
    let (one, cones) = (build(1), cones());
    let sums = |built: &Built, threads| {
        let found = index_sums(&built.index(), &cones, threads, go);
        let bits = found
            .iter()
            .map(|(sums, looked)| (sums.flux.iter().map(|x| x.to_bits()).collect(), *looked));
        bits.collect::<Vec<(Vec<u64>, u64)>>()
    };
    let first = sums(&one, 1);
    for threads in [2, 7] {
        let other = build(threads);
        assert!(one.records == other.records && one.bounds == other.bounds);
        assert!(first == sums(&other, threads));
    }
}

#[test]
fn keeps_records_byte_by_byte_and_leaves_out_what_cannot_be_used() {
    // Single precision, in inches, with a byte before and two behind: as odd as files come.
    let layout = Layout {
        stride: 31,
        position: Some(1),
        direction: 13,
        flux: 25,
        float: Float::F32,
        colour: None,
        length_scale: 25.4,
    };
    #[allow(clippy::cast_possible_truncation, reason = "single precision is meant")]
    let bytes: Vec<u8> = cloud(9_000)
        .chunks_exact(56)
        .zip((0_u8..=255).cycle())
        .flat_map(|(record, mark)| {
            let values = record.chunks_exact(8).flat_map(|b| {
                let value = f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]);
                (value as f32).to_le_bytes()
            });
            std::iter::once(mark)
                .chain(values)
                .chain([mark, !mark])
                .collect::<Vec<u8>>()
        })
        .collect();
    let built = Built::of(&bytes, layout, 8, Vec3::new(0.0, 0.0, 0.0), 2);
    let flux_at = |record: &[u8]| f32::from_le_bytes([record[25], record[26], record[27], record[28]]);
    let mut before: Vec<&[u8]> = bytes.chunks_exact(31).filter(|r| flux_at(r) >= 0.0).collect();
    let mut after: Vec<&[u8]> = built.records.chunks_exact(31).collect();
    before.sort_unstable();
    after.sort_unstable();
    assert!(before.len() > 8_000 && before == after);
    let table = RayTable::new(&bytes, layout).expect("whole records");
    let (expected, _) = cone_sums(&table, &cones(), 1, go);
    for ((sums, _), full) in index_sums(&built.index(), &cones(), 1, go).iter().zip(&expected) {
        assert_same(sums, full);
    }
}

#[test]
fn refuses_tables_that_do_not_fit() {
    let built = Built::of(&cloud(40_000), DRAWN, 8, Vec3::new(0.0, 0.0, 0.0), 1);
    let rays = RayTable::new(&built.records, DRAWN).expect("whole records");
    let bounds: &[f32] = bytemuck::cast_slice(&built.bounds);
    let open = |starts: &[u64], bounds: &[f32], side| {
        let cells = Cells::new(side).expect("a power of two");
        RayIndex::new(rays, cells, built.centre, starts, bounds).is_some()
    };
    assert!(open(&built.starts, bounds, 8));
    assert!(!open(&built.starts, bounds, 16));
    assert!(!open(&built.starts, &bounds[8..], 8));
    assert!(!open(&built.starts, &bounds[1..], 8));
    let mut falling = built.starts.clone();
    falling[5] = u64::MAX;
    assert!(!open(&falling, bounds, 8));
    assert!(!open(&[], bounds, 8));
    assert_eq!(leaves(&built.starts).sum::<u64>(), built.bounds.len() as u64);
    assert!(built.starts.windows(2).any(|pair| pair[1] - pair[0] > LEAF as u64));
}

#[test]
fn notices_rays_that_changed_between_the_passes() {
    let bytes = cloud(2_000);
    let built = Built::of(&bytes, DRAWN, 8, Vec3::new(0.0, 0.0, 0.0), 1);
    let other = beam(2_000);
    let table = RayTable::new(&other, DRAWN).expect("whole records");
    let mut records = built.records.clone();
    assert!(!place(
        &table,
        Some(&table),
        built.cells,
        &built.starts,
        &mut records,
        1,
        go
    ));
    assert!(!place(
        &table,
        Some(&table),
        built.cells,
        &built.starts[1..],
        &mut records,
        1,
        go
    ));
}

#[test]
fn stops_when_asked() {
    let bytes = cloud(2_000);
    let built = Built::of(&bytes, DRAWN, 8, Vec3::new(0.0, 0.0, 0.0), 1);
    let stop = |_| ControlFlow::Break(());
    let mut records = built.records.clone();
    assert!(arrange(&mut records, &DRAWN, built.cells, &built.starts, built.centre, 1, stop).is_none());
    let cones = cones();
    assert_eq!(index_sums(&built.index(), &cones, 1, stop).len(), 1);
}
