//! What jobs add to the figures of the service: their names, and where they come from.

use jiff::Timestamp;

use super::job::{Job, JobState};
use super::work::Work;
use gaitwright_learning::learn::Generation;
use gaitwright_physics::scene::AskedAccuracy;

const POSTED: &str = "gaitwright_jobs_posted_total";
const ENDED: &str = "gaitwright_jobs_ended_total";
const FAILED: &str = "gaitwright_jobs_failed_total";
const GENERATIONS: &str = "gaitwright_generations_total";
const STEPS: &str = "gaitwright_steps_total";
const CACHE_HITS: &str = "gaitwright_cache_hits_total";
const QUEUE_WAIT: &str = "gaitwright_queue_wait_seconds";
const GENERATION: &str = "gaitwright_generation_seconds";

/// A distribution of times.
#[derive(Debug, Clone, Copy)]
pub struct Histogram {
    /// Its name.
    pub name: &'static str,
    /// What is timed.
    pub about: &'static str,
    /// Upper ends of its buckets, s.
    pub buckets: &'static [f64],
}

/// The distributions that jobs add to.
pub const HISTOGRAMS: [Histogram; 2] = [
    Histogram {
        name: QUEUE_WAIT,
        about: "Time from the posting of a job to the worker that took it up first",
        buckets: &[0.01, 0.1, 1.0, 10.0, 60.0, 300.0, 900.0, 3600.0, 14_400.0, 86_400.0],
    },
    Histogram {
        name: GENERATION,
        about: "Time that a generation of a job took",
        buckets: &[0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 120.0],
    },
];

/// The counters that jobs add to, and what they count since the start.
pub const COUNTERS: [(&str, &str); 6] = [
    (POSTED, "Jobs queued since the start"),
    (ENDED, "Jobs ended since the start, by their last state"),
    (FAILED, "Jobs failed since the start, by cause"),
    (GENERATIONS, "Generations evaluated since the start"),
    (STEPS, "Steps simulated in learning since the start; one that was divided counts once"),
    (CACHE_HITS, "Transitions since the start that came from the cache and were not simulated"),
];

/// A job has been queued.
pub(super) fn posted() {
    metrics::counter!(POSTED).increment(1);
}

/// A worker has taken up a job that no worker had before.
pub(super) fn taken_up_first(job: &Job) {
    let waited = Timestamp::now().duration_since(job.timings.created).as_secs_f64();
    metrics::histogram!(QUEUE_WAIT).record(waited.max(0.0));
}

/// Why a job has failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FailureCause {
    /// It came to its end, and no motion was learned that is worth having.
    NoMotion,
    /// The character, or what was wanted of it, turned out impossible, or could not be worked at.
    Run,
    /// A file or the store.
    Storage,
    /// A fault of the program.
    Panic,
    /// Its workers, or the service, ended while they worked at it.
    Interrupted,
}

impl FailureCause {
    /// The word in the figures.
    fn name(self) -> &'static str {
        match self {
            Self::NoMotion => "no_motion",
            Self::Run => "run",
            Self::Storage => "storage",
            Self::Panic => "panic",
            Self::Interrupted => "interrupted",
        }
    }
}

/// A job has ended; if it has failed, for `cause`.
pub(super) fn ended(job: &Job, cause: FailureCause) {
    metrics::counter!(ENDED, "state" => job.state.name()).increment(1);
    if job.state == JobState::Failed {
        metrics::counter!(FAILED, "cause" => cause.name()).increment(1);
    }
}

/// Counts what the generations of one job took, each from the one before it.
#[derive(Debug, Default)]
pub(super) struct GenerationMeter {
    last: Option<Generation>,
}

impl GenerationMeter {
    /// Goes on after a generation of an earlier run.
    pub(super) fn after(last: Option<Generation>) -> Self {
        Self { last }
    }

    /// A generation of `job` has been evaluated.
    pub(super) fn count(&mut self, job: &Job, figures: &Generation) {
        // Times that begin again with another search of the same job are counted from nothing.
        let since = |of: fn(&Generation) -> f64| {
            let (now, before) = (of(figures), self.last.as_ref().map_or(0.0, of));
            if now >= before { now - before } else { now }
        };
        metrics::counter!(GENERATIONS).increment(1);
        metrics::histogram!(GENERATION).record(since(|figures| figures.elapsed));
        if let Work::Learning(learned) = &job.work {
            if let AskedAccuracy::Settings(accuracy) = learned.settings.accuracy {
                let steps = since(|figures| figures.simulated_seconds) / accuracy.step;
                metrics::counter!(STEPS).increment(steps.round() as u64);
            }
            if let Some(transition) = learned.settings.learning.transition_time {
                let hits = since(|figures| figures.saved_seconds) / transition;
                metrics::counter!(CACHE_HITS).increment(hits.round() as u64);
            }
        }
        self.last = Some(figures.clone());
    }
}
