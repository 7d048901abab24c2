//! Reads JSON documents and names the place of every fault.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use serde_path_to_error::{Path, Segment};

use super::strict::Strict;
use super::tree::Tree;
use super::words::plain;
use super::{Fault, InputError};

/// Objects with more members than this are not searched for the faulty one: the search reads the document once for
/// each of them.
const MEMBERS: usize = 32;

/// The member that says which kind of thing an object is.
const TAG: &str = "kind";

/// The member that says which kind of document an object is.
const FORMAT: &str = "format";

/// Reads a whole document.
///
/// # Errors
/// [`InputError::Malformed`] with line and column for what is not JSON; [`InputError::Impossible`] with a
/// JSON pointer for an unknown field, a missing one, one that is given twice or a value of the wrong kind.
pub fn from_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, InputError> {
    read(&mut parse(bytes)?).map_err(|fault| InputError::Impossible(vec![fault]))
}

/// The document in `bytes`, whatever it is.
fn parse(bytes: &[u8]) -> Result<Value, InputError> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let Tree(tree) = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let pointer = pointer(error.path());
        let error = error.into_inner();
        if error.is_data() {
            InputError::impossible(pointer, without_place(&error))
        } else {
            malformed(bytes, &error)
        }
    })?;
    reader.end().map_err(|error| malformed(bytes, &error))?;
    Ok(tree)
}

/// What is wrong with `bytes`, which are no JSON.
fn malformed(bytes: &[u8], error: &serde_json::Error) -> InputError {
    let place = format!("line {}, column {}", error.line(), error.column());
    let xml = bytes.trim_ascii_start().starts_with(b"<");
    let hint = if xml { "; it begins as XML does" } else { "" };
    InputError::Malformed(Fault::new(place, format!("not well-formed JSON: {}{hint}", without_place(error))))
}

/// The parser's message without the line and column at its end.
fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&place).unwrap_or(&message).to_owned()
}

/// What `tree` holds, or its first fault; that of its format before all others, which follow from it.
fn read<T: DeserializeOwned>(tree: &mut Value) -> Result<T, Fault> {
    attempt(tree).map_err(|fault| {
        if let Some(format) = faulty_format::<T>(tree) {
            return format;
        }
        let mut place = fault.pointer.clone();
        while let Some(key) = faulty_member::<T>(tree, &place, &fault) {
            place = member(&place, &key);
        }
        Fault { pointer: place, ..fault }
    })
}

fn attempt<T: DeserializeOwned>(tree: &Value) -> Result<T, Fault> {
    serde_path_to_error::deserialize(Strict::new(tree))
        .map_err(|error| Fault::new(pointer(error.path()), plain(&error.inner().to_string())))
}

/// What is wrong with the member that says which kind of document `tree` is.
fn faulty_format<T: DeserializeOwned>(tree: &Value) -> Option<Fault> {
    let alone = Value::Object(Map::from_iter([(FORMAT.to_owned(), tree.get(FORMAT)?.clone())]));
    // Without the other members there is another fault, unless the format is at fault itself.
    let fault = attempt::<T>(&alone).err().filter(|fault| fault.pointer == format!("/{FORMAT}"))?;
    Some(Fault {
        reason: fault.reason.replacen("unknown variant", "the document says that it is", 1),
        ..fault
    })
}

/// The member of the object at `place` that causes `fault`. Serde reads tagged objects from a buffer and loses the path
/// of an error there, so the member is found by trial: without it the document has no fault, or another one.
fn faulty_member<T: DeserializeOwned>(tree: &mut Value, place: &str, fault: &Fault) -> Option<String> {
    let members = tree.pointer(place)?.as_object()?;
    // A missing field is not found by removing others.
    if members.len() > MEMBERS || fault.reason.starts_with("missing field") {
        return None;
    }
    let mut keys: Vec<String> = members.keys().cloned().collect();
    keys.retain(|key| {
        let Some(taken) = object(tree, place).and_then(|members| members.remove(key)) else { return false };
        let other = attempt::<T>(tree).err().as_ref() != Some(fault);
        if let Some(members) = object(tree, place) {
            members.insert(key.clone(), taken);
        }
        other
    });
    // Without its tag an object cannot be read at all, so that any fault becomes another one.
    if keys.len() > 1 {
        keys.retain(|key| key != TAG);
    }
    if keys.len() == 1 { keys.pop() } else { None }
}

fn object<'a>(tree: &'a mut Value, place: &str) -> Option<&'a mut Map<String, Value>> {
    tree.pointer_mut(place)?.as_object_mut()
}

/// A JSON object read field by field, so that the faults of all fields are reported together.
///
/// Holds the fields that are still to be read, and the faults found so far.
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
    /// [`InputError::Malformed`] with line and column when `bytes` is not JSON, [`InputError::Impossible`] when
    /// it is no object or has a key twice.
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        match parse(bytes)? {
            Value::Object(fields) => Ok(Self { fields, faults: Vec::new() }),
            _ => Err(InputError::impossible("", "the document must be a JSON object")),
        }
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
        let mut value = self.fields.remove(name)?;
        match read(&mut value) {
            Ok(part) => Some(part),
            Err(fault) => {
                self.faults.push(fault.under(&member("", name)));
                None
            }
        }
    }

    /// Ends the reading: what has not been taken is unknown. `read` is the value built from the fields, if it could be, and `impossible`
    /// what of the fields that could be read makes no sense: whoever checks what was read finds that again.
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] with every fault found in reading, and then what is impossible as well.
    pub fn end<T>(
        mut self,
        read: Option<T>,
        known: &[&str],
        impossible: Vec<Fault>,
    ) -> Result<T, InputError> {
        for name in self.fields.keys() {
            let reason = format!("unknown field `{name}`, expected one of {}", known.join(", "));
            self.faults.push(Fault::new(member("", name), reason));
        }
        match read {
            Some(read) if self.faults.is_empty() => Ok(read),
            _ => {
                self.faults.extend(impossible);
                Err(InputError::Impossible(self.faults))
            }
        }
    }
}

/// The JSON pointer (RFC 6901) of a path.
fn pointer(path: &Path) -> String {
    path.iter()
        .filter_map(|segment| match segment {
            Segment::Seq { index } => Some(format!("/{index}")),
            Segment::Map { key: name } | Segment::Enum { variant: name } => Some(member("", name)),
            Segment::Unknown => None,
        })
        .collect()
}

/// The JSON pointer of the member `key` of what is at `place`; the key is escaped as RFC 6901, section 3, has it.
pub fn member(place: &str, key: &str) -> String {
    format!("{place}/{}", key.replace('~', "~0").replace('/', "~1"))
}
