//! `train`: a job without a service.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use gaitwright::jobs::{
    Artefact, JobTerms, Order, PreparedRun, RepertoireEntry, RunError, RunWatcher, Settings, Stage, run,
};
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::{Budget, Cancel, Generation};
use gaitwright_learning::training::{LearnedMotion, TrainingCheckpoint};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Metrics;
use indicatif::{ProgressBar, ProgressStyle};
use tokio::signal::unix::{SignalKind, signal};

use super::failure::CommandError;
use super::input::{self, check_budget, check_once, name, read_character, to_stdout, whole};
use super::message::tell;
use super::output::make_folder;

/// How long a run that is asked to end may take to write what it has found.
const LONGEST_END: Duration = Duration::from_secs(5);

/// Shortest time between two plain lines of progress.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// Learns motions and leaves them, with a recording, in a folder. Ctrl-C ends the learning; what
/// was found by then is written.
#[derive(Debug, clap::Args)]
pub struct TrainCommand {
    /// URDF, character JSON, or zip of a URDF with its meshes; `-` is standard input
    character: PathBuf,
    /// Refuse a character whose physics had to be repaired or approximated
    #[arg(long)]
    strict: bool,
    /// Folder for recording.rrd, motion.json, motions.json, motions/*.json, report.json, curve.csv, gait.svg
    #[arg(long)]
    out: PathBuf,
    /// Job document: scene, task, learning, accuracy, seed
    #[arg(long)]
    job: Option<PathBuf>,
    /// Seed of everything drawn by chance
    #[arg(long, allow_negative_numbers = true, value_parser = whole::<0>)]
    seed: Option<u64>,
    /// Greatest number of generations
    #[arg(long, allow_negative_numbers = true)]
    generations: Option<u32>,
    /// Greatest training time, s; a result limited by it is not reproducible
    #[arg(long, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Threads; the result does not depend on their number [default: all cores]
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

impl TrainCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let job = self.job.iter().map(|job| ("--job", job));
        check_once(job.chain([("CHARACTER", &self.character)]))?;
        let reading = read_character(&self.character, self.strict)?;
        let (settings, place) = self.settings()?;
        let order = Order::new(reading, settings).map_err(|error| self.faulty(&place, error))?;
        let out = &self.out;
        make_folder(out)?;
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = self.threads.map_or_else(cores, usize::from);
        let cancel = Cancel::default();
        cancel_on_interrupt(cancel.clone())?;
        let outcome = run(&order, threads, out, (&cancel, Duration::MAX), None, &mut Progress::new())
            .map_err(|error| match error {
                RunError::Input(error) => self.faulty(&place, error),
                error => CommandError::from(error),
            })?;
        list(out)?;
        outcome.motion.map(drop).map_err(|reason| CommandError::Work(reason.into()))
    }

    /// An error in what was asked for at `place`, or in the character, which has a file of its own here.
    fn faulty(&self, place: &str, error: InputError) -> CommandError {
        match error.within("/character") {
            Some(error) => CommandError::Input { name: name(&self.character), error },
            None => CommandError::Input { name: place.to_owned(), error },
        }
    }

    /// What is wanted, and where it was asked for.
    fn settings(&self) -> Result<(Settings, String), CommandError> {
        let (mut settings, place) = match &self.job {
            None => (Settings::default(), "the command line".to_owned()),
            Some(path) => {
                let terms = JobTerms::parse(&input::read(path)?).map_err(CommandError::input(name(path)))?;
                (terms.settings, name(path))
            }
        };
        // What is wrong with an option is said of the option, and not of the document that it amends.
        check_budget(self.generations, self.seconds)?;
        settings.seed = self.seed.unwrap_or(settings.seed);
        settings.learning.generations = self.generations.or(settings.learning.generations);
        settings.learning.seconds = self.seconds.or(settings.learning.seconds);
        Ok((settings, place))
    }
}

/// Names the files that were written, on standard output.
fn list(out: &Path) -> Result<(), CommandError> {
    let artefacts = [
        Artefact::Recording,
        Artefact::Motion,
        Artefact::Motions,
        Artefact::Report,
        Artefact::Curve,
        Artefact::Gait,
        Artefact::Diagram,
    ];
    Ok(to_stdout(|stdout| {
        for path in artefacts.map(|artefact| artefact.path(out)).iter().filter(|path| path.exists()) {
            writeln!(stdout, "{}", path.display())?;
        }
        Ok(())
    })?)
}

