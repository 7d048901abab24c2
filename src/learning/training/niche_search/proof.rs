//! Whether what was found is natural in one piece, and what the trials leave of it.

use std::cmp::Reverse;
use std::time::Instant;

use gaitwright_physics::motion::Trial;
use gaitwright_physics::playback::Trace;
use rayon::prelude::*;

use super::stage::Stage;
use super::{LONG, NicheSearch};
use crate::learn::Interrupted;
use crate::program::cost::{HOLDS, within_limits};
use crate::program::refine::{Candidate, evaluate};
use crate::program::ring::Wanted;
use crate::program::steer;
use crate::training::motion::LearnedMotion;
use crate::training::shared::Shared;

/// A candidate and what it is to be.
#[derive(Clone)]
pub(super) struct Found {
    pub(super) wanted: Wanted,
    pub(super) candidate: Candidate,
    /// Whether it was found natural in a continuous simulation.
    pub(super) natural: bool,
    /// What was left of it in the trials, where it is natural and there was time for all of them.
    pub(super) trials: Vec<Trial>,
}

impl Found {
    /// Whether it is natural, and how few trials it failed: the more, the better.
    fn proof(&self) -> (bool, Reverse<usize>) {
        (self.natural, Reverse(self.trials.len() - kept(&self.trials)))
    }

    /// Whether it is natural and kept every trial.
    pub(super) fn is_proven(&self) -> bool {
        self.proof() == (true, Reverse(0))
    }

    /// Whether it is worth more than `other`, which was found in the same way.
    pub(super) fn beats(&self, other: &Self) -> bool {
        let (own, others) = (self.proof(), other.proof());
        own > others || (own == others && self.candidate.cost < other.candidate.cost)
    }
}

/// In how many trials a motion stayed up and went on.
fn kept(trials: &[Trial]) -> usize {
    trials.iter().filter(|trial| trial.kept()).count()
}

impl NicheSearch<'_> {
    /// Shows the best of `stage` if it is natural and none has been so far: whoever waits has something to look at while it gets better.
    pub(super) fn show_first_natural(&mut self, stage: &Stage) {
        let Stage { wanted, refinement } = stage;
        let best = refinement.best();
        if self.shown_natural || !within_limits(wanted, &self.shared.subject.legs, &best.figures) {
            return;
        }
        if self.natural(wanted, std::slice::from_ref(best)).iter().any(Option::is_some) {
            let motion = self.motion(wanted, best);
            self.progress.show(motion, false, self.observer);
            self.shown_natural = true;
        }
    }

    /// The first of `candidates` that is natural and keeps every trial; where none keeps all, the natural one that keeps most.
    /// With its trials, or with none where there was no time for all of them.
    fn proven(&mut self, wanted: &Wanted, candidates: &[Candidate]) -> Option<(usize, Vec<Trial>)> {
        let Shared { setup, stop, .. } = self.shared;
        let mut best: Option<(usize, Vec<Trial>)> = None;
        for (index, (candidate, trace)) in candidates.iter().zip(self.natural(wanted, candidates)).enumerate()
        {
            let Some(trace) = &trace else { continue };
            let motion = self.motion(wanted, candidate);
            let player = motion.player(&setup.stance.angles);
            let stopped = || stop.check().is_err();
            let begun = Instant::now();
            let tried = motion.check(setup, &player).trials(trace, setup.threads, &stopped);
            let mut trials = tried.unwrap_or_default();
            self.progress.simulated += trials.iter().map(|trial| trial.upright_seconds).sum::<f64>();
            if stopped() {
                trials.clear();
            }
            let all = kept(&trials) == trials.len();
            if best.as_ref().is_none_or(|(_, others)| kept(&trials) > kept(others)) {
                best = Some((index, trials));
            }
            let short = stop.left().is_some_and(|left| left < begun.elapsed().as_secs_f64());
            self.progress.by_the_clock |= short && !all;
            if all || short {
                break;
            }
        }
        best
    }

    /// What those of `candidates` that are natural did when that was checked.
    pub(super) fn natural(&mut self, wanted: &Wanted, candidates: &[Candidate]) -> Vec<Option<Trace>> {
        let shared = self.shared;
        let motions: Vec<_> = candidates.iter().map(|candidate| self.motion(wanted, candidate)).collect();
        let judged = || motions.par_iter().with_max_len(1).map(|motion| natural(shared, motion)).collect();
        let checked: Vec<(f64, Option<Trace>)> = shared.pool.install(judged);
        self.progress.simulated += checked.iter().map(|(seconds, _)| seconds).sum::<f64>();
        checked.into_iter().map(|(_, trace)| trace).collect()
    }

    /// The one of `candidates`, in the order of their cost, that is [proven](Self::proven), or else the first; `None` of none.
    pub(super) fn first_proven(&mut self, wanted: &Wanted, candidates: Vec<Candidate>) -> Option<Found> {
        let proven = self.proven(wanted, &candidates);
        let natural = proven.is_some();
        let (index, trials) = proven.unwrap_or_default();
        let candidate = candidates.into_iter().nth(index)?;
        Some(Found { wanted: wanted.clone(), candidate, natural, trials })
    }

    /// The same gait with feedback that keeps its heading, where that makes it natural, keeps more trials, or lets it hold
    /// constraints that it does not hold without.
    pub(super) fn steered_by_heading(&mut self, found: &Found) -> Result<Option<Found>, Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        let fine = &self.fine;
        if self.steered || !subject.can_steer() || self.generations() == 0 {
            return Ok(None);
        }
        let wanted = &found.wanted;
        let mut tried: Vec<Candidate> = pool.install(|| {
            let one =
                |parameters: Vec<f64>| stop.whole(|| evaluate(subject, fine, wanted, &parameters, LONG));
            let strengths = steer::by_heading(&found.candidate.parameters).into_par_iter();
            strengths.with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        self.progress.simulated += tried.iter().map(Candidate::seconds).sum::<f64>();
        tried.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let steered = self.first_proven(wanted, tried);
        stop.check()?;
        let holds = |found: &Found| found.candidate.cost < HOLDS;
        let helps = |steered: &Found| steered.proof() > found.proof() || (holds(steered) && !holds(found));
        Ok(steered.filter(helps))
    }
}

/// How many seconds of a motion were simulated in one piece to judge it, and that simulation if the motion is natural there, goes by the
/// gait that was looked for, and nothing broke it off.
fn natural(shared: &Shared<'_>, motion: &LearnedMotion) -> (f64, Option<Trace>) {
    let player = motion.player(&shared.setup.stance.angles);
    let check = motion.check(shared.setup, &player);
    let stopped = || shared.stop.check().is_err();
    let Ok(checked) = check.run(&stopped) else { return (0.0, None) };
    let named = checked.gait.gait.as_deref();
    let as_wanted = named.is_none() || named == motion.gait.as_deref();
    let seconds = checked.trace.samples.last().map_or(0.0, |sample| sample.time);
    (seconds, (checked.gait.natural && as_wanted && !stopped()).then_some(checked.trace))
}
