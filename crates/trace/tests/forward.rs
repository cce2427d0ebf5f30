//! The forward trace as a whole: its ledger, its bits, and closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue_geometry::Face;
use etendue_geometry::shape::{Flat, Outline, Quadric, Shape};
use etendue_lightfield::View;
use etendue_math::{Frame, Vec3};
use etendue_optics::bsdf::{Bsdf, Interface, Mixture};
use etendue_optics::medium::{Index, Medium};
use etendue_optics::source::{Emitter, Pattern, Source, SurfaceSource};
use etendue_optics::table::{Curve, Table};
use etendue_sampling::ordered::inside;
use etendue_trace::camera_connection::look_at_events;
use etendue_trace::detector::{Detector, Events, FarFieldNodes, Illuminance, Image, Intensity, Portion};
use etendue_trace::events::{Row, depth, depth_of, ray_of};
use etendue_trace::forward::run::Run;
use etendue_trace::ledger::Loss;
use etendue_trace::scene::{Scene, SceneFace};
use etendue_trace::tallies::TraceSums;
use etendue_trace::work_unit::work_unit;

const ALL_R: [f64; 2] = [0.0, f64::INFINITY];
const ALL_Z: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Somewhere, turned: z points along (0.48, 0.64, 0.6).
fn turned(origin: Vec3) -> Frame {
    Frame {
        origin,
        x: Vec3::new(0.36, 0.48, -0.8),
        y: Vec3::new(-0.8, 0.6, 0.0),
        z: Vec3::new(0.48, 0.64, 0.6),
    }
}

fn straight(z: f64) -> Frame {
    Frame {
        origin: Vec3::new(0.0, 0.0, z),
        x: Vec3::new(1.0, 0.0, 0.0),
        y: Vec3::new(0.0, 1.0, 0.0),
        z: Vec3::new(0.0, 0.0, 1.0),
    }
}

fn disk(radius: f64) -> Shape {
    Shape::Flat(Flat {
        outline: Outline::Annulus {
            inner: 0.0,
            outer: radius,
        },
    })
}

fn sphere(radius: f64, z: [f64; 2]) -> Shape {
    Shape::Quadric(Quadric {
        r2: 1.0,
        z2: 1.0,
        z1: 0.0,
        z0: -radius * radius,
        z,
        r: ALL_R,
    })
}

fn part(shape: Shape, frame: Frame, solid: Option<usize>, finish: usize) -> SceneFace {
    SceneFace {
        face: Face {
            shape,
            frame,
            trims: vec![],
            flipped: false,
        },
        solid,
        finish,
        axis: None,
    }
}

fn medium(n: f64, absorption: f64) -> Medium {
    Medium {
        index: Index::Table(Curve::constant(n)),
        absorption: Curve::constant(absorption),
    }
}

fn scatter([mirrored, refracted, back, through]: [f64; 4]) -> Arc<dyn Bsdf> {
    let tables = |shares: [f64; 2]| shares.map(Table::constant);
    Mixture::of_shares(tables([mirrored, refracted]), tables([back, through])).expect("at most 1")
}

fn lamp(shape: Shape, frame: Frame, flux: f64) -> Source {
    Source {
        emitter: Emitter::Surface(SurfaceSource::new(shape, false, Pattern::CosinePower(1.0)).expect("finite")),
        frame,
        flux,
        spectrum: vec![(500.0, 0.4), (600.0, 1.0)],
    }
}

/// A scene, and what records light in it.
type Setup = (Scene, Vec<Detector>);

fn with_detectors(
    parts: Vec<SceneFace>,
    finishes: Vec<Arc<dyn Bsdf>>,
    media: Vec<Medium>,
    solids: Vec<u32>,
    sources: Vec<Source>,
    detectors: Vec<Detector>,
) -> Result<Setup, String> {
    let standing = detectors.iter().map(|detector| detector.face()).collect();
    Ok((
        Scene::new(parts, finishes, media, solids, sources, standing)?,
        detectors,
    ))
}

