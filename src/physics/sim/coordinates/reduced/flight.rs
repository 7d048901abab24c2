//! Momentum in free flight: a step of any scheme ends with that of its beginning and the impulse of the weight; and the energy
//! of a whirl.
//!
//! Once the root's velocities are those that momentum asks for at the new pose, the paper's step is no longer symmetric in time: the
//! root's velocities belong to the end of the step, those of the joints to its middle. A chain that whirls gains energy by that
//! in every step, in proportion to the step (measured: a chain of twelve links at 2 ms gained a third a second). In flight the energy is known as
//! momentum is: it changes by the work of the weight and of what acts along the joints. The kinetic energy is a sum of that of a rigid
//! motion, which has all the momentum, and of that of the motion against it (Wieber 2006), in which joint velocities are a common
//! factor. That factor makes up the difference, a projection onto both invariants (Hairer, Lubich & Wanner 2006, section IV.4):
//! it is 1 but for the step's own error, of second order, and leaves the scheme its order.

use nalgebra::Vector3;

use super::kinematics::{move_along, place};
use crate::model::Model;
use crate::sim::bodies::Bodies;
use crate::sim::energy::kinetic_energy;
use crate::sim::momentum::{Composite, Momentum};
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;

/// Least and greatest factor of a step. Where most of the energy is that of the rigid motion, the little that is left cannot make
/// up for its errors; energy may be taken faster than given.
const FACTORS: [f64; 2] = [0.5, 1.05];

/// The factor that gives velocities against the rigid motion, whose kinetic energy is `present`, the energy `wanted`, J.
pub fn factor_of_whirl(wanted: f64, present: f64) -> f64 {
    let square = wanted / present;
    if square.is_nan() { 1.0 } else { square.max(0.0).sqrt().clamp(FACTORS[0], FACTORS[1]) }
}

/// The bodies of a state, placed where the last step in flight ended or where this one begins.
///
/// What it holds follows from the state alone, so that a simulation continued elsewhere from the same state gives the
/// same bits.
#[derive(Debug, Clone)]
pub struct Flight {
    /// The root, the angles and the velocities of that state.
    at: State,
    /// Whether `composite` is that of `at`.
    known: bool,
    /// Whether `bodies` are those of `at`, with their velocities.
    placed: bool,
    composite: Composite,
    bodies: Bodies,
}

impl Flight {
    /// Room for `model`.
    pub fn new(model: &Model) -> Self {
        Self {
            at: State::new(model),
            known: false,
            placed: false,
            composite: Composite::EMPTY,
            bodies: Bodies::new(model),
        }
    }

    /// Keeps the `state` from which a step begins.
    pub fn begin(&mut self, state: &State) {
        let same = self.at.root == state.root
            && self.at.angles == state.angles
            && self.at.velocities == state.velocities;
        if !same {
            self.keep(state);
            (self.known, self.placed) = (false, false);
        }
    }

    /// The joint velocities of the state that [`begin`](Self::begin) kept, rad/s or m/s.
    pub fn rates(&self) -> &[f64] {
        &self.at.velocities
    }

    /// Exchanges `bodies` for the placed ones of the state that [`begin`](Self::begin) kept, if they are there.
    pub fn take_bodies(&mut self, bodies: &mut Bodies) -> bool {
        let there = std::mem::take(&mut self.placed);
        if there {
            std::mem::swap(&mut self.bodies, bodies);
        }
        there
    }

    /// The momentum of the state that [`begin`](Self::begin) kept.
    pub fn momentum(&mut self, model: &Model) -> Momentum {
        if !self.known {
            self.place(model);
        }
        self.composite.momentum(self.at.root.motion())
    }

    /// Gives `state` the momentum `wanted` by its root's velocities, and where `energy` is known, that kinetic energy
    /// against the centre of mass, J, by a common factor of the joints' velocities against the rigid motion. `again` says whether the next
    /// step begins with the bodies placed there.
    pub fn end(
        &mut self,
        model: &Model,
        state: &mut State,
        wanted: Momentum,
        energy: Option<f64>,
        again: bool,
    ) {
        self.keep(state);
        let rigid = state.velocities.iter().all(|rate| *rate == 0.0);
        if rigid && state.root.angular_velocity == Vector3::zeros() {
            // The inertia is what it was, and so is the momentum.
            (self.known, self.placed) = (false, false);
            return;
        }
        self.place(model);
        if let Some(motion) = self.composite.correction(state.root.motion(), wanted) {
            state.root.linear_velocity += motion.linear;
            state.root.angular_velocity += motion.angular;
            self.at.root = state.root;
            if let Some(energy) = energy {
                self.scale(model, state, wanted, energy);
            }
        }
        if again {
            self.move_along(model, state.root.motion(), &state.velocities);
        }
        self.placed = again;
    }

    /// Scales the motion of `state` against the rigid one that has the momentum `wanted` to the kinetic energy
    /// `energy` against the centre of mass, J.
    fn scale(&mut self, model: &Model, state: &mut State, wanted: Momentum, energy: f64) {
        let Some(rigid) = self.composite.rigid_motion(wanted) else { return };
        self.move_along(model, state.root.motion().minus(rigid), &state.velocities);
        let internal = kinetic_energy(model, &self.bodies, &state.velocities);
        let of_rigid = self.composite.kinetic_energy(rigid) - wanted.energy_of_center(model.mass);
        let factor = factor_of_whirl(energy - of_rigid, internal);
        let root = rigid.plus_scaled(state.root.motion().minus(rigid), factor);
        (state.root.linear_velocity, state.root.angular_velocity) = (root.linear, root.angular);
        state.velocities.iter_mut().for_each(|rate| *rate *= factor);
        self.keep(state);
        // The joints' part of the momentum has changed with them. It is added up anew, as from this state, and not scaled.
        self.move_along(model, SpatialMotion::ZERO, &state.velocities);
        self.compose();
        if let Some(motion) = self.composite.correction(state.root.motion(), wanted) {
            state.root.linear_velocity += motion.linear;
            state.root.angular_velocity += motion.angular;
            self.at.root = state.root;
        }
    }

    /// Gives the placed bodies the velocities that go with `root` and `rates`.
    fn move_along(&mut self, model: &Model, root: SpatialMotion, rates: &[f64]) {
        let Bodies { groups, velocity, .. } = &mut self.bodies;
        move_along(model, groups, root, rates, velocity);
    }

    fn keep(&mut self, state: &State) {
        self.at.root = state.root;
        self.at.angles.copy_from_slice(&state.angles);
        self.at.velocities.copy_from_slice(&state.velocities);
    }

    /// Places the bodies of the kept state with the root at rest, and finds its composite.
    fn place(&mut self, model: &Model) {
        let root = self.at.root;
        self.at.root.linear_velocity.fill(0.0);
        self.at.root.angular_velocity.fill(0.0);
        place(model, &self.at, &mut self.bodies);
        self.at.root = root;
        self.compose();
    }

    /// Finds the composite of the kept state from the bodies as they move while the root is at rest.
    fn compose(&mut self) {
        self.composite = Composite::new(&self.bodies);
        (self.known, self.placed) = (true, false);
    }
}
