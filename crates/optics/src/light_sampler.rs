//! Sources as they are seen: their luminance along a line, and points on them to connect to.

use etendue_geometry::bounds::Ball;
use etendue_lightfield::carrier::Sights;
use etendue_lightfield::field::{LightField, PartField, SightReader, SightReading};
use etendue_math::Vec3;
use etendue_sampling::alias::Alias;

use crate::source::{Emitter, Numbers, Source};

/// The share of samples that is spread evenly over a light field's surface, whatever shines there: cells are read between
/// their centres, so that light reaches into cells that hold none.
const EVEN: f64 = 0.1;

/// Light that a line meets on a source.
#[derive(Clone, Copy, Debug)]
pub struct SourceHit<'a> {
    /// Distance along the line \[mm\].
    pub t: f64,
    /// Luminance \[flux unit/(mm² sr)\].
    pub luminance: f64,
    /// Its standard deviation, for sources that know one.
    pub deviation: f64,
    /// Cosine of the angle of emission, or what takes its place where the area is seen under another solid angle.
    pub cosine: f64,
    /// See [`SourceHit::density`].
    density: PickDensity<'a>,
}

/// How densely points are picked where a line meets a source.
#[derive(Clone, Copy, Debug)]
enum PickDensity<'a> {
    /// \[1/mm²\].
    Known(f64),
    /// At a place of a part of a light field with such an area \[mm²\].
    At {
        table: &'a PlaceTable,
        place: [f64; 2],
        area: f64,
    },
}

impl SourceHit<'_> {
    /// Density, by area, with which [`LightSampler::pick`] picks this point \[1/mm²\]: of light fields it is looked up only where
    /// it is asked for.
    #[must_use]
    pub fn density(&self) -> f64 {
        match self.density {
            PickDensity::Known(density) => density,
            PickDensity::At { table, place, area } => table.density(place) / area,
        }
    }
}

/// A point of a source that a connection is made to.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// In world coordinates.
    pub point: Vec3,
    /// What of the source's flux the connection carries, if nothing is in between: L cos θ/(density · distance²) for a
    /// surface, I/distance² for a point \[flux unit/mm²\], per unit of area at right angles to it.
    pub irradiance: f64,
    /// The same for its standard deviation.
    pub deviation: f64,
    /// Density of the direction by solid angle \[1/sr\]; ∞ for a point, which no other way can find.
    pub density: f64,
}

/// A source made ready to be looked at.
#[derive(Clone, Debug)]
pub struct LightSampler {
    /// For light fields: from the field's flux to the source's.
    scale: f64,
    /// For light fields: each part's share of the picks and its cells.
    parts: Vec<PlaceTable>,
    /// For surfaces and patches: what lines of sight pass by that do not meet them.
    ball: Option<Ball>,
}

#[derive(Clone, Debug)]
struct PlaceTable {
    /// Of all picks.
    share: f64,
    cells: [usize; 2],
    /// Of the picks of the part.
    shares: Vec<f64>,
    table: Alias,
}

impl LightSampler {
    /// What has to be worked out once; None for rays, which have no luminance, and dark fields.
    #[must_use]
    pub fn new(source: &Source) -> Option<Self> {
        let Emitter::Field(sampler) = &source.emitter else {
            return (!matches!(source.emitter, Emitter::Rays { .. })).then_some(Self {
                scale: 1.0,
                parts: vec![],
                ball: source.ball(),
            });
        };
        let field = sampler.field();
        let fluxes = sampler.fluxes();
        let total: f64 = fluxes.iter().map(|(flux, _)| flux).sum();
        let parts = field.parts.iter().zip(fluxes).map(|(part, (flux, light))| {
            let [n1, n2, ..] = part.cells;
            let sum: f64 = light.iter().sum();
            let even = 1.0 / light.len() as f64;
            let shares: Vec<f64> = light
                .iter()
                .map(|l| {
                    if sum > 0.0 {
                        (1.0 - EVEN) * l / sum + EVEN * even
                    } else {
                        even
                    }
                })
                .collect();
            Some(PlaceTable {
                share: flux / total,
                cells: [n1, n2],
                table: Alias::new(&shares)?,
                shares,
            })
        });
        Some(Self {
            scale: source.flux / total,
            parts: parts.collect::<Option<Vec<_>>>()?,
            ball: None,
        })
    }

