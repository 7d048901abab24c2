//! Documents that somebody, or something, has damaged.

use crate::common;

use std::fs;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[path = "../../fuzz/readers.rs"]
mod any_bytes;

/// What damage puts into a document.
const PIECES: [&str; 18] = [
    "0", "-1", "1e308", "-1e308", "1e-308", "NaN", "inf", "1e999", "null", "true", "\"", "[", "{}",
    "<link/>", "</robot>", "&amp;", "\u{fffd}", "\0",
];

/// Altered copies of every example.
const COPIES: u64 = 1000;

#[test]
fn damaged_documents_are_read_or_refused() {
    let folder = common::repository().join("examples");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    // The programs beside the documents are read by the compiler alone.
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json" || extension == "urdf"));
    paths.sort();
    assert!(paths.len() >= 8, "{paths:?}");
    let copies: Vec<u64> = (0..common::number("CASES").unwrap_or(COPIES)).collect();
    for path in paths {
        let bytes = fs::read(&path).unwrap();
        any_bytes::read(&bytes);
        common::in_parallel(&copies, |copy| {
            let mut rng = ChaCha8Rng::seed_from_u64(*copy);
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                damage(&mut rng, &mut damaged);
            }
            let read = std::panic::catch_unwind(|| any_bytes::read(&damaged));
            assert!(read.is_ok(), "copy {copy} of {}", path.display());
        });
    }
}

/// Alters `bytes` in one place.
fn damage(rng: &mut ChaCha8Rng, bytes: &mut Vec<u8>) {
    let at = rng.random_range(0..=bytes.len());
    let end = (at + rng.random_range(0..40)).min(bytes.len());
    let piece = PIECES[rng.random_range(0..PIECES.len())].bytes();
    match rng.random_range(0..5) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..end)),
        2 => drop(bytes.splice(at..at, piece)),
        3 => {
            let copied = bytes[at..end].to_vec();
            let to = rng.random_range(0..=bytes.len());
            bytes.splice(to..to, copied);
        }
        _ => {
            // A number after this place becomes another.
            let of_number = |byte: &u8| byte.is_ascii_digit() || b"+-.eE".contains(byte);
            let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|found| at + found) else {
                return;
            };
            let length = bytes[start..].iter().take_while(|byte| of_number(byte)).count();
            bytes.splice(start..start + length, piece);
        }
    }
}
