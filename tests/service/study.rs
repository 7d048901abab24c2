//! The study from the command line, and its plots.

use std::process::{Command, Output};

use gaitwright::export::course_diagram;
use gaitwright_learning::study::LearningTable;
use tempfile::TempDir;

fn study(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("study").args(arguments).output().unwrap()
}

#[test]
fn the_command_leaves_a_table_and_a_plot_for_each_question() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let output = study(&["--out", out, "--seeds", "2", "--seconds", "1", "--question", "reward"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let named = String::from_utf8(output.stdout).unwrap();
    let names: Vec<&str> = named.lines().map(|line| line.rsplit('/').next().unwrap()).collect();
    assert_eq!(names, ["table.csv", "table.json", "reward.svg"]);
    let file = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let table: LearningTable = serde_json::from_str(&file("table.json")).unwrap();
    assert_eq!((table.task.seeds, table.task.simulated_seconds, table.rows.len()), (2, 1.0, 2));
    assert_eq!(file("table.csv"), table.to_csv());
    assert_eq!(file("table.csv").lines().count(), 3);

    let svg = file("reward.svg");
    assert_eq!(svg, course_diagram(&table, "reward").unwrap());
    let document = roxmltree::Document::parse(&svg).unwrap();
    let drawn = |tag: &str| document.descendants().filter(|node| node.has_tag_name(tag)).count();
    assert!(
        drawn("polygon") >= 2 && drawn("polyline") >= 4,
        "a band and a line for each variant, and its legend"
    );
    for text in
        ["Does it matter what energy costs?", "repaired", "repaired, energy times 10", "simulated time"]
    {
        assert!(svg.contains(text), "{text}");
    }
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let snake = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/snake.json");
    for (arguments, reason) in [
        (&[snake, "--out", "unused"][..], "no legs in pairs"),
        (&["--out", "unused", "--question", "why"][..], "there are longer, trunk"),
        (&["--out", "unused", "--seconds", "0"][..], "positive"),
        (&["--out", "unused", "--seeds", "0"][..], "seeds"),
    ] {
        let refused = study(arguments);
        let message = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(message.contains(reason), "{message}");
    }
}
