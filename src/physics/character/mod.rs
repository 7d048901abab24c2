//! What the user drew: a tree of links joined by joints, read from URDF, JSON or a zip archive.
//!
//! Reading never guesses in silence: whatever was repaired, approximated, kept although doubtful, or
//! ignored is a [`Note`] naming its link or joint, and whatever cannot be used is an
//! [`InputError`](crate::fault::InputError) naming its place.
//!
//! The way of the data: [`read`] hands the bytes to the reader of their format; each reader writes a
//! draft in its own order with the place of every part; one `build` step, the same for all, checks
//! the tree and the numbers, tells those that look like degrees or millimetres (`units`), fixes joints of a single value (`weld`), orders the links, closes loops (`loops`), repairs inertias
//! (`inertia`), replaces missing collision shapes (`stand_in`), and so establishes the invariants of [`Character`].

mod archive;
mod bounds;
mod build;
mod collada;
mod digest;
mod draft;
mod hull;
mod inertia;
mod json;
mod loops;
mod mesh;
mod read;
mod size;
mod solid;
mod stand_in;
mod supply;
mod types;
mod units;
mod urdf;
mod weld;

pub use bounds::LENGTH;
pub use json::{ShapeDocument, read_shape, schema};
pub use read::{Source, read, read_file};
pub use size::{ARCHIVE_BYTES, DOCUMENT_BYTES, LINKS, SHAPES, without_byte_order_mark};
pub use types::{
    About, Character, Friction, Inertial, Joint, JointKind, Limits, Link, Loop, LoopKind, Note, NoteKind,
    Options, Placed, Reading, Shape, SurfaceMaterial,
};
