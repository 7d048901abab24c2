//! The character as one rigid body whose shape is changing, with the motion of its joints prescribed.

use super::articulated::Articulated;
use super::root::RootFactor;
use crate::model::Model;
use crate::sim::bodies::Bodies;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::{ArticulatedInertia, RigidInertia, SpatialForce, SpatialMotion};

/// The character as one rigid body of changing shape.
#[derive(Debug, Clone)]
pub struct RigidCharacter {
    /// Composite-rigid-body inertia of each body with all beyond it. (prescribe)
    composite: Vec<RigidInertia>,
    /// Force that each body with all beyond it requires when the root does not accelerate. (prescribe, push)
    taken: Vec<SpatialForce>,
    /// Acceleration of each body besides its bias acceleration, when the root does not accelerate. (prescribe)
    acceleration: Vec<SpatialMotion>,
    /// The root's factor, of the whole character's inertia.
    pub root: RootFactor,
    /// Acceleration of the root less gravity: without contacts (prescribe), then with them (accelerate_root).
    root_minus_gravity: SpatialMotion,
}

impl RigidCharacter {
    /// Room for a model of `bodies` bodies.
    pub fn new(bodies: usize) -> Self {
        Self {
            composite: vec![RigidInertia::ZERO; bodies],
            taken: vec![SpatialForce::ZERO; bodies],
            acceleration: vec![SpatialMotion::ZERO; bodies],
            root: RootFactor::EMPTY,
            root_minus_gravity: SpatialMotion::ZERO,
        }
    }

    /// Prescribes `joint_acceleration` and returns the root's acceleration without contacts, or
    /// `None` if the character has no inertia.
    #[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
    pub fn prescribe(
        &mut self,
        model: &Model,
        bodies: &Bodies,
        articulated: &Articulated,
        joint_acceleration: &[f64],
        freedom: RootFreedom,
        minus_gravity: SpatialMotion,
        prescribed: SpatialMotion,
    ) -> Option<SpatialMotion> {
        self.acceleration[0] = SpatialMotion::ZERO;
        for index in 0..bodies.len() {
            let body = &bodies.at(index);
            if index > 0 {
                self.acceleration[index] = self.acceleration[model.bodies[index].parent]
                    .plus_scaled(body.motion_subspace, joint_acceleration[index - 1]);
            }
            self.composite[index] = body.inertia;
            self.taken[index] =
                articulated.bias_force.at(index).plus(body.inertia.times(self.acceleration[index]));
        }
        for &index in model.outward.iter().rev() {
            let parent = model.bodies[index].parent;
            self.composite[parent] = self.composite[parent].plus(self.composite[index]);
            self.taken[parent] = self.taken[parent].plus(self.taken[index]);
        }
        let whole = ArticulatedInertia::from(self.composite[0]);
        self.root = RootFactor::new(freedom, &whole)?;
        let prescribed = if freedom == RootFreedom::Fixed { minus_gravity } else { prescribed };
        self.root_minus_gravity = self.root.accelerate(&whole, self.taken[0].scaled(-1.0), prescribed);
        Some(self.root_minus_gravity.plus(minus_gravity.scaled(-1.0)))
    }

    /// Adds a contact force on `body`, which changes what it and the bodies between it and the root require.
    pub fn push(&mut self, model: &Model, mut body: usize, force: SpatialForce) {
        loop {
            self.taken[body] = self.taken[body].plus(force.scaled(-1.0));
            if body == 0 {
                return;
            }
            body = model.bodies[body].parent;
        }
    }

    /// Takes the change of the root's acceleration that the contacts bring.
    pub fn accelerate_root(&mut self, change: SpatialMotion) {
        self.root_minus_gravity = self.root_minus_gravity.plus(change);
    }

    /// Torque of joint `joint` that goes with the prescribed motion, N m or N, apart from armature
    /// and damping.
    #[inline]
    pub fn torque(&self, bodies: &Bodies, joint: usize) -> f64 {
        let index = joint + 1;
        let of_root = self.composite[index].times(self.root_minus_gravity);
        bodies.at(index).motion_subspace.dot(self.taken[index].plus(of_root))
    }
}
