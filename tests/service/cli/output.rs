//! Where results cannot be written or are not read.

use super::{PADDLER, QUADRUPED, command, run, write};
use crate::common;

use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use serde_json::{Value, json};
use tempfile::TempDir;

#[test]
fn where_nothing_can_be_left_nothing_is_begun() {
    let folder = TempDir::new().unwrap();
    let file = write(folder.path(), "file", "");
    let out = format!("{file}/out");
    // Each would take minutes.
    for command in [&["study"][..], &["accuracy", "--hard-cases"], &["train", PADDLER]] {
        let answer = run(&[command, &["--out", &out]].concat());
        let message = String::from_utf8(answer.stderr).unwrap();
        assert_eq!(answer.status.code(), Some(1), "{command:?}: {message}");
        assert!(
            message.starts_with(&format!("{out} cannot be made")) && message.lines().count() == 1,
            "{message}"
        );
    }
}

/// Targets that are played without the steering that belongs to them may fall, which whoever exports them is told.
#[test]
fn an_export_tells_of_steering_that_has_no_place_in_its_format() {
    let folder = TempDir::new().unwrap();
    let text = std::fs::read_to_string(common::example_path("quadruped-walk.motion.json")).unwrap();
    let mut motion: Value = serde_json::from_str(&text).unwrap();
    let none = json!({ "angles": vec![0.0; 12], "velocities": vec![0.0; 12] });
    let table = json!({ "measure": "heading", "bounds": [], "rings": [vec![none; 8]] });
    motion["steering"] = json!({ "direction": [1.0, 0.0], "tables": [table] });
    let steered = write(folder.path(), "steered.json", &motion.to_string());
    let plain = write(folder.path(), "plain.json", &text);
    for format in ["glb", "bvh", "csv", "ros", "mujoco"] {
        for (motion, told) in [(&plain, false), (&steered, !["glb", "bvh"].contains(&format))] {
            let out = folder.path().join("out");
            let out = out.to_str().unwrap();
            let answer = run(&["export", motion, "--character", QUADRUPED, "--format", format, "--out", out]);
            let message = String::from_utf8(answer.stderr).unwrap();
            assert!(answer.status.success(), "{format}: {message}");
            assert_eq!(message.contains("the motion is steered"), told, "{format}: {message}");
        }
    }
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let scenario = json!({ "character": PADDLER, "duration": 100.0, "sample_every": 0.002 }).to_string();
    let mut child = command(&["simulate", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(scenario.as_bytes()).unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(serde_json::from_str::<Value>(&first).is_ok());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn standard_output_that_is_full_is_named() {
    let motion = common::example_path("quadruped-walk.motion.json");
    let motion = motion.to_str().unwrap();
    for arguments in [
        &["check", PADDLER][..],
        &["simulate", "--scene", "friction-0"],
        &["simulate", "--list"],
        &["accuracy", "--list"],
        &["schema"],
        &["export", motion, "--character", QUADRUPED, "--format", "csv", "--out", "-"],
        &["serve", "--print-config"],
    ] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = command(arguments).stdout(full).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        let last = message.lines().next_back().unwrap();
        assert!(
            last.starts_with("standard output cannot be written: No space left"),
            "{arguments:?}: {message}"
        );
    }
}
