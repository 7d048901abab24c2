//! Reading a character, whatever its form.

use std::path::Path;

use super::digest::Digests;
use super::size::{ARCHIVE_BYTES, without_byte_order_mark};
use super::supply::Supply;
use super::types::{Options, Reading};
use super::{archive, build, json, urdf};
use crate::fault::{Fault, InputError};

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
        let text = without_byte_order_mark(bytes);
        match text.iter().find(|byte| !byte.is_ascii_whitespace()) {
            Some(b'<') => Some(Self::Urdf),
            Some(b'{') => Some(Self::Json),
            _ => None,
        }
    }
}

/// Reads a character from `bytes` alone. Meshes come from the archive only: no file on
/// this machine is read.
///
/// # Errors
///
/// [`InputError::Malformed`] when the bytes are no such document, [`InputError::TooLarge`] beyond the
/// bounds on size, depth and count, and [`InputError::Impossible`] with every fault found otherwise.
pub fn read(bytes: &[u8], source: Source, options: Options) -> Result<Reading, InputError> {
    let draft = match source {
        Source::Urdf => urdf::draft(bytes, &Supply::Nothing)?,
        Source::Json => json::draft(bytes)?,
        Source::Zip => archive::draft(bytes)?,
    };
    let digests = if source == Source::Json { Digests::of_json(bytes) } else { Digests::of(bytes) };
    build::build(draft, digests, options)
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
    if bytes.is_empty() {
        return Err(InputError::Malformed(Fault::new("", "is empty")));
    }
    match Source::detect(&bytes) {
        Some(Source::Urdf) => {
            let draft = urdf::draft(&bytes, &Supply::beside(path))?;
            build::build(draft, Digests::of(&bytes), options)
        }
        Some(source) => read(&bytes, source, options),
        None => Err(InputError::Malformed(Fault::new(
            "",
            "is neither a URDF document, nor a character JSON document, nor a zip archive",
        ))),
    }
}
