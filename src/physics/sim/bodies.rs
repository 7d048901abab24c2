//! The bodies of a character at one moment, whatever the coordinates.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::per_body::{Motions, PerBody};
use super::spatial::{RigidInertia, SpatialMotion, WideInertia, WideMotion};
use crate::model::wide::{LANES, Wide, WideMatrix, WideVector};
use crate::model::{BodyGroup, Model, Parents, Slot};

/// Pose, velocity and inertia of a body, along the world axes about the common point (the origin of
/// the root link).
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion {
    /// Orientation: from the body's to the world's axes.
    pub rotation: Matrix3<f64>,
    /// Origin of the body frame relative to the common point, m.
    pub origin: Vector3<f64>,
    /// S of the body's joint: velocity per unit of joint rate, about the common point; zero for the root.
    pub motion_subspace: SpatialMotion,
    /// Velocity, about the common point.
    pub velocity: SpatialMotion,
    /// Centre of mass relative to the common point, m.
    pub center: Vector3<f64>,
    /// Inertia about the common point.
    pub inertia: RigidInertia,
}

impl BodyMotion {
    /// A point given in the body frame, relative to the common point, m.
    #[inline]
    pub fn point(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * local
    }
}

/// Poses and inertias of a group of bodies: fields of [`BodyMotion`], side by side.
#[derive(Debug, Clone, Copy)]
pub struct BodyLanes {
    pub rotation: WideMatrix,
    pub origin: WideVector,
    pub motion_subspace: WideMotion,
    pub center: WideVector,
    pub inertia: WideInertia,
}

/// All bodies of a character, side by side in the groups of its model.
#[derive(Debug, Clone)]
pub struct Bodies {
    slots: Arc<[Slot]>,
    /// Poses and inertias, one for each of the model's groups.
    pub groups: Vec<BodyLanes>,
    /// Velocities.
    pub velocity: Motions,
    /// Rotations and origins of parents that do not stand side by side.
    gathered: (WideMatrix, WideVector),
}

impl Bodies {
    /// Those of `model`, all at the common point and at rest.
    pub fn new(model: &Model) -> Self {
        let group = BodyLanes {
            rotation: Wide::all(Matrix3::identity()),
            origin: Wide::ZERO,
            motion_subspace: Wide::ZERO,
            center: Wide::ZERO,
            inertia: Wide::ZERO,
        };
        Self {
            slots: model.slots.clone(),
            groups: vec![group; model.groups.len()],
            velocity: PerBody::new(model, SpatialMotion::ZERO),
            gathered: (group.rotation, group.origin),
        }
    }

    /// How many there are.
    #[allow(clippy::len_without_is_empty)] // there is always the root
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Body `index`.
    #[inline(always)] // what is not used of it is not read
    pub fn at(&self, index: usize) -> BodyMotion {
        let Slot { group, lane } = self.slots[index];
        let (lane, velocity) = (lane % LANES, &self.velocity.groups[group]);
        let group = &self.groups[group];
        BodyMotion {
            rotation: group.rotation.at(lane),
            origin: group.origin.at(lane),
            motion_subspace: group.motion_subspace.at(lane),
            velocity: velocity.at(lane),
            center: group.center.at(lane),
            inertia: group.inertia.at(lane),
        }
    }

    /// Sets body `index`.
    pub fn set(&mut self, index: usize, body: BodyMotion) {
        let Slot { group, lane } = self.slots[index];
        let group = &mut self.groups[group];
        group.rotation.set(lane, body.rotation);
        group.origin.set(lane, body.origin);
        group.motion_subspace.set(lane, body.motion_subspace);
        group.center.set(lane, body.center);
        group.inertia.set(lane, body.inertia);
        self.velocity.set(index, body.velocity);
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = BodyMotion> + '_ {
        (0..self.len()).map(|index| self.at(index))
    }

    /// Rotations and origins of the parents of `group`'s bodies, and the bodies themselves; the group is the one at `index`.
    #[inline(always)] // part of the kernels
    pub fn outward(&mut self, index: usize, group: &BodyGroup) -> (&WideMatrix, &WideVector, &mut BodyLanes) {
        let (before, rest) = self.groups.split_at_mut(index);
        let own = &mut rest[0];
        match &group.parents {
            Parents::Beside(parents) => (&before[*parents].rotation, &before[*parents].origin, own),
            Parents::Each(slots) => {
                let (rotations, origins) = &mut self.gathered;
                for (lane, slot) in slots.iter().enumerate() {
                    let parents = &before[slot.group];
                    rotations.copy_lane(lane, &parents.rotation, slot.lane % LANES);
                    origins.copy_lane(lane, &parents.origin, slot.lane % LANES);
                }
                (rotations, origins, own)
            }
        }
    }
}
