//! Rows of joints: what holds two bodies together (rows e, Tokizaki & Hasegawa eqs. 6, 10 and 15).
//!
//! A joint leaves some relative motions S of its child against its parent, and transmits the wrenches
//! T with Tᵀ S = 0 (Featherstone 2008, section 3.5). Of a relative velocity V it asks Tᵀ V⁺ = 0, row by row: a
//! direction d of translation is the wrench of a force d at the child's end of the joint, one of rotation
//! the moment d. The row's error is how far the two ends have come apart along d; under stabilisation
//! the bias takes back a share of it each step (Baumgarte 1972). Unlike what corrects contacts, it acts on the
//! velocities themselves. A body on a circle that goes straight ahead leaves it by (ω h)² / 2 of its radius in a
//! step, and where just that is taken back in each, its velocity is along the chord, whose component along the
//! next tangent is neither longer nor shorter than along the last; velocities along each new tangent would
//! gain the square of ω h.

use std::ops::Range;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use super::stabilization::{Recovery, SHARE_PER_STEP};
use crate::character::LoopKind;
use crate::model::wide::Lanes;
use crate::model::{DofKind, LoopJoint, Model};
use crate::sim::bodies::{Bodies, BodyMotion};
use crate::sim::lcp::Bound;
use crate::sim::per_body::Motions;
use crate::sim::spatial::{SpatialForce, SpatialMotion};

/// Directions in which the two ends of a joint are held together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HeldDirections {
    /// All.
    All,
    /// All, by two across an axis of unit length and one along it.
    AllAbout(Vector3<f64>),
    /// Those across an axis, of unit length.
    Across(Vector3<f64>),
    /// None.
    None,
}

/// How two bodies are to stay together, at one moment; along the world axes about the common point.
#[derive(Debug, Clone, Copy)]
pub struct Coupling {
    /// Index of the child body.
    pub child: usize,
    /// Index of the parent body.
    pub parent: usize,
    /// The child's end, m.
    at: Vector3<f64>,
    translations: HeldDirections,
    rotations: HeldDirections,
    /// The child's end less the parent's, m.
    position_error: Vector3<f64>,
    /// Rotation vector from the parent's end to the child's, where rotations are held, rad.
    rotation_error: Vector3<f64>,
}

impl HeldDirections {
    /// The directions, of unit length and square to each other.
    fn directions(self) -> ([Vector3<f64>; 3], usize) {
        match self {
            Self::All => ([Vector3::x(), Vector3::y(), Vector3::z()], 3),
            Self::AllAbout(axis) => {
                let [first, second] = across(axis);
                ([second, first, axis], 3)
            }
            Self::Across(axis) => {
                let [first, second] = across(axis);
                ([first, second, Vector3::zeros()], 2)
            }
            Self::None => ([Vector3::zeros(); 3], 0),
        }
    }

    /// The component of `vector` in the held directions, which ought to vanish.
    fn held_component(self, vector: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::All | Self::AllAbout(_) => vector,
            Self::Across(axis) => vector - axis * axis.dot(&vector),
            Self::None => Vector3::zeros(),
        }
    }
}

impl Coupling {
    /// Of joint `joint` of the tree, with the bodies where they are.
    pub fn of_joint(model: &Model, bodies: &Bodies, joint: usize) -> Self {
        let child = joint + 1;
        let body = &model.bodies[child];
        let (own, parent) = (&bodies.at(child), &bodies.at(body.parent));
        let frame = parent.rotation * body.joint_rotation;
        let axis = frame * body.axis;
        let position_error = own.origin - parent.point(body.offset);
        let (translations, rotations, rotation_error) = match body.dof {
            DofKind::Revolute => {
                (HeldDirections::All, HeldDirections::Across(axis), axis.cross(&(own.rotation * body.axis)))
            }
            DofKind::Prismatic => {
                (HeldDirections::Across(axis), HeldDirections::All, rotation_between(&frame, &own.rotation))
            }
        };
        Self {
            child,
            parent: body.parent,
            at: own.origin,
            translations,
            rotations,
            position_error,
            rotation_error,
        }
    }

