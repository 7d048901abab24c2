//! What is left of a motion when something is changed: friction, gains, mass, a push, the step.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use nalgebra::Vector3;

use super::perform::MotionCheck;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Trial;
use gaitwright_physics::playback::{Playback, Push, Trace};
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::stance::Upright;

/// How long a trial lasts, s.
const TRIED: f64 = 10.0;

/// Time between two samples of a trial, s.
const SAMPLED: f64 = 0.02;

/// Change of the sideways velocity by the push, in √(g h) with the standing height h of the root.
const PUSH: f64 = 0.06;

/// What a trial changes, as factors of what the motion was learned with.
#[derive(Debug, Clone)]
struct Change {
    /// In words.
    name: String,
    friction: f64,
    /// Of stiffness and damping alike.
    gains: f64,
    /// Of the mass and the rotational inertia of every link.
    mass: f64,
    step: f64,
    push: Option<Push>,
}

impl Change {
    fn none(name: String) -> Self {
        Self { name, friction: 1.0, gains: 1.0, mass: 1.0, step: 1.0, push: None }
    }
}

impl MotionCheck<'_> {
    /// Plays under every changed condition, on `threads` threads, which changes nothing about the result; without what
    /// `stop` cuts short. `undisturbed` is the motion played as it was learned, for as long at least.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub(super) fn trials(
        &self,
        undisturbed: &Trace,
        threads: usize,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Trial>, InputError> {
        let changes = self.changes();
        let results: Vec<Mutex<Option<Result<Trial, InputError>>>> =
            changes.iter().map(|_| Mutex::new(None)).collect();
        let next = AtomicUsize::new(0);
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some((change, result)) = changes.get(index).zip(results.get(index)) else { break };
                let trial = self.trial(change, undisturbed, stop);
                if stop() {
                    break;
                }
                *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(trial);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads.clamp(1, changes.len()) {
                scope.spawn(&work);
            }
            work();
        });
        results
            .into_iter()
            .filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner))
            .collect()
    }

    /// Everything that is tried. A step that the simulator would refuse is not.
    fn changes(&self) -> Vec<Change> {
        let mut changes = Vec::new();
        for factor in [0.6, 1.4] {
            let name = format!("friction {:.2}", factor * self.scene.friction);
            changes.push(Change { friction: factor, ..Change::none(name) });
        }
        changes.push(Change { gains: 0.75, ..Change::none("gains times 0.75".to_owned()) });
        for factor in [0.9, 1.1] {
            changes.push(Change { mass: factor, ..Change::none(format!("mass times {factor}")) });
        }
        let push = self.push();
        let impulse = push.velocity.norm() * self.model.mass;
        let name = format!("sideways push of {impulse:.2} N s at {:.1} s", push.time);
        changes.push(Change { push: Some(push), ..Change::none(name) });
        for factor in [2.0, 0.25] {
            let step = factor * self.accuracy.step;
            if (Accuracy { step, ..*self.accuracy }).faults().is_empty() {
                changes.push(Change {
                    step: factor,
                    ..Change::none(format!("step of {} ms", rounded(1000.0 * step)))
                });
            }
        }
        changes
    }

    /// To the left, half-way through the trial, but not before the entry is over.
    fn push(&self) -> Push {
        let [x, y, z] = self.scene.gravity;
        let speed = PUSH * (x.hypot(y).hypot(z) * self.stance.root_height.max(0.0)).sqrt();
        let time = (0.5 * TRIED).max(self.player.lead().min(TRIED));
        Push { time, velocity: speed * Vector3::z().cross(&self.forward()) }
    }

    /// The direction of travel, level and of unit length.
    fn forward(&self) -> Vector3<f64> {
        let [x, y, _] = self.direction;
        Vector3::new(x, y, 0.0).try_normalize(0.0).unwrap_or_else(Vector3::x)
    }

    fn trial(
        &self,
        change: &Change,
        undisturbed: &Trace,
        stop: &dyn Fn() -> bool,
    ) -> Result<Trial, InputError> {
        let model =
            if change.mass == 1.0 { self.model.clone() } else { Arc::new(heavier(self.model, change.mass)) };
        let scene = Scene { friction: change.friction * self.scene.friction, ..self.scene.clone() };
        let mut gains = self.gains.clone();
        gains.stiffness.iter_mut().chain(&mut gains.damping).for_each(|gain| *gain *= change.gains);
        let accuracy = Accuracy { step: change.step * self.accuracy.step, ..*self.accuracy };
        let playback = Playback {
            model: &model,
            plan: &Arc::new(StepPlan::compile(&scene, &accuracy, Some(&gains), &model)?),
            start: &self.stance.state,
            player: self.player,
            upright: &Upright::new(&model, self.stance, &scene),
            seconds: TRIED,
            sample_every: SAMPLED,
        };
        let trace = playback.run_pushed(change.push, stop);
        let end = trace.samples.last().map_or(0.0, |sample| sample.time);
        let speed = self.speed_until(&trace, end);
        let usual = self.speed_until(undisturbed, end);
        let relative_speed =
            speed.zip(usual).filter(|(_, usual)| *usual != 0.0).map(|(speed, usual)| speed / usual);
        Ok(Trial {
            change: change.name.clone(),
            upright_seconds: trace.fell_at.unwrap_or(end),
            speed: speed.unwrap_or(0.0),
            relative_speed,
            of_seconds: TRIED,
        })
    }

    /// Mean speed along the direction from the start of the loop to `end`, m/s; `None` where the trace has no such stretch.
    fn speed_until(&self, trace: &Trace, end: f64) -> Option<f64> {
        let lead = self.player.lead() - 1e-9;
        let mut looping =
            trace.samples.iter().filter(|sample| sample.time >= lead && sample.time <= end + 1e-9);
        let (first, last) = (looping.next()?, looping.next_back()?);
        let way = last.center_of_mass - first.center_of_mass;
        Some(way.dot(&self.forward()) / (last.time - first.time))
    }
}

/// `model` with every mass and inertia times `factor`.
fn heavier(model: &Model, factor: f64) -> Model {
    let mut character = (*model.character).clone();
    for inertial in character.links.iter_mut().filter_map(|link| link.inertial.as_mut()) {
        inertial.mass *= factor;
        inertial.inertia *= factor;
    }
    Model::new(Arc::new(character), Base::fixed_if(model.fixed_base))
}

/// `value` to four digits after the point.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
