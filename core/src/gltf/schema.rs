//! Whether each object of a document holds what glTF says it may. What is read is checked where it is read;
//! this pass tells of the rest, so that nothing broken goes unmentioned.

use crate::gltf::document::{kind, whole};
use crate::gltf::error::Problems;
use crate::gltf::schema_tables::ROOT;
use serde_json::{Map, Value};
use std::fmt::Write;

/// What a property may be.
pub(crate) enum Kind {
    Any,
    Text,
    Flag,
    /// A whole number of at least this.
    Whole(u64),
    /// A number in a closed range.
    Number(f64, f64),
    /// A number above the first and up to the second.
    Above(f64, f64),
    /// As many numbers as one of the lengths says, each in a closed range.
    Numbers(&'static [usize], f64, f64),
    Words(&'static [&'static str]),
    Codes(&'static [u64]),
    /// An index into the list with this JSON pointer.
    Index(&'static str),
    Indices(&'static str),
    /// An object of indices of accessors.
    Attributes,
    AttributeLists,
    Object(&'static Schema),
    List(&'static Schema),
}

/// A property.
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) presence: Presence,
}

/// Whether an object is complete without a property.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Presence {
    Needed,
    Free,
}

/// An object's properties, and the objects that extensions add to it.
pub(crate) struct Schema {
    pub(crate) fields: &'static [Field],
    pub(crate) extensions: &'static [(&'static str, &'static Schema)],
}

/// A step of a JSON pointer.
#[derive(Clone, Copy)]
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

struct Walk<'a, 'p> {
    root: &'a Value,
    path: Vec<Step<'a>>,
    problems: &'p mut Problems,
}

/// Reports everything in the document that its schema does not allow.
pub(crate) fn check(root: &Value, problems: &mut Problems) {
    Walk { root, path: Vec::new(), problems }.object(root, &ROOT);
}

impl<'a> Walk<'a, '_> {
    fn report(&mut self, detail: impl Into<String>) {
        let mut pointer = String::new();
        for step in &self.path {
            let _ = match step {
                Step::Key(key) => write!(pointer, "/{}", key.replace('~', "~0").replace('/', "~1")),
                Step::Index(index) => write!(pointer, "/{index}"),
            };
        }
        self.problems.add(pointer, detail);
    }

    fn mismatch(&mut self, wanted: &str, value: &Value) {
        self.report(format!("should be {wanted}, but is {}", kind(value)));
    }

    fn within(&mut self, step: Step<'a>, go: impl FnOnce(&mut Self)) {
        self.path.push(step);
        go(self);
        self.path.pop();
    }

    fn object(&mut self, value: &'a Value, schema: &'static Schema) {
        let Value::Object(members) = value else {
            return self.mismatch("an object", value);
        };
        for field in schema.fields {
            match members.get(field.name) {
                Some(value) => self.within(Step::Key(field.name), |walk| walk.value(value, &field.kind)),
                None if field.presence == Presence::Needed => {
                    self.report(format!("\"{}\" is missing", field.name));
                }
                None => {}
            }
        }
        match members.get("extensions") {
            Some(Value::Object(extensions)) => {
                self.within(Step::Key("extensions"), |walk| walk.extensions(extensions, schema));
            }
            Some(other) => self.within(Step::Key("extensions"), |walk| walk.mismatch("an object", other)),
            None => {}
        }
    }

    fn extensions(&mut self, extensions: &'a Map<String, Value>, schema: &'static Schema) {
        for (name, value) in extensions {
            let known = schema.extensions.iter().find(|(known, _)| known == name);
            self.within(Step::Key(name), |walk| match known {
                Some((_, schema)) => walk.object(value, schema),
                None if !value.is_object() => walk.mismatch("an object", value),
                None => {}
            });
        }
    }

    fn value(&mut self, value: &'a Value, kind: &'static Kind) {
        match kind {
            Kind::Text if !value.is_string() => self.mismatch("a string", value),
            Kind::Flag if !value.is_boolean() => self.mismatch("true or false", value),
            Kind::Any | Kind::Text | Kind::Flag => {}
            Kind::Whole(least) => match whole(value) {
                Some(number) if number < *least => {
                    self.report(format!("is {number}, but must be at least {least}"));
                }
                Some(_) => {}
                None => self.mismatch("a whole number that is not negative", value),
            },
            Kind::Number(least, most) => self.number(value, *least, *most),
            Kind::Above(limit, most) => match value.as_f64() {
                Some(number) if number <= *limit => {
                    self.report(format!("is {number}, but must be above {limit}"));
                }
                _ => self.number(value, *limit, *most),
            },
            Kind::Numbers(lengths, least, most) => self.numbers(value, lengths, *least, *most),
            Kind::Words(words) => match value.as_str() {
                Some(word) if words.contains(&word) => {}
                Some(_) => self.report(format!("should be one of {}", words.join(", "))),
                None => self.mismatch("a string", value),
            },
            Kind::Codes(codes) => match whole(value) {
                Some(code) if codes.contains(&code) => {}
                Some(code) => self.report(format!("is {code}, which glTF does not know")),
                None => self.mismatch("a whole number", value),
            },
            Kind::Index(list) => self.index(value, list),
            Kind::Indices(list) => self.list(value, |walk, value| walk.index(value, list)),
            Kind::Attributes => self.attributes(value),
            Kind::AttributeLists => self.list(value, Self::attributes),
            Kind::Object(schema) => self.object(value, schema),
            Kind::List(schema) => self.list(value, |walk, value| walk.object(value, schema)),
        }
    }

    fn number(&mut self, value: &Value, least: f64, most: f64) {
        match value.as_f64() {
            Some(number) if number < least => {
                self.report(format!("is {number}, but must be at least {least}"));
            }
            Some(number) if number > most => self.report(format!("is {number}, but must be at most {most}")),
            Some(_) => {}
            None => self.mismatch("a number", value),
        }
    }

    fn numbers(&mut self, value: &'a Value, lengths: &[usize], least: f64, most: f64) {
        let Value::Array(list) = value else {
            return self.mismatch("an array of numbers", value);
        };
        if !lengths.is_empty() && !lengths.contains(&list.len()) {
            self.report(format!("should hold {} numbers, but holds {}", lengths[0], list.len()));
        }
        for (i, number) in list.iter().enumerate() {
            self.within(Step::Index(i), |walk| walk.number(number, least, most));
        }
    }

    fn list(&mut self, value: &'a Value, each: impl Fn(&mut Self, &'a Value)) {
        let Value::Array(list) = value else {
            return self.mismatch("an array", value);
        };
        if list.is_empty() {
            self.report("is empty: leave it out");
        }
        for (i, value) in list.iter().enumerate() {
            self.within(Step::Index(i), |walk| each(walk, value));
        }
    }

