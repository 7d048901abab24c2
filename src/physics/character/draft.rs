//! What a reader understood, before the tree and the numbers are checked: parts in the document's own
//! order, each with its place in the document.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{About, JointKind, LoopKind, Note, NoteKind, Placed, SurfaceMaterial};
use crate::fault::Fault;

/// Something and its place in the document (what becomes [`Fault::pointer`]).
#[derive(Debug, Clone, PartialEq)]
pub struct At<T> {
    pub value: T,
    pub place: String,
}

impl<T> At<T> {
    pub fn new(value: T, place: impl Into<String>) -> Self {
        Self { value, place: place.into() }
    }
}

/// Greatest length of a name, bytes. Names are repeated in places and notes, so that long ones would
/// multiply a document's size.
const NAME_BYTES: usize = 256;

/// Why `name` cannot be the name of a link, a joint or a character.
pub fn name_fault(name: &str) -> Option<String> {
    if name.trim().is_empty() {
        return Some("the name is empty".to_owned());
    }
    let bytes = name.len();
    is_long(name).then(|| format!("the name is {bytes} bytes long; at most {NAME_BYTES} are allowed"))
}

/// Whether a name is too long to be one.
pub fn is_long(name: &str) -> bool {
    name.len() > NAME_BYTES
}

/// A character as its document describes it.
#[derive(Debug, Default)]
pub struct Draft {
    pub name: String,
    pub links: Vec<DraftLink>,
    pub joints: Vec<DraftJoint>,
    pub loops: Vec<DraftLoop>,
    pub standing: Option<Vec<(At<String>, f64)>>,
    /// Whether every link and joint of the document is here: none was left out for a fault of its own.
    pub complete: bool,
    pub diagnostics: Diagnostics,
}

/// Faults and notes as they are found, each note with its place.
#[derive(Debug, Default)]
pub struct Diagnostics {
    pub faults: Vec<Fault>,
    pub notes: Vec<At<Note>>,
}

impl Diagnostics {
    pub fn fault(&mut self, place: impl Into<String>, reason: impl Into<String>) {
        self.faults.push(Fault::new(place, reason));
    }

    pub fn note(
        &mut self,
        place: impl Into<String>,
        about: About,
        kind: NoteKind,
        message: impl Into<String>,
    ) {
        self.notes.push(At::new(Note { about, kind, message: message.into() }, place));
    }
}

#[derive(Debug)]
pub struct DraftLink {
    pub name: At<String>,
    pub inertial: Option<At<DraftInertial>>,
    pub collisions: Vec<At<Placed>>,
    pub surface: At<SurfaceMaterial>,
    pub visuals: Vec<At<Placed>>,
    /// Collision meshes that cannot be had, and why.
    pub missing_collisions: Vec<At<String>>,
    /// Visual meshes that cannot be had, and why.
    pub missing_visuals: Vec<At<String>>,
}

/// Mass (any number), centre of mass in the link frame, and rotational inertia about it along the
/// axes of the link frame, where the document gives one.
#[derive(Debug)]
pub struct DraftInertial {
    pub mass: f64,
    pub center_of_mass: Point3<f64>,
    pub inertia: Option<Matrix3<f64>>,
}

#[derive(Debug)]
pub struct DraftJoint {
    pub name: At<String>,
    pub kind: JointKind,
    pub parent: At<String>,
    pub child: At<String>,
    pub origin: At<Isometry3<f64>>,
    pub axis: At<Vector3<f64>>,
    /// Lower and upper end; `None` is unlimited.
    pub limits: Option<At<[f64; 2]>>,
    pub driven: bool,
    pub effort: Option<At<f64>>,
    pub velocity: Option<At<f64>>,
    pub damping: At<f64>,
    pub friction: At<f64>,
    pub armature: At<f64>,
}

/// A joint that closes a loop between the links `ends`.
#[derive(Debug)]
pub struct DraftLoop {
    pub name: At<String>,
    pub kind: LoopKind,
    pub ends: [At<String>; 2],
    /// In the first link's frame.
    pub origin: At<Isometry3<f64>>,
    /// In the second link's frame, where the document gives it.
    pub origin_in_second: Option<At<Isometry3<f64>>>,
    pub axis: At<Vector3<f64>>,
}
