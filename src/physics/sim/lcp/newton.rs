//! Newton's method on the natural map, with Gauss-Seidel sweeps where it does not lead on.
//!
//! Once the rows at their bounds are found, one Newton step solves the problem to rounding
//! (for circular cones a few, for their rim is curved); and between two time steps this active set seldom changes.
//! A wrong active set corrects itself in most cases (Alart & Curnier 1991; Hintermüller, Ito & Kunisch
//! 2003), but can go in circles. Then sweeps of projected Gauss-Seidel, twice as many each time, bring the
//! next active set nearer.
//!
//! Before that, where the first steps do not lead on, the problem is approached by proximal-point steps: rows that depend on each
//! other (a character on more points than it has freedoms, or with joints that dry friction holds) leave many
//! solutions, and the active sets that Newton's method meets contradict each other.
//!
//! Neither may lead on where many contacts press a mechanism with one or two freedoms left: few of the many active sets
//! are consistent. What is left unsolved then is given to the
//! pivoting method, with the pyramid for the cone, and the Newton steps start again from what it finds. What is still unsolved is
//! approached by a splitting method, which converges slowly but hardly ever goes astray: Newton steps and proximal-point steps from
//! its points, ever farther apart, find the solution to rounding.
//!
//! What that leaves unsolved is tried once more from no force at all, for the forces of the last time step may lead astray.
//!
//! A problem that has no solution leaves forces without bound that hardly differ in what they leave of it. Then rows that yield
//! a little take their place: a problem whose forces are unique and bounded.

use super::active::{self, ActiveSet, NewtonStep};
use super::lemke::Lemke;
use super::pgs::Sweeper;
use super::problem::{Problem, Solution, SolveStatus, Solver};
use super::proximal::{Nearby, longest_way};
use super::residual::{NEGLIGIBLE, evaluate, is_beyond_numbers, project};
use super::splitting::Splitting;

/// Newton steps that may fail to lessen the residual before sweeps take over. To allow as many again after each that lessens it left no
/// fewer of 30,000 random steps unsolved, and two of a collapse instead of one.
const PATIENCE: u32 = 3;

/// Most rows of a problem that is given to the pivoting method, whose tableau grows with their square.
const MOST_PIVOTED: usize = 36;

/// Most pivots; it takes about as many as the problem has rows.
const PIVOTS: u32 = 150;

/// A residual that is greater than the tolerance by less than this is not worth pivoting, nor rows that yield: the next time step
/// starts from the forces found in this one.
const NEARLY: f64 = 1e3;

/// Shares ε of A's diagonal in the proximal terms: the first, and the least and the greatest that are tried.
const FIRST_SHARE: f64 = 1e-3;
const LEAST_SHARE: f64 = 1e-8;
const GREATEST_SHARE: f64 = 10.0;

/// Most Newton steps in proximal steps, as a multiple of those allowed otherwise.
const APPROACH: u32 = 4;

/// Iterations of the splitting method before the first of its points is tried, the ratio from one to the next, and how many
/// are tried.
const FIRST_SPLIT: u32 = 20;
const SPLIT_GROWTH: u32 = 2;
const SPLITS: u32 = 9;

/// When splitting is given up. On a convex problem that has a solution the method's error falls at least as the inverse of its
/// iterations (He & Yuan 2012), which every round doubles: by this share in a round, if not in each then over some. Where a
/// problem has none, the residual stays and the forces grow in proportion to the iterations (Banjac, Goulart, Stellato & Boyd
/// 2019): by this factor in a round, and in as many in a row as make chance unlikely.
const SLOWEST: f64 = 0.5;
const STALE_ROUNDS: u32 = 5;
const LEAST_GROWTH: f64 = 1.5;
const GROWING_ROUNDS: u32 = 3;

/// Shares ε of A's diagonal by which rows yield to their forces where a problem is not solved, and how many times the residual may
/// be that of those forces.
const YIELDING_SHARES: [f64; 5] = [1e-3, 1e-2, 0.1, 1.0, 10.0];
const YIELDING_LOSS: f64 = 2.0;

/// Forces are great that are ten times those of rows that yield, by their squares.
const MUCH_SMALLER: f64 = 0.01;

/// A point found by splitting is taken if it leaves no more than this share of the residual: rows that contradict each other
/// have forces without bound that leave hardly less.
const WORTH: f64 = 0.1;

