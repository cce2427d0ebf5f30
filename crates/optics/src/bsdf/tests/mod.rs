//! What holds for every kind of BSDF, tested for all of them.

use std::f64::consts::PI;
use std::sync::Arc;

use etendue_math::Vec3;
use etendue_sampling::philox::Stream;

use super::contract::{Bsdf, Media};
use super::drawn::{Drawn, Outcome};
use super::examples::{Example, Examples};
use super::interface::Interface;
use super::kinds;
use super::lambertian::Lambertian;
use super::mirror::Mirror;
use super::mixture::Mixture;
use super::rough_coat::RoughCoat;
use crate::chi_squared::{CRITICAL, deviate};
use crate::table::Table;

mod cases;
mod facts;
mod quadrature;

use cases::{HEIGHTS, MEDIA};
use quadrature::{BANDS, SECTORS, cell_of, direction, integrals, projected};

/// Every example with all directions, in all media if these matter for it, else in each with some of them.
fn every(mut check: impl FnMut(&Example, &dyn Bsdf, &Media, Vec3)) {
    let mut count = 0;
    for example in kinds().iter().flatten() {
        for (first, media) in MEDIA.iter().enumerate() {
            let some = |(number, _): &(usize, f64)| example.media || number % MEDIA.len() == first;
            for (number, height) in HEIGHTS.into_iter().enumerate().filter(some) {
                check(example, &*example.bsdf, media, direction(height, 0.137 * number as f64));
                count += 1;
            }
        }
    }
    assert!(count >= 40 * HEIGHTS.len());
}

const DRAWN: u64 = 20_000;

#[test]
fn samples_have_their_shares_and_density() {
    let mut stream = 0;
    every(|Example { name, .. }, bsdf, media, incident| {
        stream += 1;
        let numbers = Stream::new(11, stream);
        let mut expected = integrals(12, |d| bsdf.pdf(incident, d, media));
        let shares = bsdf.shares(incident, media);
        expected.extend([1.0 - shares.total(), shares.specular[0], shares.specular[1]]);
        let others = expected.len() - 3;
        let mut counts = vec![0_u64; expected.len()];
        for i in 0..DRAWN {
            let [a, b, ..] = numbers.uniforms(i, 0);
            let cell = match bsdf.sample(incident, media, [a, b]) {
                Drawn::Absorbed => others,
                Drawn::Mirrored => others + 1,
                Drawn::Refracted(cosine) => {
                    assert!(cosine > 0.0 && cosine == shares.refraction, "{name}");
                    others + 2
                }
                Drawn::Scattered(d) => {
                    assert!((d.length() - 1.0).abs() < 1e-12, "{name}: {d:?}");
                    assert!(
                        bsdf.pdf(incident, d, media) > 0.0,
                        "{name}: drawn where the density is 0, {d:?}"
                    );
                    cell_of(d)
                }
            };
            counts[cell] += 1;
        }
        let expected: Vec<f64> = expected.iter().map(|p| p.max(0.0) * DRAWN as f64).collect();
        let z = deviate(&counts, &expected);
        assert!(z < CRITICAL, "{name}, {media:?}, {incident:?}: {z}");
    });
}

/// Draws for rays together and for each by itself: the same to the bit.
fn assert_drawn_alike(example: &Example, incident: Vec<Vec3>, media: &[Media], stream: &Stream) {
    let Example { name, bsdf, .. } = example;
    let n = incident.len();
    let numbers = [0, 1].map(|k| (0..n).map(|i| stream.uniforms(i as u64, 0)[k]).collect::<Vec<f64>>());
    let numbers = numbers.each_ref().map(|list| &list[..]);
    let mut found = [0, 1, 2].map(|axis| incident.iter().map(|d| [d.x, d.y, d.z][axis]).collect::<Vec<f64>>());
    let (mut expected, mut outcomes) = (found.clone(), vec![Outcome::Absorbed; n]);
    bsdf.sample_many(&mut found, media, numbers, &mut outcomes);
    for (i, incident) in incident.into_iter().enumerate() {
        let alone = bsdf.sample(incident, &media[i], numbers.map(|list| list[i]));
        assert_eq!(outcomes[i], alone.keep(&mut expected, i), "{name}");
        let [found, expected] = [&found, &expected].map(|lists| lists.each_ref().map(|list| list[i]));
        assert!(found == expected || outcomes[i] == Outcome::Absorbed, "{name}");
    }
}

