//! Limbs: which joints belong together, and how one limb repeats or mirrors the motion of another.

use nalgebra::{Matrix3, Vector3};

use gaitwright_physics::model::{DofKind, Model};

/// A limb: an unbranched chain of joints.
#[derive(Debug, Clone, PartialEq)]
pub struct JointChain {
    /// Its joints, from the trunk outward.
    pub joints: Vec<usize>,
    /// Joint axes in the root's frame, in the standing pose, and whether the joint turns about it or slides along it.
    axes: Vec<(Vector3<f64>, DofKind)>,
    /// y coordinate of its first joint in the root's frame (left is positive), m.
    left: f64,
}

impl JointChain {
    /// For each joint of this limb, the sign (1 or -1) by which angles of the same joint of `source` are multiplied so
    /// that this limb repeats the motion of `source`: mirrored at the root's plane y = 0 if the two limbs are on
    /// different sides of it, else unchanged. `None` if the limbs differ in their number of joints.
    pub fn signs_from(&self, source: &Self) -> Option<Vec<i8>> {
        if self.joints.len() != source.joints.len() {
            return None;
        }
        let across = self.left * source.left < 0.0;
        let signs = self.axes.iter().zip(&source.axes).map(|((ours, _), (theirs, freedom))| {
            // Mirroring reverses the component of a vector (sliding axis) across the plane, and the components of a
            // pseudovector (rotation axis) along it.
            let mirrored = match freedom {
                DofKind::Prismatic => Vector3::new(theirs.x, -theirs.y, theirs.z),
                DofKind::Revolute => Vector3::new(-theirs.x, theirs.y, -theirs.z),
            };
            if ours.dot(if across { &mirrored } else { theirs }) < 0.0 { -1 } else { 1 }
        });
        Some(signs.collect())
    }
}

/// The limbs of `model` standing at `angles` (rad or m): a joint belongs to the limb of its parent joint, unless it hangs
/// on the root or the parent has other children, too; then it begins a limb.
pub fn limbs(model: &Model, angles: &[f64]) -> Vec<JointChain> {
    let mut children = vec![0usize; model.bodies.len()];
    for body in model.bodies.iter().skip(1) {
        children[body.parent] += 1;
    }
    let mut frames = vec![(Matrix3::identity(), Vector3::zeros())];
    let mut limbs: Vec<JointChain> = Vec::new();
    let mut limb_of: Vec<usize> = Vec::with_capacity(model.joint_count());
    for (joint, body) in model.bodies.iter().skip(1).enumerate() {
        let (parent_rotation, parent_origin) = frames[body.parent];
        let origin = parent_origin + parent_rotation * body.offset;
        let (rotation, slide) = match body.dof {
            DofKind::Revolute => {
                let (sin, cos) = angles[joint].sin_cos();
                (
                    body.joint_rotation
                        + body.joint_rotation_sine * sin
                        + body.joint_rotation_versine * (1.0 - cos),
                    0.0,
                )
            }
            DofKind::Prismatic => (body.joint_rotation, angles[joint]),
        };
        let rotation = parent_rotation * rotation;
        let axis = rotation * body.axis;
        frames.push((rotation, origin + axis * slide));
        let limb = if body.parent == 0 || children[body.parent] > 1 {
            limbs.push(JointChain { joints: Vec::new(), axes: Vec::new(), left: origin.y });
            limbs.len() - 1
        } else {
            limb_of[body.parent - 1]
        };
        limbs[limb].joints.push(joint);
        limbs[limb].axes.push((axis, body.dof));
        limb_of.push(limb);
    }
    limbs
}
