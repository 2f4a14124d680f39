//! The tables of keys as text for people and as a JSON Schema document.

use super::{FILE, SCENE, VERSION, tables};
use crate::pattern::import::schema::Key;
use crate::solve::settings::Settings;
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// The schema as text for people.
pub fn text() -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "Scene files of toile {}, format version {VERSION}. SI units. Keys that are not listed are refused.",
        env!("CARGO_PKG_VERSION")
    );
    for (path, keys) in tables() {
        let _ = writeln!(out, "\n{}", if path.is_empty() { "scene" } else { path });
        for k in keys {
            let unit = if k.unit.is_empty() {
                String::new()
            } else {
                format!(" [{}]", k.unit)
            };
            let _ = writeln!(
                out,
                "  {:<18} {}{unit}, default: {}",
                k.name, k.kind, k.default
            );
            let _ = writeln!(out, "  {:<18}   {}", "", k.doc);
        }
    }
    let _ = writeln!(
        out,
        "\nnumbers (and the names of `--set` and of the C ABI's set_number)"
    );
    for k in Settings::KEYS {
        let unit = if k.unit == "1" {
            String::new()
        } else {
            format!(" [{}]", k.unit)
        };
        let _ = writeln!(
            out,
            "  {}\n      {}{unit}, default: {}, from {} to {}\n      {}",
            k.name,
            if k.whole { "whole number" } else { "number" },
            k.default,
            k.min,
            k.max,
            k.doc.trim()
        );
    }
    out
}

/// JSON Schema (draft 2020-12) type of a key.
fn json_type(kind: &str) -> Value {
    let vector = |n: usize, item: &str| json!({"type": "array", "items": {"type": item}, "minItems": n, "maxItems": n});
    match kind {
        "integer" => json!({"type": "integer"}),
        "number" => json!({"type": "number"}),
        "text" => json!({"type": "string"}),
        "boolean" => json!({"type": "boolean"}),
        "object" => json!({"type": "object"}),
        "text or array of text" => {
            json!({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]})
        }
        "text or integer" => json!({"type": ["string", "integer"]}),
        "[u, v]" => vector(2, "number"),
        "[x, y, z]" => vector(3, "number"),
        "[x, y, z, w]" => vector(4, "number"),
        "[integer, integer]" => vector(2, "integer"),
        "[integer, integer, integer]" => vector(3, "integer"),
        "array of text" => json!({"type": "array", "items": {"type": "string"}}),
        "array of numbers" => json!({"type": "array", "items": {"type": "number"}}),
        _ => json!({"type": "array"}),
    }
}

fn object_schema(path: &str, keys: &[Key]) -> Value {
    let mut properties = Map::new();
    let mut required = Vec::new();
    for k in keys {
        let child = if path.is_empty() {
            k.name.to_owned()
        } else {
            format!("{path}.{}", k.name)
        };
        let mut schema = nested(&child, k);
        if let Some(map) = schema.as_object_mut() {
            let unit = if k.unit.is_empty() {
                String::new()
            } else {
                format!(" [{}]", k.unit)
            };
            map.insert(
                "description".into(),
                json!(format!("{}{unit}; default: {}", k.doc, k.default)),
            );
        }
        // shapes of a body need different keys: only what all of them need is required here
        if k.default == "required" && !(path == "bodies[]" && k.name != "shape") {
            required.push(json!(k.name));
        }
        properties.insert(k.name.into(), schema);
    }
    json!({
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

/// The schema of a key's value, with the table of its object where there is one.
fn nested(path: &str, k: &Key) -> Value {
    let find = |wanted: &str| tables().find(|(p, _)| *p == wanted);
    if path == "numbers" {
        let numbers: Map<String, Value> = Settings::KEYS
            .iter()
            .map(|k| {
                let value = json!({
                    "type": if k.whole { "integer" } else { "number" }, "minimum": k.min, "maximum": k.max,
                    "default": k.default,
                    "description": format!("{} [{}]", k.doc.trim(), k.unit),
                });
                (k.name.to_owned(), value)
            })
            .collect();
        return json!({"type": "object", "properties": numbers, "additionalProperties": false});
    }
    if path == "garment" {
        let own = find("garment").map_or(json!({}), |(p, keys)| object_schema(p, keys));
        let file = object_schema("garment (a file)", FILE);
        let code = json!({"type": "object", "required": ["pattern"]});
        return json!({"anyOf": [own, file, code]});
    }
    if path == "fabrics" {
        return json!({"type": "object", "additionalProperties": {"type": "object"}});
    }
    if let Some((p, keys)) = find(path) {
        return object_schema(p, keys);
    }
    if let Some((p, keys)) = find(&format!("{path}[]")) {
        let item = object_schema(p, keys);
        // edges may be pairs, fabrics may be paths
        let item = match k.name {
            "edges" => json!({"anyOf": [item, {"type": "array"}]}),
            "fabrics" => json!({"anyOf": [item, {"type": "string"}]}),
            _ => item,
        };
        return json!({"type": "array", "items": item});
    }
    json_type(k.kind)
}

/// The schema as a JSON Schema document (draft 2020-12).
pub fn json_schema() -> Value {
    let mut schema = object_schema("", SCENE);
    if let Some(map) = schema.as_object_mut() {
        map.insert(
            "$schema".into(),
            json!("https://json-schema.org/draft/2020-12/schema"),
        );
        map.insert("title".into(), json!("toile scene"));
    }
    schema
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_stands_twice_and_each_has_a_meaning() {
        for (path, keys) in tables() {
            for (i, k) in keys.iter().enumerate() {
                assert!(
                    !k.doc.is_empty() && !k.default.is_empty(),
                    "{path}.{}",
                    k.name
                );
                assert!(
                    keys[..i].iter().all(|o| o.name != k.name),
                    "{path}.{}",
                    k.name
                );
            }
        }
    }

    #[test]
    fn text_and_json_schema_name_every_key() {
        let (text, json) = (text(), json_schema().to_string());
        for (path, keys) in tables() {
            for k in keys {
                assert!(
                    text.contains(k.name) && text.contains(k.doc),
                    "{path}.{}",
                    k.name
                );
                // a fabric in `fabrics` may be of two formats: left open in the JSON Schema
                assert!(
                    json.contains(&format!("\"{}\"", k.name)),
                    "{path}.{}",
                    k.name
                );
            }
        }
        for k in Settings::KEYS {
            assert!(text.contains(k.name) && json.contains(k.name), "{}", k.name);
        }
    }
}
