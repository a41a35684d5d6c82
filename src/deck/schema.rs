//! JSON Schema of decks, for editors and validators.

use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::grammar::Deck;

/// Return the JSON Schema (draft 7) of decks, generated from the grammar.
///
/// The schema covers keys, types of values and allowed words. Rules about several values, for example that
/// the deck has a set with a given name, are not part of the schema. Only [`read`](super::read) and
/// [`Deck::problem`](super::Deck::problem) check these rules.
pub fn schema() -> Value {
    let generator = SchemaSettings::draft07().into_generator();
    let mut schema = generator.into_root_schema_for::<Deck>().to_value();
    tidy(&mut schema);
    if let Some(root) = schema.as_object_mut() {
        root.insert("title".to_owned(), json!("Deck of Fissure"));
    }
    schema
}

/// Rewrite, in all parts of a schema, two constructs that editors handle badly: the type `null`, which TOML
/// lacks, and the choice between several tables.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Array(entries) => entries.iter_mut().for_each(tidy),
        Value::Object(entries) => {
            entries.values_mut().for_each(tidy);
            remove_null(schema);
            merge_choices(schema);
        }
        _ => {}
    }
}

/// Remove the type `null` of optional keys.
fn remove_null(schema: &mut Value) {
    if let Some(types) = schema.get_mut("type").and_then(Value::as_array_mut) {
        types.retain(|name| name != "null");
        if let [only] = &types[..] {
            schema["type"] = only.clone();
        }
    }
    let Some(choices) = schema.get_mut("anyOf").and_then(Value::as_array_mut) else {
        return;
    };
    choices.retain(|choice| *choice != json!({ "type": "null" }));
    // Draft 7 ignores all other keys of a table that has `$ref`, so the reference moves into `allOf`.
    if choices.len() == 1 {
        let all = schema
            .as_object_mut()
            .and_then(|entries| entries.remove("anyOf"));
        schema["allOf"] = all.unwrap_or_default();
    }
}

/// Simplify the schema of a choice between several tables, each with one key. Replace these tables by a
/// single table that must have exactly one of the keys. Editors can then complete the keys, and the messages
/// of editors point to the key with the mistake.
fn merge_choices(schema: &mut Value) {
    let joined = |choices: &Vec<Value>| {
        let mut properties = serde_json::Map::new();
        for choice in choices {
            let table = choice.get("properties")?.as_object()?;
            let (name, value) = table.iter().next().filter(|_| table.len() == 1)?;
            let mut value = value.clone();
            if let Some(description) = choice.get("description") {
                value = match value.get("$ref") {
                    Some(_) => json!({ "allOf": [value] }),
                    None => value,
                };
                value["description"] = description.clone();
            }
            properties.insert(name.clone(), value);
        }
        Some(properties)
    };
    let choices = schema.get("oneOf").and_then(Value::as_array);
    let Some(properties) = choices.and_then(joined) else {
        return;
    };
    if let Some(entries) = schema.as_object_mut() {
        entries.remove("oneOf");
        entries.insert("type".to_owned(), json!("object"));
        entries.insert("properties".to_owned(), Value::Object(properties));
        entries.insert("additionalProperties".to_owned(), json!(false));
        entries.insert("minProperties".to_owned(), json!(1));
        entries.insert("maxProperties".to_owned(), json!(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::grammar::{Form, SECTIONS};
    use crate::material::declarations;

    /// Follow the references of a schema.
    fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
        let target = schema.get("allOf").map_or(schema, |all| &all[0]);
        match target.get("$ref").and_then(Value::as_str) {
            Some(path) => resolved(root, root.pointer(path.trim_start_matches('#')).unwrap()),
            None => target,
        }
    }

    #[test]
    fn every_section_and_every_law_is_in_the_schema() {
        let root = schema();
        let property = |table: &'_ Value, name: &str| -> Value {
            let table = resolved(&root, table);
            let found = table["properties"].get(name);
            let found = found.or_else(|| table.get("additionalProperties"));
            resolved(&root, found.unwrap_or_else(|| panic!("{name}"))).clone()
        };
        for section in &SECTIONS {
            let mut found = root.clone();
            for name in section.path.split('.') {
                found = property(&found, name);
            }
            let wanted = match section.form {
                Form::Key => continue,
                Form::Array => "array",
                _ => "object",
            };
            assert_eq!(found["type"], wanted, "{}", section.path);
        }
        let material = resolved(&root, &root["definitions"]["Material"]);
        for law in declarations() {
            let table = &material["properties"][law.name]["properties"];
            for key in law.keys {
                assert_eq!(table[key.name]["description"], key.meaning, "{}", law.name);
            }
            assert!(table.get("density").is_some(), "{}", law.name);
        }
        assert_eq!(
            root["required"],
            json!(["dimension", "grid", "material", "body", "time"])
        );
    }

    #[test]
    fn there_is_no_null_and_choices_are_tables() {
        let root = schema();
        assert!(!root.to_string().contains("null"));
        let shape = &root["definitions"]["Shape"];
        assert_eq!(shape["maxProperties"], 1);
        assert!(
            shape["properties"]["union"].is_object() && shape.get("oneOf").is_none(),
            "{shape}"
        );
        assert_eq!(root["definitions"]["Damage"]["additionalProperties"], false);
        assert_eq!(
            root["properties"]["thickness"]["type"],
            json!(["number", "string"])
        );
    }
}
