//! A URDF and its meshes in a zip archive.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::draft::Draft;
use super::supply::{Supply, resolve};
use super::{ARCHIVE_BYTES, urdf};
use crate::fault::{Fault, InputError};

/// Greatest number of entries.
const ENTRIES: usize = 2000;
/// Greatest size of all files together after inflating, bytes.
const INFLATED_BYTES: u64 = 64 << 20;
/// Greatest ratio of a file's inflated to its deflated size beyond the first megabyte. Deflate reaches
/// 1032 on zeros; meshes stay below 20.
const RATIO: u64 = 200;

/// The draft of the one URDF in the archive, with the meshes beside it.
pub fn draft(bytes: &[u8]) -> Result<Draft, InputError> {
    let mut files = unpack(bytes)?;
    let name = the_urdf(&files)?;
    let document = files.remove(&name).unwrap_or_default();
    let folder = name.rsplit_once('/').map_or(String::new(), |(folder, _)| folder.to_owned());
    urdf::draft(&document, &Supply::Archive { files, folder })
}

/// The path of the only URDF, or of the only one at the shallowest level that has any.
fn the_urdf(files: &BTreeMap<String, Vec<u8>>) -> Result<String, InputError> {
    let depth = |path: &str| path.matches('/').count();
    let urdfs: Vec<&String> =
        files.keys().filter(|path| path.to_ascii_lowercase().ends_with(".urdf")).collect();
    let Some(shallowest) = urdfs.iter().map(|path| depth(path)).min() else {
        return Err(InputError::impossible("", "the archive holds no .urdf file"));
    };
    let top: Vec<&str> =
        urdfs.iter().filter(|path| depth(path) == shallowest).map(|path| path.as_str()).collect();
    match top[..] {
        [path] => Ok(path.to_owned()),
        _ => Err(InputError::impossible(
            "",
            format!("the archive holds several .urdf files ({}); exactly one is needed", top.join(", ")),
        )),
    }
}

/// Every file of the archive by its path, with the bounds on counts and sizes kept while inflating.
fn unpack(bytes: &[u8]) -> Result<BTreeMap<String, Vec<u8>>, InputError> {
    let too_large = |place: &str, reason: String| Err(InputError::TooLarge(Fault::new(place, reason)));
    if bytes.len() > ARCHIVE_BYTES {
        let reason = format!("the archive is {} bytes long; at most {ARCHIVE_BYTES} are read", bytes.len());
        return too_large("", reason);
    }
    let broken = |place: &str, error: &dyn std::fmt::Display| {
        InputError::Malformed(Fault::new(place, format!("the zip archive cannot be read: {error}")))
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| broken("", &error))?;
    if archive.len() > ENTRIES {
        let reason = format!("the archive has {} entries; at most {ENTRIES} are read", archive.len());
        return too_large("", reason);
    }
    let mut files = BTreeMap::new();
    let mut faults = Vec::new();
    let mut total = 0;
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(|error| broken("", &error))?;
        let name = entry.name().map_err(|error| broken("", &error))?.into_owned();
        let place = format!("entry {name:?}");
        if entry.is_symlink() {
            faults.push(Fault::new(place, "symbolic links in an archive are refused"));
            continue;
        }
        let path = match resolve("", &name) {
            Some(path) if !name.starts_with(['/', '\\']) && !name.contains(['\0', ':']) => path,
            _ => {
                faults.push(Fault::new(place, "the path leads out of the archive"));
                continue;
            }
        };
        if entry.is_dir() || is_resource_fork(&path) {
            continue;
        }
        let left = INFLATED_BYTES - total;
        let allowed = left.min((1 << 20) + RATIO * entry.compressed_size().min(ARCHIVE_BYTES as u64));
        let mut contents = Vec::new();
        entry.take(allowed + 1).read_to_end(&mut contents).map_err(|error| broken(&place, &error))?;
        if contents.len() as u64 > allowed {
            let reason = if allowed == left {
                format!("the archive inflates to more than {INFLATED_BYTES} bytes")
            } else {
                format!("it inflates to more than {RATIO} times its size")
            };
            return too_large(&place, reason);
        }
        total += contents.len() as u64;
        if files.insert(path, contents).is_some() {
            faults.push(Fault::new(place, "the archive holds this path twice"));
        }
    }
    if faults.is_empty() { Ok(files) } else { Err(InputError::Impossible(faults)) }
}

/// Whether a file is what macOS adds beside each one that it packs: its attributes, under its own name.
fn is_resource_fork(path: &str) -> bool {
    path.rsplit('/').next().is_some_and(|name| name.starts_with("._"))
}
