//! What a motion is for: the task as a document.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_physics::fault::Fault;

/// Greatest component of a direction; only its ratio to the others counts.
const GREATEST_COMPONENT: f64 = 1e6;
/// Greatest speed that can be asked for, m/s.
const GREATEST_SPEED: f64 = 1e3;
/// Greatest Froude number that can be asked for.
pub const GREATEST_FROUDE: f64 = 100.0;
/// The least one: the slowest wave gait of the bundled hexapod has ten times that, and strides take the longer the slower they go.
pub const LEAST_FROUDE: f64 = 1e-4;
/// Greatest weight of a cost.
const GREATEST_WEIGHT: f64 = 1e6;
/// The gait of a task that leaves it open.
pub const ANY_GAIT: &str = "any";

/// What the motion is for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Task {
    /// Wanted direction of travel in the world frame, of any length (the character starts heading
    /// along +x); only x and y count.
    pub direction: [f64; 3],
    /// `any`, or the name of a gait that so many legs have: of four `walk`, `trot`, `pace`, `canter`, `gallop`,
    /// `bound`, `pronk`, and more closely `running trot`, `transverse gallop`, `rotary gallop`; of six `wave`, `ripple`,
    /// `tripod`; of eight `wave`, `ripple`, `tetrapod`; of two `walk`, `run`, `hop`; of a body without legs `undulation`,
    /// `crawling`, `sidewinding`, as the direction allows.
    pub gait: String,
    /// Wanted speed along the direction: m/s, or `fastest`; where `null` the comfortable one, at which the gait costs
    /// least. A search without leg programs goes as fast as it can where `null`.
    pub speed: Option<AskedSpeed>,
    /// The speed as a Froude number v² / (g h) with the standing height of the hips h, from 10⁻⁴ to 100, in place of `speed`.
    pub froude: Option<f64>,
    /// What is charged against progress.
    pub weights: Weights,
}

/// A speed as a document asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of m/s, or \"fastest\"")]
pub enum AskedSpeed {
    /// m/s.
    Number(f64),
    /// A word in place of a number.
    Word(SpeedWord),
}

/// Speeds that have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpeedWord {
    /// As fast as can be.
    Fastest,
}

/// What a motion's speed is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// The one at which the gait costs least.
    Comfortable,
    /// This one, m/s.
    At(f64),
    /// As fast as can be.
    Fastest,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            direction: [1.0, 0.0, 0.0],
            gait: ANY_GAIT.to_owned(),
            speed: None,
            froude: None,
            weights: Weights::default(),
        }
    }
}

impl Task {
    /// The speed wanted of a character for which g l, the product of gravity and hip height, is so much, m²/s².
    pub fn pace(&self, gravity_times_height: f64) -> Pace {
        match (self.froude, self.speed) {
            (Some(froude), _) => Pace::At((froude * gravity_times_height).sqrt()),
            (None, None) => Pace::Comfortable,
            (None, Some(AskedSpeed::Number(speed))) => Pace::At(speed),
            (None, Some(AskedSpeed::Word(SpeedWord::Fastest))) => Pace::Fastest,
        }
    }

    /// Whether the gait is left open.
    pub fn any_gait(&self) -> bool {
        self.gait == ANY_GAIT
    }

    /// Everything impossible in the task, with JSON pointers into it, for whatever character.
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
        if let Some(AskedSpeed::Number(speed)) = self.speed
            && !(speed > 0.0 && speed <= GREATEST_SPEED)
        {
            let reason = format!("the speed must be a positive number of at most {GREATEST_SPEED} m/s");
            faults.push(Fault::new("/speed", reason));
        }
        if self.froude.is_some_and(|froude| !(LEAST_FROUDE..=GREATEST_FROUDE).contains(&froude)) {
            let reason = format!("the Froude number must be from {LEAST_FROUDE} to {GREATEST_FROUDE}");
            faults.push(Fault::new("/froude", reason));
        }
        if self.froude.is_some() && self.speed.is_some() {
            faults.push(Fault::new("/froude", "a speed is asked for as well; only one of the two can be"));
        }
        for (name, weight) in self.weights.named() {
            if !(0.0..=GREATEST_WEIGHT).contains(&weight) {
                let reason = format!("a weight must lie between 0 and {GREATEST_WEIGHT:e}");
                faults.push(Fault::new(format!("/weights/{name}"), reason));
            }
        }
        faults
    }
}

/// Factors by which costs count: 1 is usual, 0 leaves a cost out. All costs are without unit and suit small and large
/// characters alike.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Weights {
    /// The cost of transport, and, of gaits by name, torques and joint speeds near their limits.
    pub energy: f64,
    /// Travel across the direction.
    pub drift: f64,
    /// Change of heading.
    pub turn: f64,
    /// Sliding of what stands.
    pub slip: f64,
    /// Peaks of the feet's forces; to QDSEGA, what a link carries beyond the whole weight.
    pub impact: f64,
    /// Jerky torques, and, of gaits by name, strides that differ from each other.
    pub smoothness: f64,
    /// Swaying of the trunk, and, of gaits by name, anything but feet on the ground.
    pub posture: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { energy: 1.0, drift: 1.0, turn: 1.0, slip: 1.0, impact: 1.0, smoothness: 1.0, posture: 1.0 }
    }
}

impl Weights {
    fn named(&self) -> [(&'static str, f64); 7] {
        let Self { energy, drift, turn, slip, impact, smoothness, posture } = *self;
        [
            ("energy", energy),
            ("drift", drift),
            ("turn", turn),
            ("slip", slip),
            ("impact", impact),
            ("smoothness", smoothness),
            ("posture", posture),
        ]
    }
}
