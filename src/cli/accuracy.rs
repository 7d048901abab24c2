//! `accuracy`: what accuracy costs, and which setting to take.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use gaitwright::export::front_diagram;
use gaitwright::jobs::USUAL_TOLERANCES;
use gaitwright_learning::accuracy::catalogue::{self, CaseComparison, CaseVerdict};
use gaitwright_learning::accuracy::scenes::{ClosedForm, SCENES};
use gaitwright_learning::accuracy::{Pieces, Recommendation, StudyError, StudyObserver, Sweep, Table, study};
use gaitwright_learning::scenario::Scenario;
use gaitwright_physics::fault::InputError;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::failure::CommandError;
use super::input::{name, print, read, to_stdout};
use super::message::tell;
use super::output::{leave, make_folder};
use super::simulate::FilesBeside;

/// Measures what accuracy costs in computing time for a scenario, as table.csv, table.json and front.svg, and
/// prints the cheapest setting for a tolerance.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("subject").required(true).args(["scenario", "scene", "hard_cases", "list"])))]
pub struct AccuracyCommand {
    /// Scenario document; `-` is standard input
    scenario: Option<PathBuf>,
    /// A built-in scene whose exact motion is known, instead of a scenario
    #[arg(long, value_name = "NAME")]
    scene: Option<String>,
    /// The catalogue of hard cases instead, each at its step and at four times that, with the default settings and with the
    /// best ones known for it: leaves hard_cases.csv and the same as a table in hard_cases.md
    #[arg(long)]
    hard_cases: bool,
    /// List the built-in scenes
    #[arg(long)]
    list: bool,
    /// Folder for table.csv, table.json, front.svg
    #[arg(long, required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Greatest error to be accepted, in the unit of the study; may be given several times
    /// [default: powers of ten from 1e-2 to 1e-7]
    #[arg(long, allow_negative_numbers = true, value_parser = tolerance)]
    tolerance: Vec<f64>,
}

/// What is printed.
#[derive(Serialize)]
struct Recommendations<'a> {
    format: &'static str,
    subject: &'a str,
    unit: &'a str,
    recommendations: Vec<Recommendation>,
}

/// What is printed of the hard cases.
#[derive(Serialize)]
struct HardCases {
    format: &'static str,
    runs: usize,
    /// Cases of which a bound is broken with the best settings, and at which step.
    broken: Vec<String>,
    /// The same with the default settings.
    broken_by_default: Vec<String>,
}

impl AccuracyCommand {
    pub fn run(self) -> Result<(), CommandError> {
        if self.list {
            return list();
        }
        let out = self.out.as_deref().unwrap_or(Path::new("."));
        make_folder(out)?;
        if self.hard_cases {
            return hard_cases(out);
        }
        let table = match (&self.scenario, &self.scene) {
            (Some(path), _) => of_scenario(path)?,
            (None, scene) => of_scene(scene.as_deref().unwrap_or_default())?,
        };
        leave(out, "table.csv", table.to_csv().as_bytes())?;
        leave(out, "table.json", &serde_json::to_vec_pretty(&table)?)?;
        leave(out, "front.svg", front_diagram(&table)?.as_bytes())?;
        let tolerances = if self.tolerance.is_empty() { &USUAL_TOLERANCES[..] } else { &self.tolerance };
        print(&Recommendations {
            format: "gaitwright/recommendations@1",
            subject: &table.subject.name,
            unit: &table.subject.unit,
            recommendations: tolerances.iter().map(|tolerance| table.recommend(*tolerance)).collect(),
        })
    }
}

/// Names the scenes, on standard output.
fn list() -> Result<(), CommandError> {
    Ok(to_stdout(|out| {
        SCENES.iter().try_for_each(|scene| writeln!(out, "{:<16} {}", scene.name, scene.about))
    })?)
}

fn of_scenario(path: &Path) -> Result<Table, CommandError> {
    let faulty = |error| CommandError::input(name(path))(error);
    let scenario = Scenario::parse(&read(path)?).map_err(faulty)?;
    let setup = scenario.set_up(&FilesBeside(path)).map_err(faulty)?;
    let file = Path::new(&name(path))
        .file_name()
        .map_or_else(|| name(path), |file| file.to_string_lossy().into_owned());
    let studied = study(&file, &setup, &Pieces::default(), &Sweep::default(), &mut Progress::new());
    table(studied, &name(path))
}

fn of_scene(name: &str) -> Result<Table, CommandError> {
    let Some(scene) = ClosedForm::named(name) else {
        let names = SCENES.map(|scene| scene.name).join(", ");
        let error = InputError::impossible("", format!("there is no scene of this name; there are {names}"));
        return Err(CommandError::input(name)(error));
    };
    table(scene.study(&Sweep::default(), &mut Progress::new()).map_err(StudyError::from), name)
}

fn table(studied: Result<Option<Table>, StudyError>, name: &str) -> Result<Table, CommandError> {
    match studied {
        Ok(Some(table)) => Ok(table),
        Ok(None) => Err(CommandError::Work(anyhow!("{name}: the study was ended before it was done"))),
        Err(error) => Err(CommandError::study(name)(error)),
    }
}

/// Runs every hard case and leaves what it measures beside what it may be.
fn hard_cases(out: &Path) -> Result<(), CommandError> {
    let mut comparisons = Vec::new();
    let mut progress = Progress::new();
    let cases = catalogue::cases();
    for (index, case) in cases.iter().enumerate() {
        progress.progress(index, cases.len(), &case.name);
        for factor in if case.own_step { &[1.0][..] } else { &[1.0, 4.0] } {
            let compared = catalogue::compare(case, *factor);
            comparisons.push(compared.map_err(CommandError::study(case.name.clone()))?);
        }
    }
    leave(out, "hard_cases.csv", catalogue::to_csv(&comparisons).as_bytes())?;
    leave(out, "hard_cases.md", catalogue::to_markdown(&comparisons).as_bytes())?;
    let broken = |pick: fn(&CaseComparison) -> &CaseVerdict| -> Vec<String> {
        let broken = comparisons.iter().map(pick).filter(|verdict| !verdict.holds());
        broken.map(|verdict| format!("{} at {} s", verdict.case, verdict.accuracy.step)).collect()
    };
    print(&HardCases {
        format: "gaitwright/hard-cases@1",
        runs: comparisons.len(),
        broken: broken(|run| &run.best),
        broken_by_default: broken(|run| &run.by_default),
    })
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("must be a positive finite number".to_owned()),
    }
}

/// Progress on standard error: a bar on a terminal, a line for each method otherwise.
struct Progress {
    bar: Option<ProgressBar>,
    /// What was printed last.
    printed: String,
}

impl Progress {
    fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(1);
            let style = ProgressStyle::with_template("{bar:40} {pos}/{len}  {elapsed}  {msg}");
            style.map_or(bar.clone(), |style| bar.with_style(style))
        });
        Self { bar, printed: String::new() }
    }
}

impl StudyObserver for Progress {
    fn progress(&mut self, done: usize, all: usize, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
            bar.set_message(what.to_owned());
        } else if self.printed != what {
            tell(format_args!("{done}/{all} {what}"));
            what.clone_into(&mut self.printed);
        }
    }

    fn stop(&self) -> bool {
        // Nothing is lost by ending this command where it is.
        false
    }
}
