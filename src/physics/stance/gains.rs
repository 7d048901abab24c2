//! Springs and dampers suited to a character, from its weight and the length of its limbs.
//!
//! A joint's spring is deflected by [`DEFLECTION`] under its share of the weight at the end of its limb, and its damper
//! has [`DAMPING_RATIO`] of what would be critical for that share of the mass there. Both scale with the
//! character, so that a mouse and a horse are held alike.

use super::anatomy::Posed;
use super::feet;
use crate::model::{DofKind, Model};
use crate::scene::{Gains, STANDARD_GRAVITY, Scene};

/// Angle by which a joint is deflected under its share of the weight, rad.
const DEFLECTION: f64 = 0.15;

/// Share of critical damping.
const DAMPING_RATIO: f64 = 0.3;

/// Gains for `model` standing at `angles` in `scene`, with the character's own torque limits; 0 for joints
/// without an actuator.
pub fn suited(model: &Model, scene: &Scene, angles: &[f64]) -> Gains {
    let posed = Posed::new(model, angles);
    let gravity = scene.acting_gravity().norm();
    let gravity = if gravity > 0.0 { gravity } else { STANDARD_GRAVITY };
    let lowest = posed.lowest();
    let extent =
        posed.surface.iter().map(|point| (point.at - posed.center_of_mass).norm()).fold(0.0, f64::max);
    // Links within a tenth of the character's size of the ground share the load.
    let mut carrying: Vec<usize> = posed
        .surface
        .iter()
        .filter(|point| point.at.z < lowest + 0.1 * extent)
        .map(|point| point.body)
        .collect();
    carrying.sort_unstable();
    carrying.dedup();
    let share = model.mass / feet::count(model, &carrying).max(1) as f64;

    let joints = 0..model.joint_count();
    let arm = |joint: usize| {
        let carried = posed.surface.iter().filter(|point| model.carries(joint + 1, point.body));
        let origin = posed.bodies.at(joint + 1).origin;
        let farthest = carried.map(|point| (point.at - origin).norm()).fold(0.0, f64::max);
        // An ankle has little mass below it but balances the whole character above, as an inverted pendulum.
        let above = if farthest > 0.0 { posed.center_of_mass.z - origin.z } else { 0.0 };
        // A joint beyond which nothing can reach the ground still carries its own links.
        if farthest > 0.0 { farthest.max(above) } else { 0.2 * extent.max(model.size) }
    };
    let stiffness: Vec<f64> = joints
        .clone()
        .map(|joint| match model.bodies[joint + 1].dof {
            _ if !model.driven[joint] => 0.0,
            DofKind::Revolute => share * gravity * arm(joint) / DEFLECTION,
            DofKind::Prismatic => share * gravity / (DEFLECTION * arm(joint)),
        })
        .collect();
    let damping = joints
        .map(|joint| {
            let inertia = match model.bodies[joint + 1].dof {
                DofKind::Revolute => share * arm(joint).powi(2),
                DofKind::Prismatic => share,
            };
            2.0 * DAMPING_RATIO * (stiffness[joint] * inertia).sqrt()
        })
        .collect();
    Gains { stiffness, damping, max_torque: model.effort.clone(), ..Gains::default() }
}
