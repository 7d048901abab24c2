//! Waves along a body without legs, as rings of keyframes.
//!
//! A snake has two ways to go: waves to the side, which drive it where its skin slides more easily along the body than across it
//! (Gray 1946), and waves up and down, which lift the parts that go forward off the ground. Both at once, a quarter of a wave
//! apart, are sidewinding (Tesch et al. 2009, "Parameterized and scripted gaits for modular snake robots").

use std::f64::consts::TAU;

use gaitwright_physics::model::Model;

use super::legs::Legs;
use super::ring::{KEYFRAMES, Ring, Wanted, within_joint_limits};
use super::seeds::Seed;
use super::spine::{Spine, SpineJoint};
use crate::learn::Posture;

/// Number of a wave's parameters.
pub const WAVE_PARAMETERS: usize = 11;
/// Stride time: a fifth more or less.
pub const WAVE_PERIOD: usize = 0;
/// Amplitude to the side: 0.1 rad.
const AMPLITUDE_ASIDE: usize = 1;
/// Amplitude up and down: 0.05 rad.
const AMPLITUDE_UP: usize = 2;
/// Number of waves along the body: a quarter.
const COUNT: usize = 3;
/// Growth of the amplitudes from head to tail: a fifth.
const GROWTH: usize = 4;
/// Way to the side: how much later one wave is than the other, 0.05 of the period.
pub const WAVE_SIDEWAYS: usize = 5;
/// Turn: a bend of all joints to one side, 0.02 rad.
pub const WAVE_TURN: usize = 6;
/// How many more waves up and down the body has than to the side: a tenth.
const COUNT_APART: usize = 7;
/// Stiffness of the joints: a fifth more or less.
const WAVE_STIFFNESS: usize = 8;
/// Damping of the joints: three tenths more or less.
const WAVE_DAMPING: usize = 9;
/// Below 0 the waves run the other way along the body: it depends on the skin which of them drives it forward.
const SENSE: usize = 10;

/// Waves along a spine: amplitudes in rad, lengths in body lengths, phases in parts of a period.
struct Waves {
    period: f64,
    /// To the side, and up and down.
    amplitudes: [f64; 2],
    /// Waves on the body, running to the tail.
    count: f64,
    /// How much later the waves up and down are than those to the side.
    later: f64,
    /// Growth of the amplitudes from head to tail.
    growth: f64,
    /// Bend to the left of all joints.
    turn: f64,
    /// Difference of the numbers of both waves.
    apart: f64,
}

/// The waves that `parameters` ask for. All 0 is the seed.
fn waves(spine: &Spine, size: f64, wanted: &Wanted, parameters: &[f64]) -> Waves {
    let p = |index: usize| parameters.get(index).copied().unwrap_or(0.0);
    let (ahead, aside) = (spine.forward.x.signum(), -spine.forward.y.signum());
    let (amplitudes, count, later) = match wanted.gait.gait {
        "sidewinding" => ([0.5, 0.15], 1.2, 0.25 * aside),
        "undulation" => ([0.6, 0.0], 1.2 * ahead, 0.0),
        _ => ([0.0, 0.3], 1.5 * ahead, 0.0),
    };
    Waves {
        period: wanted.usual_period(size) * (0.2 * p(WAVE_PERIOD)).exp().clamp(0.25, 4.0),
        amplitudes: [amplitudes[0] + 0.1 * p(AMPLITUDE_ASIDE), amplitudes[1] + 0.05 * p(AMPLITUDE_UP)],
        count: (count + 0.25 * p(COUNT)) * if p(SENSE) < 0.0 { -1.0 } else { 1.0 },
        later: later + 0.05 * p(WAVE_SIDEWAYS),
        growth: 0.2 * p(GROWTH),
        turn: 0.02 * p(WAVE_TURN),
        apart: 0.1 * p(COUNT_APART),
    }
}

impl Waves {
    /// Angle of a joint against the standing pose at the phase `at` (parts of a period), and its change with the phase.
    fn angle(&self, joint: &SpineJoint, at: f64) -> [f64; 2] {
        let grown = 1.0 + self.growth * (joint.along - 0.5);
        let phases =
            [at - self.count * joint.along, at - (self.count + self.apart) * joint.along - self.later];
        let (mut angle, mut change) = (joint.bends[0] * self.turn, 0.0);
        for ((bend, amplitude), phase) in joint.bends.iter().zip(self.amplitudes).zip(phases) {
            let (sine, cosine) = (TAU * phase).sin_cos();
            angle += bend * amplitude * grown * sine;
            change += bend * amplitude * grown * TAU * cosine;
        }
        [angle, change]
    }
}

/// The ring of the waves that `parameters` ask for. Its targets stay within the joints' ranges and speeds.
pub fn ring(model: &Model, legs: &Legs, spine: &Spine, wanted: &Wanted, parameters: &[f64]) -> Ring {
    let waves = waves(spine, legs.hip_height, wanted, parameters);
    let mut cycle = vec![Posture::resting(&legs.standing); KEYFRAMES];
    for (knot, posture) in cycle.iter_mut().enumerate() {
        for joint in &spine.joints {
            let [angle, change] = waves.angle(joint, knot as f64 / KEYFRAMES as f64);
            posture.angles[joint.joint] += angle;
            posture.velocities[joint.joint] = change / waves.period;
        }
    }
    within_joint_limits(model, &legs.standing, (cycle, None), waves.period, wanted)
}

/// How the springs and dampers change with `parameters`: factors of both.
pub fn softness(parameters: &[f64]) -> [f64; 2] {
    let p = |index: usize| parameters.get(index).copied().unwrap_or(0.0);
    [(0.2 * p(WAVE_STIFFNESS)).exp(), (0.3 * p(WAVE_DAMPING)).exp()]
}

/// Where a search may start: waves of the usual time and of shorter and longer ones, running either way along the body.
pub fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for period in [0.0, -3.0, 3.0] {
        for (amplitude, sense) in [(0.0, 1.0), (2.0, 1.0), (0.0, -1.0), (2.0, -1.0)] {
            let mut parameters = vec![0.0; WAVE_PARAMETERS];
            (parameters[WAVE_PERIOD], parameters[SENSE]) = (period, sense);
            (parameters[AMPLITUDE_ASIDE], parameters[AMPLITUDE_UP]) = (amplitude, amplitude);
            seeds.push(Seed::far(parameters));
        }
    }
    seeds
}
