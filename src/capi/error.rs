//! Result codes and their details. What went wrong is kept per thread: a slot per device would be
//! overwritten by other threads before its owner could read it.

use super::device::DevicePointer;
use super::guard;
use super::pointer::{OutStruct, Sized32};
use crate::render::RenderError;
use crate::scene::SceneError;
use std::cell::RefCell;
use std::ffi::c_char;

/// Done.
pub const OK: i32 = 0;
/// Not finished within the time given.
pub const TIMEOUT: i32 = 1;
/// Cancelled; whole passes are valid.
pub const CANCELLED: i32 = 2;
/// A value is not acceptable.
pub const ERROR_INVALID_ARGUMENT: i32 = -1;
/// A null, released, foreign or mistyped handle.
pub const ERROR_INVALID_HANDLE: i32 = -2;
/// Not now: the object is in a state that does not allow the call.
pub const ERROR_WRONG_STATE: i32 = -3;
/// This build cannot do it.
pub const ERROR_UNSUPPORTED: i32 = -4;
/// An allocation failed.
pub const ERROR_OUT_OF_MEMORY: i32 = -5;
/// A file could not be read or written.
pub const ERROR_IO: i32 = -6;
/// Header and library do not go together.
pub const ERROR_INCOMPATIBLE_VERSION: i32 = -7;
/// A bug in the library: a caught panic.
pub const ERROR_INTERNAL: i32 = -8;
/// Another thread is working on the object.
pub const ERROR_BUSY: i32 = -9;
/// More than the library can hold.
pub const ERROR_LIMIT: i32 = -10;
/// The ray tracer failed.
pub const ERROR_BACKEND: i32 = -11;

/// No element of a list is concerned.
pub const NO_INDEX: u64 = u64::MAX;

/// No object is concerned.
pub const OBJECT_NONE: u32 = 0;
/// A device.
pub const OBJECT_DEVICE: u32 = 1;
/// A mesh.
pub const OBJECT_MESH: u32 = 2;
/// A material.
pub const OBJECT_MATERIAL: u32 = 3;
/// A scene.
pub const OBJECT_SCENE: u32 = 4;
/// An instance.
pub const OBJECT_INSTANCE: u32 = 5;
/// A light.
pub const OBJECT_LIGHT: u32 = 6;
/// A camera.
pub const OBJECT_CAMERA: u32 = 7;
/// A render.
pub const OBJECT_RENDER: u32 = 8;
/// A texture.
pub const OBJECT_TEXTURE: u32 = 9;

/// `caustica_detail`: what happened, in a form for programs and in one for people. Text that does not
/// fit is cut at the end of a character.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Detail {
    /// Size of the host's struct.
    pub struct_size: u32,
    /// Result code.
    pub code: i32,
    /// Kind of the object concerned.
    pub object_kind: u32,
    /// Zero.
    pub reserved: u32,
    /// Its handle's id; 0 if it has none.
    pub object_id: u64,
    /// Element of the list that `parameter` names.
    pub index: u64,
    /// The object's name.
    pub object_name: [c_char; 64],
    /// The parameter or field concerned.
    pub parameter: [c_char; 64],
    /// A sentence.
    pub text: [c_char; 512],
}

// SAFETY: `repr(C)`, `u32` first, integers only.
unsafe impl Sized32 for Detail {
    const NAME: &'static str = "caustica_detail";
    const FIRST_SIZE: usize = 672;
}

/// A call that failed, or a remark that goes the same way.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub(super) code: i32,
    pub(super) object_kind: u32,
    pub(super) object_id: u64,
    pub(super) object_name: String,
    pub(super) parameter: String,
    pub(super) index: u64,
    pub(super) text: String,
    /// Whether it was sent as a message, or is none for it.
    pub(super) told: bool,
}

