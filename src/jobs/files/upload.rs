//! The files of a job that runs, on their way to the object store: whatever is new in its scratch folder follows behind
//! the worker, which does not wait for it before the end.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use object_store::WriteMultipart;
use tokio::fs::File;
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio::runtime::Handle;
use tokio::sync::{Mutex, Notify};
use uuid::Uuid;

use super::folder::{self, Artefact};
use super::objects::{Leftover, Objects};

/// Time after which it is looked for what is new although nobody has said that there is something.
const EVERY: Duration = Duration::from_secs(2);

/// Largest part of a recording, bytes.
const PART: u64 = 8 << 20;

/// Number of parts up to which a recording is left in parts.
const FEW_PARTS: usize = 4;

/// Follows one run of a job. What has not been brought over when it is dropped stays behind.
#[derive(Debug)]
pub struct Upload {
    objects: Objects,
    folder: PathBuf,
    id: Uuid,
    run: i64,
    brought: Mutex<Brought>,
    /// There is something new.
    news: Notify,
    /// A checkpoint has arrived since somebody asked.
    kept: AtomicBool,
}

/// What the object store has.
#[derive(Debug, Default)]
struct Brought {
    /// Each file as it was then.
    files: BTreeMap<String, Version>,
    /// Where the parts of the recording begin, and how much of it there is.
    parts: BTreeSet<u64>,
    recorded: u64,
    /// The recording has been put together.
    whole: bool,
}

/// What tells one version of a file from another.
type Version = (u64, Option<SystemTime>);

impl Upload {
    /// Follows the run `run` of the job called `id` in `folder`.
    pub(super) fn start(
        objects: Objects,
        (id, run): (Uuid, i64),
        folder: PathBuf,
        runtime: &Handle,
    ) -> Arc<Self> {
        let upload = Arc::new(Self {
            objects,
            folder,
            id,
            run,
            brought: Mutex::default(),
            news: Notify::new(),
            kept: AtomicBool::new(false),
        });
        let follower = Arc::downgrade(&upload);
        runtime.spawn(async move {
            while let Some(upload) = follower.upgrade() {
                let _ = tokio::time::timeout(EVERY, upload.news.notified()).await;
                if let Err(error) = upload.bring().await {
                    tracing::warn!(job_id = %upload.id, %error, "files could not be brought to the object store");
                }
            }
        });
        upload
    }

    /// Says that there is something new.
    pub(crate) fn hurry(&self) {
        self.news.notify_one();
    }

    /// Whether a checkpoint has arrived since this was asked last.
    pub(crate) fn take_kept(&self) -> bool {
        self.kept.swap(false, Ordering::Relaxed)
    }

    /// Brings everything over.
    ///
    /// # Errors
    ///
    /// When a file cannot be read or written. What has arrived is not brought again.
    pub(crate) async fn finish(&self) -> io::Result<()> {
        self.bring().await?;
        let mut brought = self.brought.lock().await;
        if brought.parts.len() > FEW_PARTS && !brought.whole {
            self.put_together().await?;
            brought.whole = true;
        }
        Ok(())
    }

    /// Removes what the job's files no longer include: parts of a recording that has been put together, and what earlier
    /// runs have left. Their checkpoints stay unless the job has `succeeded`, since another run may go on from them; their recordings
    /// stay unless this run has `begun` its own.
    ///
    /// # Errors
    ///
    /// When something cannot be removed.
    pub(crate) async fn tidy(&self, succeeded: bool, begun: bool) -> io::Result<()> {
        if self.brought.lock().await.whole {
            self.objects.remove_parts(self.id, self.run).await?;
        }
        let which = Leftover { checkpoints: succeeded, recordings: begun };
        self.objects.remove_earlier(self.id, self.run, which).await
    }

