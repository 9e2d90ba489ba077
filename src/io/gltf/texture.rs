//! Textures (\[glTF\] 3.8, `KHR_texture_transform`): images beside the scene, in its buffers and in data URIs.

use super::buffer::{Buffers, decode_data, relative_path};
use super::container::read_file;
use super::document::Document;
use super::error::{GltfError, Object};
use crate::io::image::decode_texture;
use crate::scene::description::{Encoding, Filter, Texture, TextureMap, Wrap};
use crate::text::shown;
use glam::{Affine2, Mat2, Vec2};
use gltf::json::Index;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::NormalTexture;
use gltf::json::texture::{self, Info, MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Texels that the images of a file may have in all: so many, and so many more for each of their bytes. Pictures stay far below;
/// what is one colour everywhere can unfold to thousands of texels for each byte.
const MOST_TEXELS: usize = 1 << 30;
const TEXELS_A_BYTE: usize = 64;

/// The images of a document, each read when it is first used, and once.
pub(super) struct Images<'a> {
    document: &'a Document<'a>,
    buffers: &'a Buffers<'a>,
    base: Option<&'a Path>,
    read: HashMap<(Source, bool), Arc<Texture>>,
    /// Of [`MOST_TEXELS`].
    left: usize,
}

/// Where the bytes of an image are: several may be the same.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Source {
    /// A buffer view.
    View(usize),
    /// A file or a data URI.
    Uri(String),
}

impl<'a> Images<'a> {
    /// None read yet.
    pub(super) fn new(document: &'a Document, buffers: &'a Buffers, base: Option<&'a Path>) -> Images<'a> {
        Images { document, buffers, base, read: HashMap::new(), left: MOST_TEXELS }
    }

    /// What `slot` of `from` asks for; `None`, with a warning, for an image that only an extension has.
    pub(super) fn map(
        &mut self,
        info: &Info,
        encoding: Encoding,
        from: &Object,
        slot: &str,
        warnings: &mut Vec<String>,
    ) -> Result<Option<TextureMap>, GltfError> {
        let document = self.document;
        let texture = document.get(info.index, from, &format!("{slot}.index"))?;
        let object = document.object(info.index);
        let only = texture.extensions.as_ref().and_then(|extensions| extensions.others.keys().next());
        if let Some(extension) = only
            && document.root.get(texture.source).is_none()
        {
            warnings.push(format!("{from}: {slot} is ignored: its image is that of {} alone", shown(extension)));
            return Ok(None);
        }
        // The typed document's way to say that there is none.
        if texture.source.value() == u32::MAX as usize {
            return Err(object.invalid("source", "missing", "expected an image"));
        }
        let image = document.get(texture.source, &object, "source")?;
        let object_of_image = document.object(texture.source);
        let source = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => Source::Uri(uri.clone()),
            (None, Some(view)) => Source::View(view.value()),
            (None, None) => return Err(object_of_image.invalid("uri", "missing", "expected it or bufferView")),
        };
        let key = (source, encoding == Encoding::Srgb);
        let read = match self.read.get(&key) {
            Some(texture) => texture.clone(),
            None => {
                let texture = Arc::new(self.decode(&key.0, object_of_image, encoding)?);
                self.read.insert(key, texture.clone());
                texture
            }
        };
        let mut map = TextureMap { transform: transform(info, from, slot)?, ..TextureMap::new(read) };
        if let Some(index) = texture.sampler {
            (map.wrap, map.filter) = sampling(document, document.get(index, &object, "sampler")?, index)?;
        }
        Ok(Some(map))
    }

    fn decode(&mut self, source: &Source, object: Object, encoding: Encoding) -> Result<Texture, GltfError> {
        let (field, name, bytes) = match source {
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => ("uri", "its data", Cow::Owned(decode_data(data, &object)?)),
                None => {
                    let relative = relative_path(uri, "uri", &object)?;
                    let Some(base) = self.base else {
                        return Err(object.unsupported("an image beside a scene in memory"));
                    };
                    ("uri", uri.as_str(), Cow::Owned(read_file(&base.join(relative))?))
                }
            },
            Source::View(view) => {
                let (bytes, _) = self.buffers.view(self.document, Index::new(*view as u32), &object, "bufferView")?;
                ("bufferView", "its data", Cow::Borrowed(bytes))
            }
        };
        self.left = self.left.saturating_add(bytes.len().saturating_mul(TEXELS_A_BYTE));
        let texture = decode_texture(&bytes, encoding, self.left, name).map_err(|source| GltfError::Image {
            object: Box::new(object),
            field: field.to_owned(),
            source,
        })?;
        let (width, height) = texture.size();
        self.left = self.left.saturating_sub(width * height);
        Ok(texture)
    }
}

