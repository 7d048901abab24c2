//! A gait for a character at a speed: seeds from the force template, polished by CMA-ES.

use rayon::ThreadPool;
use rayon::prelude::*;

use super::candidate::{Candidate, evaluate};
use super::cma::Cma;
use super::ring::{Ring, Wanted};
use super::rollout::Arena;
use super::searched::searched;
use super::starts::{Start, Starts};
use super::straightening::{Straightened, Straightening, TRIMS};
use super::subject::Subject;
use crate::learn::{Interrupted, Stop};

/// Candidates of a generation: fixed, so that the result does not depend on the number of threads.
pub const CANDIDATES: usize = 16;
/// Generations in which candidates come in pairs where a search has few: a walk of 60 then costs a fifth less. Over 240 generations of
/// bounds the reach shrank to a hundredth, and of two searches one ended dearer than without pairs.
pub const PAIRED: u32 = 60;

/// How many of the best are compared over a longer run.
const FINALISTS: usize = 8;
/// How many of these have their ways set straight.
pub const STRAIGHTENED: usize = 4;

/// How far a refinement has come.
#[derive(Debug, Clone)]
pub struct Refinement {
    /// The best so far, in the order of their cost; at least one.
    kept: Vec<Candidate>,
    /// Costs of the candidates tried last, in the order in which they were drawn.
    pub costs: Vec<f64>,
    /// Gaits tried.
    pub evaluations: usize,
    /// s simulated.
    pub seconds: f64,
    search: Cma,
    /// Indices of the parameters that the search changes; the others stay as they are in `start`.
    searched: Vec<usize>,
    start: Vec<f64>,
    /// Strides over which candidates are tried.
    strides: usize,
}

impl Refinement {
    /// From the one of rank `rank` among `starts`; candidates are tried over so many strides, and come in pairs in so many generations
    /// ([`PAIRED`] where the search is short).
    pub fn new(
        subject: &Subject,
        wanted: &Wanted,
        (starts, rank): (&Starts, usize),
        (strides, paired, seed): (usize, u32, u64),
    ) -> Self {
        let Start { candidate: kept, reach } = starts.at(rank).clone();
        let start = kept.parameters.clone();
        let searched = searched(&subject.legs, wanted, start.len());
        let mean: Vec<f64> = searched.iter().map(|index| start[*index]).collect();
        let search = Cma::new(&mean, reach, CANDIDATES, seed).paired(paired);
        let costs = vec![kept.cost];
        Self { kept: vec![kept], costs, evaluations: 0, seconds: 0.0, search, searched, start, strides }
    }

    /// Tries candidates over so many strides from now on; those so far have to be tried [again](Self::again_in).
    pub fn try_over(&mut self, strides: usize) {
        self.strides = strides;
    }

