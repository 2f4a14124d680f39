//! Walks parsed JSON and remembers the path, so that every refusal names its place:
//! `panels[2].edges[0].endpoints[1]: must be a whole number from 0 to 4294967295, is -1`.

use super::schema::Key;
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

/// Longest JSON text accepted [bytes].
pub const MAX_TEXT: usize = 256 << 20;

/// The value, or nothing where the problem was put aside.
pub fn keep<T>(problems: &mut Vec<Error>, result: Result<T>) -> Option<T> {
    result.map_err(|e| problems.push(e)).ok()
}

/// Parses JSON text; nesting above 128 levels, numbers beyond f64, keys given twice and bad syntax are refused.
pub fn parse(text: &str) -> Result<Value> {
    if text.len() > MAX_TEXT {
        return Err(Error::limit(format!(
            "JSON text of {} bytes, limit {MAX_TEXT}",
            text.len()
        )));
    }
    let strict: Strict =
        serde_json::from_str(text).map_err(|e| Error::parse(format!("not valid JSON: {e}")))?;
    Ok(strict.0)
}

/// A value without keys given twice, of which all but one would be lost.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        from.deserialize_any(StrictVisitor).map(Self)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> std::result::Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_string<E>(self, value: String) -> std::result::Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> std::result::Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(Strict(item)) = from.next_element()? {
            items.push(item);
        }
        Ok(items.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut from: A) -> std::result::Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = from.next_key::<String>()? {
            if map.contains_key(&key) {
                let text = format!("key '{}' is given twice", shown(&key));
                return Err(serde::de::Error::custom(text));
            }
            let Strict(value) = from.next_value()?;
            map.insert(key, value);
        }
        Ok(map.into())
    }
}

/// A JSON value and where it stands.
#[derive(Clone, Debug)]
pub struct Node<'a> {
    /// The value.
    pub value: &'a Value,
    /// Its path from the root, empty for the root.
    pub path: String,
}

/// A JSON object and where it stands.
#[derive(Clone, Debug)]
pub struct Object<'a> {
    map: &'a Map<String, Value>,
    /// Its path from the root.
    pub path: String,
}

fn kind(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Bool(b) => format!("{b}"),
        Value::Number(n) => format!("{n}"),
        Value::String(s) => {
            let short: String = s.chars().take(40).collect();
            format!("the text {short:?}")
        }
        Value::Array(a) => format!("an array of {}", a.len()),
        Value::Object(o) => format!("an object of {} keys", o.len()),
    }
}

/// Key as it stands in a path: shortened, without control characters.
fn shown(key: &str) -> String {
    key.chars()
        .take(60)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect()
}

impl<'a> Node<'a> {
    /// The root of a text, or of a part of one under `path`.
    pub fn new(value: &'a Value, path: impl Into<String>) -> Self {
        Self {
            value,
            path: path.into(),
        }
    }

    /// An error at this place.
    pub fn error(&self, text: impl std::fmt::Display) -> Error {
        let path = if self.path.is_empty() {
            "top level"
        } else {
            &self.path
        };
        Error::parse(format!("{path}: {text}"))
    }

    fn expected(&self, what: &str) -> Error {
        self.error(format!("must be {what}, is {}", kind(self.value)))
    }