impl Failure {
    /// Neither object nor parameter.
    pub(super) fn new(code: i32, text: impl Into<String>) -> Failure {
        Failure {
            code,
            object_kind: OBJECT_NONE,
            object_id: 0,
            object_name: String::new(),
            parameter: String::new(),
            index: NO_INDEX,
            text: text.into(),
            told: false,
        }
    }

    /// What a host that asks again and again runs into is returned, and no message.
    pub(super) fn expected(self) -> Failure {
        Failure { told: true, ..self }
    }

    fn of_parameter(code: i32, parameter: &str, text: impl AsRef<str>) -> Failure {
        let text = format!("{parameter} {}", text.as_ref());
        Failure { parameter: parameter.to_owned(), ..Failure::new(code, text) }
    }

    /// `parameter` followed by what is wrong with it.
    pub(super) fn argument(parameter: &str, text: impl AsRef<str>) -> Failure {
        Failure::of_parameter(ERROR_INVALID_ARGUMENT, parameter, text)
    }

    /// Too much of `parameter`.
    pub(super) fn limit(parameter: &str, text: impl AsRef<str>) -> Failure {
        Failure::of_parameter(ERROR_LIMIT, parameter, text)
    }

    /// `parameter` cannot be stored.
    pub(super) fn out_of_memory(parameter: &str, text: impl AsRef<str>) -> Failure {
        Failure::of_parameter(ERROR_OUT_OF_MEMORY, parameter, text)
    }

    /// `parameter` was written for another version.
    pub(super) fn incompatible(parameter: &str, text: impl AsRef<str>) -> Failure {
        Failure::of_parameter(ERROR_INCOMPATIBLE_VERSION, parameter, text)
    }

    /// A bug.
    pub(super) fn internal(text: impl AsRef<str>) -> Failure {
        Failure::new(ERROR_INTERNAL, format!("internal error: {}", text.as_ref()))
    }

    /// With the element concerned.
    pub(super) fn at(self, index: u64) -> Failure {
        Failure { text: format!("{} (element {index})", self.text), index, ..self }
    }

    /// With the object concerned.
    pub(super) fn object(self, kind: u32, id: u64, name: &str) -> Failure {
        Failure { object_kind: kind, object_id: id, object_name: name.to_owned(), ..self }
    }

    /// With an object where none is named yet.
    pub(super) fn object_if_none(self, kind: u32, id: u64, name: &str) -> Failure {
        if self.object_kind == OBJECT_NONE { self.object(kind, id, name) } else { self }
    }

    /// For the host.
    pub(super) fn detail(&self) -> Detail {
        Detail {
            struct_size: size_of::<Detail>() as u32,
            code: self.code,
            object_kind: self.object_kind,
            reserved: 0,
            object_id: self.object_id,
            index: self.index,
            object_name: chars(&self.object_name),
            parameter: chars(&self.parameter),
            text: chars(&self.text),
        }
    }
}

/// `text` as a NUL-terminated array, cut at a character's end. A NUL inside ends it too.
pub(super) fn chars<const N: usize>(text: &str) -> [c_char; N] {
    let mut end = text.len().min(N - 1);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut array = [0; N];
    for (to, &from) in array.iter_mut().zip(&text.as_bytes()[..end]) {
        *to = from as c_char;
    }
    array
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Failure {
        let text = error.to_string();
        match error {
            RenderError::Setting { setting, .. } => {
                Failure { parameter: setting.replace(' ', "_"), ..Failure::new(ERROR_INVALID_ARGUMENT, text) }
            }
            // It has no handle.
            RenderError::View(error) => Origins::default().explain(error),
            RenderError::OutOfMemory { .. } | RenderError::OutOfMemoryForTechniques { .. } => {
                Failure::new(ERROR_OUT_OF_MEMORY, text)
            }
            RenderError::Threads { .. } => Failure::of_parameter(ERROR_LIMIT, "num_threads", text),
            RenderError::Internal(_) => Failure::new(ERROR_INTERNAL, text),
        }
    }
}

