//! Long work: without the interpreter, on a stated number of threads, stopped by Ctrl-C.

use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

/// The function that the core calls between rounds with the number of rays done.
pub type Tick<'a> = &'a mut dyn FnMut(u64) -> ControlFlow<()>;

/// Runs `work` with the number of threads to use (0: one per core) and with the interpreter released.
///
/// The tick that `work` hands to the core calls `callback(done)` and looks for signals; an exception of either ends the
/// work and is returned.
pub fn interruptible<R: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(usize, Tick<'_>) -> R + Send,
) -> PyResult<R> {
    let mut failure = None;
    let result = py.detach(|| {
        work(threads.unwrap_or(0), &mut |done| {
            let outcome = Python::attach(|py| {
                callback.as_ref().map(|c| c.call1(py, (done,))).transpose()?;
                py.check_signals()
            });
            outcome.map_or_else(
                |error| {
                    failure = Some(error);
                    ControlFlow::Break(())
                },
                ControlFlow::Continue,
            )
        })
    });
    failure.map_or(Ok(result), Err)
}

/// How often the calling thread looks for signals while another one works.
const LOOK: Duration = Duration::from_millis(50);

/// Runs `work` on a thread of its own, with the interpreter released, while the calling thread looks for signals.
///
/// An exception of a signal sets the flag that `work` is given, upon which it returns soon, and is returned in its place.
pub fn stoppable<R: Send>(py: Python<'_>, work: impl FnOnce(&AtomicBool) -> R + Send) -> PyResult<R> {
    let stop = AtomicBool::new(false);
    let mut failure = None;
    let result = py.detach(|| {
        thread::scope(|scope| {
            let (done, waiting) = channel::<()>();
            let stop = &stop;
            let worker = scope.spawn(move || {
                let result = work(stop);
                drop(done);
                result
            });
            while waiting.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if failure.is_none() {
                    failure = Python::attach(|py| py.check_signals().err());
                    stop.store(failure.is_some(), Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    });
    failure.map_or(Ok(result), Err)
}
