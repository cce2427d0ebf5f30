//! Which source gives out which ray of a run, and which rays of a run are copies of one another.
//!
//! A set of n rays that has to give out more than n of them gives out each several times, and sources may share a set. Copies
//! of one ray are not independent of each other: the light field that a set is a sample of is known no better by them. What
//! is independent is called a *unit* here: a ray of its own, or a ray of a set with all its copies. Units of one *stratum*
//! were drawn alike: stratum 0 has what sources draw; each set of rays beside other sources, and each with copies, is a stratum
//! of its own, those with copies at the end.

use std::ops::Range;

use etendue_geometry::RaySource;
use etendue_optics::source::Emitter;
use etendue_sampling::ordered::BATCH;

use crate::records::Contribution;
use crate::scene::Scene;

/// More rays than a run has: longer sets are never given out twice by one source.
const LONGEST: u64 = 1 << 50;

/// The rays of a run, dealt to its sources.
#[derive(Clone, Debug)]
pub struct Dealing {
    /// Of the whole run.
    rays: u64,
    /// Of a batch.
    each: u64,
    /// Of the sources.
    fluxes: Vec<f64>,
    /// Sums of the sources' shares of the flux.
    shares: Vec<f64>,
    /// Rays of each source in the whole run.
    counts: Vec<u64>,
    /// The stratum of each source.
    stratum: Vec<usize>,
    /// Number of strata without copies.
    plain: usize,
    /// For each stratum its first unit; at the end, the first number that is none. Rays of their own are their own units.
    units: Vec<u64>,
}

impl Dealing {
    /// A run of `rays` rays of sources with these fluxes and, of those that give out rays of a set, its number and length.
    #[must_use]
    pub fn new(fluxes: &[f64], sets: &[Option<(usize, u64)>], rays: u64) -> Self {
        let total: f64 = fluxes.iter().sum();
        let mut sum = 0.0;
        let mut shares = vec![0.0];
        for flux in fluxes {
            sum += flux;
            shares.push(sum / total);
        }
        let mut dealing = Self {
            rays,
            each: BATCH,
            fluxes: fluxes.to_vec(),
            shares,
            counts: Vec::new(),
            stratum: vec![0; fluxes.len()],
            plain: 1,
            units: vec![0, rays],
        };
        dealing.counts = dealing.edges(rays).windows(2).map(|pair| pair[1] - pair[0]).collect();
        // Those without copies first.
        let is_of_several = |number| sets.iter().flatten().filter(|other| other.0 == number).count() > 1;
        for with_copies in [false, true] {
            let mut strata: Vec<(usize, usize)> = Vec::new();
            for (source, set) in sets.iter().enumerate() {
                let Some((number, length)) = *set else { continue };
                let has_copies = is_of_several(number) || dealing.counts[source] > length;
                let alone = sets.len() == 1 && !has_copies;
                if has_copies != with_copies || alone || !(1..LONGEST).contains(&length) {
                    continue;
                }
                let known = strata.iter().find(|other| other.0 == number);
                let stratum = known.map_or(dealing.strata(), |known| known.1);
                if stratum == dealing.strata() {
                    strata.push((number, stratum));
                    dealing.units.push(dealing.units[stratum] + length);
                }
                dealing.stratum[source] = stratum;
            }
            if !with_copies {
                dealing.plain = dealing.strata();
            }
        }
        dealing
    }

    /// A run of `rays` rays of a scene.
    #[must_use]
    pub fn of(scene: &Scene, rays: u64, sets: &[&dyn RaySource]) -> Self {
        let fluxes: Vec<f64> = scene.sources.iter().map(|source| source.flux).collect();
        let set = |emitter: &Emitter| match emitter {
            Emitter::Rays { set, .. } => Some((*set, sets[*set].len())),
            _ => None,
        };
        let sets: Vec<_> = scene.sources.iter().map(|source| set(&source.emitter)).collect();
        Self::new(&fluxes, &sets, rays)
    }

