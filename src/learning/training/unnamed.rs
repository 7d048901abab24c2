//! From a behaviour of QDSEGA to a motion.

use gaitwright_physics::scene::Gains;

use super::motion::LearnedMotion;
use crate::learn::{AskedSpeed, Behaviour, LearningSetup, Objective, Pace, Task, reference_gravity};
use crate::program::legs::Legs;

/// The task of `setup` with a speed in place of a Froude number: that is one of the hips, of which QDSEGA knows nothing.
pub(super) fn in_speed(setup: &LearningSetup) -> Task {
    let LearningSetup { task, model, stance, scene, .. } = setup;
    let height = || Legs::hip_height_of(model, stance, task.direction);
    match task.froude.map(|_| task.pace(reference_gravity(scene) * height())) {
        Some(Pace::At(speed)) => {
            Task { speed: Some(AskedSpeed::Number(speed)), froude: None, ..task.clone() }
        }
        _ => task.clone(),
    }
}

/// What every motion of QDSEGA has in common.
#[derive(Debug, Clone)]
pub(super) struct UnnamedMotions {
    /// Springs and dampers of the stance.
    gains: Gains,
    /// The speed that the task asks for, m/s; `None` where any will do.
    speed: Option<f64>,
}

impl UnnamedMotions {
    /// Of the motions that are learned with `setup`.
    pub(super) fn of(setup: &LearningSetup) -> Self {
        let LearningSetup { model, stance, scene, .. } = setup;
        let objective = Objective::new(&in_speed(setup), model, stance, reference_gravity(scene));
        let speed = objective.ok().and_then(|objective| objective.wanted_speed());
        Self { gains: stance.gains.clone(), speed }
    }

    /// A behaviour, which has no gait in mind, found after so many generations of other searches.
    pub(super) fn motion(&self, behaviour: Behaviour, before: u32) -> LearnedMotion {
        let behaviour = Behaviour { generation: before + behaviour.generation, ..behaviour };
        let (name, gains) = ("motion".to_owned(), self.gains.clone());
        let (parameters, trials) = (Vec::new(), Vec::new());
        LearnedMotion { name, gait: None, speed: self.speed, behaviour, gains, parameters, trials }
    }
}