    /// Of loop `index`, whose second body is the child.
    pub fn of_loop(model: &Model, bodies: &Bodies, index: usize) -> Self {
        let LoopJoint { kind, bodies: [parent, child], origins: at, rotations: turns, axis } =
            &model.loops[index];
        let (own, other) = (&bodies.at(*child), &bodies.at(*parent));
        let (to, from) = (own.rotation * turns[1], other.rotation * turns[0]);
        let end = own.point(at[1]);
        let axis_there = from * axis;
        let (translations, rotations, rotation_error) = match kind {
            LoopKind::Ball => {
                (HeldDirections::AllAbout(carrying_axis(own)), HeldDirections::None, Vector3::zeros())
            }
            LoopKind::Revolute => (
                HeldDirections::AllAbout(axis_there),
                HeldDirections::Across(axis_there),
                axis_there.cross(&(to * axis)),
            ),
            LoopKind::Prismatic => {
                (HeldDirections::Across(axis_there), HeldDirections::All, rotation_between(&from, &to))
            }
            LoopKind::Fixed => {
                let about = carrying_axis(own);
                (
                    HeldDirections::AllAbout(about),
                    HeldDirections::AllAbout(about),
                    rotation_between(&from, &to),
                )
            }
        };
        let position_error = end - other.point(at[0]);
        Self {
            child: *child,
            parent: *parent,
            at: end,
            translations,
            rotations,
            position_error,
            rotation_error,
        }
    }

    /// How far the two ends are apart: the greater of the distance (m) and the angle (rad).
    pub fn separation(&self) -> f64 {
        self.translations
            .held_component(self.position_error)
            .norm()
            .max(self.rotations.held_component(self.rotation_error).norm())
    }

    /// How many of the rows hold translations; they come first.
    pub fn translations(&self) -> usize {
        self.translations.directions().1
    }

    /// Calls `take` with the wrench on the child and the error of every row: translations, then
    /// rotations.
    pub fn each(&self, mut take: impl FnMut(SpatialForce, f64)) {
        let (directions, count) = self.translations.directions();
        for direction in &directions[..count] {
            take(SpatialForce::at(self.at, *direction), direction.dot(&self.position_error));
        }
        let (directions, count) = self.rotations.directions();
        for direction in &directions[..count] {
            take(
                SpatialForce { moment: *direction, force: Vector3::zeros() },
                direction.dot(&self.rotation_error),
            );
        }
    }
}

/// Adds the rows of `coupling`, which belong to `owner`.
///
/// `free` gives each body's velocity if no row acted, `wanted` the child's velocity against the parent's after
/// the step; a fifth of what is apart is taken back in every `period`, s, no faster than at `recovery`. `half_solve` half-solves
/// the row of a wrench on the child and its opposite on the parent (see [`Rows::push`]).
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    owner: RowOwner,
    coupling: &Coupling,
    free: &Motions,
    wanted: SpatialMotion,
    period: f64,
    recovery: Recovery,
    mut half_solve: impl FnMut(SpatialForce, &mut Vec<Lanes>) -> Range<usize>,
) {
    let velocity = free.at(coupling.child).plus(free.at(coupling.parent).plus(wanted).scaled(-1.0));
    let mut translations = coupling.translations();
    coupling.each(|wrench, error| {
        let fastest = if translations > 0 { recovery.translation } else { recovery.rotation };
        translations = translations.saturating_sub(1);
        let back = (SHARE_PER_STEP * error / period).max(-fastest).min(fastest);
        let offset = velocity.dot(wrench) + back;
        let row = Row::new(owner, Bound::Free, offset);
        rows.push([row], |numbers| half_solve(wrench, numbers));
    });
}

/// The axis of a body's own joint, or the vertical for the root: in a planar loop, that across its plane.
fn carrying_axis(body: &BodyMotion) -> Vector3<f64> {
    let [rotation, slide] = [body.motion_subspace.angular, body.motion_subspace.linear];
    let axis = if rotation == Vector3::zeros() { slide } else { rotation };
    axis.try_normalize(0.0).unwrap_or_else(Vector3::z)
}

/// Two directions across `axis` and square to each other, all of unit length.
fn across(axis: Vector3<f64>) -> [Vector3<f64>; 2] {
    // The world axis that is farthest from it.
    let reference = Vector3::ith(axis.iamin(), 1.0);
    let first = axis.cross(&reference).normalize();
    [first, axis.cross(&first)]
}

/// The rotation vector from the frame `from` to `to`, rad.
fn rotation_between(from: &Matrix3<f64>, to: &Matrix3<f64>) -> Vector3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(to * from.transpose());
    // The angle of a matrix is the arc cosine of its trace, which rounding takes out of range.
    UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis()
}
