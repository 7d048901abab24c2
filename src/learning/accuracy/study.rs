//! The study: every setting of a sweep tried on a problem, and the results put in a table.

use std::collections::{BTreeMap, BTreeSet};

use super::engine::Engine;
use super::fault::{LeftOutReason, StudyError};
use super::figures::TrialOutcome;
use super::problem::AccuracyProblem;
use super::reference::{Pieces, reference, reference_by};
use super::row::{RowStatus, TableRow};
use super::scenes::ClosedForm;
use super::settings::TrialSettings;
use super::sweep::{Method, Series, Sweep};
use super::table::{StudySubject, Table};
use super::truth::{OtherTruth, Truth};
use crate::scenario::ScenarioSetup;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Feedforward;

/// How many times finer than the finest setting the reference of another engine is. Its steps cost too much for more.
const OTHERS_FINER: f64 = 8.0;

/// Observes a study, and may end it.
pub trait StudyObserver {
    /// The study is about to do `what`, with `done` of `all` settings finished.
    fn progress(&mut self, done: usize, all: usize, what: &str);
    /// Whether to end the study. Called at every simulation step, so it must not block.
    fn stop(&self) -> bool;
}

/// Nobody observes, and the study goes to its end.
impl StudyObserver for () {
    fn progress(&mut self, _: usize, _: usize, _: &str) {}

    fn stop(&self) -> bool {
        false
    }
}

/// Studies the scenario called `name`, cut into `pieces`; `None` when the observer ends it.
///
/// # Errors
/// Every fault of the scene and the drive; a scenario that cannot be simulated even at the finest setting.
pub fn study(
    name: &str,
    setup: &ScenarioSetup,
    pieces: &Pieces,
    sweep: &Sweep,
    observer: &mut dyn StudyObserver,
) -> Result<Option<Table>, StudyError> {
    observer.progress(0, 1, "computing the reference");
    let Some((problem, truth)) = reference(setup, pieces, &|| observer.stop())? else { return Ok(None) };
    let mut study = Study::new(name, problem, truth, sweep, observer);
    let variants: Vec<Feedforward> = study.variants().collect();
    for feedforward in variants {
        let mut setup = setup.clone();
        if let Some(gains) = &mut setup.gains {
            gains.feedforward = feedforward;
        }
        study.observer.progress(0, 1, "computing the reference of another feedforward");
        let observer = &*study.observer;
        let variant = match reference(&setup, pieces, &|| observer.stop()) {
            Ok(None) => return Ok(None),
            Ok(Some((problem, _))) => Ok(problem),
            Err(error) => Err(LeftOutReason::NoReference(error)),
        };
        study.problems.variants.insert(feedforward, variant);
    }
    let others: BTreeSet<Engine> = study.others().collect();
    for engine in others {
        study.observer.progress(0, 1, "computing the reference of another engine");
        let observer = &*study.observer;
        let step = sweep.finest() / OTHERS_FINER;
        let own = match reference_by(engine, &study.problems.subject, step, &|| observer.stop()) {
            Ok(None) => return Ok(None),
            Ok(Some((problem, truth))) => {
                study.others.push(truth);
                Ok(problem)
            }
            Err(reason) => Err(reason),
        };
        study.problems.by_engine.insert(engine, own);
    }
    Ok(study.run())
}

impl ClosedForm {
    /// Studies this scene; `None` when the observer ends it.
    ///
    /// # Errors
    /// What this simulator cannot do that the scene asks for.
    pub fn study(
        &self,
        sweep: &Sweep,
        observer: &mut dyn StudyObserver,
    ) -> Result<Option<Table>, InputError> {
        let problem = self.problem()?;
        let truth = Truth { because: self.truth.to_owned(), accuracy: None, uncertainty: None };
        Ok(Study::new(self.name, problem, truth, sweep, observer).run())
    }
}

/// The problem of a study, and what stands for it where a method has a truth of its own.
struct Problems {
    subject: AccuracyProblem,
    /// The same driven with other feedforwards, or why there is no reference of it.
    variants: BTreeMap<Feedforward, Result<AccuracyProblem, LeftOutReason>>,
    /// The same with the ends that another engine gives it, or why there are none.
    by_engine: BTreeMap<Engine, Result<AccuracyProblem, LeftOutReason>>,
}

