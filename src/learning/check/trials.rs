//! What is left of a motion when something is changed: friction, gains, mass, a push, the step, the ground, the engine.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use nalgebra::{Point3, Vector3};

use super::{CHECKED, CheckedMotion, MotionCheck};
use crate::accuracy::Engine;
use crate::accuracy::rapier::Rapier;
use crate::gait::{UNCLASSIFIED, leaps};
use crate::program::disturbance;
use crate::program::legs::Legs;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::{Playing, Trial, ahead};
use gaitwright_physics::playback::{Playback, Push, Trace};
use gaitwright_physics::scene::{Accuracy, Effect, StepPlan, Switch};
use gaitwright_physics::sim::{Command, center_of_mass};
use gaitwright_physics::stance::Upright;

/// How many rounds of the loop a trial lasts at least and at most; in between, as long as the check. A small character takes many short
/// strides of many short steps, so that the usual 20 s would take minutes to simulate.
const ROUNDS: [f64; 2] = [10.0, 120.0];

/// Longest time between two samples of a trial, s, and as a share of the loop: a trial may last ten rounds only, of which a sample is
/// to be less than the share that a motion may lack at its end.
const SAMPLED: f64 = 0.02;
const SAMPLED_SHARE: f64 = 1.0 / 12.0;

/// By what share the speed may change with the step of the simulation. What moves is the same at any step; only the simulation's error
/// differs.
const STEP_TOLERANCE: f64 = 0.05;

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
    /// Time constant of contacts where they are softer than in the scene, s.
    soft: Option<f64>,
    engine: Engine,
    /// By what share the speed may change.
    tolerance: f64,
}

impl Change {
    fn none(name: String) -> Self {
        Self {
            name,
            friction: 1.0,
            gains: 1.0,
            mass: 1.0,
            step: 1.0,
            push: None,
            soft: None,
            engine: Engine::Gaitwright,
            tolerance: Trial::usual_tolerance(),
        }
    }

    /// About how long it takes, in runs as the motion was learned.
    fn cost(&self) -> f64 {
        let each = if self.engine == Engine::Rapier { RAPIER_STEP } else { 1.0 };
        each / self.step
    }
}

/// How many times a step of ours one of rapier's takes, about.
const RAPIER_STEP: f64 = 16.0;

/// Where a character's centre of mass was when, and when it had fallen.
#[derive(Debug, Default)]
struct Course {
    /// Time, s, and place in the world frame, m, of each sample.
    marks: Vec<(f64, Point3<f64>)>,
    fell_at: Option<f64>,
}

impl From<&Trace> for Course {
    fn from(trace: &Trace) -> Self {
        let marks = trace.samples.iter().map(|sample| (sample.time, sample.center_of_mass));
        Self { marks: marks.collect(), fell_at: trace.fell_at }
    }
}

