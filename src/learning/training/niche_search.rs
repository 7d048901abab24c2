//! The search in one niche: seeds, the speed that costs least or the greatest, refinement, a longer comparison.

use std::time::Instant;

use gaitwright_physics::motion::Trial;
use gaitwright_physics::playback::Trace;
use rayon::prelude::*;

use super::motion::LearnedMotion;
use super::niche::{Niche, NichePace};
use super::observer::TrainingObserver;
use super::shared::{Progress, Shared};
use crate::check::CHECKED;
use crate::gait::leaps;
use crate::learn::{Generation, Interrupted};
use crate::program::cost::{HOLDS, within_limits};
use crate::program::refine::{Candidate, Refinement, STRAIGHTENED, evaluate};
use crate::program::ring::Wanted;
use crate::program::rollout::{Arena, STEERED_STRIDES, STRIDES};
use crate::program::steer;

/// Greatest share of the time for a niche that its end may take, and how many times its estimate is kept for it.
const LONGEST_END: f64 = 0.4;
const MARGIN: f64 = 1.2;
/// About how many checks the trials take: as many as there are, one of them at a quarter of the step, and one in an engine whose steps
/// take as long as many of ours.
const TRIALS: usize = 30;
/// Strides over which the best of a niche are compared at its end.
const LONG: usize = 40;
/// Generations after which it is looked whether the best is natural already.
const LOOK: usize = 5;
/// Share of the wanted speed below which a motion goes nowhere.
const CRAWL: f64 = 0.1;
/// Factor from one Froude number to the next where the greatest speed is looked for.
const FASTER: f64 = 1.25;
/// Froude number of a slow gallop. The search for a leap at a greater one begins at half of that, but no slower than this.
const SLOW: f64 = 1.0;
/// How many slower ones are tried where the fastest is not natural.
const SLOWER: u32 = 3;
/// A stage at another speed has this part of the generations of a gait.
const STAGE: u32 = 6;
/// How many times the generations of a gait it takes to balance it by feedback.
const STEERED_TIMES: u32 = 4;
/// Into how many parts the starts are divided where balance is looked for.
const PARTS: usize = 4;
/// Numbers of random streams kept for one niche: more than it has stages.
const STREAMS: u64 = 64;

/// A search in one niche.
pub(super) struct NicheSearch<'a> {
    shared: &'a Shared<'a>,
    index: usize,
    niche: &'a Niche,
    progress: &'a mut Progress,
    observer: &'a mut dyn TrainingObserver,
    /// Generations that the niches after this one need.
    later: u32,
    /// s of the wall clock that one simulated step takes, as in the last generation.
    step_time: f64,
    /// s of the wall clock that one simulated second of a continuous check takes, once there was one: its forces may be more exact.
    check_time: Option<f64>,
    begun: Instant,
    /// Refinements begun so far.
    stages: u64,
    /// Whether gaits have feedback.
    steered: bool,
    /// Greatest Froude number that is tried where the greatest speed is looked for.
    greatest_froude: f64,
    /// The best so far at the speed that leads.
    found: Option<Found>,
    /// Whether a natural motion has been shown.
    shown_natural: bool,
    /// Where its candidates are tried, at the step that was asked for.
    fine: Arena,
    /// The same at a longer one.
    coarse: Arena,
}

/// At which step candidates are tried.
#[derive(Debug, Clone, Copy)]
enum Fidelity {
    Coarse,
    Fine,
}

/// A candidate and what it is to be.
#[derive(Clone)]
struct Found {
    wanted: Wanted,
    candidate: Candidate,
    /// Whether it was found natural in a continuous simulation.
    natural: bool,
    /// What was left of it in the trials, where it is natural and there was time for all of them.
    trials: Vec<Trial>,
}

impl Found {
    /// Whether it is natural, and how many trials it kept.
    fn proof(&self) -> (bool, usize) {
        (self.natural, kept(&self.trials))
    }

    /// Whether it is natural and kept every trial.
    fn is_proven(&self) -> bool {
        self.natural && kept(&self.trials) == self.trials.len()
    }

    /// Whether it is worth more than `other`, which was found in the same way.
    fn beats(&self, other: &Self) -> bool {
        let (own, others) = (self.proof(), other.proof());
        own > others || (own == others && self.candidate.cost < other.candidate.cost)
    }
}

