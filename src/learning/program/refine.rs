//! A gait for a character at a speed: seeds from the force template, polished by CMA-ES.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};
use rayon::ThreadPool;
use rayon::prelude::*;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::TargetLimits;
use gaitwright_physics::scene::{Accuracy, Gains, Scene};
use gaitwright_physics::stance::Stance;

use super::cma::Cma;
use super::cost::{HOLDS, undisturbed, when_disturbed};
use super::figures::RolloutFigures;
use super::gains::gains;
use super::gaits::NamedGait;
use super::legs::Legs;
use super::ring::{PARAMETERS, Ring, SIDEWAYS, TURN, Wanted, program, ring};
use super::rollout::Arena;
use super::seeds::seeds;
use super::steer::{self, steering};
use super::wave::{self, WAVE_SIDEWAYS, WAVE_TURN, softness};
use crate::learn::{Interrupted, Stop};

/// Candidates of a generation: fixed, so that the result does not depend on the number of threads.
pub const CANDIDATES: usize = 16;
/// Generations in which candidates come in pairs where a search has few: a walk of 60 then costs a fifth less. Over 240 generations of
/// bounds the reach shrank to a hundredth, and of two searches one ended dearer than without pairs.
pub const PAIRED: u32 = 60;
/// Reach of the search at its start, in units of the parameters.
const SIGMA: f64 = 0.5;

/// How many of the best are compared over a longer run.
const FINALISTS: usize = 8;
/// How many of these have their ways set straight, by so many steps, which begin with this change of a parameter; not where turn
/// (rad a stride) and way aside (a share of the way) are less than this.
pub const STRAIGHTENED: usize = 4;
const TRIMS: u32 = 3;
const TRIM: f64 = 0.3;
const STRAIGHT: f64 = 0.001;
/// What a trim changes counts as rounding where it is less than this share of what it changes most.
const ROUNDING: f64 = 1e-9;

/// Who is to move, and where.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Who.
    pub model: Arc<Model>,
    /// How it stands.
    pub stance: Arc<Stance>,
    /// Its legs.
    pub legs: Arc<Legs>,
    /// Springs and dampers of its joints.
    pub gains: Gains,
    /// Where.
    pub scene: Scene,
    /// How finely that is simulated.
    pub accuracy: Accuracy,
    /// Wanted direction of travel in the world frame; only x and y count.
    pub direction: [f64; 3],
}

impl Subject {
    /// `model` as it stands in `stance`, with gains suited to gaits; `None` where it has neither legs in pairs nor joints in a row,
    /// or nothing pulls it down.
    pub fn new(
        model: &Arc<Model>,
        stance: &Arc<Stance>,
        scene: &Scene,
        accuracy: &Accuracy,
        direction: [f64; 3],
    ) -> Option<Self> {
        let legs = Legs::of(model, stance, direction).or_else(|| Legs::none(model, stance, direction))?;
        let legs = Arc::new(legs);
        let gravity = nalgebra::Vector3::from(scene.gravity).norm();
        let gains = (gravity > 0.0).then(|| gains(model, stance, &legs, gravity))?;
        let (model, stance) = (model.clone(), stance.clone());
        Some(Self { model, stance, legs, gains, scene: scene.clone(), accuracy: *accuracy, direction })
    }

    /// m/s².
    pub fn gravity(&self) -> f64 {
        nalgebra::Vector3::from(self.scene.gravity).norm()
    }

    /// The ring of keyframes that `parameters` mean, and the springs and dampers of the legs for it.
    pub fn ring(&self, wanted: &Wanted, parameters: &[f64]) -> (Ring, Gains) {
        let Self { model, legs, .. } = self;
        if let Some(spine) = &legs.spine {
            let gains = self.gains_times(softness(parameters));
            return (wave::ring(model, legs, spine, wanted, parameters), gains);
        }
        let program = program(legs, wanted, parameters);
        let gains = self.gains_times([program.stiffness, program.damping]);
        let mut own = ring(model, legs, &program, &gains, wanted);
        if parameters.len() > PARAMETERS {
            let of =
                |changed: &[f64]| ring(model, legs, &self::program(legs, wanted, changed), &gains, wanted);
            let [x, y, _] = self.direction;
            let direction = [x / x.hypot(y), y / x.hypot(y)];
            let limits = TargetLimits::of(&model.character);
            own.steering = Some(steering((legs, &limits), (wanted, direction), parameters, &own, of));
        }
        (own, gains)
    }

