//! Which of the places where a search may start promise most.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::candidate::Candidate;
use super::cost::{HOLDS, when_disturbed};
use super::ring::Wanted;
use super::rollout::Arena;
use super::subject::Subject;
use crate::learn::{Interrupted, Stop};

/// What speaks against a start: its cost, but what hardly breaks a constraint, undisturbed, is not behind all that hold them, since the
/// search soon mends that.
fn promise(subject: &Subject, wanted: &Wanted, start: &Candidate) -> f64 {
    let least = start.least_cost(subject, wanted);
    let mended = if least >= HOLDS { least - HOLDS } else { least };
    mended + when_disturbed(&start.figures, &start.disturbed)
}

/// One in so many starts is tried under disturbances as well, but never fewer than so many.
const PROMISING: usize = 4;

/// Where refinements may start, the most promising first.
#[derive(Debug, Clone)]
pub struct Starts {
    ranked: Vec<Candidate>,
    /// s simulated.
    pub seconds: f64,
}

impl Starts {
    /// Tries `starts` (see [`Subject::seeds`]), of which there is at least one, over so many strides.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn new(
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        starts: &[Vec<f64>],
        strides: usize,
    ) -> Result<Self, Interrupted> {
        let mut tried: Vec<Candidate> = pool.install(|| {
            let one = |start: &Vec<f64>| {
                stop.whole(|| Candidate::undisturbed(subject, arena, wanted, start, strides))
            };
            starts.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        let mut seconds = tried.iter().map(Candidate::seconds).sum::<f64>();
        let promise = |start: &Candidate| promise(subject, wanted, start);
        tried.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        tried.truncate((starts.len() / PROMISING).max(PROMISING));
        let mut ranked: Vec<Candidate> = pool.install(|| {
            let one = |start: Candidate| stop.whole(|| start.disturbed(arena, strides));
            tried.into_par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        seconds += ranked.iter().map(Candidate::disturbed_seconds).sum::<f64>();
        ranked.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        Ok(Self { ranked, seconds })
    }

    /// The one of rank `rank`, from 0; the last if there are fewer.
    pub(super) fn at(&self, rank: usize) -> &Candidate {
        &self.ranked[rank.min(self.ranked.len() - 1)]
    }
}
