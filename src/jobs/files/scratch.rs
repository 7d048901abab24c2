//! A folder of one process, for files on their way to an object store. It goes with the process; one that a process has
//! left that was killed is removed by the next.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use uuid::Uuid;

/// Folder of the scratch folders in the data folder.
const SCRATCH: &str = "scratch";

/// The file that is locked for as long as its process lives.
const LOCK: &str = "lock";

/// A scratch folder of this process.
#[derive(Debug)]
pub(super) struct Scratch {
    folder: PathBuf,
    _lock: File,
}

impl Scratch {
    /// A new one in the folder `data`, made if there is none.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub(super) fn new(data: &Path) -> io::Result<Self> {
        let all = data.join(SCRATCH);
        std::fs::create_dir_all(&all)?;
        for entry in std::fs::read_dir(&all)? {
            let folder = entry?.path();
            // One without a lock is just being made or removed.
            let abandoned = File::open(folder.join(LOCK)).is_ok_and(|lock| lock.try_lock().is_ok());
            if abandoned && let Err(error) = std::fs::remove_dir_all(&folder) {
                tracing::warn!(path = %folder.display(), %error, "what was left over stays");
            }
        }
        let folder = all.join(Uuid::now_v7().to_string());
        std::fs::create_dir(&folder)?;
        let lock = File::create(folder.join(LOCK))?;
        lock.try_lock().map_err(io::Error::from)?;
        Ok(Self { folder, _lock: lock })
    }

    /// A folder in it with this name, empty.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub(super) fn empty(&self, name: &str) -> io::Result<PathBuf> {
        let folder = self.folder.join(name);
        std::fs::create_dir(&folder)?;
        Ok(folder)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if let Err(error) = std::fs::remove_dir_all(&self.folder) {
            tracing::warn!(path = %self.folder.display(), %error, "the scratch folder is left over");
        }
    }
}