fn run((scene, detectors): &Setup, rays: u64, threads: usize) -> TraceSums {
    let run = Run {
        rays,
        seed: 7,
        most_events: 10_000,
        sets: &[],
        stop: None,
        light_samplers: &[],
    };
    inside(threads, || work_unit(scene, detectors, &run, 0..rays.div_ceil(1 << 16)))
}

const VIEW: View = View {
    observer: Vec3::new(3.0, -40.0, 60.0),
    target: Vec3::new(0.0, 0.0, 0.0),
    right: Vec3::new(1.0, 0.0, 0.0),
    up: Vec3::new(0.0, 1.0, 0.0),
    normal: Vec3::new(0.0, 0.0, 1.0),
    width: 20.0,
    height: 20.0,
    columns: 8,
    rows: 8,
};

/// The far field at nodes in equal steps.
fn far_field(planes: u32, steps: u32) -> Detector {
    let gamma = (0..=steps).map(|i| PI * f64::from(i) / f64::from(steps)).collect();
    let row: Vec<f64> = (0..planes)
        .map(|i| 2.0 * PI * f64::from(i) / f64::from(planes))
        .collect();
    Detector::Intensity(Intensity(Arc::new(
        FarFieldNodes::new(gamma, vec![row; steps as usize + 1]).expect("sound"),
    )))
}

/// A ball lens, an open mirror, a wall that scatters and transmits, two lamps; nothing symmetric.
fn mixed(watched: bool) -> Setup {
    let mut detectors = vec![far_field(8, 9)];
    if watched {
        detectors.push(Detector::Image(Image {
            view: VIEW,
            portion: Portion::Whole,
        }));
    }
    mixed_with(detectors)
}

fn mixed_with(detectors: Vec<Detector>) -> Setup {
    with_detectors(
        vec![
            part(sphere(2.0, ALL_Z), turned(Vec3::new(1.0, 0.5, 4.0)), Some(0), 0),
            part(sphere(9.0, [-9.0, -2.0]), turned(Vec3::new(0.0, 1.0, 3.0)), None, 1),
            part(disk(6.0), turned(Vec3::new(-3.0, 0.0, 12.0)), None, 2),
        ],
        vec![
            Arc::new(Interface),
            scatter([0.6, 0.0, 0.3, 0.0]),
            scatter([0.1, 0.2, 0.3, 0.25]),
        ],
        vec![medium(1.0, 0.0), medium(1.6, 0.05)],
        vec![1],
        vec![
            lamp(disk(1.0), straight(0.2), 3.0),
            lamp(sphere(0.4, [-0.1, 0.4]), turned(Vec3::new(2.0, -3.0, 1.0)), 1.7),
        ],
        detectors,
    )
    .expect("sound")
}

#[test]
fn every_ray_has_one_fate_and_the_ledger_closes() {
    let sums = run(&mixed(false), 300_000, 2);
    let [emitted, fates] = sums.ledger.balance();
    assert_eq!((emitted.rays, fates.rays), (300_000, 300_000));
    assert!((emitted.flux() - 4.7).abs() < 1e-12 && (fates.flux() - 4.7).abs() < 1e-12);
    assert!(sums.imbalance < 1e-12);
    assert!(sums.ledger.lost.iter().all(|entry| entry.rays == 0));
    let in_glass = sums.ledger.in_medium[1].flux();
    assert!(in_glass > 0.05 && sums.ledger.on_face[2].flux() > 0.05);
    // What escapes is what the far field holds: shared by its nodes, and once more in the cell of all rays.
    let (all, nodes) = sums.tallies[0].cells.split_last().expect("cells");
    let far: f64 = nodes.iter().map(|cell| cell.sum).sum();
    let escaped = sums.ledger.escaped;
    // Plain sums of 10^5 terms: their rounding.
    assert!((far / escaped.flux() - 1.0).abs() < 1e-11 && (all.sum / escaped.flux() - 1.0).abs() < 1e-11);
    assert_eq!(all.rays, escaped.rays);
}

