//! Where a rising list passes a number, without looking through it: a table of places to start from `[ChenAsau1974]`.

/// Places in a list of rising numbers from 0 on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Guide {
    /// For each of the even steps up to the end the first place whose number is not below it.
    first: Vec<u32>,
    /// Steps per unit.
    scale: f64,
}

impl Guide {
    /// Of a list that rises, with so many more steps than it has numbers that few of them hold two.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "lists of less than 2^32 numbers"
    )]
    pub fn new(rising: &[f64]) -> Self {
        let steps = 8 * rising.len().next_power_of_two();
        let scale = match rising.last() {
            Some(end) if *end > 0.0 && (steps as f64 / end).is_finite() => steps as f64 / end,
            _ => 0.0,
        };
        let place = |step: usize| rising.partition_point(|x| *x * scale < step as f64) as u32;
        Self {
            first: (0..steps).map(place).collect(),
            scale,
        }
    }

    /// How many of its list, whose numbers `of` tells, are not above `x`: what `partition_point` finds.
    #[inline(always)]
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "kept within the table"
    )]
    pub fn not_above<T>(&self, rising: &[T], x: f64, of: impl Fn(&T) -> f64) -> usize {
        let step = ((x * self.scale) as usize).min(self.first.len().saturating_sub(1));
        // Numbers before this place are below the step, and so below `x`, whatever products are rounded to.
        let mut at = self.first.get(step).map_or(0, |first| *first as usize);
        // Whether one number lies below in the step nobody foresees, so it is counted; that there are more is rare.
        at += rising.get(at).map_or(0, |next| usize::from(of(next) <= x));
        while at < rising.len() && of(&rising[at]) <= x {
            at += 1;
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::philox::Stream;

    #[test]
    fn it_finds_what_a_search_finds() {
        let stream = Stream::new(3, 4);
        let mut number = 0;
        let mut next = || {
            number += 1;
            stream.uniforms(number, 0)[0]
        };
        for length in [0, 1, 2, 3, 17, 64, 200] {
            for steep in [1.0, 8.0, 60.0] {
                let mut sum = 0.0;
                let list: Vec<f64> = (0..length)
                    .map(|k| {
                        sum += if k % 5 == 2 { 0.0 } else { next().powf(steep) };
                        sum
                    })
                    .collect();
                let guide = Guide::new(&list);
                let asked: Vec<f64> = (0..400)
                    .map(|_| next() * 1.1 * sum)
                    .chain(list.iter().copied())
                    .collect();
                for x in asked.into_iter().chain([0.0, -1.0, 2.0 * sum, f64::MAX]) {
                    assert_eq!(
                        guide.not_above(&list, x, |y| *y),
                        list.partition_point(|y| *y <= x),
                        "{length} {steep} {x}"
                    );
                }
            }
        }
    }
}