    /// Marks the lines of sight on which light of the source may arrive; others keep their marks.
    pub fn mark(&self, source: &Source, sights: Sights<'_>, marks: &mut [bool]) {
        match &source.emitter {
            Emitter::Field(sampler) => {
                for part in &sampler.field().parts {
                    part.part.mark(&source.frame, sights, marks);
                }
            }
            Emitter::Surface(_) | Emitter::Patches(_) => match self.ball {
                Some(ball) => ball.mark(sights.origin, sights.direction, marks),
                None => marks.fill(true),
            },
            Emitter::Rays { .. } | Emitter::Point(_) | Emitter::Beam(_) => {}
        }
    }

    /// Calls `visit` for the light that travels along −`d` to `o` from points of the source at 0 < t ≤ `reach`.
    pub fn along(&self, source: &Source, o: Vec3, d: Vec3, reach: f64, mut visit: impl FnMut(SourceHit<'_>)) {
        let (p, k) = (source.frame.point_to_local(o), source.frame.direction_to_local(d));
        match &source.emitter {
            Emitter::Surface(surface) => {
                let (shape, flipped) = surface.shape();
                shape.crossings(p, k, [0.0, reach], &[], |crossing| {
                    let (_, normal) = shape.settle(p + k * crossing.t, crossing.part);
                    let cosine = if flipped { k.dot(normal) } else { -k.dot(normal) };
                    if crossing.t > 0.0 && cosine > 0.0 {
                        visit(SourceHit {
                            t: crossing.t,
                            luminance: surface.luminance(-k, cosine) * source.flux,
                            deviation: 0.0,
                            cosine,
                            density: PickDensity::Known(1.0 / surface.area()),
                        });
                    }
                });
            }
            Emitter::Field(sampler) => {
                for (part, table) in sampler.field().parts.iter().zip(&self.parts) {
                    let Some((back, cosine)) = part.part.leaves(p, -k) else {
                        continue;
                    };
                    if !(-reach..0.0).contains(&back) {
                        continue;
                    }
                    let crossing = part.part.cross(p, -k);
                    if crossing.met {
                        let seen = SightReading {
                            t: -back,
                            cosine,
                            place: crossing.place,
                            reading: part.at(crossing.place, crossing.direction),
                        };
                        visit(self.hit(part, table, seen));
                    }
                }
            }
            Emitter::Patches(patches) => patches.leaving(p, -k, |light| {
                if light.luminance > 0.0 && light.t < 0.0 && -light.t <= reach {
                    visit(SourceHit {
                        t: -light.t,
                        luminance: light.luminance * source.flux,
                        deviation: 0.0,
                        cosine: light.cosine,
                        density: PickDensity::Known(light.density),
                    });
                }
            }),
            Emitter::Rays { .. } | Emitter::Point(_) | Emitter::Beam(_) => {}
        }
    }

    /// The same for those of many lines of sight that have these numbers, to the same bits; `visit` is told the number of each.
    pub fn along_all(
        &self,
        source: &Source,
        sights: Sights<'_>,
        which: &[u32],
        reader: &mut SightReader,
        mut visit: impl FnMut(usize, SourceHit<'_>),
    ) {
        if let Emitter::Field(sampler) = &source.emitter {
            for (part, table) in sampler.field().parts.iter().zip(&self.parts) {
                reader.read(part, &source.frame, sights, which, |i, seen| {
                    visit(i, self.hit(part, table, seen));
                });
            }
            return;
        }
        for i in which {
            let i = *i as usize;
            let (o, d) = sights.line(i);
            self.along(source, o, d, sights.reach[i], |hit| visit(i, hit));
        }
    }

    /// What is seen of a part of a light field.
    #[inline]
    fn hit<'a>(&self, part: &PartField, table: &'a PlaceTable, seen: SightReading) -> SourceHit<'a> {
        SourceHit {
            t: seen.t,
            luminance: seen.reading.value * self.scale,
            deviation: seen.reading.deviation * self.scale,
            cosine: seen.cosine,
            density: PickDensity::At {
                table,
                place: seen.place,
                area: part.part.area(),
            },
        }
    }