impl Problems {
    /// The problem that `method` is tried on.
    fn of(&self, method: &Method) -> Result<&AccuracyProblem, LeftOutReason> {
        let variant = method.feedforward.and_then(|feedforward| self.variants.get(&feedforward));
        match variant.or_else(|| self.by_engine.get(&method.engine)) {
            None => Ok(&self.subject),
            Some(other) => other.as_ref().map_err(Clone::clone),
        }
    }
}

/// A study under way.
struct Study<'a> {
    name: &'a str,
    problems: Problems,
    truth: Truth,
    others: Vec<OtherTruth>,
    sweep: &'a Sweep,
    series: Vec<Series>,
    observer: &'a mut dyn StudyObserver,
}

impl<'a> Study<'a> {
    fn new(
        name: &'a str,
        problem: AccuracyProblem,
        truth: Truth,
        sweep: &'a Sweep,
        observer: &'a mut dyn StudyObserver,
    ) -> Self {
        let series = sweep.series(&problem);
        let problems = Problems { subject: problem, variants: BTreeMap::new(), by_engine: BTreeMap::new() };
        Self { name, problems, truth, others: Vec::new(), sweep, series, observer }
    }

    /// The engines beside this one that are to be tried.
    fn others(&self) -> impl Iterator<Item = Engine> + '_ {
        let engines =
            self.series.iter().filter(|series| series.settings.is_ok()).map(|series| series.method.engine);
        engines.filter(|engine| *engine != Engine::Gaitwright)
    }

    /// The feedforwards beside the problem's own that are to be tried.
    fn variants(&self) -> impl Iterator<Item = Feedforward> + '_ {
        self.series
            .iter()
            .filter(|series| series.settings.is_ok())
            .filter_map(|series| series.method.feedforward)
    }

    fn run(mut self) -> Option<Table> {
        let all = self.series.iter().flat_map(|series| &series.settings).map(Vec::len).sum();
        let (mut rows, mut done) = (Vec::new(), 0);
        for Series { method, settings } in std::mem::take(&mut self.series) {
            match (settings, self.problems.of(&method)) {
                (Err(reason), _) | (_, Err(reason)) => {
                    rows.push(row(&method, None, TrialOutcome::LeftOut(reason)));
                }
                (Ok(settings), Ok(problem)) => {
                    let after = done + settings.len();
                    for (index, settings) in settings.into_iter().enumerate() {
                        self.observer.progress(done + index, all, &method.name);
                        let observer = &*self.observer;
                        let outcome = problem.try_out(&settings, self.sweep.repeats, &|| observer.stop())?;
                        let left_out = matches!(outcome, TrialOutcome::LeftOut(_));
                        rows.push(row(&method, Some((problem, settings)), outcome));
                        // A setting that does not apply or takes too long does so at finer steps, too.
                        if left_out {
                            break;
                        }
                    }
                    done = after;
                }
            }
        }
        Some(Table::new(self.subject(), self.truth, self.others, rows))
    }

    fn subject(&self) -> StudySubject {
        let AccuracyProblem { setup, measure, .. } = &self.problems.subject;
        StudySubject {
            name: self.name.to_owned(),
            character: setup.model.character.name.clone(),
            error: measure.what.to_owned(),
            unit: measure.unit.to_owned(),
            compared: self.problems.subject.marks(),
            seconds: self.problems.subject.seconds(),
        }
    }
}

fn row(method: &Method, tried: Option<(&AccuracyProblem, TrialSettings)>, outcome: TrialOutcome) -> TableRow {
    let (status, figures, because) = match outcome {
        TrialOutcome::Measured(figures) => (RowStatus::Measured, Some(figures), None),
        TrialOutcome::Diverged(divergence) => (RowStatus::Diverged, None, Some(divergence.to_string())),
        TrialOutcome::LeftOut(reason) => (RowStatus::LeftOut, None, Some(reason.to_string())),
    };
    TableRow {
        method: method.name.clone(),
        engine: method.engine,
        accuracy: tried.map(|(problem, settings)| problem.divided(&settings.accuracy)),
        feedforward: method.feedforward,
        status,
        because,
        figures,
        front: false,
    }
}
