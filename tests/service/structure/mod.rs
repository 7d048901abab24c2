//! The structure of the program: crates and rooms know only those below them, and no two files import each other.

mod source;

use std::collections::BTreeMap;
use std::fs;

use crate::common::repository;
use source::{Modules, rust_files};

/// A crate, or the program itself, by its root file, and its rooms from the lowest: a room may use those before it.
struct Floor {
    root: &'static str,
    rooms: &'static [&'static str],
    /// Rooms that a room does without although they stand below it.
    apart: &'static [(&'static str, &'static [&'static str])],
}

const FLOORS: [Floor; 4] = [
    Floor {
        root: "src/physics/lib.rs",
        rooms: &["fault", "character", "model", "scene", "sim", "motion", "stance", "playback"],
        apart: &[],
    },
    Floor {
        root: "src/learning/lib.rs",
        rooms: &["scenario", "gait", "learn", "program", "accuracy", "check", "training", "study"],
        apart: &[("gait", &["scenario"]), ("learn", &["scenario", "gait"]), ("accuracy", &["gait", "learn"])],
    },
    Floor { root: "src/lib.rs", rooms: &["export", "jobs", "http"], apart: &[] },
    Floor { root: "src/main.rs", rooms: &["cli"], apart: &[] },
];

/// Folders whose files name none of these crates, or rooms of another crate.
const WITHOUT: [(&str, &[&str]); 8] = [
    ("src/physics", &["rapier3d", "rand", "rand_chacha", "rayon", "tokio", "re_sdk", "axum", "sqlx"]),
    ("src/physics/sim", &["serde_json"]),
    ("src/physics/model", &["serde_json"]),
    ("src/learning", &["tokio", "re_sdk", "axum", "sqlx"]),
    ("src/learning/learn", &["serde_json", "rapier3d"]),
    ("src/export", &["tokio", "axum", "sqlx", "gaitwright_learning::scenario"]),
    ("src/jobs", &["axum"]),
    (
        "src/http",
        &[
            "gaitwright_physics::model",
            "gaitwright_physics::scene",
            "gaitwright_physics::sim",
            "gaitwright_physics::stance",
            "gaitwright_physics::playback",
        ],
    ),
];

/// Rooms that touch no file.
const WITHOUT_FILES: [&str; 4] =
    ["src/physics/sim", "src/physics/model", "src/learning/learn", "src/learning/gait"];

fn modules(floor: &Floor) -> Modules {
    Modules::read(&repository().join(floor.root), floor.rooms)
}

#[test]
fn every_room_is_listed() {
    for floor in FLOORS {
        let text = fs::read_to_string(repository().join(floor.root)).unwrap();
        let declared = text.lines().filter_map(|line| {
            line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';').map(str::to_owned)
        });
        let mut declared: Vec<String> = declared.filter(|room| room != "guide").collect();
        declared.sort();
        let mut listed = floor.rooms.to_vec();
        listed.sort_unstable();
        assert_eq!(declared, listed, "{}", floor.root);
    }
}

#[test]
fn rooms_look_downward_only() {
    let mut upward = Vec::new();
    for floor in &FLOORS {
        let modules = modules(floor);
        for (height, room) in floor.rooms.iter().enumerate() {
            let apart =
                floor.apart.iter().find(|(apart, _)| apart == room).map_or(&[][..], |(_, others)| others);
            for (module, path) in modules.files(&[room]) {
                for used in modules.imports(module) {
                    let Some(name) = used.first() else { continue };
                    let other = floor.rooms.iter().position(|other| other == name).unwrap();
                    if other > height || apart.contains(&name.as_str()) {
                        upward.push(format!("{}: {room} uses {name}", path.display()));
                    }
                }
            }
        }
    }
    assert!(upward.is_empty(), "{}", upward.join("\n"));
}

#[test]
fn no_files_import_each_other() {
    let mut circles = Vec::new();
    for floor in &FLOORS {
        let modules = modules(floor);
        for circle in modules.circles() {
            for module in &circle {
                for other in modules.imports(module).intersection(&circle) {
                    circles.push(format!(
                        "{}: {} imports {}",
                        floor.root,
                        module.join("::"),
                        other.join("::")
                    ));
                }
            }
        }
    }
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}

#[test]
fn rooms_do_without_what_is_not_theirs() {
    for (folder, others) in WITHOUT {
        let mut looked_at = 0;
        for floor in &FLOORS {
            let modules = modules(floor);
            for (module, path) in modules.files(&[]) {
                if path.starts_with(repository().join(folder)) {
                    looked_at += 1;
                    let strange: Vec<_> = others.iter().filter(|name| modules.names(module, name)).collect();
                    assert!(strange.is_empty(), "{} uses {strange:?}", path.display());
                }
            }
        }
        assert!(looked_at > 1, "no files in {folder}");
    }
}

#[test]
fn the_simulator_and_the_learner_touch_no_file() {
    for folder in WITHOUT_FILES {
        for path in rust_files(&repository().join(folder)) {
            assert!(!fs::read_to_string(&path).unwrap().contains("std::fs"), "{}", path.display());
        }
    }
}

#[test]
fn solvers_know_no_model() {
    let modules = modules(&FLOORS[0]);
    for (module, path) in modules.files(&["sim", "lcp"]) {
        for used in modules.imports(module) {
            let known = used.starts_with(&["sim".to_owned(), "lcp".to_owned()]) || used[0] == "scene";
            assert!(known, "{} uses {}", path.display(), used.join("::"));
        }
    }
}

#[test]
fn the_learner_reaches_the_simulator_in_one_place() {
    let modules = modules(&FLOORS[1]);
    let mut files = modules.files(&["learn"]);
    files.retain(|(module, _)| modules.names(module, "gaitwright_physics::sim"));
    assert_eq!(files.len(), 1, "{files:?}");
}

/// A public type name means one thing in the whole program.
#[test]
fn public_type_names_are_used_once() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in rust_files(&repository().join("src")) {
        for line in fs::read_to_string(&path).unwrap().lines() {
            let Some(rest) = line.trim_start().strip_prefix("pub ") else { continue };
            let mut words = rest.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            if let (Some("struct" | "enum" | "trait" | "type"), Some(name)) = (words.next(), words.next()) {
                places.entry(name.to_owned()).or_default().push(path.display().to_string());
            }
        }
    }
    let twice: Vec<_> = places.iter().filter(|(_, places)| places.len() > 1).collect();
    assert!(places.len() > 200, "only {} types were found", places.len());
    assert!(twice.is_empty(), "{twice:#?}");
}
