//! Which effects a scene and a character call for, and why.

use std::borrow::Cow;
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::surfaces::PairMaterial;
use super::{Effect, Feedforward, Gains, Scene, Switch};
use crate::model::Model;
use crate::model::collision::pairs::Pairs;

/// The effects that make contacts.
pub const CONTACTS: [Effect; 3] = [Effect::GroundContact, Effect::SelfCollision, Effect::Obstacles];

/// Effects that are decided last, since they depend on the decisions about others.
const LAST: [Effect; 3] = [Effect::Friction, Effect::SpeedLimits, Effect::Stabilization];

/// Whether an effect is simulated, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Whether it is simulated.
    pub on: bool,
    /// The reason, in one sentence.
    pub because: String,
}

/// What speaks for (`Ok`) or against (`Err`) simulating an effect, in one sentence.
type Call = Result<Cow<'static, str>, Cow<'static, str>>;

/// Decides every effect; `maximal`: whether the coordinates are maximal, in which joints are constraint rows; `greatest`
/// are the greatest coefficients of anything that can touch. An effect
/// that is switched on is simulated wherever the scene and the character have anything for it to act on.
pub fn decide(
    scene: &Scene,
    gains: Option<&Gains>,
    model: &Model,
    maximal: bool,
    greatest: PairMaterial,
) -> BTreeMap<Effect, Decision> {
    let mut decisions: BTreeMap<Effect, Decision> = BTreeMap::new();
    let (last, first): (Vec<Effect>, Vec<Effect>) = Effect::ALL.into_iter().partition(|it| LAST.contains(it));
    for effect in first.into_iter().chain(last) {
        let call = call(effect, scene, gains, model, maximal, greatest, &decisions);
        let decision = match (scene.effects.get(&effect).copied().unwrap_or_default(), call) {
            (Switch::Off, _) => Decision { on: false, because: "switched off".into() },
            (Switch::On, Ok(_)) => Decision { on: true, because: "switched on".into() },
            (Switch::On, Err(_)) if effect == Effect::TrunkRotationLock && !model.fixed_base => {
                Decision { on: true, because: "switched on".into() }
            }
            (Switch::Auto, Ok(because)) => Decision { on: true, because: because.into_owned() },
            (_, Err(because)) => Decision { on: false, because: because.into_owned() },
        };
        decisions.insert(effect, decision);
    }
    decisions
}

