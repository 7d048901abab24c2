//! Whether a task can be one of a character.

use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::Scene;
use gaitwright_physics::stance::Stance;

use crate::learn::{AskedSpeed, GREATEST_FROUDE, LEAST_FROUDE, Task};
use crate::program::gaits::{task_gaits, with_gaits};
use crate::program::legs::Legs;

/// Whether a character that stands so has the task's gait, and is not asked for a speed beyond the least or the greatest Froude number.
///
/// # Errors
/// [`InputError::Impossible`] at `/task/gait`, with the gaits that there are, and at `/task/speed`.
pub fn check_task(task: &Task, model: &Model, stance: &Stance, scene: &Scene) -> Result<(), InputError> {
    let faults = [gait_fault(task, model, stance, scene), speed_fault(task, model, stance, scene)];
    let faults: Vec<Fault> = faults.into_iter().flatten().collect();
    if faults.is_empty() { Ok(()) } else { Err(InputError::Impossible(faults)) }
}

fn speed_fault(task: &Task, model: &Model, stance: &Stance, scene: &Scene) -> Option<Fault> {
    let Some(AskedSpeed::Number(speed)) = task.speed else { return None };
    let gravity = scene.acting_gravity().norm();
    let height = Legs::hip_height_of(model, stance, task.direction);
    let froude = speed * speed / (gravity * height);
    let speed_at = |froude: f64| (froude * gravity * height).sqrt();
    let within = (LEAST_FROUDE..=GREATEST_FROUDE).contains(&froude);
    (gravity > 0.0 && !within).then(|| {
        let reason = format!(
            "{speed} m/s is a Froude number of {froude:.3e} for this character, which can be from {LEAST_FROUDE} to {GREATEST_FROUDE}: \
             from {:.3e} to {:.3e} m/s",
            speed_at(LEAST_FROUDE),
            speed_at(GREATEST_FROUDE),
        );
        Fault::new("/task/speed", reason)
    })
}

fn gait_fault(task: &Task, model: &Model, stance: &Stance, scene: &Scene) -> Option<Fault> {
    if task.any_gait() {
        return None;
    }
    let gravity = scene.acting_gravity().norm();
    let legs = with_gaits(model, stance, gravity, task.direction);
    let reason = match legs.map(|legs| task_gaits(&legs)) {
        Ok(known) if known.contains(&task.gait.as_str()) => return None,
        Ok(known) => {
            let known = known.join(", ");
            format!("the character has no gait `{}` in the task's direction; there are {known}", task.gait)
        }
        Err(none) => format!("the character has no gait `{}`, and only `any` suits it: {none}", task.gait),
    };
    Some(Fault::new("/task/gait", reason))
}
