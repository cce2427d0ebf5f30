//! Fixed batches, ordered merge: the same bits for any number of threads, and a chance to stop between rounds.

use std::ops::ControlFlow;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

/// Rays in one unit of work. Fixed: partial sums are formed per batch, so their bits depend on it.
pub const BATCH: u64 = 1 << 16;

/// Batches between two calls of the progress function: some 5 ms to 50 ms of work.
const ROUND: u64 = 32;

/// Runs `work` over `0..n` in batches of [`BATCH`] on `threads` threads (0: one per core), and hands each result to
/// `merge` in batch order.
///
/// `merge` and `progress` run on the calling thread, which is where an interpreter looks for signals. `progress` is told
/// how many items are done after each round; [`ControlFlow::Break`] ends the run early. Returns the number of items done.
/// At most twice [`ROUND`] results wait to be merged at any time, which bounds the memory. The threads live as long as the
/// call: a process may fork afterwards. A single batch, or a system that grants no threads, is served by the calling thread.
pub fn run<T: Send>(
    threads: usize,
    n: u64,
    work: impl Fn(Range<u64>) -> T + Sync,
    mut merge: impl FnMut(T),
    mut progress: impl FnMut(u64) -> ControlFlow<()>,
) -> u64 {
    let batches = n.div_ceil(BATCH);
    let batch = |b: u64| work(b * BATCH..((b + 1) * BATCH).min(n));
    let round = |first: u64| {
        (first..(first + ROUND).min(batches))
            .into_par_iter()
            .map(batch)
            .collect::<Vec<T>>()
    };
    let mut rounds = |pool: Option<&rayon::ThreadPool>| {
        let mut first = 0;
        let mut ready = pool.map(|pool| pool.install(|| round(0)));
        while first < batches {
            let last = (first + ROUND).min(batches);
            let done = (last * BATCH).min(n);
            let stop = if let (Some(pool), Some(results)) = (pool, ready.take()) {
                pool.in_place_scope(|scope| {
                    if last < batches {
                        // The next round is worked on while this one is merged.
                        scope.spawn(|_| ready = Some(round(last)));
                    }
                    results.into_iter().for_each(&mut merge);
                    progress(done).is_break()
                })
            } else {
                (first..last).map(batch).for_each(&mut merge);
                progress(done).is_break()
            };
            first = last;
            if stop {
                break;
            }
        }
        (first * BATCH).min(n)
    };
    if batches <= 1 || threads == 1 {
        return rounds(None);
    }
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let done = builder.build_scoped(rayon::ThreadBuilder::run, |pool| rounds(Some(pool)));
    done.unwrap_or_else(|_| rounds(None))
}

/// Calls `work` inside a pool of `threads` threads (0: one per core), where rayon's parallel loops run; tells it whether
/// there is such a pool, which a system may refuse. The threads live as long as the call.
pub fn within<T: Send>(threads: usize, work: impl Fn(bool) -> T + Sync) -> T {
    beside(threads, |pool| match pool {
        Some(pool) => pool.install(|| work(true)),
        None => work(false),
    })
}

/// Calls `work` inside a pool of `threads` threads (0: one per core), also if that is one: for work whose parallel loops do not
/// ask whether there is a pool. Where a system refuses threads, rayon's own pool serves.
pub fn inside<T: Send>(threads: usize, work: impl Fn() -> T + Sync) -> T {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let done = builder.build_scoped(rayon::ThreadBuilder::run, |pool| pool.install(&work));
    done.unwrap_or_else(|_| work())
}

/// Calls `work` on the calling thread, beside a pool of `threads` threads (0: one per core), if there is one.
///
/// For work that allocates much between its parallel loops: what the calling thread frees, it is given again, while the
/// memory of threads that come and go has to be fetched page by page.
pub fn beside<T>(threads: usize, work: impl Fn(Option<&rayon::ThreadPool>) -> T) -> T {
    if threads == 1 {
        return work(None);
    }
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    let done = builder.build_scoped(rayon::ThreadBuilder::run, |pool| work(Some(pool)));
    done.unwrap_or_else(|_| work(None))
}

/// Room to work in that no thread uses at present: it is made for as many threads as want some at once, and used again by the
/// next task, as to fetch and clear its memory may take longer than a task.
#[derive(Debug)]
pub struct Idle<T>(Mutex<Vec<Box<T>>>);

impl<T> Default for Idle<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Idle<T> {
    /// Does a task in some room, made if there is none.
    pub fn with<R>(&self, make: impl FnOnce() -> T, task: impl FnOnce(&mut T) -> R) -> R {
        let mut room = self.take(make);
        let done = task(&mut room);
        self.give_back(room);
        done
    }

    /// Some room to keep for a while, made if there is none.
    pub fn take(&self, make: impl FnOnce() -> T) -> Box<T> {
        let taken = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        taken.unwrap_or_else(|| Box::new(make()))
    }

    /// Room that is no longer needed.
    pub fn give_back(&self, room: Box<T>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(room);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_used_again_and_made_where_all_is_in_use() {
        let (idle, count) = (Idle::default(), std::cell::Cell::new(0));
        let make = || {
            count.set(count.get() + 1);
            count.get()
        };
        idle.with(make, |outer| {
            assert_eq!(*outer, 1);
            idle.with(make, |inner| assert_eq!(*inner, 2));
        });
        // The last one given back comes first.
        idle.with(make, |room| assert_eq!(*room, 1));
        assert_eq!(count.get(), 2);
    }

    #[test]
    fn a_pool_has_as_many_threads_as_asked_for() {
        for threads in [1, 2, 3] {
            assert_eq!(inside(threads, rayon::current_num_threads), threads);
        }
    }

    #[test]
    fn merges_in_order_for_any_number_of_threads() {
        let n = 10 * BATCH + 17;
        let sum = |threads| {
            let mut parts = Vec::new();
            let harmonic = |r: Range<u64>| r.map(|i| 1.0 / (i as f64 + 1.0)).sum::<f64>();
            let done = run(threads, n, harmonic, |s| parts.push(s), |_| ControlFlow::Continue(()));
            assert_eq!(done, n);
            parts.iter().sum::<f64>().to_bits()
        };
        let one = sum(1);
        assert_eq!(one, sum(2));
        assert_eq!(one, sum(7));
    }

    #[test]
    fn stops_when_asked() {
        let mut seen = 0;
        let done = run(
            2,
            200 * BATCH,
            |r| r.end - r.start,
            |k| seen += k,
            |_| ControlFlow::Break(()),
        );
        assert_eq!(done, ROUND * BATCH);
        assert_eq!(seen, done);
    }
}
