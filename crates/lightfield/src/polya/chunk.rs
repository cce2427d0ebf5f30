//! Chunks of boxes, in which groups without points to speak of are passed over.

/// Boxes in one unit of work: a power of two whose scratch arrays fit the first caches.
pub(super) const CHUNK: usize = 256;

/// Boxes that are worked on together: what one vector holds.
pub(super) const GROUP: usize = 8;

/// The groups of a chunk in which any box has more than one point. Less than two points say nothing about a split: every term of
/// the evidence is its prior.
pub(super) struct Busy {
    groups: [usize; CHUNK],
    len: usize,
}

impl Busy {
    /// No group.
    pub const fn none() -> Self {
        Self {
            groups: [0; CHUNK],
            len: 0,
        }
    }

    /// Finds the groups of boxes with so many points each.
    pub fn find(&mut self, count: &[f64]) {
        self.len = 0;
        for (group, counts) in count.chunks(group_of(count.len())).enumerate() {
            // Without a branch: where there are points is as good as random.
            self.groups[self.len] = group;
            self.len += usize::from(counts.iter().any(|n| *n > 1.0));
        }
    }

    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The numbers of the groups.
    pub fn groups(&self) -> impl Iterator<Item = usize> {
        self.groups[..self.len].iter().copied()
    }
}

/// Boxes in a group of a chunk: of less than a whole group each is one by itself.
const fn group_of(boxes: usize) -> usize {
    if boxes < GROUP { 1 } else { GROUP }
}
