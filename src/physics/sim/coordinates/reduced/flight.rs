//! Momentum in free flight: a step of any scheme ends with that of its beginning and the impulse of the weight.

use nalgebra::Vector3;

use super::kinematics::{move_along, place};
use crate::model::Model;
use crate::sim::bodies::BodyMotion;
use crate::sim::momentum::{Composite, Momentum};
use crate::sim::state::State;

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
    bodies: Vec<BodyMotion>,
}

impl Flight {
    /// Room for `model`.
    pub fn new(model: &Model) -> Self {
        Self {
            at: State::new(model),
            known: false,
            placed: false,
            composite: Composite::EMPTY,
            bodies: vec![BodyMotion::REST; model.bodies.len()],
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

    /// Exchanges `bodies` for the placed ones of the state that [`begin`](Self::begin) kept, if they are there.
    pub fn take_bodies(&mut self, bodies: &mut Vec<BodyMotion>) -> bool {
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

    /// Gives `state` the momentum `wanted` by its root's velocities; `again` says whether the next step begins with the bodies
    /// placed there.
    pub fn end(&mut self, model: &Model, state: &mut State, wanted: Momentum, again: bool) {
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
        }
        if again {
            move_along(model, state.root.motion(), &state.velocities, &mut self.bodies);
        }
        self.placed = again;
    }

    fn keep(&mut self, state: &State) {
        self.at.root = state.root;
        self.at.angles.copy_from_slice(&state.angles);
        self.at.velocities.copy_from_slice(&state.velocities);
    }

    /// Finds the composite of the kept state.
    fn place(&mut self, model: &Model) {
        let root = self.at.root;
        self.at.root.linear_velocity.fill(0.0);
        self.at.root.angular_velocity.fill(0.0);
        place(model, &self.at, &mut self.bodies);
        self.at.root = root;
        self.composite = Composite::new(&self.bodies);
        (self.known, self.placed) = (true, false);
    }
}