#[test]
fn many_rays_are_drawn_for_as_each_by_itself() {
    // More than are ever worked on together; from both sides, and from either alone.
    let media: Vec<Media> = (0..300).map(|i| MEDIA[i % MEDIA.len()]).collect();
    for example in kinds().iter().flatten() {
        for side in [0.0, 1.0, -1.0] {
            let towards = |i: usize| {
                let height = HEIGHTS[i % HEIGHTS.len()];
                direction(if side == 0.0 { height } else { height.abs() * side }, 0.137 * i as f64)
            };
            assert_drawn_alike(example, (0..300).map(towards).collect(), &media, &Stream::new(41, 0));
        }
    }
}

#[test]
fn many_grazing_rays_are_drawn_for_as_each_by_itself() {
    // Most directions off a lobe that the horizon cuts are drawn again: more rays wait than are worked on together.
    for example in kinds().iter().flatten() {
        let incident = (0..2000).map(|i| direction(0.02, 0.137 * f64::from(i))).collect();
        assert_drawn_alike(example, incident, &vec![MEDIA[0]; 2000], &Stream::new(43, 0));
    }
}

#[test]
fn a_density_that_is_wrong_is_seen() {
    // The test above, with a share of 3 % moved from one side of the normal to the other.
    let bsdf = Lambertian::examples().remove(0);
    let incident = direction(0.5, 0.1);
    let mut expected = integrals(12, |d| bsdf.pdf(incident, d, &MEDIA[0]));
    for (cell, p) in expected.iter_mut().enumerate() {
        *p *= if cell % SECTORS < SECTORS / 2 { 1.06 } else { 0.94 } * DRAWN as f64;
    }
    let numbers = Stream::new(11, 1);
    let mut counts = vec![0; expected.len()];
    for i in 0..DRAWN {
        let [a, b, ..] = numbers.uniforms(i, 0);
        if let Drawn::Scattered(d) = bsdf.sample(incident, &MEDIA[0], [a, b]) {
            counts[cell_of(d)] += 1;
        }
    }
    assert!(deviate(&counts, &expected) > CRITICAL);
}

#[test]
fn the_density_integrates_to_the_shares_and_energy_is_kept() {
    every(|example, bsdf, media, incident| {
        let Example { name, quadrature, .. } = example;
        let shares = bsdf.shares(incident, media);
        let found = [false, true].map(|transmitted| {
            projected(example, incident, transmitted, |d| {
                bsdf.pdf(incident, d, media) / d.z.abs()
            })
        });
        for side in 0..2 {
            assert!(
                (found[side] - shares.diffuse[side]).abs() < *quadrature,
                "{name}, {media:?}, {incident:?}: {found:?} of {shares:?}"
            );
        }
        assert!(
            shares.in_order().iter().all(|share| *share >= 0.0) && shares.total() <= 1.0 + 1e-9,
            "{name}"
        );
    });
}

/// f of the product, and the shares that it scatters.
fn product(bsdf: &dyn Bsdf, incident: Vec3, scattered: Vec3, media: &Media) -> Option<(f64, [f64; 2])> {
    let product = bsdf.parts()?.product;
    let shares = product.arriving(incident, media);
    let transmitted = (incident.z > 0.0) != (scattered.z > 0.0);
    Some((
        shares[usize::from(transmitted)] * product.leaving(scattered, media) / PI,
        shares,
    ))
}

#[test]
fn product_and_rest_are_all() {
    let satin = RoughCoat::new([0.5, 0.3], true, 1.8, Table::constant(0.7)).expect("sound");
    let white = Lambertian::new(Table::constant(0.8), Table::constant(0.1)).expect("sound");
    let mixed: [Arc<dyn Bsdf>; 2] = [Arc::new(satin), Arc::new(white)];
    let [one, other] = [[0.6, 0.0], [0.5, 0.4]].map(|weights| {
        let members = weights.into_iter().zip(mixed.clone()).collect();
        Arc::new(Mixture::new(members).expect("at most 1")) as Arc<dyn Bsdf>
    });
    let (mut taken, mut left, mut uneven) = (0, 0, Vec::new());
    let mixtures = [("a mixture", &one), ("another mixture", &other)];
    let kinds = kinds();
    let examples = kinds.iter().flatten().map(|example| (&*example.name, &example.bsdf));
    for (name, bsdf) in examples.chain(mixtures) {
        let Some(parts) = bsdf.parts() else { continue };
        taken += 1;
        left += usize::from(parts.rest.is_some());
        if !parts.product.is_even() {
            uneven.push(name);
        }
        for media in &MEDIA {
            for [a, b] in HEIGHTS.iter().flat_map(|a| HEIGHTS.map(|b| [*a, b])) {
                let (incident, scattered) = (direction(a, 0.137 + 0.2 * b), direction(b, 0.711 - 0.3 * a));
                let (mut f, mut shares) = product(&**bsdf, incident, scattered, media).expect("has parts");
                if let Some(rest) = parts.rest {
                    f += rest.evaluate(incident, scattered, media);
                    let own = rest.shares(incident, media).diffuse;
                    shares = [shares[0] + own[0], shares[1] + own[1]];
                }
                let whole = bsdf.evaluate(incident, scattered, media);
                assert!((f - whole).abs() <= 1e-12 * (1.0 + whole), "{bsdf:?}: {f} {whole}");
                let expected = bsdf.shares(incident, media).diffuse;
                let off = (0..2).map(|side| (shares[side] - expected[side]).abs());
                assert!(off.fold(0.0, f64::max) < 1e-12, "{bsdf:?}: {shares:?} {expected:?}");
                assert!(!parts.product.is_even() || parts.product.leaving(scattered, media) == 1.0);
            }
        }
    }
    assert!(taken > 12 && left > 5 && uneven.len() > 4, "{taken} {left} {uneven:?}");
    // Of tables as well: of one with several azimuths, of one by wavelength.
    for name in ["tabulated 1", "tabulated 2"] {
        assert!(uneven.contains(&name), "{uneven:?}");
    }
}

