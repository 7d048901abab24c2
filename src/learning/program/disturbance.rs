//! What a motion has to withstand, in the search as in the trials that it is played in at its end.

use std::sync::Arc;

use gaitwright_physics::character::{Character, Friction};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::Scene;

/// Factors of the coefficient of friction.
pub const FRICTION: [f64; 2] = [0.6, 1.4];

/// Factor of stiffness and damping.
pub const GAINS: f64 = 0.75;

/// Change of velocity by a push, in √(g h).
const PUSH: f64 = 0.06;

/// Time constant of soft contacts, in √(h / g).
///
/// For a dog 25 ms, a little more than what MuJoCo's contacts have where nothing is said of them (`solref` 0.02): what only hard ground
/// makes steady stumbles on either.
const SOFT: f64 = 0.15;

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

/// Time constant of soft contacts, s; for the others see [`push`]. 0 without weight or height.
pub fn soft_contact(height: f64, gravity: f64) -> f64 {
    if gravity > 0.0 { SOFT * (height.max(0.0) / gravity).sqrt() } else { 0.0 }
}
