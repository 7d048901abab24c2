//! Limbs: which joints belong together, and how one limb repeats or mirrors the motion of another.

use nalgebra::{Matrix3, Vector3};

use gaitwright_physics::model::{DofKind, Model};

/// The plane between left and right, and what lies ahead in it: unit vectors in the root's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sagittal {
    /// Along the task's direction.
    ahead: Vector3<f64>,
    /// Perpendicular to the plane.
    left: Vector3<f64>,
}

impl Sagittal {
    /// For travel along `ahead` where `up` is up, both in the root's frame and of any length; `ahead` along x where it has
    /// no level part.
    pub fn new(ahead: Vector3<f64>, up: Vector3<f64>) -> Self {
        let up = up.try_normalize(0.0).unwrap_or_else(Vector3::z);
        let level = ahead - up * up.dot(&ahead);
        let ahead = level.try_normalize(0.0).unwrap_or_else(Vector3::x);
        Self { ahead, left: up.cross(&ahead) }
    }

    /// The mirror image of a vector.
    pub fn mirrored(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        vector - self.left * (2.0 * self.left.dot(vector))
    }

    /// The mirror image of a joint's axis: of a rotation the axis is a pseudovector.
    fn mirrored_axis(&self, (axis, freedom): &(Vector3<f64>, DofKind)) -> Vector3<f64> {
        match freedom {
            DofKind::Prismatic => self.mirrored(axis),
            DofKind::Revolute => -self.mirrored(axis),
        }
    }
}

/// A limb: an unbranched chain of joints.
#[derive(Debug, Clone, PartialEq)]
pub struct JointChain {
    /// Its joints, from the trunk outward.
    pub joints: Vec<usize>,
    /// Its first joint in the root's frame, in the standing pose, m.
    pub origin: Vector3<f64>,
    /// How far that is ahead of the root's origin and to the left of it, m.
    pub ahead: f64,
    /// See `ahead`.
    pub left: f64,
    plane: Sagittal,
    /// Joint axes in the root's frame, in the standing pose, and whether the joint turns about it or slides along it.
    axes: Vec<(Vector3<f64>, DofKind)>,
}

impl JointChain {
    /// For each joint of this limb, the sign (1 or -1) by which angles of the same joint of `source` are multiplied so
    /// that this limb repeats the motion of `source`: mirrored if the two limbs are on different sides of the sagittal
    /// plane, else unchanged. `None` if the limbs differ in their number of joints.
    pub fn signs_from(&self, source: &Self) -> Option<Vec<i8>> {
        self.signs(source, self.left * source.left < 0.0)
    }

    /// The same for a limb that lies in the plane and mirrors itself.
    pub fn own_mirror_signs(&self) -> Vec<i8> {
        self.signs(self, true).unwrap_or_default()
    }

    /// Where the mirror image of its first joint is, in the root's frame, m.
    pub fn mirrored_origin(&self) -> Vector3<f64> {
        self.plane.mirrored(&self.origin)
    }

    fn signs(&self, source: &Self, across: bool) -> Option<Vec<i8>> {
        if self.joints.len() != source.joints.len() {
            return None;
        }
        let signs = self.axes.iter().zip(&source.axes).map(|((ours, _), theirs)| {
            let image = if across { self.plane.mirrored_axis(theirs) } else { theirs.0 };
            if ours.dot(&image) < 0.0 { -1 } else { 1 }
        });
        Some(signs.collect())
    }
}

/// The limbs of `model` standing at `angles` (rad or m): a joint belongs to the limb of its parent joint, unless it hangs
/// on the root or the parent has other children, too; then it begins a limb.
pub fn limbs(model: &Model, angles: &[f64], plane: Sagittal) -> Vec<JointChain> {
    let mut children = vec![0usize; model.bodies.len()];
    for body in model.bodies.iter().skip(1) {
        children[body.parent] += 1;
    }
    let mut frames = vec![(Matrix3::identity(), Vector3::zeros())];
    let mut limbs: Vec<JointChain> = Vec::new();
    let mut limb_of: Vec<usize> = Vec::with_capacity(model.joint_count());
    for (joint, body) in model.bodies.iter().skip(1).enumerate() {
        let parent = frames[body.parent];
        let frame = body.carried_by(parent, angles[joint]);
        let axis = frame.0 * body.axis;
        let origin = parent.1 + parent.0 * body.offset;
        frames.push(frame);
        let limb = if body.parent == 0 || children[body.parent] > 1 {
            let (ahead, left) = (plane.ahead.dot(&origin), plane.left.dot(&origin));
            limbs.push(JointChain { joints: Vec::new(), axes: Vec::new(), origin, ahead, left, plane });
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
