//! Where the meshes that a URDF refers to come from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Greatest size of one mesh file, bytes.
const MESH_BYTES: u64 = 64 << 20;
/// How many folders above the URDF's own are looked into for a `package://` reference.
const LEVELS: usize = 12;

/// A source of mesh files.
#[derive(Debug)]
pub enum Supply {
    /// No files: the document came alone.
    Nothing,
    /// The files of an archive by their path, and the folder that its URDF lies in.
    Archive { files: BTreeMap<String, Vec<u8>>, folder: String },
    /// The folder on this machine that the URDF lies in.
    Folder(PathBuf),
}

/// Why a mesh reference is refused, or its file cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SupplyError {
    #[error("the mesh {0:?} is named by a URL or an absolute path, which is refused")]
    Absolute(String),
    #[error("the mesh path {0:?} leads out of the archive")]
    OutsideArchive(String),
    #[error("the mesh path {0:?} leads out of its package")]
    OutsidePackage(String),
    #[error("the mesh {} is larger than {MESH_BYTES} bytes", .0.display())]
    TooLarge(PathBuf),
    #[error("the mesh {} cannot be read: {error}", path.display())]
    Unreadable { path: PathBuf, error: std::io::Error },
}

/// What a mesh reference stands for.
enum Reference<'a> {
    Relative(&'a str),
    /// `package://name/rest`.
    Package {
        name: &'a str,
        rest: &'a str,
    },
    /// An absolute path or any other URL.
    Elsewhere,
}

impl<'a> Reference<'a> {
    fn new(text: &'a str) -> Self {
        if let Some(path) = text.strip_prefix("package://") {
            let (name, rest) = path.split_once('/').unwrap_or((path, ""));
            return Self::Package { name, rest };
        }
        // A colon marks every other URL and a drive letter.
        if text.starts_with(['/', '\\']) || text.contains(':') {
            return Self::Elsewhere;
        }
        Self::Relative(text)
    }
}

/// Whether `reference` is an absolute path, or a URL of another kind than `package://`.
pub fn is_elsewhere(reference: &str) -> bool {
    matches!(Reference::new(reference), Reference::Elsewhere)
}

impl Supply {
    /// The files beside and above the URDF at `path`.
    pub fn beside(path: &Path) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Self::Folder(folder.unwrap_or(Path::new(".")).to_path_buf())
    }

    /// The bytes of the file that `reference` names, or `None` when they are not supplied.
    ///
    /// # Errors
    ///
    /// [`SupplyError`] where `reference` leads out of what the sender supplied, or the file cannot be read.
    pub fn find(&self, reference: &str) -> Result<Option<Vec<u8>>, SupplyError> {
        match (Reference::new(reference), self) {
            (Reference::Elsewhere, Self::Folder(_)) => Ok(None),
            (Reference::Elsewhere, _) => Err(SupplyError::Absolute(reference.to_owned())),
            (Reference::Relative(path), Self::Archive { files, folder }) => {
                let path =
                    resolve(folder, path).ok_or_else(|| SupplyError::OutsideArchive(reference.to_owned()))?;
                Ok(files.get(&path).cloned())
            }
            (Reference::Package { name, rest }, Self::Archive { files, .. }) => {
                let out = || SupplyError::OutsideArchive(reference.to_owned());
                let rest = resolve("", rest).ok_or_else(out)?;
                let inside = format!("{name}/{rest}");
                Ok(ending(files, &inside).or_else(|| ending(files, &rest)).cloned())
            }
            (Reference::Relative(path), Self::Folder(folder)) => read_if_there(&folder.join(path)),
            (Reference::Package { name, rest }, Self::Folder(folder)) => {
                let out = || SupplyError::OutsidePackage(reference.to_owned());
                let rest = resolve("", rest).ok_or_else(out)?;
                let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
                for above in folder.ancestors().take(LEVELS) {
                    for candidate in [above.join(name).join(&rest), above.join(&rest)] {
                        if let Some(bytes) = read_if_there(&candidate)? {
                            return Ok(Some(bytes));
                        }
                    }
                }
                Ok(None)
            }
            (_, Self::Nothing) => Ok(None),
        }
    }
}

/// `path` seen from `folder`, without `.` and `..`; `None` when it leads out of the top.
pub fn resolve(folder: &str, path: &str) -> Option<String> {
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in path.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// The file whose path ends with the components of `end`; of several the one with the shortest path,
/// then the first by name.
fn ending<'a>(files: &'a BTreeMap<String, Vec<u8>>, end: &str) -> Option<&'a Vec<u8>> {
    files
        .iter()
        .filter(|(path, _)| {
            path.strip_suffix(end).is_some_and(|before| before.is_empty() || before.ends_with('/'))
        })
        .min_by_key(|(path, _)| path.len())
        .map(|(_, bytes)| bytes)
}

fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>, SupplyError> {
    match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_file() => {
            if metadata.len() > MESH_BYTES {
                return Err(SupplyError::TooLarge(path.to_owned()));
            }
            std::fs::read(path)
                .map(Some)
                .map_err(|error| SupplyError::Unreadable { path: path.to_owned(), error })
        }
        _ => Ok(None),
    }
}
