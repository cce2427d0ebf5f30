//! Long work: without the interpreter, on a stated number of threads, stopped by Ctrl-C.

use std::ops::ControlFlow;

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
