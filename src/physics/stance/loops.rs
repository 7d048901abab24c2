//! Angles at which a character's loops are closed.

use nalgebra::{DMatrix, DVector};

use super::anatomy::Posed;
use crate::model::Model;
use crate::sim::rows::joint::Coupling;

/// Most steps of the search.
const STEPS: u32 = 50;

/// Distance (m) and angle (rad) at which a loop counts as closed.
const CLOSED: f64 = 1e-10;

/// Greatest change of an angle (rad) or a distance (m) in one step.
const LONGEST_STEP: f64 = 0.2;

/// Share of the greatest entry of J Jᵀ that is added to its diagonal, for rows that no angle moves.
const DAMPING: f64 = 1e-9;

/// Greatest distance (m) or angle (rad) by which a loop of `model` is open.
pub fn opening(model: &Model, posed: &Posed) -> f64 {
    let loops = 0..model.loops.len();
    loops.map(|index| Coupling::of_loop(model, &posed.bodies, index).separation()).fold(0.0, f64::max)
}

/// Moves `angles` to the nearest at which the loops are closed, as far as the limits let them.
pub fn close(model: &Model, angles: &mut [f64]) {
    close_with(model, angles, |_| false);
}

/// Moves `angles`, but for those that are `given`, to the nearest at which the loops are closed, as far as the limits let
/// them: damped Gauss-Newton (Levenberg) steps, each the shortest that closes the loops to first order. Gives by how much the loop that is
/// farthest open still is, m or rad.
pub fn close_with(model: &Model, angles: &mut [f64], given: impl Fn(usize) -> bool) -> f64 {
    if model.loops.is_empty() {
        return 0.0;
    }
    for _ in 0..STEPS {
        let posed = Posed::new(model, angles);
        let open = opening(model, &posed);
        if open <= CLOSED {
            return open;
        }
        let (mut jacobian, errors) = equations(model, &posed);
        for joint in (0..angles.len()).filter(|joint| given(*joint)) {
            jacobian.column_mut(joint).fill(0.0);
        }
        let mut square = &jacobian * jacobian.transpose();
        let damping = DAMPING * square.amax();
        for row in 0..errors.len() {
            square[(row, row)] += damping;
        }
        let Some(factor) = square.cholesky() else { break };
        let mut change = jacobian.tr_mul(&factor.solve(&errors));
        // Where a chain is nearly straight a step to first order is far too long, and would end in another of the postures that close it.
        change *= (LONGEST_STEP / change.amax()).min(1.0);
        for (joint, angle) in angles.iter_mut().enumerate().filter(|(joint, _)| !given(*joint)) {
            *angle -= change[joint];
            if let Some([lower, upper]) = model.limits[joint] {
                *angle = angle.max(lower).min(upper);
            }
        }
    }
    opening(model, &Posed::new(model, angles))
}

/// How the errors of all loops change with each joint's angle, one column a joint, and the errors themselves, m and rad.
pub fn equations(model: &Model, posed: &Posed) -> (DMatrix<f64>, DVector<f64>) {
    let joints = model.joint_count();
    let (mut slopes, mut errors) = (Vec::new(), Vec::new());
    for index in 0..model.loops.len() {
        let coupling = Coupling::of_loop(model, &posed.bodies, index);
        coupling.each(|wrench, error| {
            errors.push(error);
            slopes.extend((1..=joints).map(|body| {
                let carries = |end: usize| f64::from(u8::from(model.carries(body, end)));
                let share = carries(coupling.child) - carries(coupling.parent);
                share * posed.bodies.at(body).motion_subspace.dot(wrench)
            }));
        });
    }
    (DMatrix::from_row_slice(errors.len(), joints, &slopes), DVector::from_vec(errors))
}
