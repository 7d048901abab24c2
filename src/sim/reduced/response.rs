//! How the character's velocity answers to forces on its bodies and joints.
//!
//! With the mass matrix factorised by the articulated-body sweep, M⁻¹ = Xᵀ X for an X that
//! is applied by walking from a body to the root. A row of the Jacobian becomes `x = X Jᵀ`, six
//! numbers of the root and one for every joint on the way, and the contact-space matrix J M⁻¹ Jᵀ is
//! made of dot products of such rows. No inverse is ever formed.

use std::ops::Range;

use super::articulated::Articulated;
use super::kinematics::BodyMotion;
use crate::model::Model;
use crate::sim::spatial::{Force, Motion};

/// Numbers of a half-solved row that belong to the root.
pub const ROOT: usize = 6;

/// Half-solves a unit of the row that is `force` on body `body`, and the opposite on body `other` if there
/// is one: fills `half`, which is zero before, with [`ROOT`] numbers of the root and one for every joint on the way, and
/// gives the range of the joints' numbers.
#[inline]
pub fn of_bodies(
    model: &Model,
    bodies: &[BodyMotion],
    factor: &Articulated,
    body: usize,
    other: Option<usize>,
    force: Force,
    half: &mut [f64],
) -> Range<usize> {
    let (mut at_root, mut joints) = climb(model, bodies, factor, body, force, half);
    if let Some(other) = other {
        let (rest, others) = climb(model, bodies, factor, other, force.scaled(-1.0), half);
        at_root = at_root.plus(rest);
        joints = union(joints, others);
    }
    half[..ROOT].copy_from_slice(&factor.root.half_solve(at_root));
    joints
}

/// Half-solves a unit of the row that is a force along joint `joint` into `half`, which is zero before, and gives the range
/// of the joints' numbers.
pub fn of_joint(
    model: &Model,
    bodies: &[BodyMotion],
    factor: &Articulated,
    joint: usize,
    half: &mut [f64],
) -> Range<usize> {
    let share = &factor.joints[joint];
    half[ROOT + joint] = share.root_inverse_d;
    let rest = share.u.scaled(-share.inverse_d);
    let (at_root, joints) = climb(model, bodies, factor, model.bodies[joint + 1].parent, rest, half);
    half[..ROOT].copy_from_slice(&factor.root.half_solve(at_root));
    union(joints, ROOT + joint..ROOT + joint + 1)
}

/// The smallest range that holds both.
fn union(first: Range<usize>, second: Range<usize>) -> Range<usize> {
    match (first.is_empty(), second.is_empty()) {
        (true, _) => second,
        (_, true) => first,
        _ => first.start.min(second.start)..first.end.max(second.end),
    }
}

/// Walks `force` on `body` to the root, adds each joint's share to `half`, and gives what reaches the root and the
/// range of the joints on the way.
#[inline(always)] // the rows of contacts spend most of their time here
fn climb(
    model: &Model,
    bodies: &[BodyMotion],
    factor: &Articulated,
    mut body: usize,
    mut force: Force,
    half: &mut [f64],
) -> (Force, Range<usize>) {
    // A body's index is greater than its parent's.
    let mut joints = ROOT..ROOT + body;
    while body > 0 {
        let joint = body - 1;
        joints.start = ROOT + joint;
        let share = &factor.joints[joint];
        let along = bodies[body].freedom.dot(force);
        half[ROOT + joint] += along * share.root_inverse_d;
        force = force.plus_scaled(share.u, -along * share.inverse_d);
        body = model.bodies[body].parent;
    }
    (force, joints)
}

/// Change of velocity that belongs to the half-solved impulse `half`: of the root as the result, of
/// the joints added to `joint_rates`; `changes` receives that of every body.
pub fn finish(
    model: &Model,
    bodies: &[BodyMotion],
    factor: &Articulated,
    half: &[f64],
    joint_rates: &mut [f64],
    changes: &mut [Motion],
) -> Motion {
    let mut z = [0.0; ROOT];
    z.copy_from_slice(&half[..ROOT]);
    changes[0] = factor.root.finish(z);
    for index in 1..bodies.len() {
        let joint = index - 1;
        let share = &factor.joints[joint];
        let carried = changes[model.bodies[index].parent];
        let change = half[ROOT + joint] * share.root_inverse_d - carried.dot(share.u) * share.inverse_d;
        joint_rates[joint] += change;
        changes[index] = carried.plus_scaled(bodies[index].freedom, change);
    }
    changes[0]
}
