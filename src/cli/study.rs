//! `study`: the open questions about the learning.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::anyhow;
use gaitwright::export::course_diagram;
use gaitwright::jobs::read_character as read_bytes;
use gaitwright_learning::learn::LearnError;
use gaitwright_learning::study::arena::StudyArena;
use gaitwright_learning::study::variants::{Question, questions, variants};
use gaitwright_learning::study::{LearningStudy, run};
use gaitwright_physics::character::Options;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use indicatif::{ProgressBar, ProgressStyle};

use super::demo::QUADRUPED;
use super::failure::CommandError;
use super::input::{read_character, to_stdout, whole};
use super::message::tell;
use super::output::{leave, make_folder};

/// Answers the open questions of the paper, and compares the learning with rival searches, each variant on the same budget
/// of simulated time: table.csv, table.json, and a plot for each question.
#[derive(Debug, clap::Args)]
pub struct StudyCommand {
    /// Who is to move, with legs in pairs: URDF, character JSON, or zip [default: the bundled quadruped]
    character: Option<PathBuf>,
    /// Folder for table.csv, table.json and the plots
    #[arg(long)]
    out: PathBuf,
    /// Runs of each variant
    #[arg(long, default_value = "5", allow_negative_numbers = true, value_parser = whole::<1>)]
    seeds: u64,
    /// Budget of a run in seconds of simulated time, so that the result does not depend on the machine or on what else it
    /// does; the generation in which it is used up is the last
    #[arg(long, default_value = "1000", allow_negative_numbers = true, value_parser = budget)]
    seconds: f64,
    /// A question to be answered, and no others; may be given several times
    #[arg(long, value_name = "NAME")]
    question: Vec<String>,
    /// Threads; the result does not depend on their number [default: all cores]
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

impl StudyCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let questions = self.questions()?;
        let file = self.character.as_deref().map_or("examples/quadruped.urdf".to_owned(), super::input::name);
        let reading = match &self.character {
            Some(path) => read_character(path, false)?,
            None => read_bytes(QUADRUPED.as_bytes(), None, Options::default())
                .map_err(CommandError::input(file.clone()))?,
        };
        let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
        let arena = StudyArena::new(&model).ok_or_else(|| {
            let reason = "the character has no legs in pairs that gaits have names for";
            CommandError::input(file)(InputError::impossible("", reason))
        })?;
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let study = LearningStudy {
            arena,
            questions,
            variants: variants(),
            seeds: self.seeds,
            seconds: self.seconds,
            threads: self.threads.map_or_else(cores, usize::from),
        };
        make_folder(&self.out)?;
        let bar = bar();
        let progress = |done: usize, all: usize, what: &str| match &bar {
            Some(bar) => {
                bar.set_length(all as u64);
                bar.set_position(done as u64);
                bar.set_message(what.to_owned());
            }
            None => tell(format_args!("{done}/{all} {what}")),
        };
        let table = run(&study, &progress).map_err(|error| match error {
            LearnError::Input(error) => CommandError::input("study")(error),
            error => CommandError::Work(anyhow!(error)),
        })?;
        let out = |name: &str, contents: &[u8]| {
            leave(&self.out, name, contents)?;
            Ok::<_, CommandError>(to_stdout(|stdout| writeln!(stdout, "{}", self.out.join(name).display()))?)
        };
        out("table.csv", table.to_csv().as_bytes())?;
        out("table.json", &serde_json::to_vec_pretty(&table)?)?;
        for question in &study.questions {
            let plot = course_diagram(&table, question.name)?;
            out(&format!("{}.svg", question.name), plot.as_bytes())?;
        }
        Ok(())
    }

    /// Those that are asked for.
    fn questions(&self) -> Result<Vec<Question>, CommandError> {
        let all = questions();
        for name in &self.question {
            if !all.iter().any(|question| question.name == name) {
                let names: Vec<&str> = all.iter().map(|question| question.name).collect();
                let reason = format!("there is no question of this name; there are {}", names.join(", "));
                return Err(CommandError::input(name.clone())(InputError::impossible("", reason)));
            }
        }
        let asked = |question: &Question| self.question.iter().any(|name| name == question.name);
        Ok(all.into_iter().filter(|question| self.question.is_empty() || asked(question)).collect())
    }
}

fn bar() -> Option<ProgressBar> {
    std::io::stderr().is_terminal().then(|| {
        let bar = ProgressBar::new(1);
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len}  {elapsed}  {msg}");
        style.map_or(bar.clone(), |style| bar.with_style(style))
    })
}

fn budget(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1e9 => Ok(value),
        _ => Err("must be a positive number of at most 1e9".to_owned()),
    }
}
