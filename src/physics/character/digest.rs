//! By what a motion knows the character that it was made for.

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::size::without_byte_order_mark;

/// The digests of a description of a character.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Digests {
    /// `sha256:…` of its bytes.
    pub whole: String,
    /// That of the same JSON document as it stands within another one: without white space, its fields in order. `None`
    /// for one of any other form.
    pub embedded: Option<String>,
}

impl Digests {
    /// Those of a document that is no JSON.
    pub fn of(bytes: &[u8]) -> Self {
        Self { whole: digest(bytes), embedded: None }
    }

    /// Those of a JSON document.
    pub fn of_json(bytes: &[u8]) -> Self {
        let embedded = || {
            let document: Value = serde_json::from_slice(without_byte_order_mark(bytes)).ok()?;
            Some(digest(&serde_json::to_vec(&document).ok()?))
        };
        Self { embedded: embedded(), ..Self::of(bytes) }
    }
}

fn digest(bytes: &[u8]) -> String {
    let hash = Sha256::digest(bytes);
    hash.iter().fold(String::from("sha256:"), |text, byte| text + &format!("{byte:02x}"))
}