    /// One generation on the threads of `pool`. What comes out does not depend on their number: candidates are
    /// drawn before any is tried, and compared in the order in which they were drawn.
    ///
    /// # Errors
    /// The reason of `stop` to break off; the refinement is then as it was.
    pub fn generation(
        &mut self,
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
    ) -> Result<(), Interrupted> {
        let strides = self.strides;
        let mut search = self.search.clone();
        let asked = search.ask();
        let whole = |asked: &Vec<f64>| {
            let mut parameters = self.start.clone();
            self.searched.iter().zip(asked).for_each(|(index, number)| parameters[*index] = *number);
            parameters
        };
        let tried: Vec<Candidate> = pool.install(|| {
            let one = |asked: &Vec<f64>| {
                let tried = || Candidate::undisturbed(subject, arena, wanted, &whole(asked), strides);
                let candidate = stop.whole(tried)?;
                stop.count();
                Ok(candidate)
            };
            asked.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        // Only the better half is disturbed: its order moves the mean. The others count as no better than the worst of these. What
        // order they have among each other matters little: by their undisturbed costs, 13 gaits of two robots came out no better.
        let mut order: Vec<usize> = (0..tried.len()).collect();
        order.sort_by(|&a, &b| tried[a].cost.total_cmp(&tried[b].cost));
        order.truncate(CANDIDATES / 2);
        let parents: Vec<Candidate> = pool.install(|| {
            let one = |&index: &usize| stop.whole(|| tried[index].clone().disturbed(arena, strides));
            order.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        let worst = parents.iter().map(|parent| parent.cost).fold(0.0, f64::max);
        let mut costs: Vec<f64> = tried.iter().map(|candidate| candidate.cost.max(worst)).collect();
        for (&index, parent) in order.iter().zip(&parents) {
            costs[index] = parent.cost;
        }
        search.tell(&asked, &costs);
        self.search = search;
        self.costs = costs;
        self.count(&tried);
        self.seconds += parents.iter().map(Candidate::disturbed_seconds).sum::<f64>();
        self.kept.extend(parents);
        self.kept.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        self.kept.truncate(FINALISTS);
        Ok(())
    }

    /// Goes on with another idea of what is wanted: the best so far is the best by that.
    pub fn revalue(&mut self, subject: &Subject, wanted: &Wanted) {
        for kept in &mut self.kept {
            kept.cost = kept.cost_as(subject, wanted);
        }
        self.kept.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }

    /// Goes on with the trims of `straight` (see [`Subject::trims`]), where the search leaves them alone: what set one way straight sets
    /// those of its like nearly straight.
    pub fn trim_as(&mut self, subject: &Subject, straight: &Candidate) {
        for index in subject.trims().into_iter().filter(|index| !self.searched.contains(index)) {
            self.start[index] = straight.parameters[index];
        }
    }

    /// Tries the best so far again in `arena`, where another step may find them other than the last did.
    ///
    /// # Errors
    /// The reason of `stop` to break off; the refinement is then as it was.
    pub fn again_in(
        &mut self,
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
    ) -> Result<(), Interrupted> {
        let strides = self.strides;
        let mut tried: Vec<Candidate> = pool.install(|| {
            let one = |kept: &Candidate| {
                let again = || evaluate(subject, arena, wanted, &kept.parameters, strides);
                stop.whole(again)
            };
            self.kept.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        self.count(&tried);
        tried.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        self.kept = tried;
        Ok(())
    }

    /// The best so far, over the few strides of the search.
    pub fn best(&self) -> &Candidate {
        &self.kept[0]
    }

    /// The best so far over `strides` strides each, which show a drift that a few do not: the four that would be best if they
    /// went straight, set straight, in the order of their cost.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn finalists(
        &mut self,
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        strides: usize,
    ) -> Result<Vec<Candidate>, Interrupted> {
        let straightening = Straightening { subject, arena, wanted, strides, stop };
        let mut tried: Vec<Candidate> = pool.install(|| {
            let try_long = |candidate: &Candidate| straightening.disturbed(&candidate.parameters);
            self.kept.par_iter().with_max_len(1).map(try_long).collect::<Result<_, Interrupted>>()
        })?;
        self.count(&tried);
        let straight = |candidate: &Candidate| candidate.cost_if_straight(subject, wanted);
        tried.sort_by(|a, b| straight(a).total_cmp(&straight(b)));
        tried.truncate(STRAIGHTENED);
        let straightened: Vec<Straightened> = pool.install(|| {
            let tried = tried.into_par_iter().with_max_len(1);
            let straightened = tried.map(|candidate| straightening.straightened(candidate));
            straightened.collect::<Result<_, Interrupted>>()
        })?;
        self.evaluations += straightened.iter().map(|of| of.evaluations).sum::<usize>();
        self.seconds += straightened.iter().map(|of| of.seconds).sum::<f64>();
        let mut finalists: Vec<Candidate> = straightened.into_iter().map(|of| of.candidate).collect();
        finalists.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(finalists)
    }

    /// About as many seconds as [`Refinement::finalists`] simulates in `arena`.
    pub fn seconds_of_finalists(&self, arena: &Arena, strides: usize) -> f64 {
        let compared = arena.runs(strides) * FINALISTS as f64 * self.seconds_of_try(strides);
        compared + STRAIGHTENED as f64 * self.seconds_to_straighten(strides)
    }

    /// The same of setting the way of the best straight.
    pub fn seconds_to_straighten(&self, strides: usize) -> f64 {
        f64::from(2 + TRIMS) * self.seconds_of_try(strides)
    }

    fn seconds_of_try(&self, strides: usize) -> f64 {
        let Ring { period, .. } = self.best().ring;
        self.best().ring.lead() + strides as f64 * period
    }

    fn count(&mut self, tried: &[Candidate]) {
        self.evaluations += tried.len();
        self.seconds += tried.iter().map(Candidate::seconds).sum::<f64>();
    }
}
