//! Springs and dampers suited to a character, from its weight and the length of its limbs.
//!
//! A joint's spring is deflected by [`DEFLECTION`] under its share of the weight at the end of its limb, and its damper
//! has [`DAMPING_RATIO`] of what would be critical for that share of the mass there. A joint that no foot hangs on (of an arm, a neck or
//! a tail) carries what hangs on it in place of that share. Both scale with the character, so that a mouse and a horse are held alike.

use super::anatomy::Posed;
use super::feet;
use crate::model::{DofKind, Model};
use crate::scene::{Gains, STANDARD_GRAVITY, Scene};
use crate::sim::coordinates::reduced::kinematics::composite_inertia;

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

    let looped: Vec<usize> = model.loops.iter().flat_map(|closing| closing.bodies).collect();
    // The arm of what has no end that could touch the ground, m.
    let loose = 0.2 * extent.max(model.size);
    let inertia = composite_inertia(model);
    // The mass that a joint holds, kg, and how far from it, m.
    let load = |joint: usize| {
        let origin = posed.bodies.at(joint + 1).origin;
        // Through a closed loop the ground's forces reach joints that no foot hangs on.
        if carrying.iter().chain(&looped).any(|body| model.carries(joint + 1, *body)) {
            let carried = posed.surface.iter().filter(|point| model.carries(joint + 1, point.body));
            let farthest = carried.map(|point| (point.at - origin).norm()).fold(0.0, f64::max);
            // An ankle has little mass below it but balances the whole character above, as an inverted pendulum.
            let above = posed.center_of_mass.z - origin.z;
            return (share, if farthest > 0.0 { farthest.max(above) } else { loose });
        }
        let beyond = (1..model.bodies.len()).filter(|body| model.carries(joint + 1, *body));
        let mass: f64 = beyond.map(|body| model.bodies[body].mass).sum();
        match model.bodies[joint + 1].dof {
            // The radius of gyration about its axis.
            DofKind::Revolute => (mass, (inertia[joint] / mass.max(f64::MIN_POSITIVE)).sqrt()),
            DofKind::Prismatic => (mass, loose),
        }
    };
    let spring = |joint: usize| {
        let (mass, arm) = load(joint);
        let (stiffness, inertia) = match model.bodies[joint + 1].dof {
            DofKind::Revolute => (mass * gravity * arm / DEFLECTION, mass * arm.powi(2)),
            DofKind::Prismatic => (mass * gravity / (DEFLECTION * arm), mass),
        };
        let stiffness = if model.driven[joint] { stiffness } else { 0.0 };
        (stiffness, 2.0 * DAMPING_RATIO * (stiffness * inertia).sqrt())
    };
    let (stiffness, damping) = (0..model.joint_count()).map(spring).unzip();
    Gains { stiffness, damping, max_torque: model.effort.clone(), ..Gains::default() }
}
