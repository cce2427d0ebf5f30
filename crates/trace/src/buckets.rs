//! Buckets by number, most of which are empty most of the time.

/// Entries from which on it is worth while to work on them together.
const MANY: usize = 8;

/// Buckets of places in a block.
#[derive(Default)]
pub struct Buckets {
    lists: Vec<Vec<u32>>,
    /// Those that are not empty, in the order of their first entries.
    used: Vec<usize>,
}

impl Buckets {
    pub fn new(count: usize) -> Self {
        Self {
            lists: vec![Vec::new(); count],
            used: Vec::new(),
        }
    }

    /// Empties all, in the time that those in use take.
    pub fn clear(&mut self) {
        for list in self.used.drain(..) {
            self.lists[list].clear();
        }
    }

    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "a block is short")]
    pub fn push(&mut self, list: usize, place: usize) {
        if self.lists[list].is_empty() {
            self.used.push(list);
        }
        self.lists[list].push(place as u32);
    }

    /// Moves what lists from number `first` on hold to list `other`, where they hold few entries.
    pub fn join_short(&mut self, first: usize, other: usize) {
        let mut short = std::mem::take(&mut self.lists[other]);
        let lists = &mut self.lists;
        self.used.retain(|list| {
            let joins = *list >= first && lists[*list].len() < MANY;
            if joins {
                short.append(&mut lists[*list]);
            }
            !joins && *list != other
        });
        if !short.is_empty() {
            self.used.push(other);
        }
        self.lists[other] = short;
    }

    pub fn get(&self, list: usize) -> &[u32] {
        &self.lists[list]
    }

    /// Those that are not empty, with their numbers.
    pub fn used(&self) -> impl Iterator<Item = (usize, &[u32])> {
        self.used.iter().map(|list| (*list, &self.lists[*list][..]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_lists_join_another_and_nothing_is_lost() {
        let mut lists = Buckets::new(6);
        for round in 0..3 {
            lists.clear();
            let counts = [0, 2 * round, 3, MANY - 1, MANY, 40];
            for (list, count) in counts.iter().enumerate() {
                (0..*count).for_each(|i| lists.push(list, 100 * list + i));
            }
            lists.join_short(2, 1);
            let found: Vec<(usize, usize)> = lists.used().map(|(list, places)| (list, places.len())).collect();
            assert_eq!(found, [(4, MANY), (5, 40), (1, 2 * round + 3 + MANY - 1)]);
            let mut all: Vec<u32> = lists.used().flat_map(|(_, places)| places.to_vec()).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), counts.iter().sum::<usize>());
        }
    }
}