    /// A point of the source to connect `x` to; None if it sends no light there, or cannot be connected to.
    #[must_use]
    pub fn pick(&self, source: &Source, x: Vec3, numbers: &mut Numbers) -> Option<LightSample> {
        let p = source.frame.point_to_local(x);
        match &source.emitter {
            Emitter::Surface(surface) => {
                if surface.turns_away_from(p) {
                    return None;
                }
                let (point, normal) = surface.draw_point(numbers);
                let (distance2, cosine) = towards(point, normal, p)?;
                let luminance = surface.luminance((p - point) * (1.0 / distance2.sqrt()), cosine);
                Some(LightSample {
                    point: source.frame.point_to_world(point),
                    irradiance: source.flux * luminance * cosine * surface.area() / distance2,
                    deviation: 0.0,
                    density: distance2 / (cosine * surface.area()),
                })
            }
            Emitter::Patches(patches) => {
                let (point, light) = patches.pick(p, numbers)?;
                let per_area = light.cosine / (light.t * light.t);
                Some(LightSample {
                    point: source.frame.point_to_world(point),
                    irradiance: source.flux * light.luminance * per_area / light.density,
                    deviation: 0.0,
                    density: light.density / per_area,
                })
            }
            Emitter::Field(sampler) => self.pick_field(sampler.field(), source, p, numbers),
            Emitter::Point(point) => {
                let distance2 = p.dot(p);
                let irradiance = source.flux * point.intensity(p * (1.0 / distance2.sqrt())) / distance2;
                (irradiance > 0.0 && irradiance.is_finite()).then_some(LightSample {
                    point: source.frame.origin,
                    irradiance,
                    deviation: 0.0,
                    density: f64::INFINITY,
                })
            }
            Emitter::Rays { .. } | Emitter::Beam(_) => None,
        }
    }

    fn pick_field(&self, field: &LightField, source: &Source, p: Vec3, numbers: &mut Numbers) -> Option<LightSample> {
        let mut number = numbers.draw();
        let last = self.parts.len() - 1;
        let index = self.parts.iter().position(|table| {
            number -= table.share;
            number < 0.0
        });
        let index = index.unwrap_or(last);
        let (part, table) = (&field.parts[index], &self.parts[index]);
        let cell = table.table.pick(numbers.draw());
        let [n1, n2] = table.cells;
        let place = [
            ((cell / n2) as f64 + numbers.draw()) / n1 as f64,
            ((cell % n2) as f64 + numbers.draw()) / n2 as f64,
        ];
        let (point, cosine) = part.part.seen_from(place, p)?;
        let away = p - point;
        let distance2 = away.dot(away);
        let crossing = part.part.cross(point, away * (1.0 / distance2.sqrt()));
        if !crossing.met {
            return None;
        }
        let reading = part.at(crossing.place, crossing.direction);
        let density = table.density(place) / part.part.area();
        let weight = self.scale * cosine / (distance2 * density);
        Some(LightSample {
            point: source.frame.point_to_world(point),
            irradiance: reading.value * weight,
            deviation: reading.deviation * weight,
            density: density * distance2 / cosine,
        })
    }
}

/// Square of the distance to `p` and cosine of the angle of emission; None behind the surface.
fn towards(point: Vec3, normal: Vec3, p: Vec3) -> Option<(f64, f64)> {
    let away = p - point;
    let distance2 = away.dot(away);
    let cosine = away.dot(normal) / distance2.sqrt();
    (cosine > 0.0 && distance2 > 0.0).then_some((distance2, cosine))
}

