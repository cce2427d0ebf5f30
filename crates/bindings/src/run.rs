//! Long work: without the interpreter, on a stated number of threads, stopped by Ctrl-C.

use std::ops::ControlFlow;

use etendue_sampling::ordered::{self, ThreadPool};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// The function that the core calls between rounds with the number of rays done.
pub type Tick<'a> = &'a mut dyn FnMut(u64) -> ControlFlow<()>;

/// Runs `work` on a pool of `threads` threads (one per core if None) with the interpreter released.
///
/// The tick that `work` hands to the core calls `callback(done)` and looks for signals; an exception of either ends the
/// work and is returned.
pub fn interruptible<R: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&ThreadPool, Tick<'_>) -> R + Send,
) -> PyResult<R> {
    let pool = ordered::pool(threads.unwrap_or(0)).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    let mut failure = None;
    let result = py.detach(|| {
        work(&pool, &mut |done| {
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
