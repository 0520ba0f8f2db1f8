//! The JSON of a document, and a cursor that knows where it stands.

use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use serde_json::{Map, Value};
use std::fmt::Write;

/// A parsed document.
pub(crate) struct Document {
    file: String,
    root: Value,
}

impl Document {
    /// Parses a document after a look at its size.
    pub(crate) fn parse(file: &str, bytes: &[u8], limits: &Limits) -> Result<Self, LoadError> {
        let over = |what, found, limit| LoadError::Limit {
            file: file.to_owned(),
            pointer: String::new(),
            what,
            found,
            limit,
        };
        if bytes.len() as u64 > limits.document_bytes {
            return Err(over("bytes of JSON", bytes.len() as u64, limits.document_bytes));
        }
        // Every value but the first follows one of these.
        let values = 1 + bytes.iter().filter(|b| matches!(b, b',' | b'[' | b'{')).count() as u64;
        if values > limits.document_values {
            return Err(over("JSON values", values, limits.document_values));
        }
        let root: Value = serde_json::from_slice(bytes).map_err(|e| {
            let text = e.to_string();
            let detail = text.split(" at line ").next().unwrap_or(&text).to_owned();
            LoadError::Json { file: file.to_owned(), line: e.line(), column: e.column(), detail }
        })?;
        Ok(Self { file: file.to_owned(), root })
    }

    /// The document's name.
    pub(crate) fn file(&self) -> &str {
        &self.file
    }

    /// The outermost object.
    pub(crate) fn root(&self) -> At<'_> {
        At { file: &self.file, value: &self.root, pointer: String::new() }
    }

    /// The objects of one of the outermost lists: none where it is absent.
    pub(crate) fn list(&self, key: &str) -> Result<Vec<At<'_>>, LoadError> {
        self.root().items(key)
    }

    /// How many objects one of the outermost lists has.
    pub(crate) fn count(&self, key: &str) -> usize {
        self.root.get(key).and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// One object of an outermost list that an index was checked against.
    pub(crate) fn item(&self, key: &str, index: usize) -> Result<At<'_>, LoadError> {
        let pointer = format!("/{key}/{index}");
        match self.root.get(key).and_then(|list| list.get(index)) {
            Some(value) => At { file: &self.file, value, pointer }.into_object(),
            None => Err(self.error(pointer, format!("there are only {} {key}", self.count(key)))),
        }
    }

    /// An error at a place of the document.
    pub(crate) fn error(&self, pointer: impl Into<String>, detail: impl Into<String>) -> LoadError {
        LoadError::Document { file: self.file.clone(), pointer: pointer.into(), detail: detail.into() }
    }
}

/// A value and where it stands.
#[derive(Clone, Debug)]
pub(crate) struct At<'a> {
    file: &'a str,
    pub(crate) value: &'a Value,
    pub(crate) pointer: String,
}

/// What a value is, for messages.
pub(crate) fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// A whole number that is not negative; 3.0 counts as one, as JSON schema has it.
pub(crate) fn whole(value: &Value) -> Option<u64> {
    value.as_u64().or_else(|| {
        let number = value.as_f64()?;
        ((0.0..9.007_199_254_740_992e15).contains(&number) && number.fract() == 0.0).then_some(number as u64)
    })
}

impl<'a> At<'a> {
    /// An error here.
    pub(crate) fn error(&self, detail: impl Into<String>) -> LoadError {
        LoadError::Document {
            file: self.file.to_owned(),
            pointer: self.pointer.clone(),
            detail: detail.into(),
        }
    }

    /// The error of a value that is not `wanted`.
    fn mismatch(&self, wanted: &str) -> LoadError {
        self.error(format!("should be {wanted}, but is {}", kind(self.value)))
    }

    fn into_object(self) -> Result<Self, LoadError> {
        if self.value.is_object() { Ok(self) } else { Err(self.mismatch("an object")) }
    }

