//! Arrays of many megabytes that are filled once and dropped: in large pages where the system has them, and used again by the
//! next array, as half of a tree's time on two threads would otherwise go into fetching and clearing pages.

use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Bytes from which large pages are asked for: some of those that most systems have.
const LARGE: usize = 1 << 22;

/// Memory of arrays that are no longer needed, for those to come.
#[derive(Default)]
pub(super) struct Workspace {
    spare: Vec<MmapMut>,
}

impl Workspace {
    /// An array of so many numbers that are yet to be written: they may be anything.
    pub fn array<T: Pod>(&mut self, len: usize) -> Array<T> {
        let bytes = len * size_of::<T>();
        if bytes >= LARGE {
            let fitting = (0..self.spare.len()).filter(|i| self.spare[*i].len() >= bytes);
            if let Some(index) = fitting.min_by_key(|i| self.spare[*i].len()) {
                let memory = Memory::Pages(self.spare.swap_remove(index));
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
}
