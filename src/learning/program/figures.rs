//! What is seen of a gait while it is simulated.

use std::f64::consts::TAU;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Simulator, State};

use super::leg_watch::{LegFigures, LegRule, LegWatch};
use super::legs::Legs;
use crate::gait::Detection;
use crate::gait::foot_force::IMPACT;
use crate::gait::harmonics::{HarmonicFit, MOST_HARMONICS, harmonics};

/// Most steps from one look at the joints' angles, which change slowly beside the step, to the next.
const POSTURE_STEPS: usize = 4;
/// Fewest looks in a stride, if it has as many steps: more than three times the harmonics in which short strides are judged. Ten looks do
/// not show by how much a joint moves, nor the highest point of a swing.
const FEWEST_LOOKS: usize = 20;

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
    /// Mean speed of whatever touches the ground along it, weighted by its force, m/s.
    pub slip: f64,
    /// Greatest force of one foot over the weight, without what lasts for less than an impact.
    pub peak: f64,
    /// Height, from lowest to highest, over the hip height.
    pub heave: f64,
    /// Roll and pitch, from least to greatest, rad.
    pub roll: f64,
    /// rad.
    pub pitch: f64,
    /// Share of the time in which something else than a foot touched the ground.
    pub scuffed: f64,
    /// Root mean square of the torques' rate times √(h / g), over m g h.
    pub torque_rate: f64,
    /// Least share of a joint's variance that lies in the first harmonics of the stride.
    pub smoothness: f64,
    /// Share of the joints with a greatest torque and of the time in which an actuator gives all that it has at its speed.
    pub saturated: f64,
    /// Greatest joint speed over what the actuator has.
    pub speed_used: f64,
    /// How much the trunk's pose at the same moment of a stride differs from one to the next, in its own units.
    pub irregular: f64,
    /// Share of a stride that a step of the simulation takes: phases are not known any better.
    pub resolution: f64,
    /// s simulated.
    pub seconds: f64,
    /// One for each leg.
    pub legs: Vec<LegFigures>,
}

impl RolloutFigures {
    /// The same as if it had gone straight on: how far a way turns and drifts aside is mended more easily than all else.
    pub fn if_straight(&self) -> Self {
        Self { yaw: 0.0, sideways: 0.0, ..self.clone() }
    }
}

/// Sums up what a gait does, step by step.
#[derive(Debug)]
pub(super) struct Watch<'a> {
    model: &'a Model,
    legs: &'a Legs,
    direction: [f64; 2],
    gravity: f64,
    /// s.
    step: f64,
    /// Steps of a stride, exactly and as a whole number.
    period: f64,
    stride: usize,
    /// Steps judged so far.
    judged: usize,
    /// Steps from one look at the posture to the next.
    posture_steps: usize,
    leg_of: Vec<Option<usize>>,
    /// Whether the trunk has touched the ground.
    lies: bool,
    /// Height of the ground, m.
    ground: f64,
    leg_rule: LegRule,
    leg_watches: Vec<LegWatch>,
    /// Which joints slide.
    slides: Vec<bool>,
    harmonic_fit: HarmonicFit,
    /// Force on each foot, and on each link that is none, N.
    forces: Vec<f64>,
    loads: Vec<f64>,
    /// Angles of one leg's joints.
    own: Vec<f64>,
    torques: Vec<f64>,
    work: f64,
    rates: f64,
    /// Looks at actuators with a greatest torque, and those at which they gave all that they had.
    bounded: usize,
    saturated: usize,
    speed_used: f64,
    /// Of the forces on the ground, and of their slip with that weight.
    load: f64,
    slid: f64,
    scuffed: f64,
    /// Least and greatest height, roll and pitch.
    ranges: [[f64; 2]; 3],
    /// Height, roll, pitch and speed at the end of each stride, in the character's units.
    marks: Vec<[f64; 4]>,
    start: Point3<f64>,
    end: Point3<f64>,
    heading: f64,
    turned: f64,
}