/// In how many trials a motion stayed up and went on.
fn kept(trials: &[Trial]) -> usize {
    trials.iter().filter(|trial| trial.kept()).count()
}

/// A refinement at one speed.
struct Stage {
    wanted: Wanted,
    refinement: Refinement,
}

impl Stage {
    fn best(&self) -> &Candidate {
        self.refinement.best()
    }

    fn holds(&self) -> bool {
        self.best().cost < HOLDS
    }

    fn found(&self) -> Found {
        let (wanted, candidate) = (self.wanted.clone(), self.best().clone());
        Found { wanted, candidate, natural: false, trials: Vec::new() }
    }

    /// Whether it does what is wanted for less than `other`.
    fn beats(&self, other: &Self) -> bool {
        let cost = |stage: &Self| stage.best().figures.cost_of_transport;
        self.holds() && (!other.holds() || cost(self) < cost(other))
    }
}

/// Whether what a refinement finds is the niche's best.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rank {
    Leading,
    Rival,
}

impl<'a> NicheSearch<'a> {
    pub(super) fn new(
        shared: &'a Shared<'a>,
        (index, niches): (usize, &'a [Niche]),
        progress: &'a mut Progress,
        observer: &'a mut dyn TrainingObserver,
    ) -> Self {
        let share: u32 = niches[index + 1..].iter().map(|niche| niche.gait.share()).sum();
        let later = share.saturating_mul(shared.setup.parameters.gait_generations);
        Self {
            shared,
            index,
            niche: &niches[index],
            later,
            step_time: 0.0,
            check_time: None,
            begun: Instant::now(),
            progress,
            observer,
            stages: 0,
            steered: false,
            greatest_froude: niches[index].gait.froude[2],
            found: None,
            shown_natural: false,
            fine: shared.fine.clone().suited(&niches[index].gait),
            coarse: shared.coarse.clone().suited(&niches[index].gait),
        }
    }

    /// Searches, and gives what was found also where the search was broken off: a motion that stays up and gets on.
    pub(super) fn run(mut self) -> (Option<LearnedMotion>, Result<(), Interrupted>) {
        let outcome = self.search();
        let found = self.found.take().filter(|Found { wanted, candidate, .. }| {
            candidate.figures.upright >= 1.0 && candidate.figures.speed > CRAWL * wanted.speed
        });
        let motion = |Found { wanted, candidate, trials, .. }: Found| LearnedMotion {
            trials,
            ..self.motion(&wanted, &candidate)
        };
        (found.map(motion), outcome)
    }

    /// Searches once, with feedback where nothing stays up without, and once more with other chances where what was found stays
    /// up but is not natural or fails a trial; where it was to be the fastest, at lower speeds.
    fn search(&mut self) -> Result<(), Interrupted> {
        self.attempt()?;
        let fallen = self.found.as_ref().is_some_and(|found| found.candidate.figures.upright < 1.0);
        // Where the first gait cannot be balanced, the time is better left to QDSEGA than spent on others.
        let promising =
            self.index == 0 || self.progress.milestones.iter().any(|milestone| milestone.finished);
        if fallen && promising && self.generations() > 0 && self.shared.subject.can_steer() {
            self.steered = true;
            self.attempt()?;
        }
        let again = |found: &Found| !found.is_proven() && found.candidate.figures.upright >= 1.0;
        let attempts = match self.niche.pace {
            NichePace::Cheapest { .. } => 1,
            NichePace::Fastest { .. } => SLOWER,
        };
        for _ in 0..attempts {
            let wanting = self.generations() > 0 && self.found.as_ref().is_some_and(again);
            if !wanting || !self.can_spare(self.generations()) {
                break;
            }
            let Some(before) = self.found.take() else { break };
            // Whoever is too fast to be natural may be so when slower.
            let tried = before.wanted.froude(&self.shared.subject.legs);
            self.greatest_froude = self.greatest_froude.min(tried) / FASTER;
            let outcome = self.attempt();
            // What was broken off is not known to be better.
            if outcome.is_err() || !self.found.as_ref().is_some_and(|next| next.beats(&before)) {
                self.found = Some(before);
            }
            outcome?;
        }
        Ok(())
    }

    /// Generations of one attempt.
    fn generations(&self) -> u32 {
        let parameters = &self.shared.setup.parameters;
        let times = if self.steered { STEERED_TIMES } else { 1 };
        if parameters.refine { parameters.gait_generations * self.niche.gait.share() * times } else { 0 }
    }

    /// Whether so many more generations take nothing of the budget from the gaits that are still to come.
    fn can_spare(&mut self, generations: u32) -> bool {
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
    fn is_late(&self, stage: &Stage) -> bool {
        let searched = self.step_time / self.fine.step();
        let checked = self.check_time.unwrap_or(searched);
        let needed = MARGIN
            * (searched * stage.refinement.seconds_of_finalists(LONG)
                + checked * CHECKED * (STRAIGHTENED + TRIALS) as f64);
        self.shared.stop.left().is_some_and(|left| {
            left < needed && needed < LONGEST_END * (left + self.begun.elapsed().as_secs_f64())
        })
    }

    fn attempt(&mut self) -> Result<(), Interrupted> {
        let all = self.generations();
        // What other gaits have found is often a better start than the template.
        let known = self.progress.milestones.iter().filter(|milestone| milestone.finished);
        let mut starts: Vec<Vec<f64>> = self
            .shared
            .subject
            .seeds(&self.niche.gait)
            .into_iter()
            .chain(known.map(|milestone| milestone.motion.parameters.clone()))
            .collect();
        if self.shared.subject.can_steer() {
            starts = starts.iter().flat_map(|start| steer::starts(start, self.steered)).collect();
        }
        let first = match &self.niche.pace {
            NichePace::Cheapest { first, .. } | NichePace::Fastest { first } => *first,
        };
        let mut leading =
            if self.steered { self.balanced(first, &starts, all)? } else { self.stage(first, &starts)? };
        self.found = Some(leading.found());
        if self.stages == 1 && leading.best().figures.upright >= 1.0 {
            let motion = self.motion(&leading.wanted, leading.best());
            self.progress.show(motion, false, self.observer);
        }
        let trial = all / STAGE;
        let slower = (0.5 * first).max(SLOW);
        let mut done = 0;
        if leaps(self.niche.gait.gait) && slower < first && !self.steered {
            leading = self.from_slower(&leading, [slower, first], &starts, all / 4)?;
            done = all / 4;
        }
        let next = trial.max(done);
        self.refine(&mut leading, Fidelity::Coarse, next - done, Rank::Leading)?;
        let fallen = leading.best().figures.upright < 1.0;
        if all > 0 && fallen && !self.steered && self.shared.used_up(self.progress).is_none() {
            // Whoever does not learn to stay up at first does not learn it at all.
            return Ok(());
        }
        self.refine(&mut leading, Fidelity::Coarse, all / 2 - next, Rank::Leading)?;
        let leading = match &self.niche.pace {
            NichePace::Cheapest { others, .. } => self.cheapest(leading, others, all / STAGE)?,
            NichePace::Fastest { .. } => self.fastest(leading, all / STAGE)?,
        };
        self.finish(leading, all - all / 2)
    }

    /// A stage at the second of two Froude numbers, from the best of `leading` and of as many generations at the first, slower one: at
    /// high speeds most of what could become a gallop falls or has no name.
    fn from_slower(
        &mut self,
        leading: &Stage,
        [slower, froude]: [f64; 2],
        starts: &[Vec<f64>],
        generations: u32,
    ) -> Result<Stage, Interrupted> {
        let mut slow = self.stage(slower, starts)?;
        self.refine(&mut slow, Fidelity::Coarse, generations, Rank::Rival)?;
        let starts = [slow.best().parameters.clone(), leading.best().parameters.clone()];
        let leading = self.stage(froude, &starts)?;
        self.found = Some(leading.found());
        Ok(leading)
    }

    /// The best of searches from parts of the `starts`, up to the first that stays up: what falls soon costs little time, and whether it
    /// learns not to depends on where it began.
    fn balanced(&mut self, froude: f64, starts: &[Vec<f64>], generations: u32) -> Result<Stage, Interrupted> {
        let mut best = self.stage(froude, starts)?;
        self.refine(&mut best, Fidelity::Coarse, generations, Rank::Rival)?;
        for part in 0..PARTS.min(starts.len()) {
            if best.best().figures.upright >= 1.0 || self.shared.used_up(self.progress).is_some() {
                break;
            }
            let own: Vec<Vec<f64>> = starts.iter().skip(part).step_by(PARTS).cloned().collect();
            let mut stage = self.stage(froude, &own)?;
            self.refine(&mut stage, Fidelity::Coarse, generations, Rank::Rival)?;
            if stage.best().cost < best.best().cost {
                best = stage;
            }
        }
        Ok(best)
    }

    /// The one of `leading` and of refinements at `others` that costs least.
    fn cheapest(
        &mut self,
        mut leading: Stage,
        others: &[f64],
        generations: u32,
    ) -> Result<Stage, Interrupted> {
        for &froude in others {
            let other = self.from(&leading, froude, generations)?;
            if other.beats(&leading) {
                leading = other;
                self.found = Some(leading.found());
            }
        }
        Ok(leading)
    }

    /// The last of refinements at growing speeds that holds all constraints.
    fn fastest(&mut self, mut leading: Stage, generations: u32) -> Result<Stage, Interrupted> {
        let greatest = self.greatest_froude;
        loop {
            let now = leading.wanted.froude(&self.shared.subject.legs);
            if generations == 0
                || !leading.holds()
                || now >= greatest
                || self.shared.used_up(self.progress).is_some()
            {
                return Ok(leading);
            }
            let other = self.from(&leading, (FASTER * now).min(greatest), generations)?;
            if !other.holds() {
                return Ok(leading);
            }
            leading = other;
            self.found = Some(leading.found());
        }
    }

    /// The rest of the refinement at the step that was asked for; of the best over many strides, set straight, then the
    /// first that is natural.
    fn finish(&mut self, mut leading: Stage, generations: u32) -> Result<(), Interrupted> {
        // What keeps the limits already has only effort left to save.
        let begun = Instant::now();
        let natural = self.natural(&leading.wanted, std::slice::from_ref(leading.best()));
        self.check_time = Some(begun.elapsed().as_secs_f64() / CHECKED);
        if natural.iter().all(Option::is_none) {
            leading.wanted = leading.wanted.strictly();
            leading.refinement.revalue(self.shared.subject, &leading.wanted);
        }
        self.refine(&mut leading, Fidelity::Fine, generations, Rank::Leading)?;
        let Stage { wanted, mut refinement } = leading;
        let Shared { pool, stop, subject, .. } = self.shared;
        let before = refinement.seconds;
        let finalists = refinement.finalists((pool, stop), subject, &self.fine, &wanted, LONG)?;
        self.progress.simulated += refinement.seconds - before;
        let proven = self.proven(&wanted, &finalists);
        let natural = proven.is_some();
        let (index, trials) = proven.unwrap_or_default();
        let Some(candidate) = finalists.into_iter().nth(index) else { return Ok(()) };
        let found = Found { wanted, candidate, natural, trials };
        // Kept before the clock is looked at: what was straightened and proven is not lost where time ends in the proof.
        self.found = Some(found.clone());
        stop.check()?;
        let steered = if found.natural { None } else { self.steered_by_heading(&found)? };
        self.found = Some(steered.unwrap_or(found));
        Ok(())
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
    fn natural(&mut self, wanted: &Wanted, candidates: &[Candidate]) -> Vec<Option<Trace>> {
        let shared = self.shared;
        let motions: Vec<_> = candidates.iter().map(|candidate| self.motion(wanted, candidate)).collect();
        let judged = || motions.par_iter().with_max_len(1).map(|motion| natural(shared, motion)).collect();
        let checked: Vec<(f64, Option<Trace>)> = shared.pool.install(judged);
        self.progress.simulated += checked.iter().map(|(seconds, _)| seconds).sum::<f64>();
        checked.into_iter().map(|(_, trace)| trace).collect()
    }

    /// The same gait with feedback that keeps its heading, where that makes it natural, or lets it hold constraints that it does not
    /// hold without.
    fn steered_by_heading(&mut self, found: &Found) -> Result<Option<Found>, Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        let fine = &self.fine;
        if self.steered || !subject.can_steer() || self.generations() == 0 {
            return Ok(None);
        }
        let wanted = &found.wanted;
        let tried: Vec<Candidate> = pool.install(|| {
            let one =
                |parameters: Vec<f64>| stop.whole(|| evaluate(subject, fine, wanted, &parameters, LONG));
            let strengths = steer::by_heading(&found.candidate.parameters).into_par_iter();
            strengths.with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        self.progress.simulated += tried.iter().map(Candidate::seconds).sum::<f64>();
        let natural = self.natural(wanted, &tried);
        stop.check()?;
        let steered = tried.into_iter().zip(natural);
        let best = steered
            .map(|(candidate, natural)| Found {
                wanted: wanted.clone(),
                candidate,
                natural: natural.is_some(),
                trials: Vec::new(),
            })
            .reduce(|best, other| {
                let better = (other.natural, -other.candidate.cost) > (best.natural, -best.candidate.cost);
                if better { other } else { best }
            });
        let holds = |found: &Found| found.candidate.cost < HOLDS;
        Ok(best.filter(|steered| steered.natural || (holds(steered) && !holds(found))))
    }

    /// A refinement at another Froude number, on from the best of `leading`.
    fn from(&mut self, leading: &Stage, froude: f64, generations: u32) -> Result<Stage, Interrupted> {
        let mut other = self.stage(froude, &[leading.best().parameters.clone()])?;
        self.refine(&mut other, Fidelity::Coarse, generations, Rank::Rival)?;
        Ok(other)
    }

    /// Begins a refinement at a Froude number.
    fn stage(&mut self, froude: f64, starts: &[Vec<f64>]) -> Result<Stage, Interrupted> {
        let Shared { setup, subject, pool, stop, .. } = self.shared;
        let coarse = &self.coarse;
        stop.check()?;
        let usual = Wanted::at_froude(&subject.legs, self.niche.gait, froude, subject.gravity());
        let wanted = Wanted { weights: setup.task.weights, ..usual };
        // Steps of the golden ratio keep the seeds of all stages apart (Steele, Lea & Flood 2014).
        let strides = if self.steered { STEERED_STRIDES } else { STRIDES };
        let number = STREAMS * self.index as u64 + self.stages + 1;
        let seed = setup.seed.wrapping_add(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(number));
        self.stages += 1;
        let refinement = Refinement::new((pool, stop), subject, coarse, &wanted, starts, (strides, seed))?;
        self.progress.simulated += refinement.seconds;
        Ok(Stage { wanted, refinement })
    }

    /// So many generations, or as many as the budget has.
    fn refine(
        &mut self,
        stage: &mut Stage,
        fidelity: Fidelity,
        generations: u32,
        rank: Rank,
    ) -> Result<(), Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        for _ in 0..generations {
            self.progress.hurried |= self.is_late(stage);
            if self.shared.used_up(self.progress).is_some() {
                break;
            }
            let arena = match fidelity {
                Fidelity::Coarse => &self.coarse,
                Fidelity::Fine => &self.fine,
            };
            let Stage { wanted, refinement } = &mut *stage;
            let (before, begun) = (refinement.seconds, Instant::now());
            refinement.generation((pool, stop), subject, arena, wanted)?;
            let simulated = refinement.seconds - before;
            self.step_time = begun.elapsed().as_secs_f64() * arena.step() / simulated;
            self.progress.simulated += simulated;
            if rank == Rank::Leading {
                self.found = Some(stage.found());
            }
            let figures = self.figures(&stage.refinement);
            self.observer.generation(&figures);
            self.progress.curve.push(figures);
            if rank == Rank::Leading && self.progress.curve.len().is_multiple_of(LOOK) {
                self.show_first_natural(stage);
            }
        }
        Ok(())
    }

    /// Shows the best of `stage` if it is natural and none has been so far: whoever waits has something to look at while it gets better.
    fn show_first_natural(&mut self, stage: &Stage) {
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

    fn motion(&self, wanted: &Wanted, candidate: &Candidate) -> LearnedMotion {
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

/// From 0 to 1, the more the less a gait costs.
fn fitness(cost: f64) -> f64 {
    if cost.is_finite() { 1.0 / (1.0 + cost.max(0.0)) } else { 0.0 }
}
