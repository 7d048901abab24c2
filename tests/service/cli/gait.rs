//! The gait of a motion document.

use super::{QUADRUPED, QUICK, failure, json, refusal, run, run_with, stdout, write};

use std::path::Path;
use std::process::Output;

use serde_json::{Value, json};
use tempfile::TempDir;

#[test]
fn the_gait_of_a_motion_is_that_of_its_training() {
    let folder = TempDir::new().unwrap();
    let job = write(folder.path(), "job.json", QUICK);
    let out = folder.path().join("out");
    stdout(&run(&["train", QUADRUPED, "--out", out.to_str().unwrap(), "--job", &job]));
    let motion = out.join("motion.json");
    let motion = motion.to_str().unwrap();
    let svg = folder.path().join("gait.svg");
    let text = stdout(&run(&["gait", motion, "--character", QUADRUPED, "--svg", svg.to_str().unwrap()]));
    let report: Value = serde_json::from_str(&text).unwrap();
    // The document's times are rounded: targets differ in the last digits.
    assert_close(&report, &json(&out.join("gait.json")));
    assert!(std::fs::read_to_string(svg).unwrap().contains("<svg"));
    let alone: Value = serde_json::from_str(&stdout(&run(&["gait", motion]))).unwrap();
    assert_eq!(
        (&report["format"], &alone["format"]),
        (&json!("gaitwright/gait@1"), &json!("gaitwright/metrics@1"))
    );
    assert_close(&alone["speed"], &report["speed"]);

    let other = std::fs::read_to_string(QUADRUPED).unwrap().replacen("mass value=\"", "mass value=\"1", 1);
    let other = write(folder.path(), "other.urdf", &other);
    let message = refusal(&run(&["gait", motion, "--character", &other]));
    assert!(message.contains("quadruped"), "{message}");
}

/// The same, but for the last digits of numbers.
fn assert_close(one: &Value, other: &Value) {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => {
            assert!(one.keys().eq(other.keys()));
            one.iter().for_each(|(name, value)| assert_close(value, &other[name]));
        }
        (Value::Array(one), Value::Array(other)) => {
            assert_eq!(one.len(), other.len());
            one.iter().zip(other).for_each(|(one, other)| assert_close(one, other));
        }
        _ => match (one.as_f64(), other.as_f64()) {
            (Some(one), Some(other)) => {
                assert!((one - other).abs() <= 1e-7 * one.abs().max(1e-3), "{one} and {other}")
            }
            _ => assert_eq!(one, other),
        },
    }
}

/// The bundled walk, changed, played with the bundled quadruped.
fn gait_of_changed_walk(change: impl FnOnce(&mut Value)) -> Output {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let mut motion = json(&Path::new(examples).join("quadruped-walk.motion.json"));
    change(&mut motion);
    let quadruped = format!("{examples}/quadruped.urdf");
    run_with(&["gait", "-", "--character", &quadruped], motion.to_string().as_bytes())
}

#[test]
fn the_gait_of_a_motion_that_breaks_off_is_not_told() {
    let broken = gait_of_changed_walk(|motion| {
        motion["scene"]["effects"] = json!({ "torque_limits": "off" });
        motion["drive"]["offset"] = json!(vec![1e300; 12]);
    });
    let message = failure(&broken);
    assert!(message.starts_with("standard input: ") && message.contains("broke off"), "{message}");
    assert!(message.contains(" s (") && broken.stdout.is_empty(), "{message}");
}

#[test]
fn the_gait_of_a_motion_that_ends_in_a_fall_says_so() {
    // The ground tilted against gravity: by little, and by more than it can stand on.
    let fallen = gait_of_changed_walk(|motion| motion["scene"]["gravity"] = json!([0, 2, -9]));
    let report: Value = serde_json::from_str(&stdout(&fallen)).unwrap();
    let (fell, seen) = (report["fell_at"].as_f64().unwrap(), report["span"][1].as_f64().unwrap());
    assert!(seen <= fell && fell < seen + 0.01 && fell < 20.0, "{fell} {seen}");
    assert!(String::from_utf8(fallen.stderr).unwrap().contains("fell after"));

    let at_once = gait_of_changed_walk(|motion| motion["scene"]["gravity"] = json!([0, 20, -9]));
    assert!(failure(&at_once).contains("fell after") && at_once.stdout.is_empty());

    let upright: Value = serde_json::from_str(&stdout(&gait_of_changed_walk(|_| ()))).unwrap();
    assert!(upright.get("fell_at").is_none());
}
