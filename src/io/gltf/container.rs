//! From a file to its JSON text and binary chunk (\[glTF\] 4.4, "Binary glTF Layout").

use super::error::GltfError;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

/// The parts of a file.
pub(super) struct Container<'a> {
    /// JSON text.
    pub(super) json: &'a [u8],
    /// The BIN chunk of a `.glb`.
    pub(super) bin: Option<&'a [u8]>,
}

/// Reads a regular file; its size is known, and its memory granted, before it is read.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, GltfError> {
    let read = || -> io::Result<Vec<u8>> {
        // Asked before opening: to open a pipe would wait for its writer.
        let metadata = fs::metadata(path)?;
        if !metadata.is_file() {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
        }
        let size = usize::try_from(metadata.len()).map_err(|_| io::ErrorKind::OutOfMemory)?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size)?;
        File::open(path)?.take(size as u64).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|source| GltfError::Io { path: path.to_owned(), source })
}

/// Tells `.glb` from `.gltf` by its first bytes and finds the chunks.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, GltfError> {
    // Some editors put a byte order mark before the text (RFC 8259, 8.1, lets a parser ignore it).
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if !bytes.starts_with(b"glTF") {
        return match bytes.iter().find(|b| !b.is_ascii_whitespace()) {
            Some(b'{') => Ok(Container { json: bytes, bin: None }),
            Some(_) => Err(GltfError::NotGltf("it begins with neither 'glTF' nor a JSON object".into())),
            None => Err(GltfError::NotGltf("it is empty".into())),
        };
    }
    let header = |at| word(bytes, at).ok_or_else(|| GltfError::NotGltf("it ends within its header".into()));
    let version = header(4)?;
    if version != 2 {
        return Err(GltfError::NotGltf(format!("its container version is {version}; expected 2")));
    }
    let length = header(8)? as usize;
    if length < 12 || length > bytes.len() {
        return Err(GltfError::NotGltf(format!("its header says {length} bytes, the file has {}", bytes.len())));
    }
    let (kind, json, mut rest) = chunk(&bytes[12..length], 0)?;
    if kind != *b"JSON" {
        return Err(GltfError::NotGltf(format!("chunk 0 is '{}'; expected 'JSON'", kind.escape_ascii())));
    }
    let mut bin = None;
    let mut number = 1;
    // The binary chunk is the second; chunks of other types are to be ignored.
    while !rest.is_empty() {
        let (kind, data, after) = chunk(rest, number)?;
        if number == 1 && kind == *b"BIN\0" {
            bin = Some(data);
        }
        (rest, number) = (after, number + 1);
    }
    Ok(Container { json, bin })
}

/// Type, data and what comes after.
type Chunk<'a> = ([u8; 4], &'a [u8], &'a [u8]);

fn chunk(bytes: &[u8], number: usize) -> Result<Chunk<'_>, GltfError> {
    let (Some(length), Some(kind)) = (word(bytes, 0), bytes.get(4..8)) else {
        return Err(GltfError::NotGltf(format!("it ends within the header of chunk {number}")));
    };
    let data = &bytes[8..];
    match data.split_at_checked(length as usize) {
        Some((data, rest)) => Ok(([kind[0], kind[1], kind[2], kind[3]], data, rest)),
        None => {
            let have = data.len();
            Err(GltfError::NotGltf(format!("chunk {number} says {length} bytes, {have} are left")))
        }
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}
