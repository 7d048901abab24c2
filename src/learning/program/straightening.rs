//! How the way of a gait is set straight.

use nalgebra::{Matrix2, Vector2};

use super::candidate::{Candidate, evaluate};
use super::cost::when_disturbed;
use super::figures::RolloutFigures;
use super::ring::Wanted;
use super::rollout::Arena;
use super::steer;
use super::subject::Subject;
use crate::learn::{Interrupted, Stop};

/// Most corrections by which a way is set straight.
pub const TRIMS: u32 = 4;
/// Change of each trim from which its first slope is taken, and the greatest at once, in units of the parameters.
const TRIM: f64 = 0.3;
const FARTHEST: f64 = 1.0;
/// A way is straight where it goes aside by less than this share of its length, both by turning and by itself.
const STRAIGHT: f64 = 0.005;
/// What going farther aside costs where the best of the tries is chosen: what turns by little soon goes aside by much.
const CROOKED: f64 = 500.0;
/// What a trim changes counts as rounding where it is less than this share of what it changes most.
const ROUNDING: f64 = 1e-9;

/// Where and for how long gaits are tried whose way is set straight.
#[derive(Debug, Clone, Copy)]
pub struct Straightening<'a> {
    /// Who is to move.
    pub subject: &'a Subject,
    /// Where.
    pub arena: &'a Arena,
    /// How.
    pub wanted: &'a Wanted,
    /// Over how many strides.
    pub strides: usize,
    /// What may break it off.
    pub stop: &'a Stop,
}

/// A gait whose way was set straight, as far as that helped.
#[derive(Debug, Clone)]
pub struct Straightened {
    /// The gait that costs least of those tried, where going aside has a price of its own.
    pub candidate: Candidate,
    /// Gaits tried for it, beside the one that it began with.
    pub evaluations: usize,
    /// s simulated for them.
    pub seconds: f64,
}

impl Straightening<'_> {
    /// The gait of `parameters` as it is, tried without any disturbance.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn undisturbed(&self, parameters: &[f64]) -> Result<Candidate, Interrupted> {
        let Self { subject, arena, wanted, strides, stop } = *self;
        stop.whole(|| Candidate::undisturbed(subject, arena, wanted, parameters, strides))
    }

    /// The gait of `parameters` as it is, tried also under disturbances.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn disturbed(&self, parameters: &[f64]) -> Result<Candidate, Interrupted> {
        let Self { subject, arena, wanted, strides, stop } = *self;
        stop.whole(|| evaluate(subject, arena, wanted, parameters, strides))
    }

    /// `start` with its way set straight by trimming its turn and its way to the side: Newton's method, its matrix mended by every try
    /// (Broyden 1965), with steps that become shorter where one did not help.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    pub fn straightened(&self, start: Candidate) -> Result<Straightened, Interrupted> {
        if self.off(&start).amax() < STRAIGHT {
            return Ok(Straightened { candidate: start, evaluations: 0, seconds: 0.0 });
        }
        let moved = |change: Vector2<f64>, from: &Candidate| self.trimmed(change, from, &start);
        let tries = [Vector2::x() * TRIM, Vector2::y() * TRIM];
        let mut tried =
            tries.iter().map(|&change| moved(change, &start)).collect::<Result<Vec<_>, Interrupted>>()?;
        let slopes =
            tried.iter().map(|tried| (self.off(tried) - self.off(&start)) / TRIM).collect::<Vec<_>>();
        let mut matrix = Matrix2::from_columns(&slopes);
        let mut now = start.clone();
        let mut farthest = FARTHEST;
        for _ in 0..TRIMS {
            let Some(inverse) = inverse(&matrix) else { break };
            let change = (-inverse * self.off(&now)).map(|change| change.clamp(-farthest, farthest));
            let next = moved(change, &now)?;
            let missed = self.off(&next) - self.off(&now) - matrix * change;
            matrix += missed * change.transpose() / change.norm_squared().max(f64::MIN_POSITIVE);
            let (before, after) = (self.off(&now).amax(), self.off(&next).amax());
            if after < before {
                now = next.clone();
            } else {
                farthest = 0.5 * change.amax();
            }
            let done = after < STRAIGHT || next.figures.upright < 1.0;
            tried.push(next);
            if done {
                break;
            }
        }
        let (evaluations, seconds) = (tried.len(), tried.iter().map(|tried| tried.figures.seconds).sum());
        let price = |tried: &Candidate| tried.cost + CROOKED * (self.off(tried).amax() - STRAIGHT).max(0.0);
        let better =
            |best: Candidate, tried: Candidate| if price(&tried) < price(&best) { tried } else { best };
        Ok(Straightened { candidate: tried.into_iter().fold(start, better), evaluations, seconds })
    }

    /// How far a gait goes aside, over the strides in which it was tried, because it turns, and how far by itself: shares of the way ahead.
    fn off(&self, candidate: &Candidate) -> Vector2<f64> {
        let RolloutFigures { yaw, sideways, .. } = candidate.figures;
        // Feedback holds the heading against the trims: what they change of it is the heading that it holds, and with that the way.
        let held = steer::holds_heading(&candidate.parameters);
        // The mean heading of a way that turns evenly is half of the last.
        let by_turning = if held { 0.0 } else { 0.5 * yaw * self.strides as f64 };
        Vector2::new(by_turning, sideways - by_turning)
    }

    /// `from` with its turn and its way to the side changed by so much; so small a change does not alter what disturbances did to `start`.
    fn trimmed(
        &self,
        change: Vector2<f64>,
        from: &Candidate,
        start: &Candidate,
    ) -> Result<Candidate, Interrupted> {
        let mut parameters = from.parameters.clone();
        let [turn, sideways] = self.subject.trims();
        parameters[turn] += change.x;
        parameters[sideways] += change.y;
        let tried = self.undisturbed(&parameters)?;
        let cost = tried.cost + when_disturbed(&start.figures, &start.disturbed);
        Ok(Candidate { disturbed: start.disturbed.clone(), cost, ..tried })
    }
}

/// The inverse of what the trims do; where one direction does nothing, the least change that does the rest.
fn inverse(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let parts = matrix.iter().all(|entry| entry.is_finite()).then(|| matrix.svd(true, true))?;
    let least = ROUNDING * parts.singular_values.max();
    parts.pseudo_inverse(least).ok()
}
