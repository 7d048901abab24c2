//! Which shapes of a character can make contact with each other.
//!
//! Pairs that no motion within the joint limits brings together are left out of contact detection. A bound shows it:
//! the distance d(q) of two shapes, over the joints on the path between them, changes by no more than r_k for each
//! radian of joint k, where the moment arm r_k bounds how far the shape lies from the joint's axis (1 for a metre of a
//! prismatic joint). Over a box of joint angles with half widths h_k around q it is therefore at least
//! d(q) − Σ r_k h_k. A box where that is positive is free of contact; any other is halved, until all boxes are free
//! or a pose is found in which the shapes make contact.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Vector};

use super::convert::{frame, vector};
use super::convex::Convex;
use super::surface::GroundShape;
use crate::model::body::{Body, DofKind, LoopJoint};

/// Greatest number of joints between two shapes for which the search is made. With more joints between them, shapes are
/// assumed to be able to make contact.
const JOINTS: usize = 3;
/// Hinges this close to each other, as a share of how far the body on them reaches, turn about one point.
const SAME_PLACE: f64 = 0.01;
/// Greatest number of poses examined for a pair. Where they do not decide, the shapes are assumed to be able to make
/// contact.
const POSES: usize = 100;

/// The pairs of a character's shapes, as indices into [`crate::model::Model::solids`] in ascending order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pairs {
    /// Number of shapes.
    shapes: usize,
    /// One bit for every ordered pair of shapes: whether they can make contact within the joint limits.
    touching: Vec<u64>,
    /// The same: whether only the joint limits keep them from it.
    beyond: Vec<u64>,
    /// Number of pairs that can make contact within the joint limits.
    pub count: usize,
    /// Pairs of bodies joined by a joint, or by hinges about one point, whose shapes overlap by design.
    pub joined: Vec<[usize; 2]>,
    /// Pairs of bodies of which two shapes overlap at the standing pose (as far as the author gave one, with
    /// other joints at 0): their shapes are larger than the real bodies.
    pub overlapping: Vec<[usize; 2]>,
    /// Pairs that no motion within the joint limits brings together.
    pub apart: Vec<[usize; 2]>,
}

impl Pairs {
    /// Whether shapes `first` and `second` can make contact, with joints that are `limited` to their ranges or go on beyond them.
    #[inline]
    pub fn can_touch(&self, first: usize, second: usize, limited: bool) -> bool {
        let bit = first * self.shapes + second;
        let is_set = |bits: &[u64]| bits.get(bit / 64).is_some_and(|word| word >> (bit % 64) & 1 == 1);
        is_set(&self.touching) || !limited && is_set(&self.beyond)
    }

    /// The two bits of a pair.
    fn set(bits: &mut [u64], shapes: usize, [first, second]: [usize; 2]) {
        for bit in [first * shapes + second, second * shapes + first] {
            bits[bit / 64] |= 1 << (bit % 64);
        }
    }
}

/// What the search for pairs needs of a model.
pub struct PairFinder<'a> {
    /// Bodies, parents before children.
    pub bodies: &'a [Body],
    /// Joints that close loops.
    pub loops: &'a [LoopJoint],
    /// Ranges of motion, one a joint.
    pub limits: &'a [Option<[f64; 2]>],
    /// The bodies of the shapes.
    pub shapes: &'a [GroundShape],
    /// Their solids.
    pub solids: &'a [Convex],
    /// Joint angles of the standing pose, rad or m.
    pub standing: &'a [f64],
}