/// Where the objects of a description came from: their handles' ids, by index.
#[derive(Clone, Debug, Default)]
pub(super) struct Origins {
    pub(super) meshes: Vec<u64>,
    pub(super) materials: Vec<u64>,
    pub(super) instances: Vec<u64>,
    pub(super) lights: Vec<u64>,
    pub(super) cameras: Vec<u64>,
}

impl Origins {
    /// Says of which object of the host a scene error speaks. What concerns the scene as a whole
    /// keeps no object.
    pub(super) fn explain(&self, mut error: SceneError) -> Failure {
        if let SceneError::Invalid { kind, field, .. } = &mut error {
            *field = host_name(kind, field);
        }
        let text = error.to_string();
        match error {
            SceneError::Invalid { kind, index, name, field, .. } => {
                let (object, ids) = match kind {
                    "mesh" => (OBJECT_MESH, &self.meshes),
                    "material" => (OBJECT_MATERIAL, &self.materials),
                    "instance" => (OBJECT_INSTANCE, &self.instances),
                    "light" => (OBJECT_LIGHT, &self.lights),
                    "camera" => (OBJECT_CAMERA, &self.cameras),
                    _ => return Failure { parameter: field, ..Failure::new(ERROR_INVALID_ARGUMENT, text) },
                };
                let id = ids.get(index).copied().unwrap_or(0);
                let index = first_subscript(&field).unwrap_or(NO_INDEX);
                Failure { parameter: field, index, ..Failure::new(ERROR_INVALID_ARGUMENT, text) }
                    .object(object, id, &name)
            }
            SceneError::TooLarge(_) => Failure::new(ERROR_LIMIT, text),
            SceneError::OutOfMemory(_) => Failure::new(ERROR_OUT_OF_MEMORY, text),
            SceneError::Backend(_) => Failure::new(ERROR_BACKEND, text),
        }
    }
}

/// What the structs of the header call the fields of a description, where that differs: (kind, ours, theirs).
const FIELDS: [(&str, &str, &str); 21] = [
    ("environment", "rotation", "transform"),
    ("instance", "transform.translation", "transform"),
    ("camera", "transform.translation", "transform"),
    ("material", "reflectance", "color"),
    ("material", "tint", "color"),
    ("material", "base_color", "color"),
    ("material", "inside.ior", "ior"),
    ("material", "inside.absorption", "absorption"),
    ("material", "inside.abbe", "abbe_number"),
    ("material", "outside.abbe", "abbe_number_outside"),
    ("material", "abbe", "abbe_number"),
    ("material", "outside.ior", "ior_outside"),
    ("material", "outside.absorption", "absorption_outside"),
    ("material", "textures.color", "color_texture"),
    ("material", "textures.emission", "emission_texture"),
    ("material", "textures.normal.scale", "normal_scale"),
    ("material", "textures.normal", "normal_texture"),
    ("material", "textures.metallic_roughness", "metallic_roughness_texture"),
    ("light", "irradiance", "intensity"),
    ("light", "inner", "inner_angle"),
    ("light", "outer", "outer_angle"),
];

/// A field of an object, as the header names it.
fn host_name(kind: &str, field: &str) -> String {
    // `triangles[2][1]` is `indices[7]`.
    if let Some((triangle, corner)) =
        field.strip_prefix("triangles[").and_then(|f| f.strip_suffix(']')?.split_once("]["))
        && let (Ok(triangle), Ok(corner)) = (triangle.parse::<u64>(), corner.parse::<u64>())
    {
        return format!("indices[{}]", 3 * triangle + corner);
    }
    let renamed = FIELDS.iter().filter(|(of, ..)| *of == kind).find_map(|(_, ours, theirs)| {
        let rest = field.strip_prefix(ours).filter(|rest| rest.is_empty() || rest.starts_with('.'))?;
        Some(format!("{theirs}{rest}"))
    });
    renamed.unwrap_or_else(|| field.to_owned())
}