    /// The same in batches of another size, for work that needs fewer rays.
    #[must_use]
    pub fn in_batches_of(self, each: u64) -> Self {
        Self { each, ..self }
    }

    /// The number of the first ray of a batch.
    #[must_use]
    pub const fn first(&self, batch: u64) -> u64 {
        batch * self.each
    }

    /// Number of sources.
    #[must_use]
    pub const fn sources(&self) -> usize {
        self.counts.len()
    }

    /// Number of strata.
    #[must_use]
    pub const fn strata(&self) -> usize {
        self.units.len() - 1
    }

    /// Rays of a source in the whole run.
    #[must_use]
    pub fn count(&self, source: usize) -> u64 {
        self.counts[source]
    }

    /// Number of strata without copies, which are the first ones.
    #[must_use]
    pub const fn plain(&self) -> usize {
        self.plain
    }

    /// The stratum of a source's rays.
    #[must_use]
    pub fn stratum_of(&self, source: usize) -> usize {
        self.stratum[source]
    }

    /// Rays of the first s sources among the first `done` rays.
    fn edges(&self, done: u64) -> Vec<u64> {
        let mut edges = vec![0; self.shares.len()];
        self.split(0, self.shares.len() - 1, done, &mut edges);
        edges
    }

    /// Rays dealt to the sources `from..to`: the first half of them takes its share, rounded down, and the others the rest.
    ///
    /// With one ray more, one half has one more and the other as many, so that no source ever has fewer, however faint it is:
    /// of differences of rounded sums, ⌊n `Q_s`⌋ − ⌊n `Q_{s−1}`⌋, that is not so.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of `rays`"
    )]
    fn split(&self, from: usize, to: usize, rays: u64, edges: &mut [u64]) {
        edges[to] = edges[from] + rays;
        if to - from < 2 {
            return;
        }
        let middle = usize::midpoint(from, to);
        let share = (self.shares[middle] - self.shares[from]) / (self.shares[to] - self.shares[from]);
        let first = (share * rays as f64).floor() as u64;
        self.split(from, middle, first, edges);
        self.split(middle, to, rays - first, edges);
    }

    /// Rays of each source among the first `done` rays.
    fn dealt(&self, done: u64) -> impl Iterator<Item = u64> {
        let edges = self.edges(done);
        (1..edges.len()).map(move |s| edges[s] - edges[s - 1])
    }

    /// The rays of each source in batch `batch`, counted among those of the source.
    ///
    /// Every beginning of a run serves all sources in proportion, and each number is known without counting.
    #[must_use]
    pub fn batch(&self, batch: u64) -> Vec<Range<u64>> {
        let (from, to) = (self.first(batch), self.first(batch + 1));
        let from = self.dealt(from.min(self.rays));
        from.zip(self.dealt(to.min(self.rays)))
            .map(|(from, to)| from..to)
            .collect()
    }

    /// The unit of ray `i` of a source that has a stratum of its own.
    #[allow(clippy::cast_possible_truncation, reason = "a quotient below the set's length")]
    fn unit(&self, source: usize, i: u64) -> u64 {
        let first = self.units[self.stratum[source]];
        if self.stratum[source] < self.plain {
            return first + i;
        }
        let length = self.units[self.stratum[source] + 1] - first;
        first + (u128::from(i) * u128::from(length) / u128::from(self.counts[source])) as u64
    }

    /// Rays of a source that gives out a set with copies which are that unit.
    #[allow(clippy::cast_possible_truncation, reason = "a source has no more rays than the run")]
    fn copies(&self, source: usize, unit: u64) -> u64 {
        let first = self.units[self.stratum[source]];
        let length = u128::from(self.units[self.stratum[source] + 1] - first);
        let before = |unit: u64| (u128::from(unit) * u128::from(self.counts[source])).div_ceil(length);
        (before(unit - first + 1) - before(unit - first)) as u64
    }

    /// What a unit brings in the whole run, of which a ray of that source has this flux: a source's rays carry its share of
    /// what the set says of them.
    fn whole(&self, source: usize, unit: u64, flux: f64) -> f64 {
        if self.stratum[source] < self.plain {
            return flux;
        }
        let each = |source: usize| self.fluxes[source] / self.counts[source] as f64;
        let own = each(source);
        let sharing = (0..self.sources()).filter(|s| self.stratum[*s] == self.stratum[source] && self.counts[*s] > 0);
        let part = |s: usize| self.copies(s, unit) as f64 * if s == source { 1.0 } else { each(s) / own };
        flux * sharing.map(part).sum::<f64>()
    }

    /// Of the rays of a batch, by their numbers in the run: the source and the unit of those outside stratum 0.
    fn unit_of(&self, batch: u64) -> impl Fn(u64) -> Option<(usize, u64)> {
        let ranges = self.batch(batch);
        let mut firsts = vec![self.first(batch)];
        firsts.extend(ranges.iter().scan(self.first(batch), |first, range| {
            *first += range.end - range.start;
            Some(*first)
        }));
        move |ray| {
            let source = firsts.partition_point(|first| *first <= ray) - 1;
            let apart = self.stratum.get(source).is_some_and(|stratum| *stratum > 0);
            apart.then(|| (source, self.unit(source, ranges[source].start + (ray - firsts[source]))))
        }
    }

    /// Of rays of one batch, by their numbers in the run: their units, and what these bring in the whole run over the flux of
    /// the ray.
    pub fn units(&self, batch: u64, rays: impl Iterator<Item = u64>) -> Vec<(u64, f64)> {
        let unit_of = self.unit_of(batch);
        let of = |ray| unit_of(ray).map_or((ray, 1.0), |(source, unit)| (unit, self.whole(source, unit, 1.0)));
        rays.map(of).collect()
    }

    /// The contributions of rays of one batch as those of units.
    pub fn by_units<'a>(&self, batch: u64, contributions: impl Iterator<Item = &'a mut Contribution>) {
        if self.strata() > 1 {
            let unit_of = self.unit_of(batch);
            for of_ray in contributions {
                if let Some((source, unit)) = unit_of(of_ray.unit) {
                    of_ray.unit = unit;
                    of_ray.flux = self.whole(source, unit, of_ray.flux);
                }
            }
        }
    }

    /// The stratum of a unit.
    #[inline]
    #[must_use]
    pub fn stratum(&self, unit: u64) -> usize {
        if unit < self.rays {
            return 0;
        }
        self.units.partition_point(|first| *first <= unit) - 1
    }

    /// For each stratum the first unit of which rays may come after `done` rays.
    #[must_use]
    pub fn ahead(&self, done: u64) -> Vec<u64> {
        let mut ahead = self.units[1..].to_vec();
        ahead[..self.plain].fill(0);
        for (source, dealt) in self.dealt(done).enumerate() {
            if self.stratum[source] >= self.plain && dealt < self.counts[source] {
                let next = self.unit(source, dealt);
                let least = &mut ahead[self.stratum[source]];
                *least = (*least).min(next);
            }
        }
        ahead
    }

    /// For each stratum how many units there are among the first `done` rays. Sources that go through parts of one set are
    /// taken to meet different rays of it, unless they are as long as each other.
    #[must_use]
    pub fn done(&self, done: u64) -> Vec<u64> {
        let mut found = vec![0; self.strata()];
        let mut parts: Vec<(usize, u64, u64)> = Vec::new();
        for (source, dealt) in self.dealt(done).enumerate() {
            let stratum = self.stratum[source];
            if stratum < self.plain {
                found[stratum] += dealt;
            } else if dealt > 0 {
                let length = self.units[stratum + 1] - self.units[stratum];
                let met = if self.counts[source] > length {
                    self.unit(source, dealt - 1) - self.units[stratum] + 1
                } else {
                    dealt
                };
                parts.push((stratum, self.counts[source].min(length), met));
            }
        }
        parts.sort_unstable();
        for same in parts.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (stratum, _, met) = same[same.len() - 1];
            let length = self.units[stratum + 1] - self.units[stratum];
            found[stratum] = (found[stratum] + met).min(length);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// A lamp of its own, a set of 1000 rays given out many times, one of 10⁶ given out in part, one that two sources share.
    fn dealing() -> Dealing {
        let sets = [None, Some((0, 1000)), Some((1, 1_000_000)), Some((2, 7)), Some((2, 7))];
        Dealing::new(&[0.3, 1.7, 0.25, 0.05, 0.11], &sets, 5 * BATCH + 1234)
    }

    #[test]
    fn sets_with_copies_are_strata_of_their_own() {
        let dealing = dealing();
        assert_eq!(dealing.stratum, [0, 2, 1, 3, 3]);
        assert_eq!((dealing.plain(), dealing.strata()), (2, 4));
        assert_eq!(
            dealing.done(dealing.rays),
            [dealing.count(0), dealing.count(2), 1000, 7]
        );
        assert_eq!(Dealing::new(&[1.0], &[Some((0, 1000))], 1000).strata(), 1);
        assert_eq!(Dealing::new(&[1.0], &[Some((0, 1000))], 1001).strata(), 2);
    }

    #[test]
    fn every_ray_has_one_unit_and_none_comes_back_that_is_passed() {
        let dealing = dealing();
        let (mut met, mut all) = (BTreeSet::new(), 0);
        for batch in 0..6 {
            let (from, to) = (batch * BATCH, ((batch + 1) * BATCH).min(dealing.rays));
            let units: Vec<u64> = dealing.units(batch, from..to).iter().map(|of| of.0).collect();
            let ahead = dealing.ahead(from);
            all += units.len() as u64;
            assert!(units.iter().all(|u| *u >= ahead[dealing.stratum(*u)]));
            met.extend(units.iter().filter(|u| dealing.stratum(**u) > 0).copied());
            let found = |stratum| met.iter().filter(|u| dealing.stratum(**u) == stratum).count() as u64;
            assert_eq!(dealing.done(to)[1..], [1, 2, 3].map(found));
            // What is still open was given out already.
            let ahead = dealing.ahead(to);
            assert!((2..4).all(|s| to == dealing.rays || met.contains(&ahead[s]) || met.contains(&(ahead[s] - 1))));
        }
        assert_eq!(all, dealing.rays);
        assert_eq!(met.len() as u64, 1007 + dealing.count(2));
    }

    #[test]
    fn faint_sources_give_out_each_ray_once_and_in_proportion() {
        let fluxes = [1e3, 2e-3, 2e-3, 3e-10, 2e-3, 2e-3, 0.01, 1e3, 5e-4];
        for each in [BATCH, 100] {
            let rays = 40 * each + 77;
            let dealing = Dealing::new(&fluxes, &[None; 9], rays).in_batches_of(each);
            let mut next = vec![0; fluxes.len()];
            for batch in 0..=40 {
                let ranges = dealing.batch(batch);
                let dealt: u64 = ranges.iter().map(|range| range.end - range.start).sum();
                assert_eq!(dealt, dealing.first(batch + 1).min(rays) - dealing.first(batch));
                for (range, next) in ranges.iter().zip(&mut next) {
                    assert!(
                        range.start == *next && range.end >= range.start,
                        "{range:?} after {next}"
                    );
                    *next = range.end;
                }
            }
            assert_eq!(next, dealing.counts);
            let total: f64 = fluxes.iter().sum();
            for (count, flux) in dealing.counts.iter().zip(fluxes) {
                assert!((*count as f64 - rays as f64 * flux / total).abs() < 4.0);
            }
        }
    }

    #[test]
    fn sources_that_share_a_set_meet_the_same_rays_of_it() {
        let dealing = Dealing::new(&[1.0, 1.0], &[Some((0, 1 << 20)), Some((0, 1 << 20))], 2 * BATCH);
        assert_eq!(dealing.strata(), 2);
        assert_eq!(dealing.done(2 * BATCH), [0, BATCH]);
        let distinct: BTreeSet<u64> = dealing.units(0, 0..BATCH).iter().map(|of| of.0).collect();
        assert_eq!(distinct.len() as u64, BATCH / 2);
    }
}
