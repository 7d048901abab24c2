//! What a motion has to withstand in the search and in the trials that it is played in at its end: by how much each thing is changed.
//! The search changes friction, gains and speed at once; the trials change one thing each.

use std::sync::Arc;

use gaitwright_physics::character::{Character, Friction};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::Scene;

/// Factors of the coefficient of friction.
pub const FRICTION: [f64; 2] = [0.6, 1.4];

/// Factors of every mass and rotational inertia.
pub const MASS: [f64; 2] = [0.9, 1.1];

/// Factor of stiffness and damping.
pub const GAINS: f64 = 0.75;

/// The same on little friction in the search for leaps. Softer legs push off with less force, so that on less friction as well they do not
/// show that stiff ones slip: with [`GAINS`] two of five bounds of `anymal_b` slipped on the spot where friction alone was changed in
/// the trials, with this none of five, and all kept the trial of softer gains too.
pub const GAINS_OF_LEAPS: f64 = 1.0;

/// Change of velocity by a push, in √(g h): in the search that of each of two components, in the trials that of the whole.
const PUSH: f64 = 0.06;

/// Time constant of soft contacts, in √(h / g), for gaits whose left and right legs take turns.
///
/// For a dog 25 ms, a little more than what MuJoCo's contacts have where nothing is said of them (`solref` 0.02): what only hard ground
/// makes steady stumbles on either.
const SOFT: f64 = 0.15;

/// The same for leaps, whose legs push together: a quarter, for a dog 6 ms. Each push has to turn the trunk's pitch round within a
/// stance of some 80 ms, which ground that takes 25 ms to give way does not allow. With half fewer bounds were natural, and none of
/// three kept every trial (with a quarter four of five).
const SOFT_FOR_LEAPS: f64 = SOFT / 4.0;

/// Factor of the coefficient of friction on that soft ground for gallops, which push along the ground the hardest: about what is left
/// of a circle's radius across the edges of a friction pyramid, which is what MuJoCo's contacts have where nothing is said of them.
pub const GRIP_OF_GALLOPS: f64 = 0.7;

/// `scene` and `model` with every coefficient of friction times `factor`: those of links and obstacles that have their own as well, since
/// in a contact the smaller of both sides holds.
pub fn with_friction(factor: f64, scene: &Scene, model: &Arc<Model>) -> (Scene, Arc<Model>) {
    let mut scene = Scene { friction: factor * scene.friction, ..scene.clone() };
    for friction in scene.obstacles.iter_mut().filter_map(|obstacle| obstacle.friction.as_mut()) {
        *friction *= factor;
    }
    if model.character.links.iter().all(|link| link.surface.friction.is_none()) {
        return (scene, model.clone());
    }
    let model = changed(model, |character| {
        for friction in character.links.iter_mut().filter_map(|link| link.surface.friction.as_mut()) {
            *friction = match *friction {
                Friction::Uniform(coefficient) => Friction::Uniform(factor * coefficient),
                Friction::Directional { along, across, axis } => {
                    Friction::Directional { along: factor * along, across: factor * across, axis }
                }
            };
        }
    });
    (scene, model)
}

/// `model` with every mass and rotational inertia times `factor`.
pub fn heavier(factor: f64, model: &Model) -> Arc<Model> {
    changed(model, |character| {
        for inertial in character.links.iter_mut().filter_map(|link| link.inertial.as_mut()) {
            inertial.mass *= factor;
            inertial.inertia *= factor;
        }
    })
}

/// The model of a character that is changed.
fn changed(model: &Model, change: impl FnOnce(&mut Character)) -> Arc<Model> {
    let mut character = (*model.character).clone();
    change(&mut character);
    Arc::new(Model::new(Arc::new(character), Base::fixed_if(model.fixed_base)))
}

/// Change of velocity by a push, m/s, for hips at a `height` above the ground, m, under `gravity`, m/s²; without legs see
/// [`Legs::hip_height`](super::legs::Legs::hip_height).
pub fn push(height: f64, gravity: f64) -> f64 {
    PUSH * (gravity * height.max(0.0)).sqrt()
}

/// Time constant of soft contacts for a gait that [leaps](crate::gait::leaps) or does not, s; for the others see [`push`]. 0 without
/// weight or height.
pub fn soft_contact(height: f64, gravity: f64, leaps: bool) -> f64 {
    let softness = if leaps { SOFT_FOR_LEAPS } else { SOFT };
    if gravity > 0.0 { softness * (height.max(0.0) / gravity).sqrt() } else { 0.0 }
}
