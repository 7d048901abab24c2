//! What was understood of a character: the `check` document.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::teaching::Teaching;
use gaitwright_learning::learn::Task;
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::character::{Character, JointKind, Limits, Note, Reading, Shape};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;

/// The format of a check document.
pub const FORMAT: &str = "gaitwright/check@1";

/// What was understood of a character, and how it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Findings {
    /// `gaitwright/check@1`.
    pub format: String,
    /// The character's name, as its author wrote it.
    pub name: String,
    /// `sha256:…` of the bytes it was read from.
    pub digest: String,
    /// Total mass, kg.
    pub mass: f64,
    /// Names of the links, parents before children.
    pub links: Vec<String>,
    /// The movable joints.
    pub joints: Vec<JointFinding>,
    /// The shapes that touch the world.
    pub shapes: Vec<ShapeFinding>,
    /// Which of the shapes can touch each other.
    pub self_collision: SelfCollision,
    /// The standing pose.
    pub standing: Standing,
    /// How a job that asks for nothing teaches it; `null` in a document of an earlier version.
    #[serde(default)]
    pub teaching: Option<Teaching>,
    /// Everything repaired, approximated or ignored.
    pub notes: Vec<Note>,
}

/// A movable joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointFinding {
    /// Its name.
    pub name: String,
    /// `revolute` or `prismatic`.
    pub kind: String,
    /// The link that it moves.
    pub link: String,
    /// Lower and upper end of the range of motion, rad or m; `null` is unlimited.
    pub limits: Option<[f64; 2]>,
    /// Whether it has an actuator; without one it is passive.
    pub driven: bool,
    /// Greatest torque or force, N m or N; `null` is unbounded.
    pub effort: Option<f64>,
    /// Greatest speed, rad/s or m/s; `null` is unbounded.
    pub velocity: Option<f64>,
}

/// A shape that touches the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapeFinding {
    /// The link that it belongs to.
    pub link: String,
    /// `sphere`, `box`, `cylinder`, `capsule` or `hull`.
    pub kind: String,
    /// Edges of the box about it in its own frame, m.
    pub size: [f64; 3],
}

/// Which shapes of a character can touch each other: its pairs of shapes of different bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SelfCollision {
    /// Number of pairs that can touch.
    pub can_touch: usize,
    /// Number of pairs that cannot, whatever the joints do within their limits.
    pub apart: usize,
    /// Number of pairs of bodies that a joint connects, which always pass through each other.
    pub joined: usize,
    /// The pairs that pass through each other because shapes of their bodies overlap in the standing pose; indices
    /// into `shapes`.
    pub overlapping: Vec<[usize; 2]>,
}

/// A standing pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Standing {
    /// Angle at which every movable joint is held, rad or m.
    pub joints: BTreeMap<String, f64>,
    /// Angle at which every movable joint comes to rest, since what holds it gives way under the weight, rad or m.
    #[serde(default)]
    pub settled: BTreeMap<String, f64>,
    /// Height of the root link's origin above the ground, m.
    pub root_height: f64,
    /// Orientation of the root link, unit quaternion `[w, x, y, z]`.
    #[serde(default = "upright")]
    pub root_orientation: [f64; 4],
    /// The links that carry the character.
    pub support: Vec<String>,
    /// Whether it came to rest without falling when it was tried in the simulator.
    pub stable: bool,
    /// Whether the character's author gave it.
    pub given: bool,
}

fn upright() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// Finds how the character stands on the ground of `scene`, and reports what was understood of it.
pub fn check(reading: &Reading, scene: &Scene) -> Findings {
    check_until(reading, scene, &|| false)
}

/// The same until `stop` returns true: the pose found by then counts as not standing.
pub(super) fn check_until(reading: &Reading, scene: &Scene, stop: &dyn Fn() -> bool) -> Findings {
    let character = &reading.character;
    let model = Arc::new(Model::new(Arc::new(character.clone()), Base::Floating));
    let stance = Arc::new(Stance::find_until(&model, scene, stop));
    let subject = Subject::new(&model, &stance, scene, &Accuracy::default(), Task::default().direction);
    Findings {
        format: FORMAT.to_owned(),
        name: character.name.clone(),
        digest: character.digest.clone(),
        mass: model.mass,
        links: character.links.iter().map(|link| link.name.clone()).collect(),
        joints: joints(character),
        shapes: shapes(character),
        self_collision: self_collision(&model),
        standing: standing(&model, &stance),
        teaching: Some(Teaching::of(&subject)),
        notes: reading.notes.clone(),
    }
}

fn joints(character: &Character) -> Vec<JointFinding> {
    let movable = |link: &gaitwright_physics::character::Link| {
        let joint = link.joint.as_ref()?;
        let kind = match joint.kind {
            JointKind::Fixed => return None,
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        Some(JointFinding {
            name: joint.name.clone(),
            kind: kind.to_owned(),
            link: link.name.clone(),
            limits: joint.limits.map(|Limits { lower, upper }| [lower, upper]),
            driven: joint.driven,
            effort: joint.effort,
            velocity: joint.velocity,
        })
    };
    character.links.iter().filter_map(movable).collect()
}

fn shapes(character: &Character) -> Vec<ShapeFinding> {
    let of_link = |link: &gaitwright_physics::character::Link| {
        let name = link.name.clone();
        let found = link.collisions.iter().map(move |placed| {
            let (kind, size) = extent(&placed.shape);
            ShapeFinding { link: name.clone(), kind: kind.to_owned(), size }
        });
        found.collect::<Vec<_>>()
    };
    character.links.iter().flat_map(of_link).collect()
}

/// The model's shapes are those of the links in their order, as [`shapes`] lists them.
fn self_collision(model: &Model) -> SelfCollision {
    let pairs = &model.pairs;
    SelfCollision {
        can_touch: pairs.count,
        apart: pairs.apart.len(),
        joined: pairs.joined.len(),
        overlapping: pairs.overlapping.clone(),
    }
}

/// A shape's kind, and the edges of the box about it in its own frame, m.
fn extent(shape: &Shape) -> (&'static str, [f64; 3]) {
    match shape {
        Shape::Sphere { radius } => ("sphere", [2.0 * radius; 3]),
        Shape::Box { half_extents } => ("box", (half_extents * 2.0).into()),
        Shape::Cylinder { radius, half_length } => {
            ("cylinder", [2.0 * radius, 2.0 * radius, 2.0 * half_length])
        }
        Shape::Capsule { radius, half_length } => {
            ("capsule", [2.0 * radius, 2.0 * radius, 2.0 * (half_length + radius)])
        }
        Shape::Hull { vertices, .. } => {
            let along = |axis: usize| {
                let (lowest, highest) = vertices
                    .iter()
                    .map(|vertex| vertex[axis])
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(lowest, highest), at| {
                        (lowest.min(at), highest.max(at))
                    });
                (highest - lowest).max(0.0)
            };
            ("hull", [along(0), along(1), along(2)])
        }
    }
}

/// A standing pose as documents show it.
pub(super) fn standing(model: &Model, stance: &Stance) -> Standing {
    let links = &model.character.links;
    let q = stance.state.root.orientation;
    let named = |angles: &[f64]| model.joint_names.iter().cloned().zip(angles.iter().copied()).collect();
    Standing {
        joints: named(&stance.angles),
        settled: named(&stance.state.angles),
        root_height: stance.root_height,
        root_orientation: [q.w, q.i, q.j, q.k],
        support: stance.support.iter().map(|&link| links[link].name.clone()).collect(),
        stable: stance.stable,
        given: stance.given,
    }
}
