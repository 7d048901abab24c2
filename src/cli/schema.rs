//! `schema`: the JSON Schema of character documents.

use super::failure::Failure;
use super::input::print;

pub fn run() -> Result<(), Failure> {
    print(&gaitwright_physics::character::schema())
}
