//! The price of accuracy from the command line, and its diagrams.

use std::process::{Command, Output};

use gaitwright::export::front_diagram;
use gaitwright_learning::accuracy::Table;
use gaitwright_physics::scene::{Accuracy, AskedAccuracy};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::tables::{readable, table};

/// The lines of a diagram, told by their number of points.
fn lines(svg: &str) -> Vec<usize> {
    let document = roxmltree::Document::parse(svg).unwrap();
    let drawn = document.descendants().filter(|node| node.has_tag_name("polyline"));
    drawn.map(|line| line.attribute("points").unwrap().split_whitespace().count()).collect()
}

#[test]
fn the_diagram_shows_every_method_and_the_front() {
    let svg = front_diagram(&table()).unwrap();
    for text in
        ["hand-made", "coarse (× 1 diverged)", "fine", "other engine", "distance from home", "error, m"]
    {
        assert!(svg.contains(text), "{text}");
    }
    assert!(!svg.contains("variant"), "what drives the character otherwise is not compared");
    assert!(lines(&svg).iter().filter(|points| **points == 3).count() >= 2, "the front and `fine`");
}

#[test]
fn an_empty_table_can_be_drawn() {
    let table = Table::new(table().subject, table().truth, Vec::new(), Vec::new());
    assert!(front_diagram(&table).unwrap().contains("hand-made"));
    assert_eq!(table.recommend(1.0).accuracy, None);
}

fn accuracy(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("accuracy").args(arguments).output().unwrap()
}

#[test]
fn the_command_leaves_table_and_diagram_and_recommends() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let output = accuracy(&["--scene", "ballistic", "--out", out.to_str().unwrap(), "--tolerance", "1e-2"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let recommended = &said["recommendations"][0];
    assert_eq!((&said["unit"], &recommended["tolerance"]), (&Value::from("m"), &Value::from(1e-2)));
    assert!(recommended["error"].as_f64().unwrap() <= 1e-2);
    let settings: Accuracy = serde_json::from_value(recommended["accuracy"].clone()).unwrap();
    assert!(settings.faults().is_empty());

    let table: Table = serde_json::from_slice(&std::fs::read(out.join("table.json")).unwrap()).unwrap();
    assert_eq!(table.subject.name, "ballistic");
    assert_eq!(serde_json::to_value(table.recommend(1e-2)).unwrap(), *recommended);
    readable(&std::fs::read_to_string(out.join("table.csv")).unwrap(), table.rows.len());
    assert!(!lines(&std::fs::read_to_string(out.join("front.svg")).unwrap()).is_empty());
}

#[test]
fn the_command_lists_its_scenes_and_refuses_others() {
    let listed = String::from_utf8(accuracy(&["--list"]).stdout).unwrap();
    assert_eq!(listed.lines().count(), gaitwright_learning::accuracy::scenes::SCENES.len());
    assert!(listed.starts_with("ballistic "));
    let refused = accuracy(&["--scene", "nothing", "--out", "unused"]);
    assert_eq!(refused.status.code(), Some(2));
    let message = String::from_utf8(refused.stderr).unwrap();
    assert!(message.contains("nothing") && message.contains("tumbling"), "{message}");
    assert_eq!(accuracy(&["--out", "unused"]).status.code(), Some(2), "neither a scenario nor a scene");
}

#[test]
fn a_job_says_what_was_chosen_and_why() {
    let quadruped = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/quadruped.urdf");
    let folder = TempDir::new().unwrap();
    let job = folder.path().join("job.json");
    let document = json!({
        "accuracy": { "tolerance": 0.004 },
        "task": { "gait": "trot" },
        "learning": { "generations": 1 } });
    std::fs::write(&job, document.to_string()).unwrap();
    let out = folder.path().join("out");
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright"))
        .args(["train", quadruped, "--job", job.to_str().unwrap(), "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["accuracy_choice"]["tolerance"], 0.004);
    assert!(report["accuracy_choice"]["error"].as_f64().unwrap() <= 0.004);
    // What was learned is tried again with it.
    let checked = &report["accuracy_check"];
    assert!(report["metrics"].is_object(), "{}", report["unsuccessful"]);
    assert_eq!(checked["tolerance"], 0.004);
    assert_eq!(checked["holds"], checked["error"].as_f64().unwrap() <= 0.004, "{checked}");
    assert!(checked["because"].as_str().unwrap().contains("the motion that was learned"), "{checked}");
    let used: AskedAccuracy = serde_json::from_value(report["accuracy"].clone()).unwrap();
    assert!(matches!(used, AskedAccuracy::Settings(_)), "{used:?}");
}
