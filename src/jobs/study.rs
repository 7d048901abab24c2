//! Studies of what accuracy costs, as jobs.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::files::{Artefact, sweep_folder};
use super::memory::MemoryEstimate;
use super::request::Priority;
use super::run::RunError;
use super::work::{StudyRecord, Work};
use crate::export::front_diagram;
use gaitwright_learning::accuracy::{Pieces, StudyObserver, Sweep, Table, study};
use gaitwright_learning::scenario::{NoFiles, Scenario, ScenarioSetup};
use gaitwright_physics::fault::{Fault, InputError, Parts};

/// The format of a request for a study.
const FORMAT: &str = "gaitwright/study@1";

/// Longest scenario that is studied, s.
const LONGEST: f64 = 60.0;

/// Errors for which a setting is recommended where no others are asked for, in the unit of the error.
pub const USUAL_TOLERANCES: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];

/// Most tolerances of a request.
const MOST_TOLERANCES: usize = 20;

/// A study as posted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StudyRequest {
    /// What is studied. Character and motion are inline; `accuracy` plays no part.
    pub scenario: Scenario,
    /// Errors for which a setting is to be recommended, m: powers of ten from 1e-2 to 1e-7 where left out.
    #[serde(default = "usual_tolerances")]
    pub tolerances: Vec<f64>,
    /// Which of the jobs that wait come first.
    #[serde(default)]
    pub priority: Priority,
}

fn usual_tolerances() -> Vec<f64> {
    USUAL_TOLERANCES.to_vec()
}

impl StudyRequest {
    /// Reads a request and everything in it, for a job that may come to need `budget` bytes.
    ///
    /// # Errors
    ///
    /// [`InputError::Malformed`] when `bytes` is not JSON, otherwise [`InputError::Impossible`] with
    /// every fault of the scenario, its character and its motion.
    pub fn parse(bytes: &[u8], budget: u64) -> Result<(Self, ScenarioSetup), InputError> {
        let mut parts = Parts::parse(bytes)?;
        parts.check_format(FORMAT);
        let scenario = parts.require("scenario");
        let tolerances = parts.take("tolerances").unwrap_or_else(usual_tolerances);
        let priority = parts.take("priority").unwrap_or_default();
        let request = scenario.map(|scenario| Self { scenario, tolerances, priority });
        let impossible = request.as_ref().map(Self::all_faults).unwrap_or_default();
        let request = parts.end(request, &["format", "scenario", "tolerances", "priority"], impossible)?;
        let fits = check_memory(&request.scenario, budget).map_err(|error| error.under("/scenario"));
        InputError::beside(request.faults(), fits)?;
        let setup = request.scenario.set_up(&NoFiles).map_err(|error| error.under("/scenario"))?;
        Ok((request, setup))
    }

    /// What is impossible in it, but for the character and the motion.
    fn all_faults(&self) -> Vec<Fault> {
        let of_scenario = self.scenario.faults().into_iter().map(|fault| fault.under("/scenario"));
        self.faults().into_iter().chain(of_scenario).collect()
    }

    /// What cannot be studied here.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.scenario.duration > LONGEST {
            let reason = format!("only scenarios of at most {LONGEST} s are studied here");
            faults.push(Fault::new("/scenario/duration", reason));
        }
        if self.tolerances.len() > MOST_TOLERANCES {
            faults.push(Fault::new("/tolerances", format!("at most {MOST_TOLERANCES} are answered")));
        }
        for (index, tolerance) in self.tolerances.iter().enumerate() {
            if !(tolerance.is_finite() && *tolerance > 0.0) {
                let reason = "a tolerance must be a positive finite number";
                faults.push(Fault::new(format!("/tolerances/{index}"), reason));
            }
        }
        faults
    }
}

impl From<StudyRequest> for Work {
    fn from(request: StudyRequest) -> Self {
        let StudyRequest { tolerances, .. } = request;
        Self::Accuracy(Box::new(StudyRecord { tolerances, subject: None, recommendations: Vec::new() }))
    }
}

/// Whether the character of `scenario` may be simulated with `budget` bytes.
///
/// # Errors
///
/// Every fault of the scenario and of its character; [`InputError::Impossible`] with the figures of one that is too large.
pub(super) fn check_memory(scenario: &Scenario, budget: u64) -> Result<(), InputError> {
    let reading = scenario.check(&NoFiles)?;
    MemoryEstimate::of_simulation(&reading.character, &scenario.scene, &scenario.accuracy).check(budget)
}

/// Studies the request in `bytes`, which may come to need `budget` bytes, and leaves table and diagram in `folder`;
/// `None` when the watcher ends it.
///
/// # Errors
///
/// When the scenario turns out impossible, or a file cannot be written.
pub(super) fn run(
    (bytes, budget): (&[u8], u64),
    folder: &Path,
    watcher: &mut dyn StudyObserver,
) -> Result<Option<StudyRecord>, RunError> {
    // An earlier attempt may have broken off in the middle of a file.
    sweep_folder(folder)?;
    let (request, setup) = StudyRequest::parse(bytes, budget)?;
    let name = setup.model.character.name.clone();
    let studied = study(&name, &setup, &Pieces::default(), &Sweep::default(), watcher);
    let Some(table) = studied? else { return Ok(None) };
    leave(&table, folder)?;
    let recommendations = request.tolerances.iter().map(|tolerance| table.recommend(*tolerance)).collect();
    Ok(Some(StudyRecord { tolerances: request.tolerances, subject: Some(table.subject), recommendations }))
}

/// Writes a study's table and diagram into `folder`.
fn leave(table: &Table, folder: &Path) -> Result<(), RunError> {
    let json = serde_json::to_vec_pretty(table).map_err(std::io::Error::from)?;
    Artefact::Front.publish(folder, front_diagram(table)?.as_bytes())?;
    Artefact::TableCsv.publish(folder, table.to_csv().as_bytes())?;
    Ok(Artefact::Table.publish(folder, &json)?)
}
