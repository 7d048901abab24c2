//! The search in one niche: seeds, the speed that costs least or the greatest, refinement, a longer comparison.

mod proof;
mod stage;

use std::time::Instant;

use proof::Found;
use stage::{Fidelity, Rank, Stage};

use super::motion::LearnedMotion;
use super::niche::{Niche, NichePace};
use super::observer::TrainingObserver;
use super::shared::{Progress, Shared};
use crate::check::CHECKED;
use crate::gait::leaps;
use crate::learn::Interrupted;
use crate::program::refine::STRAIGHTENED;
use crate::program::rollout::Arena;
use crate::program::steer;

/// Greatest share of the time for a niche that its end may take, and how many times its estimate is kept for it.
const LONGEST_END: f64 = 0.4;
const MARGIN: f64 = 1.2;
/// About how many checks the trials take: as many as there are, one of them at a quarter of the step, and one in an engine whose steps
/// take as long as many of ours.
const TRIALS: usize = 30;
/// Strides over which the best of a niche are compared at its end.
const LONG: usize = 40;
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
        let Some(found) = self.first_proven(&wanted, finalists) else { return Ok(()) };
        // Kept before the clock is looked at: what was straightened and proven is not lost where time ends in the proof.
        self.found = Some(found.clone());
        stop.check()?;
        let steered = if found.is_proven() { None } else { self.steered_by_heading(&found)? };
        self.found = Some(steered.unwrap_or(found));
        Ok(())
    }
}
