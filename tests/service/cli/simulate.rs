//! Scenarios and scenes of the catalogue.

use super::{PADDLER, failure, refusal, run, run_with, stdout, write};

use serde_json::{Value, json};
use tempfile::TempDir;

#[test]
fn simulate_prints_samples_and_a_summary() {
    let folder = TempDir::new().unwrap();
    std::fs::copy(PADDLER, folder.path().join("paddler.urdf")).unwrap();
    let scenario =
        r#"{"character": "paddler.urdf", "scene": {"ground": null}, "duration": 1.0, "sample_every": 0.5}"#;
    let path = write(folder.path(), "scenario.json", scenario);
    let text = stdout(&run(&["simulate", &path]));
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    // In free fall the centre of mass falls by g t²/2, up to the first-order step's g h t/2.
    let height = |line: &Value| line["center_of_mass"][2].as_f64().unwrap();
    let fallen = height(&lines[0]) - height(&lines[2]);
    assert!((fallen - 0.5 * 9.81).abs() <= 0.5 * 9.81 * 0.002 * 1.01, "{fallen}");
    assert_eq!(lines[3]["summary"]["status"], "finished");
    assert_eq!(lines[3]["summary"]["effects"]["ground_contact"]["on"], false);
}

#[test]
fn the_scenes_of_the_catalogue_are_listed_and_run_by_name() {
    let list = stdout(&run(&["simulate", "--list"]));
    let line = list.lines().find(|line| line.starts_with("friction-0 ")).unwrap();
    assert!(line.ends_with("a block slides on ice for ever"), "{line}");

    let lines = stdout(&run(&["simulate", "--scene", "friction-0", "--step", "0.01"]));
    let last: Value = serde_json::from_str(lines.lines().next_back().unwrap()).unwrap();
    assert_eq!(last["summary"]["status"], "finished");
    assert_eq!(last["summary"]["steps"], 1000);
    assert_eq!(last["summary"]["accuracy"]["step"], 0.01);

    assert!(
        refusal(&run(&["simulate", "--scene", "no-such"])).contains("scene no-such: there is no such scene")
    );
    assert!(refusal(&run(&["simulate", "--scene", "friction-0", "--step", "1"])).contains("/accuracy/step"));
    for arguments in [&["simulate"][..], &["simulate", "--list", "--scene", "friction-0"]] {
        assert_eq!(run(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_scene_that_cannot_be_simulated_is_a_failure_at_work_everywhere() {
    let folder = TempDir::new().unwrap();
    let mut document = json!({ "character": PADDLER, "duration": 0.5,
        "scene": { "effects": { "torque_limits": "off" } },
        "drive": { "kind": "torque", "joints": { "left_hinge": 1e200 } } });
    let path = write(folder.path(), "scenario.json", &document.to_string());
    assert!(failure(&run(&["simulate", &path])).contains("could not go on"));
    let study = run(&["accuracy", &path, "--out", folder.path().to_str().unwrap()]);
    assert_eq!(study.status.code(), Some(1));
    assert!(String::from_utf8(study.stderr).unwrap().contains("broke off"));
    document["accuracy"] = json!({ "tolerance": 1e-3 });
    let message = failure(&run_with(&["simulate", "-"], document.to_string().as_bytes()));
    assert!(message.contains("broke off"), "{message}");
}