    /// The gains with other springs and dampers in the joints that move.
    fn gains_times(&self, [stiffness, damping]: [f64; 2]) -> Gains {
        let mut gains = self.gains.clone();
        for joint in self.legs.joints() {
            gains.stiffness[joint] *= stiffness;
            gains.damping[joint] *= damping;
        }
        gains
    }

    /// Indices of the parameters of the turn and of the way to the side.
    fn trims(&self) -> [usize; 2] {
        if self.legs.spine.is_some() { [WAVE_TURN, WAVE_SIDEWAYS] } else { [TURN, SIDEWAYS] }
    }

    /// Where a search for `gait` may start.
    pub fn seeds(&self, gait: &NamedGait) -> Vec<Vec<f64>> {
        if self.legs.spine.is_some() { wave::seeds() } else { seeds(gait) }
    }

    /// Whether its gaits can have feedback.
    pub fn can_steer(&self) -> bool {
        self.legs.spine.is_none()
    }

    /// Where its gaits are tried.
    ///
    /// # Errors
    /// Every fault of scene and accuracy.
    pub fn arena(&self) -> Result<Arena, InputError> {
        let who = (&self.model, &self.stance, &self.legs);
        Arena::new(who, &self.scene, &self.accuracy, self.direction)
    }
}

/// A gait and what it costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Of the leg program.
    pub parameters: Vec<f64>,
    /// The same in keyframes.
    pub ring: Ring,
    /// Springs and dampers that go with it.
    pub gains: Gains,
    /// What it did.
    pub figures: RolloutFigures,
    /// What it did under each disturbance.
    pub disturbed: Vec<RolloutFigures>,
    /// Less is better (see [`cost`](super::cost::cost)).
    pub cost: f64,
}

impl Candidate {
    /// The gait of `parameters`, tried over `strides` strides without any disturbance: its cost is the least that it can be.
    fn undisturbed(
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        parameters: &[f64],
        strides: usize,
    ) -> Self {
        let (ring, gains) = subject.ring(wanted, parameters);
        let figures = arena.run(&ring, &gains, strides);
        let disturbed = Vec::new();
        let mut tried = Self { parameters: parameters.to_vec(), ring, gains, figures, disturbed, cost: 0.0 };
        tried.cost = tried.least_cost(subject, wanted);
        tried
    }

    /// What it costs without what a disturbance takes from it.
    fn least_cost(&self, subject: &Subject, wanted: &Wanted) -> f64 {
        let Self { parameters, ring, figures, .. } = self;
        // Parameters far out make sense to nobody; the pull back to the seed is weak.
        let far = 0.01 * parameters.iter().map(|p| (p.abs() - 3.0).max(0.0).powi(2)).sum::<f64>();
        let missed = 5.0 * ring.missed / subject.legs.length;
        undisturbed(wanted, ring.period, &subject.legs, figures) + far + missed
    }

    /// The same after it was disturbed, too.
    fn disturbed(mut self, arena: &Arena, strides: usize) -> Self {
        self.disturbed = arena.run_disturbed(&self.figures, &self.ring, &self.gains, strides);
        self.cost += when_disturbed(&self.figures, &self.disturbed);
        self
    }

    /// s simulated for it.
    pub fn seconds(&self) -> f64 {
        self.figures.seconds + self.disturbed_seconds()
    }

    /// s simulated for it while it was disturbed.
    fn disturbed_seconds(&self) -> f64 {
        self.disturbed.iter().map(|disturbed| disturbed.seconds).sum()
    }
}

/// Tries the gait of `parameters` over `strides` strides.
pub fn evaluate(
    subject: &Subject,
    arena: &Arena,
    wanted: &Wanted,
    parameters: &[f64],
    strides: usize,
) -> Candidate {
    Candidate::undisturbed(subject, arena, wanted, parameters, strides).disturbed(arena, strides)
}

