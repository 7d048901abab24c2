//! A character as everyone after the readers sees it.

use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};

use crate::fault::Fault;

/// An articulated character: a tree of links, parents before children.
///
/// Invariants, established by the readers and relied on by everyone after them: `links` is not
/// empty; `links[0]` is the root and the only link without a joint; every joint's `parent` is
/// smaller than its link's own index; names are unique among links and among joints; every number
/// is finite; masses are not negative; axes have unit length; links joined by fixed joints have, taken
/// together, a positive mass and a positive definite inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct Character {
    /// The character's name, as its author wrote it.
    pub name: String,
    /// Links, parents before children.
    pub links: Vec<Link>,
    /// Joints that close loops over the tree.
    pub loops: Vec<Loop>,
    /// Joint angles (rad; m for prismatic joints) of a standing pose given by the author, by joint
    /// name, in the order of the links; joints left out stand at 0, or at the nearest angle that they can have.
    pub standing: Option<Vec<(String, f64)>>,
    /// `sha256:…` of the bytes the character was read from.
    pub digest: String,
    /// That of the same JSON document as it stands within another one: without white space, its fields in order. `None`
    /// for a character from anything else.
    pub embedded_digest: Option<String>,
}

impl Character {
    /// Whether `digest` is that of this character, be it as the file that was read or within a larger document.
    pub fn has_digest(&self, digest: &str) -> bool {
        self.digest == digest || self.embedded_digest.as_deref() == Some(digest)
    }
}

/// A rigid link, its inertia and its shapes, and the joint that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Unique among the links.
    pub name: String,
    /// The joint to the parent link; `None` for the root alone.
    pub joint: Option<Joint>,
    /// `None`: the link is massless and fixed to a link that is not. A link given an inertia but no mass
    /// keeps both, with a mass of 0.
    pub inertial: Option<Inertial>,
    /// Shapes that make contact.
    pub collisions: Vec<Placed>,
    /// What those shapes are like to touch.
    pub surface: SurfaceMaterial,
    /// Shapes for display only. Where there are none, the collision shapes are shown.
    pub visuals: Vec<Placed>,
}

/// Mass, centre of mass and rotational inertia of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Inertial {
    /// kg, not negative; the mass of the rigid body it belongs to is positive.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub center_of_mass: Point3<f64>,
    /// Rotational inertia about the centre of mass, along the axes of the link frame, kg m².
    /// Symmetric and positive semidefinite; a link's own may be singular, but the inertia of the
    /// rigid body that it forms with the links fixed to it is positive definite.
    pub inertia: Matrix3<f64>,
}

/// What a surface is like to touch; the scene's values hold where it has none of its own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceMaterial {
    /// Of Coulomb friction.
    pub friction: Option<Friction>,
    /// Coefficient of restitution, 0 to 1.
    pub restitution: Option<f64>,
}

/// Coefficients of Coulomb friction of a surface, at least 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Friction {
    /// The same in all directions.
    Uniform(f64),
    /// Of a link whose skin grips otherwise along an axis than across it.
    Directional {
        /// Where the link slides along the axis.
        along: f64,
        /// Where it slides across it.
        across: f64,
        /// In the link frame; both of its directions are the same.
        axis: Unit<Vector3<f64>>,
    },
}

impl Friction {
    /// The greatest coefficient in any direction.
    pub fn greatest(self) -> f64 {
        match self {
            Self::Uniform(coefficient) => coefficient,
            Self::Directional { along, across, .. } => along.max(across),
        }
    }

    /// Everything impossible in it, with JSON pointers to its fields.
    fn faults(self) -> Vec<Fault> {
        let coefficients = match self {
            Self::Uniform(coefficient) => vec![("", "", coefficient)],
            Self::Directional { along, across, .. } => {
                vec![("/along", " along its axis", along), ("/across", " across its axis", across)]
            }
        };
        let impossible =
            |(_, _, coefficient): &(&str, &str, f64)| !(coefficient.is_finite() && *coefficient >= 0.0);
        let fault = |(pointer, which, _): (&str, &str, f64)| {
            Fault::new(
                pointer,
                format!("the friction coefficient{which} must be a finite number of at least 0"),
            )
        };
        coefficients.into_iter().filter(impossible).map(fault).collect()
    }
}

impl SurfaceMaterial {
    /// Everything impossible in it, with JSON pointers to its fields.
    pub fn faults(&self) -> Vec<Fault> {
        let of_friction = self.friction.into_iter().flat_map(Friction::faults);
        let mut faults: Vec<Fault> = of_friction.map(|fault| fault.under("/friction")).collect();
        if self.restitution.is_some_and(|restitution| !(0.0..=1.0).contains(&restitution)) {
            faults
                .push(Fault::new("/restitution", "the coefficient of restitution must lie between 0 and 1"));
        }
        faults
    }
}