    /// Brings over what is new, and removes what is gone.
    async fn bring(&self) -> io::Result<()> {
        let mut brought = self.brought.lock().await;
        let there = {
            let folder = self.folder.clone();
            tokio::task::spawn_blocking(move || files(&folder)).await??
        };
        let gone: Vec<String> =
            brought.files.keys().filter(|name| !there.contains_key(*name)).cloned().collect();
        for name in gone {
            self.objects.remove_file(self.id, self.run, &name).await?;
            brought.files.remove(&name);
        }
        let recording = Artefact::Recording.file_name();
        // What the index of motions names is there before the index is.
        let (index, others): (Vec<_>, Vec<_>) =
            there.iter().partition(|(name, _)| name.as_str() == Artefact::Motions.file_name());
        for (name, version) in others.into_iter().chain(index) {
            if name == recording || brought.files.get(name) == Some(version) {
                continue;
            }
            let contents = match tokio::fs::read(self.folder.join(name)).await {
                // It has gone since.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                contents => contents?,
            };
            self.objects.write(self.id, self.run, name, contents).await?;
            brought.files.insert(name.clone(), *version);
            if name == Artefact::Checkpoint.file_name() {
                self.kept.store(true, Ordering::Relaxed);
            }
        }
        if let Some((length, _)) = there.get(recording) {
            self.bring_recording(&mut brought, *length).await?;
        }
        Ok(())
    }

    /// Brings over what the recording, of `length` bytes by now, has grown by.
    async fn bring_recording(&self, brought: &mut Brought, length: u64) -> io::Result<()> {
        if brought.recorded >= length {
            return Ok(());
        }
        let mut file = File::open(Artefact::Recording.path(&self.folder)).await?;
        file.seek(SeekFrom::Start(brought.recorded)).await?;
        while brought.recorded < length {
            let mut part = Vec::new();
            let read = (&mut file).take(PART.min(length - brought.recorded)).read_to_end(&mut part).await?;
            if read == 0 {
                break;
            }
            self.objects.write_part(self.id, self.run, brought.recorded, part).await?;
            brought.parts.insert(brought.recorded);
            brought.recorded += read as u64;
        }
        Ok(())
    }

    /// Writes the recording in one piece.
    async fn put_together(&self) -> io::Result<()> {
        let name = Artefact::Recording.file_name();
        let mut file = File::open(Artefact::Recording.path(&self.folder)).await?;
        let mut upload = self.objects.write_long(self.id, self.run, name).await?;
        if let Err(error) = write_pieces(&mut file, &mut upload).await {
            // The pieces that have arrived would be kept, and charged for, without anybody seeing them.
            if let Err(left) = upload.abort().await {
                tracing::warn!(job_id = %self.id, error = %left, "pieces of a recording are left over");
            }
            return Err(error);
        }
        upload.finish().await?;
        Ok(())
    }
}

/// Writes `file` in pieces to an object that is there once the upload is finished.
async fn write_pieces(file: &mut File, upload: &mut WriteMultipart) -> io::Result<()> {
    loop {
        let mut piece = Vec::new();
        if file.take(PART).read_to_end(&mut piece).await? == 0 {
            return Ok(());
        }
        upload.wait_for_capacity(2).await?;
        upload.put(piece.into());
    }
}

impl Drop for Upload {
    fn drop(&mut self) {
        if let Err(error) = std::fs::remove_dir_all(&self.folder)
            && error.kind() != io::ErrorKind::NotFound
        {
            tracing::warn!(path = %self.folder.display(), %error, "files in the scratch folder are left over");
        }
    }
}

/// The files of a job in `folder` and the folders in it, by their names from there on, with what tells whether they have
/// changed.
fn files(folder: &Path) -> io::Result<BTreeMap<String, Version>> {
    let mut found = BTreeMap::new();
    for (prefix, folder) in folder::with_shelves(folder) {
        let entries = match std::fs::read_dir(folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let (Some(name), Ok(about)) = (entry.file_name().to_str().map(str::to_owned), entry.metadata())
            else {
                continue;
            };
            if about.is_file() && !folder::is_leftover(&entry.path()) {
                found.insert(format!("{prefix}{name}"), (about.len(), about.modified().ok()));
            }
        }
    }
    Ok(found)
}