/// Semi-smooth Newton method, warm-started, with projected Gauss-Seidel and Lemke's method behind it.
#[derive(Debug, Clone)]
pub struct Newton {
    iterations: u32,
    tolerance: f64,
    sweeper: Sweeper,
    active: ActiveSet,
    /// n each.
    velocity: Vec<f64>,
    trial: Vec<f64>,
    before: Vec<f64>,
    start: Vec<f64>,
    /// See `approach`.
    nearby: Nearby,
    point: Vec<f64>,
    pivoting: Lemke,
    splitting: Splitting,
    /// n.
    pivoted: Vec<f64>,
    /// n. See `afresh`.
    fresh: Vec<f64>,
}

impl Newton {
    /// At most `iterations` Newton steps, four times as many in proximal steps, as many sweeps and Newton steps together, and
    /// those again after pivoting; fewer when the residual falls to `tolerance` (m/s or rad/s) before.
    pub fn new(iterations: u32, tolerance: f64) -> Self {
        Self {
            iterations,
            tolerance,
            sweeper: Sweeper::default(),
            active: ActiveSet::default(),
            velocity: Vec::new(),
            trial: Vec::new(),
            before: Vec::new(),
            start: Vec::new(),
            nearby: Nearby::default(),
            point: Vec::new(),
            pivoting: Lemke::new(PIVOTS),
            splitting: Splitting::default(),
            pivoted: Vec::new(),
            fresh: Vec::new(),
        }
    }

    /// Proximal-point steps from `lambda`, whose residual is `residual`; both are left at the best point. Returns how many
    /// Newton steps that took.
    ///
    /// Each solves the problem with A + ε D in place of A and b − ε D λ in place of b, where D is A's diagonal and λ the last
    /// step's point (Rockafellar 1976). Rows that depend on each other leave it one solution, which Newton's method finds from
    /// nearby; where it does not, ε grows. The steps end at a solution of the problem itself, for the difference, ε D times
    /// their length, tends to zero.
    ///
    /// Where rows depend on each other and their velocities contradict each other by δ, a step only shifts their forces, by
    /// δ / ε, until one of them reaches a bound. It is prolonged to there.
    fn approach(&mut self, problem: &Problem<'_>, lambda: &mut [f64], residual: &mut f64) -> u32 {
        let mut nearby = std::mem::take(&mut self.nearby);
        let mut point = std::mem::take(&mut self.point);
        point.clear();
        point.extend_from_slice(lambda);
        let (mut share, mut before, mut failed) = (FIRST_SHARE, *residual, false);
        let mut taken = 0;
        while *residual > self.tolerance && taken < APPROACH * self.iterations && share <= GREATEST_SHARE {
            nearby.pose(problem, &point, share);
            let shifted = Problem { matrix: &nearby.matrix, offset: &nearby.offset, ..*problem };
            self.trial.clear();
            self.trial.extend_from_slice(&point);
            let mut left = evaluate(&shifted, &self.trial, &mut self.velocity);
            nearby.solution.clear();
            nearby.solution.extend_from_slice(&point);
            let (steps, _) = self.walk(&shifted, &mut nearby.solution, &mut left, self.iterations);
            taken += steps.max(1);
            if left > self.tolerance {
                (share, failed) = (10.0 * share, true);
                continue;
            }
            let mut reached = evaluate(problem, &nearby.solution, &mut self.velocity);
            if reached > 0.5 * before && share <= FIRST_SHARE && !failed {
                let way = longest_way(problem, &point, &nearby.solution);
                for (force, from) in nearby.solution.iter_mut().zip(&point) {
                    *force = from + way * (*force - from);
                }
                project(problem, &mut nearby.solution);
                reached = evaluate(problem, &nearby.solution, &mut self.velocity);
            } else if !failed {
                share = (0.1 * share).max(LEAST_SHARE);
            }
            (before, failed) = (reached, false);
            point.copy_from_slice(&nearby.solution);
            if reached < *residual {
                *residual = reached;
                lambda.copy_from_slice(&point);
            }
        }
        self.nearby = nearby;
        self.point = point;
        taken
    }

