//! What accuracy costs: the table of a study for the bundled quadruped's gait and for two scenes whose motion is
//! known exactly, as Markdown. The command `accuracy` draws the same as a diagram.
//!
//! `cargo bench --bench accuracy`

use std::path::{Path, PathBuf};

use gaitwright_learning::accuracy::scenes::ClosedForm;
use gaitwright_learning::accuracy::{Pieces, RowStatus, StudyObserver, Sweep, Table, study};
use gaitwright_learning::scenario::{Files, Scenario};
use gaitwright_physics::character::{Options, Reading, read_file};
use gaitwright_physics::fault::InputError;

/// The scenes shown beside the gait.
const SCENES: [&str; 2] = ["double-pendulum", "rolling-ball"];

/// Errors for which a setting is recommended.
const TOLERANCES: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// The files beside the bundled scenarios.
struct Examples(PathBuf);

impl Files for Examples {
    fn character(&self, path: &str) -> Result<Reading, InputError> {
        read_file(&self.0.join(path), Options::default())
    }

    fn motion(&self, path: &str) -> Result<Vec<u8>, InputError> {
        std::fs::read(self.0.join(path)).map_err(|error| InputError::impossible("", error.to_string()))
    }
}

/// Says on standard error what is being done.
struct Told;

impl StudyObserver for Told {
    fn progress(&mut self, done: usize, all: usize, what: &str) {
        eprintln!("{done}/{all} {what}");
    }

    fn stop(&self) -> bool {
        false
    }
}

fn gait() -> Table {
    let examples = Examples(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"));
    let document = std::fs::read(examples.0.join("quadruped-walk.json")).expect("the bundled scenario");
    let setup = Scenario::parse(&document).and_then(|scenario| scenario.set_up(&examples));
    let setup = setup.expect("a sound scenario");
    let table = study("quadruped-walk.json", &setup, &Pieces::default(), &Sweep::default(), &mut Told);
    table.expect("a scenario that can be studied").expect("a study that is not ended early")
}

fn print(table: &Table) {
    let subject = &table.subject;
    println!("\n## {}\n\nError: {}. Truth: {}.\n", subject.name, subject.error, table.truth.because);
    println!("| method | step, ms | error, {} | computing s / simulated s | front |", subject.unit);
    println!("|---|---|---|---|---|");
    for row in &table.rows {
        let step = row.accuracy.map_or("–".to_owned(), |accuracy| match accuracy.step_tolerance {
            Some(tolerance) => format!("to {tolerance:.0e}"),
            None => format!("{}", 1000.0 * accuracy.step),
        });
        let because = row.because.as_deref().unwrap_or_default();
        match (&row.figures, row.status) {
            (Some(figures), _) => println!(
                "| {} | {step} | {:.2e} | {:.2e} | {} |",
                row.method,
                figures.error,
                figures.seconds,
                if row.front { "yes" } else { "" }
            ),
            (None, RowStatus::Diverged) => println!("| {} | {step} | diverged: {because} | | |", row.method),
            (None, _) => println!("| {} | – | left out: {because} | | |", row.method),
        }
    }
    println!("\n| within, {} | take | error | computing s / simulated s |\n|---|---|---|---|", subject.unit);
    for tolerance in TOLERANCES {
        let recommended = table.recommend(tolerance);
        match (recommended.accuracy, recommended.error, recommended.seconds) {
            (Some(accuracy), Some(error), Some(seconds)) => {
                println!(
                    "| {tolerance:.0e} | {} ms: {} | {error:.1e} | {seconds:.1e} |",
                    1000.0 * accuracy.step,
                    recommended.because
                );
            }
            _ => println!("| {tolerance:.0e} | {} | | |", recommended.because),
        }
    }
}

fn main() {
    print(&gait());
    for name in SCENES {
        let scene = ClosedForm::named(name).expect("a scene of this name");
        let table = scene.study(&Sweep::default(), &mut Told).expect("a sound scene");
        print(&table.expect("a study that is not ended early"));
    }
}
