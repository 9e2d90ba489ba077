//! `extras.caustica`: what glTF has no word for.

use super::error::{GltfError, Object};
use crate::text::shown;
use gltf::json::Extras;
use serde_json::{Map, Value};

/// The `caustica` entry of an object's extras. Keys are taken out as they are read; the rest is
/// reported by [`Self::finish`].
pub(super) struct Caustica<'a> {
    object: &'a Object,
    map: Map<String, Value>,
}

impl<'a> Caustica<'a> {
    /// Empty if there is none.
    pub(super) fn of(extras: &Extras, object: &'a Object) -> Result<Self, GltfError> {
        // Extras may be large and are somebody else's: only text that names us is parsed.
        let text = extras.as_ref().map(|raw| raw.get()).filter(|text| text.contains("\"caustica\""));
        let value = match text {
            Some(text) => serde_json::from_str::<Value>(text)
                .map_err(|e| object.invalid("extras", "unreadable", e))?
                .get_mut("caustica")
                .map(Value::take),
            None => None,
        };
        // Programs whose properties are texts write one.
        let value = match value {
            Some(Value::String(text)) => Some(serde_json::from_str(&text).unwrap_or(Value::String(text))),
            value => value,
        };
        match value {
            Some(Value::Object(map)) => Ok(Caustica { object, map }),
            Some(value) => Err(object.invalid("extras.caustica", value, "expected an object")),
            None => Ok(Caustica { object, map: Map::new() }),
        }
    }

    /// A number.
    pub(super) fn number(&mut self, key: &str) -> Result<Option<f64>, GltfError> {
        self.map.remove(key).map(|value| self.to_number(key, &value)).transpose()
    }

    /// A text.
    pub(super) fn text(&mut self, key: &str) -> Result<Option<String>, GltfError> {
        let Some(value) = self.map.remove(key) else { return Ok(None) };
        match value {
            Value::String(text) => Ok(Some(text)),
            _ => Err(self.object.invalid(format!("extras.caustica.{key}"), value, "expected a text")),
        }
    }

    /// So many numbers.
    pub(super) fn list<const N: usize>(&mut self, key: &str) -> Result<Option<[f32; N]>, GltfError> {
        let Some(value) = self.map.remove(key) else { return Ok(None) };
        let Some(values) = value.as_array().filter(|values| values.len() == N) else {
            let expected = format!("expected a list of {N} numbers");
            return Err(self.object.invalid(format!("extras.caustica.{key}"), value, expected));
        };
        let mut list = [0.0; N];
        for (i, value) in values.iter().enumerate() {
            let field = format!("extras.caustica.{key}[{i}]");
            list[i] = self.object.finite(&field, self.to_number(key, value)? as f32)?;
        }
        Ok(Some(list))
    }

    /// `{"sphere": {"radius": r}}`.
    pub(super) fn sphere_radius(&mut self) -> Result<Option<f64>, GltfError> {
        let Some(sphere) = self.map.remove("sphere") else { return Ok(None) };
        let field = "sphere.radius";
        let radius = match sphere.get("radius") {
            Some(radius) => self.to_number(field, radius)?,
            None => return Err(self.object.invalid("extras.caustica.sphere", sphere, "expected {\"radius\": number}")),
        };
        if radius > 0.0 {
            Ok(Some(radius))
        } else {
            Err(self.object.invalid(format!("extras.caustica.{field}"), radius, "expected a positive number"))
        }
    }

    /// Warns about what nobody asked for: likely a misspelling.
    pub(super) fn finish(self, warnings: &mut Vec<String>) {
        for key in self.map.keys() {
            warnings.push(format!("{}: extras.caustica.{} is unknown and ignored", self.object, shown(key)));
        }
    }

    fn to_number(&self, key: &str, value: &Value) -> Result<f64, GltfError> {
        let number = value.as_f64().filter(|x| x.is_finite());
        number.ok_or_else(|| self.object.invalid(format!("extras.caustica.{key}"), value, "expected a number"))
    }
}
