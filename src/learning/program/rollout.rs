//! What a ring of keyframes does in the simulator, and what that costs.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::{Accuracy, Gains, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::{Stance, Upright};

use super::gaits::NamedGait;
use super::legs::Legs;
use super::ring::{Ring, Wanted};
use crate::learn::Posture;

/// Strides that are judged, after the entry, in the search.
pub const STRIDES: usize = 5;
/// What is changed in the disturbed run: friction, stiffness and damping times these, and a push of this share of
/// √(g h) to one side and back in its middle.
const SLIPPERY: f64 = 0.6;
const SOFTENED: f64 = 0.75;
const PUSH: f64 = 0.06;
/// Steps between two looks at how far the legs are extended.
const EXTENSION_STEPS: usize = 4;
/// How far legs are to be extended in their stance, shares of their length.
const EXTENDED: [f64; 2] = [0.82, 0.93];
/// Share of the weight with which a foot counts as standing.
const STANDING: f64 = 0.01;
/// Forces are averaged over this share of √(h / g) before their peak is taken: what rigid contact gives within one step
/// depends on the step.
const IMPACT: f64 = 0.05;

/// What was seen of a gait over the judged strides.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RolloutFigures {
    /// Share of the run for which it stayed upright; all else is of that time only.
    pub upright: f64,
    /// Along the task's direction, m/s.
    pub speed: f64,
    /// To the left of it over the way along it.
    pub sideways: f64,
    /// Change of the heading in one stride, rad.
    pub yaw: f64,
    /// ∫ Σ |τ q̇| dt / (m g d).
    pub cost_of_transport: f64,
    /// Mean speed of standing feet along the ground, weighted by their force, m/s.
    pub slip: f64,
    /// Greatest force of one foot over the weight, without what lasts for less than an impact.
    pub peak: f64,
    /// Height, from lowest to highest, over the hip height.
    pub heave: f64,
    /// Roll and pitch, from least to greatest, rad.
    pub roll: f64,
    /// rad.
    pub pitch: f64,
    /// Share of the stride for which each leg stood.
    pub duty: Vec<f64>,
    /// When each leg pushed: the phase of its force, as a circular mean over the stride, parts of a stride.
    pub phases: Vec<f64>,
    /// Share of the time in which nothing touched the ground.
    pub aerial: f64,
    /// Share of the time in which something else than a foot touched the ground.
    pub scuffed: f64,
    /// Root mean square of the torques' rate times √(h / g), over m g h.
    pub torque_rate: f64,
    /// Least extension of a leg: its mean over the stance, weighted by the leg's force, as a share of its length.
    pub extension: f64,
    /// Share of joints and time at the torque limit.
    pub saturated: f64,
    /// Greatest joint speed over what the actuator has.
    pub speed_used: f64,
    /// How much the trunk's pose at the same moment of a stride differs from one to the next, in its own units.
    pub irregular: f64,
    /// s simulated.
    pub seconds: f64,
}

/// Where gaits are tried: one for each thread.
#[derive(Debug, Clone)]
pub struct Arena {
    model: Arc<Model>,
    stance: Arc<Stance>,
    legs: Arc<Legs>,
    upright: Upright,
    direction: [f64; 2],
    gravity: f64,
    accuracy: Accuracy,
    /// As asked, and disturbed.
    scenes: [Scene; 2],
}

impl Arena {
    /// `model`, starting as in `stance`, in `scene`, to go along `direction`.
    ///
    /// # Errors
    /// Every fault of scene and accuracy ([`StepPlan::compile`]).
    pub fn new(
        (model, stance, legs): (&Arc<Model>, &Arc<Stance>, &Arc<Legs>),
        scene: &Scene,
        accuracy: &Accuracy,
        direction: [f64; 3],
    ) -> Result<Self, InputError> {
        StepPlan::compile(scene, accuracy, None, model)?;
        let mut slippery = scene.clone();
        slippery.friction *= SLIPPERY;
        let length = direction[0].hypot(direction[1]);
        Ok(Self {
            model: model.clone(),
            stance: stance.clone(),
            legs: legs.clone(),
            upright: Upright::new(model, stance, scene),
            direction: [direction[0] / length, direction[1] / length],
            gravity: Vector3::from(scene.gravity).norm(),
            accuracy: *accuracy,
            scenes: [scene.clone(), slippery],
        })
    }

