//! The character half a step away from where forces are taken.

use super::kinematics::place;
use crate::model::Model;
use crate::sim::bodies::BodyMotion;
use crate::sim::energy::kinetic_energy;
use crate::sim::integrate::advance;
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;

/// The character half a step away from where forces are taken.
#[derive(Debug, Clone)]
pub struct Displaced {
    state: State,
    pub bodies: Vec<BodyMotion>,
}

impl Displaced {
    /// Room for `model`.
    pub fn new(model: &Model) -> Self {
        Self { state: State::new(model), bodies: vec![BodyMotion::REST; model.bodies.len()] }
    }

    /// The character of `from` moved for `time` seconds along the velocity `root` of its root and the joint
    /// velocities `rates`, with which it moves there too. Gives its kinetic energy, J.
    pub fn displace(
        &mut self,
        model: &Model,
        from: &State,
        root: SpatialMotion,
        rates: &[f64],
        time: f64,
    ) -> f64 {
        let Self { state, bodies } = self;
        state.root = from.root;
        state.root.linear_velocity = root.linear;
        state.root.angular_velocity = root.angular;
        state.angles.copy_from_slice(&from.angles);
        state.velocities.copy_from_slice(rates);
        advance(state, root, rates, time);
        place(model, state, bodies);
        kinetic_energy(model, bodies, rates)
    }
}
