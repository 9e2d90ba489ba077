//! What a file says about how its pixels were made.

use super::Failure;
use crate::render::{Region, Settings, Statistics};

/// Who made the file.
pub(super) const SOFTWARE: &str = concat!("caustica ", env!("CARGO_PKG_VERSION"));

/// CIE xy of red, green, blue and white (ITU-R BT.709).
pub(super) const REC709: [(f32, f32); 4] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];

/// The value of one entry.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// UTF-8, without NUL.
    Text(String),
    /// EXR has no wider integer: what does not fit belongs into a text.
    Int(i32),
    /// A number.
    Float(f32),
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::Text(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Value::Text(text)
    }
}

impl From<i32> for Value {
    fn from(number: i32) -> Self {
        Value::Int(number)
    }
}

impl From<f32> for Value {
    fn from(number: f32) -> Self {
        Value::Float(number)
    }
}

/// An integer if EXR can hold it as one, else its digits.
impl From<u32> for Value {
    fn from(number: u32) -> Self {
        i32::try_from(number).map_or_else(|_| Value::Text(number.to_string()), Value::Int)
    }
}

/// Always its digits: a seed keeps its type whatever its size.
impl From<u64> for Value {
    fn from(number: u64) -> Self {
        Value::Text(number.to_string())
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Text(text) => f.write_str(text),
            Value::Int(number) => number.fmt(f),
            Value::Float(number) => number.fmt(f),
        }
    }
}

/// Entries in the order in which they were set.
///
/// An EXR file holds each as an attribute `caustica:<key>`, which cannot collide with the names the
/// format reserves; the other formats hold all of them as lines of the image description. Every
/// file also names the software and its version, and an EXR file the chromaticities of Rec. 709.
///
/// Keys in use: `samples`, `seed`, `settings`, `scene-hash`, `backend`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    entries: Vec<(&'static str, Value)>,
    window: Option<Window>,
}

/// Where the image is in a larger one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) data: Region,
    /// Columns and rows of the larger one.
    pub(super) frame: [u32; 2],
}

impl Metadata {
    /// No entry.
    pub fn new() -> Self {
        Metadata::default()
    }

    /// How an image was made. `camera` is the camera's name.
    pub fn of_render(settings: &Settings, camera: &str, scene_hash: u64, statistics: &Statistics) -> Self {
        let mut metadata = Metadata::new();
        if let Some(region) = settings.region {
            metadata.set_window(region, settings.width, settings.height);
        }
        // A name may hold anything; the formats' texts do not take NUL.
        let text = format!("{} camera={camera:?}", settings.describe());
        metadata
            .set("samples", statistics.samples)
            .set("seed", settings.seed)
            .set("settings", text)
            .set("scene-hash", format!("{scene_hash:016x}"))
            .set("backend", statistics.backend.as_str());
        metadata
    }

    /// Sets an entry, in place of an older one of the same key.
    pub fn set(&mut self, key: &'static str, value: impl Into<Value>) -> &mut Self {
        let value = value.into();
        match self.entries.iter_mut().find(|(known, _)| *known == key) {
            Some(entry) => entry.1 = value,
            None => self.entries.push((key, value)),
        }
        self
    }

    /// The image is that region of a frame of so many pixels: EXR and TIFF files say so by their windows.
    pub fn set_window(&mut self, region: Region, width: u32, height: u32) -> &mut Self {
        self.window = Some(Window { data: region, frame: [width, height] });
        self
    }

    /// That, or all of an image of this size.
    pub(super) fn window(&self, width: u32, height: u32) -> Window {
        self.window.unwrap_or(Window { data: Region::all(width, height), frame: [width, height] })
    }

    /// The entries.
    pub fn entries(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.entries.iter().map(|(key, value)| (*key, value))
    }

    /// Refuses texts that a format would cut short, and a window that is not the image's.
    pub(super) fn check(&self, width: u32, height: u32) -> Result<(), Failure> {
        if let Some(Window { data, frame: [columns, rows] }) = self.window
            && !((data.width, data.height) == (width, height)
                && data.is_within(columns, rows)
                && columns.max(rows) <= i32::MAX as u32)
        {
            let reason = format!("an image of {width}x{height} is not {data} of {columns}x{rows}");
            return Err(Failure::Unsupported(reason));
        }
        match self.entries().find(|(_, value)| matches!(value, Value::Text(text) if text.contains('\0'))) {
            Some((key, _)) => Err(Failure::Unsupported(format!("the metadata '{key}' contains a NUL character"))),
            None => Ok(()),
        }
    }

    /// The names and values of EXR attributes, the version of this library first.
    pub(super) fn attributes(&self) -> impl Iterator<Item = (String, Value)> {
        let version = ("version", Value::from(env!("CARGO_PKG_VERSION")));
        let own = self.entries().map(|(key, value)| (key, value.clone()));
        std::iter::once(version).chain(own).map(|(key, value)| (format!("caustica:{key}"), value))
    }

    /// All entries as text, one per line, cut after `limit` bytes at a whole character.
    pub(super) fn description(&self, limit: usize) -> String {
        let lines: Vec<String> = self.entries().map(|(key, value)| format!("{key}: {value}")).collect();
        let mut text = lines.join("\n");
        let end = (0..=limit.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        text.truncate(end);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_value_of_a_key_stays_at_its_first_place() {
        let mut metadata = Metadata::new();
        metadata.set("samples", 64u32).set("seed", u64::MAX).set("samples", u32::MAX);
        let entries: Vec<_> = metadata.entries().collect();
        assert_eq!(
            entries,
            [("samples", &Value::Text("4294967295".into())), ("seed", &Value::Text("18446744073709551615".into()))]
        );
        assert_eq!(metadata.description(99), "samples: 4294967295\nseed: 18446744073709551615");
        metadata.set("samples", "ä");
        assert_eq!(metadata.description(10), "samples: ");
    }
}
