//! Springs and dampers for gaits: plain servos within the character's torque limits.

use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::scene::{Feedforward, Gains};
use gaitwright_physics::stance::Stance;

use super::legs::Legs;

/// Angle by which a joint gives way under its share of the weight at the end of its leg, rad. Twice as soft costs
/// more on every robot, and is useless from 0.4 on.
const GIVE: f64 = 0.06;
/// Share of critical damping for that share of the mass at the end of the leg.
const DAMPING_RATIO: f64 = 0.5;

/// Gains for the joints of `legs`; all others keep those of the stance. `gravity` in m/s².
pub fn gains(model: &Model, stance: &Stance, legs: &Legs, gravity: f64) -> Gains {
    let mut gains = Gains { feedforward: Feedforward::None, ..stance.gains.clone() };
    let share = legs.mass / legs.legs.len() as f64;
    for leg in &legs.legs {
        for (joint, origin) in leg.moved().zip(&leg.origins).filter(|(joint, _)| model.driven[*joint]) {
            let revolute = model.bodies[joint + 1].dof == DofKind::Revolute;
            // An ankle has little below it but the whole character above.
            let arm = (leg.foot - origin).norm().max(if leg.keeps_level() { 0.5 * leg.length } else { 0.0 });
            let (stiffness, inertia) = if revolute {
                (share * gravity * arm / GIVE, share * arm * arm)
            } else {
                (share * gravity / (GIVE * leg.length), share)
            };
            gains.stiffness[joint] = stiffness;
            gains.damping[joint] = 2.0 * DAMPING_RATIO * (stiffness * inertia).sqrt();
        }
    }
    gains
}
