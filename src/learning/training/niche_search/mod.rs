//! The search in one niche: seeds, the speed that costs least or the greatest, refinement, a longer comparison.

mod feedback;
mod found;
mod judged;
mod proof;
mod search;
mod stage;

use feedback::{Balances, Feedback};
use found::{Found, Proof};
use search::{LONG, STAGE, with_stages};
use stage::{Fidelity, Rank, Stage};

use super::motion::LearnedMotion;
use super::niche::NichePace;
use super::shared::Shared;

pub(super) use search::NicheSearch;

use crate::learn::{Interrupted, StopReason};
use crate::program::ring::Wanted;
use crate::program::rollout::{BALANCED_STRIDES, STRIDES};
use crate::program::seeds::Seed;
use crate::program::steer;
use crate::program::straightening::Straightening;

/// Share of the wanted speed below which a motion goes nowhere.
const CRAWL: f64 = 0.1;
/// Factor from one Froude number to the next where the greatest speed is looked for.
const FASTER: f64 = 1.25;
/// How many slower ones are tried where the fastest is not natural.
const SLOWER: u32 = 3;
/// How many more times at most a gait is searched for that is not natural or fails a trial; more often hard gaits, which more searches
/// miss, and those that were given feedback on the way.
const AGAIN: u32 = 1;
const HARD_AGAIN: u32 = 2;
/// How many times a search for a hard gait begins, and which part of the generations of a gait each beginning has.
const BEGINNINGS: u32 = 3;
const BEGINNING: u32 = 8;
/// How many programs are drawn for each search for a balance to start from.
const DRAWN: usize = 2000;