/// The same with its way set straight, and s simulated for that.
///
/// # Errors
/// The reason of `stop` to break off.
pub fn evaluate_straightened(
    stop: &Stop,
    subject: &Subject,
    arena: &Arena,
    wanted: &Wanted,
    parameters: &[f64],
    strides: usize,
) -> Result<(Candidate, f64), Interrupted> {
    let trial = Trial { subject, arena, wanted, strides, stop };
    let start = trial.run(parameters)?;
    let seconds = start.seconds();
    let (straight, tried) = trial.straightened(start)?;
    Ok((straight, seconds + tried.iter().map(Candidate::seconds).sum::<f64>()))
}

/// What speaks against a start: its cost, but what hardly breaks a constraint is not behind all that hold them, since the search soon
/// mends that.
fn promise(start: &Candidate) -> f64 {
    if start.cost >= HOLDS { start.cost - HOLDS } else { start.cost }
}

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
    /// Strides over which candidates are tried.
    strides: usize,
}

impl Refinement {
    /// Starts from the best of `starts` (see [`Subject::seeds`]), of which there is at least one; candidates are tried over so many
    /// strides, and come in pairs in so many generations ([`PAIRED`] where the search is short).
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn new(
        (pool, stop): (&ThreadPool, &Stop),
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        starts: &[Vec<f64>],
        (strides, paired, seed): (usize, u32, u64),
    ) -> Result<Self, Interrupted> {
        let mut tried: Vec<Candidate> = pool.install(|| {
            let tried = starts.par_iter().with_max_len(1);
            let one =
                |parameters: &Vec<f64>| stop.whole(|| evaluate(subject, arena, wanted, parameters, strides));
            tried.map(one).collect::<Result<_, Interrupted>>()
        })?;
        let seconds = tried.iter().map(Candidate::seconds).sum();
        let evaluations = tried.len();
        let costs = tried.iter().map(|candidate| candidate.cost).collect();
        tried.sort_by(|a, b| promise(a).total_cmp(&promise(b)));
        tried.truncate(1);
        let search = Cma::new(&tried[0].parameters, SIGMA, CANDIDATES, seed).paired(paired);
        Ok(Self { kept: tried, costs, evaluations, seconds, search, strides })
    }

    /// How far the search reaches at present, in units of the parameters.
    pub fn search_sigma(&self) -> f64 {
        self.search.sigma()
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
        let tried: Vec<Candidate> = pool.install(|| {
            let one = |parameters: &Vec<f64>| {
                let tried = || Candidate::undisturbed(subject, arena, wanted, parameters, strides);
                let candidate = stop.whole(tried)?;
                stop.count();
                Ok(candidate)
            };
            asked.par_iter().with_max_len(1).map(one).collect::<Result<_, Interrupted>>()
        })?;
        // Only parents have an influence on the search, so only the better half is disturbed.
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
            kept.cost = kept.least_cost(subject, wanted) + when_disturbed(&kept.figures, &kept.disturbed);
        }
        self.kept.sort_by(|a, b| a.cost.total_cmp(&b.cost));
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
        let trial = Trial { subject, arena, wanted, strides, stop };
        let mut tried: Vec<Candidate> = pool.install(|| {
            let try_long = |candidate: &Candidate| trial.run(&candidate.parameters);
            self.kept.par_iter().with_max_len(1).map(try_long).collect::<Result<_, Interrupted>>()
        })?;
        self.count(&tried);
        // Their drift will be mended, so it does not count yet.
        let straight = |candidate: &Candidate| {
            let figures = RolloutFigures { yaw: 0.0, sideways: 0.0, ..candidate.figures.clone() };
            undisturbed(wanted, candidate.ring.period, &subject.legs, &figures)
                + when_disturbed(&candidate.figures, &candidate.disturbed)
        };
        tried.sort_by(|a, b| straight(a).total_cmp(&straight(b)));
        tried.truncate(STRAIGHTENED);
        let trims: Vec<(Candidate, Vec<Candidate>)> = pool.install(|| {
            let trims = tried.into_par_iter().with_max_len(1);
            trims.map(|candidate| trial.straightened(candidate)).collect::<Result<_, Interrupted>>()
        })?;
        let mut finalists = Vec::new();
        for (best, tried) in trims {
            self.count(&tried);
            finalists.push(best);
        }
        finalists.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(finalists)
    }

    /// About as many seconds as [`Refinement::finalists`] simulates.
    pub fn seconds_of_finalists(&self, strides: usize) -> f64 {
        let tries = 3 * FINALISTS + STRAIGHTENED * (2 + TRIMS as usize);
        let Ring { period, .. } = self.best().ring;
        tries as f64 * (self.best().ring.lead() + strides as f64 * period)
    }

    fn count(&mut self, tried: &[Candidate]) {
        self.evaluations += tried.len();
        self.seconds += tried.iter().map(Candidate::seconds).sum::<f64>();
    }
}