/// A normal texture as any other. Its typed extensions are the JSON's.
pub(super) fn info_of_normal(normal: &NormalTexture, from: &Object) -> Result<Info, GltfError> {
    let others = normal.extensions.clone().unwrap_or_default().others;
    let texture_transform = match others.get("KHR_texture_transform") {
        Some(value) => Some(serde_json::from_value(value.clone()).map_err(|error| {
            from.invalid(
                "normalTexture.KHR_texture_transform",
                value,
                format!("of another form was expected ({error})"),
            )
        })?),
        None => None,
    };
    let extensions = Some(gltf::json::extensions::texture::Info { texture_transform, others });
    Ok(Info { index: normal.index, tex_coord: normal.tex_coord, extensions, extras: Default::default() })
}

/// The set of texture coordinates that is asked for.
pub(super) fn set(info: &Info) -> u32 {
    extension(info).and_then(|t| t.tex_coord).unwrap_or(info.tex_coord)
}

fn extension(info: &Info) -> Option<&TextureTransform> {
    info.extensions.as_ref()?.texture_transform.as_ref()
}

/// Scaled, turned, shifted. Counter-clockwise is seen with v down, as the extension's words and its first example have it; its
/// GLSL turns the other way.
fn transform(info: &Info, from: &Object, slot: &str) -> Result<Affine2, GltfError> {
    let Some(t) = extension(info) else { return Ok(Affine2::IDENTITY) };
    let field = |name| format!("{slot}.KHR_texture_transform.{name}");
    let offset = from.all_finite(&field("offset"), t.offset.0)?;
    let rotation = from.finite(&field("rotation"), t.rotation.0)?;
    let scale = from.all_finite(&field("scale"), t.scale.0)?;
    let turned = Mat2::from_angle(-rotation) * Mat2::from_diagonal(Vec2::from(scale));
    Ok(Affine2::from_mat2_translation(turned, offset.into()))
}

fn sampling(
    document: &Document,
    sampler: &Sampler,
    index: Index<texture::Sampler>,
) -> Result<([Wrap; 2], Filter), GltfError> {
    let wrap = |mode: &Checked<WrappingMode>, field: &str| match mode {
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Invalid => {
            let value = document.literal(&format!("/samplers/{index}/{field}"));
            Err(document.object(index).invalid(field, value, "expected 33071, 33648 or 10497"))
        }
    };
    let filter = match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Linear,
    };
    Ok(([wrap(&sampler.wrap_s, "wrapS")?, wrap(&sampler.wrap_t, "wrapT")?], filter))
}

#[cfg(all(test, feature = "oiio"))]
mod tests {
    use super::*;

    /// PNG, 128 x 128, one bit, all black.
    const BLACK: &str = "iVBORw0KGgoAAAANSUhEUgAAAIAAAACAAQAAAADrRVxmAAAAGUlEQVR42mNgGAWjYBSMglEwCkbBKKAvAAAIgAABw1fMHQAAAABJRU5ErkJggg==";

    /// A file may name the same bytes as often as it likes, and is not let to unfold without end.
    #[test]
    fn images_have_a_bound() {
        let images = format!(r#"{{"uri":"data:,{BLACK}"}},{{"uri":"data:,{BLACK}"}}"#)
            .replace("data:,", "data:image/png;base64,");
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"images":[{images}],"textures":[{{"source":0}},{{"source":1}}],
                "materials":[{{"emissiveTexture":{{"index":0}}}},{{"emissiveTexture":{{"index":1}}}}]}}"#
        );
        let mut warnings = Vec::new();
        let document = Document::parse(text.as_bytes(), &mut warnings).unwrap();
        let buffers = Buffers::load(&document, None, None).unwrap();
        let object = Object { kind: "material", index: None, name: String::new() };
        let read = |left| {
            let mut images = Images { left, ..Images::new(&document, &buffers, None) };
            let mut texture = |i: usize| {
                let info = document.root.materials[i].emissive_texture.as_ref().unwrap();
                let map = images.map(info, Encoding::Srgb, &object, "emissiveTexture", &mut Vec::new());
                map.map(|map| map.unwrap().texture)
            };
            Ok::<_, GltfError>((texture(0)?, texture(1)?))
        };
        let (a, b) = read(128 * 128).unwrap();
        assert!(Arc::ptr_eq(&a, &b));
        let error = read(0).unwrap_err().to_string();
        assert!(error.contains("image 0: uri: its data: it has 16384 pixels; at most"), "{error}");
    }
}
