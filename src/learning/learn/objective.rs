//! How a stretch of motion is scored against its task.

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::ahead_in_plane;
use gaitwright_physics::scene::Scene;
use gaitwright_physics::stance::Stance;

use super::task::{Pace, Task, Weights};

/// Gravity to which energies and times are related where a scene has none, m/s².
const STANDARD_GRAVITY: f64 = 9.81;

/// The gravity to which energies, speeds and times are related in `scene`, m/s²: its own, or the Earth's where it has
/// none.
pub fn reference_gravity(scene: &Scene) -> f64 {
    let gravity = scene.acting_gravity().norm();
    if gravity > 0.0 { gravity } else { STANDARD_GRAVITY }
}

/// Cost of energy at its usual weight, m: a metre of ∫ Σ |τ q̇| dt / (m g).
const ENERGY: f64 = 0.02;
/// Of drift, m: a metre across the direction.
const DRIFT: f64 = 0.5;
/// Of turn, m: a standing root height of arc.
const TURN: f64 = 2.0;
/// Of slip, m: a metre that a contact slides.
const SLIP: f64 = 0.1;
/// Of impact, m: the way at Froude number 1 in the time for which a link carries twice the weight.
const IMPACT: f64 = 0.5;
/// Of torque variation, m: a standing root height for torques that change by the weight at that height.
const SMOOTHNESS: f64 = 0.02;
/// Of sway, m: a standing root height of arc.
const POSTURE: f64 = 0.1;
/// Share of the costs of impact, torque variation and sway that is charged where a speed is asked for: it comes first, and keeps hops from paying
/// already. With the whole of them, the median of five searches of 300 simulated seconds stood still.
const WITH_SPEED: f64 = 0.25;

/// What a stretch of motion did, as far as the reward asks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Terms {
    /// Horizontal displacement of the centre of mass in the world frame, m.
    pub displacement: [f64; 2],
    /// Change of the root's heading, rad, counter-clockwise seen from above, not wrapped.
    pub turn: f64,
    /// ∫ Σ |τ q̇| dt over the joints, J.
    pub work: f64,
    /// Distance slid by contacts: ∫ Σ |v_tangential| dt, divided by the number of contacts, m.
    pub slip: f64,
    /// By how much links carry more than the character's weight: ∫ Σ (F / (m g) − 1)₊ dt, s.
    pub impact: f64,
    /// Σ |Δτ| over steps and joints, over m g h, or over m g for joints that slide.
    pub torque_variation: f64,
    /// Way of the trunk's tilt to and fro: ∫ |ω_horizontal| dt, rad.
    pub sway: f64,
}

impl Terms {
    /// The same with the displacement in axes that are turned by `heading` (rad, counter-clockwise seen from above).
    pub fn seen_from(self, heading: f64) -> Self {
        let ([x, y], (sine, cosine)) = (self.displacement, heading.sin_cos());
        Self { displacement: [cosine * x + sine * y, cosine * y - sine * x], ..self }
    }
}

impl std::ops::AddAssign for Terms {
    fn add_assign(&mut self, other: Self) {
        self.displacement[0] += other.displacement[0];
        self.displacement[1] += other.displacement[1];
        self.turn += other.turn;
        self.work += other.work;
        self.slip += other.slip;
        self.impact += other.impact;
        self.torque_variation += other.torque_variation;
        self.sway += other.sway;
    }
}

/// A reward in parts, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Earnings {
    /// Progress less what is never given back.
    pub plain: f64,
    /// What is charged by its size, and of which parts of a motion cancel out: turn, drift, and progress beyond what the
    /// wanted speed makes.
    pub signed: [f64; 3],
}

impl Earnings {
    /// The reward.
    pub fn total(&self) -> f64 {
        let [turn, drift, beyond] = self.signed.map(f64::abs);
        self.plain - turn - drift - beyond
    }

    /// The reward with turn and drift left out, which show over a cycle only.
    pub fn without_sway(&self) -> f64 {
        self.plain - self.signed[2].abs()
    }

    /// The same motion in a mirror.
    pub fn mirrored(&self) -> Self {
        let [turn, drift, beyond] = self.signed;
        Self { plain: self.plain, signed: [-turn, -drift, beyond] }
    }
}

