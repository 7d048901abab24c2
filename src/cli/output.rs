//! What a command leaves in a folder.

use std::path::Path;

use anyhow::Context;

use super::failure::CommandError;

/// Makes `folder`, before the work whose results it is to hold.
pub fn make_folder(folder: &Path) -> Result<(), CommandError> {
    Ok(std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?)
}

/// Writes a file of the folder that [`make_folder`] made.
pub fn leave(folder: &Path, name: &str, contents: &[u8]) -> Result<(), CommandError> {
    let path = folder.join(name);
    Ok(std::fs::write(&path, contents).with_context(|| format!("{} cannot be written", path.display()))?)
}
