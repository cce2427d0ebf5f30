//! Sampling of a table: one uniform number, two look-ups.

use crate::warp::part_of;

/// Alias table (Walker 1977; construction of Vose 1991, `[Vose1991]`) over weights that need not add up to one.
#[derive(Clone, Debug)]
pub struct Alias {
    slots: Vec<Slot>,
}

/// One of the even parts of all uniform numbers. Eight bytes: large tables do not fit into caches, and each number takes one.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// Chance of the entry of the same number, in units of 2⁻³².
    pub own: u32,
    /// The entry that has the rest.
    pub alias: u32,
}

/// Unit of the chances.
pub const UNIT: f64 = 1.0 / 4_294_967_296.0;

impl Slot {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a chance is from 0 to 1; as a cast saturates, what is rounded to 1 falls short of it by a unit"
    )]
    fn new((chance, alias): (f64, u32)) -> Self {
        Self {
            own: (chance / UNIT).round() as u32,
            alias,
        }
    }

    /// Chance of the entry of the same number.
    #[inline]
    #[must_use]
    pub fn chance(self) -> f64 {
        f64::from(self.own) * UNIT
    }
}

impl Alias {
    /// A table over weights ≥ 0; None if there are none, their sum is not above 0 and finite, or there are 2³² or more. Shares are
    /// right to 2⁻³² of that of an even weight.
    #[must_use]
    pub fn new(weights: &[f64]) -> Option<Self> {
        let count = u32::try_from(weights.len()).ok()?;
        let total: f64 = weights.iter().sum();
        if !(total > 0.0 && total.is_finite()) || weights.iter().any(|w| *w < 0.0) {
            return None;
        }
        let scale = f64::from(count) / total;
        let mut slots: Vec<(f64, u32)> = weights.iter().zip(0..count).map(|(w, i)| (w * scale, i)).collect();
        let (mut poor, mut rich): (Vec<u32>, Vec<u32>) = (0..count).partition(|i| slots[*i as usize].0 < 1.0);
        while let (Some(small), Some(large)) = (poor.pop(), rich.last().copied()) {
            let missing = 1.0 - slots[small as usize].0;
            slots[small as usize].1 = large;
            slots[large as usize].0 -= missing;
            if slots[large as usize].0 < 1.0 {
                rich.pop();
                poor.push(large);
            }
        }
        // Whatever is left differs from one by rounding only.
        for i in rich.into_iter().chain(poor) {
            if weights[i as usize] > 0.0 {
                slots[i as usize] = (1.0, i);
            }
        }
        let slots = slots.into_iter().map(Slot::new).collect();
        Some(Self { slots })
    }

    /// The entry for a uniform number in (0, 1).
    #[inline]
    #[must_use]
    pub fn pick(&self, u: f64) -> usize {
        pick_from(&self.slots, u).0
    }

    /// Its slots: a uniform number falls into one of them, and what is left of it decides.
    #[inline]
    #[must_use]
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// The number of the slot that a uniform number in (0, 1) falls into, and the same with how far into it the number falls.
    #[inline]
    #[must_use]
    pub fn place(&self, u: f64) -> (u32, f64) {
        place_among(self.slots.len(), u)
    }

    /// The entry for a uniform number in (0, 1), and what is left of the number: uniform again, less than 1.
    #[inline]
    #[must_use]
    pub fn pick_and_rest(&self, u: f64) -> (usize, f64) {
        pick_from(&self.slots, u)
    }
}

/// Tables one after the other, in one piece of memory.
#[derive(Clone, Debug)]
pub struct Aliases {
    slots: Vec<Slot>,
    /// Where each table begins, and the last one ends.
    starts: Vec<usize>,
}

impl Default for Aliases {
    /// None yet.
    fn default() -> Self {
        Self {
            slots: Vec::new(),
            starts: vec![0],
        }
    }
}

impl Aliases {
    /// One more table, over weights ≥ 0; without entries where [`Alias::new`] has none.
    pub fn push(&mut self, weights: &[f64]) {
        self.slots
            .extend(Alias::new(weights).map(|table| table.slots).unwrap_or_default());
        self.starts.push(self.slots.len());
    }

    /// The entry of a table for a uniform number in (0, 1); None if the table has no entries.
    #[inline]
    #[must_use]
    pub fn pick(&self, table: usize, u: f64) -> Option<usize> {
        let slots = &self.slots[self.starts[table]..self.starts[table + 1]];
        (!slots.is_empty()).then(|| pick_from(slots, u).0)
    }
}

/// The number of the slot of so many that a uniform number in (0, 1) falls into, and the same with how far into it the number falls.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the number of slots, which is below 2^32"
)]
fn place_among(slots: usize, u: f64) -> (u32, f64) {
    let scaled = u * slots as f64;
    ((scaled as u32).min(slots as u32 - 1), scaled)
}

/// The entry for a uniform number in (0, 1), and what is left of the number.
#[inline(always)]
fn pick_from(slots: &[Slot], u: f64) -> (usize, f64) {
    let (slot, scaled) = place_among(slots.len(), u);
    let within = scaled - f64::from(slot);
    let slot = slot as usize;
    let (chance, alias) = (slots[slot].chance(), slots[slot].alias);
    // Without a branch: which of the two it is, nobody can foresee.
    let own = within < chance;
    let (part, share) = if own {
        (within, chance)
    } else {
        (within - chance, 1.0 - chance)
    };
    (if own { slot } else { alias as usize }, part_of(part, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_has_its_share() {
        // The share of an entry, from the table itself: own chances and what aliases hand over.
        for weights in [
            vec![1.0],
            vec![0.0, 3.0, 1.0, 0.0, 0.5],
            (0..1000_u32).map(|i| f64::from(i * i % 97)).collect(),
        ] {
            let table = Alias::new(&weights).expect("positive");
            let n = weights.len() as f64;
            let mut shares = vec![0.0; weights.len()];
            for (i, slot) in table.slots.iter().enumerate() {
                shares[i] += slot.chance() / n;
                shares[slot.alias as usize] += (1.0 - slot.chance()) / n;
            }
            let total: f64 = weights.iter().sum();
            for (share, weight) in shares.iter().zip(&weights) {
                assert!((share - weight / total).abs() < UNIT);
            }
            for k in 0..10_000 {
                assert!(weights[table.pick((f64::from(k) + 0.5) / 10_000.0)] > 0.0);
            }
        }
    }

    #[test]
    fn tables_in_a_row_are_those_of_each() {
        let weights = [vec![1.0, 3.0, 0.5], vec![0.0, 0.0], vec![2.0], vec![0.0, 1.0, 4.0, 2.0]];
        let mut row = Aliases::default();
        for weights in &weights {
            row.push(weights);
        }
        for (table, weights) in weights.iter().enumerate() {
            for k in 0..100 {
                let u = (f64::from(k) + 0.5) / 100.0;
                assert_eq!(row.pick(table, u), Alias::new(weights).map(|alone| alone.pick(u)));
            }
        }
    }

    #[test]
    fn tables_without_a_meaning_are_refused() {
        for weights in [
            vec![],
            vec![0.0, 0.0],
            vec![1.0, -1.0],
            vec![f64::NAN],
            vec![f64::INFINITY, 1.0],
        ] {
            assert!(Alias::new(&weights).is_none());
        }
    }
}
