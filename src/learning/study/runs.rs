//! All runs of a study.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use super::arena::StudyArena;
use super::judged::{JudgedRun, judged_run};
use super::table::{LearningTable, VariantRow};
use super::variants::{Question, Variant};
use crate::learn::LearnError;

/// What a study consists of.
#[derive(Debug, Clone)]
pub struct LearningStudy {
    /// Who moves, and how fast.
    pub arena: StudyArena,
    /// What is asked.
    pub questions: Vec<Question>,
    /// The ways to search; of them, those that answer a question are run.
    pub variants: Vec<Variant>,
    /// Number of runs of each; seeds count from 1.
    pub seeds: u64,
    /// Simulated time of a run, s; the generation in which it is used up is a run's last.
    pub seconds: f64,
    /// Runs that take place beside each other; what they find does not depend on it.
    pub threads: usize,
}

/// Is told that so many of all runs are done, and which one is next; called from several threads.
pub type StudyProgress<'a> = &'a (dyn Fn(usize, usize, &str) + Sync);

/// Runs every variant with every seed.
///
/// # Errors
/// Parameters or a scene that make no sense, and threads that could not be started.
pub fn run(study: &LearningStudy, progress: StudyProgress<'_>) -> Result<LearningTable, LearnError> {
    let asked = |variant: &&Variant| {
        study.questions.iter().any(|question| question.variants.contains(&variant.name))
    };
    let variants: Vec<&Variant> = study.variants.iter().filter(asked).collect();
    let pairs: Vec<(&Variant, u64)> =
        (1..=study.seeds).flat_map(|seed| variants.iter().map(move |variant| (*variant, seed))).collect();
    let done = AtomicUsize::new(0);
    let pool = ThreadPoolBuilder::new().num_threads(study.threads.max(1)).build()?;
    let runs: Vec<JudgedRun> = pool.install(|| {
        let runs = pairs.par_iter().with_max_len(1).map(|(variant, seed)| {
            progress(done.load(Ordering::Relaxed), pairs.len(), variant.name);
            let run = judged_run(&study.arena, variant, *seed, study.seconds)?;
            done.fetch_add(1, Ordering::Relaxed);
            Ok(run)
        });
        runs.collect::<Result<_, LearnError>>()
    })?;
    let of = |name: &str| -> Vec<JudgedRun> {
        let runs = pairs.iter().zip(&runs).filter(|((variant, _), _)| variant.name == name);
        runs.map(|(_, run)| run.clone()).collect()
    };
    let rows = study.questions.iter().flat_map(|question| {
        question.variants.iter().map(|name| VariantRow::new(question.name, name, of(name)))
    });
    Ok(LearningTable::new(&study.arena, &study.questions, (study.seeds, study.seconds), rows.collect()))
}