    /// As an object.
    pub fn object(&self) -> Result<Object<'a>> {
        match self.value {
            Value::Object(map) => Ok(Object {
                map,
                path: self.path.clone(),
            }),
            _ => Err(self.expected("an object")),
        }
    }

    /// As an array of any length.
    pub fn array(&self) -> Result<Vec<Node<'a>>> {
        match self.value {
            Value::Array(items) => Ok(items
                .iter()
                .enumerate()
                .map(|(k, value)| Node {
                    value,
                    path: format!("{}[{k}]", self.path),
                })
                .collect()),
            _ => Err(self.expected("an array")),
        }
    }

    /// As an array of exactly `N` entries.
    pub fn array_of<const N: usize>(&self) -> Result<[Node<'a>; N]> {
        let items = self.array()?;
        let count = items.len();
        items
            .try_into()
            .map_err(|_| self.error(format!("must have {N} entries, has {count}")))
    }

    /// As a finite number.
    pub fn number(&self) -> Result<f64> {
        match self.value.as_f64() {
            Some(x) if x.is_finite() => Ok(x),
            _ => Err(self.expected("a finite number")),
        }
    }

    /// As a whole number that fits `u32`.
    pub fn index(&self) -> Result<u32> {
        self.value
            .as_u64()
            .and_then(|x| u32::try_from(x).ok())
            .ok_or_else(|| self.expected("a whole number from 0 to 4294967295"))
    }

    /// As true or false.
    pub fn boolean(&self) -> Result<bool> {
        self.value
            .as_bool()
            .ok_or_else(|| self.expected("true or false"))
    }

    /// As text.
    pub fn text(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.expected("text"))
    }

    /// As a pair of numbers.
    pub fn vec2(&self) -> Result<Vec2> {
        let [x, y] = self.array_of::<2>()?;
        Ok(Vec2::new(x.number()?, y.number()?))
    }

    /// As three numbers.
    pub fn vec3(&self) -> Result<Vec3> {
        let [x, y, z] = self.array_of::<3>()?;
        Ok(Vec3::new(x.number()?, y.number()?, z.number()?))
    }
}

impl<'a> Object<'a> {
    /// The object as a node, to report errors on it.
    pub fn error(&self, text: impl std::fmt::Display) -> Error {
        let path = if self.path.is_empty() {
            "top level"
        } else {
            &self.path
        };
        Error::parse(format!("{path}: {text}"))
    }

    /// Refuses keys that `keys` does not list.
    pub fn only(&self, keys: &[Key]) -> Result<()> {
        for key in self.map.keys() {
            if !keys.iter().any(|k| k.name == key) {
                let known: Vec<&str> = keys.iter().map(|k| k.name).collect();
                return Err(Error::parse(format!(
                    "{}: unknown key; known here: {}",
                    self.join(key),
                    known.join(", ")
                )));
            }
        }
        Ok(())
    }

    fn join(&self, key: &str) -> String {
        let key = shown(key);
        if self.path.is_empty() {
            key
        } else {
            format!("{}.{key}", self.path)
        }
    }

    /// The value of a key, if there; `null` counts as not there.
    pub fn get(&self, key: &str) -> Option<Node<'a>> {
        match self.map.get(key) {
            None | Some(Value::Null) => None,
            Some(value) => Some(Node {
                value,
                path: self.join(key),
            }),
        }
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &str) -> Result<Node<'a>> {
        self.get(key)
            .ok_or_else(|| self.error(format!("key '{key}' is missing")))
    }

    /// A number, or `default` where the key is absent.
    pub fn number_or(&self, key: &str, default: f64) -> Result<f64> {
        self.get(key).map_or(Ok(default), |node| node.number())
    }

    /// True or false, or `default` where the key is absent.
    pub fn boolean_or(&self, key: &str, default: bool) -> Result<bool> {
        self.get(key).map_or(Ok(default), |node| node.boolean())
    }

    /// All keys with their values, in the order of the file.
    pub fn entries(&self) -> impl Iterator<Item = (&'a str, Node<'a>)> + '_ {
        self.map.iter().map(|(key, value)| {
            (
                key.as_str(),
                Node {
                    value,
                    path: self.join(key),
                },
            )
        })
    }

    /// Whether the key is there at all.
    pub fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_text_and_keys_stand_once() {
        let text =
            r#"{"b": [1, -2, 0.1, 1e-7, true, null, "x"], "a": {"k": 18446744073709551615}}"#;
        let strict = parse(text).unwrap();
        assert_eq!(strict, serde_json::from_str::<Value>(text).unwrap());
        assert_eq!(
            strict.to_string(),
            text.replace(", ", ",").replace(": ", ":")
        );
        let error = parse("{\"a\": [{\"k\": 1,\n \"k\": 2}]}")
            .unwrap_err()
            .message;
        assert!(error.contains("'k' is given twice at line 2"), "{error}");
    }
}