    /// Newton steps from the present point for as long as they lead on, at most `most`. `lambda` and `residual` are
    /// those of the best point so far, and are kept up. Returns how many were taken, and whether the equations
    /// of an active set contradicted each other.
    fn walk(
        &mut self,
        problem: &Problem<'_>,
        lambda: &mut [f64],
        residual: &mut f64,
        most: u32,
    ) -> (u32, bool) {
        self.start.clear();
        self.start.extend_from_slice(lambda);
        let before = *residual;
        let mut patience = PATIENCE;
        let mut taken = 0;
        while *residual > self.tolerance && taken < most && patience > 0 {
            taken += 1;
            match active::step(&mut self.active, problem, &mut self.trial, &mut self.velocity) {
                NewtonStep::Taken { residual: stepped } if stepped < *residual => {
                    *residual = stepped;
                    lambda.copy_from_slice(&self.trial);
                }
                NewtonStep::Taken { residual: stepped } if stepped.is_finite() => patience -= 1,
                NewtonStep::Taken { .. } | NewtonStep::Singular => patience = 0,
                NewtonStep::Contradiction => {
                    // Earlier steps may have gone far along the contradiction.
                    *residual = before;
                    lambda.copy_from_slice(&self.start);
                    return (taken, true);
                }
            }
        }
        (taken, false)
    }

    /// Newton steps and, where they do not lead on, sweeps from `lambda`, whose residual is `residual`; both are
    /// left at the best point. Returns how many steps and sweeps that took, and whether the last active set
    /// was a contradiction.
    fn search(&mut self, problem: &Problem<'_>, lambda: &mut [f64], residual: &mut f64) -> (u32, bool) {
        self.trial.clear();
        self.trial.extend_from_slice(lambda);
        let mut contradiction = false;
        let mut iterations = 0;
        let mut sweeps = 0;
        // `lambda` is the best point so far and `trial` the present one.
        while *residual > self.tolerance && iterations < self.iterations {
            if sweeps > 0 {
                let allowed = sweeps.min(self.iterations - iterations);
                iterations += allowed;
                self.trial.copy_from_slice(lambda);
                let swept = self.sweep(problem, allowed);
                // Equal is progress too: the residual of a contradiction hides what the other rows gain.
                if swept <= *residual {
                    *residual = swept;
                    lambda.copy_from_slice(&self.trial);
                }
            }
            sweeps = if sweeps == 0 { 1 } else { 2 * sweeps };
            if iterations < self.iterations {
                let taken;
                (taken, contradiction) = self.walk(problem, lambda, residual, self.iterations - iterations);
                iterations += taken;
            }
        }
        (iterations, contradiction)
    }

    /// Newton steps and proximal-point steps from points of the splitting method, which starts from `lambda`, whose residual is
    /// `residual`; both are left at the best point that is worth taking. Returns how many steps and iterations that took.
    fn split(&mut self, problem: &Problem<'_>, lambda: &mut [f64], residual: &mut f64) -> u32 {
        let mut splitting = std::mem::take(&mut self.splitting);
        let mut found = std::mem::take(&mut self.pivoted);
        evaluate(problem, lambda, &mut self.velocity);
        splitting.begin(problem, lambda, &self.velocity);
        let (mut taken, mut least) = (0, WORTH * *residual);
        let mut given_up = Futility::default();
        for round in 0..SPLITS {
            let count = FIRST_SPLIT * SPLIT_GROWTH.pow(round);
            splitting.iterate(problem, count);
            found.clear();
            found.extend_from_slice(splitting.point());
            project(problem, &mut found);
            let mut left = evaluate(problem, &found, &mut self.velocity);
            if !left.is_finite() || given_up.after(left, splitting.point()) {
                break;
            }
            self.trial.clear();
            self.trial.extend_from_slice(&found);
            let (steps, _) = self.walk(problem, &mut found, &mut left, self.iterations);
            taken += count + steps;
            if left > self.tolerance {
                taken += self.approach(problem, &mut found, &mut left);
            }
            if left < least || left <= self.tolerance {
                (least, *residual) = (left, left);
                lambda.copy_from_slice(&found);
            }
            if *residual <= self.tolerance {
                break;
            }
        }
        self.splitting = splitting;
        self.pivoted = found;
        taken
    }