/// The 3 of `positions[3].y`.
fn first_subscript(field: &str) -> Option<u64> {
    field.split_once('[')?.1.split_once(']')?.0.parse().ok()
}

thread_local! {
    /// The last failed call of this thread. Per thread because only the caller knows which call it
    /// asks about; one slot because only the last is asked for.
    static LAST: RefCell<Option<(DevicePointer, Failure)>> = const { RefCell::new(None) };
}

/// Keeps a failure for [`caustica_last_error`]. A thread that is ending may have no slot any more.
pub(super) fn remember(device: DevicePointer, failure: Failure) {
    let _ = LAST.try_with(|last| last.replace(Some((device, failure))));
}

/// What this thread remembers.
#[cfg(test)]
pub(super) fn last() -> Option<Failure> {
    LAST.with_borrow(|last| last.as_ref().map(|(_, failure)| failure.clone()))
}

guard::export! {
    /// The calling thread's last failed call.
    quiet fn caustica_last_error(device: DevicePointer, detail: OutStruct<Detail>) = last_error;
}

fn last_error(device: DevicePointer, detail: OutStruct<Detail>) -> Result<i32, Failure> {
    let place = detail.required("detail")?;
    let last = LAST.try_with(|last| last.borrow().clone()).unwrap_or(None);
    let matching = last.filter(|(of, _)| device.is_null() || *of == device);
    place.write(&matching.map_or_else(|| Failure::new(OK, ""), |(_, failure)| failure).detail());
    Ok(OK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_cut_between_characters() {
        let cut: [c_char; 4] = chars("aéé");
        assert_eq!(cut.map(|c| c as u8), [b'a', 0xc3, 0xa9, 0]);
        let cut: [c_char; 4] = chars("aaéé");
        assert_eq!(cut.map(|c| c as u8), [b'a', b'a', 0, 0]);
    }

    #[test]
    fn a_scene_error_names_the_object_of_the_host() {
        let origins = Origins { meshes: vec![5, 77], ..Origins::default() };
        let failure = origins.explain(SceneError::Invalid {
            kind: "mesh",
            index: 1,
            name: "floor".into(),
            field: "positions[3].y".into(),
            value: "NaN".into(),
            expected: "a finite number was expected".into(),
        });
        assert_eq!((failure.code, failure.object_kind, failure.object_id), (ERROR_INVALID_ARGUMENT, OBJECT_MESH, 77));
        assert_eq!((failure.object_name.as_str(), failure.parameter.as_str()), ("floor", "positions[3].y"));
        assert_eq!(failure.index, 3);
    }

    #[test]
    fn fields_have_the_names_of_the_header() {
        for (kind, ours, theirs) in [
            ("material", "reflectance.g", "color.g"),
            ("material", "inside.ior", "ior"),
            ("material", "outside.absorption.b", "absorption_outside.b"),
            ("material", "roughness", "roughness"),
            ("material", "textures.normal", "normal_texture"),
            ("material", "textures.normal.scale", "normal_scale"),
            ("light", "outer", "outer_angle"),
            ("mesh", "triangles[2][1]", "indices[7]"),
            ("mesh", "positions[3].y", "positions[3].y"),
        ] {
            assert_eq!(host_name(kind, ours), theirs);
        }
        let header = include_str!("../../include/caustica.h");
        for (_, _, theirs) in FIELDS {
            assert!(header.contains(&format!(" {theirs};")) || header.contains(&format!(" {theirs}[")), "{theirs}");
        }
        let failure = Origins::default().explain(SceneError::Invalid {
            kind: "light",
            index: 0,
            name: "spot".into(),
            field: "outer".into(),
            value: "7".into(),
            expected: "at most 1".into(),
        });
        assert!(failure.text.contains("outer_angle") && failure.parameter == "outer_angle", "{}", failure.text);
    }
}
