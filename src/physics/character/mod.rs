//! What the user drew: a tree of links joined by joints, read from URDF, JSON or a zip archive.
//!
//! Reading never guesses in silence: whatever was repaired, approximated, kept although doubtful, or
//! ignored is a [`Note`] naming its link or joint, and whatever cannot be used is an
//! [`InputError`] naming its place.
//!
//! The way of the data: [`read`] hands the bytes to the reader of their format; each reader writes a
//! draft in its own order with the place of every part; one `build` step, the same for all, checks
//! the tree and the numbers, orders the links, closes loops (`loops`), repairs inertias (`inertia`), replaces missing
//! collision shapes (`stand_in`), and so establishes the invariants of [`Character`].

mod archive;
mod bounds;
mod build;
mod draft;
mod hull;
mod inertia;
mod json;
mod loops;
mod mesh;
mod solid;
mod stand_in;
mod supply;
mod types;
mod urdf;

use std::path::Path;

use sha2::{Digest, Sha256};

pub use json::{ShapeDocument, read_shape, schema};
pub use types::{
    About, Character, Inertial, Joint, JointKind, Limits, Link, Loop, LoopKind, Note, NoteKind, Placed, Shape,
};

use crate::fault::{Fault, InputError};
use supply::Supply;

/// Greatest size of a URDF or JSON document, bytes.
pub const DOCUMENT_BYTES: usize = 8 << 20;
/// Greatest size of an archive as sent, bytes.
pub const ARCHIVE_BYTES: usize = 32 << 20;
/// Greatest number of links (and of joints).
pub const LINKS: usize = 1000;

/// The form in which a character is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// A URDF document.
    Urdf,
    /// A `gaitwright/character@1` JSON document.
    Json,
    /// A zip archive that holds one URDF and its meshes.
    Zip,
}

impl Source {
    /// The form that `bytes` begin like, if any: a zip archive by its magic number, otherwise by the
    /// first character after a byte order mark and white space.
    pub fn detect(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
            return Some(Self::Zip);
        }
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'<') => Some(Self::Urdf),
            Some(b'{') => Some(Self::Json),
            _ => None,
        }
    }
}

/// How strictly a character is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Options {
    /// Whether everything doubtful about the physics (repaired or approximated inertias, shapes and
    /// limits) is a fault instead of a note.
    pub strict: bool,
}

/// A character and what was done to its description to get it.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The character.
    pub character: Character,
    /// Everything repaired, approximated, kept although doubtful, or ignored.
    pub notes: Vec<Note>,
}

/// Reads a character from `bytes` alone. Meshes come from the archive only: no file on
/// this machine is read.
///
/// # Errors
///
/// [`InputError::Malformed`] when the bytes are no such document, [`InputError::TooLarge`] beyond the
/// bounds on size, depth and count, and [`InputError::Impossible`] with every fault found otherwise.
pub fn read(bytes: &[u8], source: Source, options: Options) -> Result<Reading, InputError> {
    let digest = digest(bytes);
    let draft = match source {
        Source::Urdf => urdf::draft(bytes, &Supply::Nothing)?,
        Source::Json => json::draft(bytes)?,
        Source::Zip => archive::draft(bytes)?,
    };
    build::build(draft, digest, options)
}

/// Reads a character from the file at `path`, whatever its form. The meshes of a URDF are looked for
/// in its folder and, for `package://` references, in the folders above it.
///
/// # Errors
///
/// As [`read`], and [`InputError::Malformed`] when the file cannot be read or its form is unknown.
pub fn read_file(path: &Path, options: Options) -> Result<Reading, InputError> {
    let unreadable =
        |error: std::io::Error| InputError::Malformed(Fault::new("", format!("cannot be read: {error}")));
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > ARCHIVE_BYTES as u64 {
        let reason = format!("is {length} bytes long; at most {ARCHIVE_BYTES} are read");
        return Err(InputError::TooLarge(Fault::new("", reason)));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    match Source::detect(&bytes) {
        Some(Source::Urdf) => {
            let draft = urdf::draft(&bytes, &Supply::beside(path))?;
            build::build(draft, digest(&bytes), options)
        }
        Some(source) => read(&bytes, source, options),
        None => Err(InputError::Malformed(Fault::new(
            "",
            "is neither a URDF document, nor a character JSON document, nor a zip archive",
        ))),
    }
}

fn digest(bytes: &[u8]) -> String {
    let hash = Sha256::digest(bytes);
    hash.iter().fold(String::from("sha256:"), |text, byte| text + &format!("{byte:02x}"))
}

/// The text of a document within the bound on its size.
fn text(bytes: &[u8]) -> Result<&str, InputError> {
    if bytes.len() > DOCUMENT_BYTES {
        let reason = format!("the document is {} bytes long; at most {DOCUMENT_BYTES} are read", bytes.len());
        return Err(InputError::TooLarge(Fault::new("", reason)));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        InputError::Malformed(Fault::new(format!("line {line}"), "the document is not UTF-8 text"))
    })
}