/// How a link moves against its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Unique among the joints.
    pub name: String,
    /// Index of the parent link.
    pub parent: usize,
    /// Which relative motion the joint allows.
    pub kind: JointKind,
    /// The joint frame (which is the child link's frame at angle zero) in the parent link's frame.
    pub origin: Isometry3<f64>,
    /// Axis in the joint frame; meaningless for a fixed joint.
    pub axis: Unit<Vector3<f64>>,
    /// Range of motion, rad or m; `None` is unlimited. `lower < upper`.
    pub limits: Option<Limits>,
    /// Whether an actuator drives the joint; without one it is passive.
    pub driven: bool,
    /// Greatest torque or force of the actuator, N m or N; `None` is unbounded.
    pub effort: Option<f64>,
    /// Greatest speed of the actuator, rad/s or m/s; `None` is unbounded.
    pub velocity: Option<f64>,
    /// Viscous damping, N m s/rad or N s/m, at least 0.
    pub damping: f64,
    /// Dry friction, N m or N, at least 0.
    pub friction: f64,
    /// Reflected inertia of the rotor, kg m² or kg, at least 0.
    pub armature: f64,
}

/// Which relative motion a joint of the tree allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Rotation about the axis.
    Revolute,
    /// Translation along the axis.
    Prismatic,
}

/// A passive joint between two links that the tree joins already.
#[derive(Debug, Clone, PartialEq)]
pub struct Loop {
    /// Unique among the loops.
    pub name: String,
    /// Which relative motions the joint allows.
    pub kind: LoopKind,
    /// Indices of the two links, which the tree does not join rigidly.
    pub links: [usize; 2],
    /// The joint's frame in each of the two links' frames. With all angles of the tree at zero they
    /// coincide.
    pub frames: [Isometry3<f64>; 2],
    /// Axis in the joint's frame; meaningless for balls and fixed joints.
    pub axis: Unit<Vector3<f64>>,
}

/// Which relative motions a joint that closes a loop allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoopKind {
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest value.
    pub lower: f64,
    /// Greatest value.
    pub upper: f64,
}

/// A shape and where it sits on its link.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// Frame of the shape in the link frame.
    pub pose: Isometry3<f64>,
    /// The shape, about its own frame.
    pub shape: Shape,
    /// Red, green, blue, opacity from 0 to 1, where the author gave one.
    pub color: Option<[f32; 4]>,
}

/// A solid shape in its own frame, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A ball about the origin.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box about the origin.
    Box {
        /// Half of each edge's length, m.
        half_extents: Vector3<f64>,
    },
    /// A cylinder about the origin along z.
    Cylinder {
        /// m.
        radius: f64,
        /// Half of its length, m.
        half_length: f64,
    },
    /// A cylinder along z with round ends.
    Capsule {
        /// m.
        radius: f64,
        /// Half of the length of the straight part, m.
        half_length: f64,
    },
    /// A body bounded by triangles: convex among the collision shapes, any mesh among the visuals.
    Hull {
        /// Corners, m.
        vertices: Vec<Point3<f64>>,
        /// Faces, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
    },
}

/// Something that was changed, approximated or left out while a character was read.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct Note {
    /// What the note is about.
    #[serde(flatten)]
    pub about: About,
    /// What was done.
    pub kind: NoteKind,
    /// One sentence for the character's author.
    pub message: String,
}

/// What a [`Note`] is about; in JSON one field, `"link": name`, `"joint": name` or
/// `"character": name`.
#[derive(
    Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum About {
    /// A link, by name.
    Link(String),
    /// A joint, by name.
    Joint(String),
    /// The whole character, by name.
    Character(String),
}

/// What was done to the character's description.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoteKind {
    /// A fault was mended.
    Repaired,
    /// Something was replaced by something simpler.
    Approximated,
    /// Something doubtful about the physics was kept as given.
    Kept,
    /// Something that has no bearing on the physics was left out.
    Ignored,
}

impl Character {
    /// Total mass, kg.
    pub fn mass(&self) -> f64 {
        self.links.iter().filter_map(|link| link.inertial.as_ref()).map(|inertial| inertial.mass).sum()
    }
}

/// How strictly a character is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Options {
    /// Whether everything doubtful about the physics (repaired or approximated inertias, shapes and
    /// limits) is a fault instead of a note.
    pub strict: bool,
}

/// A character and what was done to its description to get it.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The character.
    pub character: Character,
    /// Everything repaired, approximated, kept although doubtful, or ignored.
    pub notes: Vec<Note>,
}
