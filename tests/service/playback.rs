//! A motion document is all it takes to play a learned motion back.

use crate::common;

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

fn gaitwright(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn center(sample: &Value) -> [f64; 2] {
    [0, 1].map(|axis| sample["center_of_mass"][axis].as_f64().unwrap())
}

/// Learns for a few generations, then plays the document in another process with nothing but the
/// character and the file, and measures the speed from the centre of mass.
#[test]
fn a_motion_played_back_from_its_file_has_the_reported_speed() {
    let folder = tempfile::tempdir().unwrap();
    let character = common::example_path("quadruped.urdf");
    let job = folder.path().join("job.json");
    let learning = json!({ "generations": 3, "population": 8, "islands": 2, "episodes": 4 });
    std::fs::write(&job, json!({ "learning": learning, "seed": 5 }).to_string()).unwrap();
    let out = folder.path().join("out");
    gaitwright(&["train", path(&character), "--out", path(&out), "--job", path(&job)]);

    let motion: Value = serde_json::from_slice(&std::fs::read(out.join("motion.json")).unwrap()).unwrap();
    let scenario = folder.path().join("scenario.json");
    let seconds = motion["metrics"]["upright_seconds"].as_f64().unwrap();
    assert!(seconds >= 20.0, "only {seconds} s");
    let document = json!({
        "format": "gaitwright/scenario@1",
        "character": path(&character),
        "scene": motion["scene"],
        "accuracy": motion["provenance"]["accuracy"],
        "drive": { "kind": "track", "motion": path(&out.join("motion.json")) },
        "duration": seconds,
        "sample_every": 0.002,
    });
    std::fs::write(&scenario, document.to_string()).unwrap();
    let lines = gaitwright(&["simulate", path(&scenario)]);
    let samples: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (summary, samples) = samples.split_last().unwrap();
    assert_eq!(summary["summary"]["status"], "finished");

    let lead = motion["entry"].as_array().unwrap().last().unwrap()["time"].as_f64().unwrap();
    let looping: Vec<&Value> =
        samples.iter().filter(|sample| sample["time"].as_f64().unwrap() >= lead - 1e-9).collect();
    let (first, last) = (looping[0], looping[looping.len() - 1]);
    let time = last["time"].as_f64().unwrap() - first["time"].as_f64().unwrap();
    let speed = (center(last)[0] - center(first)[0]) / time;
    let reported = motion["metrics"]["speed"].as_f64().unwrap();
    // The report samples less finely, so that its first sample may be a few steps into the loop.
    assert!((speed - reported).abs() < 0.01 * reported.abs() + 0.002, "{speed} m/s, reported {reported} m/s");
}