impl<'a> Watch<'a> {
    /// Of a character with `legs` that goes along `direction` under `gravity` (m/s²) on ground at the height `ground` (m), in strides of
    /// `period` seconds, simulated in steps of `step` seconds.
    pub(super) fn new(
        model: &'a Model,
        legs: &'a Legs,
        (direction, gravity, ground): ([f64; 2], f64, f64),
        (step, period): (f64, f64),
    ) -> Self {
        let (count, joints) = (legs.legs.len(), model.joint_count());
        let stride = (period / step).round().max(1.0) as usize;
        let unit_time = (legs.hip_height / gravity).sqrt();
        let detection = Detection::of(legs.mass * gravity, unit_time);
        let leg_rule = LegRule {
            threshold: detection.threshold,
            shortest: (detection.debounce / step).round() as usize,
            memory: (-step / (IMPACT * unit_time)).exp(),
        };
        Self {
            model,
            legs,
            direction,
            gravity,
            step,
            period: period / step,
            stride,
            judged: 0,
            posture_steps: (stride / FEWEST_LOOKS).clamp(1, POSTURE_STEPS),
            leg_of: (0..model.links.len()).map(|link| legs.standing_on(link)).collect(),
            lies: false,
            ground,
            leg_rule,
            leg_watches: vec![LegWatch::default(); count],
            slides: model.bodies.iter().skip(1).map(|body| body.dof == DofKind::Prismatic).collect(),
            harmonic_fit: HarmonicFit::new(joints, MOST_HARMONICS),
            forces: vec![0.0; count],
            loads: vec![0.0; model.links.len()],
            own: Vec::new(),
            torques: vec![0.0; joints],
            work: 0.0,
            rates: 0.0,
            bounded: 0,
            saturated: 0,
            speed_used: 0.0,
            load: 0.0,
            slid: 0.0,
            scuffed: 0.0,
            ranges: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            marks: Vec::new(),
            start: Point3::origin(),
            end: Point3::origin(),
            heading: 0.0,
            turned: 0.0,
        }
    }

    /// Standing hip height, m.
    fn size(&self) -> f64 {
        self.legs.hip_height
    }

    /// From here on the strides are judged.
    pub(super) fn begin(&mut self, simulator: &Simulator) {
        self.start = simulator.center_of_mass();
        self.turned = 0.0;
        self.leg_watches.iter_mut().for_each(LegWatch::begin);
    }

    /// Takes in a step, which is `judged` or belongs to the entry.
    pub(super) fn step(&mut self, simulator: &Simulator, judged: bool) {
        let root = simulator.state().root;
        let facing = yaw(&root.orientation);
        self.turned += (facing - self.heading + std::f64::consts::PI).rem_euclid(TAU) - std::f64::consts::PI;
        self.heading = facing;
        self.contacts(simulator, judged);
        if judged {
            self.judged += 1;
            self.trunk(simulator);
            self.joints(simulator);
            if self.judged.is_multiple_of(self.posture_steps) {
                self.posture(simulator.state());
            }
        }
        self.torques.copy_from_slice(simulator.torques());
    }

    /// Whether a character with legs has lain down on its trunk.
    pub(super) fn lies(&self) -> bool {
        self.lies && !self.legs.legs.is_empty()
    }

    /// Forces of the ground.
    fn contacts(&mut self, simulator: &Simulator, judged: bool) {
        self.forces.fill(0.0);
        self.loads.fill(0.0);
        for contact in simulator.contacts().filter(|contact| contact.against == Against::Ground) {
            let normal = contact.force.dot(&contact.normal).max(0.0);
            match self.leg_of[contact.link] {
                Some(leg) => self.forces[leg] += normal,
                None => self.loads[contact.link] += normal,
            }
            if judged {
                let across = contact.velocity - contact.normal * contact.velocity.dot(&contact.normal);
                self.slid += normal * across.norm();
                self.load += normal;
            }
        }
        let mut scuffing = false;
        for (link, _) in self.loads.iter().enumerate().filter(|(_, load)| **load > self.leg_rule.threshold) {
            scuffing = true;
            self.lies |= self.model.links[link].body == 0;
        }
        if judged {
            self.scuffed += f64::from(u8::from(scuffing));
        }
        let (sine, cosine) = (TAU * (self.judged + 1) as f64 / self.period).sin_cos();
        for (leg, &force) in self.leg_watches.iter_mut().zip(&self.forces) {
            leg.step(force, [cosine, sine], self.leg_rule);
        }
    }

