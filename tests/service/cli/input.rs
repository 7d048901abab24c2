//! Command lines and documents that are refused, and the schema of documents that are not.

use super::{PADDLER, QUADRUPED, refusal, run, run_with, stdout, write};
use crate::common;

use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

/// A body without joints.
const BLOCK: &str = r#"<robot name="block"><link name="block"><inertial><mass value="1"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>"#;

#[test]
fn inputs_are_refused_with_their_place() {
    let folder = TempDir::new().unwrap();
    let urdf = std::fs::read_to_string(PADDLER).unwrap();
    let faulty = write(folder.path(), "faulty.urdf", &urdf.replacen("\"2\"", "\"-2\"", 1));
    let message = refusal(&run(&["check", &faulty]));
    assert!(message.starts_with(&format!("{faulty}: line 4")) && message.contains("plate"), "{message}");

    let message = refusal(&run_with(&["check", "-"], b"neither"));
    assert!(message.starts_with("standard input: "), "{message}");
    let message = refusal(&run(&["check", "no-such-file.urdf"]));
    assert!(message.starts_with("no-such-file.urdf: "), "{message}");

    let job = write(folder.path(), "job.json", r#"{"sede": 1, "scene": {"frictoin": 1}}"#);
    let out = folder.path().join("out");
    let message = refusal(&run(&["train", PADDLER, "--out", out.to_str().unwrap(), "--job", &job]));
    assert!(
        message.starts_with(&job) && message.contains("/sede") && message.contains("/scene/frictoin"),
        "{message}"
    );
    assert!(!out.exists());

    // What is wrong with the character is said of its own file, not of the job's.
    let block = write(folder.path(), "block.urdf", BLOCK);
    let job = write(folder.path(), "job.json", "{}");
    let message = refusal(&run(&["train", &block, "--out", out.to_str().unwrap(), "--job", &job]));
    assert!(message.starts_with(&format!("{block}: ")) && message.contains("no joint"), "{message}");

    let scenario = write(folder.path(), "scenario.json", r#"{"character": "no-such-file.urdf"}"#);
    let message = refusal(&run(&["simulate", &scenario]));
    assert!(message.contains("/character") && message.contains("no-such-file.urdf"), "{message}");
    let motion = write(folder.path(), "motion.json", r#"{"format": "gaitwright/motion@1"}"#);
    let message = refusal(&run(&["gait", &motion]));
    assert!(message.starts_with(&motion), "{message}");

    assert_eq!(run(&["dance"]).status.code(), Some(2));
    assert_eq!(run(&["train", PADDLER]).status.code(), Some(2), "--out is missing");
}

#[test]
fn standard_input_is_read_once() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let export = ["export", "-", "--character", "-", "--format", "glb", "--out", out];
    for (arguments, names) in [
        (&["train", "-", "--job", "-", "--out", out][..], "--job and CHARACTER"),
        (&export, "MOTION and --character"),
        (&["gait", "-", "--character", "-"], "--character and MOTION"),
    ] {
        let message = refusal(&run(arguments));
        assert!(
            message.starts_with(&format!("standard input: can be read once, and {names} are")),
            "{message}"
        );
    }
}

#[test]
fn negative_numbers_are_refused_by_the_option_that_they_are_given_to() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let motion = common::example_path("quadruped-walk.motion.json");
    let train = ["train", PADDLER, "--out", out];
    let export =
        ["export", motion.to_str().unwrap(), "--character", QUADRUPED, "--format", "csv", "--out", out];
    let accuracy = ["accuracy", "--scene", "pendulum", "--out", out];
    let study = ["study", "--out", out];
    let simulate = ["simulate", "--scene", "friction-0"];
    for (command, option, reason) in [
        (&train[..], "--seed", "--seed <SEED>': must be a whole number from 0"),
        (&train, "--generations", "-1 is not in 0..="),
        (&train, "--seconds", "--seconds: -1 does not"),
        (&train, "--threads", "-1 is not in 1..=1024"),
        (&export, "--fps", "--fps: "),
        (&accuracy, "--tolerance", "must be a positive finite number"),
        (&study, "--seeds", "must be a whole number from 1"),
        (&study, "--seconds", "must be a positive number"),
        (&study, "--threads", "-1 is not in 1..=1024"),
        (&simulate, "--step", "/accuracy/step: "),
    ] {
        let output = run(&[command, &[option, "-1"]].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        let name = option.trim_start_matches('-');
        assert!(message.contains(name) && message.contains(reason), "{option}: {message}");
        assert!(!message.contains("unexpected"), "{option}: {message}");
    }
    assert!(!Path::new(out).exists(), "nothing was begun");
}

#[test]
fn a_command_line_that_cannot_be_used_is_told_in_one_line() {
    for (arguments, what) in [
        (&["train", "robot.urdf"][..], "--out"),
        (&["train", "robot.urdf", "--out", "there", "--sede", "7"], "--seed"),
        (&["weave"], "weave"),
        (&["export", "motion.json"], "--character"),
    ] {
        let output = run(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert!(message.starts_with("the command line: ") && message.contains(what), "{message}");
    }
    let help = run(&["train", "--help"]);
    assert!(help.status.success() && stdout(&help).lines().count() > 10);
}

#[test]
fn a_step_does_not_go_with_a_tolerance() {
    let document = json!({ "character": PADDLER, "accuracy": { "tolerance": 0.1 } }).to_string();
    let message = refusal(&run_with(&["simulate", "-", "--step", "0.002"], document.as_bytes()));
    assert!(message.contains("/accuracy: `tolerance`") && message.contains("--step"), "{message}");
}

#[test]
fn schema_is_a_json_schema() {
    let schema: Value = serde_json::from_str(&stdout(&run(&["schema"]))).unwrap();
    assert!(schema["$schema"].as_str().unwrap().contains("2020-12"));
    assert!(schema["properties"]["links"].is_object());
}
