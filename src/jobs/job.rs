//! A job's record: what was asked for, how far it is, what came of it.

use jiff::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::repertoire::Repertoire;
use super::request::{FORMAT, Priority};
use super::retention::Expiry;
use super::work::{MotionOutcome, Work};
use gaitwright_learning::learn::Generation;

/// How often a job is taken up without getting further before it fails: once, and three times again.
pub const MOST_ATTEMPTS: u32 = 4;

/// Where a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "State")]
pub enum JobState {
    /// Waits for a worker.
    Queued,
    /// Is being worked at.
    Running,
    /// Ended with what it was for.
    Succeeded,
    /// Ended without it.
    Failed,
    /// Ended because it was asked to.
    Cancelled,
}

impl JobState {
    /// Every state, in the order of a job's life.
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// The word used in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// Whether nothing more happens to the job by itself.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
    }
}

/// What a running job is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Finds how the character stands.
    Standing,
    /// Learns.
    Learning,
    /// Tries settings of the simulation.
    Studying,
    /// Plays what was learned for a long stretch and writes the results.
    Checking,
}

/// A job, as stored and as shown. Its learning curve is kept apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Job {
    /// `gaitwright/job@1`.
    pub format: String,
    /// Ordered by time of creation (UUID version 7).
    #[schemars(with = "String")]
    pub id: Uuid,
    /// Where it stands.
    pub state: JobState,
    /// What a running job is doing.
    pub stage: Option<Stage>,
    /// Name and digest of the character.
    pub character: CharacterName,
    /// Who posted it, as far as the service tells its clients apart.
    #[serde(default)]
    pub caller: String,
    /// Which of the jobs that wait come first.
    #[serde(default)]
    pub priority: Priority,
    /// How often it was taken up since it was posted, tried again or last got to a checkpoint, without having been put
    /// back in order.
    #[serde(default)]
    pub attempts: u32,
    /// What it is for, and what came of it.
    #[serde(flatten)]
    pub work: Work,
    /// How far it is.
    pub progress: Progress,
    /// When things happened and what they took.
    pub timings: Timings,
    /// Why the job failed.
    pub error: Option<String>,
    /// What it takes up, and until when.
    #[serde(default)]
    pub storage: JobStorage,
}

/// What a job that has ended takes up, and until when it is kept.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct JobStorage {
    /// Size of all its files, bytes.
    pub bytes: u64,
    /// Size of its recording, bytes.
    pub recording_bytes: u64,
    /// When the job goes with all its files; `null` while it is kept without a limit.
    pub expires: Option<Expiry>,
    /// When its recording goes; `null` while that is kept as long as the job.
    pub recording_expires: Option<Expiry>,
    /// When its recording went.
    #[schemars(with = "Option<String>")]
    pub recording_removed: Option<Timestamp>,
}

/// Which character a job is about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct CharacterName {
    /// Its name, as its author wrote it.
    pub name: String,
    /// `sha256:…` of the bytes it was read from.
    pub digest: String,
}

/// How far a job is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Progress {
    /// Share of the learning's budget, or of the study's settings, used so far, 0 to 1.
    pub fraction: f64,
    /// Candidates tried since the job was posted, from the first moments of learning on. Those that are tried once more
    /// after an interruption count once more.
    #[serde(default)]
    pub evaluations: u64,
    /// Generations evaluated.
    pub generations: u32,
    /// Simulated seconds.
    pub simulated_seconds: f64,
    /// Simulated seconds saved by the cache.
    pub saved_seconds: f64,
}

/// When things happened, and what they took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Timings {
    /// When it was posted.
    #[schemars(with = "String")]
    pub created: Timestamp,
    /// When a worker took it up, the last time.
    #[schemars(with = "Option<String>")]
    pub started: Option<Timestamp>,
    /// When it ended.
    #[schemars(with = "Option<String>")]
    pub ended: Option<Timestamp>,
    /// s of the wall clock spent finding the standing pose since it was last taken up.
    pub standing_seconds: Option<f64>,
    /// s of the wall clock spent learning since then, without what is checked between two generations.
    pub learning_seconds: Option<f64>,
    /// s of the wall clock spent checking and recording motions since then, and writing the results.
    pub checking_seconds: Option<f64>,
}

impl Job {
    /// A job that waits for a worker.
    pub fn queued(
        character: CharacterName,
        work: impl Into<Work>,
        (caller, priority): (String, Priority),
    ) -> Self {
        Self {
            format: FORMAT.to_owned(),
            id: Uuid::now_v7(),
            state: JobState::Queued,
            stage: None,
            character,
            caller,
            priority,
            attempts: 0,
            work: work.into(),
            progress: Progress::default(),
            timings: Timings {
                created: Timestamp::now(),
                started: None,
                ended: None,
                standing_seconds: None,
                learning_seconds: None,
                checking_seconds: None,
            },
            error: None,
            storage: JobStorage::default(),
        }
    }