/// A task made ready for scoring one character.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    direction: [f64; 2],
    speed: Option<f64>,
    weights: Weights,
    /// m g, N.
    weight_force: f64,
    /// Standing root height, m.
    height: f64,
    /// √(g h): the speed at Froude number 1, m/s.
    froude_speed: f64,
}

impl Objective {
    /// `task` for a character as heavy as `model` that stands as in `stance`, under `gravity` (m/s²).
    ///
    /// # Errors
    /// Every fault of the task ([`Task::faults`]).
    pub fn new(task: &Task, model: &Model, stance: &Stance, gravity: f64) -> Result<Self, InputError> {
        Self::of(task, model.mass, model.height_scale(stance.root_height), gravity)
    }

    /// `task` for a character of `mass` (kg) whose root stands at `height` (m, greater than 0) under `gravity` (m/s²).
    ///
    /// # Errors
    /// Every fault of the task ([`Task::faults`]).
    pub fn of(task: &Task, mass: f64, height: f64, gravity: f64) -> Result<Self, InputError> {
        let faults = task.faults();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        Ok(Self {
            direction: ahead_in_plane(task.direction),
            speed: match task.pace(gravity * height) {
                Pace::At(speed) => Some(speed),
                Pace::Comfortable | Pace::Fastest => None,
            },
            weights: task.weights,
            weight_force: mass * gravity,
            height,
            froude_speed: (gravity * height).sqrt(),
        })
    }

    /// The same without what makes a motion natural and the algorithm as published knows nothing of: impacts, torque variation and sway cost nothing.
    pub fn as_published(mut self) -> Self {
        self.weights = Weights { impact: 0.0, smoothness: 0.0, posture: 0.0, ..self.weights };
        self
    }

    /// The speed that the task asks for, m/s; `None` where any will do.
    pub fn wanted_speed(&self) -> Option<f64> {
        self.speed
    }

    /// Displacement along the task's direction, m.
    pub fn progress(&self, terms: &Terms) -> f64 {
        let ([x, y], [dx, dy]) = (self.direction, terms.displacement);
        x * dx + y * dy
    }

    /// Reward of `seconds` of upright motion, m: progress (or, when a speed is wanted, the wanted
    /// progress less the deviation from it) less the weighted costs.
    pub fn reward(&self, terms: &Terms, seconds: f64) -> f64 {
        self.earnings(terms, seconds).total()
    }

    /// The same in parts, of which those that can cancel out keep their sign.
    pub fn earnings(&self, terms: &Terms, seconds: f64) -> Earnings {
        let progress = self.progress(terms);
        let wanted = self.speed.map(|speed| speed * seconds);
        let ([x, y], [dx, dy]) = (self.direction, terms.displacement);
        let weights = &self.weights;
        let unnatural = weights.impact * IMPACT * self.froude_speed * terms.impact
            + weights.smoothness * SMOOTHNESS * self.height * terms.torque_variation
            + weights.posture * POSTURE * self.height * terms.sway;
        let share = if self.speed.is_some() { WITH_SPEED } else { 1.0 };
        Earnings {
            plain: wanted.unwrap_or(progress)
                - weights.energy * ENERGY * terms.work / self.weight_force
                - weights.slip * SLIP * terms.slip
                - share * unnatural,
            signed: [
                weights.turn * TURN * self.height * terms.turn,
                weights.drift * DRIFT * (x * dy - y * dx),
                wanted.map_or(0.0, |wanted| progress - wanted),
            ],
        }
    }

    /// Fitness of an upright stretch, m/s: its reward per second.
    pub fn fitness(&self, terms: &Terms, seconds: f64) -> f64 {
        self.reward(terms, seconds) / seconds
    }

    /// Fitness of a behaviour that fell after standing for `stood` of the `asked` seconds, m/s.
    ///
    /// It grows with the time stood and, less, with the progress made until then, and stays below
    /// −√(g h) / 2, under every upright behaviour that moves as it should.
    pub fn fallen(&self, terms: &Terms, stood: f64, asked: f64) -> f64 {
        let share = (stood / asked).clamp(0.0, 1.0);
        let credit = 0.5 * self.froude_speed * share;
        let progress = (self.progress(terms) / asked).clamp(-credit, credit);
        progress - self.froude_speed * (2.0 - share)
    }

    /// What the Q-learner is charged for a transition that ends in a fall, m.
    pub fn fall_cost(&self) -> f64 {
        self.height
    }
}
