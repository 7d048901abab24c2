//! A ring of keyframes in the simulator, as asked and disturbed.

use std::sync::Arc;

use nalgebra::Vector3;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Playing, ahead_in_plane};
use gaitwright_physics::scene::{Accuracy, Gains, Scene, StepPlan, Terrain};
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::{Stance, Upright};

use super::disturbance;
use super::figures::{RolloutFigures, Watch};
use super::gaits::NamedGait;
use super::legs::Legs;
use super::ring::Ring;
use crate::gait::leaps;
use crate::learn::Stop;

/// Strides that are judged, after the entry, in the search.
pub const STRIDES: usize = 5;
/// The same of gallops, whose strides are half as long: in MuJoCo, on contacts of 5 ms, two of five of the bundled quadruped that were tried
/// over five strides fell after 2 to 4 s, and none of five that were tried over ten.
pub const GALLOPING_STRIDES: usize = 10;
/// The same with feedback, which shows what it is worth after more of them.
pub const STEERED_STRIDES: usize = 15;
/// The same of what balances by it: a walk of `bolt` that had been tried over half as many fell after 19 and 36 strides in two trials.
pub const BALANCED_STRIDES: usize = 30;
/// The same where it is only to be seen how it sets out.
const FIRST_STRIDES: usize = 5;

/// Where gaits are tried; all threads share it.
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
    as_asked: Conditions,
    /// Slippery ground and a push, with weaker actuators where these do not hide that others slip.
    slippery: Conditions,
    /// Soft ground, unless that of the scene is as soft.
    soft: Option<Conditions>,
    /// Weaker actuators alone, for what balances.
    weak_legs: Option<Conditions>,
    /// Under what it sets out again, for [`FIRST_STRIDES`] only.
    setting_out: Vec<Conditions>,
    /// What breaks off runs.
    stop: Stop,
}

/// Under what a gait is simulated.
#[derive(Debug, Clone)]
struct Conditions {
    model: Arc<Model>,
    scene: Scene,
    accuracy: Accuracy,
    /// Factor of stiffness and damping.
    gains: f64,
    push: Option<Push>,
}

/// A change of the trunk's velocity.
#[derive(Debug, Clone, Copy)]
struct Push {
    /// Parts of the entry, and from 1 on of the strides after it.
    at: f64,
    /// To the left and backward, m/s.
    velocity: [f64; 2],
}

