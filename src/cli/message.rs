//! What the commands tell people, on standard error.

use std::fmt::Arguments;
use std::io::{Write, stderr};

/// Writes a line to standard error. Where that is full or gone, the command goes on without: unlike `eprintln!`, which
/// panics then.
pub fn tell(line: Arguments<'_>) {
    let _ = writeln!(stderr().lock(), "{line}");
}
