//! The bytes behind a document: the binary chunk, files beside the scene, data URIs.

use super::container::read_file;
use super::document::Document;
use super::error::{GltfError, Object};
use crate::text::shown;
use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::Index;
use gltf::json::buffer::View;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

/// Base64 with or without padding: writers differ.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The buffers of a document, each at least as long as it says.
pub(super) struct Buffers<'a> {
    /// A file that several buffers name is read once.
    stores: Vec<Cow<'a, [u8]>>,
    /// Per buffer, its store and its length in it; `None` where the file gives no bytes.
    buffers: Vec<Option<(usize, usize)>>,
    external_bytes: usize,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers.
    pub(super) fn load(document: &Document, bin: Option<&'a [u8]>, base: Option<&Path>) -> Result<Self, GltfError> {
        let mut this = Buffers { stores: Vec::new(), buffers: Vec::new(), external_bytes: 0 };
        let mut files: HashMap<PathBuf, usize> = HashMap::new();
        for (i, buffer) in document.root.buffers.iter().enumerate() {
            let object = Object { kind: "buffer", index: Some(i), name: buffer.name.clone().unwrap_or_default() };
            let store = match (&buffer.uri, bin) {
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => this.add(Cow::Owned(decode_data(data, &object)?)),
                    None => {
                        let relative = relative_path(uri, "uri", &object)?;
                        match files.get(&relative) {
                            Some(&store) => store,
                            None => {
                                let Some(base) = base else {
                                    return Err(object.unsupported("a file beside a scene in memory"));
                                };
                                let bytes = read_file(&base.join(&relative))?;
                                this.external_bytes = this.external_bytes.saturating_add(bytes.len());
                                *files.entry(relative).or_insert(this.add(Cow::Owned(bytes)))
                            }
                        }
                    }
                },
                // Only the first buffer may be the binary chunk.
                (None, Some(bin)) if i == 0 => this.add(Cow::Borrowed(bin)),
                (None, _) => {
                    this.buffers.push(None);
                    continue;
                }
            };
            let have = this.stores[store].len();
            let length = usize::try_from(buffer.byte_length.0).ok().filter(|&length| length <= have);
            let Some(length) = length else {
                return Err(object.invalid("byteLength", buffer.byte_length.0, format!("its data has {have} bytes")));
            };
            this.buffers.push(Some((store, length)));
        }
        Ok(this)
    }

    fn add(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.stores.push(bytes);
        self.stores.len() - 1
    }

    /// Bytes read from files beside the scene.
    pub(super) fn external_bytes(&self) -> usize {
        self.external_bytes
    }

    /// The bytes of a view and its stride; `field` of `from` names the view.
    pub(super) fn view(
        &self,
        document: &Document,
        index: Index<View>,
        from: &Object,
        field: &str,
    ) -> Result<(&[u8], Option<usize>), GltfError> {
        let view = document.get(index, from, field)?;
        let object = document.object(index);
        document.get(view.buffer, &object, "buffer")?;
        let bytes = match self.buffers.get(view.buffer.value()) {
            Some(&Some((store, length))) => &self.stores[store][..length],
            _ => return Err(document.object(view.buffer).invalid("uri", "missing", "the file has no bytes for it")),
        };
        let offset = view.byte_offset.unwrap_or_default().0;
        let range = offset.checked_add(view.byte_length.0).and_then(|end| {
            let (start, end) = (usize::try_from(offset).ok()?, usize::try_from(end).ok()?);
            bytes.get(start..end)
        });
        match range {
            Some(range) => Ok((range, view.byte_stride.map(|stride| stride.0))),
            None => Err(object.invalid(
                "byteOffset + byteLength",
                format!("{offset} + {}", view.byte_length.0),
                format!("its buffer has {} bytes", bytes.len()),
            )),
        }
    }
}

/// The data of a URI, after `data:`.
pub(super) fn decode_data(uri: &str, object: &Object) -> Result<Vec<u8>, GltfError> {
    let Some((kind, data)) = uri.split_once(',') else {
        return Err(object.invalid("uri", format!("data:{uri}"), "expected a comma before the data"));
    };
    if !kind.ends_with(";base64") {
        return Err(object.unsupported(format!("a data URI of type '{}' (only base64 is)", shown(kind))));
    }
    BASE64.decode(data).map_err(|e| object.invalid("uri", "broken base64", e))
}

/// The file that a URI in `field` names, relative to the scene's folder, and inside it.
pub(super) fn relative_path(uri: &str, field: &str, object: &Object) -> Result<PathBuf, GltfError> {
    if let Some((scheme, _)) = uri.split_once(':').filter(|(scheme, _)| !scheme.contains('/')) {
        return Err(object.unsupported(format!("a URI with the scheme '{scheme}'")));
    }
    let wrong = |expected: &str| object.invalid(field, format!("'{uri}'"), expected);
    let outside = || wrong("expected a path inside the scene's folder: copy the file there");
    let decoded = percent_decode(uri).filter(|path| !path.contains('\0')).ok_or_else(outside)?;
    // What Unix takes for part of a name, Windows takes for a way out.
    if decoded.contains('\\') {
        return Err(wrong("expected / between folders, not \\"));
    }
    let mut path = PathBuf::new();
    for component in Path::new(&decoded).components() {
        match component {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => return Err(outside()),
        }
    }
    if path.as_os_str().is_empty() { Err(outside()) } else { Ok(path) }
}

/// Resolves `%20` and the like (RFC 3986, 2.1); a `%` that no two digits follow was meant as it stands.
fn percent_decode(uri: &str) -> Option<String> {
    let digit = |byte: u8| char::from(byte).to_digit(16);
    let digits = |pair: &[u8]| Some((digit(pair[0])? * 16 + digit(pair[1])?) as u8);
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [byte, after @ ..] = rest {
        let escaped = after.get(..2).filter(|_| *byte == b'%').and_then(digits);
        bytes.push(escaped.unwrap_or(*byte));
        rest = if escaped.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).ok()
}
