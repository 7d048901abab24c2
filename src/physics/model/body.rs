//! Bodies, and the joints that carry them or close loops over them.

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::character::LoopKind;

/// A rigid body and the joint that carries it.
///
/// With the joint at angle q about `axis` a (Rodrigues' formula, \[a\] the cross-product matrix of a), a revolute
/// joint gives the body the orientation `joint_rotation` (1 + sin q \[a\] + (1 − cos q) \[a\]²) in its parent's frame;
/// a prismatic joint keeps `joint_rotation` and moves the origin by `joint_rotation` a q.
#[derive(Debug, Clone)]
pub struct Body {
    /// Index of the parent body; 0 for the root itself.
    pub parent: usize,
    /// Whether the joint rotates or slides; meaningless for the root.
    pub dof: DofKind,
    /// Origin of the joint frame in the parent body's frame, m.
    pub offset: Vector3<f64>,
    /// Rotation matrix of the joint frame in the parent body's frame.
    pub joint_rotation: Matrix3<f64>,
    /// `joint_rotation` \[a\]: the coefficient of sin q; zero for a prismatic joint.
    pub joint_rotation_sine: Matrix3<f64>,
    /// `joint_rotation` \[a\]²: the coefficient of the versine 1 − cos q; zero for a prismatic joint.
    pub joint_rotation_versine: Matrix3<f64>,
    /// Unit vector of the joint's axis in the body frame (and in the joint frame: the joint does not move it).
    pub axis: Vector3<f64>,
    /// kg.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub center: Vector3<f64>,
    /// Rotational inertia about the centre of mass along the axes of the body frame, kg m².
    pub inertia: Matrix3<f64>,
}

/// Rotation matrix and origin, m, of a body in whatever frame they are given in.
pub type Frame = (Matrix3<f64>, Vector3<f64>);

impl Body {
    /// Its frame with its joint at `angle` (rad or m), on a parent with the frame `parent`.
    pub fn carried_by(&self, (rotation, origin): Frame, angle: f64) -> Frame {
        let at = origin + rotation * self.offset;
        match self.dof {
            DofKind::Revolute => {
                let (sine, cosine) = angle.sin_cos();
                let turned = self.joint_rotation
                    + self.joint_rotation_sine * sine
                    + self.joint_rotation_versine * (1.0 - cosine);
                (rotation * turned, at)
            }
            DofKind::Prismatic => {
                let turned = rotation * self.joint_rotation;
                (turned, at + turned * self.axis * angle)
            }
        }
    }
}

/// The one degree of freedom of a movable joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DofKind {
    /// Rotation about the axis, rad.
    Revolute,
    /// Translation along the axis, m.
    Prismatic,
}

/// A joint that closes a loop: it joins two bodies of the tree.
#[derive(Debug, Clone)]
pub struct LoopJoint {
    /// Which relative motions it allows.
    pub kind: LoopKind,
    /// Indices of the two bodies.
    pub bodies: [usize; 2],
    /// Origin of the joint frame in the frame of each of the two bodies, m.
    pub origins: [Vector3<f64>; 2],
    /// Rotation matrix of the joint frame in the frame of each of the two bodies.
    pub rotations: [Matrix3<f64>; 2],
    /// Unit vector of the axis in the joint frame; meaningless for balls and fixed joints.
    pub axis: Vector3<f64>,
}

/// Where a link of the character sits in the model.
#[derive(Debug, Clone)]
pub struct LinkPlace {
    /// Index of the body it belongs to.
    pub body: usize,
    /// The link frame in the body frame; the identity for a body's first link.
    pub pose: Isometry3<f64>,
}