impl Conditions {
    /// The same on ground whose contacts have `contact_time_constant`, s; `None` where it is no softer.
    fn softer(&self, contact_time_constant: f64) -> Option<Self> {
        let softer = contact_time_constant > self.scene.contact_time_constant;
        softer.then(|| Self { scene: Scene { contact_time_constant, ..self.scene.clone() }, ..self.clone() })
    }
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
        let (height, gravity) = (legs.hip_height, scene.acting_gravity().norm());
        let as_asked = Conditions {
            model: model.clone(),
            scene: scene.clone(),
            accuracy: *accuracy,
            gains: 1.0,
            push: None,
        };
        let (slippery_scene, slipping) = disturbance::with_friction(disturbance::FRICTION[0], scene, model);
        let slippery = Conditions {
            model: slipping,
            scene: slippery_scene,
            gains: disturbance::GAINS,
            push: Some(Push { at: 1.5, velocity: [disturbance::push(height, gravity); 2] }),
            ..as_asked.clone()
        };
        let soft = as_asked.softer(disturbance::soft_contact(height, gravity, false));
        Ok(Self {
            model: model.clone(),
            stance: stance.clone(),
            legs: legs.clone(),
            upright: Upright::new(model, stance, scene),
            direction: ahead_in_plane(direction),
            gravity,
            ground: scene.ground.as_ref().map_or(0.0, |ground| Terrain::new(ground).height(0.0, 0.0)),
            as_asked,
            slippery,
            soft,
            weak_legs: None,
            setting_out: Vec::new(),
            stop: Stop::default(),
        })
    }

    /// The same place where runs are broken off by `stop`; what they then give is worth nothing.
    #[must_use]
    pub fn until(mut self, stop: &Stop) -> Self {
        self.stop = stop.clone();
        self
    }

    /// The same place where disturbed runs are simulated as accurately as in `other`: a longer step is one more disturbance.
    #[must_use]
    pub fn disturbed_as_in(mut self, other: &Self) -> Self {
        for conditions in std::iter::once(&mut self.slippery).chain(&mut self.soft) {
            conditions.accuracy = other.slippery.accuracy;
        }
        self
    }

    /// The same place with disturbances as they are for `gait`.
    #[must_use]
    pub fn suited(self, gait: &NamedGait) -> Self {
        let leaps = leaps(gait.gait);
        let gains = if leaps { disturbance::GAINS_OF_LEAPS } else { disturbance::GAINS };
        let slippery = Conditions { gains, ..self.slippery.clone() };
        let time = disturbance::soft_contact(self.legs.hip_height, self.gravity, leaps);
        let accuracy = self.slippery.accuracy;
        let grip = if gait.gallops() { disturbance::GRIP_OF_GALLOPS } else { 1.0 };
        let soft = self.as_asked.softer(time).map(|soft| {
            let (scene, model) = disturbance::with_friction(grip, &soft.scene, &soft.model);
            Conditions { accuracy, scene, model, ..soft }
        });
        Self { slippery, soft, ..self }
    }

    /// The same place for what balances by its feedback. On soft ground it is pushed, to the other side, while it sets out: of seven walks of
    /// `bolt` that were not, four fell in some trial within the first 2 s. Legs are weak there, and on usual ground, not on slippery ground:
    /// weak ones hide that others slip. Of six walks of `bolt` that were tried with both at once four fell with less friction alone, and
    /// five with softer gains alone; of three that were tried with weak legs on usual ground for few strides only all fell with them later.
    ///
    /// It sets out three more times, each time otherwise changed, once with the step of `longer`, and pushed another way at another moment.
    /// What a push leaves is soon made up for, or it falls soon, and few strides show which. Of two walks of `bolt` that had not been tried
    /// so one fell in four trials of ten within 2 s.
    #[must_use]
    pub fn balancing(mut self, longer: &Self) -> Self {
        let plain = self.as_asked.clone();
        let soft = self.soft.clone().unwrap_or_else(|| plain.clone());
        let of_mass = |factor: f64| disturbance::heavier(factor, &plain.model);
        let [lighter, heavier] = disturbance::MASS.map(of_mass);
        let with_step = Conditions { accuracy: longer.as_asked.accuracy, ..plain.clone() };
        self.setting_out = vec![
            Conditions { push: self.pushed(0.25, [1.0, -1.0]), ..with_step },
            Conditions { model: lighter, push: self.pushed(0.5, [-1.0, 1.0]), ..soft },
            Conditions { model: heavier, push: self.pushed(1.0, [-1.0, -1.0]), ..plain.clone() },
        ];
        self.slippery.gains = 1.0;
        let push = self.pushed(0.5, [-1.0, -1.0]);
        if let Some(soft) = &mut self.soft {
            (soft.gains, soft.push) = (disturbance::GAINS, push);
        }
        let push = self.pushed(0.75, [1.0, 1.0]);
        self.weak_legs = Some(Conditions { gains: disturbance::GAINS, push, ..plain });
        self
    }

    /// The push of disturbed runs, so many times to the left and backward.
    fn pushed(&self, at: f64, [left, backward]: [f64; 2]) -> Option<Push> {
        let speed = disturbance::push(self.legs.hip_height, self.gravity);
        Some(Push { at, velocity: [left * speed, backward * speed] })
    }

    /// Step of the undisturbed simulation, s.
    pub fn step(&self) -> f64 {
        self.as_asked.accuracy.step
    }

    /// Plays `ring` with `gains` from the standing pose, and judges `strides` strides after the entry. What cannot be simulated
    /// has fallen at once.
    pub fn run(&self, ring: &Ring, gains: &Gains, strides: usize) -> RolloutFigures {
        self.run_under(&self.as_asked, ring, gains, strides)
    }

    /// The same under every disturbance, those of [`balancing`](Self::balancing) over the first strides last, where the undisturbed run
    /// was as in `plain`: what does not stay up by itself does not when it is disturbed, and is not simulated.
    pub fn run_disturbed(
        &self,
        plain: &RolloutFigures,
        ring: &Ring,
        gains: &Gains,
        strides: usize,
    ) -> Vec<RolloutFigures> {
        let run = |(conditions, strides)| match plain.upright < 1.0 {
            true => RolloutFigures::default(),
            false => self.run_under(conditions, ring, gains, strides),
        };
        self.disturbances(strides).map(run).collect()
    }

    /// About how many undisturbed runs over `strides` strides take as long as one and all disturbed ones.
    pub fn runs(&self, strides: usize) -> f64 {
        let share = |(_, its_own): (&Conditions, usize)| its_own as f64 / strides.max(1) as f64;
        1.0 + self.disturbances(strides).map(share).sum::<f64>()
    }

    /// What a gait is disturbed by, and over how many of `strides` strides.
    fn disturbances(&self, strides: usize) -> impl Iterator<Item = (&Conditions, usize)> {
        let all = std::iter::once(&self.slippery).chain(&self.soft).chain(&self.weak_legs);
        let all = all.map(move |conditions| (conditions, strides));
        let first = self.setting_out.iter().map(move |conditions| (conditions, FIRST_STRIDES.min(strides)));
        all.chain(first)
    }

    fn run_under(
        &self,
        conditions: &Conditions,
        ring: &Ring,
        gains: &Gains,
        strides: usize,
    ) -> RolloutFigures {
        let Conditions { model, scene, accuracy, gains: factor, push } = conditions;
        let step = accuracy.step;
        let stride = (ring.period / step).round().max(1.0) as usize;
        let mut watch = Watch::new(
            &self.model,
            &self.legs,
            (self.direction, self.gravity, self.ground),
            (step, ring.period),
        );
        let mut gains = gains.clone();
        gains.stiffness.iter_mut().chain(&mut gains.damping).for_each(|gain| *gain *= factor);
        let Ok(plan) = StepPlan::compile(scene, accuracy, Some(&gains), model) else {
            return watch.figures(0.0, 0.0);
        };
        let mut simulator = Simulator::new(Arc::new(plan), self.stance.state.clone());
        let player = ring.player(&self.stance.angles);
        let lead = (ring.lead() / step).round() as usize;
        let total = lead + strides * stride;
        let pushed = push.map(|Push { at, .. }| {
            let (of_entry, of_strides) =
                (at.min(1.0) * lead as f64, (at - 1.0).max(0.0) * (stride * strides) as f64);
            (of_entry + of_strides) as usize
        });
        let joints = self.model.joint_count();
        let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
        let mut playing = Playing::new(&player, &self.stance.state.root);
        playing.targets(&player, 0.0, &self.stance.state.root, &mut next);
        let mut done = 0;
        while done < total {
            if self.stop.check().is_err() {
                break;
            }
            if done == lead {
                watch.begin(&simulator);
            }
            if let Some(push) = push.filter(|_| Some(done) == pushed) {
                self.push(&mut simulator, push.velocity);
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

    /// Changes the trunk's velocity by so much to the left and backward, m/s.
    fn push(&self, simulator: &mut Simulator, [left, backward]: [f64; 2]) {
        let mut state = simulator.state().clone();
        let [x, y] = self.direction;
        state.push(Vector3::new(-y * left - x * backward, x * left - y * backward, 0.0));
        simulator.set_state(&state);
    }
}