impl PairFinder<'_> {
    /// Sorts all pairs of shapes of different bodies.
    pub fn pairs(&self) -> Pairs {
        let shapes = self.shapes.len();
        let bits = vec![0; (shapes * shapes).div_ceil(64)];
        let mut pairs = Pairs { shapes, touching: bits.clone(), beyond: bits, ..Pairs::default() };
        let bodies = self.standing_bodies();
        let standing: Vec<(Pose, Vector)> = self
            .shapes
            .iter()
            .zip(self.solids)
            .map(|(shape, solid)| {
                let body = bodies[shape.body];
                (solid.placed(&body), body.transform_point(vector(solid.center)))
            })
            .collect();
        let mut overlapping = BTreeSet::new();
        for (first, second) in index_pairs(shapes) {
            let bodies = [self.shapes[first].body, self.shapes[second].body];
            if bodies[0] != bodies[1] && self.overlap([first, second], &standing) {
                overlapping.insert(bodies);
            }
        }
        for (first, second) in index_pairs(shapes) {
            let bodies = [self.shapes[first].body, self.shapes[second].body];
            if bodies[0] == bodies[1] {
                continue;
            }
            if self.joined(bodies) {
                pairs.joined.push([first, second]);
            } else if overlapping.contains(&bodies) || overlapping.contains(&[bodies[1], bodies[0]]) {
                pairs.overlapping.push([first, second]);
            } else if self.can_meet([first, second]) {
                Pairs::set(&mut pairs.touching, shapes, [first, second]);
                pairs.count += 1;
            } else {
                Pairs::set(&mut pairs.beyond, shapes, [first, second]);
                pairs.apart.push([first, second]);
            }
        }
        pairs
    }

    /// Frames of all bodies at the standing pose, in that of the root.
    fn standing_bodies(&self) -> Vec<Pose> {
        let mut frames: Vec<Isometry3<f64>> = vec![Isometry3::identity()];
        for (body, angle) in self.bodies.iter().skip(1).zip(self.standing) {
            frames.push(frames[body.parent] * pose_in_parent(body, *angle));
        }
        frames.iter().map(in_parry).collect()
    }

    /// Whether two shapes overlap where they are `placed` (their frames, and the centres of their bounding spheres).
    fn overlap(&self, [first, second]: [usize; 2], placed: &[(Pose, Vector)]) -> bool {
        let solids = [first, second].map(|shape| &self.solids[shape]);
        let [(frame, center), (other_frame, other_center)] = [placed[first], placed[second]];
        center.distance(other_center) < solids[0].reach + solids[1].reach
            && distance(solids, &(frame.inverse() * other_frame)) <= 0.0
    }

    /// Whether some motion may bring two shapes together.
    fn can_meet(&self, shapes: [usize; 2]) -> bool {
        let bodies = shapes.map(|shape| self.shapes[shape].body);
        self.path(bodies).is_none_or(|path| Pair { finder: self, shapes, path }.can_meet())
    }

    /// Whether one of the bodies carries the other, or a loop's joint is between them.
    fn joined(&self, [a, b]: [usize; 2]) -> bool {
        let closes = |closing: &LoopJoint| closing.bodies == [a, b] || closing.bodies == [b, a];
        self.hangs_on(a, b) || self.hangs_on(b, a) || self.loops.iter().any(closes)
    }

    /// Whether `child` hangs on `parent` by one joint, or by hinges about one point (a hip that abducts and swings), which are one joint
    /// by design however many links a file needs for it.
    fn hangs_on(&self, child: usize, parent: usize) -> bool {
        let apart = SAME_PLACE * self.reach(child);
        let mut body = child;
        while body > 0 {
            let Body { parent: carrier, offset, .. } = self.bodies[body];
            if carrier == parent {
                return true;
            }
            if self.bodies[carrier].dof != DofKind::Revolute || offset.norm() > apart {
                return false;
            }
            body = carrier;
        }
        false
    }

    /// Distance of the farthest point of a body's shapes from its joint, m.
    fn reach(&self, body: usize) -> f64 {
        self.shapes.iter().filter(|shape| shape.body == body).map(|shape| shape.farthest).fold(0.0, f64::max)
    }

    /// The joints between two bodies, those nearer to the root first on each side; `None` if they are too
    /// many.
    fn path(&self, [a, b]: [usize; 2]) -> Option<Vec<Step>> {
        let (mut ends, mut path) = ([a, b], Vec::new());
        while ends[0] != ends[1] {
            if path.len() == JOINTS {
                return None;
            }
            let side = usize::from(ends[1] > ends[0]);
            let body = ends[side];
            path.push(Step { joint: body - 1, side });
            ends[side] = self.bodies[body].parent;
        }
        path.reverse();
        Some(path)
    }
}

/// A joint on the path, and to which of the two shapes it leads.
#[derive(Debug, Clone, Copy)]
struct Step {
    joint: usize,
    side: usize,
}

struct Pair<'a> {
    finder: &'a PairFinder<'a>,
    shapes: [usize; 2],
    path: Vec<Step>,
}

/// A box of joint angles.
struct Region {
    middle: Vec<f64>,
    half: Vec<f64>,
}