impl MotionCheck<'_> {
    /// Plays under every changed condition, on `threads` threads, which changes nothing about the result; without what
    /// `stop` cuts short. `checked` is the motion played as it was learned, for as long at least. The ground is as soft as leaps are tried
    /// on where the gait is called a leap there; where it has no name, the name that was wanted decides.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub fn trials(
        &self,
        checked: &CheckedMotion,
        threads: usize,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Trial>, InputError> {
        let named = checked.gait.gait.as_deref().filter(|name| *name != UNCLASSIFIED);
        let changes = self.changes(named.or(self.gait));
        let undisturbed = Course::from(&checked.trace);
        let results: Vec<Mutex<Result<Option<Trial>, InputError>>> =
            changes.iter().map(|_| Mutex::new(Ok(None))).collect();
        // What takes longest first, so that no thread works on alone at the end.
        let mut order: Vec<usize> = (0..changes.len()).collect();
        order.sort_by(|&a, &b| changes[a].cost().total_cmp(&changes[b].cost()).reverse());
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(&index) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                let trial = self.trial(&changes[index], &undisturbed, stop);
                if stop() {
                    break;
                }
                *results[index].lock().unwrap_or_else(PoisonError::into_inner) = trial;
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads.clamp(1, changes.len()) {
                scope.spawn(work);
            }
            work();
        });
        results
            .into_iter()
            .filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner).transpose())
            .collect()
    }

    /// Everything that is tried of a motion that goes by the name `gait`. A step that the simulator would refuse is not.
    fn changes(&self, gait: Option<&str>) -> Vec<Change> {
        let mut changes = Vec::new();
        for factor in disturbance::FRICTION {
            let name = format!("friction times {factor}");
            changes.push(Change { friction: factor, ..Change::none(name) });
        }
        let gains = disturbance::GAINS;
        changes.push(Change { gains, ..Change::none(format!("gains times {gains}")) });
        for factor in disturbance::MASS {
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
                    tolerance: STEP_TOLERANCE,
                    ..Change::none(format!("step of {} ms", rounded(1000.0 * step)))
                });
            }
        }
        let soft = disturbance::soft_contact(self.hip_height(), self.gravity(), gait.is_some_and(leaps));
        if soft > self.scene.contact_time_constant {
            let name = format!("soft contacts of {:.2} ms", 1000.0 * soft);
            changes.push(Change { soft: Some(soft), ..Change::none(name) });
        }
        changes.push(Change { engine: Engine::Rapier, ..Change::none("engine rapier3d".to_owned()) });
        changes
    }

    /// About how many times as long as one run of the motion as it was learned all trials take: the same for every motion of a gait.
    pub fn cost_of_trials(&self) -> f64 {
        self.changes(self.gait).iter().map(Change::cost).sum()
    }

    /// How long a trial lasts, s.
    pub fn trial_seconds(&self) -> f64 {
        let [least, most] = ROUNDS.map(|rounds| self.player.lead() + rounds * self.player.period());
        CHECKED.clamp(least, most)
    }

    /// Time between two samples of a trial, s.
    fn trial_sampling(&self) -> f64 {
        let period = self.player.period();
        if period > 0.0 { SAMPLED.min(SAMPLED_SHARE * period) } else { SAMPLED }
    }

    /// To the left, half-way through what a trial has of the loop.
    fn push(&self) -> Push {
        let speed = disturbance::push(self.hip_height(), self.gravity());
        let time = 0.5 * (self.player.lead() + self.trial_seconds());
        Push { time, velocity: speed * Vector3::z().cross(&self.forward()) }
    }

    /// That by which the search measures its disturbances, m.
    fn hip_height(&self) -> f64 {
        Legs::hip_height_of(self.model, self.stance, self.direction)
    }

    /// m/s².
    fn gravity(&self) -> f64 {
        self.scene.acting_gravity().norm()
    }

    /// The direction of travel, level and of unit length.
    fn forward(&self) -> Vector3<f64> {
        ahead(self.direction)
    }

    /// What came of the motion with `change`; `None` where the other engine cannot do what the scene asks for.
    fn trial(
        &self,
        change: &Change,
        undisturbed: &Course,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Trial>, InputError> {
        let (mut scene, mut model) = if change.friction == 1.0 {
            (self.scene.clone(), self.model.clone())
        } else {
            disturbance::with_friction(change.friction, self.scene, self.model)
        };
        if change.mass != 1.0 {
            model = disturbance::heavier(change.mass, &model);
        }
        scene.contact_time_constant = change.soft.unwrap_or(scene.contact_time_constant);
        if change.engine == Engine::Rapier {
            // Its multibodies do not collide with themselves as ours do.
            scene.effects.insert(Effect::SelfCollision, Switch::Off);
        }
        let mut gains = self.gains.clone();
        gains.stiffness.iter_mut().chain(&mut gains.damping).for_each(|gain| *gain *= change.gains);
        let accuracy = Accuracy { step: change.step * self.accuracy.step, ..*self.accuracy };
        let playback = Playback {
            model: &model,
            plan: &Arc::new(StepPlan::compile(&scene, &accuracy, Some(&gains), &model)?),
            start: &self.stance.state,
            player: self.player,
            upright: &Upright::new(&model, self.stance, &scene),
            seconds: self.trial_seconds(),
            sample_every: self.trial_sampling(),
        };
        let course = match change.engine {
            Engine::Gaitwright => Some(Course::from(&playback.run_pushed(change.push, stop))),
            Engine::Rapier => in_rapier(&playback, stop),
        };
        Ok(course.map(|course| {
            let end = course.marks.last().map_or(0.0, |(time, _)| *time);
            let speed = self.speed_until(&course, end);
            let usual = self.speed_until(undisturbed, end).filter(|usual| *usual != 0.0);
            Trial {
                change: change.name.clone(),
                upright_seconds: course.fell_at.unwrap_or(end),
                speed: speed.unwrap_or(0.0),
                relative_speed: speed.zip(usual).map(|(speed, usual)| speed / usual),
                tolerance: change.tolerance,
                of_seconds: self.trial_seconds(),
            }
        }))
    }

    /// Mean speed along the direction from the start of the loop to `end`, m/s; `None` where there is no such stretch.
    fn speed_until(&self, course: &Course, end: f64) -> Option<f64> {
        let lead = self.player.lead() - 1e-9;
        let mut looping = course.marks.iter().filter(|(time, _)| *time >= lead && *time <= end + 1e-9);
        let (first, last) = (looping.next()?, looping.next_back()?);
        Some((last.1 - first.1).dot(&self.forward()) / (last.0 - first.0))
    }
}

/// Plays in rapier's multibody engine instead; `None` where it cannot do what the plan asks for.
fn in_rapier(playback: &Playback<'_>, stop: &dyn Fn() -> bool) -> Option<Course> {
    let Playback { model, plan, player, .. } = *playback;
    let mut rapier = Rapier::new(model, plan, playback.start).ok()?;
    let step = plan.step();
    let every = ((playback.sample_every / step).round() as usize).max(1);
    let joints = model.joint_count();
    let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
    let mut playing = Playing::new(player, &playback.start.root);
    playing.targets(player, 0.0, &playback.start.root, &mut now);
    let mut course = Course { marks: vec![(0.0, center_of_mass(model, rapier.state()))], fell_at: None };
    for index in 1..=(playback.seconds / step).round() as usize {
        let time = index as f64 * step;
        playing.targets(player, time, &rapier.state().root, &mut next);
        if rapier.step(Command::Track { now: &now, next: &next }).is_err() || stop() {
            break;
        }
        std::mem::swap(&mut now, &mut next);
        if index % every == 0 {
            course.marks.push((time, center_of_mass(model, rapier.state())));
        }
        if !playback.upright.holds(rapier.state()) {
            course.fell_at = Some(time);
            break;
        }
    }
    Some(course)
}

/// `value` to four digits after the point.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
