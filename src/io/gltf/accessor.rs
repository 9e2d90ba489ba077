//! Typed arrays (\[glTF\] 3.6.2, "Accessors"): all sizes are checked when one is opened, elements
//! are then read one by one, so that nothing is allocated for what a file only claims.

use super::buffer::Buffers;
use super::document::Document;
use super::error::{GltfError, Object};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

/// Types of positions and texture coordinates with `KHR_mesh_quantization`.
pub(super) const QUANTIZED: [ComponentType; 5] =
    [ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];

/// Of normals with it; that they are fractions is not demanded, their length has no say.
pub(super) const SIGNED: [ComponentType; 3] = [ComponentType::F32, ComponentType::I8, ComponentType::I16];

/// An array in a buffer.
pub(super) struct Accessor<'a> {
    /// For messages.
    pub(super) object: Object,
    /// Number of elements, at least 1.
    pub(super) count: usize,
    component: ComponentType,
    /// Whether integers are fractions of the largest one.
    normalized: bool,
    /// `None`: all zeros.
    base: Option<Elements<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements at a stride.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

/// Elements that replace others.
struct Sparse<'a> {
    /// Strictly increasing.
    indices: Vec<u32>,
    values: Elements<'a>,
}

impl<'a> Accessor<'a> {
    /// Opens an array of vectors, the attribute `field` of `from`: floats, or by `KHR_mesh_quantization` one of these types.
    pub(super) fn of_vectors(
        document: &Document,
        buffers: &'a Buffers,
        index: Index<json::Accessor>,
        from: &Object,
        field: &str,
        quantized: &[ComponentType],
    ) -> Result<Self, GltfError> {
        let legal = if document.quantized() { quantized } else { &[ComponentType::F32] };
        Self::open(document, buffers, index, from, field, Type::Vec3, legal)
    }

    /// The same of texture coordinates; without the extension, integers of two types are fractions of the largest one.
    pub(super) fn of_coordinates(
        document: &Document,
        buffers: &'a Buffers,
        index: Index<json::Accessor>,
        from: &Object,
        field: &str,
    ) -> Result<Self, GltfError> {
        if document.quantized() {
            return Self::open(document, buffers, index, from, field, Type::Vec2, &QUANTIZED);
        }
        let legal = [ComponentType::F32, ComponentType::U8, ComponentType::U16];
        let opened = Self::open(document, buffers, index, from, field, Type::Vec2, &legal)?;
        Ok(Accessor { normalized: true, ..opened })
    }

    /// Opens an array of vertex indices of `from`.
    pub(super) fn of_indices(
        document: &Document,
        buffers: &'a Buffers,
        index: Index<json::Accessor>,
        from: &Object,
    ) -> Result<Self, GltfError> {
        let legal = [ComponentType::U8, ComponentType::U16, ComponentType::U32];
        Self::open(document, buffers, index, from, "indices", Type::Scalar, &legal)
    }

    fn open(
        document: &Document,
        buffers: &'a Buffers,
        index: Index<json::Accessor>,
        from: &Object,
        field: &str,
        shape: Type,
        components: &[ComponentType],
    ) -> Result<Self, GltfError> {
        let accessor = document.get(index, from, field)?;
        let object = document.object(index);
        let literal = |field| document.literal(&format!("/accessors/{index}/{field}"));
        match accessor.type_ {
            Checked::Valid(found) if found == shape => {}
            _ => return Err(object.invalid("type", literal("type"), format!("{field} needs {shape:?}"))),
        }
        let component = match accessor.component_type {
            Checked::Valid(found) => found.0,
            Checked::Invalid => {
                return Err(object.invalid("componentType", literal("componentType"), "expected 5120 to 5126"));
            }
        };
        if !components.contains(&component) {
            return Err(object.unsupported(format!("componentType {} for {field}", component.as_gl_enum())));
        }
        let size = component.size() * shape.multiplicity();
        let count = usize::try_from(accessor.count.0).ok().filter(|&count| count > 0 && count <= u32::MAX as usize);
        let Some(count) = count else {
            return Err(object.invalid("count", accessor.count.0, "expected 1 to 4294967295"));
        };
        let base = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = buffers.view(document, view, &object, "bufferView")?;
                let offset = accessor.byte_offset.unwrap_or_default().0;
                Some(Elements::new(bytes, offset, stride, size, count, &object, "")?)
            }
            None => None,
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(Sparse::open(document, buffers, sparse, size, count, &object)?),
            None => None,
        };
        Ok(Accessor { object, count, component, normalized: accessor.normalized, base, sparse })
    }

    /// Bytes of element `i`; `None` for one of zeros. `i` is below `count`.
    fn element(&self, i: usize) -> Option<&'a [u8]> {
        if let Some(sparse) = &self.sparse
            && let Ok(at) = sparse.indices.binary_search(&(i as u32))
        {
            return Some(sparse.values.get(at));
        }
        self.base.as_ref().map(|base| base.get(i))
    }

    /// Element `i` of an array of vectors or of texture coordinates (\[glTF\] 3.11.1, "Animations": its formulas for
    /// integers hold everywhere).
    pub(super) fn vector<const N: usize>(&self, i: usize) -> [f32; N] {
        let Some(bytes) = self.element(i) else { return [0.0; N] };
        std::array::from_fn(|axis| {
            let bits = unsigned(&bytes[axis * self.component.size()..], self.component);
            let (integer, largest) = match self.component {
                ComponentType::I8 => (f32::from(bits as u8 as i8), 127.0),
                ComponentType::U8 => (bits as f32, 255.0),
                ComponentType::I16 => (f32::from(bits as u16 as i16), 32767.0),
                ComponentType::U16 => (bits as f32, 65535.0),
                ComponentType::U32 | ComponentType::F32 => return f32::from_bits(bits),
            };
            if self.normalized { (integer / largest).max(-1.0) } else { integer }
        })
    }

    /// Element `i` of an array of indices.
    pub(super) fn index(&self, i: usize) -> u32 {
        self.element(i).map_or(0, |bytes| unsigned(bytes, self.component))
    }
}

