//! The study: every setting of a sweep tried on a problem, and the results put in a table.

use std::collections::BTreeMap;

use super::fault::{LeftOutReason, StudyError};
use super::figures::TrialOutcome;
use super::problem::AccuracyProblem;
use super::reference::{Pieces, reference};
use super::row::{RowStatus, TableRow};
use super::scenes::ClosedForm;
use super::settings::TrialSettings;
use super::sweep::{Method, Series, Sweep};
use super::table::{StudySubject, Table};
use super::truth::Truth;
use crate::scenario::ScenarioSetup;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Feedforward;

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
        study.variant.insert(feedforward, variant);
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

/// A study under way.
struct Study<'a> {
    name: &'a str,
    problem: AccuracyProblem,
    truth: Truth,
    sweep: &'a Sweep,
    series: Vec<Series>,
    /// The same problem driven with other feedforwards, each with a truth of its own, or why there is none.
    variant: BTreeMap<Feedforward, Result<AccuracyProblem, LeftOutReason>>,
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
        Self { name, problem, truth, sweep, series, variant: BTreeMap::new(), observer }
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
        let mut rows = Vec::new();
        for Series { method, settings } in std::mem::take(&mut self.series) {
            let problem = match method.feedforward.and_then(|feedforward| self.variant.get(&feedforward)) {
                None => Ok(&self.problem),
                Some(variant) => variant.as_ref().map_err(Clone::clone),
            };
            match (settings, problem) {
                (Err(reason), _) | (_, Err(reason)) => {
                    rows.push(row(&method, None, TrialOutcome::LeftOut(reason)));
                }
                (Ok(settings), Ok(problem)) => {
                    for settings in settings {
                        self.observer.progress(rows.len().min(all), all, &method.name);
                        let observer = &*self.observer;
                        let outcome = problem.try_out(&settings, self.sweep.repeats, &|| observer.stop())?;
                        let left_out = matches!(outcome, TrialOutcome::LeftOut(_));
                        rows.push(row(&method, Some((problem, settings)), outcome));
                        // A setting that does not apply or takes too long does so at finer steps, too.
                        if left_out {
                            break;
                        }
                    }
                }
            }
        }
        Some(Table::new(self.subject(), self.truth.clone(), rows))
    }

    fn subject(&self) -> StudySubject {
        let AccuracyProblem { setup, measure, .. } = &self.problem;
        StudySubject {
            name: self.name.to_owned(),
            character: setup.model.character.name.clone(),
            error: measure.what.to_owned(),
            unit: measure.unit.to_owned(),
            compared: self.problem.marks(),
            seconds: self.problem.seconds(),
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
