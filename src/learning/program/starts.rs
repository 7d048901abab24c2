//! Which of the places where a search may start promise most.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::candidate::Candidate;
use super::cost::{HOLDS, when_disturbed};
use super::ring::Wanted;
use super::rollout::Arena;
use super::seeds::Seed;
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

/// A seed that was tried.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) candidate: Candidate,
    /// See [`Seed::reach`].
    pub(super) reach: f64,
}

/// Where refinements may start, the most promising first.
#[derive(Debug, Clone)]
pub struct Starts {
    ranked: Vec<Start>,
    /// s simulated.
    pub seconds: f64,
}

impl Starts {
    /// Tries `seeds` (see [`Subject::seeds`]), of which there is at least one, over so many strides.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn new(
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        seeds: &[Seed],
        strides: usize,
    ) -> Result<Self, Interrupted> {
        let mut tried: Vec<Start> = pool.install(|| {
            let one = |&Seed { ref parameters, reach }: &Seed| {
                let tried = || Candidate::undisturbed(subject, arena, wanted, parameters, strides);
                Ok(Start { candidate: stop.whole(tried)?, reach })
            };
            seeds.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        let mut seconds = tried.iter().map(|start| start.candidate.seconds()).sum::<f64>();
        let promise = |start: &Start| promise(subject, wanted, &start.candidate);
        tried.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        tried.truncate((seeds.len() / PROMISING).max(PROMISING));
        let mut ranked: Vec<Start> = pool.install(|| {
            let one = |Start { candidate, reach }| {
                Ok(Start {
                    candidate: stop.whole(|| Candidate::disturbed(candidate, arena, strides))?,
                    reach,
                })
            };
            tried.into_par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        seconds += ranked.iter().map(|start| start.candidate.disturbed_seconds()).sum::<f64>();
        ranked.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        Ok(Self { ranked, seconds })
    }

    /// The one of rank `rank`, from 0; the last if there are fewer.
    pub(super) fn at(&self, rank: usize) -> &Start {
        &self.ranked[rank.min(self.ranked.len() - 1)]
    }
}