#[test]
fn one_two_and_seven_threads_give_the_same_bits() {
    let bits = |threads| {
        let sums = run(&mixed(true), 200_000, threads);
        let cells = sums
            .tallies
            .iter()
            .flat_map(|tally| &tally.cells)
            .flat_map(|c| [c.sum.to_bits(), c.squares.to_bits(), c.rays]);
        (sums.ledger, cells.collect::<Vec<u64>>())
    };
    let one = bits(1);
    assert_eq!(one, bits(2));
    assert_eq!(one, bits(7));
}

/// Events of all faces, a number at most, beside a light image.
fn kept(most: usize) -> Setup {
    mixed_with(vec![
        Detector::Image(Image {
            view: VIEW,
            portion: Portion::Whole,
        }),
        Detector::Events(Events { most, faces: None }),
    ])
}

fn rows_of(sums: &TraceSums) -> Vec<Row> {
    sums.events[1].rows().copied().collect()
}

#[test]
fn events_looked_at_later_are_the_light_image() {
    let scene = kept(1 << 24);
    let sums = run(&scene, 200_000, 2);
    let rows = rows_of(&sums);
    assert!(rows.len() > 30_000 && sums.events[1].level() == 0);
    assert!(rows.windows(2).all(|two| ray_of(&two[0]) <= ray_of(&two[1])));
    let flat: Vec<u64> = rows.iter().flatten().copied().collect();
    let brought: Vec<f64> = rows.iter().map(|row| f64::from_bits(row[6])).collect();
    let later = look_at_events(&scene.0, &flat, &brought, &VIEW, None).expect("of this scene");
    let lit = later.iter().filter(|cell| cell.rays > 0).count();
    assert!(lit > 20, "{lit}");
    for (a, b) in later.iter().zip(&sums.tallies[0].cells) {
        assert_eq!(a.rays, b.rays);
        assert!((a.sum - b.sum).abs() <= 1e-12 * b.sum && (a.squares - b.squares).abs() <= 1e-12 * b.squares);
        assert!((a.products - b.products).abs() <= 1e-12 * b.products);
    }
    for threads in [1, 7] {
        assert_eq!(
            inside(threads, || look_at_events(&scene.0, &flat, &brought, &VIEW, None)),
            Some(later.clone())
        );
    }
    // Of a scene with other faces, or with numbers that stand for nothing.
    for (word, value) in [(9, 77), (11, 1), (13, 2 << 48), (6, f64::NAN.to_bits())] {
        let mut other = flat.clone();
        other[word] = value;
        assert_eq!(look_at_events(&scene.0, &other, &brought, &VIEW, None), None);
    }
}

#[test]
fn thinned_events_are_those_of_deep_rays_whatever_the_threads() {
    let all = rows_of(&run(&kept(1 << 24), 200_000, 2));
    for most in [1000, 30_000] {
        let few = run(&kept(most), 200_000, 1);
        let level = few.events[1].level();
        let deep: Vec<Row> = all.iter().filter(|row| depth_of(*row) >= level).copied().collect();
        assert!(level > 1 && few.events[1].count() <= most && few.events[1].count() > most / 8);
        assert_eq!(rows_of(&few), deep);
        for threads in [2, 7] {
            assert_eq!(rows_of(&run(&kept(most), 200_000, threads)), deep);
        }
    }
    // One ray of 2ᵏ has a depth of k or more: binomial, to four standard deviations.
    for k in [1, 3, 6] {
        let n = 100_000.0;
        let share = (0.5_f64).powi(k);
        let found = (0..100_000)
            .filter(|ray| i64::from(depth(7, *ray)) >= i64::from(k))
            .count();
        assert!((found as f64 - n * share).abs() < 4.0 * (n * share).sqrt());
    }
}

#[test]
fn rays_that_bounce_together_go_where_they_go_alone() {
    // A detector of scattered light asks for every scatter by itself; the fates must not depend on it.
    let (alone, together) = (
        run(&mixed(true), 200_000, 2).ledger,
        run(&mixed(false), 200_000, 2).ledger,
    );
    assert_eq!(alone.segments, together.segments);
    assert_eq!(alone.escaped.rays, together.escaped.rays);
    for (a, b) in alone.on_face.iter().zip(&together.on_face) {
        assert_eq!(a.rays, b.rays);
    }
}