/// The inverse of what the trims do; where one direction does nothing, the least change that does the rest.
fn inverse(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let parts = matrix.iter().all(|entry| entry.is_finite()).then(|| matrix.svd(true, true))?;
    let least = ROUNDING * parts.singular_values.max();
    parts.pseudo_inverse(least).ok()
}

/// Where and for how long candidates are tried.
struct Trial<'a> {
    subject: &'a Subject,
    arena: &'a Arena,
    wanted: &'a Wanted,
    strides: usize,
    stop: &'a Stop,
}

impl Trial<'_> {
    fn run(&self, parameters: &[f64]) -> Result<Candidate, Interrupted> {
        self.stop.whole(|| evaluate(self.subject, self.arena, self.wanted, parameters, self.strides))
    }

    /// `start` with its way set straight by trimming its turn and its way to the side, as far as that helps, and all that was
    /// tried for it: Newton's method on the change of heading in a stride and the way aside, its matrix mended by every
    /// try (Broyden 1965).
    fn straightened(&self, start: Candidate) -> Result<(Candidate, Vec<Candidate>), Interrupted> {
        // Feedback holds the heading against the trims: what they change of it is the heading that it holds, and with that the way.
        let held = steer::holds_heading(&start.parameters);
        let off = |candidate: &Candidate| {
            let RolloutFigures { yaw, sideways, .. } = candidate.figures;
            Vector2::new(if held { 0.0 } else { yaw }, sideways)
        };
        let moved = |change: Vector2<f64>, from: &Candidate| {
            let mut parameters = from.parameters.clone();
            let [turn, sideways] = self.subject.trims();
            parameters[turn] += change.x;
            parameters[sideways] += change.y;
            let Self { subject, arena, wanted, strides, stop } = *self;
            let tried = || Candidate::undisturbed(subject, arena, wanted, &parameters, strides);
            let mut moved = stop.whole(tried)?;
            // So small a change does not alter what a disturbance does.
            moved.cost += when_disturbed(&start.figures, &start.disturbed);
            let counted = |of: &RolloutFigures| RolloutFigures { seconds: 0.0, ..of.clone() };
            let disturbed = start.disturbed.iter().map(counted).collect();
            Ok(Candidate { disturbed, ..moved })
        };
        if off(&start).amax() < STRAIGHT {
            return Ok((start, Vec::new()));
        }
        let tries = [Vector2::x() * TRIM, Vector2::y() * TRIM];
        let mut tried =
            tries.iter().map(|&change| moved(change, &start)).collect::<Result<Vec<_>, Interrupted>>()?;
        let slopes = tried.iter().map(|tried| (off(tried) - off(&start)) / TRIM).collect::<Vec<_>>();
        let mut matrix = Matrix2::from_columns(&slopes);
        let mut now = start.clone();
        for _ in 0..TRIMS {
            let Some(inverse) = inverse(&matrix) else { break };
            let change = (-inverse * off(&now)).map(|change| change.clamp(-1.0, 1.0));
            let next = moved(change, &now)?;
            let missed = off(&next) - off(&now) - matrix * change;
            matrix += missed * change.transpose() / change.norm_squared().max(f64::MIN_POSITIVE);
            now = next.clone();
            tried.push(next);
        }
        let best = tried.iter().fold(&start, |best, tried| if tried.cost < best.cost { tried } else { best });
        Ok((best.clone(), tried))
    }
}