/// The little-endian number that `bytes` begin with.
fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    let mut word = [0; 4];
    let size = component.size();
    word[..size].copy_from_slice(&bytes[..size]);
    u32::from_le_bytes(word)
}

impl<'a> Elements<'a> {
    /// `part` of the accessor `object`, "" for the whole.
    fn new(
        view: &'a [u8],
        offset: u64,
        stride: Option<usize>,
        size: usize,
        count: usize,
        object: &Object,
        part: &str,
    ) -> Result<Self, GltfError> {
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(object.invalid("byteStride of its bufferView", stride, format!("an element has {size} bytes")));
        }
        let bytes = usize::try_from(offset).ok().and_then(|start| view.get(start..)).filter(|bytes| {
            let last = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(size));
            last.is_some_and(|last| last <= bytes.len())
        });
        match bytes {
            Some(bytes) => Ok(Elements { bytes, stride, size }),
            None => Err(object.invalid(
                format!("{part}byteOffset, {part}count"),
                format!("{offset}, {count}"),
                format!("{} bytes of its bufferView cannot hold {size} bytes each {stride}", view.len()),
            )),
        }
    }

    fn get(&self, i: usize) -> &'a [u8] {
        &self.bytes[i * self.stride..][..self.size]
    }
}

impl<'a> Sparse<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers,
        sparse: &json::accessor::sparse::Sparse,
        size: usize,
        whole: usize,
        object: &Object,
    ) -> Result<Self, GltfError> {
        let count = usize::try_from(sparse.count.0).ok().filter(|&count| count > 0 && count <= whole);
        let Some(count) = count else {
            return Err(object.invalid("sparse.count", sparse.count.0, format!("expected 1 to {whole}")));
        };
        let Checked::Valid(component) = sparse.indices.component_type else {
            let pointer = format!("/accessors/{}/sparse/indices/componentType", object.index.unwrap_or_default());
            let value = document.literal(&pointer);
            return Err(object.invalid("sparse.indices.componentType", value, "expected 5121, 5123 or 5125"));
        };
        let component = component.0;
        let part = |view, field: &str, offset, size| -> Result<Elements<'a>, GltfError> {
            let (bytes, stride) = buffers.view(document, view, object, &format!("{field}bufferView"))?;
            if let Some(stride) = stride {
                return Err(object.invalid(format!("{field}bufferView.byteStride"), stride, "expected none"));
            }
            Elements::new(bytes, offset, None, size, count, object, field)
        };
        let indices = &sparse.indices;
        let indices = part(indices.buffer_view, "sparse.indices.", indices.byte_offset.0, component.size())?;
        let values = part(sparse.values.buffer_view, "sparse.values.", sparse.values.byte_offset.0, size)?;
        let mut list = super::budget::reserve(count, object)?;
        for i in 0..count {
            let index = unsigned(indices.get(i), component);
            if index as usize >= whole || list.last().is_some_and(|&last| last >= index) {
                let expected = format!("expected more than the one before and less than {whole}");
                return Err(object.invalid(format!("sparse.indices[{i}]"), index, expected));
            }
            list.push(index);
        }
        Ok(Sparse { indices: list, values })
    }
}
