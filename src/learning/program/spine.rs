//! Bodies without legs: joints in a row.

use nalgebra::{Vector2, Vector3};

use gaitwright_physics::model::{DofKind, Frame, Model};

/// Fewest driven joints in a row that waves can run along.
const FEWEST: usize = 4;
/// Share of the body's length that stands in for the height of the hips: waves are about so long, and their times go with its
/// root.
const SIZE: f64 = 0.25;

/// One joint of a body that bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpineJoint {
    /// Its index among the model's joints.
    pub joint: usize,
    /// Its place: 0 at the head, 1 at the tail.
    pub along: f64,
    /// What its angle does to the body: the parts of its axis that point up and to the body's left.
    pub bends: [f64; 2],
}

/// A body without legs.
#[derive(Debug, Clone, PartialEq)]
pub struct Spine {
    /// From head to tail.
    pub joints: Vec<SpineJoint>,
    /// m.
    pub length: f64,
    /// From tail to head, way frame, of unit length.
    pub forward: Vector2<f64>,
}

impl Spine {
    /// The joints of `model` with these frames of its bodies (way frame), where they are a row; `None` where a link carries
    /// two others, or too few of its joints are driven and bend it.
    pub fn of(model: &Model, frames: &[Frame]) -> Option<Self> {
        let carried = |by: usize| model.bodies.iter().skip(1).filter(|body| body.parent == by).count();
        if (0..model.bodies.len()).any(|body| carried(body) > 1) {
            return None;
        }
        let ends: Vec<Vector3<f64>> = model.bodies.iter().zip(frames).map(|(_, frame)| frame.1).collect();
        let (head, tail) = (ends.first()?, ends.last()?);
        let body = (head - tail).xy();
        let length = body.norm();
        let forward = body.try_normalize(0.0)?;
        let left = Vector3::new(-forward.y, forward.x, 0.0);
        let joints = (1..model.bodies.len())
            .filter(|&body| model.driven[body - 1] && model.bodies[body].dof == DofKind::Revolute);
        let joints: Vec<SpineJoint> = joints
            .map(|body| {
                let axis = frames[body].0 * model.bodies[body].axis;
                let along = (head - ends[body]).xy().dot(&forward) / length;
                SpineJoint { joint: body - 1, along, bends: [axis.z, axis.dot(&left)] }
            })
            .filter(|joint| joint.bends[0].abs().max(joint.bends[1].abs()) > 0.5)
            .collect();
        (joints.len() >= FEWEST).then_some(Self { joints, length, forward })
    }

    /// What stands in for the height of the hips, m.
    pub fn size(&self) -> f64 {
        SIZE * self.length
    }
}
