//! Who moves, where and how fast, and what a motion costs.

use std::sync::Arc;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Gains, Scene};
use gaitwright_physics::stance::Stance;

use super::trail::Found;
use crate::check::{CheckedMotion, MotionCheck};
use crate::learn::{AskedSpeed, Behaviour, LearningSetup, Parameters, Task, Trunk, Weights};
use crate::program::cost::cost;
use crate::program::gaits::{NamedGait, gaits};
use crate::program::ring::{Ring, Wanted};
use crate::program::rollout::Arena;
use crate::program::subject::Subject;
use crate::training::LearnedMotion;

/// Froude number that is asked for: between the usual ones of a walk and of a run.
pub const FROUDE: f64 = 0.4;
/// For how long a motion is played to tell what it costs, s.
const JUDGED: f64 = 10.0;

/// The character, its task, and where it moves.
#[derive(Debug, Clone)]
pub struct StudyArena {
    /// The character with its legs.
    pub subject: Subject,
    /// The speed that is asked for, m/s, along x.
    pub speed: f64,
}

impl StudyArena {
    /// `model` on level ground; `None` where it has no legs in pairs, so that its gaits have no names.
    pub fn new(model: &Arc<Model>) -> Option<Self> {
        let (scene, accuracy) = (Scene::default(), Accuracy::default());
        let stance = Stance::find(model, &scene);
        let task = Task::default();
        let legs = Subject::new(model, &Arc::new(stance.clone()), &scene, &accuracy, task.direction).ok()?;
        // All variants drive the same springs and dampers: those of leg programs.
        let stance = Arc::new(Stance { gains: legs.gains.clone(), ..stance });
        let subject = Subject { stance, ..legs };
        if gaits(subject.legs.legs.len()).is_empty() {
            return None;
        }
        let speed = (FROUDE * subject.gravity() * subject.legs.hip_height).sqrt();
        Some(Self { subject, speed })
    }

    /// The gaits that are used at the speed asked for.
    pub fn gaits(&self) -> Vec<NamedGait> {
        gaits(self.subject.legs.legs.len()).into_iter().filter(|gait| gait.suits(FROUDE)).collect()
    }

    /// What is asked of a gait here.
    pub fn wanted(&self, gait: NamedGait) -> Wanted {
        Wanted::at_froude(&self.subject.legs, gait, FROUDE, self.subject.gravity())
    }

    /// What QDSEGA is given, with its cost of energy times a factor.
    pub fn setup(&self, trunk: Trunk, parameters: Parameters, energy: f64, seed: u64) -> LearningSetup {
        let Subject { model, stance, accuracy, .. } = &self.subject;
        let weights = Weights::default();
        let task = Task {
            speed: Some(AskedSpeed::Number(self.speed)),
            weights: Weights { energy: energy * weights.energy, ..weights },
            ..Task::default()
        };
        let (model, stance) = (model.clone(), stance.clone());
        let scene = trunk.in_scene(&self.subject.scene);
        LearningSetup { model, stance, scene, accuracy: *accuracy, task, parameters, seed, threads: 1 }
    }

    /// Where rings are tried, with the trunk as it is in a variant.
    ///
    /// # Errors
    /// Every fault of the scene.
    pub fn arena(&self, trunk: Trunk) -> Result<Arena, InputError> {
        Subject { scene: trunk.in_scene(&self.subject.scene), ..self.subject.clone() }.arena()
    }

    /// What a ring costs as the named gait that it costs least as, over so many strides, with the simulated time, s.
    pub fn cost(&self, arena: &Arena, ring: &Ring, gains: &Gains, strides: usize) -> (f64, f64) {
        let plain = arena.run(ring, gains, strides);
        let disturbed = arena.run_disturbed(&plain, ring, gains, strides);
        let legs = &self.subject.legs;
        let costs = gaits(legs.legs.len())
            .into_iter()
            .map(|gait| cost(&self.wanted(gait), ring.period, legs, &plain, &disturbed));
        (
            costs.fold(f64::INFINITY, f64::min),
            plain.seconds + disturbed.iter().map(|it| it.seconds).sum::<f64>(),
        )
    }

    /// What a motion costs over ten seconds.
    pub(super) fn natural_cost(&self, arena: &Arena, found: &Found) -> f64 {
        let Behaviour { transition_time, entry, cycle, .. } = &found.behaviour;
        let period = transition_time * cycle.len() as f64;
        let ring = Ring { period, entry: entry.clone(), cycle: cycle.clone(), missed: 0.0, steering: None };
        self.cost(arena, &ring, &found.gains, (JUDGED / period).ceil() as usize).0
    }

    /// The continuous check of a motion, as jobs have it.
    ///
    /// # Errors
    /// Every fault of scene and gains.
    pub(super) fn check(&self, trunk: Trunk, found: &Found) -> Result<CheckedMotion, InputError> {
        let Subject { model, stance, accuracy, direction, .. } = &self.subject;
        let motion = LearnedMotion {
            name: String::new(),
            gait: None,
            speed: None,
            behaviour: found.behaviour.clone(),
            gains: found.gains.clone(),
            parameters: Vec::new(),
            trials: Vec::new(),
        };
        let check = MotionCheck {
            model,
            stance,
            gains: &found.gains,
            scene: &trunk.in_scene(&self.subject.scene),
            accuracy,
            player: &motion.player(&stance.angles),
            direction: *direction,
            speed: Some(self.speed),
            gait: None,
        };
        check.run(&|| false)
    }
}
