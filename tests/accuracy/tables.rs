//! Tables made by hand: their front, what they recommend, their forms; and the command that writes them.

use std::process::{Command, Output};

use gaitwright::accuracy::{Engine, Figures, Row, Status, Subject, Table, Truth};
use gaitwright::export::front_diagram;
use gaitwright::scene::{Accuracy, Feedforward};
use serde_json::Value;
use tempfile::TempDir;

fn row(method: &str, step: f64, figures: Option<(f64, f64)>) -> Row {
    let figures = figures.map(|(seconds, error)| Figures {
        error,
        worst_error: 2.0 * error,
        seconds,
        evaluations: Some(1.0 / step),
        energy_error: 0.0,
        momentum_error: 0.0,
        penetration: Some(0.0),
        limit_overshoot: 0.0,
        joint_separation: Some(0.0),
        residual: Some(1e-12),
    });
    Row {
        method: method.to_owned(),
        engine: Engine::Gaitwright,
        accuracy: Some(Accuracy { step, ..Accuracy::default() }),
        feedforward: None,
        status: if figures.is_some() { Status::Measured } else { Status::Diverged },
        because: figures.is_none().then(|| "it flew away, \"far\"".to_owned()),
        figures,
        front: false,
    }
}

fn table() -> Table {
    let mut variant = row("variant", 0.003, Some((0.0001, 1e-9)));
    variant.feedforward = Some(Feedforward::None);
    let mut other = row("other engine", 0.0005, Some((0.0015, 1e-5)));
    other.engine = Engine::Rapier;
    let rows = vec![
        row("coarse", 0.008, Some((0.001, 1e-2))),
        row("coarse", 0.004, Some((0.002, 5e-3))),
        row("coarse", 0.002, None),
        row("fine", 0.004, Some((0.004, 2e-4))),
        row("fine", 0.002, Some((0.0065, 2e-4))),
        row("fine", 0.001, Some((0.01, 2e-6))),
        variant,
        other,
    ];
    let subject = Subject {
        name: "hand-made".into(),
        character: "nobody".into(),
        error: "distance from home".into(),
        unit: "m".into(),
        compared: 3,
        seconds: 1.0,
    };
    Table::new(
        subject,
        Truth { because: "written down".into(), accuracy: None, uncertainty: Some(1e-7) },
        rows,
    )
}

#[test]
fn the_front_is_what_nothing_beats() {
    let front: Vec<bool> = table().rows.iter().map(|row| row.front).collect();
    assert_eq!(front, [true, false, false, false, false, true, false, true]);
}

#[test]
fn the_cheapest_setting_within_the_tolerance_is_recommended() {
    let table = table();
    let step = |tolerance| table.recommend(tolerance).accuracy.map(|accuracy| accuracy.step);
    assert_eq!(step(1.0), Some(0.008));
    assert_eq!(step(1e-2), Some(0.008), "a tolerance that is just met is met");
    assert_eq!(step(6e-3), Some(0.004));
    assert_eq!(step(1e-3), Some(0.004), "of two equally exact settings the faster");
    assert_eq!(step(1e-5), Some(0.001), "another engine is not recommended, nor a variant of the subject");
    let recommended = table.recommend(1e-3);
    assert_eq!((recommended.error, recommended.seconds), (Some(2e-4), Some(0.004)));
    assert!(recommended.because.contains("fine"), "{}", recommended.because);
}

#[test]
fn a_tolerance_that_nothing_meets_is_told() {
    let none = table().recommend(1e-6);
    assert_eq!((none.accuracy, none.error, none.seconds), (None, None, None));
    assert!(none.because.contains("2.0e-6 m"), "{}", none.because);
    let unknowable = table().recommend(1e-8);
    assert!(unknowable.because.contains("1.0e-7 m"), "{}", unknowable.because);
}

/// Splits a line of comma-separated values.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            letter => cells.last_mut().unwrap().push(letter),
        }
    }
    cells
}

fn readable(csv: &str, rows: usize) {
    let lines: Vec<Vec<String>> = csv.lines().map(cells).collect();
    assert_eq!(lines.len(), rows + 1);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{csv}");
    let column = |name: &str| lines[0].iter().position(|own| own == name).unwrap();
    for line in &lines[1..] {
        match line[column("status")].as_str() {
            "measured" => {
                assert!(line[column("error")].parse::<f64>().unwrap() >= 0.0);
                assert!(line[column("seconds")].parse::<f64>().unwrap() > 0.0);
            }
            "diverged" | "left_out" => {
                assert!(line[column("error")].is_empty() && !line[column("because")].is_empty());
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn tables_can_be_read_back() {
    let table = table();
    let text = serde_json::to_string(&table).unwrap();
    assert!(text.starts_with(r#"{"format":"gaitwright/accuracy@1""#));
    assert_eq!(serde_json::from_str::<Table>(&text).unwrap(), table);
    readable(&table.to_csv(), table.rows.len());
}

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
    let table = Table::new(table().subject, table().truth, Vec::new());
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
    assert_eq!(listed.lines().count(), gaitwright::accuracy::scenes::SCENES.len());
    assert!(listed.starts_with("ballistic "));
    let refused = accuracy(&["--scene", "nothing", "--out", "unused"]);
    assert_eq!(refused.status.code(), Some(2));
    let message = String::from_utf8(refused.stderr).unwrap();
    assert!(message.contains("nothing") && message.contains("tumbling"), "{message}");
    assert_eq!(accuracy(&["--out", "unused"]).status.code(), Some(2), "neither a scenario nor a scene");
}