#[test]
fn no_more_leaves_than_is_known_beforehand() {
    // Of some it is known closely, of a table as well.
    let mut close = Vec::new();
    for Example { name, bsdf, .. } in kinds().iter().flatten() {
        let most = bsdf.most();
        let mut found = 0.0_f64;
        for (media, k) in MEDIA
            .iter()
            .flat_map(|media| (0..720).map(move |k| (media, f64::from(k))))
        {
            let incident = direction((k * 0.0123).cos(), k * 0.137);
            let total = bsdf.shares(incident, media).total();
            assert!(total <= most + 1e-9, "{name}: {total}, {most}");
            found = found.max(total);
            if most + 1e-9 < 1.0 {
                let drawn = bsdf.sample(incident, media, [most + 1e-9, 0.4]);
                assert_eq!(drawn, Drawn::Absorbed, "{name}");
            }
        }
        if most < 1.0 && found > 0.97 * most {
            close.push(name.clone());
        }
    }
    let kinds = ["lambertian", "mirror", "mixture", "tabulated"];
    assert!(
        kinds.iter().all(|kind| close.iter().any(|name| name.starts_with(kind))),
        "{close:?}"
    );
}

#[test]
fn in_a_furnace_one_sees_what_would_be_absorbed_missing() {
    // Surroundings of luminance n² on both sides. Who looks at a surface sees n² of his side times 1 − what it absorbs of light
    // from his eye, by Kirchhoff's law, which holds where light goes back as it came.
    let mut looked = 0;
    every(|example, bsdf, media, towards| {
        let Example { name, quadrature, .. } = example;
        let n2 = |d: Vec3| media.seen_from(d)[0].powi(2);
        let (seen, shares) = bsdf.seen(towards, media);
        let scattered = [false, true].map(|transmitted| {
            projected(example, towards, transmitted, |k| {
                bsdf.evaluate(k, towards, media) * n2(k)
            })
        });
        let all = seen[0] * n2(towards) + seen[1] * n2(-towards) + scattered.iter().sum::<f64>();
        if bsdf.facts().reciprocal {
            looked += 1;
            assert!(
                (all / n2(towards) - shares.total()).abs() < *quadrature,
                "{name}, {media:?}, {towards:?}: {all}"
            );
        } else {
            assert!(all.is_finite() && all >= 0.0, "{name}");
        }
    });
    assert!(looked > 100);
}

#[test]
fn refracted_radiance_of_an_exception_is_that_of_light_from_there() {
    let part = |a, b| crate::table::Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
    let bsdf = Mirror::new(part(0.0, 0.0), part(0.9, 0.1)).expect("at most 1");
    let media = MEDIA[1];
    // Seen from the air at 40°; the light comes through glass at 25.37°, where the table says 0.9 − 0.8 · θ/1.5.
    let (seen, _) = bsdf.seen(direction(40_f64.to_radians().cos(), 0.2), &media);
    let inside = (40_f64.to_radians().sin() / 1.5).asin();
    assert!((seen[1] - (0.9 - 0.8 * inside / 1.5) / 2.25).abs() < 1e-12);
}

