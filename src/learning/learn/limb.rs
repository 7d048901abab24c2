//! Limbs: which joints belong together, and how one limb does what another does.

use nalgebra::{Matrix3, Vector3};

use gaitwright_physics::model::{Freedom, Model};

/// An unbranched chain of joints.
#[derive(Debug, Clone, PartialEq)]
pub struct JointChain {
    /// Its joints, from the trunk outward.
    pub joints: Vec<usize>,
    /// Joint axes in the root's frame, in the standing pose, and what they are axes of.
    axes: Vec<(Vector3<f64>, Freedom)>,
    /// Where it starts, to the left of the root's origin, m.
    left: f64,
}

impl JointChain {
    /// For each joint of this limb, whether it moves with (1) or against (-1) the same joint of `source`
    /// when both limbs do the same: mirrored at the root's plane y = 0 if they are on different sides of
    /// it, else as they are. `None` if the limbs differ in their number of joints.
    pub fn like(&self, source: &Self) -> Option<Vec<i8>> {
        if self.joints.len() != source.joints.len() {
            return None;
        }
        let across = self.left * source.left < 0.0;
        let signs = self.axes.iter().zip(&source.axes).map(|((ours, _), (theirs, freedom))| {
            // In a mirror a slide reverses across the plane, a turn (a pseudovector) along it.
            let mirrored = match freedom {
                Freedom::Prismatic => Vector3::new(theirs.x, -theirs.y, theirs.z),
                Freedom::Revolute => Vector3::new(-theirs.x, theirs.y, -theirs.z),
            };
            if ours.dot(if across { &mirrored } else { theirs }) < 0.0 { -1 } else { 1 }
        });
        Some(signs.collect())
    }
}

/// The limbs of `model` standing at `angles`: a joint belongs to the limb of the joint that carries it,
/// unless that one carries others too.
pub fn limbs(model: &Model, angles: &[f64]) -> Vec<JointChain> {
    let mut children = vec![0usize; model.bodies.len()];
    for body in model.bodies.iter().skip(1) {
        children[body.parent] += 1;
    }
    let mut frames = vec![(Matrix3::identity(), Vector3::zeros())];
    let mut limbs: Vec<JointChain> = Vec::new();
    let mut limb_of: Vec<usize> = Vec::with_capacity(model.joint_count());
    for (joint, body) in model.bodies.iter().skip(1).enumerate() {
        let (parent_turn, parent_origin) = frames[body.parent];
        let origin = parent_origin + parent_turn * body.offset;
        let (turn, slide) = match body.freedom {
            Freedom::Revolute => {
                let (sin, cos) = angles[joint].sin_cos();
                (body.turn + body.turn_sine * sin + body.turn_versine * (1.0 - cos), 0.0)
            }
            Freedom::Prismatic => (body.turn, angles[joint]),
        };
        let turn = parent_turn * turn;
        let axis = turn * body.axis;
        frames.push((turn, origin + axis * slide));
        let limb = if body.parent == 0 || children[body.parent] > 1 {
            limbs.push(JointChain { joints: Vec::new(), axes: Vec::new(), left: origin.y });
            limbs.len() - 1
        } else {
            limb_of[body.parent - 1]
        };
        limbs[limb].joints.push(joint);
        limbs[limb].axes.push((axis, body.freedom));
        limb_of.push(limb);
    }
    limbs
}
