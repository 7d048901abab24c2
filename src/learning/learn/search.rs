//! The loop over generations, in any world: ask the islands for genomes, evaluate them, tell the results.

use std::time::Duration;

use rayon::ThreadPool;
use rayon::prelude::*;

use super::behaviour::Behaviour;
use super::cache::{Cache, SimulationTotals};
use super::chance::{Purpose, stream};
use super::checkpoint::Checkpoint;
use super::clock::Clock;
use super::evaluation::World;
use super::ga::{Individual, Island, migrate, restart_stale};
use super::generation::Generation;
use super::genome::Genome;
use super::grid::Grid;
use super::learned::Learned;
use super::objective::Objective;
use super::observer::Observer;
use super::parameters::{Coding, Parameters};
use super::population;
use super::stop::{Interrupted, Stop, StopReason};
use super::subset::SearchContext;
use super::task::Task;
use super::trial::{AcceptedBehaviour, IndividualVerdict, judge, prove};

/// What a search is given; it does not change while the search runs.
#[derive(Debug, Clone)]
pub struct Search<W> {
    /// Where behaviours are tried.
    pub world: W,
    /// The division of the joints.
    pub grid: Grid,
    /// What the motion is for.
    pub task: Task,
    /// The task as a function that scores motion.
    pub objective: Objective,
    /// The learner's parameters.
    pub parameters: Parameters,
    /// Seed of all randomness.
    pub seed: u64,
}

/// What changes from generation to generation.
struct Progress<S> {
    /// Number of generations done.
    generations: u32,
    islands: Vec<Island>,
    best: Option<Behaviour>,
    /// Every best behaviour so far, in the order in which they were found.
    improved: Vec<Behaviour>,
    curve: Vec<Generation>,
    totals: SimulationTotals,
    cache: Cache<S>,
    clock: Clock,
    /// What the clock showed when this run began.
    started: Duration,
    /// Time spent before this run was resumed, s.
    spent: f64,
}

impl<S> Progress<S> {
    /// s since the start of the search.
    fn elapsed(&self) -> f64 {
        self.spent + self.clock.since(self.started)
    }
}

/// An individual to be evaluated: index of its island, index on the island, genome.
type Candidate = (usize, usize, Genome);

impl<W: World> Search<W> {
    /// Runs the search on the threads of `pool`, from `resume` if given, until the budget is used up or
    /// `stop` asks to.
    pub fn run(
        &self,
        pool: &ThreadPool,
        observer: &mut dyn Observer,
        stop: &Stop,
        resume: Option<Checkpoint>,
    ) -> Learned {
        let mut progress = self.begin(stop.clock(), resume);
        let ended = loop {
            if self.parameters.budget.generations().is_some_and(|most| progress.generations >= most) {
                break StopReason::Generations;
            }
            let judged = self.ask(&progress, stop).and_then(|candidates| {
                let verdicts = self.evaluate(pool, &progress, &candidates, stop)?;
                Ok((candidates, verdicts))
            });
            match judged {
                Ok((candidates, verdicts)) => self.tell(&mut progress, candidates, verdicts, observer),
                Err(Interrupted(reason)) => break reason,
            }
            if progress.generations.is_multiple_of(self.parameters.cache_generations) {
                progress.cache.clear();
                observer.checkpoint(&self.checkpoint(&progress));
            }
        };
        let Progress { best, curve, .. } = progress;
        Learned { ended, best, curve, parameters: self.parameters.clone() }
    }

