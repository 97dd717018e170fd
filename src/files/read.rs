//! Files that are read: regular ones only, none larger than it may be.
//!
//! A device or a pipe would fill memory, or never end; so what is no regular file is refused before it is opened.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use crate::error::invalid;

/// Opens a regular file of at most `largest` bytes.
pub(crate) fn open(path: &Path, largest: u64) -> io::Result<File> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(invalid("it is a folder".into()));
    }
    if !metadata.is_file() {
        return Err(invalid("it is not a regular file".into()));
    }
    if metadata.len() > largest {
        let [found, allowed] = [metadata.len(), largest].map(|bytes| bytes >> 20);
        return Err(invalid(format!("its {found} MiB are more than the {allowed} MiB allowed")));
    }
    File::open(path)
}

/// Reads such a file. What says that it is empty and isn't, as in `/proc`, ends at `largest` too.
pub(crate) fn read(path: &Path, largest: u64) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    open(path, largest)?.take(largest).read_to_end(&mut content)?;
    Ok(content)
}

/// Why a file can't be read, in one line.
pub(crate) fn why(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::PermissionDenied => "reading it is not permitted".to_owned(),
        _ => error.to_string().replace('\n', " "),
    }
}