impl PlaceTable {
    /// Density of a place by its share of the area, times that of the part.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "places lie in 0..1"
    )]
    fn density(&self, place: [f64; 2]) -> f64 {
        let [n1, n2] = self.cells;
        let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        self.share * self.shares[at(place[0], n1) * n2 + at(place[1], n2)] * (n1 * n2) as f64
    }
}

#[cfg(test)]
mod tests {
    use etendue_geometry::shape::{Flat, Outline, Quadric, Shape, Torus};
    use etendue_math::Frame;
    use etendue_sampling::philox::Stream;

    use super::*;
    use crate::source::surface::{Pattern, SurfaceSource, about};

    #[test]
    fn lines_that_see_a_surface_are_marked_and_most_others_are_not() {
        let quadric = |[r2, z2, z1, z0]: [f64; 4], z: [f64; 2]| {
            let r = [0.0, f64::INFINITY];
            Shape::Quadric(Quadric { r2, z2, z1, z0, z, r })
        };
        let outline = |outline| Shape::Flat(Flat { outline });
        let shapes = [
            outline(Outline::Annulus { inner: 0.0, outer: 2.5 }),
            outline(Outline::Rectangle {
                width: 4.0,
                height: 0.5,
            }),
            quadric([1.0, 1.0, 0.0, -4.0], [-2.0, 2.0]),
            quadric([1.0, 0.0, 0.0, -1.0], [0.0, 3.0]),
            Shape::Torus(Torus { major: 2.0, minor: 0.4 }),
        ];
        let frame = Frame {
            origin: Vec3::new(-3.0, 2.0, 1.0),
            x: Vec3::new(0.0, 0.6, 0.8),
            y: Vec3::new(1.0, 0.0, 0.0),
            z: Vec3::new(0.0, 0.8, -0.6),
        };
        let stream = Stream::new(3, 8);
        let n = 20_000_usize;
        for shape in shapes {
            let surface = SurfaceSource::new(shape.clone(), false, Pattern::CosinePower(1.0)).expect("sound");
            let source = Source {
                emitter: Emitter::Surface(surface),
                frame,
                flux: 2.0,
                spectrum: vec![(555.0, 1.0)],
            };
            let sampler = LightSampler::new(&source).expect("can be seen");
            let (mut origin, mut direction): ([Vec<f64>; 3], [Vec<f64>; 3]) = Default::default();
            for i in 0..n as u64 {
                let [a, b, c, d] = stream.uniforms(i, 0);
                let z = Vec3::new(0.0, 0.0, 1.0);
                let o = frame.origin + about(z, 2.0 * a - 1.0, b) * (20.0 * c);
                let k = about(z, 2.0 * d - 1.0, stream.uniforms(i, 1)[0]);
                for (list, x) in origin.iter_mut().zip([o.x, o.y, o.z]) {
                    list.push(x);
                }
                for (list, x) in direction.iter_mut().zip([k.x, k.y, k.z]) {
                    list.push(x);
                }
            }
            let reach = vec![f64::INFINITY; n];
            let sights = Sights {
                origin: origin.each_ref().map(Vec::as_slice),
                direction: direction.each_ref().map(Vec::as_slice),
                reach: &reach,
            };
            let mut marks = vec![false; n];
            sampler.mark(&source, sights, &mut marks);
            let mut seen = 0;
            for (i, mark) in marks.iter().enumerate() {
                let (o, d) = sights.line(i);
                sampler.along(&source, o, d, reach[i], |_| {
                    seen += 1;
                    assert!(*mark, "{shape:?}: line {i}");
                });
            }
            let marked = marks.iter().filter(|mark| **mark).count();
            assert!(seen > 100 && marked < n / 2, "{shape:?}: {seen} {marked}");
        }
    }
}