    fn index(&mut self, value: &Value, list: &str) {
        let count = self.root.pointer(list).and_then(Value::as_array).map_or(0, Vec::len);
        match whole(value) {
            Some(index) if index < count as u64 => {}
            Some(index) => self.report(format!("refers to {index} of {list}, but there are only {count}")),
            None => self.mismatch("an index", value),
        }
    }

    fn attributes(&mut self, value: &'a Value) {
        let Value::Object(members) = value else {
            return self.mismatch("an object", value);
        };
        if members.is_empty() {
            self.report("is empty");
        }
        for (name, index) in members {
            self.within(Step::Key(name), |walk| walk.index(index, "/accessors"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(json: &str) -> Vec<String> {
        let mut problems = Problems::default();
        check(&serde_json::from_str(json).unwrap(), &mut problems);
        problems.finish().into_iter().map(|p| format!("{} {}", p.pointer, p.detail)).collect()
    }

    #[test]
    fn a_sound_document_has_no_problems() {
        let json = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives":
            [{"attributes": {"POSITION": 0}, "mode": 4}]}],
            "accessors": [{"count": 3, "componentType": 5126, "type": "VEC3"}]}"#;
        assert_eq!(problems(json), Vec::<String>::new());
    }

    #[test]
    fn each_problem_has_its_pointer() {
        for (json, says) in [
            (r"{}", r#" "asset" is missing"#),
            (r#"{"asset": {"version": "2.0"}, "nodes": {}}"#, "/nodes should be an array, but is an object"),
            (r#"{"asset": {"version": "2.0"}, "nodes": []}"#, "/nodes is empty: leave it out"),
            (
                r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 2}]}"#,
                "/nodes/0/mesh refers to 2 of /meshes, but there are only 0",
            ),
            (
                r#"{"asset": {"version": "2.0"}, "materials": [{"alphaMode": "WAT"}]}"#,
                "/materials/0/alphaMode should be one of OPAQUE, MASK, BLEND",
            ),
            (
                r#"{"asset": {"version": "2.0"}, "materials": [{"extensions": {"KHR_materials_ior": {"ior": -1}}}]}"#,
                "/materials/0/extensions/KHR_materials_ior/ior is -1, but must be at least 0",
            ),
            (
                r#"{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"a/b": 1.5}}]}]}"#,
                "/meshes/0/primitives/0/attributes/a~1b should be an index, but is a number",
            ),
        ] {
            assert_eq!(problems(json), [says]);
        }
    }
}