    /// Plays `ring` with `gains` from the standing pose, as asked or `disturbed`, and judges `strides` strides after the
    /// entry. What cannot be simulated has fallen at once.
    pub fn run(&self, ring: &Ring, gains: &Gains, disturbed: bool, strides: usize) -> RolloutFigures {
        let count = self.legs.legs.len();
        let none =
            RolloutFigures { duty: vec![0.0; count], phases: vec![0.0; count], ..RolloutFigures::default() };
        let mut gains = gains.clone();
        if disturbed {
            gains.stiffness.iter_mut().chain(&mut gains.damping).for_each(|gain| *gain *= SOFTENED);
        }
        let scene = &self.scenes[usize::from(disturbed)];
        let Ok(plan) = StepPlan::compile(scene, &self.accuracy, Some(&gains), &self.model) else {
            return none;
        };
        let mut simulator = Simulator::new(Arc::new(plan), self.stance.state.clone());
        let player = Player::from_postures(
            &self.stance.angles,
            ring.entry.iter().map(Posture::parts),
            ring.cycle.iter().map(Posture::parts),
            ring.transition_time(),
        );
        let step = simulator.plan().step();
        let lead = (ring.lead() / step).round() as usize;
        let stride = (ring.period / step).round().max(1.0) as usize;
        let (size, weight) = (self.legs.hip_height, self.legs.mass * self.gravity);
        let unit_time = (size / self.gravity).sqrt();
        let memory = (-step / (IMPACT * unit_time)).exp();
        let joints = self.model.joint_count();
        let leg_of: Vec<Option<usize>> =
            self.model.links.iter().map(|place| self.legs.on(place.body)).collect();
        let push = disturbed.then(|| lead + stride * strides / 2);

        let mut figures = none;
        let mut beats = vec![[0.0; 2]; count];
        let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
        let mut torques = vec![0.0; joints];
        let (mut force, mut smooth) = (vec![0.0; count], vec![0.0; count]);
        let (mut work, mut slid, mut load, mut rates, mut saturated) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut extended = vec![[0.0; 2]; count];
        let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let (mut start, mut heading, mut turned) = (simulator.center_of_mass(), 0.0, 0.0);
        let mut marks: Vec<[f64; 4]> = Vec::new();
        let total = lead + strides * stride;
        let mut judged = 0usize;
        player.targets(0.0, &mut next);
        let mut done = 0;
        while done < total {
            if done == lead {
                start = simulator.center_of_mass();
                turned = 0.0;
            }
            if Some(done) == push {
                let mut state = simulator.state().clone();
                let speed = PUSH * (self.gravity * size).sqrt();
                let [x, y] = self.direction;
                state.root.linear_velocity += Vector3::new(-x - y, x - y, 0.0) * speed;
                simulator.set_state(&state);
            }
            std::mem::swap(&mut now, &mut next);
            player.targets((done + 1) as f64 * step, &mut next);
            let stepped = simulator.step(Command::Track { now: &now, next: &next }).is_ok();
            if !stepped || !self.upright.holds(simulator.state()) {
                break;
            }
            done += 1;
            let root = simulator.state().root;
            let facing = yaw(&root.orientation);
            turned += (facing - heading + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            heading = facing;
            force.fill(0.0);
            let (mut touching, mut scuffing) = (false, false);
            let counts = done > lead;
            for contact in simulator.contacts() {
                let normal = contact.force.dot(&contact.normal).max(0.0);
                match leg_of[contact.link] {
                    Some(leg) => force[leg] += normal,
                    None => scuffing = true,
                }
                touching = true;
                if counts {
                    slid += normal
                        * (contact.velocity - contact.normal * contact.velocity.dot(&contact.normal)).norm();
                    load += normal;
                }
            }
            for (smooth, force) in smooth.iter_mut().zip(&force) {
                *smooth = memory * *smooth + (1.0 - memory) * force;
            }
            if counts {
                judged += 1;
                let (roll, pitch) = tilt(&root.orientation, self.direction);
                for (range, value) in ranges.iter_mut().zip([root.position.z, roll, pitch]) {
                    *range = [range[0].min(value), range[1].max(value)];
                }
                figures.aerial += f64::from(u8::from(!touching));
                figures.scuffed += f64::from(u8::from(scuffing));
                // Legs change slowly beside the step.
                if judged.is_multiple_of(EXTENSION_STEPS) {
                    let angles = &simulator.state().angles;
                    for ((leg, force), sums) in self.legs.legs.iter().zip(&force).zip(&mut extended) {
                        let own: Vec<f64> = leg.joints.iter().map(|&joint| angles[joint]).collect();
                        sums[0] += force * leg.extension(&own);
                        sums[1] += force;
                    }
                }
                for (leg, force) in force.iter().enumerate() {
                    figures.duty[leg] += f64::from(u8::from(*force > STANDING * weight));
                    figures.peak = figures.peak.max(smooth[leg] / weight);
                    let angle = std::f64::consts::TAU * (done - lead) as f64 * step / ring.period;
                    beats[leg][0] += force * angle.cos();
                    beats[leg][1] += force * angle.sin();
                }
                let rate = |joint: usize| simulator.state().velocities[joint];
                for (joint, torque) in simulator.torques().iter().enumerate() {
                    work += (torque * rate(joint)).abs() * step;
                    rates += (torque - torques[joint]).powi(2);
                    let limit = self.model.effort[joint];
                    saturated +=
                        f64::from(u8::from(limit.is_some_and(|limit| torque.abs() >= 0.999 * limit)));
                    if let Some(limit) = self.model.speed[joint] {
                        figures.speed_used = figures.speed_used.max(rate(joint).abs() / limit);
                    }
                }
                if (done - lead).is_multiple_of(stride) {
                    let v = root.linear_velocity;
                    let along = v.x * self.direction[0] + v.y * self.direction[1];
                    marks.push([root.position.z / size, roll, pitch, along / (self.gravity * size).sqrt()]);
                }
            }
            torques.copy_from_slice(simulator.torques());
        }
        figures.upright = done as f64 / total as f64;
        figures.seconds = done as f64 * step;
        if judged > 0 {
            let time = judged as f64;
            let travel = simulator.center_of_mass() - start;
            let [x, y] = self.direction;
            let (along, left) = (travel.x * x + travel.y * y, travel.y * x - travel.x * y);
            figures.speed = along / (time * step);
            figures.sideways = left / along.abs().max(0.1 * size);
            figures.yaw = turned * stride as f64 / time;
            figures.cost_of_transport = work / (weight * along.abs().max(0.1 * size));
            figures.slip = if load > 0.0 { slid / load } else { 0.0 };
            figures.heave = (ranges[0][1] - ranges[0][0]) / size;
            figures.roll = ranges[1][1] - ranges[1][0];
            figures.pitch = ranges[2][1] - ranges[2][0];
            figures.aerial /= time;
            figures.scuffed /= time;
            figures.duty.iter_mut().for_each(|duty| *duty /= time);
            figures.phases = beats
                .iter()
                .map(|[cosine, sine]| (sine.atan2(*cosine) / std::f64::consts::TAU).rem_euclid(1.0))
                .collect();
            let means = extended.iter().filter(|sums| sums[1] > 0.0).map(|sums| sums[0] / sums[1]);
            figures.extension = means.fold(1.0, f64::min);
            figures.torque_rate = (rates / time).sqrt() / step * unit_time / (weight * size);
            figures.saturated = saturated / (time * joints as f64);
            let pairs = marks
                .windows(2)
                .skip(1)
                .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).powi(2)).sum::<f64>());
            let differences: Vec<f64> = pairs.collect();
            figures.irregular = (differences.iter().sum::<f64>() / differences.len().max(1) as f64).sqrt();
        }
        figures
    }
}

