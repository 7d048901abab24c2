//! What the motion is for, and how a stretch of motion is scored against it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::model::Model;
use gaitwright_physics::stance::Stance;

/// Gravity to which energies are related, m/s²: costs of transport of scenes with different gravity
/// stay comparable.
pub(super) const STANDARD_GRAVITY: f64 = 9.81;

/// Greatest component of a direction; only its ratio to the others counts.
const GREATEST_COMPONENT: f64 = 1e6;
/// Greatest speed that can be asked for, m/s.
const GREATEST_SPEED: f64 = 1e3;
/// Greatest weight of a cost.
const GREATEST_WEIGHT: f64 = 1e6;

/// What the motion is for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Task {
    /// Wanted direction of travel in the world frame, of any length (the character starts heading
    /// along +x); only x and y count.
    pub direction: [f64; 3],
    /// Wanted speed along the direction, m/s; as fast as possible where `null`.
    pub speed: Option<f64>,
    /// What is charged against progress.
    pub weights: Weights,
}

impl Default for Task {
    fn default() -> Self {
        Self { direction: [1.0, 0.0, 0.0], speed: None, weights: Weights::default() }
    }
}

impl Task {
    /// Everything impossible in the task, with JSON pointers into it.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let [x, y, _] = self.direction;
        let length = x.hypot(y);
        if !self.direction.iter().all(|component| component.abs() <= GREATEST_COMPONENT) {
            let reason =
                format!("the direction must be three numbers of at most {GREATEST_COMPONENT:e} either way");
            faults.push(Fault::new("/direction", reason));
        } else if !length.is_normal() {
            faults.push(Fault::new("/direction", "the direction must have a horizontal part"));
        }
        if self.speed.is_some_and(|speed| !(speed > 0.0 && speed <= GREATEST_SPEED)) {
            let reason = format!("the speed must be a positive number of at most {GREATEST_SPEED} m/s");
            faults.push(Fault::new("/speed", reason));
        }
        let Weights { energy, drift, turn, slip } = self.weights;
        for (name, weight) in [("energy", energy), ("drift", drift), ("turn", turn), ("slip", slip)] {
            if !(0.0..=GREATEST_WEIGHT).contains(&weight) {
                let reason = format!("a weight must lie between 0 and {GREATEST_WEIGHT:e}");
                faults.push(Fault::new(format!("/weights/{name}"), reason));
            }
        }
        faults
    }
}

/// Costs charged against forward displacement. All are without unit, so that the defaults, found by
/// measurement on several characters, suit small and large ones alike.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Weights {
    /// Per metre of ∫ Σ |τ q̇| dt / (m g): the weight of the cost of transport.
    pub energy: f64,
    /// Per metre of displacement across the direction.
    pub drift: f64,
    /// Per standing root height of arc: a yaw of one radian costs this many standing heights.
    pub turn: f64,
    /// Per metre that a contact slides.
    pub slip: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { energy: 0.02, drift: 0.5, turn: 2.0, slip: 0.0 }
    }
}

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
}

impl std::ops::AddAssign for Terms {
    fn add_assign(&mut self, other: Self) {
        self.displacement[0] += other.displacement[0];
        self.displacement[1] += other.displacement[1];
        self.turn += other.turn;
        self.work += other.work;
        self.slip += other.slip;
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
    /// `task` for a character as heavy as `model` that stands as in `stance`.
    ///
    /// # Errors
    /// Every fault of the task ([`Task::faults`]).
    pub fn new(task: &Task, model: &Model, stance: &Stance) -> Result<Self, InputError> {
        Self::of(task, model.mass, stance.root_height)
    }

    /// `task` for a character of `mass` (kg) whose root stands at `height` (m).
    ///
    /// # Errors
    /// Every fault of the task ([`Task::faults`]).
    pub fn of(task: &Task, mass: f64, height: f64) -> Result<Self, InputError> {
        let faults = task.faults();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let [x, y, _] = task.direction;
        let length = x.hypot(y);
        // A root that lies on the ground gives no scale; a centimetre keeps the figures finite.
        let height = height.max(0.01);
        Ok(Self {
            direction: [x / length, y / length],
            speed: task.speed,
            weights: task.weights,
            weight_force: mass * STANDARD_GRAVITY,
            height,
            froude_speed: (STANDARD_GRAVITY * height).sqrt(),
        })
    }

    /// Displacement along the task's direction, m.
    pub fn progress(&self, terms: &Terms) -> f64 {
        let ([x, y], [dx, dy]) = (self.direction, terms.displacement);
        x * dx + y * dy
    }

    /// Reward of `seconds` of upright motion, m: progress (or, when a speed is wanted, the wanted
    /// progress less the deviation from it) less the weighted costs.
    pub fn reward(&self, terms: &Terms, seconds: f64) -> f64 {
        let progress = self.progress(terms);
        let gain = match self.speed {
            None => progress,
            Some(speed) => speed * seconds - (progress - speed * seconds).abs(),
        };
        let ([x, y], [dx, dy]) = (self.direction, terms.displacement);
        let drift = (x * dy - y * dx).abs();
        let Weights { energy, drift: drift_weight, turn, slip } = self.weights;
        gain - energy * terms.work / self.weight_force
            - drift_weight * drift
            - turn * self.height * terms.turn.abs()
            - slip * terms.slip
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
