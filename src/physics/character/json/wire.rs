//! The words of a `gaitwright/character@1` document.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::fault::object;

/// The document's kind and version.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
pub enum CharacterFormat {
    /// The one described here.
    #[serde(rename = "gaitwright/character@1")]
    V1,
}

/// A character: links joined by joints into one tree, and loops closed over it. SI units, radians, z up, x forward.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "gaitwright/character@1", rename = "Character")]
pub struct Document {
    /// Always `gaitwright/character@1`.
    #[expect(dead_code, reason = "to be read is to be checked")]
    pub format: CharacterFormat,
    /// The character's name.
    pub name: String,
    /// At least one; each but the root is the child of one joint.
    pub links: Vec<LinkDocument>,
    /// In the order in which a parent's children are to follow it.
    #[serde(default)]
    pub joints: Vec<JointDocument>,
    /// Joints that close loops: each joins two links that the tree joins already, and is passive.
    #[serde(default)]
    pub loops: Vec<LoopDocument>,
    /// A standing pose, by joint name, rad or m; joints left out stand at 0, or at the nearest angle that they can have.
    #[serde(default)]
    pub standing: Option<BTreeMap<String, f64>>,
}

/// A rigid body. Give either `density`, and mass and inertia follow from the shapes, or `mass`,
/// `center_of_mass` and `inertia`; or none of them for a mere frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Link")]
pub struct LinkDocument {
    /// Unique among the links.
    pub name: String,
    /// kg/m³ of all `shapes`; where shapes overlap, both count.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: Option<f64>,
    /// kg.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub mass: Option<f64>,
    /// In the link frame, m. The origin when left out.
    #[serde(default)]
    pub center_of_mass: Option<[f64; 3]>,
    /// About the centre of mass along the axes of the link frame, kg m².
    #[serde(default)]
    pub inertia: Option<Inertia>,
    /// What touches the world.
    #[serde(default)]
    pub shapes: Vec<ShapeDocument>,
    /// Friction of the shapes; the scene's when left out. In a contact the smaller of both sides holds.
    #[serde(default)]
    pub friction: Option<FrictionDocument>,
    /// Coefficient of restitution of the shapes; the scene's when left out. In a contact the greater of both sides holds.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub restitution: Option<f64>,
    /// What is only looked at; the shapes when left out.
    #[serde(default)]
    pub visuals: Vec<ShapeDocument>,
}

/// Friction of a link's shapes: a coefficient, or one along an axis of the link and another across it.
#[derive(Debug, Clone, Copy, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "Friction")]
pub enum FrictionDocument {
    /// The same in all directions.
    Uniform(#[schemars(range(min = 0))] f64),
    /// Depending on the direction in which the link slides.
    Directional(DirectionalFriction),
}

/// Coefficients of friction along an axis of a link and across it, as of a snake's scales or of a skate.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalFriction {
    /// Where the link slides along the axis.
    #[schemars(range(min = 0))]
    pub along: f64,
    /// Where it slides across it.
    #[schemars(range(min = 0))]
    pub across: f64,
    /// In the link frame; it is normalised.
    pub axis: [f64; 3],
}

impl<'de> Deserialize<'de> for FrictionDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Coefficients;

        impl<'de> Visitor<'de> for Coefficients {
            type Value = FrictionDocument;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, or an object with `along`, `across` and `axis`")
            }

            fn visit_f64<E>(self, coefficient: f64) -> Result<FrictionDocument, E> {
                Ok(FrictionDocument::Uniform(coefficient))
            }

            fn visit_u64<E>(self, coefficient: u64) -> Result<FrictionDocument, E> {
                Ok(FrictionDocument::Uniform(coefficient as f64))
            }

            fn visit_i64<E>(self, coefficient: i64) -> Result<FrictionDocument, E> {
                Ok(FrictionDocument::Uniform(coefficient as f64))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FrictionDocument, A::Error> {
                DirectionalFriction::deserialize(MapAccessDeserializer::new(map))
                    .map(FrictionDocument::Directional)
            }
        }

        deserializer.deserialize_any(Coefficients)
    }
}

/// A symmetric matrix of inertia, kg m².
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Inertia {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    #[serde(default)]
    pub xy: f64,
    #[serde(default)]
    pub xz: f64,
    #[serde(default)]
    pub yz: f64,
}

/// A frame in another: a position in m, and either an orientation or roll, pitch and yaw.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Pose")]
pub struct PoseDocument {
    /// m.
    #[serde(default)]
    pub position: [f64; 3],
    /// A quaternion `[w, x, y, z]`; it is normalised.
    #[serde(default)]
    pub orientation: Option<[f64; 4]>,
    /// Rotations about the fixed x, y and z axes, in this order, rad.
    #[serde(default)]
    pub rpy: Option<[f64; 3]>,
}