    /// The members of an object; none of anything else.
    pub(crate) fn members(&self) -> Option<&'a Map<String, Value>> {
        self.value.as_object()
    }

    /// Pointer of a member.
    pub(crate) fn pointer_to(&self, key: &str) -> String {
        let mut pointer = self.pointer.clone();
        let _ = write!(pointer, "/{}", key.replace('~', "~0").replace('/', "~1"));
        pointer
    }

    /// A member of any kind.
    pub(crate) fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        Some(Self { file: self.file, value, pointer: self.pointer_to(key) })
    }

    /// A member of any kind that has to be there.
    pub(crate) fn need(&self, key: &str) -> Result<Self, LoadError> {
        self.get(key).ok_or_else(|| self.error(format!("\"{key}\" is missing")))
    }

    /// An object.
    pub(crate) fn object(&self, key: &str) -> Result<Option<Self>, LoadError> {
        self.get(key).map(Self::into_object).transpose()
    }

    /// An extension's object.
    pub(crate) fn extension(&self, name: &str) -> Result<Option<Self>, LoadError> {
        match self.object("extensions")? {
            Some(extensions) => extensions.object(name),
            None => Ok(None),
        }
    }

    /// The elements of an array of anything; none where it is absent.
    pub(crate) fn elements(&self, key: &str) -> Result<Vec<Self>, LoadError> {
        let Some(at) = self.get(key) else {
            return Ok(Vec::new());
        };
        let Value::Array(list) = at.value else {
            return Err(at.mismatch("an array"));
        };
        let element = |(i, value)| Self { file: self.file, value, pointer: format!("{}/{i}", at.pointer) };
        Ok(list.iter().enumerate().map(element).collect())
    }

    /// An element of this array.
    pub(crate) fn element(&self, index: usize) -> Result<Self, LoadError> {
        let value = self.value.get(index).ok_or_else(|| self.error(format!("has no element {index}")))?;
        Ok(Self { file: self.file, value, pointer: format!("{}/{index}", self.pointer) })
    }

    /// The elements of an array of objects; none where it is absent.
    pub(crate) fn items(&self, key: &str) -> Result<Vec<Self>, LoadError> {
        self.elements(key)?.into_iter().map(Self::into_object).collect()
    }

    /// This value as an index into a list of `count` `things`.
    pub(crate) fn as_index(&self, things: &str, count: usize) -> Result<usize, LoadError> {
        let index = whole(self.value).ok_or_else(|| self.mismatch("an index"))?;
        match usize::try_from(index) {
            Ok(index) if index < count => Ok(index),
            _ => Err(self.error(format!("refers to {index} of {things}, but there are only {count}"))),
        }
    }

    /// An index into a list of `count` `things`.
    pub(crate) fn index(&self, key: &str, things: &str, count: usize) -> Result<Option<usize>, LoadError> {
        self.get(key).map(|at| at.as_index(things, count)).transpose()
    }

    /// A whole number that is not negative.
    pub(crate) fn whole(&self, key: &str) -> Result<Option<u64>, LoadError> {
        self.get(key)
            .map(|at| whole(at.value).ok_or_else(|| at.mismatch("a whole number that is not negative")))
            .transpose()
    }

    /// A finite number.
    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>, LoadError> {
        self.get(key).map(|at| at.value.as_f64().ok_or_else(|| at.mismatch("a number"))).transpose()
    }

    /// A number of at least `least`.
    pub(crate) fn number_from(&self, key: &str, least: f64) -> Result<Option<f64>, LoadError> {
        match self.number(key)? {
            Some(value) if value < least => {
                let at = self.need(key)?;
                Err(at.error(format!("is {value}, but must be at least {least}")))
            }
            number => Ok(number),
        }
    }

    /// A number in 0..1; what lies outside is brought to the nearer end.
    pub(crate) fn share(&self, key: &str) -> Result<Option<f32>, LoadError> {
        Ok(self.number(key)?.map(|v| v.clamp(0.0, 1.0) as f32))
    }

    /// `N` numbers.
    pub(crate) fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>, LoadError> {
        let Some(at) = self.get(key) else {
            return Ok(None);
        };
        let list = at.value.as_array().ok_or_else(|| at.mismatch("an array of numbers"))?;
        if list.len() != N {
            return Err(at.error(format!("should hold {N} numbers, but holds {}", list.len())));
        }
        let mut numbers = [0.0; N];
        for (number, value) in numbers.iter_mut().zip(list) {
            *number = value
                .as_f64()
                .ok_or_else(|| at.error(format!("holds {} instead of a number", kind(value))))?;
        }
        Ok(Some(numbers))
    }

    /// A text.
    pub(crate) fn text(&self, key: &str) -> Result<Option<&'a str>, LoadError> {
        self.get(key).map(|at| at.value.as_str().ok_or_else(|| at.mismatch("a string"))).transpose()
    }

    /// True or false.
    pub(crate) fn flag(&self, key: &str) -> Result<Option<bool>, LoadError> {
        self.get(key).map(|at| at.value.as_bool().ok_or_else(|| at.mismatch("true or false"))).transpose()
    }

    /// The name, empty where there is none.
    pub(crate) fn name(&self) -> String {
        self.value.get("name").and_then(Value::as_str).unwrap_or_default().to_owned()
    }
}
