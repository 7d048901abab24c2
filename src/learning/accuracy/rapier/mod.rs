//! The same character in another engine: rapier3d's multibodies, for comparison.
//!
//! [`Rapier`] takes the model, plan and state of a [`Simulator`](gaitwright_physics::sim::Simulator) and steps them with
//! rapier3d 0.36 in double precision. A multibody is rapier's own tree in joint coordinates, with a dense
//! mass matrix, Coriolis terms that are partly implicit in the new velocity, and projected Gauss-Seidel on
//! contacts, limits, motors and dry friction, over a few substeps of each step. The same in both
//! engines are: masses and inertias, joint frames, armature, collision shapes, the ground, the coefficient of friction,
//! gravity, joint damping, dry friction, limits and the drives' spring, damper and greatest torque.
//!
//! Rapier's own, whatever the plan's accuracy asks for besides the step:
//!
//! - The step is divided into rapier's default number of substeps, of a few sweeps each. A motor's target changes only
//!   once a step, so it is set to where the moving target is at the mean of the substeps' beginnings.
//! - A multibody takes the linear velocity of its root for that of the centre of mass and turns the root about
//!   its origin. Here the root's frame is therefore at its centre of mass, where both are the same.
//! - Multibody joints damp rotation by 0.1 N m s/rad by default; here the damping is set to the plan's.
//! - A limit acts from the first step after it was crossed, so that it is crossed by up to the joint's speed times the
//!   step, and a motor's target velocity is reduced so that it does not lead beyond it.
//! - A contact is a stiff spring and damper that does not correct a penetration of less than [`LINEAR_SLOP`]. It
//!   acts from the distance [`PREDICTION`] on, before the shapes meet.
//! - A character without joints is a rigid body instead of a multibody; its gyroscopic term is implicit.
//! - Motors keep their greatest torque at any speed.
//! - Motors have no offset torque: tracking with feedforward is [`Unsupported`].
//! - A step allocates, and rapier resets a state that is not finite; here that ends the simulation.

mod world;

use std::sync::Arc;

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use rapier3d::dynamics::{MotorModel, Multibody, MultibodyJointHandle, RigidBodyHandle};
use rapier3d::math::{Rotation, Vector};
use rapier3d::pipeline::PhysicsWorld;

use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{Command, Failure, FailureCause, State, check_finite};

pub use world::{LINEAR_SLOP, PREDICTION, Unsupported};

/// A character in a scene, stepped through time by rapier.
pub struct Rapier {
    model: Arc<Model>,
    plan: Arc<StepPlan>,
    state: State,
    world: PhysicsWorld,
    /// One a body of the model.
    bodies: Vec<RigidBodyHandle>,
    /// Any joint of the multibody; `None` for a lone body.
    tree: Option<MultibodyJointHandle>,
}

impl Rapier {
    /// `model` in the scene of `plan` (compiled for this model), starting from `state`.
    ///
    /// # Errors
    /// [`Unsupported`] names the first thing that the plan asks for and rapier does not do.
    pub fn new(model: &Arc<Model>, plan: &Arc<StepPlan>, state: &State) -> Result<Self, Unsupported> {
        let world::Built { world, bodies, tree } = world::build(model, plan, state)?;
        Ok(Self { model: model.clone(), plan: plan.clone(), state: state.clone(), world, bodies, tree })
    }

    /// The present state, without the forces of the last step.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// One step of the plan's step length.
    ///
    /// A torque acts along the joint's axis as it is at the beginning of the step.
    ///
    /// # Errors
    /// [`Failure`] when a number became non-finite.
    ///
    /// # Panics
    /// If a slice of `command` does not have one number for each joint.
    pub fn step(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let joints = self.model.joint_count();
        match command {
            Command::Passive => {}
            Command::Torque(torque) => {
                assert_eq!(torque.len(), joints, "one torque a joint");
                self.apply_torques(torque);
            }
            Command::Velocity(wanted) => {
                assert_eq!(wanted.len(), joints, "one velocity a joint");
                self.set_velocity_motors(wanted);
            }
            Command::Track { now, next } => {
                assert_eq!((now.len(), next.len()), (joints, joints), "one target a joint");
                self.set_motors(now, next);
            }
        }
        self.world.step();
        self.state.time += self.plan.step();
        self.read();
        match command {
            Command::Passive => {}
            Command::Torque(_) => self.reset_torques(),
            Command::Velocity(_) | Command::Track { .. } => self.remove_motors(),
        }
        self.check()
    }

