//! Arrays of many megabytes that are filled once and dropped: in large pages where the system has them, as half of a
//! tree's time on two threads would otherwise go into fetching small ones.

use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Bytes from which large pages are asked for: some of those that most systems have.
const LARGE: usize = 1 << 22;

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

    /// A copy.
    pub fn copy(values: &[T]) -> Self {
        let mut array = Self::zeros(values.len());
        array.copy_from_slice(values);
        array
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
            assert!(*Array::copy(&array) == *array);
        }
    }
}
