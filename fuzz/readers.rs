//! Every reader of documents from outside, on any bytes.

use std::sync::Arc;

use gaitwright::jobs::JobRequest;
use gaitwright_learning::scenario::Scenario;
use gaitwright_physics::character::{self, Character, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Motion;
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator, State};

/// Most bodies of a character that is stepped as well.
const BODIES: usize = 100;

/// Reads `bytes` as every kind of document and steps the characters that are accepted. Nothing may panic.
pub fn read(bytes: &[u8]) {
    for source in [Source::Urdf, Source::Json, Source::Zip] {
        for strict in [false, true] {
            if let Ok(reading) = character::read(bytes, source, Options { strict }) {
                step(reading.character);
            }
        }
    }
    if let Ok(scenario) = Scenario::parse(bytes) {
        scenario.faults();
    }
    if let Ok(request) = JobRequest::parse(bytes) {
        request.terms.settings.faults();
    }
    if let Ok(motion) = Motion::parse(bytes) {
        motion.faults();
    }
}

/// A few steps from the origin, half in the ground. They may fail, and then say why.
fn step(character: Character) {
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    if model.bodies.len() > BODIES {
        return;
    }
    let Ok(plan) = StepPlan::compile(&Scene::default(), &Accuracy::default(), None, &model) else { return };
    let start = State::new(&model);
    let mut simulator = Simulator::new(Arc::new(plan), start);
    for _ in 0..3 {
        match simulator.step(Command::Passive) {
            Ok(()) => assert!(simulator.state().velocities.iter().all(|rate| rate.is_finite())),
            Err(failure) => {
                assert!(!failure.place.is_empty() && !failure.cause.to_string().is_empty());
                return;
            }
        }
    }
}
