//! Bounds on the size of what is read.

use crate::fault::{Fault, InputError};

/// Greatest size of a URDF or JSON document, bytes.
pub const DOCUMENT_BYTES: usize = 8 << 20;
/// Greatest size of an archive as sent, bytes.
pub const ARCHIVE_BYTES: usize = 32 << 20;
/// Greatest number of links (and of joints).
pub const LINKS: usize = 1000;
/// Greatest number of collision shapes of all links together: every pair of them is looked at when a character is made ready.
pub const SHAPES: usize = 4000;

/// A document without the byte order mark that some editors write before it.
pub fn without_byte_order_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// The text of a document within the bound on its size.
pub fn text(bytes: &[u8]) -> Result<&str, InputError> {
    if bytes.len() > DOCUMENT_BYTES {
        let reason = format!("the document is {} bytes long; at most {DOCUMENT_BYTES} are read", bytes.len());
        return Err(InputError::TooLarge(Fault::new("", reason)));
    }
    let bytes = without_byte_order_mark(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        InputError::Malformed(Fault::new(format!("line {line}"), "the document is not UTF-8 text"))
    })
}
