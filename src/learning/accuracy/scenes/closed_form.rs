//! A scene with an exact solution, and what the scenes have in common.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::accuracy::measure::Measure;
use crate::accuracy::problem::{AccuracyProblem, Piece};
use crate::scenario::{CharacterSource, InlineCharacter, NoFiles, Scenario, ScenarioFormat, Start};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::{Accuracy, Drive, Scene};
use gaitwright_physics::sim::State;

/// Number of times at which a scene is compared with its solution, evenly spaced, the last at its end. The time
/// between two of them is a multiple of 8 ms in every scene, so that the steps of a sweep divide it.
const MARKS: u32 = 8;

/// Gravitational acceleration in the scenes, m/s².
pub const GRAVITY: f64 = 9.81;

/// A scene whose motion is known exactly.
#[derive(Debug, Clone, Copy)]
pub struct ClosedForm {
    /// Its unique name.
    pub name: &'static str,
    /// What happens in it.
    pub about: &'static str,
    /// Where the solution comes from.
    pub truth: &'static str,
    /// How the error of a state against the true one is measured.
    pub measure: Measure,
    /// Makes the scene's document.
    pub(super) scenario: fn() -> Scenario,
    /// The true states at ascending times, s, of a simulation that starts from the given state.
    pub(super) solution: fn(&State, &[f64]) -> Vec<State>,
}

impl ClosedForm {
    /// The scene as a document.
    pub fn scenario(&self) -> Scenario {
        (self.scenario)()
    }

    /// The scene as a problem of a single piece.
    ///
    /// # Errors
    /// What the scene asks for and this simulator cannot do.
    pub fn problem(&self) -> Result<AccuracyProblem, InputError> {
        let scenario = self.scenario();
        let setup = scenario.set_up(&NoFiles)?;
        let interval = setup.duration / f64::from(MARKS);
        let times: Vec<f64> = (1..=MARKS).map(|mark| f64::from(mark) * interval).collect();
        let marks = (self.solution)(&setup.start, &times);
        let pieces = vec![Piece { start: setup.start.clone(), marks }];
        Ok(AccuracyProblem { setup, measure: self.measure, interval, pieces })
    }
}

/// A passive character in `scene` for `seconds`, its root starting as `root`.
pub(super) fn scenario(character: Value, scene: Scene, root: RootMotion, seconds: f64) -> Scenario {
    Scenario {
        format: ScenarioFormat::V1,
        character: CharacterSource::Inline(InlineCharacter::Json(character)),
        fixed_base: false,
        scene,
        accuracy: Accuracy::default().into(),
        start: Start { root: Some(root), joints: BTreeMap::new() },
        drive: Drive::default(),
        duration: seconds,
        sample_every: seconds / f64::from(MARKS),
    }
}

/// Gravity without ground.
pub(super) fn free_space() -> Scene {
    Scene { gravity: [0.0, 0.0, -GRAVITY], ground: None, ..Scene::default() }
}

/// A body of one link.
pub(super) fn body(name: &str, link: &Value) -> Value {
    let mut link = link.clone();
    link["name"] = json!(name);
    json!({ "format": "gaitwright/character@1", "name": name, "links": [link] })
}

/// A root at `position` (m) with the linear velocity `velocity` (m/s) and no angular velocity.
pub(super) fn moving(position: [f64; 3], velocity: [f64; 3]) -> RootMotion {
    RootMotion {
        position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        linear_velocity: velocity,
        angular_velocity: [0.0; 3],
    }
}

/// `start` at another time.
pub(super) fn at(start: &State, time: f64) -> State {
    let mut state = start.clone();
    state.time = time;
    state
}