/// Heading of the root's x axis from above, rad.
fn yaw(orientation: &UnitQuaternion<f64>) -> f64 {
    let forward = orientation * Vector3::x();
    forward.y.atan2(forward.x)
}

/// Roll to the right and pitch nose down against the vertical, seen along `direction`, rad.
fn tilt(orientation: &UnitQuaternion<f64>, [x, y]: [f64; 2]) -> (f64, f64) {
    let up = orientation * Vector3::z();
    ((up.x * y - up.y * x).atan2(up.z), (up.x * x + up.y * y).atan2(up.z))
}

/// What a gait that holds all constraints costs at most (see [`cost`]).
pub const HOLDS: f64 = 100.0;

/// Whether and how well a gait does what is wanted of it: less is better, and what does not hold a constraint is
/// worse than all that does.
pub fn cost(
    wanted: &Wanted,
    period: f64,
    legs: &Legs,
    plain: &RolloutFigures,
    disturbed: &RolloutFigures,
) -> f64 {
    let violation = violation(wanted, plain) + (1.0 - disturbed.upright);
    let natural = natural(wanted, period, legs, plain);
    // What holds the constraints costs less than this; both parts keep their slope.
    natural.min(0.9 * HOLDS)
        + if violation > 0.0 { HOLDS + HOLDS * violation } else { 0.0 }
        + 2.0 * unsteady(plain, disturbed)
}

