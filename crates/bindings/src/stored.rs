//! Stretches of files.

use std::ffi::CString;
use std::fs::{File, Metadata};
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use etendue_geometry::stored::StoredBytes as CoreBytes;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What the system says of a file that nobody writes to.
type Stamp = (u64, Option<SystemTime>);

fn stamp(metadata: &Metadata) -> Stamp {
    (metadata.len(), metadata.modified().ok())
}

/// A file that is held open, as it was when it was opened.
struct Held {
    bytes: CoreBytes,
    stamp: Stamp,
    /// Whether it was told that somebody changed the file.
    told: AtomicBool,
}

/// Bytes of a file, read where they are asked for; `name` is what messages call the file.
#[pyclass(frozen, module = "etendue._core")]
pub struct StoredBytes {
    held: Arc<Held>,
    name: String,
}

#[pymethods]
impl StoredBytes {
    #[new]
    fn new(path: PathBuf, start: u64, len: u64) -> PyResult<Self> {
        let file = File::open(&path)?;
        let stamp = stamp(&file.metadata()?);
        let held = Held {
            bytes: CoreBytes::new(file, start, len),
            stamp,
            told: AtomicBool::new(false),
        };
        Ok(Self {
            held: Arc::new(held),
            name: path.display().to_string(),
        })
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(usize::try_from(self.held.bytes.len())?)
    }

    /// Size of the whole file when it was opened.
    fn size(&self) -> u64 {
        self.held.stamp.0
    }

    /// The same bytes under another name.
    fn named(&self, name: String) -> Self {
        Self {
            held: Arc::clone(&self.held),
            name,
        }
    }

    /// Bytes `start..stop`.
    fn read<'py>(&self, py: Python<'py>, start: u64, stop: u64) -> PyResult<Bound<'py, PyArray1<u8>>> {
        if start > stop || stop > self.held.bytes.len() {
            let len = self.held.bytes.len();
            return Err(PyValueError::new_err(format!("bytes {start}..{stop} of {len}")));
        }
        let array = PyArray1::zeros(py, usize::try_from(stop - start)?, false);
        {
            let mut room = array.readwrite();
            let room = room.as_slice_mut()?;
            py.detach(|| self.held.bytes.read(start, room));
        }
        self.check(py)?;
        Ok(array)
    }

    /// Raises `FormatError` if the file did not give what was asked of it; warns once if somebody has changed it.
    pub fn check(&self, py: Python<'_>) -> PyResult<()> {
        let (size, modified) = self.held.stamp;
        if let Some(failure) = self.held.bytes.failure() {
            let found = if failure.error.kind() == ErrorKind::UnexpectedEof {
                format!("the file ended here while it was read; it had {size} bytes when it was opened")
            } else {
                format!("the file could not be read: {}", failure.error)
            };
            let advice =
                "Nothing may write to a file that is read: start again with a whole file, or with a copy of it.";
            let place = format!("byte {}", failure.at);
            let error = py.import("etendue.errors")?.getattr("FormatError")?;
            return Err(PyErr::from_value(error.call1((&self.name, place, found, advice))?));
        }
        let now = self.held.bytes.file().metadata().map(|metadata| stamp(&metadata));
        if now.is_ok_and(|now| now != (size, modified)) && !self.held.told.swap(true, Ordering::Relaxed) {
            let category = py.import("etendue.quantities.report")?.getattr("ChangedFileWarning")?;
            let text = format!(
                "{}: somebody wrote to this file while it was in use; the {size} bytes that it had when it was opened count, \
                 and if they were changed the result is of no one file. Start again once it is at rest.",
                self.name
            );
            PyErr::warn(py, &category, &CString::new(text)?, 2)?;
        }
        Ok(())
    }
}

impl StoredBytes {
    /// The core's view of it.
    pub fn core(&self) -> &CoreBytes {
        &self.held.bytes
    }
}
