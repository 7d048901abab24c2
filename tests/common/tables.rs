//! A table of accuracy made by hand, and a reader of its CSV.

use gaitwright_learning::accuracy::{
    Engine, ErrorSpread, Figures, RowStatus, StudySubject, Table, TableRow, Truth,
};
use gaitwright_physics::scene::{Accuracy, Feedforward};

fn row(method: &str, step: f64, figures: Option<(f64, f64)>) -> TableRow {
    let figures = figures.map(|(seconds, error)| Figures {
        error,
        spread: ErrorSpread::of(&[0.5 * error, error, 2.0 * error]),
        seconds,
        evaluations: Some(1.0 / step),
        energy_error: 0.0,
        momentum_error: 0.0,
        penetration: Some(0.0),
        limit_overshoot: 0.0,
        joint_separation: Some(0.0),
        residual: Some(1e-12),
        unsolved_steps: Some(0),
    });
    TableRow {
        method: method.to_owned(),
        engine: Engine::Gaitwright,
        accuracy: Some(Accuracy { step, ..Accuracy::default() }),
        feedforward: None,
        status: if figures.is_some() { RowStatus::Measured } else { RowStatus::Diverged },
        because: figures.is_none().then(|| "it flew away, \"far\"".to_owned()),
        figures,
        front: false,
    }
}

pub fn table() -> Table {
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
    let subject = StudySubject {
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
        Vec::new(),
        rows,
    )
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

pub fn readable(csv: &str, rows: usize) {
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