#[test]
fn a_sphere_absorbs_what_its_walls_do_not_reflect_and_a_port_lets_out_the_rest() {
    // V6: of the light that first meets the wall, the port of area fraction f lets out ρ f/(1 − ρ (1 − f)).
    let (rho, rim) = (0.9, -1.8);
    let fraction = (2.0 + rim) / 4.0;
    let scene = with_detectors(
        vec![part(sphere(2.0, [rim, 2.0]), turned(Vec3::new(5.0, 1.0, 2.0)), None, 0)],
        vec![scatter([0.0, 0.0, rho, 0.0])],
        vec![medium(1.0, 0.0)],
        vec![],
        // A small lamp that looks away from the port.
        vec![lamp(disk(0.05), turned(Vec3::new(5.2, 1.1, 2.1)), 1.0)],
        vec![],
    )
    .expect("sound");
    let rays = 1_000_000;
    let ledger = run(&scene, rays, 2).ledger;
    let expected = rho * fraction / (1.0 - rho * (1.0 - fraction));
    let z = (ledger.escaped.flux() - expected) / (expected * (1.0 - expected) / rays as f64).sqrt();
    assert!(z.abs() < 4.0, "{} {expected} {z}", ledger.escaped.flux());
}

#[test]
fn an_open_solid_loses_rays_and_says_where() {
    let scene = with_detectors(
        vec![part(sphere(2.0, [-2.0, 1.0]), straight(0.0), Some(0), 0)],
        vec![Arc::new(Interface)],
        vec![medium(1.0, 0.0), medium(1.5, 0.0)],
        vec![1],
        vec![lamp(disk(0.5), straight(-9.0), 1.0)],
        vec![],
    )
    .expect("sound");
    let ledger = run(&scene, 20_000, 1).ledger;
    let lost = ledger.lost[Loss::Contradiction as usize];
    assert!(ledger.lost_at[Loss::Contradiction as usize].is_none() || lost.rays > 0);
    let from_above = with_detectors(
        vec![part(sphere(2.0, [-2.0, 1.0]), straight(0.0), Some(0), 0)],
        vec![Arc::new(Interface)],
        vec![medium(1.0, 0.0), medium(1.5, 0.0)],
        vec![1],
        vec![Source {
            frame: Frame {
                x: Vec3::new(1.0, 0.0, 0.0),
                y: Vec3::new(0.0, -1.0, 0.0),
                z: Vec3::new(0.0, 0.0, -1.0),
                origin: Vec3::new(0.0, 0.0, 9.0),
            },
            ..lamp(disk(0.5), straight(0.0), 1.0)
        }],
        vec![],
    )
    .expect("sound");
    let ledger = run(&from_above, 20_000, 1).ledger;
    assert!(ledger.lost[Loss::Contradiction as usize].rays > 100);
    assert_eq!(ledger.lost_at[Loss::Contradiction as usize], Some(0));
}

#[test]
fn a_lens_cemented_on_a_dome_of_the_same_glass_is_one_body() {
    // Coincident faces: the outer side of the dome is the inner side of a shell. With equal indices nothing is reflected
    // there, and rays reach the far field as from one ball.
    let glass = medium(1.5, 0.0);
    let build = |shell: bool| {
        let mut parts = vec![part(sphere(2.0, ALL_Z), straight(0.0), Some(0), 0)];
        let mut solids = vec![1];
        if shell {
            let mut inner = part(sphere(1.0, ALL_Z), straight(0.0), Some(0), 0);
            inner.face.flipped = true;
            parts.push(inner);
            parts.push(part(sphere(1.0, ALL_Z), straight(0.0), Some(1), 0));
            solids.push(1);
        }
        with_detectors(
            parts,
            vec![Arc::new(Interface)],
            vec![medium(1.0, 0.0), glass.clone()],
            solids,
            vec![lamp(disk(0.3), turned(Vec3::new(0.1, 0.2, 0.3)), 1.0)],
            vec![far_field(4, 6)],
        )
        .expect("sound")
    };
    let rays = 200_000;
    let (one, two) = (run(&build(false), rays, 2), run(&build(true), rays, 2));
    assert!(two.ledger.lost.iter().all(|entry| entry.rays == 0));
    // The largest of 25 nodes' differences over their errors; 1e-4 for all of them together: 4.6.
    let largest = one.tallies[0]
        .cells
        .iter()
        .zip(&two.tallies[0].cells)
        .filter(|(a, b)| a.rays + b.rays > 0)
        .map(|(a, b)| (a.sum - b.sum).abs() / (a.squares + b.squares).sqrt())
        .fold(0.0, f64::max);
    assert!(largest > 0.1 && largest < 4.6, "{largest}");
}

