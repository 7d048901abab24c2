//! Names of the recording's entities and timelines.

use re_sdk::EntityPath;

/// The application that a viewer files the recordings under.
pub const APPLICATION: &str = "gaitwright";

/// The learner's generation.
pub const GENERATION: &str = "generation";

/// Seconds of the recorded motions, one after the other.
pub const SIM_TIME: &str = "sim_time";

/// Everything seen in three dimensions.
pub fn world() -> EntityPath {
    path(&["world"])
}

/// The ground.
pub fn ground() -> EntityPath {
    path(&["world", "ground"])
}

/// An obstacle, by name.
pub fn obstacle(name: &str) -> EntityPath {
    path(&["world", "obstacles", name])
}

/// Path of the centre of mass.
pub fn travel() -> EntityPath {
    path(&["world", "path"])
}

/// The ring on the ground around the centre of mass.
pub fn ring() -> EntityPath {
    path(&["world", "center_of_mass"])
}

/// A link, by name.
pub fn link(name: &str) -> EntityPath {
    path(&["world", "character", name])
}

/// Contact forces on a link.
pub fn contact(link: &str) -> EntityPath {
    path(&["world", "character", link, "contact"])
}

/// Stance and swing of a link.
pub fn gait(link: &str) -> EntityPath {
    path(&["gait", link])
}

/// A quantity of a joint.
pub fn joint(name: &str, quantity: &str) -> EntityPath {
    path(&["joints", name, quantity])
}

/// A figure of the learning curve.
pub fn learning(figure: &str) -> EntityPath {
    path(&["learning", figure])
}

/// What the motion shown is.
pub fn motion() -> EntityPath {
    path(&["motion"])
}

/// What the job is.
pub fn job() -> EntityPath {
    path(&["job"])
}

/// Names come from users, so each is one part whatever characters it has.
fn path(parts: &[&str]) -> EntityPath {
    parts.iter().map(|&part| part.into()).collect()
}