impl NicheSearch<'_> {
    /// Searches, and gives what was found also where the search was broken off: a motion that stays up and gets on, if one was seen a
    /// natural one.
    pub(super) fn run(mut self) -> (Option<LearnedMotion>, Result<(), Interrupted>) {
        let outcome = self.search();
        // A natural motion on the way is worth more than what was not found natural: the search may have been broken off, or have gone on
        // to a speed that costs less. Where the greatest speed is looked for, it counts at that speed only.
        let cheapest = matches!(self.niche.pace, NichePace::Cheapest { .. });
        let in_its_place = |seen: &Found| {
            let found = self.found.as_ref();
            found.is_none_or(|found| !found.natural && (cheapest || found.wanted.speed == seen.wanted.speed))
        };
        let seen = self.seen_natural.clone().filter(in_its_place);
        let found = seen.or(self.found.take()).filter(|found| self.gets_on(found));
        let motion = |Found { wanted, candidate, trials, .. }: Found| LearnedMotion {
            trials: trials.unwrap_or_default(),
            ..self.motion(&wanted, &candidate)
        };
        (found.map(motion), outcome)
    }

    /// Whether a motion stays up and gets on. One that stays up by its feedback alone has to do so for as long as it is judged: where it
    /// falls, QDSEGA does better.
    fn gets_on(&self, found: &Found) -> bool {
        let Found { wanted, candidate, natural, .. } = found;
        let stays_up = || {
            let motion = self.motion(wanted, candidate);
            let player = motion.player(&self.shared.setup.stance.angles);
            let stopped = || self.shared.stop.is_cancelled();
            let checked = motion.check(self.shared.setup, &player).run(&stopped);
            checked.is_ok_and(|checked| !stopped() && checked.trace.fell_at.is_none())
        };
        candidate.figures.upright >= 1.0
            && candidate.figures.speed > CRAWL * wanted.speed
            && (*natural || self.feedback != Feedback::Balances || found.stood.unwrap_or_else(stays_up))
    }

    /// Searches once, with feedback where nothing stays up without, and again with other chances where what was found stays
    /// up in the search but is not natural or fails a trial, with feedback where it falls when judged or in a trial; where it was to be the
    /// fastest, at lower speeds.
    fn search(&mut self) -> Result<(), Interrupted> {
        self.attempt()?;
        let fallen = self.found.as_ref().is_some_and(|found| found.candidate.figures.upright < 1.0);
        // Where the first gait cannot be balanced, the time is better left to QDSEGA than spent on others.
        let promising =
            self.index == 0 || self.progress.milestones.iter().any(|milestone| milestone.finished);
        let left = self.generations() > 0 && self.shared.used_up(self.progress).is_none();
        if fallen && promising && left && self.shared.subject.can_steer() {
            self.feedback = Feedback::Balances;
            if self.index > 0 && !self.can_spare(self.attempt_takes()) {
                return Ok(());
            }
            // Whether a balance holds depends on the step: of five that were searched for at twice the step three fell at a quarter of it.
            self.fine = self.shared.fine.clone().suited(&self.niche.gait).balancing(&self.shared.coarse);
            self.coarse = self.fine.clone();
            self.attempt()?;
        }
        let mut again = 0;
        while again < self.most_attempts_again() && self.attempt_again()? {
            again += 1;
        }
        Ok(())
    }

    /// How many more times the gait is searched for at most.
    fn most_attempts_again(&self) -> u32 {
        match self.niche.pace {
            NichePace::Cheapest { .. } if self.niche.gait.is_hard() || self.keeps() => HARD_AGAIN,
            NichePace::Cheapest { .. } => AGAIN,
            NichePace::Fastest { .. } => SLOWER,
        }
    }

    /// Searches once more if that may be of use, and keeps the better of what was found before and now; whether it did.
    fn attempt_again(&mut self) -> Result<bool, Interrupted> {
        let of_use = |found: &Found| {
            found.proof() != Proof::ALL_TRIALS_KEPT
                && (found.candidate.figures.upright >= 1.0 || self.keeps())
                && self.generations() > 0
        };
        let Some(before) = self.found.clone().filter(of_use) else { return Ok(false) };
        if !self.can_spare(self.attempt_takes()) {
            return Ok(false);
        }
        // What falls later, or under a disturbance, is given feedback.
        if self.may_be_steered() && self.falls(&before) {
            self.feedback = Feedback::Keeps;
            if !self.can_spare(self.attempt_takes()) {
                return Ok(false);
            }
        }
        if matches!(self.niche.pace, NichePace::Fastest { .. }) {
            // Whoever is too fast to be natural may be so when slower.
            let tried = before.wanted.froude(&self.shared.subject.legs);
            self.greatest_froude = self.greatest_froude.min(tried) / FASTER;
            if self.greatest_froude < self.niche.gait.froude[0] {
                return Ok(false);
            }
        }
        self.found = None;
        // What only fails a trial is better left for another way to go; what is not natural yet, or falls, may do better in as many
        // generations more.
        self.unfinished = (!before.natural || self.keeps()).then(|| before.candidate.parameters.clone());
        let outcome = self.attempt();
        let better = |next: &Found| match self.niche.pace {
            NichePace::Cheapest { .. } => next.beats(&before, self.shared.subject),
            // This one is slower.
            NichePace::Fastest { .. } => next.proof() > before.proof(),
        };
        // What was broken off is not known to be better.
        if outcome.is_err() || !self.found.as_ref().is_some_and(better) {
            self.found = Some(before);
        }
        outcome.map(|()| true)
    }

    /// Whether a gait that falls can be given feedback. Leaps are left out: most of them fall on soft ground alone.
    fn may_be_steered(&self) -> bool {
        !self.feedback.is_given() && self.shared.subject.can_steer() && !self.niche.gait.is_hard()
    }

    fn keeps(&self) -> bool {
        self.feedback == Feedback::Keeps
    }

    fn attempt(&mut self) -> Result<(), Interrupted> {
        let all = self.generations();
        // What other gaits have found is often a better start than the template.
        let known = self.progress.milestones.iter().filter(|milestone| milestone.finished);
        let known = known.map(|milestone| Seed::far(milestone.motion.parameters.clone()));
        let seeds = self.shared.subject.seeds(&self.niche.gait).into_iter().chain(known);
        let others = self.with_feedback(seeds);
        let unfinished = self.with_feedback(self.unfinished.clone().map(Seed::far).into_iter());
        let seeds = [&others[..], &unfinished].concat();
        let first = match &self.niche.pace {
            NichePace::Cheapest { first, .. } => *first,
            NichePace::Fastest { first } => first.min(self.greatest_froude),
        };
        let wanted = self.wanted(first);
        // What keeps most limits already has the others left.
        let wanted = if self.unfinished.is_some() { wanted.strictly() } else { wanted };
        let (mut leading, spent) = if self.feedback.is_given() {
            let mut leading = self.balanced(&wanted, (&seeds, &others), all)?;
            if !self.keeps() && leading.best().figures.upright >= 1.0 {
                leading.refinement.try_over(BALANCED_STRIDES);
                self.again(&mut leading, Fidelity::Coarse)?;
            }
            self.refine(&mut leading, Fidelity::Coarse, all / STAGE, Rank::Leading)?;
            (leading, all / STAGE)
        } else {
            let hard = self.niche.gait.is_hard();
            let (count, each) = if hard { (BEGINNINGS, all / BEGINNING) } else { (1, all / STAGE) };
            (self.begun(&wanted, &seeds, count, each)?, count * each)
        };
        let fallen = leading.best().figures.upright < 1.0;
        if all > 0 && fallen && !self.feedback.is_given() && self.shared.used_up(self.progress).is_none() {
            // Whoever does not learn to stay up at first does not learn it at all.
            return Ok(());
        }
        self.refine(&mut leading, Fidelity::Coarse, all / 2 - spent, Rank::Leading)?;
        let leading = match &self.niche.pace {
            NichePace::Cheapest { others, .. } => self.cheapest(leading, others, all / STAGE)?,
            NichePace::Fastest { .. } => self.fastest(leading, all / STAGE)?,
        };
        self.finish(leading, all - all / 2)
    }

    /// Runs `count` searches of so many generations each, from the most promising of `seeds`, and keeps the best: where a search for a
    /// hard gait ends is soon decided, by where it began and by chance. That takes few strides, also of a gallop.
    fn begun(
        &mut self,
        wanted: &Wanted,
        seeds: &[Seed],
        count: u32,
        generations: u32,
    ) -> Result<Stage, Interrupted> {
        let starts = self.starts(wanted, seeds, STRIDES)?;
        let mut leading = self.stage(wanted, (&starts, 0), STRIDES);
        self.found = Some(leading.found());
        if self.stages == 1 && leading.best().figures.upright >= 1.0 {
            let motion = self.motion(&leading.wanted, leading.best());
            self.progress.show(motion, false, self.observer);
        }
        self.refine(&mut leading, Fidelity::Coarse, generations, Rank::Leading)?;
        for rank in 1..count {
            let mut other = self.stage(wanted, (&starts, rank as usize), STRIDES);
            self.refine(&mut other, Fidelity::Coarse, generations, Rank::Beginning)?;
            if other.best().cost < leading.best().cost {
                leading = other;
                self.found = Some(leading.found());
            }
        }
        if self.niche.gait.gallops() {
            leading.refinement.try_over(self.strides());
            self.again(&mut leading, Fidelity::Coarse)?;
            // Gallops of `anymal_b`, five seeds, were natural after 62 s (35 to 64) where this was left to the second half, and so after 55 s
            // (48 to 70, of which the last was found beside other work).
            self.hold_to_limits(&mut leading)?;
            self.found = Some(leading.found());
        }
        Ok(leading)
    }

    /// Holds what is not natural yet to the limits more strictly: what keeps them has only effort left to save.
    fn hold_to_limits(&mut self, leading: &mut Stage) -> Result<(), Interrupted> {
        if !self.is_natural(leading)? {
            leading.wanted = leading.wanted.clone().strictly();
            leading.refinement.revalue(self.shared.subject, &leading.wanted);
        }
        Ok(())
    }

    /// `seeds` as they are, or with feedback where this search has some.
    fn with_feedback(&self, seeds: impl Iterator<Item = Seed>) -> Vec<Seed> {
        match self.shared.subject.can_steer() {
            true => seeds.flat_map(|seed| steer::starts(&seed, self.feedback.is_given())).collect(),
            false => seeds.collect(),
        }
    }

    /// The best of the searches for a balance of an attempt of so many generations, and of more where none of these stays up and they can
    /// be spared, each from the most promising of some seeds and of programs drawn about them and about where searches ended: what falls
    /// soon costs little time to try, and how well the rest can go is soon decided. The first begins with `seeds`, the further ones,
    /// which are to find another way than the attempt before, with `others`.
    fn balanced(
        &mut self,
        wanted: &Wanted,
        (seeds, others): (&[Seed], &[Seed]),
        all: u32,
    ) -> Result<Stage, Interrupted> {
        let Balances { generations, usual, most } = self.feedback.searches(all);
        // What follows in this attempt comes first.
        let with_rest = generations.saturating_add(with_stages(self.niche, all));
        let mut best = self.balance(wanted, seeds, generations)?;
        for search in 1..most {
            let further = search >= usual;
            let stays_up = best.best().figures.upright >= 1.0;
            let used_up = self.shared.used_up(self.progress).is_some();
            if used_up || further && (stays_up || !self.can_spare(with_rest)) {
                break;
            }
            let stage = self.balance(wanted, others, generations)?;
            if stage.best().cost < best.best().cost {
                best = stage;
            }
        }
        self.found = Some(best.found());
        Ok(best)
    }

    /// One of these searches.
    fn balance(&mut self, wanted: &Wanted, seeds: &[Seed], generations: u32) -> Result<Stage, Interrupted> {
        let Shared { subject, .. } = self.shared;
        let mut starts = seeds.to_vec();
        if self.feedback == Feedback::Balances {
            let ends = steer::ends();
            for (about, chances) in [(seeds, self.chances()), (&ends, !self.chances())] {
                starts.extend(steer::drawn(&subject.legs, wanted, about, DRAWN / 2, chances));
            }
            starts.extend(ends);
        }
        let mut stage = self.first_stage(wanted, &starts)?;
        let outcome = self.refine(&mut stage, Fidelity::Coarse, generations, Rank::Rival);
        // Kept also where the search is broken off.
        if self.found.as_ref().is_none_or(|found| stage.best().cost < found.candidate.cost) {
            self.found = Some(stage.found());
        }
        outcome?;
        Ok(stage)
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
            let next = (FASTER * now).min(greatest);
            // A Froude number that has become a speed and is one again may be less by rounding.
            let as_fast = next <= now * (1.0 + 1e-9);
            if generations == 0 || !leading.holds() || as_fast || self.shared.used_up(self.progress).is_some()
            {
                return Ok(leading);
            }
            let other = self.from(&leading, next, generations)?;
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
        self.hold_to_limits(&mut leading)?;
        if self.fine.step() != self.coarse.step() {
            // What is found at the step that was asked for is compared with what is best at that step.
            self.again(&mut leading, Fidelity::Fine)?;
        }
        self.refine(&mut leading, Fidelity::Fine, generations, Rank::Leading)?;
        let Shared { pool, stop, subject, .. } = self.shared;
        let Stage { wanted, mut refinement } = leading;
        let wanted = wanted.as_it_goes();
        let before = refinement.seconds;
        let mut finalists = refinement.finalists((pool, stop), subject, &self.fine, &wanted, LONG)?;
        self.progress.simulated += refinement.seconds - before;
        // What was natural on the way is not lost where what came after it costs less but is not. It is tried as the others were.
        if let Some(seen) = self.seen_natural.as_ref().filter(|seen| seen.wanted.speed == wanted.speed) {
            let comparison =
                Straightening { subject, arena: &self.fine, wanted: &wanted, strides: LONG, stop };
            let tried = comparison.disturbed(&seen.candidate.parameters)?;
            self.progress.simulated += tried.seconds();
            finalists.push(tried);
            finalists.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        }
        let Some(found) = self.first_proven(&wanted, finalists) else { return Ok(()) };
        // Kept before the clock is looked at: what was straightened and proven is not lost where time ends in the proof.
        self.found = Some(found.clone());
        stop.check()?;
        if found.proof() == Proof::ALL_TRIALS_KEPT {
            return Ok(());
        }
        match self.steered_by_heading(&found) {
            Ok(steered) => self.found = Some(steered.unwrap_or(found)),
            // What was proven without stands.
            Err(Interrupted(StopReason::Seconds)) => self.progress.by_the_clock = true,
            Err(interrupted) => return Err(interrupted),
        }
        Ok(())
    }
}