/// Cancels at the first interrupt; at the second the program ends where it is, and so it does when somebody who asked for
/// its end (SIGTERM) has waited for [`LONGEST_END`], whatever it is waiting for itself.
fn cancel_on_interrupt(cancel: Cancel) -> Result<(), CommandError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (mut interrupt, mut terminate) = {
        let _entered = runtime.enter();
        (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?)
    };
    std::thread::Builder::new().name("interrupts".to_owned()).spawn(move || {
        runtime.block_on(async {
            let longest = tokio::select! {
                _ = interrupt.recv() => Duration::MAX,
                _ = terminate.recv() => LONGEST_END,
            };
            cancel.cancel();
            tell(format_args!("stopping; what was found is written"));
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
                () = tokio::time::sleep(longest) => {}
            }
            std::process::exit(1);
        });
    })?;
    Ok(())
}

/// Progress on standard error: a bar on a terminal, plain lines otherwise.
struct Progress {
    bar: Option<ProgressBar>,
    /// Known once the learning begins.
    budget: Option<Budget>,
    /// When the last plain line was printed.
    printed: Option<Instant>,
    /// s since the start of the learning, as of the last generation.
    elapsed: f64,
}

impl Progress {
    fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(1000);
            let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed}  {msg}");
            style.map_or(bar.clone(), |style| bar.with_style(style))
        });
        Self { bar, budget: None, printed: None, elapsed: 0.0 }
    }

    /// A line that stays.
    fn print(&self, line: String) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => tell(format_args!("{line}")),
        }
    }

    fn show(&self, line: String) {
        match &self.bar {
            Some(bar) => bar.set_message(line),
            None => tell(format_args!("{line}")),
        }
    }
}

impl RunWatcher for Progress {
    fn stage(&mut self, stage: Stage) {
        self.show(match stage {
            Stage::Standing => "finding how the character stands".to_owned(),
            Stage::Learning => "learning".to_owned(),
            Stage::Studying => "trying settings of the simulation".to_owned(),
            Stage::Checking => "checking what was learned".to_owned(),
        });
    }

    fn prepared(&mut self, prepared: &PreparedRun) {
        self.budget = Some(prepared.setup.parameters.budget);
        self.print(format!("the character {}", prepared.teaching()));
    }

    fn generation(&mut self, figures: &Generation) {
        self.elapsed = figures.elapsed;
        if let Some(bar) = &self.bar {
            let share = |budget: Budget| budget.fraction(figures.generation + 1, figures.elapsed);
            bar.set_position((1000.0 * self.budget.map_or(0.0, share)) as u64);
        } else if self.printed.is_some_and(|printed| printed.elapsed() < LINE_EVERY) {
            return;
        }
        self.printed = Some(Instant::now());
        let what = figures.gait.as_ref().map_or(String::new(), |gait| format!("{gait}, "));
        self.show(format!(
            "{what}generation {}: fitness {:.3}, mean {:.3}, {:.0} s simulated, {:.0} s",
            figures.generation, figures.best, figures.mean, figures.simulated_seconds, figures.elapsed
        ));
    }

    fn improved(&mut self, motion: &LearnedMotion, gait: &GaitReport) {
        // What is not natural yet is shown in the recording alone.
        if gait.natural {
            let figures = outcome(gait.speed, gait.cost_of_transport, gait.gait.as_deref(), "natural");
            self.print(format!("{} after {:.0} s: {figures}", motion.name, self.elapsed));
        }
    }

    fn learned(&mut self, entry: &RepertoireEntry) {
        let RepertoireEntry { number, name, metrics, .. } = entry;
        let Metrics { speed, cost_of_transport, gait, natural, validity, .. } = metrics;
        let verdict = match (natural, validity.valid) {
            (true, true) => "natural",
            (true, false) => "natural, not valid",
            (false, true) => "not natural",
            (false, false) => "not natural, not valid",
        };
        let figures = outcome(*speed, *cost_of_transport, gait.as_deref(), verdict);
        self.print(format!("motion {number}, {name}: {figures}"));
    }

    fn checkpoint(&mut self, _: &TrainingCheckpoint) {
        // A run of this command is not resumed.
    }
}

/// Speed (m/s), cost of transport, gait and verdict in words.
fn outcome(speed: f64, cost: Option<f64>, gait: Option<&str>, verdict: &str) -> String {
    let cost = cost.map_or(String::new(), |cost| format!(", cost of transport {cost:.2}"));
    format!("{speed:.2} m/s{cost}, {}, {verdict}", gait.unwrap_or("no name"))
}
