//! A leg program's motion as a document that any reader can play.

use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{
    CharacterRef, Interpolation, Keyframe, Metrics, Motion, MotionFormat, MotionLoop, Provenance,
    RootAdvance, RootMotion,
};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::{Gains, Scene};

use super::ring::Ring;
use crate::gait::GaitReport;
use crate::learn::{Behaviour, Posture};

impl Ring {
    /// The ring as the learner's behaviours are, with a fitness (m/s) and the generation that found it.
    pub fn behaviour(&self, fitness: f64, generation: u32) -> Behaviour {
        let transition_time = self.transition_time();
        let (entry, cycle) = (self.entry.clone(), self.cycle.clone());
        Behaviour { fitness, generation, transition_time, entry, cycle }
    }
}

/// What a motion document is made of, besides the ring.
#[derive(Debug, Clone, Copy)]
pub struct RolloutRecord<'a> {
    /// Who moves.
    pub model: &'a Model,
    /// Targets of the standing pose, rad or m.
    pub standing: &'a [f64],
    /// The ring played from the standing pose at time 0, entry and at least one turn.
    pub trace: &'a Trace,
    /// The gait in the looping part of the trace.
    pub gait: &'a GaitReport,
    /// How strongly the joints followed.
    pub drive: &'a Gains,
    /// Where.
    pub scene: &'a Scene,
    /// How it came about.
    pub provenance: &'a Provenance,
}

/// The motion document; `None` where the character fell before it had gone round once.
///
/// The root is that of the first turn of the simulation; only its last keyframe is moved, to where the travel leads
/// from its start, so that the loop closes.
pub fn motion(ring: &Ring, performance: &RolloutRecord<'_>) -> Option<Motion> {
    let RolloutRecord { model, standing, trace, gait, drive, scene, provenance } = performance;
    let (step, lead) = (ring.transition_time(), ring.lead());
    let root = |time: f64| -> Option<RootMotion> {
        let end = trace.samples.last()?.time;
        let after = trace.samples.partition_point(|sample| sample.time < time - 1e-9);
        (time <= end + 1e-9).then(|| trace.samples.get(after).map(|sample| RootMotion::from(&sample.root)))?
    };
    let frame = |time: f64, posture: &Posture, root: RootMotion| Keyframe {
        time,
        angles: posture.angles.clone(),
        velocities: posture.velocities.clone(),
        root,
    };
    let first = ring.cycle.first()?;
    let (start, end) = (root(lead)?, root(lead + ring.period)?);
    let mut root_advance = RootAdvance::between(&start, &end);
    root_advance.translation[2] = 0.0;

    let mut entry = vec![frame(0.0, &Posture::resting(standing), root(0.0)?)];
    for (index, posture) in ring.entry.iter().enumerate() {
        let time = step * (index + 1) as f64;
        entry.push(frame(time, posture, root(time)?));
    }
    entry.push(frame(lead, first, start));
    let mut keyframes = Vec::with_capacity(ring.cycle.len() + 1);
    for (index, posture) in ring.cycle.iter().enumerate() {
        let time = step * index as f64;
        keyframes.push(frame(time, posture, root(lead + time)?));
    }
    keyframes.push(frame(ring.period, first, root_advance.apply(&start)));

    let character = &model.character;
    Some(Motion {
        format: MotionFormat::V1,
        character: CharacterRef { name: character.name.clone(), digest: character.digest.clone() },
        joints: model.joint_names.clone(),
        interpolation: Interpolation::CubicHermite,
        keyframes,
        cycle: MotionLoop { start: 0.0, end: ring.period, root_advance },
        entry,
        drive: (*drive).clone(),
        metrics: Metrics {
            speed: gait.speed,
            upright_seconds: trace.fell_at.unwrap_or(trace.samples.last()?.time),
            cost_of_transport: gait.cost_of_transport,
            positive_cost_of_transport: gait.positive_cost_of_transport,
            froude: gait.froude,
            gait: gait.gait.clone(),
            duty_factors: gait.feet.iter().map(|foot| (foot.link.clone(), foot.duty_factor)).collect(),
            stride_period: gait.stride_period,
            natural: gait.natural,
            naturalness: gait.naturalness.clone(),
            ..Metrics::default()
        },
        scene: (*scene).clone(),
        provenance: (*provenance).clone(),
        poses: None,
    })
}
