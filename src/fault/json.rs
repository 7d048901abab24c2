//! JSON documents read so that every fault has its place.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use serde_path_to_error::{Path, Segment};

use super::{Fault, InputError};

/// Reads a whole document.
///
/// # Errors
/// [`InputError::Malformed`] with line and column for what is not JSON; [`InputError::Impossible`] with a
/// JSON pointer for an unknown field, a missing one or a value of the wrong kind.
pub fn from_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, InputError> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let document = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let pointer = pointer(error.path());
        let error = error.into_inner();
        if error.is_data() {
            InputError::impossible(pointer, without_place(&error))
        } else {
            malformed(&error)
        }
    })?;
    reader.end().map_err(|error| malformed(&error))?;
    Ok(document)
}

fn malformed(error: &serde_json::Error) -> InputError {
    let place = format!("line {}, column {}", error.line(), error.column());
    InputError::Malformed(Fault::new(place, format!("not well-formed JSON: {}", without_place(error))))
}

/// The parser's message without the line and column at its end.
fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    message.split(" at line ").next().unwrap_or(&message).to_owned()
}

/// A JSON document read part by part, so that the faults of every part are found at once.
///
/// Holds the fields of a JSON object that are still to be read, and the faults found so far.
#[derive(Debug)]
pub struct Parts {
    fields: Map<String, Value>,
    faults: Vec<Fault>,
}

impl Parts {
    /// Parses a JSON object.
    ///
    /// # Errors
    ///
    /// [`InputError::Malformed`] with line and column when `bytes` is not JSON, or not an object.
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        let fields = serde_json::from_slice(bytes).map_err(|error| malformed(&error))?;
        Ok(Self { fields, faults: Vec::new() })
    }

    /// Checks the field `format` where there is one.
    pub fn check_format(&mut self, format: &str) {
        if let Some(found) = self.fields.remove("format")
            && found != format
        {
            self.faults.push(Fault::new("/format", format!("the format must be \"{format}\"")));
        }
    }

    /// Takes the field `name`, whose absence is a fault as well.
    pub fn require<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        if !self.fields.contains_key(name) {
            self.faults.push(Fault::new(format!("/{name}"), format!("the field `{name}` is missing")));
        }
        self.take(name)
    }

    /// Takes the field `name`; `None` when it is absent or faulty.
    pub fn take<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        let value = self.fields.remove(name)?;
        match serde_path_to_error::deserialize(value) {
            Ok(part) => Some(part),
            Err(error) => {
                let pointer = format!("/{name}{}", pointer(error.path()));
                self.faults.push(Fault::new(pointer, without_place(error.inner())));
                None
            }
        }
    }

    /// Ends the reading: what has not been taken is unknown. `read` is what was made of the parts.
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] with every fault found.
    pub fn end<T>(mut self, read: Option<T>, known: &[&str]) -> Result<T, InputError> {
        for name in self.fields.keys() {
            let reason = format!("unknown field `{name}`, expected one of {}", known.join(", "));
            self.faults.push(Fault::new(format!("/{}", pointer_token(name)), reason));
        }
        match read {
            Some(read) if self.faults.is_empty() => Ok(read),
            _ => Err(InputError::Impossible(self.faults)),
        }
    }
}

/// The JSON pointer (RFC 6901) of a path.
fn pointer(path: &Path) -> String {
    path.iter()
        .filter_map(|segment| match segment {
            Segment::Seq { index } => Some(format!("/{index}")),
            Segment::Map { key } => Some(format!("/{}", pointer_token(key))),
            Segment::Enum { variant } => Some(format!("/{}", pointer_token(variant))),
            Segment::Unknown => None,
        })
        .collect()
}

/// A key as a reference token of a JSON pointer (RFC 6901, section 3).
pub fn pointer_token(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}