#[test]
fn illuminance_falls_with_the_square_of_the_distance_and_the_cosines() {
    // A small lamp under an oblique plate: E = I cos θ cos θ'/s², I = Φ/π.
    let plate = turned(Vec3::new(20.0, 30.0, 40.0));
    let facing = Frame {
        z: -plate.z,
        x: -plate.x,
        ..plate
    };
    let scene = with_detectors(
        vec![],
        vec![],
        vec![medium(1.0, 0.0)],
        vec![],
        vec![lamp(disk(0.01), straight(0.0), 2.0)],
        vec![Detector::Illuminance(Illuminance {
            frame: facing,
            width: 8.0,
            height: 6.0,
            columns: 4,
            rows: 3,
        })],
    )
    .expect("sound");
    let sums = run(&scene, 3_000_000, 2);
    let (cw, ch) = (2.0, 2.0);
    let mut chi2 = 0.0;
    let (all, cells) = sums.tallies[0].cells.split_last().expect("cells");
    for (index, cell) in (0_u32..).zip(cells) {
        let (row, column) = (f64::from(index / 4), f64::from(index % 4));
        // The midpoint rule on 10 × 10 points of the cell.
        let mut expected = 0.0;
        for i in 0..100 {
            let x = -4.0 + (column + (f64::from(i % 10) + 0.5) / 10.0) * cw;
            let y = 3.0 - (row + (f64::from(i / 10) + 0.5) / 10.0) * ch;
            let p = facing.point_to_world(Vec3::new(x, y, 0.0));
            let s2 = p.dot(p);
            let k = p * (1.0 / s2.sqrt());
            expected += 2.0 / PI * k.z * -k.dot(facing.z) / s2 * cw * ch / 100.0;
        }
        chi2 += (cell.sum - expected).powi(2) / cell.squares;
    }
    // 12 degrees of freedom, 1e-4 point: 39.1.
    assert!(chi2 < 39.1, "{chi2}");
    // A ray that goes straight on meets one cell: what all of them bring is what the cells have.
    assert_eq!(all.rays, cells.iter().map(|cell| cell.rays).sum::<u64>());
    let (sum, squares) = cells
        .iter()
        .fold((0.0, 0.0), |(a, b), cell| (a + cell.sum, b + cell.squares));
    assert!((all.sum / sum - 1.0).abs() < 1e-12 && (all.squares / squares - 1.0).abs() < 1e-12);
}

#[test]
fn a_face_without_its_detector_is_passed_and_changes_nothing() {
    let plate = |at: f64| {
        Detector::Illuminance(Illuminance {
            frame: straight(at),
            width: 30.0,
            height: 30.0,
            columns: 2,
            rows: 2,
        })
    };
    let (scene, detectors) = mixed_with(vec![plate(-20.0), plate(20.0)]);
    let found = run(&(scene.clone(), detectors), 100_000, 2);
    assert!(
        found
            .tallies
            .iter()
            .any(|tally| tally.cells.iter().any(|cell| cell.rays > 0))
    );
    let without = run(&(scene, vec![]), 100_000, 2);
    assert!(without.tallies.is_empty() && without.ledger == found.ledger);
}