#[test]
fn directions_that_light_may_come_from_are_drawn_with_their_density_and_none_is_left_out() {
    let mut stream = 0;
    every(|example, bsdf, media, scattered| {
        let Example { name, quadrature, .. } = example;
        stream += 1;
        let outward = bsdf.outward(scattered, media);
        let whole = |d: Vec3| {
            let transmitted = (d.z > 0.0) != (scattered.z > 0.0);
            let chance = outward.chances[usize::from(transmitted)];
            if chance > 0.0 {
                let (f, density, about) = bsdf.drawn_light(d, &outward, media);
                assert_eq!((f, about), bsdf.incoming_light(d, &outward, media), "{name}");
                assert!(
                    (density > 0.0) == (about > 0.0) && about.is_finite(),
                    "{name}: {density}, {about}"
                );
                density
            } else {
                0.0
            }
        };
        let expected = integrals(12, whole);
        for (side, chance) in outward
            .chances
            .into_iter()
            .enumerate()
            .filter(|(_, chance)| *chance > 0.0)
        {
            let front = (scattered.z > 0.0) == (side == 0);
            let half = if front {
                0..BANDS * SECTORS
            } else {
                BANDS * SECTORS..2 * BANDS * SECTORS
            };
            let sum = projected(example, scattered, side == 1, |d| whole(d) / d.z.abs());
            assert!((sum - 1.0).abs() < *quadrature && chance.is_finite(), "{name}: {sum}");
            let numbers = Stream::new(12, stream);
            let mut counts = vec![0; BANDS * SECTORS];
            for i in 0..DRAWN {
                let [a, b, ..] = numbers.uniforms(i, 0);
                let d = bsdf.draw_incoming(&outward, side == 1, media, [a, b]);
                assert!(
                    (d.length() - 1.0).abs() < 1e-12 && (d.z > 0.0) == front,
                    "{name}: {d:?}"
                );
                counts[cell_of(d) - half.start] += 1;
            }
            let expected: Vec<f64> = expected[half].iter().map(|p| p * DRAWN as f64).collect();
            let z = deviate(&counts, &expected);
            assert!(z < CRITICAL, "{name}, {media:?}, {scattered:?}: {z}");
        }
        for height in HEIGHTS {
            let k = direction(height, 0.6);
            assert!(
                bsdf.evaluate(k, scattered, media) == 0.0 || whole(k) > 0.0,
                "{name}, {k:?} is left out"
            );
        }
    });
}

#[test]
fn at_grazing_incidence_everything_is_finite_and_on_its_side() {
    for Example { name, bsdf, .. } in kinds().iter().flatten() {
        for media in &MEDIA {
            for height in [1e-3, 1e-9, 1e-15, f64::MIN_POSITIVE].into_iter().flat_map(|h| [h, -h]) {
                let incident = direction(height, 0.2);
                let shares = bsdf.shares(incident, media);
                assert!(
                    shares.in_order().iter().all(|s| s.is_finite() && *s >= 0.0),
                    "{name}: {shares:?}"
                );
                assert!(
                    shares.total() <= 1.0 + 1e-9 && (0.0..=1.0).contains(&shares.refraction),
                    "{name}: {shares:?}"
                );
                assert!(bsdf.seen(incident, media).0.iter().all(|s| s.is_finite()), "{name}");
                for side in [false, true] {
                    if shares.diffuse[usize::from(side)] > 0.0 {
                        for numbers in [[0.0, 0.0], [0.5, 0.9], [1.0 - f64::EPSILON / 2.0, 0.3]] {
                            let d = bsdf.draw(incident, side, media, numbers);
                            assert!((d.z > 0.0) == ((incident.z > 0.0) != side), "{name}: {d:?}");
                            let f = bsdf.evaluate(incident, d, media);
                            assert!(f.is_finite() && f > 0.0, "{name}: {f}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_mixture_that_sends_out_more_than_it_gets_is_refused() {
    let table = |a: f64, b: f64| crate::table::Table::new(vec![0.0, 1.5], vec![500.0], vec![a, b]).expect("sound");
    let zero = || crate::table::Table::constant(0.0);
    let mirror = |a, b| Arc::new(Mirror::new(table(a, b), zero()).expect("at most 1")) as Arc<dyn Bsdf>;
    let diffuse = |a, b| Arc::new(Lambertian::new(table(a, b), zero()).expect("at most 1")) as Arc<dyn Bsdf>;
    assert!(Mixture::new(vec![(1.0, mirror(0.1, 0.6)), (1.0, diffuse(0.9, 0.4))]).is_some());
    assert!(Mixture::new(vec![(1.0, mirror(0.1, 0.6)), (1.0, diffuse(0.9, 0.41))]).is_none());
    assert!(Mixture::new(vec![(-0.1, mirror(0.1, 0.6))]).is_none());
    assert!(Mixture::new(vec![(0.5, Arc::new(Interface)), (0.6, diffuse(0.9, 0.9))]).is_none());
    assert!(Mixture::new(vec![(0.5, Arc::new(Interface)), (0.5, diffuse(1.0, 1.0))]).is_some());
}
