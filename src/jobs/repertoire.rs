//! The repertoire of a job: every motion that was learned, in figures, and which of them is the job's motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_physics::motion::Metrics;

/// Kind and version of the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum RepertoireFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/motions@1")]
    V1,
}

/// Every motion that a job has learned.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Repertoire {
    /// Kind and version of the document.
    pub format: RepertoireFormat,
    /// Number of the one that is the job's motion: of those that stay upright to the end (or longest) the natural one of least cost of
    /// transport, or where none is natural that of all, valid ones first; `null` where there is none.
    pub motion: Option<u32>,
    /// In the order in which they were learned.
    pub motions: Vec<RepertoireEntry>,
}

/// One motion of a repertoire, in figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepertoireEntry {
    /// Its number, from 1.
    pub number: u32,
    /// What was searched for: `walk`, `running trot`, `fastest running trot`.
    pub name: String,
    /// Name of its file in the folders `motions` and `gaits`.
    pub file: String,
    /// The gait that was asked for; `null` where none was.
    pub asked_gait: Option<String>,
    /// The speed that was asked for, m/s; `null` where none was.
    pub asked_speed: Option<f64>,
    /// What was measured.
    pub metrics: Metrics,
}

/// A motion of a repertoire in one line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionSummary {
    /// Its number, from 1.
    pub number: u32,
    /// What was searched for.
    pub name: String,
    /// Name of its gait as measured.
    pub gait: Option<String>,
    /// m/s.
    pub speed: f64,
    /// ∫ Σ |τ q̇| dt / (m g d).
    pub cost_of_transport: Option<f64>,
    /// Whether it is natural.
    pub natural: bool,
}

impl From<&RepertoireEntry> for MotionSummary {
    fn from(entry: &RepertoireEntry) -> Self {
        let RepertoireEntry { number, name, metrics, .. } = entry;
        Self {
            number: *number,
            name: name.clone(),
            gait: metrics.gait.clone(),
            speed: metrics.speed,
            cost_of_transport: metrics.cost_of_transport,
            natural: metrics.natural,
        }
    }
}

impl Repertoire {
    /// Adds a motion. It becomes the job's motion if it is better than that: upright for longer, then natural, then valid, then for a
    /// lower cost of transport. Returns its number, and whether it did.
    pub(super) fn add(
        &mut self,
        name: &str,
        (asked_gait, asked_speed): (Option<String>, Option<f64>),
        metrics: Metrics,
    ) -> (u32, bool) {
        let number = self.motions.len() as u32 + 1;
        let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
        let file = format!("{number}-{}.json", words.join("-"));
        let better = self.chosen().is_none_or(|best| rank(&metrics) < rank(&best.metrics));
        self.motions.push(RepertoireEntry {
            number,
            name: name.to_owned(),
            file,
            asked_gait,
            asked_speed,
            metrics,
        });
        if better {
            self.motion = Some(number);
        }
        (number, better)
    }

    /// The motion with this number.
    pub fn entry(&self, number: u32) -> Option<&RepertoireEntry> {
        self.motions.iter().find(|entry| entry.number == number)
    }

    /// The job's motion.
    pub fn chosen(&self) -> Option<&RepertoireEntry> {
        self.entry(self.motion?)
    }
}

/// The less the better.
fn rank(metrics: &Metrics) -> Rank {
    let stands = metrics.naturalness.get("upright").is_some_and(|measure| measure.holds);
    Rank {
        // How long a check lasts depends on the motion, so that of those that stand none has stood for longer.
        fallen: if stands { f64::NEG_INFINITY } else { -metrics.upright_seconds },
        unnatural: !metrics.natural,
        invalid: !metrics.validity.valid,
        cost: metrics.cost_of_transport.unwrap_or(f64::INFINITY),
    }
}

/// In the order of weight.
#[derive(PartialEq, PartialOrd)]
struct Rank {
    /// -∞, or less how long it stood until it fell, s.
    fallen: f64,
    unnatural: bool,
    invalid: bool,
    cost: f64,
}
