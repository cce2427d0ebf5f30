//! The first entries of several lists, for loops that run over all of them.
//!
//! Functions that are compiled once per instruction set take them from here. A closure of their own would be compiled for the
//! instruction set, and the library's `map` over arrays is not: it may then be called and not inlined, so that the loop does not
//! know how long its lists are, checks every index, and is not vectorised.

/// The first `n` entries of each list.
///
/// # Panics
/// If a list has fewer.
#[inline(always)]
#[must_use]
pub fn heads<T, L: AsRef<[T]>, const N: usize>(lists: &[L; N], n: usize) -> [&[T]; N] {
    lists.each_ref().map(|list| &list.as_ref()[..n])
}

/// The first `n` entries of each list, to be written to.
///
/// # Panics
/// If a list has fewer.
#[inline(always)]
#[must_use]
pub fn heads_mut<T, L: AsMut<[T]>, const N: usize>(lists: &mut [L; N], n: usize) -> [&mut [T]; N] {
    lists.each_mut().map(|list| &mut list.as_mut()[..n])
}
