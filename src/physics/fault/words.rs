//! What a reader of JSON says of a value of the wrong kind, in the words of JSON instead of Rust's.

/// `reason` as serde has it ("invalid type: X, expected Y"), with X and Y as people who write documents call them.
pub(super) fn plain(reason: &str) -> String {
    let Some((found, expected)) = reason.rsplit_once(", expected ") else { return reason.to_owned() };
    let Some((fault, found)) = found.split_once(": ") else { return reason.to_owned() };
    format!("{fault}: {}, expected {}", of_value(found), of_type(expected))
}

/// A value that was found; text of the document's own stays as it is.
fn of_value(found: &str) -> String {
    let number = ["floating point `", "integer `"].iter().find_map(|kind| found.strip_prefix(kind));
    match (found, number) {
        ("map", _) => "object".to_owned(),
        ("sequence", _) => "list".to_owned(),
        (_, Some(number)) => format!("number `{number}"),
        _ => found.to_owned(),
    }
}

/// What should have been there.
fn of_type(expected: &str) -> &str {
    match expected {
        "f32" | "f64" => "a number",
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "usize" => "a whole number of at least 0",
        "i8" => "a whole number from -128 to 127",
        "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        "map with a single key" => "an object with one member",
        _ if expected.starts_with("struct ")
            || expected == "a map"
            || expected.starts_with("internally tagged ") =>
        {
            "an object"
        }
        _ => expected,
    }
}