    /// Torques (forces along prismatic joints) on both bodies of each joint, until [`Self::reset_torques`].
    fn apply_torques(&mut self, torques: &[f64]) {
        let plan = self.plan.clone();
        let limits = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref());
        for (joint, torque) in torques.iter().copied().enumerate() {
            let most = limits.map_or(f64::INFINITY, |limits| limits[joint]);
            let torque = torque.clamp(-most, most);
            let body = &self.model.bodies[joint + 1];
            let (child, parent) = (self.bodies[joint + 1], self.bodies[body.parent]);
            let carried = &self.world.bodies[child];
            let along = *carried.rotation() * world::vector(body.axis) * torque;
            let at = carried.center_of_mass();
            match body.dof {
                DofKind::Revolute => {
                    self.world.bodies[child].add_torque(along, false);
                    self.world.bodies[parent].add_torque(-along, false);
                }
                DofKind::Prismatic => {
                    self.world.bodies[child].add_force_at_point(along, at, false);
                    self.world.bodies[parent].add_force_at_point(-along, at, false);
                }
            }
        }
    }

    /// Removes the torques of [`Self::apply_torques`].
    fn reset_torques(&mut self) {
        for body in &self.bodies {
            self.world.bodies[*body].reset_forces(false);
            self.world.bodies[*body].reset_torques(false);
        }
    }

    /// Sets the motors to targets that move from `now` to `next` over the step.
    fn set_motors(&mut self, now: &[f64], next: &[f64]) {
        let plan = self.plan.clone();
        let Some(drive) = &plan.drive else { return };
        let substeps = self.world.integration_parameters.num_solver_iterations.max(1) as f64;
        // Substep k = 0, …, n − 1 begins at the share k/n of the step: the mean is (n − 1) / 2n.
        let share = 0.5 * (1.0 - 1.0 / substeps);
        self.each_joint(|joint, axis, data| {
            let (stiffness, damping) = (drive.stiffness[joint], drive.damping[joint]);
            if stiffness + damping == 0.0 {
                // Rapier treats a motor without spring and damper as a rigid one.
                return;
            }
            let change = next[joint] - now[joint];
            data.set_motor_model(axis, MotorModel::ForceBased);
            data.set_motor(axis, now[joint] + share * change, change / plan.step(), stiffness, damping);
            let strongest = drive.max_torque.as_ref().map_or(f64::MAX, |limits| limits[joint].min(f64::MAX));
            data.set_motor_max_force(axis, strongest);
        });
    }

    /// Sets the motors to the velocities `wanted`, each with a damper of 10⁶ times the character's mass.
    fn set_velocity_motors(&mut self, wanted: &[Option<f64>]) {
        let plan = self.plan.clone();
        let limits = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref());
        let damping = 1e6 * self.model.mass;
        self.each_joint(|joint, axis, data| {
            let Some(wanted) = wanted[joint] else { return };
            data.set_motor_model(axis, MotorModel::ForceBased);
            data.set_motor_velocity(axis, wanted, damping);
            data.set_motor_max_force(axis, limits.map_or(f64::MAX, |limits| limits[joint].min(f64::MAX)));
        });
    }

    /// Removes the motors, so that joints are passive until the next command.
    fn remove_motors(&mut self) {
        self.each_joint(|_, axis, data| data.motor_axes.remove(axis.into()));
    }

    /// Calls `visit` with the index, the free axis and the rapier joint of every joint.
    fn each_joint(
        &mut self,
        mut visit: impl FnMut(usize, rapier3d::dynamics::JointAxis, &mut rapier3d::dynamics::GenericJoint),
    ) {
        let Some((tree, _)) = self.tree.and_then(|tree| self.world.multibody_joints.get_mut(tree)) else {
            return;
        };
        for (joint, link) in tree.links_mut().skip(1).enumerate() {
            visit(joint, world::axis(self.model.bodies[joint + 1].dof), &mut link.joint.data);
        }
    }

    /// Reads the state back from rapier's bodies and joints.
    fn read(&mut self) {
        let Self { model, state, world, bodies, tree, .. } = self;
        let tree: Option<&Multibody> =
            tree.and_then(|tree| world.multibody_joints.get(tree)).map(|(tree, _)| tree);
        if let Some(tree) = tree {
            let rates = tree.generalized_velocity();
            for (joint, link) in tree.links().skip(1).enumerate() {
                state.angles[joint] = link.joint().coords()[world::coordinate(model.bodies[joint + 1].dof)];
                state.velocities[joint] = rates[link.assembly_id()];
            }
        }
        if model.fixed_base {
            return;
        }
        let body = &world.bodies[bodies[0]];
        let (linear, angular) = match tree {
            None => (vector3(body.linvel()), vector3(body.angvel())),
            Some(tree) => {
                let rates = tree.generalized_velocity();
                (Vector3::new(rates[0], rates[1], rates[2]), Vector3::new(rates[3], rates[4], rates[5]))
            }
        };
        let root = &mut state.root;
        root.orientation = orientation(*body.rotation());
        let center = root.orientation * model.bodies[0].center;
        root.position = Point3::from(vector3(body.translation()) - center);
        root.angular_velocity = angular;
        root.linear_velocity = linear - angular.cross(&center);
    }

    /// Fails if rapier quarantined a body or a number of the state is not finite.
    fn check(&self) -> Result<(), Failure> {
        let cause = FailureCause::OtherEngine("the state became non-finite in rapier");
        let quarantined = self.world.quarantine().bodies().first();
        if let Some(index) = quarantined.and_then(|lost| self.bodies.iter().position(|body| body == lost)) {
            let place = match index.checked_sub(1) {
                None => format!("root link {}", self.model.character.links[0].name),
                Some(joint) => format!("body of joint {}", self.model.joint_names[joint]),
            };
            return Err(Failure { time: self.state.time, place, cause });
        }
        check_finite(&self.model, &self.state).map_err(|failure| Failure { cause, ..failure })
    }
}

fn vector3(vector: Vector) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

fn orientation(rotation: Rotation) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(rotation.w, rotation.x, rotation.y, rotation.z))
}