    fn begin(&self, clock: &Clock, resume: Option<Checkpoint>) -> Progress<W::State> {
        let parameters = &self.parameters;
        let islands = vec![Island::default(); parameters.islands];
        let mut progress = Progress {
            generations: 0,
            islands,
            best: None,
            improved: Vec::new(),
            curve: Vec::new(),
            totals: SimulationTotals::default(),
            cache: Cache::new(parameters.cache_transitions),
            clock: clock.clone(),
            started: clock.now(),
            spent: 0.0,
        };
        if let Some(checkpoint) = resume {
            progress.generations = checkpoint.generations;
            progress.islands = checkpoint.islands;
            progress.best = checkpoint.best;
            progress.improved = checkpoint.improved;
            progress.curve = checkpoint.curve;
            progress.totals = checkpoint.totals;
            progress.spent = checkpoint.elapsed;
        }
        progress
    }

    /// The genomes of the next generation.
    fn ask(&self, progress: &Progress<W::State>, stop: &Stop) -> Result<Vec<Candidate>, Interrupted> {
        let (parameters, generation) = (&self.parameters, progress.generations);
        let mut asked = Vec::new();
        for (index, island) in progress.islands.iter().enumerate() {
            stop.check()?;
            let genomes = match parameters.coding {
                Coding::Chromosome => island.ask(&self.grid, parameters, self.seed, generation, index),
                Coding::Population => {
                    let ways = (&self.grid, parameters);
                    vec![population::next_subset(&island.members, ways, self.seed, generation, index)]
                }
            };
            asked.extend(genomes.into_iter().enumerate().map(|(place, genome)| (index, place, genome)));
        }
        Ok(asked)
    }

    /// Evaluates all candidates in parallel and independently; the verdicts are in the order of the candidates.
    fn evaluate(
        &self,
        pool: &ThreadPool,
        progress: &Progress<W::State>,
        candidates: &[Candidate],
        stop: &Stop,
    ) -> Result<Vec<IndividualVerdict<W::State>>, Interrupted> {
        let context = SearchContext {
            grid: &self.grid,
            objective: &self.objective,
            parameters: &self.parameters,
            stop,
        };
        let mut verdicts: Vec<IndividualVerdict<W::State>> = pool.install(|| {
            let judged = candidates.par_iter().with_max_len(1).map_init(
                || self.world.clone(),
                |world, (island, place, genome)| {
                    let generation = progress.generations;
                    let mut rng = stream(self.seed, Purpose::Episodes, generation, *island, *place);
                    let incumbent = progress.islands[*island].accepted.as_deref();
                    let verdict =
                        judge(context, world, &progress.cache, genome, (generation, incumbent), &mut rng);
                    stop.count();
                    verdict
                },
            );
            judged.collect::<Result<_, Interrupted>>()
        })?;
        // Of an island that has nothing proven yet, the best is given the whole check.
        let mut best: Vec<Option<(usize, f64)>> = vec![None; progress.islands.len()];
        for (index, ((island, ..), verdict)) in candidates.iter().zip(&verdicts).enumerate() {
            let leads = best[*island].is_none_or(|(_, fitness)| verdict.fitness > fitness);
            if verdict.candidate.is_some() && leads {
                best[*island] = Some((index, verdict.fitness));
            }
        }
        let chosen: Vec<usize> = best.into_iter().flatten().map(|(index, _)| index).collect();
        let proving = verdicts.iter_mut().enumerate().filter(|(index, _)| chosen.contains(index));
        let proving: Vec<_> = proving.map(|(_, verdict)| verdict).collect();
        pool.install(|| {
            let proven = proving.into_par_iter().with_max_len(1);
            proven
                .map_init(|| self.world.clone(), |world, verdict| prove(context, world, verdict))
                .collect::<Result<(), Interrupted>>()
        })?;
        self.measured_by_the_proven(candidates, &mut verdicts);
        Ok(verdicts)
    }

    /// Those that went no further than the first inspection are as far from the behaviour of their island that passed the
    /// whole check as they were then.
    fn measured_by_the_proven(&self, candidates: &[Candidate], verdicts: &mut [IndividualVerdict<W::State>]) {
        for island in 0..self.parameters.islands {
            let own = || candidates.iter().enumerate().filter(|(_, (other, ..))| *other == island);
            let proven = own().find_map(|(index, _)| verdicts[index].accepted.as_ref());
            let Some((&first, &last)) =
                proven.and_then(|proven| proven.inspections.first().zip(proven.inspections.last()))
            else {
                continue;
            };
            for (index, _) in own() {
                if verdicts[index].candidate.is_some() {
                    verdicts[index].fitness += last - first;
                }
            }
        }
    }

