//! Legs with closed loops, such as five-bar and parallelogram legs: the joints that a loop moves along with those between the trunk and the
//! foot, and the torques of motors that sit on either.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};

use gaitwright_physics::model::Model;
use gaitwright_physics::stance::{close_loops, loop_slopes};

/// Singular values of a loop's slopes below this share of the greatest are zeros.
const SINGULAR: f64 = 1e-6;

/// The bodies of all loops of which a body is in `chain`, between their ends and the body that carries both, in their order, without
/// those of the chain.
pub(super) fn beside(model: &Model, chain: &[usize]) -> Vec<usize> {
    let mut all: BTreeSet<usize> = chain.iter().copied().collect();
    loop {
        let before = all.len();
        for closed in &model.loops {
            let around = around(model, closed.bodies);
            if around.iter().any(|body| all.contains(body)) {
                all.extend(around);
            }
        }
        if all.len() == before {
            return all.into_iter().filter(|body| !chain.contains(body)).collect();
        }
    }
}

/// The bodies on the ways from two bodies to the one that carries both, without that.
fn around(model: &Model, [mut one, mut other]: [usize; 2]) -> Vec<usize> {
    let mut bodies = Vec::new();
    // Bodies come after those that carry them.
    while one != other {
        let farther = if one > other { &mut one } else { &mut other };
        bodies.push(*farther);
        *farther = model.bodies[*farther].parent;
    }
    bodies
}

/// Whether the loops leave the joints `chain` free, decide of the joints `followers` by them, and as many of all these have motors as
/// there are in the chain; for joints at `angles`.
pub(super) fn decide(model: &Model, angles: &[f64], chain: &[usize], followers: &[usize]) -> bool {
    let driven = chain.iter().chain(followers).filter(|joint| model.driven[**joint]).count();
    if driven != chain.len() || followers.is_empty() {
        return false;
    }
    let slopes = loop_slopes(model, angles);
    let rank = |joints: &[usize]| slopes.select_columns(joints).rank(SINGULAR * slopes.amax());
    let (own, both) = (rank(followers), rank(&[followers, chain].concat()));
    own == followers.len() && both == own && Following::new(model, angles, chain, followers).is_some()
}

/// How the joints that follow do so, and what that makes of torques, at one posture.
pub struct Following {
    /// Their angles, in their order.
    pub angles: Vec<f64>,
    /// By how much a loop is open, m or rad.
    pub open: f64,
    /// The rate of each joint with a motor per unit rate of each of the chain's.
    driven: DMatrix<f64>,
    /// The places of those joints in the chain with the followers behind it.
    motors: Vec<usize>,
}

impl Following {
    /// With all of the character's joints at `angles`, of which those of the followers are where they are looked for first; `None` where the
    /// posture is singular.
    pub fn new(model: &Model, angles: &[f64], chain: &[usize], followers: &[usize]) -> Option<Self> {
        let mut angles = angles.to_vec();
        let open = close_loops(model, &mut angles, |joint| !followers.contains(&joint));
        let slopes = loop_slopes(model, &angles);
        let (own, given) = (slopes.select_columns(followers), slopes.select_columns(chain));
        let rates = -(own.tr_mul(&own)).cholesky()?.solve(&own.tr_mul(&given));
        let count = chain.len();
        let all = DMatrix::from_fn(count + followers.len(), count, |row, column| match row < count {
            true => f64::from(u8::from(row == column)),
            false => rates[(row - count, column)],
        });
        let moved = chain.iter().chain(followers).enumerate();
        let motors: Vec<usize> =
            moved.filter(|(_, joint)| model.driven[**joint]).map(|(place, _)| place).collect();
        let angles = followers.iter().map(|&joint| angles[joint]).collect();
        Some(Self { angles, open, driven: all.select_rows(&motors), motors })
    }

    /// The torques of the chain's joints and the followers, N m or N, that do what `torques` in each of the chain's joints would: those without
    /// a motor have none.
    pub fn carried(&self, torques: &[f64]) -> Option<Vec<f64>> {
        let found = self.driven.transpose().lu().solve(&DVector::from_column_slice(torques))?;
        let mut all = vec![0.0; torques.len() + self.angles.len()];
        for (motor, torque) in self.motors.iter().zip(&found) {
            all[*motor] = *torque;
        }
        all.iter().all(|torque| torque.is_finite()).then_some(all)
    }
}
