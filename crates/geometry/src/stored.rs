//! A stretch of a file, read where it is asked for by any number of threads.
//!
//! Not a memory map: when somebody shortens a mapped file, the system ends the program, and nothing can be said of it. A read
//! that finds less than was there is a failure that can be told.

use std::fs::File;
use std::io::{Error, ErrorKind};
use std::sync::OnceLock;

/// Why a stretch could not be read.
#[derive(Debug)]
pub struct Failure {
    /// The byte of the file that could not be read.
    pub at: u64,
    /// What the system said; [`ErrorKind::UnexpectedEof`] if the file ends before.
    pub error: Error,
}

/// Bytes `start..start + len` of an open file.
#[derive(Debug)]
pub struct StoredBytes {
    file: File,
    start: u64,
    len: u64,
    failure: OnceLock<Failure>,
}

impl StoredBytes {
    /// A stretch of a file that is open for reading; it need not be there.
    #[must_use]
    pub fn new(file: File, start: u64, len: u64) -> Self {
        Self {
            file,
            start,
            len,
            failure: OnceLock::new(),
        }
    }

    /// Length of the stretch.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether it holds nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The file itself, for what the system knows of it.
    #[must_use]
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Fills `into` from byte `at` of the stretch. Where the file does not give them the bytes are 0, and the first failure is
    /// kept for [`Self::failure`].
    pub fn read(&self, at: u64, into: &mut [u8]) {
        let mut done = 0;
        while done < into.len() {
            let place = self.start + at + done as u64;
            let error = match read_at(&self.file, &mut into[done..], place) {
                Ok(0) => Error::from(ErrorKind::UnexpectedEof),
                Ok(count) => {
                    done += count;
                    continue;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => error,
            };
            into[done..].fill(0);
            self.failure.get_or_init(|| Failure { at: place, error });
            return;
        }
    }

    /// The first failure, for good: whoever made a pass asks for it before he believes what the pass found.
    #[must_use]
    pub fn failure(&self) -> Option<&Failure> {
        self.failure.get()
    }
}

#[cfg(unix)]
fn read_at(file: &File, into: &mut [u8], place: u64) -> Result<usize, Error> {
    std::os::unix::fs::FileExt::read_at(file, into, place)
}

#[cfg(windows)]
fn read_at(file: &File, into: &mut [u8], place: u64) -> Result<usize, Error> {
    std::os::windows::fs::FileExt::seek_read(file, into, place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_file_that_shrinks_leaves_zeros_and_a_failure_with_its_place() {
        let path = std::env::temp_dir().join(format!("etendue-stored-{}", std::process::id()));
        let mut file = File::create(&path).expect("a file");
        file.write_all(&[7; 100]).expect("written");
        let bytes = StoredBytes::new(File::open(&path).expect("opened"), 10, 90);
        let mut into = [1; 20];
        bytes.read(0, &mut into);
        assert!(into == [7; 20] && bytes.failure().is_none());
        file.set_len(85).expect("shortened");
        bytes.read(70, &mut into);
        std::fs::remove_file(&path).expect("removed");
        assert_eq!((&into[..5], &into[5..]), (&[7; 5][..], &[0; 15][..]));
        let failure = bytes.failure().expect("it was too short");
        assert_eq!((failure.at, failure.error.kind()), (85, ErrorKind::UnexpectedEof));
    }
}
