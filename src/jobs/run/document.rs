//! The document of a motion that a job has learned.

use super::prepared::PreparedRun;
use crate::export::{Performance, motion};
use crate::jobs::order::Order;
use gaitwright_learning::check::CheckedMotion;
use gaitwright_learning::learn::{AskedSpeed, Learning, Task};
use gaitwright_learning::training::LearnedMotion;
use gaitwright_physics::motion::{Motion, Provenance};

/// The document of a motion; `None` of one that fell.
pub(super) fn document(
    order: &Order,
    prepared: &PreparedRun,
    learned: &LearnedMotion,
    checked: &CheckedMotion,
) -> Option<Motion> {
    let setup = &prepared.setup;
    // A Froude number is a speed on this character; a reader needs no hip height then.
    let speed = learned.asked_speed(&setup.task).map(AskedSpeed::Number).or(setup.task.speed);
    let task = Task { speed, froude: None, ..setup.task.clone() };
    let value = |value: Result<serde_json::Value, serde_json::Error>| value.unwrap_or_default();
    let provenance = Provenance {
        program: env!("CARGO_PKG_NAME").to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: Some(setup.seed),
        learning: value(serde_json::to_value(Learning::from(&setup.parameters))),
        task: value(serde_json::to_value(&task)),
        accuracy: setup.accuracy,
        effects: prepared.plan.decisions.clone(),
    };
    motion(&Performance {
        character: &order.reading.character,
        joints: &setup.model.joint_names,
        standing: &setup.stance.angles,
        behaviour: &learned.behaviour,
        trace: &checked.trace,
        gait: &checked.gait,
        validity: &checked.validity,
        scene: &setup.scene,
        drive: &learned.gains,
        provenance: &provenance,
    })
}