    /// Newton steps, proximal-point steps, sweeps and splitting from no force at all: where many rows depend on each other, the forces of the last
    /// time step, if they were not a solution then, may lead astray in every step after it. `lambda` and `residual` are replaced where
    /// that leaves less. Returns how many steps, sweeps and iterations that took.
    fn afresh(&mut self, problem: &Problem<'_>, lambda: &mut [f64], residual: &mut f64) -> u32 {
        let mut found = std::mem::take(&mut self.fresh);
        found.clear();
        found.resize(problem.rows(), 0.0);
        project(problem, &mut found);
        let mut left = evaluate(problem, &found, &mut self.velocity);
        self.trial.clone_from(&found);
        let (mut taken, _) = self.walk(problem, &mut found, &mut left, self.iterations);
        if left > self.tolerance {
            taken += self.approach(problem, &mut found, &mut left);
        }
        if left > self.tolerance {
            evaluate(problem, &found, &mut self.velocity);
            taken += self.search(problem, &mut found, &mut left).0;
        }
        if left > self.tolerance && problem.cone {
            taken += self.split(problem, &mut found, &mut left);
        }
        if left < *residual {
            *residual = left;
            lambda.copy_from_slice(&found);
        }
        self.fresh = found;
        taken
    }

    /// Forces in place of `lambda`, which are not a solution but great: those of rows that yield by a share ε of A's diagonal D,
    /// in units of force. With the least ε that is solved for, 10⁻³ in most cases, they satisfy
    /// ε λᵀ D λ ≤ −bᵀ λ, for λᵀ w ≤ 0 and A is semidefinite, and with it ‖D^½ λ‖ ≤ ‖D^-½ b‖ / ε. They are taken where they are much smaller and leave
    /// hardly more of the problem than `residual`, and in any case where numbers cannot show what `lambda` leaves.
    fn yielding(&mut self, problem: &Problem<'_>, lambda: &mut [f64], residual: &mut f64) {
        let square = |forces: &[f64]| -> f64 {
            let diagonal = problem.matrix.iter().step_by(forces.len() + 1);
            diagonal.zip(forces).map(|(a, force)| a * force * force).sum()
        };
        let mut nearby = std::mem::take(&mut self.nearby);
        let mut start = std::mem::take(&mut self.point);
        start.clear();
        start.resize(lambda.len(), 0.0);
        project(problem, &mut start);
        let mut solved = false;
        for share in YIELDING_SHARES {
            nearby.pose(problem, &start, share);
            let yielding = Problem { matrix: &nearby.matrix, offset: &nearby.offset, ..*problem };
            self.trial.clone_from(&start);
            nearby.solution.clone_from(&start);
            let mut left = evaluate(&yielding, &self.trial, &mut self.velocity);
            self.walk(&yielding, &mut nearby.solution, &mut left, self.iterations);
            solved = left <= self.tolerance;
            if solved {
                break;
            }
        }
        let mut left = evaluate(problem, &nearby.solution, &mut self.velocity);
        let smaller = square(&nearby.solution) < MUCH_SMALLER * square(lambda);
        let taken = solved && smaller && left <= YIELDING_LOSS * *residual
            || is_beyond_numbers(problem, lambda, self.tolerance, NEGLIGIBLE);
        if taken {
            *residual = left;
            lambda.copy_from_slice(&nearby.solution);
        }
        self.nearby = nearby;
        self.point = start;
        if taken {
            // Where there is a solution after all, it is near these forces.
            let mut found = std::mem::take(&mut self.pivoted);
            found.clear();
            found.extend_from_slice(lambda);
            self.approach(problem, &mut found, &mut left);
            let better = left <= self.tolerance
                || left * YIELDING_LOSS < *residual
                    && !is_beyond_numbers(problem, &found, self.tolerance, NEGLIGIBLE);
            if better {
                *residual = left;
                lambda.copy_from_slice(&found);
            }
            self.pivoted = found;
        }
    }

    /// The pivoting method's point in `pivoted`, and its residual.
    fn pivot(&mut self, problem: &Problem<'_>) -> f64 {
        self.pivoted.resize(problem.rows(), 0.0);
        self.pivoting.solve(&Problem { cone: false, ..*problem }, &mut self.pivoted);
        project(problem, &mut self.pivoted);
        evaluate(problem, &self.pivoted, &mut self.velocity)
    }

