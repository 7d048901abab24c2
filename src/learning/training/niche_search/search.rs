//! What the search of a niche is made of: refinements at one speed, their budget, and whether what they find is natural.

use std::cell::OnceCell;
use std::time::Duration;

use rayon::prelude::*;

use super::feedback::{Balances, Feedback};
use super::found::Found;
use super::judged::{Judged, judge};
use super::stage::{Fidelity, Rank, Stage};
use crate::gait::leaps;
use crate::learn::{Generation, Interrupted};
use crate::program::candidate::Candidate;
use crate::program::cost::within_limits;
use crate::program::refine::{PAIRED, Refinement, STRAIGHTENED};
use crate::program::ring::Wanted;
use crate::program::rollout::Arena;
use crate::program::seeds::Seed;
use crate::program::starts::Starts;
use crate::program::straightening::{Straightened, Straightening};
use crate::training::motion::LearnedMotion;
use crate::training::niche::{Niche, NichePace};
use crate::training::observer::TrainingObserver;
use crate::training::shared::{Progress, Shared};

/// Greatest share of the time for a niche that its end may take, and how many times its estimate is kept for it.
const LONGEST_END: f64 = 0.4;
const MARGIN: f64 = 1.2;
/// Strides over which the best of a niche are compared at its end.
pub(super) const LONG: usize = 40;
/// A stage at another speed has this part of the generations of a gait.
pub(super) const STAGE: u32 = 6;
/// With so many rises of the speed is reckoned where the greatest is looked for: most end long before the greatest Froude number that is
/// tried. A running trot has so many from its usual one, 1, to its greatest, 3, in steps of a quarter.
const RISES: u32 = 5;
/// Random streams that are numbered on from one niche to the next; those of further stages are numbered apart.
const STREAMS: u64 = 64;
/// Generations from one look whether the best is natural to the next: until one is, and from then on.
const LOOK: usize = 5;
const LOOK_AGAIN: usize = 20;
/// Strides over which a way is set straight for such a look.
const LOOK_STRIDES: usize = 20;

/// A search in one niche.
pub(in crate::training) struct NicheSearch<'a> {
    pub(super) shared: &'a Shared<'a>,
    pub(super) index: usize,
    pub(super) niche: &'a Niche,
    pub(super) progress: &'a mut Progress,
    pub(super) observer: &'a mut dyn TrainingObserver,
    /// Generations that the niches after this one need.
    pub(super) later: u32,
    /// s that one simulated step takes, as in the last generation.
    pub(super) step_time: f64,
    /// s that one simulated second of a continuous check takes, once there was one: its forces may be more exact.
    pub(super) check_time: Option<f64>,
    /// How many times as long as one run of a motion its trials take, once that was asked for.
    pub(super) cost_of_trials: OnceCell<f64>,
    /// What the clock showed when this search began.
    pub(super) begun: Duration,
    /// Refinements begun so far.
    pub(super) stages: u64,
    pub(super) feedback: Feedback,
    /// Greatest Froude number that is tried where the greatest speed is looked for.
    pub(super) greatest_froude: f64,
    /// The best so far at the speed that leads.
    pub(super) found: Option<Found>,
    /// Parameters of what the attempt before this one found, where that was not natural.
    pub(super) unfinished: Option<Vec<f64>>,
    /// The natural motion on the way that goes for least, or, where the greatest speed is looked for, the one at the speed tried last.
    pub(super) seen_natural: Option<Found>,
    /// Whether a natural motion has been shown.
    pub(super) shown_natural: bool,
    /// The parameters of what was looked at last.
    pub(super) looked_at: Vec<f64>,
    /// Where its candidates are tried, at the step that was asked for.
    pub(super) fine: Arena,
    /// The same at a longer one, but for leaps: how their short stances go depends on the step. Canters of `anymal_b` that began with the
    /// longer one cost 0.44 (median of four), and 0.39 without, in less time.
    pub(super) coarse: Arena,
}