    /// Takes in the figures of a generation.
    pub fn advance(&mut self, figures: &Generation) {
        let Work::Learning(learned) = &mut self.work else { return };
        self.progress = Progress {
            fraction: learned.settings.learning.budget().fraction(figures.generation + 1, figures.elapsed),
            evaluations: self.progress.evaluations,
            generations: figures.generation + 1,
            simulated_seconds: figures.simulated_seconds,
            saved_seconds: figures.saved_seconds,
        };
        learned.best_fitness = Some(learned.best_fitness.map_or(figures.best, |best| best.max(figures.best)));
        learned.cache_hit_rate = Some(figures.cache_hit_rate);
    }

    /// Has a worker begin.
    pub fn take_up(&mut self) {
        self.state = JobState::Running;
        self.attempts += 1;
        self.timings = Timings {
            started: Some(Timestamp::now()),
            standing_seconds: None,
            learning_seconds: None,
            checking_seconds: None,
            ..self.timings
        };
    }

    /// Takes note that it need not be begun from the same place again; whether that was not known before.
    pub fn get_further(&mut self) -> bool {
        std::mem::replace(&mut self.attempts, 1) != 1
    }

    /// Has it wait for a worker again, through no fault of its own.
    pub fn put_back(&mut self) {
        self.attempts = self.attempts.saturating_sub(1);
        self.wait();
    }

    /// Has it wait again after an attempt that ended for `cause`, or fail if that has happened too often.
    pub fn lose(&mut self, cause: &str) {
        if self.attempts < MOST_ATTEMPTS {
            self.wait();
        } else {
            self.fail(format!("{cause}, {} times in a row without getting further", self.attempts));
        }
    }

    fn wait(&mut self) {
        self.state = JobState::Queued;
        self.stage = None;
    }

    /// Whether what an earlier run has left is still the job's.
    pub fn has_earlier_results(&self) -> bool {
        matches!(&self.work, Work::Learning(learned) if learned.earlier.is_some())
    }

    /// Whether it has learned a motion.
    pub fn has_motions(&self) -> bool {
        matches!(&self.work, Work::Learning(learned) if !learned.motions.is_empty())
    }

    /// Whether it has ended with motions and without the figures of the one that is the job's.
    pub fn lacks_figures(&self) -> bool {
        let Work::Learning(learned) = &self.work else { return false };
        self.state.is_final() && learned.metrics.is_none() && !learned.motions.is_empty()
    }

    /// Takes these figures from the repertoire that an earlier run has left.
    pub fn recall(&mut self, repertoire: &Repertoire) {
        let Work::Learning(learned) = &mut self.work else { return };
        learned.metrics = repertoire.chosen().map(|entry| entry.metrics.clone());
        learned.outcome = Some(MotionOutcome::of(learned.metrics.as_ref()));
    }

    /// Has the results of the present run be the job's from now on, which goes on after the generations of `curve`.
    pub fn begin_anew(&mut self, curve: &[Generation]) {
        self.storage = JobStorage::default();
        if let Work::Learning(learned) = &mut self.work {
            learned.earlier = None;
            (learned.best_fitness, learned.cache_hit_rate) = (None, None);
            self.progress = Progress { evaluations: self.progress.evaluations, ..Progress::default() };
            curve.iter().for_each(|figures| self.advance(figures));
        }
    }

    /// Puts a job that has ended back into the queue.
    pub fn reopen(&mut self) {
        self.wait();
        self.attempts = 0;
        self.error = None;
        self.storage =
            JobStorage { recording_removed: self.storage.recording_removed, ..JobStorage::default() };
        self.timings.ended = None;
        if let Work::Learning(learned) = &mut self.work {
            learned.set_aside();
        }
    }

    /// Ends the job because somebody asked for it.
    pub fn call_off(&mut self) {
        self.error = None;
        self.end(JobState::Cancelled);
    }

    /// Ends the job without what it was for.
    pub fn fail(&mut self, reason: String) {
        self.error = Some(reason);
        self.end(JobState::Failed);
    }

    /// Ends the job. One that has not begun to learn since it was taken up or tried again has what came of it before.
    pub fn end(&mut self, state: JobState) {
        if let Work::Learning(learned) = &mut self.work {
            learned.take_back();
        }
        self.state = state;
        self.stage = None;
        self.timings.ended = Some(Timestamp::now());
        if state == JobState::Succeeded {
            self.progress.fraction = 1.0;
        }
    }
}
