//! Who is to move, and where.

use std::sync::Arc;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{TargetLimits, ahead_in_plane};
use gaitwright_physics::scene::{Accuracy, Gains, Scene};
use gaitwright_physics::stance::Stance;

use super::gains::gains;
use super::gaits::{NamedGait, with_gaits};
use super::legs::Legs;
use super::no_gaits::NoGaits;
use super::ring::{PARAMETERS, Ring, SIDEWAYS, TURN, Wanted, program, ring};
use super::rollout::Arena;
use super::seeds::{Seed, seeds};
use super::steer::{balances, steering};
use super::wave::{self, WAVE_SIDEWAYS, WAVE_TURN, softness};

/// Who is to move, and where.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Who.
    pub model: Arc<Model>,
    /// How it stands.
    pub stance: Arc<Stance>,
    /// Its legs.
    pub legs: Arc<Legs>,
    /// Springs and dampers of its joints.
    pub gains: Gains,
    /// Where.
    pub scene: Scene,
    /// How finely that is simulated.
    pub accuracy: Accuracy,
    /// Wanted direction of travel in the world frame; only x and y count.
    pub direction: [f64; 3],
}

impl Subject {
    /// `model` as it stands in `stance`, with gains suited to gaits.
    ///
    /// # Errors
    /// [`NoGaits`] where it has neither two, four, six or eight legs in pairs nor joints in a row, or nothing pulls it down.
    pub fn new(
        model: &Arc<Model>,
        stance: &Arc<Stance>,
        scene: &Scene,
        accuracy: &Accuracy,
        direction: [f64; 3],
    ) -> Result<Self, NoGaits> {
        let gravity = scene.acting_gravity().norm();
        let legs = Arc::new(with_gaits(model, stance, gravity, direction)?);
        let gains = gains(model, stance, &legs, gravity);
        let (model, stance) = (model.clone(), stance.clone());
        Ok(Self { model, stance, legs, gains, scene: scene.clone(), accuracy: *accuracy, direction })
    }

    /// m/s².
    pub fn gravity(&self) -> f64 {
        self.scene.acting_gravity().norm()
    }

    /// The ring of keyframes that `parameters` mean, and the springs and dampers of the legs for it.
    pub fn ring(&self, wanted: &Wanted, parameters: &[f64]) -> (Ring, Gains) {
        let Self { model, legs, .. } = self;
        if let Some(spine) = &legs.spine {
            let gains = self.gains_times(softness(parameters));
            return (wave::ring(model, legs, spine, wanted, parameters), gains);
        }
        let program = program(legs, wanted, parameters);
        let gains = self.gains_times([program.stiffness, program.damping]);
        let mut own = ring(model, legs, &program, &gains, (wanted, balances(parameters)));
        if parameters.len() > PARAMETERS {
            let of = |changed: &[f64]| {
                ring(model, legs, &self::program(legs, wanted, changed), &gains, (wanted, false))
            };
            let direction = ahead_in_plane(self.direction);
            let limits = TargetLimits::of(&model.character);
            let who = (&**legs, &limits[..], &program.steps[..]);
            own.steering = Some(steering(who, (wanted, direction), parameters, &own, of));
        }
        (own, gains)
    }

    /// The gains with other springs and dampers in the joints that move.
    fn gains_times(&self, [stiffness, damping]: [f64; 2]) -> Gains {
        let mut gains = self.gains.clone();
        for joint in self.legs.joints() {
            gains.stiffness[joint] *= stiffness;
            gains.damping[joint] *= damping;
        }
        gains
    }

    /// Indices of the parameters of the turn and of the way to the side.
    pub fn trims(&self) -> [usize; 2] {
        if self.legs.spine.is_some() { [WAVE_TURN, WAVE_SIDEWAYS] } else { [TURN, SIDEWAYS] }
    }

    /// Where a search for `gait` may start.
    pub fn seeds(&self, gait: &NamedGait) -> Vec<Seed> {
        if self.legs.spine.is_some() { wave::seeds() } else { seeds(gait) }
    }

    /// Whether its gaits can have feedback.
    pub fn can_steer(&self) -> bool {
        self.legs.spine.is_none()
    }

    /// Where its gaits are tried.
    ///
    /// # Errors
    /// Every fault of scene and accuracy.
    pub fn arena(&self) -> Result<Arena, InputError> {
        let who = (&self.model, &self.stance, &self.legs);
        Arena::new(who, &self.scene, &self.accuracy, self.direction)
    }
}
