//! A motion document is all it takes to play a learned motion back.

use crate::common;
use crate::http::whole::hasty_task;

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
    let document =
        json!({ "task": { "gait": "trot", "froude": 0.4 }, "learning": { "generations": 8 }, "seed": 5 });
    std::fs::write(&job, document.to_string()).unwrap();
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

/// The trials are all there, each with what it changes, and every measure is judged by the limit beside it.
#[test]
fn a_published_motion_is_judged_and_tried() {
    let folder = tempfile::tempdir().unwrap();
    let character = common::example_path("quadruped.urdf");
    let train = |name: &str, threads: &str| -> Value {
        let (job, out) = (folder.path().join("job.json"), folder.path().join(name));
        let learning =
            json!({ "generations": 2, "population": 8, "islands": 1, "episodes": 4, "seeds": "none" });
        let task = hasty_task([1.0, 0.0, 0.0]);
        let job_document =
            json!({ "task": task, "learning": learning, "seed": 5, "scene": { "friction": 0.5 } });
        std::fs::write(&job, job_document.to_string()).unwrap();
        let arguments =
            ["train", path(&character), "--out", path(&out), "--job", path(&job), "--threads", threads];
        gaitwright(&arguments);
        serde_json::from_slice(&std::fs::read(out.join("motion.json")).unwrap()).unwrap()
    };
    let motion = train("one", "1");
    let metrics = &motion["metrics"];
    let trials = metrics["validity"]["trials"].as_array().unwrap();
    let step = 1000.0 * motion["provenance"]["accuracy"]["step"].as_f64().unwrap();
    let changes: Vec<&str> = trials.iter().map(|trial| trial["change"].as_str().unwrap()).collect();
    let steps = [2.0, 0.25].map(|factor| format!("step of {} ms", factor * step));
    assert_eq!(
        changes[..5],
        ["friction times 0.6", "friction times 1.4", "gains times 0.75", "mass times 0.9", "mass times 1.1"]
    );
    assert!(changes[5].starts_with("sideways push of ") && changes[5].contains(" N s at "), "{changes:?}");
    assert_eq!(changes[6..8], steps);
    // 0.15 √(h / g) for hips at a height of 0.279 m.
    let soft = changes[8].strip_prefix("soft contacts of ").unwrap().strip_suffix(" ms").unwrap();
    assert!((soft.parse::<f64>().unwrap() - 25.3).abs() < 0.2, "{changes:?}");
    assert_eq!(changes[9..], ["engine rapier3d"]);
    for trial in trials {
        let number = |field: &str| trial[field].as_f64().unwrap();
        assert!(number("upright_seconds") <= number("of_seconds"), "{trial}");
        assert!(number("speed").is_finite());
        if let Some(relative) = trial["relative_speed"].as_f64() {
            assert!(
                relative * number("speed") >= 0.0 || metrics["speed"].as_f64().unwrap() < 0.05,
                "{trial}"
            );
        }
    }
    assert_ne!(trials[0]["speed"], trials[1]["speed"]);

    let measures = metrics["naturalness"].as_object().unwrap();
    assert!(measures.len() > 10, "{measures:?}");
    assert_eq!(metrics["natural"], measures.values().all(|measure| measure["holds"] == true));
    assert_eq!(measures["travel"]["limit"], json!([0.01, null]));
    assert_eq!(measures["travel"]["holds"], true);
    assert!(metrics["positive_cost_of_transport"].as_f64() <= metrics["cost_of_transport"].as_f64());

    // The same on two threads.
    assert_eq!(train("two", "2")["metrics"], *metrics);
}

/// On ice nothing can travel: nothing accelerates the centre of mass along the ground. Whatever was learned is no success.
#[test]
fn what_does_not_travel_is_no_success() {
    let folder = tempfile::tempdir().unwrap();
    let character = common::example_path("quadruped.urdf");
    let (job, out) = (folder.path().join("job.json"), folder.path().join("out"));
    let learning = json!({ "generations": 2, "population": 8, "islands": 1, "episodes": 4, "seeds": "none" });
    std::fs::write(
        &job,
        json!({ "learning": learning, "seed": 5, "scene": { "friction": 0.0 } }).to_string(),
    )
    .unwrap();
    let arguments = ["train", path(&character), "--out", path(&out), "--job", path(&job)];
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright")).args(arguments).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(!out.join("motion.json").exists());
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    let reason = report["unsuccessful"].as_str().unwrap();
    assert!(reason.contains("does not travel"), "{reason}");
}
