//! From a problem and a sweep to a table.

use std::collections::BTreeMap;

use super::fault::StudyError;
use super::problem::Problem;
use super::reference::{Pieces, reference};
use super::scenes::ClosedForm;
use super::sweep::{Method, Point, Series, Sweep};
use super::table::{Row, Status, Subject, Table, Truth};
use super::trial::Outcome;
use crate::scenario::Setup;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Feedforward;

/// Watches a study, and may end it.
pub trait Watcher {
    /// The study is about to do `what`, after `done` of `all` settings.
    fn progress(&mut self, done: usize, all: usize, what: &str);
    /// Whether to end it; asked at every step, so that it has to answer at once.
    fn stop(&self) -> bool;
}

/// Nobody watches, and the study goes to its end.
impl Watcher for () {
    fn progress(&mut self, _: usize, _: usize, _: &str) {}

    fn stop(&self) -> bool {
        false
    }
}

/// Studies the scenario called `name`, cut into `pieces`; `None` when the watcher ends it.
///
/// # Errors
/// Every fault of the scene and the drive; a scenario that cannot be simulated even at the finest setting.
pub fn study(
    name: &str,
    setup: &Setup,
    pieces: &Pieces,
    sweep: &Sweep,
    watcher: &mut dyn Watcher,
) -> Result<Option<Table>, StudyError> {
    watcher.progress(0, 1, "computing the reference");
    let Some((problem, truth)) = reference(setup, pieces, &|| watcher.stop())? else { return Ok(None) };
    let mut study = Study::new(name, problem, truth, sweep, watcher);
    let variants: Vec<Feedforward> = study.variants().collect();
    for feedforward in variants {
        let mut setup = setup.clone();
        if let Some(gains) = &mut setup.gains {
            gains.feedforward = feedforward;
        }
        study.watcher.progress(0, 1, "computing the reference of another feedforward");
        let watcher = &*study.watcher;
        let variant = match reference(&setup, pieces, &|| watcher.stop()) {
            Ok(None) => return Ok(None),
            Ok(Some((problem, _))) => Ok(problem),
            Err(error) => Err(error.to_string()),
        };
        study.variant.insert(feedforward, variant);
    }
    Ok(study.run())
}

impl ClosedForm {
    /// Studies this scene; `None` when the watcher ends it.
    ///
    /// # Errors
    /// What this simulator cannot do that the scene asks for.
    pub fn study(&self, sweep: &Sweep, watcher: &mut dyn Watcher) -> Result<Option<Table>, InputError> {
        let problem = self.problem()?;
        let truth = Truth { because: self.truth.to_owned(), accuracy: None, uncertainty: None };
        Ok(Study::new(self.name, problem, truth, sweep, watcher).run())
    }
}

/// A study at work.
struct Study<'a> {
    name: &'a str,
    problem: Problem,
    truth: Truth,
    sweep: &'a Sweep,
    series: Vec<Series>,
    /// The problem as other feedforwards have it, or why there is none.
    variant: BTreeMap<Feedforward, Result<Problem, String>>,
    watcher: &'a mut dyn Watcher,
}

impl<'a> Study<'a> {
    fn new(
        name: &'a str,
        problem: Problem,
        truth: Truth,
        sweep: &'a Sweep,
        watcher: &'a mut dyn Watcher,
    ) -> Self {
        let series = sweep.series(&problem);
        Self { name, problem, truth, sweep, series, variant: BTreeMap::new(), watcher }
    }

    /// The feedforwards beside the problem's own that are to be tried.
    fn variants(&self) -> impl Iterator<Item = Feedforward> + '_ {
        self.series
            .iter()
            .filter(|series| series.points.is_ok())
            .filter_map(|series| series.method.feedforward)
    }

    fn run(mut self) -> Option<Table> {
        let all = self.series.iter().flat_map(|series| &series.points).map(Vec::len).sum();
        let mut rows = Vec::new();
        for Series { method, points } in std::mem::take(&mut self.series) {
            let problem = match method.feedforward.and_then(|feedforward| self.variant.get(&feedforward)) {
                None => Ok(&self.problem),
                Some(variant) => variant.as_ref().map_err(Clone::clone),
            };
            match (points, problem) {
                (Err(because), _) | (_, Err(because)) => {
                    rows.push(row(&method, None, Outcome::LeftOut(because)));
                }
                (Ok(points), Ok(problem)) => {
                    for point in points {
                        self.watcher.progress(rows.len().min(all), all, &method.name);
                        let watcher = &*self.watcher;
                        let outcome = problem.try_out(&point, self.sweep.repeats, &|| watcher.stop())?;
                        let left_out = matches!(outcome, Outcome::LeftOut(_));
                        rows.push(row(&method, Some((problem, point)), outcome));
                        // What does not apply, or takes too long, does so all the more at finer settings.
                        if left_out {
                            break;
                        }
                    }
                }
            }
        }
        Some(Table::new(self.subject(), self.truth.clone(), rows))
    }

    fn subject(&self) -> Subject {
        let Problem { setup, measure, .. } = &self.problem;
        Subject {
            name: self.name.to_owned(),
            character: setup.model.character.name.clone(),
            error: measure.what.to_owned(),
            unit: measure.unit.to_owned(),
            compared: self.problem.marks(),
            seconds: self.problem.seconds(),
        }
    }
}

fn row(method: &Method, tried: Option<(&Problem, Point)>, outcome: Outcome) -> Row {
    let (status, figures, because) = match outcome {
        Outcome::Measured(figures) => (Status::Measured, Some(figures), None),
        Outcome::Diverged(because) => (Status::Diverged, None, Some(because)),
        Outcome::LeftOut(because) => (Status::LeftOut, None, Some(because)),
    };
    Row {
        method: method.name.clone(),
        engine: method.engine,
        accuracy: tried.map(|(problem, point)| problem.divided(&point.accuracy)),
        feedforward: method.feedforward,
        status,
        because,
        figures,
        front: false,
    }
}
