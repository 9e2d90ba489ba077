//! Writing a file as a whole or not at all.

use super::ImageError;
use std::fs::{self, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// A file under construction, in the directory of its final name. Dropping it removes it.
pub(super) struct Pending {
    part: NamedTempFile,
    /// The final name, links resolved.
    target: PathBuf,
    /// As the user wrote it.
    path: PathBuf,
}

/// Starts a file that is to replace `path`. Refuses what a rename would replace against the will of
/// its owner: directories, devices, write-protected files.
pub(super) fn begin(path: &Path) -> Result<Pending, ImageError> {
    let error = |source| ImageError::Io { path: path.into(), action: "write", source };
    let (target, replaced) = match fs::canonicalize(path) {
        Ok(target) => {
            let permissions = may_replace(&target).map_err(error)?;
            (target, Some(permissions))
        }
        Err(e) if e.kind() == io::ErrorKind::NotFound => (path.to_owned(), None),
        Err(e) => return Err(error(e)),
    };
    let directory = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !directory.is_dir() {
        let message = format!("there is no directory '{}'", directory.display());
        return Err(error(io::Error::new(io::ErrorKind::NotFound, message)));
    }
    // The umask takes from 0666 as for any new file; the default of `tempfile` is 0600.
    let part = Builder::new()
        .prefix(".caustica-")
        .suffix(".part")
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(directory)
        .map_err(error)?;
    if let Some(permissions) = replaced {
        part.as_file().set_permissions(permissions).map_err(error)?;
    }
    Ok(Pending { part, target, path: path.to_owned() })
}

/// What the file to be replaced permits.
fn may_replace(target: &Path) -> io::Result<Permissions> {
    let known = fs::metadata(target)?;
    if !known.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"));
    }
    // The mode as such: the superuser may open anything.
    if known.permissions().readonly() {
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is write-protected"));
    }
    OpenOptions::new().append(true).open(target)?;
    Ok(known.permissions())
}

impl Pending {
    /// Fills the file and gives it its name. The contents reach the disk first: a full disk may show
    /// only then.
    pub(super) fn finish(mut self, bytes: &[u8]) -> Result<(), ImageError> {
        let written = self.part.write_all(bytes).and_then(|()| self.part.as_file().sync_all());
        let Pending { part, target, path } = self;
        written.and_then(|()| part.persist(&target).map(drop).map_err(|e| e.error)).map_err(|source| ImageError::Io {
            path,
            action: "write",
            source,
        })
    }
}
