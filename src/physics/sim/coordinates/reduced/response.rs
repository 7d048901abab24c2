//! The response of the character's velocity to forces on its bodies and joints.
//!
//! With the mass matrix factorised by the articulated-body sweep, M⁻¹ = Xᵀ X for an X that
//! is applied by walking from a body to the root. A row of the Jacobian becomes `x = X Jᵀ`, six
//! numbers of the root and one for every joint on the way, and the contact-space matrix J M⁻¹ Jᵀ is
//! made of dot products of such rows. No inverse is ever formed.

use multiversion::multiversion;
use std::ops::Range;

use super::articulated::{Articulated, JointFactor};
use crate::model::Model;
use crate::model::wide::{LANES, Lanes, Wide};
use crate::sim::bodies::Bodies;
use crate::sim::per_body::Motions;
use crate::sim::rows::ROOT;
use crate::sim::spatial::{SpatialForce, WideMotion};

/// Half-solves units of the rows that are `forces`, no more than [`LANES`], on body `body`, and the opposite on body
/// `other` if there is one: appends side by side to `numbers` [`ROOT`] of the root and one for each joint in the
/// range that it gives, in which all joints on the way are.
#[multiversion(targets("x86_64+avx2"))]
pub fn of_bodies(
    model: &Model,
    bodies: &Bodies,
    factor: &Articulated,
    body: usize,
    other: Option<usize>,
    forces: &[SpatialForce],
    numbers: &mut Vec<Lanes>,
) -> Range<usize> {
    let mut own = side_by_side(forces);
    let joints = match other {
        None => way(model, body),
        Some(other) => union(way(model, body), way(model, other)),
    };
    let start = numbers.len();
    numbers.resize(start + ROOT + joints.len(), [0.0; LANES]);
    let (root, shares) = numbers[start..].split_at_mut(ROOT);
    let opposite = own;
    climb(model, bodies, factor, body, &mut own, &joints, shares);
    if let Some(other) = other {
        let mut rest = opposite.map(|lanes| lanes.map(|component| -component));
        climb(model, bodies, factor, other, &mut rest, &joints, shares);
        for (own, rest) in own.iter_mut().zip(rest) {
            *own = std::array::from_fn(|lane| own[lane] + rest[lane]);
        }
    }
    root.copy_from_slice(&factor.root.half_solve(own));
    joints
}

/// The components of `forces`, no more than [`LANES`], moments first.
#[inline]
pub fn side_by_side(forces: &[SpatialForce]) -> [Lanes; 6] {
    // The three of a contact, whose number the compiler then knows.
    if let [a, b, c] = forces {
        let [a, b, c] = [a, b, c].map(|force| force.components());
        return std::array::from_fn(|component| [a[component], b[component], c[component], 0.0]);
    }
    let mut filled = [[0.0; 6]; LANES];
    for (lane, force) in filled.iter_mut().zip(forces) {
        *lane = force.components();
    }
    std::array::from_fn(|component| filled.map(|lane| lane[component]))
}

/// Half-solves a unit of the row that is a force along joint `joint`, as [`of_bodies`] does.
pub fn of_joint(
    model: &Model,
    bodies: &Bodies,
    factor: &Articulated,
    joint: usize,
    numbers: &mut Vec<Lanes>,
) -> Range<usize> {
    let share = factor.joints.at(joint + 1);
    let rest = share.u.scaled(-share.inverse_d);
    let others = of_bodies(model, bodies, factor, model.bodies[joint + 1].parent, None, &[rest], numbers);
    let joints = union(others.clone(), ROOT + joint..ROOT + joint + 1);
    numbers.resize(numbers.len() + joints.len() - others.len(), [0.0; LANES]);
    if let Some(own) = numbers.last_mut() {
        own[0] = share.root_inverse_d;
    }
    joints
}

/// The range of the joints between body `body` and the root. A body's index is greater than its parent's.
#[inline]
fn way(model: &Model, body: usize) -> Range<usize> {
    ROOT + model.branches[body].saturating_sub(1)..ROOT + body
}

/// The smallest range that holds both.
fn union(first: Range<usize>, second: Range<usize>) -> Range<usize> {
    match (first.is_empty(), second.is_empty()) {
        (true, _) => second,
        (_, true) => first,
        _ => first.start.min(second.start)..first.end.max(second.end),
    }
}

/// Walks `forces` (moments first) on `body` to the root, adds each joint's share to `shares`, which are those of
/// `joints`, and leaves what reaches the root.
#[inline(always)] // the rows of contacts spend most of their time here
fn climb(
    model: &Model,
    bodies: &Bodies,
    factor: &Articulated,
    mut body: usize,
    forces: &mut [Lanes; 6],
    joints: &Range<usize>,
    shares: &mut [Lanes],
) {
    while body > 0 {
        let joint = body - 1;
        let JointFactor { u, inverse_d, root_inverse_d } = factor.joints.at(body);
        let [x, y, z, a, b, c] = bodies.at(body).motion_subspace.components();
        // A sum of three does not wait for as many others as one of six.
        let along: Lanes = std::array::from_fn(|lane| {
            let turned = x * forces[0][lane] + y * forces[1][lane] + z * forces[2][lane];
            let pushed = a * forces[3][lane] + b * forces[4][lane] + c * forces[5][lane];
            turned + pushed
        });
        let share = &mut shares[ROOT + joint - joints.start];
        *share = std::array::from_fn(|lane| share[lane] + along[lane] * root_inverse_d);
        let along = along.map(|along| along * inverse_d);
        for (u, lanes) in u.components().into_iter().zip(&mut *forces) {
            *lanes = std::array::from_fn(|lane| lanes[lane] - u * along[lane]);
        }
        body = model.bodies[body].parent;
    }
}

/// Change of velocity that belongs to the half-solved impulse `half`: that of the joints is added to `joint_rates`, `changes` receives
/// that of every body.
#[multiversion(targets("x86_64+avx2"))]
pub fn finish(
    model: &Model,
    bodies: &Bodies,
    factor: &Articulated,
    half: &[f64],
    joint_rates: &mut [f64],
    changes: &mut Motions,
) {
    let mut z = [0.0; ROOT];
    z.copy_from_slice(&half[..ROOT]);
    changes.set_root(factor.root.finish(z));
    for index in 1..model.groups.len() {
        let group = &model.groups[index];
        let (parents, own) = changes.outward(index, group);
        let joints = follow(
            parents,
            &bodies.groups[index].motion_subspace,
            &factor.joints.groups[index],
            &group.of_joints(&half[ROOT..]),
            own,
        );
        for (joint, change) in group.joints().zip(joints) {
            joint_rates[joint] += change;
        }
    }
}

/// Changes of the velocities of bodies whose parents' are `parents`, and of their joints' as the result, by the half-solved
/// impulses `half` along the joints.
#[multiversion(targets("x86_64+avx2"))]
fn follow(
    parents: &WideMotion,
    along: &WideMotion,
    factors: &Wide<JointFactor, 8>,
    half: &Lanes,
    changes: &mut WideMotion,
) -> Lanes {
    let mut joints = [0.0; LANES];
    for lane in 0..LANES {
        let (factor, parent) = (factors.at(lane), parents.at(lane));
        let joint = half[lane] * factor.root_inverse_d - parent.dot(factor.u) * factor.inverse_d;
        joints[lane] = joint;
        changes.set(lane, parent.plus_scaled(along.at(lane), joint));
    }
    joints
}