    /// Adds the verdicts to the progress, in the order of the candidates, and informs the observer.
    fn tell(
        &self,
        progress: &mut Progress<W::State>,
        candidates: Vec<Candidate>,
        verdicts: Vec<IndividualVerdict<W::State>>,
        observer: &mut dyn Observer,
    ) {
        let parameters = &self.parameters;
        let mut children: Vec<Vec<Individual>> = vec![Vec::new(); progress.islands.len()];
        let mut fitness = Vec::with_capacity(verdicts.len());
        let mut champion: Option<Behaviour> = None;
        for ((island, _, genome), verdict) in candidates.into_iter().zip(verdicts) {
            progress.cache.merge(verdict.additions);
            progress.totals += verdict.totals;
            if let Some(AcceptedBehaviour { behaviour, inspections }) = verdict.accepted {
                progress.islands[island].accept(&inspections);
                let best = champion.as_ref().or(progress.best.as_ref());
                if best.is_none_or(|best| behaviour.fitness > best.fitness) {
                    champion = Some(behaviour);
                }
            }
            fitness.push(verdict.fitness);
            match parameters.coding {
                Coding::Chromosome => children[island].push(Individual { genome, fitness: verdict.fitness }),
                Coding::Population => children[island] = population::members(&genome, &verdict.worths),
            }
        }
        for (island, children) in progress.islands.iter_mut().zip(children) {
            match parameters.coding {
                Coding::Chromosome => island.tell(children, parameters),
                Coding::Population => island.replace(children),
            }
        }
        if parameters.coding == Coding::Chromosome {
            // The elite counts, too.
            let members = progress.islands.iter().flat_map(|island| &island.members);
            fitness = members.map(|member| member.fitness).collect();
        }
        if (progress.generations + 1).is_multiple_of(parameters.migration) {
            migrate(&mut progress.islands);
        }
        if let Some(champion) = champion {
            observer.improved(&champion);
            progress.improved.push(champion.clone());
            progress.best = Some(champion);
        }
        let figures = self.figures(progress, &fitness);
        restart_stale(&mut progress.islands, parameters.patience);
        observer.generation(&figures);
        progress.curve.push(figures);
        progress.generations += 1;
    }

    /// `fitness` is that of all subsets of the generation.
    fn figures(&self, progress: &Progress<W::State>, fitness: &[f64]) -> Generation {
        let count = fitness.len().max(1) as f64;
        let mean = fitness.iter().sum::<f64>() / count;
        let variance = fitness.iter().map(|fitness| (fitness - mean).powi(2)).sum::<f64>() / count;
        let fittest = fitness.iter().copied().fold(f64::MIN, f64::max);
        Generation {
            generation: progress.generations,
            gait: None,
            best: progress.best.as_ref().map_or(fittest, |best| best.fitness),
            mean,
            spread: variance.sqrt(),
            cache_hit_rate: progress.totals.hit_rate(),
            simulated_seconds: progress.totals.seconds,
            saved_seconds: progress.totals.saved,
            elapsed: progress.elapsed(),
        }
    }

    fn checkpoint(&self, progress: &Progress<W::State>) -> Checkpoint {
        Checkpoint {
            seed: self.seed,
            learning: (&self.parameters).into(),
            task: self.task.clone(),
            generations: progress.generations,
            islands: progress.islands.clone(),
            best: progress.best.clone(),
            improved: progress.improved.clone(),
            curve: progress.curve.clone(),
            totals: progress.totals,
            elapsed: progress.elapsed(),
        }
    }
}
