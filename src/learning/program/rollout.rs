//! A ring of keyframes in the simulator, as asked and disturbed.

use std::sync::Arc;

use nalgebra::Vector3;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::Playing;
use gaitwright_physics::scene::{Accuracy, Gains, Scene, StepPlan, Terrain};
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::{Stance, Upright};

use super::figures::{RolloutFigures, Watch};
use super::legs::Legs;
use super::ring::Ring;

/// Strides that are judged, after the entry, in the search.
pub const STRIDES: usize = 5;
/// The same with feedback, which shows what it is worth after more of them.
pub const STEERED_STRIDES: usize = 15;
/// What is changed in the disturbed run: friction, stiffness and damping times these, and a push of this share of
/// √(g h) to one side and back in its middle.
const SLIPPERY: f64 = 0.6;
const SOFTENED: f64 = 0.75;
const PUSH: f64 = 0.06;

/// Where gaits are tried: one for each thread.
#[derive(Debug, Clone)]
pub struct Arena {
    model: Arc<Model>,
    stance: Arc<Stance>,
    legs: Arc<Legs>,
    upright: Upright,
    direction: [f64; 2],
    gravity: f64,
    /// Height of the ground where it stands, m.
    ground: f64,
    /// As asked, and disturbed.
    runs: [(Scene, Accuracy); 2],
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
            ground: scene.ground.as_ref().map_or(0.0, |ground| Terrain::new(ground).height(0.0, 0.0)),
            runs: [(scene.clone(), *accuracy), (slippery, *accuracy)],
        })
    }

    /// The same place where disturbed runs are simulated with `accuracy`: a longer step is one more disturbance.
    #[must_use]
    pub fn disturbed_with(mut self, accuracy: &Accuracy) -> Self {
        self.runs[1].1 = *accuracy;
        self
    }

    /// Step of the undisturbed simulation, s.
    pub fn step(&self) -> f64 {
        self.runs[0].1.step
    }

    /// Plays `ring` with `gains` from the standing pose, as asked or `disturbed`, and judges `strides` strides after the
    /// entry. What cannot be simulated has fallen at once.
    pub fn run(&self, ring: &Ring, gains: &Gains, disturbed: bool, strides: usize) -> RolloutFigures {
        let (scene, accuracy) = &self.runs[usize::from(disturbed)];
        let step = accuracy.step;
        let stride = (ring.period / step).round().max(1.0) as usize;
        let mut watch = Watch::new(
            &self.model,
            &self.legs,
            (self.direction, self.gravity, self.ground),
            (step, ring.period),
        );
        let mut gains = gains.clone();
        if disturbed {
            gains.stiffness.iter_mut().chain(&mut gains.damping).for_each(|gain| *gain *= SOFTENED);
        }
        let Ok(plan) = StepPlan::compile(scene, accuracy, Some(&gains), &self.model) else {
            return watch.figures(0.0, 0.0);
        };
        let mut simulator = Simulator::new(Arc::new(plan), self.stance.state.clone());
        let player = ring.player(&self.stance.angles);
        let lead = (ring.lead() / step).round() as usize;
        let total = lead + strides * stride;
        let push = disturbed.then(|| lead + stride * strides / 2);
        let joints = self.model.joint_count();
        let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
        let mut playing = Playing::new(&player, &self.stance.state.root);
        playing.targets(&player, 0.0, &self.stance.state.root, &mut next);
        let mut done = 0;
        while done < total {
            if done == lead {
                watch.begin(&simulator);
            }
            if Some(done) == push {
                self.push(&mut simulator);
            }
            std::mem::swap(&mut now, &mut next);
            let root = simulator.state().root;
            playing.targets(&player, (done + 1) as f64 * step, &root, &mut next);
            let stepped = simulator.step(Command::Track { now: &now, next: &next }).is_ok();
            if !stepped || !self.upright.holds(simulator.state()) {
                break;
            }
            done += 1;
            watch.step(&simulator, done > lead);
            if watch.lies() {
                break;
            }
        }
        watch.figures(done as f64 / total as f64, done as f64 * step)
    }

    /// Pushes the trunk aside and back.
    fn push(&self, simulator: &mut Simulator) {
        let mut state = simulator.state().clone();
        let speed = PUSH * (self.gravity * self.legs.hip_height).sqrt();
        let [x, y] = self.direction;
        state.root.linear_velocity += Vector3::new(-x - y, x - y, 0.0) * speed;
        simulator.set_state(&state);
    }
}
