//! What each kind of BSDF says of itself.

use etendue_math::Vec3;

use super::super::contract::{Bsdf, Media};
use super::super::examples::Example;
use super::super::kinds;
use super::cases::{HEIGHTS, MEDIA};
use super::quadrature::direction;

#[test]
fn facts_are_true() {
    let mut some = [false; 6];
    for Example { name, bsdf, .. } in kinds().iter().flatten() {
        let facts = bsdf.facts();
        some[4 + usize::from(bsdf.is_selective())] = true;
        let mut met = [false; 4];
        let mut kept = true;
        for media in &MEDIA {
            for height in HEIGHTS {
                let incident = direction(height, 0.3);
                let shares = bsdf.shares(incident, media);
                for (met, share) in met.iter_mut().zip(shares.in_order()) {
                    *met |= share > 0.0;
                }
                // Total reflection is no matter of the BSDF.
                let constant = facts.constant.unwrap_or_default();
                let total = shares.specular[1] == 0.0 && constant[1] > 0.0;
                kept &= total || shares.in_order() == constant;
                let one = bsdf.evaluate(incident, direction(0.3, 0.1), media);
                let other = bsdf.evaluate(incident, direction(0.9, 0.7), media);
                assert!(!facts.lambertian || one == other, "{name}");
                if !bsdf.is_selective() {
                    let elsewhere = Media {
                        wavelength: media.wavelength + 100.0,
                        ..*media
                    };
                    assert_eq!(
                        shares.in_order(),
                        bsdf.shares(incident, &elsewhere).in_order(),
                        "{name}"
                    );
                    assert_eq!(one, bsdf.evaluate(incident, direction(0.3, 0.1), &elsewhere), "{name}");
                }
            }
        }
        // A mirror of a glass may reflect by total reflection alone.
        let stated = [facts.specular, facts.diffuse].concat();
        assert!(
            (0..4).all(|k| stated[k] == met[k] || (k == 0 && stated[1])),
            "{name}: {stated:?}, {met:?}"
        );
        assert!(facts.constant.is_none() || kept, "{name}");
        for (k, fact) in [
            facts.is_specular(),
            facts.is_diffuse(),
            facts.reciprocal,
            !facts.reciprocal,
        ]
        .into_iter()
        .enumerate()
        {
            some[k] |= fact;
        }
    }
    assert_eq!(some, [true; 6]);
}

/// The largest relative difference between f/n² there and back, and between the refracted shares there and back.
fn irreciprocity(bsdf: &dyn Bsdf) -> f64 {
    let mut worst: f64 = 0.0;
    let difference = |a: f64, b: f64| {
        if a == b {
            0.0
        } else {
            (a - b).abs() / a.abs().max(b.abs())
        }
    };
    for media in &MEDIA {
        let n2 = |d: Vec3| media.seen_from(d)[0].powi(2);
        for (a, b) in HEIGHTS.iter().flat_map(|a| HEIGHTS.iter().map(move |b| (*a, *b))) {
            let (a, b) = (direction(a, 0.1), direction(b, 0.45));
            let [there, back] = [(a, b), (b, a)].map(|(from, to)| bsdf.evaluate(from, to, media) / n2(to));
            worst = worst.max(difference(there, back));
        }
        for height in HEIGHTS.into_iter().filter(|h| h.abs() > 0.01) {
            let towards = direction(height, 0.0);
            let shares = bsdf.shares(towards, media);
            if shares.refraction > 0.0 && shares.specular[1] > 0.0 {
                let there = direction(-shares.refraction.copysign(height), 0.5);
                let back = bsdf.shares(there, media);
                worst = worst.max(difference(shares.specular[1], back.specular[1]));
            }
        }
    }
    worst
}

#[test]
fn light_goes_back_as_it_came_or_the_exception_is_declared() {
    for Example { name, bsdf, .. } in kinds().iter().flatten() {
        let worst = irreciprocity(&**bsdf);
        if bsdf.facts().reciprocal {
            assert!(worst < 1e-9, "{name}: {worst}");
        } else {
            assert!(
                worst > 1e-3,
                "{name} declares an exception that it does not make: {worst}"
            );
        }
    }
}
