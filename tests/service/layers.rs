//! Rooms look downward only: a room's `use crate::…` lines name rooms that stand before it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms, lowest first: a room may use those before it.
const ROOMS: [&str; 15] = [
    "fault",
    "character",
    "model",
    "scene",
    "sim",
    "motion",
    "stance",
    "playback",
    "scenario",
    "gait",
    "learn",
    "accuracy",
    "export",
    "jobs",
    "http",
];

/// Rooms that a room does without although they stand below it.
const APART: [(&str, &[&str]); 5] = [
    ("gait", &["scenario"]),
    ("learn", &["scenario", "gait"]),
    ("accuracy", &["gait", "learn"]),
    ("export", &["scenario"]),
    ("http", &["model", "scene", "sim", "stance", "playback"]),
];

/// Outside crates that a room does without, and why it can.
const WITHOUT: [(&str, &[&str]); 4] = [
    ("sim", &["rand", "rand_chacha", "serde_json", "tokio", "re_sdk", "re_sdk_types", "axum", "sqlx"]),
    ("learn", &["tokio", "re_sdk", "re_sdk_types", "axum", "sqlx", "serde_json"]),
    ("gait", &["tokio", "re_sdk", "re_sdk_types", "axum", "sqlx"]),
    ("model", &["tokio", "re_sdk", "re_sdk_types", "axum", "sqlx", "serde_json"]),
];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// The source files of a room.
fn files(room: &str) -> Vec<PathBuf> {
    let (file, folder) = (source().join(format!("{room}.rs")), source().join(room));
    let mut found = Vec::new();
    let mut open = vec![if folder.is_dir() { folder } else { file }];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    assert!(!found.is_empty(), "the room {room} has no source files");
    found
}

/// The source without comments, which may speak of any room.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The words that follow `prefix` in a text, whichever names of a `{…}` group they are.
fn named(text: &str, prefix: &str) -> BTreeSet<String> {
    let word = |text: &str| -> String {
        text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut names = BTreeSet::new();
    for (at, _) in text.match_indices(prefix) {
        let before = text[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &text[at + prefix.len()..];
        match rest.strip_prefix('{') {
            None => {
                names.insert(word(rest));
            }
            Some(group) => {
                let mut depth = 0;
                let mut start = 0;
                for (index, character) in group.char_indices() {
                    match character {
                        '{' => depth += 1,
                        '}' if depth > 0 => depth -= 1,
                        ',' if depth == 0 => {
                            names.insert(word(&group[start..index]));
                            start = index + 1;
                        }
                        '}' => {
                            names.insert(word(&group[start..index]));
                            break;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    names.remove("");
    names
}

#[test]
fn names_are_read_from_lines_and_groups() {
    let text =
        "use crate::model::Model;\nuse crate::{fault::{Fault, InputError}, sim};\nlet x = crate::learn::y();";
    let expected = ["fault", "learn", "model", "sim"].map(str::to_owned);
    assert_eq!(named(text, "crate::"), BTreeSet::from(expected));
}

#[test]
fn every_room_of_the_library_is_listed() {
    let library = code(&source().join("lib.rs"));
    let listed = BTreeSet::from(ROOMS);
    let present: BTreeSet<&str> =
        library.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(present, listed);
}

#[test]
fn rooms_look_downward_only() {
    let mut upward = Vec::new();
    for (height, room) in ROOMS.into_iter().enumerate() {
        let apart = APART.iter().find(|(apart, _)| *apart == room).map_or(&[][..], |(_, others)| others);
        for path in files(room) {
            for used in named(&code(&path), "crate::") {
                let Some(other) = ROOMS.iter().position(|other| *other == used) else { continue };
                if other > height || apart.contains(&ROOMS[other]) {
                    upward.push(format!("{}: {room} uses {used}", path.display()));
                }
            }
        }
    }
    assert!(upward.is_empty(), "{}", upward.join("\n"));
}

#[test]
fn solvers_know_no_model() {
    for path in files("sim/lcp") {
        let used = named(&code(&path), "crate::");
        let strange: Vec<_> = used.iter().filter(|used| *used != "sim" && *used != "scene").collect();
        assert!(strange.is_empty(), "{}: a solver uses {strange:?}", path.display());
    }
}

#[test]
fn rooms_do_without_what_is_not_theirs() {
    for (room, crates) in WITHOUT {
        for path in files(room) {
            let code = code(&path);
            for name in crates {
                let used = named(&code, &format!("{name}::"));
                assert!(used.is_empty(), "{}: {room} uses {name}", path.display());
            }
        }
    }
}

#[test]
fn simulator_and_learner_touch_no_file() {
    for room in ["sim", "learn", "model", "gait"] {
        for path in files(room) {
            assert!(!code(&path).contains("std::fs"), "{}: {room} touches files", path.display());
        }
    }
}

#[test]
fn the_learner_reaches_the_simulator_in_one_place() {
    let reaching: Vec<_> =
        files("learn").into_iter().filter(|path| named(&code(path), "crate::").contains("sim")).collect();
    assert_eq!(reaching.len(), 1, "{reaching:?}");
}