/// A solid shape about its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "Shape")]
pub enum ShapeDocument {
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
        /// The shape's frame in that of its link, or of the world for an obstacle.
        #[serde(default, deserialize_with = "object")]
        pose: PoseDocument,
        /// Red, green, blue, opacity, 0 to 1.
        #[serde(default)]
        color: Option<[f32; 4]>,
    },
    /// A box.
    Box {
        /// Full lengths of the edges, m.
        size: [f64; 3],
        /// The shape's frame in that of its link, or of the world for an obstacle.
        #[serde(default, deserialize_with = "object")]
        pose: PoseDocument,
        /// Red, green, blue, opacity, 0 to 1.
        #[serde(default)]
        color: Option<[f32; 4]>,
    },
    /// A cylinder along z.
    Cylinder {
        /// m.
        radius: f64,
        /// Full length, m.
        length: f64,
        /// The shape's frame in that of its link, or of the world for an obstacle.
        #[serde(default, deserialize_with = "object")]
        pose: PoseDocument,
        /// Red, green, blue, opacity, 0 to 1.
        #[serde(default)]
        color: Option<[f32; 4]>,
    },
    /// A cylinder along z with round ends.
    Capsule {
        /// m.
        radius: f64,
        /// Length of the straight part, m.
        length: f64,
        /// The shape's frame in that of its link, or of the world for an obstacle.
        #[serde(default, deserialize_with = "object")]
        pose: PoseDocument,
        /// Red, green, blue, opacity, 0 to 1.
        #[serde(default)]
        color: Option<[f32; 4]>,
    },
    /// The convex hull of points; of many points the 32 that tell most.
    Hull {
        /// At least 4 points, not all in one plane, m.
        vertices: Vec<[f64; 3]>,
        /// The shape's frame in that of its link, or of the world for an obstacle.
        #[serde(default, deserialize_with = "object")]
        pose: PoseDocument,
        /// Red, green, blue, opacity, 0 to 1.
        #[serde(default)]
        color: Option<[f32; 4]>,
    },
}

/// What joins a child link to its parent.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Joint")]
pub struct JointDocument {
    /// Unique among the joints.
    pub name: String,
    /// What the joint allows.
    pub kind: JointKindDocument,
    /// Name of the parent link.
    pub parent: String,
    /// Name of the child link.
    pub child: String,
    /// The joint frame, which is the child link's frame at angle 0, in the parent link's frame.
    #[serde(default)]
    pub origin: PoseDocument,
    /// In the joint frame; it is normalised.
    #[serde(default = "x_axis")]
    pub axis: [f64; 3],
    /// Range of motion; none when left out.
    #[serde(default)]
    pub limits: Option<LimitsDocument>,
    /// Bounds of the actuator, without any when left out; `null` for a passive joint, which has no actuator.
    #[serde(default = "unbounded_actuator")]
    pub actuation: Option<Actuation>,
    /// Viscous damping, N m s/rad or N s/m.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub damping: f64,
    /// Dry friction, N m or N.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub friction: f64,
    /// Reflected inertia of the rotor, kg m² or kg.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub armature: f64,
}

fn x_axis() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

/// What a joint allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "JointKind")]
pub enum JointKindDocument {
    /// No motion.
    Fixed,
    /// Rotation about the axis.
    Revolute,
    /// Rotation about the axis without limits.
    Continuous,
    /// Translation along the axis.
    Prismatic,
}

/// A joint between two links of the tree, which closes a loop. With all angles at 0 it must be closed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Loop")]
pub struct LoopDocument {
    /// Unique among the loops.
    pub name: String,
    /// What the joint allows.
    pub kind: LoopKindDocument,
    /// Name of the first link.
    pub a: String,
    /// Name of the second link.
    pub b: String,
    /// The joint frame in the frame of link `a`.
    #[serde(default)]
    pub origin: PoseDocument,
    /// The joint frame in the frame of link `b`: where `origin` is with all angles at 0. It follows
    /// from that and may be left out.
    #[serde(default)]
    pub origin_in_b: Option<PoseDocument>,
    /// In the joint frame; it is normalised.
    #[serde(default = "x_axis")]
    pub axis: [f64; 3],
}

/// What a joint that closes a loop allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "LoopKind")]
pub enum LoopKindDocument {
    /// All rotations.
    Ball,
    /// Rotation about the axis.
    Revolute,
    /// Translation along the axis.
    Prismatic,
    /// No motion.
    Fixed,
}

/// A range of motion, rad or m.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Limits")]
pub struct LimitsDocument {
    pub lower: f64,
    /// Not below `lower`; where it is the same, the joint is fixed.
    pub upper: f64,
}

fn unbounded_actuator() -> Option<Actuation> {
    Some(Actuation::default())
}

/// Bounds of an actuator.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Actuation {
    /// N m or N.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_torque: Option<f64>,
    /// rad/s or m/s.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed: Option<f64>,
}
