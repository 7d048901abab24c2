//! The simulator, from the character document to the step.

mod allocation;
#[path = "../common/bodies.rs"]
mod bodies;
mod character;
mod character_faults;
mod character_shapes;
mod collada;
mod collision;
#[path = "../common/mod.rs"]
mod common;
mod conservation;
mod contact;
#[path = "../common/contacts.rs"]
mod contacts;
mod coordinates;
mod drives;
mod dry_friction;
mod dynamics;
mod effects;
mod failures;
mod flight;
mod grain;
mod groups;
mod impacts;
mod lcp;
mod loops;
mod materials;
mod orders;
mod properties;
mod shaping;
mod soft_contact;
mod stance;
mod steering;
mod step_control;
