//! Tables as comma-separated values.

use csv::{Terminator, WriterBuilder};

/// A line of column names and a line for each record (RFC 4180, lines ended by `\n`).
pub(super) fn csv_text<const COLUMNS: usize>(
    names: [&str; COLUMNS],
    records: impl IntoIterator<Item = [String; COLUMNS]>,
) -> String {
    let mut writer = WriterBuilder::new().terminator(Terminator::Any(b'\n')).from_writer(Vec::new());
    // Writing to memory cannot fail, and every record has as many cells as there are names.
    let _ = writer.write_record(names);
    for record in records {
        let _ = writer.write_record(record);
    }
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}
