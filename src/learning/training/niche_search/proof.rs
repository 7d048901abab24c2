//! What the trials leave of what was found, and whether feedback of the heading helps.

use gaitwright_physics::motion::Trial;
use rayon::prelude::*;

use super::found::{Found, Proof};
use super::judged::Judged;
use super::search::{LONG, NicheSearch};
use crate::check::CheckedMotion;
use crate::learn::Interrupted;
use crate::program::candidate::Candidate;
use crate::program::cost::HOLDS;
use crate::program::ring::Wanted;
use crate::program::steer;
use crate::program::straightening::Straightening;
use crate::training::shared::Shared;

impl NicheSearch<'_> {
    /// The first of the natural among the `judged` that keeps every trial; where none keeps all, the one that keeps most. With its trials,
    /// where there was time for all of them.
    fn proven(
        &mut self,
        judged: &[(Candidate, Option<Judged>)],
        wanted: &Wanted,
    ) -> Option<(usize, Option<Vec<Trial>>)> {
        let Shared { stop, .. } = self.shared;
        let mut best: Option<(Proof, usize, Option<Vec<Trial>>)> = None;
        for (index, (candidate, judged)) in judged.iter().enumerate() {
            let Some(Judged { checked, natural: true }) = judged else { continue };
            let begun = stop.clock().now();
            let trials = self.tried(wanted, candidate, checked);
            let proof = Proof::of(trials.as_deref());
            if best.as_ref().is_none_or(|(others, ..)| proof > *others) {
                best = Some((proof, index, trials));
            }
            let short = stop.left().is_some_and(|left| left < stop.clock().since(begun));
            self.progress.by_the_clock |= short && proof != Proof::ALL_TRIALS_KEPT;
            if proof == Proof::ALL_TRIALS_KEPT || short {
                break;
            }
        }
        best.map(|(_, index, trials)| (index, trials))
    }

    /// What the trials leave of a motion of which `checked` was seen; `None` where there was no time for all of them.
    fn tried(
        &mut self,
        wanted: &Wanted,
        candidate: &Candidate,
        checked: &CheckedMotion,
    ) -> Option<Vec<Trial>> {
        let Shared { setup, stop, .. } = self.shared;
        let motion = self.motion(wanted, candidate);
        let player = motion.player(&setup.stance.angles);
        let stopped = || stop.check().is_err();
        let trials = motion.check(setup, &player).trials(checked, setup.threads, &stopped).ok();
        self.progress.simulated += trials.iter().flatten().map(|trial| trial.upright_seconds).sum::<f64>();
        trials.filter(|_| !stopped())
    }

    /// The one of `candidates`, in the order of their cost, that is [proven](Self::proven), or else the first; `None` of none.
    pub(super) fn first_proven(&mut self, wanted: &Wanted, candidates: Vec<Candidate>) -> Option<Found> {
        let judged = self.judged(wanted, &candidates);
        let judged: Vec<(Candidate, Option<Judged>)> = candidates.into_iter().zip(judged).collect();
        let proven = self.proven(&judged, wanted);
        let natural = proven.is_some();
        let (index, trials) = proven.unwrap_or_default();
        let (candidate, judged) = judged.into_iter().nth(index)?;
        let stood = judged.map(|judged| judged.stood());
        Some(Found { wanted: wanted.clone(), candidate, natural, stood, trials })
    }

    /// Whether what was found falls when it is judged or in a trial. What is not natural was not tried before.
    pub(super) fn falls(&mut self, found: &Found) -> bool {
        if found.natural || found.stood == Some(false) {
            return found.falls();
        }
        let judged = self.judged(&found.wanted, std::slice::from_ref(&found.candidate)).pop().flatten();
        let Some(judged) = judged else { return false };
        let trials = self.tried(&found.wanted, &found.candidate, &judged.checked);
        Found { stood: Some(judged.stood()), trials, ..found.clone() }.falls()
    }

    /// The same gait with feedback that keeps its heading, set straight again, where that makes it natural, keeps more trials, or
    /// lets it hold constraints that it does not hold without.
    pub(super) fn steered_by_heading(&mut self, found: &Found) -> Result<Option<Found>, Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        if self.feedback.is_given() || !subject.can_steer() || self.generations() == 0 {
            return Ok(None);
        }
        let straightening =
            Straightening { subject, arena: &self.fine, wanted: &found.wanted, strides: LONG, stop };
        let tried: Vec<(Candidate, f64)> = pool.install(|| {
            let one = |parameters: Vec<f64>| {
                let start = straightening.disturbed(&parameters)?;
                let seconds = start.seconds();
                let straightened = straightening.straightened(start)?;
                Ok((straightened.candidate, seconds + straightened.seconds))
            };
            let strengths = steer::by_heading(&found.candidate.parameters).into_par_iter();
            strengths.with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        self.progress.simulated += tried.iter().map(|(_, seconds)| seconds).sum::<f64>();
        let mut tried: Vec<Candidate> = tried.into_iter().map(|(straight, _)| straight).collect();
        tried.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let steered = self.first_proven(&found.wanted, tried);
        stop.check()?;
        let holds = |found: &Found| found.candidate.cost < HOLDS;
        let helps = |steered: &Found| steered.proof() > found.proof() || (holds(steered) && !holds(found));
        Ok(steered.filter(helps))
    }
}