/// By how much the constraints are broken: upright, speed within a tenth, heading.
fn violation(wanted: &Wanted, figures: &RolloutFigures) -> f64 {
    let off = (figures.speed / wanted.speed - 1.0).abs();
    let sideways = figures.sideways.abs() - 0.05;
    let yaw = figures.yaw.abs() - 0.05;
    3.0 * (1.0 - figures.upright) + (off - 0.1).max(0.0) + sideways.clamp(0.0, 1.0) + yaw.clamp(0.0, 1.0)
}

/// How much a disturbance takes from the gait, from 0.
fn unsteady(plain: &RolloutFigures, disturbed: &RolloutFigures) -> f64 {
    let lost = (disturbed.speed / plain.speed.abs().max(1e-6) - 1.0).abs().min(1.0);
    lost * lost + 0.2 * (disturbed.roll + disturbed.pitch).min(1.0) + 1.0 - disturbed.upright
}

/// Mean square of the distance of the legs' phases from those of the gait, squares of parts of a stride; the time from
/// which phases are counted is left open.
fn timing(gait: &NamedGait, phases: &[f64]) -> f64 {
    let apart = || phases.iter().zip(gait.phases).map(|(phase, wanted)| phase - wanted);
    let (sine, cosine) = apart().fold((0.0, 0.0), |(sine, cosine), apart| {
        let (s, c) = (std::f64::consts::TAU * apart).sin_cos();
        (sine + s, cosine + c)
    });
    let common = sine.atan2(cosine) / std::f64::consts::TAU;
    let squares = apart().map(|apart| (apart - common - (apart - common).round()).powi(2));
    squares.sum::<f64>() / phases.len().max(1) as f64
}

/// What is unnatural about a gait, from 0.
fn natural(wanted: &Wanted, period: f64, legs: &Legs, figures: &RolloutFigures) -> f64 {
    let Wanted { gait, speed, weights, .. } = wanted;
    let count = figures.duty.len().max(1) as f64;
    let timing = timing(gait, &figures.phases);
    // In 60 √(h / g): for a dog in some ten seconds.
    let yaw = figures.yaw.abs() / period * 60.0 * (legs.hip_height / wanted.gravity).sqrt();
    let duty = figures.duty.iter().map(|duty| (duty - gait.duty_factor).powi(2)).sum::<f64>() / count;
    // A half-sine of force over the stance has π / (2 β) times its share as peak.
    let usual = std::f64::consts::FRAC_PI_2 / (gait.duty_factor * count);
    let peak = (figures.peak / usual - 1.3).max(0.0);
    let off = figures.speed / speed - 1.0;
    let [least, most] = EXTENDED;
    let bent = (least - figures.extension).max(figures.extension - most).max(0.0);
    let energy =
        3.0 * figures.cost_of_transport + 2.0 * figures.saturated + (figures.speed_used - 0.8).max(0.0);
    20.0 * off * off
        + 60.0 * timing
        + 30.0 * duty
        + 0.5 * (period / wanted.usual_period(legs)).ln().powi(2)
        + weights.energy * energy
        + weights.slip * 3.0 * figures.slip / speed
        + weights.impact * 1.0 * peak * peak
        + weights.drift * 2.0 * figures.sideways.abs()
        + weights.turn * 0.5 * yaw.min(4.0)
        + weights.smoothness * (0.03 * figures.torque_rate + figures.irregular)
        + weights.posture
            * (figures.heave + figures.roll + figures.pitch + 2.0 * figures.scuffed + 60.0 * bent * bent)
}