impl Pair<'_> {
    /// Distance of the shapes with the joints of the path at `angles`.
    fn gap(&self, angles: &[f64]) -> f64 {
        let mut ends = [Isometry3::identity(); 2];
        for (step, angle) in self.path.iter().zip(angles) {
            ends[step.side] *= pose_in_parent(&self.finder.bodies[step.joint + 1], *angle);
        }
        let solids = self.shapes.map(|shape| &self.finder.solids[shape]);
        let [first, second] = [0, 1].map(|side| solids[side].placed(&in_parry(&ends[side])));
        distance(solids, &(first.inverse() * second))
    }

    /// Whether some motion may bring the shapes together.
    fn can_meet(&self) -> bool {
        let Some(whole) = self.ranges() else { return true };
        let arms = self.arms(&whole);
        let mut open = vec![whole];
        for _ in 0..POSES {
            let Some(region) = open.pop() else { return false };
            let gap = self.gap(&region.middle);
            let changes: Vec<f64> = arms.iter().zip(&region.half).map(|(arm, half)| arm * half).collect();
            if gap <= 0.0 {
                return true;
            }
            if gap > changes.iter().sum::<f64>() {
                continue;
            }
            let Some(widest) = (0..changes.len()).max_by(|a, b| changes[*a].total_cmp(&changes[*b])) else {
                return true;
            };
            for sign in [-1.0, 1.0] {
                let mut part = Region { middle: region.middle.clone(), half: region.half.clone() };
                part.half[widest] /= 2.0;
                part.middle[widest] += sign * part.half[widest];
                open.push(part);
            }
        }
        !open.is_empty()
    }

    /// All angles that the joints of the path can have; `None` if one of them is an unlimited prismatic joint.
    fn ranges(&self) -> Option<Region> {
        let range =
            |step: &Step| match (self.finder.limits[step.joint], self.finder.bodies[step.joint + 1].dof) {
                (Some(limits), _) => Some(limits),
                (None, DofKind::Revolute) => Some([-PI, PI]),
                (None, DofKind::Prismatic) => None,
            };
        let ranges: Vec<[f64; 2]> = self.path.iter().map(range).collect::<Option<_>>()?;
        Some(Region {
            middle: ranges.iter().map(|[lower, upper]| (lower + upper) / 2.0).collect(),
            half: ranges.iter().map(|[lower, upper]| (upper - lower) / 2.0).collect(),
        })
    }

    /// Moment arms r_k: how far a radian (or a metre) of each joint of the path can move the shape beyond it, m.
    fn arms(&self, ranges: &Region) -> Vec<f64> {
        let mut beyond = self.shapes.map(|shape| {
            let solid = &self.finder.solids[shape];
            solid.center.norm() + solid.reach
        });
        let mut arms = vec![0.0; self.path.len()];
        for (index, step) in self.path.iter().enumerate().rev() {
            let body = &self.finder.bodies[step.joint + 1];
            let farthest = ranges.middle[index].abs() + ranges.half[index];
            arms[index] = match body.dof {
                DofKind::Revolute => beyond[step.side],
                DofKind::Prismatic => {
                    beyond[step.side] += farthest;
                    1.0
                }
            };
            beyond[step.side] += body.offset.norm();
        }
        arms
    }
}

/// Every pair of indices below `count`, in ascending order.
fn index_pairs(count: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
}

/// Distance of two solids, the second's frame in the first's being `pose`; not positive where they overlap.
fn distance([first, second]: [&Convex; 2], pose: &Pose) -> f64 {
    first.approach(second, pose, f64::INFINITY).map_or(f64::INFINITY, |approach| approach.gap)
}

fn in_parry(pose: &Isometry3<f64>) -> Pose {
    frame(pose.rotation.to_rotation_matrix().matrix(), pose.translation.vector)
}

/// The frame of `body` in its parent's, with its joint at `angle`.
fn pose_in_parent(body: &Body, angle: f64) -> Isometry3<f64> {
    let joint_rotation = UnitQuaternion::from_matrix(&body.joint_rotation);
    let axis = Unit::new_unchecked(body.axis);
    let (rotation, shift) = match body.dof {
        DofKind::Revolute => (UnitQuaternion::from_axis_angle(&axis, angle), Vector3::zeros()),
        DofKind::Prismatic => (UnitQuaternion::identity(), body.axis * angle),
    };
    Isometry3::from_parts(Translation3::from(body.offset + joint_rotation * shift), joint_rotation * rotation)
}