fn call(
    effect: Effect,
    scene: &Scene,
    gains: Option<&Gains>,
    model: &Model,
    maximal: bool,
    greatest: PairMaterial,
    earlier: &BTreeMap<Effect, Decision>,
) -> Call {
    let on = |effect| earlier.get(&effect).is_some_and(|decision| decision.on);
    let either = |yes: bool, because: &'static str, otherwise: &'static str| -> Call {
        if yes { Ok(because.into()) } else { Err(otherwise.into()) }
    };
    match effect {
        Effect::Gravity => {
            either(scene.gravity != [0.0; 3], "the scene has gravity", "the scene has no gravity")
        }
        Effect::VelocityForces => either(
            !model.fixed_base || model.joint_count() > 0,
            "bodies can rotate",
            "nothing in the character can move",
        ),
        Effect::GroundContact => match (&scene.ground, model.ground_slots) {
            (None, _) => Err("the scene has no ground".into()),
            (_, 0) => Err("the character has no collision shapes".into()),
            _ => {
                let because = "the scene has ground and the character has collision shapes";
                Ok(with_rebound(because, scene, greatest))
            }
        },
        Effect::Friction => {
            if !CONTACTS.into_iter().any(on) {
                Err("there are no contacts".into())
            } else {
                either(
                    greatest.friction > 0.0,
                    "contacts have friction",
                    "the scene's friction coefficient is 0",
                )
            }
        }
        Effect::SelfCollision => self_collision(scene, &model.pairs, greatest),
        Effect::Obstacles => match (scene.obstacles.len(), model.solids.len()) {
            (0, _) => Err("the scene has no obstacles".into()),
            (_, 0) => Err("the character has no collision shapes".into()),
            _ => {
                let because = "the scene has obstacles and the character has collision shapes";
                Ok(with_rebound(because, scene, greatest))
            }
        },
        Effect::JointLimits => either(
            model.limits.iter().any(Option::is_some),
            "the character has joints with limits",
            "no joint of the character has limits",
        ),
        Effect::TorqueLimits => match gains {
            None => Err("no joint is driven".into()),
            Some(gains) => either(
                gains.max_torque.iter().any(Option::is_some),
                "actuators have a greatest torque",
                "no actuator has a greatest torque",
            ),
        },
        Effect::SpeedLimits => match gains {
            None => Err("no joint is driven".into()),
            Some(_) if !on(Effect::TorqueLimits) => {
                Err("actuators have no torque limits that could fall".into())
            }
            Some(gains) => {
                let motors = gains.max_torque.iter().zip(&model.speed).zip(&model.driven);
                let falls = motors.filter(|((torque, speed), driven)| {
                    **driven && torque.is_some_and(|it| it > 0.0) && speed.is_some_and(|it| it > 0.0)
                });
                either(
                    falls.count() > 0,
                    "actuators have a greatest speed, at which no torque is left",
                    "no actuator has both a greatest speed and a greatest torque",
                )
            }
        },
        Effect::Feedforward => match gains {
            None => Err("no joint is driven toward a target".into()),
            Some(gains) => either(
                gains.feedforward != Feedforward::None,
                "the drive asks for it",
                "the drive asks for none",
            ),
        },
        Effect::TrunkRotationLock => either(
            false,
            "",
            if model.fixed_base { "the root is bolted to the world" } else { "nobody asked for it" },
        ),
        Effect::JointDamping => {
            let any = model.damping.iter().any(|damping| *damping > 0.0);
            either(any, "the character has damped joints", "no joint of the character is damped")
        }
        Effect::JointFriction => {
            let any = model.friction.iter().any(|friction| *friction > 0.0);
            either(
                any,
                "the character has joints with dry friction",
                "no joint of the character has dry friction",
            )
        }
        Effect::Stabilization if maximal && model.joint_count() > 0 => {
            Ok("joints of maximal coordinates drift without it".into())
        }
        Effect::Stabilization if !model.loops.is_empty() => Ok("closed loops drift without it".into()),
        Effect::Stabilization => either(
            on(Effect::JointLimits) || CONTACTS.into_iter().any(on),
            "contacts and limits drift without it",
            "there are neither contacts nor limits",
        ),
    }
}

/// `because`, and how contacts give way or rebound where they do.
fn with_rebound(because: &str, scene: &Scene, greatest: PairMaterial) -> Cow<'static, str> {
    match (scene.contact_time_constant, greatest.restitution) {
        (0.0, 0.0) => because.to_owned().into(),
        (0.0, restitution) => format!("{because}; contacts rebound with restitution {restitution}").into(),
        (time, _) => format!("{because}; contacts are springs with a time constant of {time} s").into(),
    }
}

/// Self-collision is simulated where two shapes can make contact: within the joint limits, unless these are switched off.
fn self_collision(scene: &Scene, pairs: &Pairs, greatest: PairMaterial) -> Call {
    let (joined, overlapping) = (pairs.joined.len(), pairs.overlapping.len());
    let (count, apart) = match scene.effects.get(&Effect::JointLimits) {
        Some(Switch::Off) => (pairs.count + pairs.apart.len(), 0),
        _ => (pairs.count, pairs.apart.len()),
    };
    if count + joined + overlapping + apart == 0 {
        return Err("no two bodies of the character have collision shapes".into());
    }
    let mut left_out = Vec::new();
    for (count, why) in [
        (joined, "of neighbouring bodies"),
        (overlapping, "of bodies that overlap in the standing pose"),
        (apart, "that cannot meet within the joint limits"),
    ] {
        if count > 0 {
            left_out.push(format!("{count} {why}"));
        }
    }
    let left_out = left_out.join(", ");
    match count {
        0 if joined + overlapping == 0 => Err("no two shapes can touch within the joint limits".into()),
        0 => {
            Err(format!("no two shapes can touch within the joint limits; left out are pairs {left_out}")
                .into())
        }
        count => {
            let rest =
                if left_out.is_empty() { String::new() } else { format!("; left out are pairs {left_out}") };
            let because = format!("{count} pairs of shapes can touch{rest}");
            Ok(with_rebound(&because, scene, greatest))
        }
    }
}
