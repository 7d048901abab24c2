//! `schema`: the JSON Schema of character documents.

use super::failure::CommandError;
use super::input::print;

pub fn run() -> Result<(), CommandError> {
    print(&gaitwright_physics::character::schema())
}