    fn trunk(&mut self, simulator: &Simulator) {
        let root = simulator.state().root;
        let (roll, pitch) = tilt(&root.orientation, self.direction);
        for (range, value) in self.ranges.iter_mut().zip([root.position.z, roll, pitch]) {
            *range = [range[0].min(value), range[1].max(value)];
        }
        self.end = simulator.center_of_mass();
        if self.judged.is_multiple_of(self.stride) {
            let v = root.linear_velocity;
            let along = v.x * self.direction[0] + v.y * self.direction[1];
            let speed = along / (self.gravity * self.size()).sqrt();
            self.marks.push([root.position.z / self.size(), roll, pitch, speed]);
        }
    }

    /// Torques and rates.
    fn joints(&mut self, simulator: &Simulator) {
        let plan = simulator.plan();
        let rates = &simulator.state().velocities;
        for (joint, torque) in simulator.torques().iter().enumerate() {
            self.work += (torque * rates[joint]).abs() * self.step;
            // A force of a joint that slides is counted as if it had the hips' height as its arm.
            let arm = if self.slides[joint] { self.size() } else { 1.0 };
            self.rates += (arm * (torque - self.torques[joint])).powi(2);
            let actuator = plan.actuator_limits(joint);
            self.bounded += usize::from(actuator.is_bounded());
            self.saturated += usize::from(actuator.gives_all(*torque, rates[joint]));
            if let Some(limit) = self.model.speed[joint] {
                self.speed_used = self.speed_used.max(rates[joint].abs() / limit);
            }
        }
    }

    fn posture(&mut self, state: &State) {
        let Legs { to_way, hip_height, .. } = self.legs;
        let up = to_way * (state.root.orientation.inverse() * Vector3::z());
        for (leg, watch) in self.legs.legs.iter().zip(&mut self.leg_watches) {
            self.own.clear();
            self.own.extend(leg.joints.iter().map(|&joint| state.angles[joint]));
            let placed = leg.place(&self.own);
            let height = state.root.position.z + up.dot(&placed.foot) - leg.radius;
            watch.look(leg.extension(&placed), (height - self.ground) / hip_height);
        }
        self.harmonic_fit.add(self.judged as f64 / self.period, &state.angles);
    }

    /// The figures of a run of which the share `upright` was upright, for `seconds`.
    pub(super) fn figures(&self, upright: f64, seconds: f64) -> RolloutFigures {
        let legs = vec![LegFigures::default(); self.legs.legs.len()];
        let fallen = RolloutFigures { upright, seconds, legs, ..RolloutFigures::default() };
        if self.judged == 0 {
            return fallen;
        }
        let (size, time) = (self.size(), self.judged as f64);
        let (weight, unit_time) = (self.legs.mass * self.gravity, (size / self.gravity).sqrt());
        let travel = self.end - self.start;
        let [x, y] = self.direction;
        let (along, left) = (travel.x * x + travel.y * y, travel.y * x - travel.x * y);
        let way = along.abs().max(0.1 * size);
        let legs: Vec<LegFigures> = self.leg_watches.iter().map(|leg| leg.figures(time)).collect();
        let range = |axis: usize| self.ranges[axis][1] - self.ranges[axis][0];
        RolloutFigures {
            speed: along / (time * self.step),
            sideways: left / way,
            yaw: self.turned * self.stride as f64 / time,
            cost_of_transport: self.work / (weight * way),
            slip: if self.load > 0.0 { self.slid / self.load } else { 0.0 },
            peak: self.leg_watches.iter().map(LegWatch::peak).fold(0.0, f64::max) / weight,
            heave: range(0) / size,
            roll: range(1),
            pitch: range(2),
            scuffed: self.scuffed / time,
            torque_rate: (self.rates / time).sqrt() / self.step * unit_time / (weight * size),
            smoothness: self.smoothness(legs.iter().map(|leg| leg.duty).fold(0.0, f64::max)),
            saturated: self.saturated as f64 / self.bounded.max(1) as f64,
            speed_used: self.speed_used,
            irregular: self.irregular(),
            resolution: 1.0 / self.period,
            legs,
            ..fallen
        }
    }

    /// Least share of a joint's variance in the harmonics of feet with this greatest duty factor, among the joints that move.
    fn smoothness(&self, duty: f64) -> f64 {
        self.harmonic_fit.shares(harmonics(duty), &self.slides).into_iter().fold(1.0, f64::min)
    }

    /// Root mean square of the change of the marks from one stride to the next; the first is still of the entry.
    fn irregular(&self) -> f64 {
        let changes = self.marks.windows(2).skip(1);
        let squares: Vec<f64> = changes
            .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).powi(2)).sum::<f64>())
            .collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
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