impl<'a> NicheSearch<'a> {
    pub(in crate::training) fn new(
        shared: &'a Shared<'a>,
        (index, niches): (usize, &'a [Niche]),
        progress: &'a mut Progress,
        observer: &'a mut dyn TrainingObserver,
    ) -> Self {
        let generations = shared.setup.parameters.gait_generations;
        let each = |niche: &Niche| with_stages(niche, generations.saturating_mul(niche.gait.share()));
        let later = niches[index + 1..].iter().map(each).fold(0, u32::saturating_add);
        let gait = &niches[index].gait;
        let [fine, longer] = [&shared.fine, &shared.coarse].map(|arena| arena.clone().suited(gait));
        let (fine, coarse) =
            if leaps(gait.gait) { (fine.clone(), fine) } else { (fine.disturbed_as_in(&longer), longer) };
        Self {
            shared,
            index,
            niche: &niches[index],
            later,
            step_time: 0.0,
            check_time: None,
            cost_of_trials: OnceCell::new(),
            begun: shared.stop.clock().now(),
            progress,
            observer,
            stages: 0,
            feedback: Feedback::Open,
            greatest_froude: niches[index].gait.froude[2],
            found: None,
            unfinished: None,
            seen_natural: None,
            shown_natural: false,
            looked_at: Vec::new(),
            fine,
            coarse,
        }
    }

    /// Generations of one attempt at its own speed.
    pub(super) fn generations(&self) -> u32 {
        let parameters = &self.shared.setup.parameters;
        let share = self.niche.gait.share() * self.feedback.times();
        if parameters.refine { parameters.gait_generations.saturating_mul(share) } else { 0 }
    }

    /// How many generations one more attempt takes, without searches for a balance beyond the usual.
    pub(super) fn attempt_takes(&self) -> u32 {
        let all = self.generations();
        let Balances { generations, usual, .. } = self.feedback.searches(all);
        with_stages(self.niche, all).saturating_add(generations.saturating_mul(usual))
    }

    /// Whether so many more generations take nothing of the budget from the gaits that are still to come.
    pub(super) fn can_spare(&mut self, generations: u32) -> bool {
        let most = self.shared.setup.parameters.budget.generations();
        let (done, needed) = (self.progress.curve.len(), generations.saturating_add(self.later));
        let each = self.progress.elapsed() / done.max(1) as f64;
        if most.is_some_and(|most| done + needed as usize > most as usize) {
            return false;
        }
        let in_time = self.shared.stop.left().is_none_or(|left| f64::from(needed) * each <= left);
        self.progress.by_the_clock |= !in_time;
        in_time
    }

    /// Whether the time that is left is needed to compare the best of `stage`, to set them straight, and to look whether they are
    /// natural; not where that would take most of it from the start.
    pub(super) fn is_late(&self, stage: &Stage) -> bool {
        let Some(left) = self.shared.stop.left() else { return false };
        let searched = self.step_time / self.fine.step();
        let checked = self.check_time.unwrap_or(searched);
        let motion = self.motion(&stage.wanted, stage.best());
        let player = motion.player(&self.shared.setup.stance.angles);
        let check = motion.check(self.shared.setup, &player);
        let trials = *self.cost_of_trials.get_or_init(|| check.cost_of_trials());
        // One more look comes first, on one of the threads.
        let threads = self.shared.pool.current_num_threads() as f64;
        let compared = stage.refinement.seconds_of_finalists(&self.fine, LONG)
            + threads * stage.refinement.seconds_to_straighten(LOOK_STRIDES);
        let looks = (STRAIGHTENED as f64 + threads) * check.seconds();
        let needed = MARGIN * (searched * compared + checked * (looks + trials * check.trial_seconds()));
        left < needed && needed < LONGEST_END * (left + self.shared.stop.clock().since(self.begun))
    }

    /// A refinement at another Froude number, on from the best of `leading`.
    pub(super) fn from(
        &mut self,
        leading: &Stage,
        froude: f64,
        generations: u32,
    ) -> Result<Stage, Interrupted> {
        let wanted = self.wanted(froude);
        let seed = Seed::far(leading.best().parameters.clone());
        let mut other = self.first_stage(&wanted, &[seed])?;
        self.refine(&mut other, Fidelity::Coarse, generations, Rank::Rival)?;
        Ok(other)
    }

    /// Begins a refinement from the most promising of `seeds`.
    pub(super) fn first_stage(&mut self, wanted: &Wanted, seeds: &[Seed]) -> Result<Stage, Interrupted> {
        let strides = self.strides();
        let starts = self.starts(wanted, seeds, strides)?;
        Ok(self.stage(wanted, (&starts, 0), strides))
    }

    /// Strides over which candidates are tried.
    pub(super) fn strides(&self) -> usize {
        self.feedback.strides(&self.niche.gait)
    }

    /// What is asked of a gait at a Froude number while it is searched for.
    pub(super) fn wanted(&self, froude: f64) -> Wanted {
        let Shared { setup, subject, .. } = self.shared;
        let usual = Wanted::at_froude(&subject.legs, self.niche.gait, froude, subject.gravity());
        let wanted = Wanted { weights: setup.task.weights, ..usual };
        // The waves of a body without legs turn by the form of the wave itself.
        if subject.legs.spine.is_some() { wanted } else { wanted.straightened_later() }
    }

    /// Tries `seeds` over so many strides.
    pub(super) fn starts(
        &mut self,
        wanted: &Wanted,
        seeds: &[Seed],
        strides: usize,
    ) -> Result<Starts, Interrupted> {
        let Shared { subject, pool, stop, .. } = self.shared;
        stop.check()?;
        let starts = Starts::new((pool, stop), subject, &self.coarse, wanted, seeds, strides)?;
        self.progress.simulated += starts.seconds;
        Ok(starts)
    }

    /// Seed of the random numbers of the refinement that begins next. Steps of the golden ratio keep those of all apart (Steele, Lea &
    /// Flood 2014).
    pub(super) fn chances(&self) -> u64 {
        let further = (self.stages / STREAMS) << 32;
        let number = STREAMS * self.index as u64 + self.stages % STREAMS + 1 + further;
        self.shared.setup.seed.wrapping_add(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(number))
    }

    /// Begins a refinement over so many strides from the one of rank `rank` among `starts`.
    pub(super) fn stage(
        &mut self,
        wanted: &Wanted,
        (starts, rank): (&Starts, usize),
        strides: usize,
    ) -> Stage {
        let Shared { subject, .. } = self.shared;
        let seed = self.chances();
        self.stages += 1;
        let paired = if self.feedback.is_given() || self.niche.gait.is_hard() { 0 } else { PAIRED };
        let chances = (strides, paired, seed);
        let refinement = Refinement::new(subject, wanted, (starts, rank), chances);
        Stage { wanted: wanted.clone(), refinement }
    }

    fn arena(&self, fidelity: Fidelity) -> Arena {
        match fidelity {
            Fidelity::Coarse => self.coarse.clone(),
            Fidelity::Fine => self.fine.clone(),
        }
    }

    /// Tries the best of `stage` again, from now on by other means.
    pub(super) fn again(&mut self, stage: &mut Stage, fidelity: Fidelity) -> Result<(), Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        let Stage { wanted, refinement } = stage;
        let before = refinement.seconds;
        refinement.again_in((pool, stop), subject, &self.arena(fidelity), wanted)?;
        self.progress.simulated += refinement.seconds - before;
        Ok(())
    }

