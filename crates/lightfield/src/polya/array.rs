//! Arrays of many megabytes that are filled once and dropped: in large pages where the system has them, and used again by the
//! next array, as half of a tree's time on two threads would otherwise go into fetching and clearing pages.

use std::cmp::Reverse;
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Bytes from which large pages are asked for: some of those that most systems have.
const LARGE: usize = 1 << 22;

/// Bytes that are held between trees at most.
const MOST_HELD: usize = 1 << 30;

/// What trees leave to one another.
static HELD: Mutex<Held> = Mutex::new(Held {
    holders: 0,
    spare: Vec::new(),
});

struct Held {
    /// How many want it to be held.
    holders: usize,
    spare: Vec<MmapMut>,
}

impl Held {
    /// Takes memory over, if anybody wants it to be held: not too much, and the largest, which take longest to fetch.
    fn take_over(&mut self, spare: &mut Vec<MmapMut>, most: usize) {
        if self.holders == 0 {
            return;
        }
        self.spare.append(spare);
        self.spare.sort_by_key(|map| Reverse(map.len()));
        let mut bytes = 0;
        self.spare.retain(|map| {
            bytes += map.len();
            bytes <= most
        });
    }

    /// One fewer wants it to be held.
    fn release(&mut self) {
        self.holders -= 1;
        if self.holders == 0 {
            self.spare.clear();
        }
    }
}

fn held() -> MutexGuard<'static, Held> {
    // Whoever fails while it changes leaves a list that is as good as any.
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// As long as one lives, trees leave their memory to those that are grown after them, whoever grows them: for work that grows
/// many.
#[derive(Debug)]
pub struct TreeMemory(());

impl TreeMemory {
    /// From now on.
    #[must_use]
    pub fn begin() -> Self {
        held().holders += 1;
        Self(())
    }
}

impl Drop for TreeMemory {
    fn drop(&mut self) {
        held().release();
    }
}

/// Memory of arrays that are no longer needed, for those to come.
#[derive(Default)]
pub(super) struct Workspace {
    spare: Vec<MmapMut>,
}

/// The smallest that has so many bytes.
fn fitting(spare: &mut Vec<MmapMut>, bytes: usize) -> Option<MmapMut> {
    let fit = (0..spare.len()).filter(|i| spare[*i].len() >= bytes);
    let index = fit.min_by_key(|i| spare[*i].len())?;
    Some(spare.swap_remove(index))
}

impl Drop for Workspace {
    fn drop(&mut self) {
        held().take_over(&mut self.spare, MOST_HELD);
    }
}

impl Workspace {
    /// An array of so many numbers that are yet to be written: they may be anything.
    pub fn array<T: Pod>(&mut self, len: usize) -> Array<T> {
        let bytes = len * size_of::<T>();
        if bytes >= LARGE {
            let found = fitting(&mut self.spare, bytes).or_else(|| fitting(&mut held().spare, bytes));
            if let Some(map) = found {
                let memory = Memory::Pages(map);
                return Array { memory, len };
            }
        }
        Array::zeros(len)
    }

    /// Takes an array that is no longer needed.
    pub fn keep<T>(&mut self, array: Array<T>) {
        if let Memory::Pages(map) = array.memory {
            self.spare.push(map);
        }
    }
}

/// An array of zeros to begin with.
pub(super) struct Array<T> {
    memory: Memory<T>,
    len: usize,
}

enum Memory<T> {
    Pages(MmapMut),
    Heap(Vec<T>),
}

impl<T: Pod> Array<T> {
    /// An array of so many zeros.
    pub fn zeros(len: usize) -> Self {
        let memory = pages(len * size_of::<T>()).map_or_else(|| Memory::Heap(vec![T::zeroed(); len]), Memory::Pages);
        Self { memory, len }
    }
}

/// So many bytes of memory in large pages; None if they are few, or the system refuses.
fn pages(bytes: usize) -> Option<MmapMut> {
    if bytes < LARGE {
        return None;
    }
    let map = MmapMut::map_anon(bytes).ok()?;
    #[cfg(target_os = "linux")]
    // A wish: without large pages all goes on, only slower.
    let _ = map.advise(memmap2::Advice::HugePage);
    Some(map)
}

impl<T: Pod> Default for Array<T> {
    fn default() -> Self {
        Self::zeros(0)
    }
}

impl<T: Pod> Deref for Array<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.memory {
            Memory::Pages(map) => &bytemuck::cast_slice(map)[..self.len],
            Memory::Heap(values) => values,
        }
    }
}

impl<T: Pod> DerefMut for Array<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.memory {
            Memory::Pages(map) => &mut bytemuck::cast_slice_mut(map)[..self.len],
            Memory::Heap(values) => values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_arrays_are_alike() {
        for len in [0, 5, LARGE / 8 - 1, LARGE / 8, LARGE / 4 + 3] {
            let mut array = Array::<f64>::zeros(len);
            assert!(array.len() == len && array.iter().all(|v| *v == 0.0));
            array.iter_mut().for_each(|v| *v = 1.5);
            assert!(array.iter().all(|v| *v == 1.5));
        }
    }

    #[test]
    fn memory_is_used_again() {
        let mut workspace = Workspace::default();
        let first = workspace.array::<f64>(LARGE);
        let place = first.as_ptr().cast::<u8>();
        workspace.keep(first);
        assert!(workspace.array::<f32>(LARGE / 2).as_ptr().cast() == place && workspace.spare.is_empty());
        assert!(workspace.array::<f32>(LARGE).len() == LARGE);
    }

    #[test]
    fn memory_is_held_while_somebody_wants_it_and_no_more_of_it_than_allowed() {
        let maps = || {
            [1, 3, 2]
                .map(|n| pages(n * LARGE).expect("some pages"))
                .into_iter()
                .collect()
        };
        let mut held = Held {
            holders: 0,
            spare: Vec::new(),
        };
        held.take_over(&mut maps(), 100 * LARGE);
        assert!(held.spare.is_empty());
        held.holders = 2;
        held.take_over(&mut maps(), 5 * LARGE);
        let lengths: Vec<usize> = held.spare.iter().map(|map| map.len() / LARGE).collect();
        assert_eq!(lengths, [3, 2]);
        assert!(fitting(&mut held.spare, 4 * LARGE).is_none());
        assert_eq!(fitting(&mut held.spare, LARGE).map(|map| map.len()), Some(2 * LARGE));
        held.release();
        assert_eq!(held.spare.len(), 1);
        held.release();
        assert!(held.spare.is_empty());
    }
}