    /// Sweeps the present point `count` times, each time only half-way: friction can make whole sweeps
    /// go round in circles. Returns its residual.
    fn sweep(&mut self, problem: &Problem<'_>, count: u32) -> f64 {
        self.sweeper.prepare(problem);
        for _ in 0..count {
            self.before.clear();
            self.before.extend_from_slice(&self.trial);
            self.sweeper.sweep(problem, &mut self.trial);
            for (force, before) in self.trial.iter_mut().zip(&self.before) {
                *force = 0.5 * (*force + before);
            }
        }
        project(problem, &mut self.trial);
        evaluate(problem, &self.trial, &mut self.velocity)
    }
}

/// Whether the rounds of the splitting method lead nowhere.
#[derive(Debug)]
struct Futility {
    /// The residual that the last round had to undercut, m/s or rad/s.
    least: f64,
    /// Rounds since one did.
    stale: u32,
    /// The greatest force of the last round, N or N m.
    reach: f64,
    /// Rounds in a row in which it grew and the residual did not fall.
    growing: u32,
}

impl Default for Futility {
    fn default() -> Self {
        Self { least: f64::INFINITY, stale: 0, reach: f64::INFINITY, growing: 0 }
    }
}

impl Futility {
    /// Judges a round that ended at the forces `point` with `residual`.
    fn after(&mut self, residual: f64, point: &[f64]) -> bool {
        let falls = residual <= SLOWEST * self.least;
        self.stale = if falls { 0 } else { self.stale + 1 };
        if falls || self.least.is_infinite() {
            self.least = residual;
        }
        let reach = point.iter().fold(0.0_f64, |reach, force| reach.max(force.abs()));
        self.growing = if !falls && reach >= LEAST_GROWTH * self.reach { self.growing + 1 } else { 0 };
        self.reach = reach;
        self.growing == GROWING_ROUNDS || self.stale == STALE_ROUNDS
    }
}

impl Solver for Newton {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        if let Some(status) = problem.refusal(lambda) {
            return Solution::refused(status);
        }
        project(problem, lambda);
        self.velocity.resize(problem.rows(), 0.0);
        let mut residual = evaluate(problem, lambda, &mut self.velocity);
        if !residual.is_finite() {
            return Solution::refused(SolveStatus::NotFinite);
        }
        self.trial.clear();
        self.trial.extend_from_slice(lambda);
        let (mut iterations, mut contradiction) = self.walk(problem, lambda, &mut residual, self.iterations);
        if residual <= problem.enough && !is_beyond_numbers(problem, lambda, problem.enough, NEGLIGIBLE) {
            return Solution { status: SolveStatus::Solved, iterations, residual };
        }
        if residual > self.tolerance {
            iterations += self.approach(problem, lambda, &mut residual);
        }
        if residual > self.tolerance {
            evaluate(problem, lambda, &mut self.velocity);
            let more;
            (more, contradiction) = self.search(problem, lambda, &mut residual);
            iterations += more;
        }
        if residual > NEARLY * self.tolerance && problem.rows() <= MOST_PIVOTED {
            let mut found = self.pivot(problem);
            if found.is_finite() {
                let mut pivoted = std::mem::take(&mut self.pivoted);
                let (more, contradicted) = self.search(problem, &mut pivoted, &mut found);
                iterations += more;
                if found < residual {
                    (residual, contradiction) = (found, contradicted);
                    lambda.copy_from_slice(&pivoted);
                }
                self.pivoted = pivoted;
            }
        }
        if residual > self.tolerance && problem.cone {
            let before = residual;
            iterations += self.split(problem, lambda, &mut residual);
            contradiction &= residual == before;
        }
        if residual > self.tolerance {
            iterations += self.afresh(problem, lambda, &mut residual);
        }
        // Forces whose velocities are lost in rounding leave a residual that says so.
        if residual > NEARLY * self.tolerance
            || residual > self.tolerance && is_beyond_numbers(problem, lambda, self.tolerance, NEGLIGIBLE)
        {
            self.yielding(problem, lambda, &mut residual);
        }
        let status = if residual <= self.tolerance {
            SolveStatus::Solved
        } else if contradiction {
            SolveStatus::Singular
        } else {
            evaluate(problem, lambda, &mut self.velocity);
            self.sweeper.prepare(problem);
            self.sweeper.verdict(problem, lambda, &self.velocity, residual, self.tolerance)
        };
        Solution { status, iterations, residual }
    }
}