    /// So many generations, or as many as the budget has.
    pub(super) fn refine(
        &mut self,
        stage: &mut Stage,
        fidelity: Fidelity,
        generations: u32,
        rank: Rank,
    ) -> Result<(), Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        let arena = self.arena(fidelity);
        for _ in 0..generations {
            self.progress.hurried |= self.is_late(stage);
            if self.shared.used_up(self.progress).is_some() {
                break;
            }
            let Stage { wanted, refinement } = &mut *stage;
            let (before, begun) = (refinement.seconds, stop.clock().now());
            refinement.generation((pool, stop), subject, &arena, wanted)?;
            let simulated = refinement.seconds - before;
            self.step_time = stop.clock().since(begun) * arena.step() / simulated;
            self.progress.simulated += simulated;
            if rank == Rank::Leading {
                self.found = Some(stage.found());
            }
            let figures = self.figures(&stage.refinement);
            self.observer.generation(&figures);
            self.progress.curve.push(figures);
            let pause = if self.shown_natural { LOOK_AGAIN } else { LOOK };
            if rank != Rank::Rival && self.progress.curve.len().is_multiple_of(pause) {
                self.look(stage)?;
            }
        }
        Ok(())
    }

    fn figures(&self, refinement: &Refinement) -> Generation {
        let values: Vec<f64> = refinement.costs.iter().map(|&cost| fitness(cost)).collect();
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        Generation {
            generation: self.progress.curve.len() as u32,
            gait: Some(self.niche.name.clone()),
            best: fitness(refinement.best().cost),
            mean,
            spread: variance.sqrt(),
            cache_hit_rate: 0.0,
            simulated_seconds: self.progress.simulated,
            saved_seconds: 0.0,
            elapsed: self.progress.elapsed(),
        }
    }

    pub(super) fn motion(&self, wanted: &Wanted, candidate: &Candidate) -> LearnedMotion {
        let Candidate { ring, gains, parameters, cost, .. } = candidate;
        LearnedMotion {
            name: self.niche.name.clone(),
            gait: Some(self.niche.gait.gait.to_owned()),
            speed: Some(wanted.speed),
            behaviour: ring.behaviour(fitness(*cost), self.progress.curve.len() as u32),
            gains: gains.clone(),
            parameters: parameters.clone(),
            trials: Vec::new(),
        }
    }

    /// Looks whether the best of `stage` is natural, if it may be. The first that is, is shown: whoever waits has something to look at while
    /// it gets better.
    fn look(&mut self, stage: &mut Stage) -> Result<(), Interrupted> {
        let Stage { wanted, refinement } = &*stage;
        let best = refinement.best();
        let promising = within_limits(wanted, &self.shared.subject.legs, &best.figures.if_straight());
        if promising && self.looked_at != best.parameters {
            self.looked_at.clone_from(&best.parameters);
            self.is_natural(stage)?;
        }
        Ok(())
    }

    /// Whether the best of `stage` is natural once its way is set straight; the first that is, is shown. What comes after it is tried with
    /// these trims.
    pub(super) fn is_natural(&mut self, stage: &mut Stage) -> Result<bool, Interrupted> {
        let Shared { stop, subject, .. } = self.shared;
        let Stage { wanted, refinement } = stage;
        let wanted = &wanted.as_it_goes();
        let straightening = Straightening { subject, arena: &self.fine, wanted, strides: LOOK_STRIDES, stop };
        let start = straightening.undisturbed(&refinement.best().parameters)?;
        self.progress.simulated += start.seconds();
        let Straightened { candidate: straight, seconds, .. } = straightening.straightened(start)?;
        self.progress.simulated += seconds;
        refinement.trim_as(subject, &straight);
        let (begun, before) = (stop.clock().now(), self.progress.simulated);
        let judged = self.judged(wanted, std::slice::from_ref(&straight)).pop().flatten();
        let checked = self.progress.simulated - before;
        self.check_time = (checked > 0.0).then(|| stop.clock().since(begun) / checked);
        let natural = judged.as_ref().is_some_and(|judged| judged.natural);
        let stood = judged.map(|judged| judged.stood());
        let found =
            Found { wanted: wanted.clone(), candidate: straight.clone(), natural, stood, trials: None };
        let cost_of_transport = |found: &Found| found.candidate.figures.cost_of_transport;
        let better = |seen: &Found| match &self.niche.pace {
            _ if seen.wanted.speed == wanted.speed => found.beats(seen, subject),
            NichePace::Cheapest { .. } => cost_of_transport(&found) < cost_of_transport(seen),
            NichePace::Fastest { .. } => true,
        };
        if natural && self.seen_natural.as_ref().is_none_or(better) {
            self.seen_natural = Some(found);
        }
        if natural && !self.shown_natural {
            let motion = self.motion(wanted, &straight);
            self.progress.show(motion, false, self.observer);
            self.shown_natural = true;
        }
        Ok(natural)
    }

    /// What was seen of each of `candidates` in one continuous simulation; `None` of what was broken off or could not be simulated.
    pub(super) fn judged(&mut self, wanted: &Wanted, candidates: &[Candidate]) -> Vec<Option<Judged>> {
        let shared = self.shared;
        let motions: Vec<_> = candidates.iter().map(|candidate| self.motion(wanted, candidate)).collect();
        let one = |motion| judge(shared, &self.niche.gait, motion);
        let all = || motions.par_iter().with_max_len(1).map(one).collect();
        let judged: Vec<Option<Judged>> = shared.pool.install(all);
        self.progress.simulated += judged.iter().flatten().map(Judged::seconds).sum::<f64>();
        judged
    }
}

/// `generations` of a niche, and those that stages at other speeds take.
pub(super) fn with_stages(niche: &Niche, generations: u32) -> u32 {
    let stages = match &niche.pace {
        NichePace::Cheapest { others, .. } => others.len() as u32,
        NichePace::Fastest { .. } => RISES,
    };
    generations.saturating_add(stages.saturating_mul(generations / STAGE))
}

/// From 0 to 1, the more the less a gait costs.
fn fitness(cost: f64) -> f64 {
    if cost.is_finite() { 1.0 / (1.0 + cost.max(0.0)) } else { 0.0 }
}
