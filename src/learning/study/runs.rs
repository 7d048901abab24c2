//! All runs of a study.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

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
/// Parameters or a scene that make no sense, and threads of a search that could not be started.
pub fn run(study: &LearningStudy, progress: StudyProgress<'_>) -> Result<LearningTable, LearnError> {
    let asked =
        |variant: &&Variant| study.questions.iter().any(|question| question.variants.contains(&variant.name));
    let variants: Vec<&Variant> = study.variants.iter().filter(asked).collect();
    let pairs: Vec<(&Variant, u64)> =
        (1..=study.seeds).flat_map(|seed| variants.iter().map(move |variant| (*variant, seed))).collect();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let results: Vec<Mutex<Option<Result<JudgedRun, LearnError>>>> =
        pairs.iter().map(|_| Mutex::new(None)).collect();
    // Threads of their own: a worker of rayon that waits for the threads of a search would begin another run meanwhile.
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(((variant, seed), result)) = pairs.get(index).zip(results.get(index)) else { break };
            progress(done.load(Ordering::Relaxed), pairs.len(), variant.name);
            let run = judged_run(&study.arena, variant, *seed, study.seconds);
            *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(run);
            done.fetch_add(1, Ordering::Relaxed);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..study.threads.clamp(1, pairs.len().max(1)) {
            scope.spawn(work);
        }
        work();
    });
    let results =
        results.into_iter().filter_map(|run| run.into_inner().unwrap_or_else(PoisonError::into_inner));
    let runs = results.collect::<Result<Vec<JudgedRun>, LearnError>>()?;
    let of = |name: &str| -> Vec<JudgedRun> {
        let runs = pairs.iter().zip(&runs).filter(|((variant, _), _)| variant.name == name);
        runs.map(|(_, run)| run.clone()).collect()
    };
    let rows = study.questions.iter().flat_map(|question| {
        question.variants.iter().map(|name| VariantRow::new(question.name, name, of(name)))
    });
    Ok(LearningTable::new(&study.arena, &study.questions, (study.seeds, study.seconds), rows.collect()))
}
