//! Documents that somebody, or something, has damaged, and their readers.

use std::fs;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common;
use crate::damage::{archive, cases, damage, meshed};

#[path = "../../fuzz/readers.rs"]
mod any_bytes;

/// Altered copies of every document.
const COPIES: u64 = 1000;

/// Altered copies that are read before it is looked whether there is time for more.
const BATCH: usize = 64;

/// Every document that ships, by its name.
fn documents() -> Vec<(String, Vec<u8>)> {
    let folder = common::repository().join("examples");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    // The programs beside the documents are read by the compiler alone.
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json" || extension == "urdf"));
    paths.sort();
    assert!(paths.len() >= 8, "{paths:?}");
    paths.iter().map(|path| (path.display().to_string(), fs::read(path).unwrap())).collect()
}

/// Reads the copies that `copy` makes, one after the other until there is no more time for them.
fn read_copies(
    name: &str,
    numbers: impl Iterator<Item = u64>,
    copy: impl Fn(&mut ChaCha8Rng) -> Vec<u8> + Sync,
) {
    let mut numbers = numbers.peekable();
    let mut read = 0;
    while numbers.peek().is_some() {
        let batch: Vec<u64> = numbers.by_ref().take(BATCH).collect();
        read += batch.len();
        common::in_parallel(&batch, |number| {
            let damaged = copy(&mut ChaCha8Rng::seed_from_u64(*number));
            let read = std::panic::catch_unwind(|| any_bytes::read(&damaged));
            assert!(read.is_ok(), "copy {number} of {name}");
        });
    }
    assert!(read > 0, "no copy of {name} was read");
}

#[test]
fn damaged_documents_are_read_or_refused() {
    let documents = documents();
    for (_, bytes) in &documents {
        any_bytes::read(bytes);
    }
    let copies = cases(COPIES * documents.len() as u64);
    read_copies("an example", copies, |rng| {
        let mut damaged = documents[rng.random_range(0..documents.len())].1.clone();
        damage(rng, &mut damaged);
        damaged
    });
}

#[test]
fn damaged_archives_are_read_or_refused() {
    let files = meshed();
    any_bytes::read(&archive(&files));
    read_copies("an archive", cases(COPIES), |rng| {
        let mut files = files.clone();
        let which = rng.random_range(0..=files.len());
        if let Some((_, contents)) = files.get_mut(which) {
            damage(rng, contents);
        }
        let mut archive = archive(&files);
        if which == files.len() {
            damage(rng, &mut archive);
        }
        archive
    });
}
