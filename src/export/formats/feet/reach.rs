//! Inverse kinematics: the pose in which points of links lie elsewhere.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, UnitQuaternion, Vector3};

use crate::export::formats::skeleton::Skeleton;
use gaitwright_physics::character::{Joint, JointKind};

/// Linearisations after each other; each leaves an error that is quadratic in what is missing.
const ITERATIONS: usize = 2;

/// Missing distance below which nothing more is done, m.
const NEAR: f64 = 1e-7;

/// Share of the greatest reach in the damping of the least squares: directions in which the limb cannot move are left.
const DAMPING: f64 = 0.02;

/// How far the root is moved, m, or turned, rad, where a joint would be turned by 1 rad for the same cost: the root moves
/// where limbs cannot reach, and hardly otherwise.
const ROOT: f64 = 0.05;

/// A pose of the character.
pub(super) struct Pose<'a> {
    /// The root link.
    pub(super) root: &'a mut Isometry3<f64>,
    /// rad or m, in the order of the skeleton.
    pub(super) angles: &'a mut [f64],
}

/// A point of a link, and where it is to lie.
pub(super) struct PointTarget {
    pub(super) link: usize,
    /// In the link's frame, m.
    pub(super) point: Point3<f64>,
    /// In the frame of the root's pose, m.
    pub(super) place: Point3<f64>,
}

/// A pair of points of two links that stay as far from each other as they are: where a loop closes.
pub(super) struct PointPair {
    pub(super) links: [usize; 2],
    /// Each in its link's frame, m.
    pub(super) points: [Point3<f64>; 2],
    /// From the first to the second, in the frame of the root's pose, m.
    pub(super) apart: Vector3<f64>,
}

/// Changes a pose so that the points come to their places, by the least change of all angles and the root together
/// (damped least squares; Wampler 1986). Joints stay within their limits, or where they were outside.
pub(super) fn reach(
    skeleton: &Skeleton<'_>,
    Pose { root, angles }: Pose<'_>,
    targets: &[PointTarget],
    pairs: &[PointPair],
) {
    let limits = limits(skeleton, angles);
    let joints = angles.len();
    let rows = 3 * (targets.len() + pairs.len());
    for _ in 0..ITERATIONS {
        let poses = skeleton.poses(root, angles);
        let mut missing = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, joints + 6);
        for (index, target) in targets.iter().enumerate() {
            let at = poses[target.link] * target.point;
            missing.fixed_rows_mut::<3>(3 * index).copy_from(&(target.place - at));
            add_columns(skeleton, &poses, (target.link, &at), 1.0, &mut jacobian, 3 * index);
            let arm = at - Point3::from(root.translation.vector);
            for axis in 0..3 {
                let unit = Vector3::ith(axis, ROOT);
                jacobian.fixed_view_mut::<3, 1>(3 * index, joints + axis).copy_from(&unit);
                jacobian.fixed_view_mut::<3, 1>(3 * index, joints + 3 + axis).copy_from(&unit.cross(&arm));
            }
        }
        for (index, pair) in pairs.iter().enumerate() {
            let row = 3 * (targets.len() + index);
            let [from, to] = [0, 1].map(|end| poses[pair.links[end]] * pair.points[end]);
            missing.fixed_rows_mut::<3>(row).copy_from(&(pair.apart - (to - from)));
            add_columns(skeleton, &poses, (pair.links[0], &from), -1.0, &mut jacobian, row);
            add_columns(skeleton, &poses, (pair.links[1], &to), 1.0, &mut jacobian, row);
        }
        if missing.amax() < NEAR {
            return;
        }
        let mut normal = &jacobian * jacobian.transpose();
        let damping = (DAMPING * jacobian.amax()).powi(2);
        for row in 0..rows {
            normal[(row, row)] += damping;
        }
        let Some(solved) = normal.cholesky().map(|factor| factor.solve(&missing)) else { return };
        let change = jacobian.transpose() * solved;
        for ((angle, change), [lower, upper]) in angles.iter_mut().zip(change.iter()).zip(&limits) {
            *angle = (*angle + change).clamp(*lower, *upper);
        }
        let [moved, turned] = [joints, joints + 3].map(|at| ROOT * change.fixed_rows::<3>(at).into_owned());
        root.translation.vector += moved;
        root.rotation = UnitQuaternion::from_scaled_axis(turned) * root.rotation;
    }
}

/// The range of each angle, widened to where the angle is.
fn limits(skeleton: &Skeleton<'_>, angles: &[f64]) -> Vec<[f64; 2]> {
    let range = |(joint, angle): (&Joint, &f64)| match &joint.limits {
        Some(limits) => [limits.lower.min(*angle), limits.upper.max(*angle)],
        None => [f64::NEG_INFINITY, f64::INFINITY],
    };
    skeleton.movable().zip(angles).map(range).collect()
}

/// Adds `sign` times the velocity of a point of `link` at `at` by the rate of every joint that carries the link, from
/// row `row` on.
fn add_columns(
    skeleton: &Skeleton<'_>,
    poses: &[Isometry3<f64>],
    (link, at): (usize, &Point3<f64>),
    sign: f64,
    jacobian: &mut DMatrix<f64>,
    row: usize,
) {
    let mut next = Some(link);
    while let Some(link) = next {
        let joint = skeleton.character.links[link].joint.as_ref();
        next = joint.map(|joint| joint.parent);
        let (Some(joint), Some(column)) = (joint, skeleton.angle_of[link]) else { continue };
        let axis = poses[link] * joint.axis.into_inner();
        let velocity = match joint.kind {
            JointKind::Prismatic => axis,
            _ => axis.cross(&(at - Point3::from(poses[link].translation.vector))),
        };
        for (offset, part) in velocity.iter().enumerate() {
            jacobian[(row + offset, column)] += sign * part;
        }
    }
}
