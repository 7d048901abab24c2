//! Files of jobs in an object store: S3 and what speaks like it, or a folder that is used as one.
//!
//! The files of a job lie under `jobs/ID/RUN/`, where the run is the number of its worker's claim: a worker that has lost
//! its job, and does not know yet, writes where nobody looks any more. The recording of a job that runs is there in
//! parts, `recording.parts/OFFSET`, which are joined on reading; at the end it is put together.

use std::collections::BTreeSet;
use std::io;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use futures_util::{StreamExt, TryStreamExt};
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::local::LocalFileSystem;
use object_store::path::Path as Key;
use object_store::prefix::PrefixStore;
use object_store::{ClientConfigKey, ObjectMeta, ObjectStore, ObjectStoreExt, PutPayload, RetryConfig};
use sha2::{Digest, Sha256};
use url::Url;
use uuid::Uuid;

use super::folder::Artefact;
use super::scratch::Scratch;
use crate::jobs::job::JobStorage;

/// Under which all jobs lie.
const JOBS: &str = "jobs";

/// Under which the parts of a growing recording lie, in the folder of a run.
const PARTS: &str = "recording.parts";

/// How long one request may take.
const REQUEST: &str = "20 seconds";

/// How long one file may be tried, again and again.
const RETRYING: RetryConfig = RetryConfig {
    backoff: object_store::BackoffConfig {
        init_backoff: Duration::from_millis(100),
        max_backoff: Duration::from_secs(2),
        base: 2.0,
    },
    max_retries: 5,
    retry_timeout: Duration::from_secs(10),
};

/// An object store and a scratch folder; clones share them.
#[derive(Debug, Clone)]
pub struct Objects {
    store: Arc<dyn ObjectStore>,
    scratch: Arc<Scratch>,
}

/// Chooses the one implementation of cryptography that every client of this process uses, for as long as nothing else has
/// been chosen.
pub fn choose_cryptography() {
    // An error says that there is one.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

impl Objects {
    /// The store at `url`, with a scratch folder in the folder `data`. An S3 store has its credentials, region and
    /// address from the environment variables of AWS's own programs.
    ///
    /// # Errors
    ///
    /// When the URL names no store, or the scratch folder cannot be made.
    pub(super) fn open(url: &Url, data: &std::path::Path) -> io::Result<Self> {
        choose_cryptography();
        let scratch = Arc::new(Scratch::new(data)?);
        let store: Arc<dyn ObjectStore> = match url.to_file_path() {
            Ok(folder) if url.scheme() == "file" => {
                std::fs::create_dir_all(&folder)?;
                let store = LocalFileSystem::new_with_prefix(folder)?;
                Arc::new(store.with_fsync(true).with_automatic_cleanup(true))
            }
            _ => {
                let store = AmazonS3Builder::from_env()
                    .with_url(url.as_str())
                    .with_config(AmazonS3ConfigKey::Client(ClientConfigKey::Timeout), REQUEST)
                    .with_retry(RETRYING)
                    .build()?;
                let prefix = Key::parse(url.path()).map_err(object_store::Error::from)?;
                Arc::new(PrefixStore::new(store, prefix))
            }
        };
        Ok(Self { store, scratch })
    }

    /// A folder for the files of one run of a job, empty.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub(super) fn work_folder(&self, id: Uuid, run: i64) -> io::Result<PathBuf> {
        self.scratch.empty(&format!("{id}-{run}"))
    }

    /// Where the file called `name` (with its folder, where it is in one) of a run lies.
    fn key(id: Uuid, run: i64, name: &str) -> Key {
        Key::from_iter([JOBS, &id.to_string(), &run.to_string()].into_iter().chain(name.split('/')))
    }

    /// Writes a file of a run: it appears whole or not at all.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub(super) async fn write(&self, id: Uuid, run: i64, name: &str, contents: Vec<u8>) -> io::Result<()> {
        self.store.put(&Self::key(id, run, name), PutPayload::from(contents)).await?;
        Ok(())
    }

    /// Writes a part of the recording that begins at `offset`.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub(super) async fn write_part(&self, id: Uuid, run: i64, offset: u64, part: Vec<u8>) -> io::Result<()> {
        self.write(id, run, &format!("{PARTS}/{offset:020}"), part).await
    }

    /// The store's own way of writing a large file piece by piece.
    ///
    /// # Errors
    ///
    /// When it cannot be begun.
    pub(super) async fn write_long(
        &self,
        id: Uuid,
        run: i64,
        name: &str,
    ) -> io::Result<object_store::WriteMultipart> {
        let upload = self.store.put_multipart(&Self::key(id, run, name)).await?;
        Ok(object_store::WriteMultipart::new(upload))
    }

    /// A file of a run; `None` where there is none.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub(super) async fn read(&self, id: Uuid, run: i64, name: &str) -> io::Result<Option<Vec<u8>>> {
        self.read_key(&Self::key(id, run, name)).await
    }

    async fn read_key(&self, key: &Key) -> io::Result<Option<Vec<u8>>> {
        let found = match self.store.get(key).await {
            Ok(found) => found.bytes().await,
            Err(error) => Err(error),
        };
        match found {
            Ok(bytes) => Ok(Some(bytes.into())),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The newest checkpoint of a job, whichever run has written it.
    ///
    /// # Errors
    ///
    /// When it cannot be looked for.
    pub(super) async fn checkpoint(&self, id: Uuid) -> io::Result<Option<Vec<u8>>> {
        let checkpoint = Artefact::Checkpoint.file_name();
        let files = self.list(&Key::from_iter([JOBS, &id.to_string()])).await?;
        let runs = files.iter().filter_map(|file| {
            let mut names = file.location.parts().rev();
            let last = names.next()?;
            (last.as_ref() == checkpoint).then(|| names.next()?.as_ref().parse::<i64>().ok())?
        });
        match runs.max() {
            Some(run) => self.read(id, run, checkpoint).await,
            None => Ok(None),
        }
    }

    /// The recording of a run, as far as it is there; `None` where there is none.
    ///
    /// # Errors
    ///
    /// When it cannot be looked for.
    pub(super) async fn recording(&self, id: Uuid, run: i64) -> io::Result<Option<Joined>> {
        let whole = Self::key(id, run, Artefact::Recording.file_name());
        let mut parts = match self.store.head(&whole).await {
            Ok(whole) => vec![whole],
            Err(object_store::Error::NotFound { .. }) => self.list(&Self::key(id, run, PARTS)).await?,
            Err(error) => return Err(error.into()),
        };
        parts.sort_by(|one, other| one.location.cmp(&other.location));
        Ok((!parts.is_empty()).then(|| Joined::new(Arc::clone(&self.store), parts)))
    }

    async fn list(&self, under: &Key) -> io::Result<Vec<ObjectMeta>> {
        Ok(self.store.list(Some(under)).try_collect().await?)
    }

    /// What the files of a run take up.
    ///
    /// # Errors
    ///
    /// When they cannot be looked for.
    pub(super) async fn storage(&self, id: Uuid, run: i64) -> io::Result<JobStorage> {
        let bytes = self.list(&Self::key(id, run, "")).await?.iter().map(|file| file.size).sum();
        let recording_bytes = self.recording(id, run).await?.map_or(0, |recording| recording.length());
        Ok(JobStorage { bytes, recording_bytes, ..JobStorage::default() })
    }

    /// Removes every file of a job.
    ///
    /// # Errors
    ///
    /// When one cannot be removed.
    pub(super) async fn remove(&self, id: Uuid) -> io::Result<()> {
        self.remove_under(&Key::from_iter([JOBS, &id.to_string()]), |_| true).await
    }

    /// Removes what runs of a job before `run` have left, of those `which`.
    ///
    /// # Errors
    ///
    /// When a file cannot be removed.
    pub(super) async fn remove_earlier(&self, id: Uuid, run: i64, which: Leftover) -> io::Result<()> {
        let unwanted = |key: &Key| {
            let checkpoint = key.filename().is_some_and(|name| name == Artefact::Checkpoint.file_name());
            is_before(key, run)
                && (which.checkpoints || !checkpoint)
                && (which.recordings || !is_recording(key))
        };
        self.remove_under(&Key::from_iter([JOBS, &id.to_string()]), unwanted).await
    }

    /// Removes the recordings of a job up to that of `run`.
    ///
    /// # Errors
    ///
    /// When one cannot be removed.
    pub(super) async fn remove_recordings(&self, id: Uuid, run: i64) -> io::Result<()> {
        let unwanted = |key: &Key| is_before(key, run + 1) && is_recording(key);
        self.remove_under(&Key::from_iter([JOBS, &id.to_string()]), unwanted).await
    }

    /// Removes the parts of the recording of a run, which has been put together.
    ///
    /// # Errors
    ///
    /// When one cannot be removed.
    pub(super) async fn remove_parts(&self, id: Uuid, run: i64) -> io::Result<()> {
        self.remove_under(&Self::key(id, run, PARTS), |_| true).await
    }

    /// Removes a file of a run, where there is one.
    ///
    /// # Errors
    ///
    /// When it cannot be removed.
    pub(super) async fn remove_file(&self, id: Uuid, run: i64, name: &str) -> io::Result<()> {
        match self.store.delete(&Self::key(id, run, name)).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    async fn remove_under(&self, under: &Key, which: impl Fn(&Key) -> bool) -> io::Result<()> {
        let files = self.list(under).await?;
        let unwanted = files.into_iter().map(|file| file.location).filter(which);
        let keys = futures_util::stream::iter(unwanted.map(Ok).collect::<Vec<_>>());
        let mut removed = self.store.delete_stream(keys.boxed());
        while let Some(outcome) = removed.next().await {
            match outcome {
                // Somebody else has removed it in the meantime.
                Ok(_) | Err(object_store::Error::NotFound { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// The jobs that have files.
    ///
    /// # Errors
    ///
    /// When they cannot be looked for.
    pub(super) async fn jobs(&self) -> io::Result<BTreeSet<Uuid>> {
        let listing = self.store.list_with_delimiter(Some(&Key::from(JOBS))).await?;
        let ids = listing.common_prefixes.iter().filter_map(|job| Uuid::parse_str(job.filename()?).ok());
        Ok(ids.collect())
    }

    /// Sees whether files can be written, by writing one.
    ///
    /// # Errors
    ///
    /// When they cannot.
    pub(super) async fn probe(&self) -> io::Result<()> {
        let key = Key::from_iter(["probe", &Uuid::now_v7().to_string()]);
        self.store.put(&key, PutPayload::from_static(b"probe")).await?;
        Ok(self.store.delete(&key).await?)
    }
}

/// Which files of runs that are over are not needed, besides their results.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leftover {
    /// Those that another run may go on from.
    pub(super) checkpoints: bool,
    /// Those that are the job's as long as no later run has begun one.
    pub(super) recordings: bool,
}

/// Whether a file of a job is that of a run before `run`. Later ones may be at work already, and their files are never another's.
fn is_before(key: &Key, run: i64) -> bool {
    let number = key.parts().nth(2).and_then(|number| number.as_ref().parse::<i64>().ok());
    number.is_some_and(|number| number < run)
}

/// Whether a file is a recording or a part of one.
fn is_recording(key: &Key) -> bool {
    key.parts().any(|part| part.as_ref() == PARTS)
        || key.filename().is_some_and(|name| name == Artefact::Recording.file_name())
}

/// A file that lies in an object store, in one part or several that follow one another.
#[derive(Debug, Clone)]
pub struct Joined {
    store: Arc<dyn ObjectStore>,
    /// With where each begins.
    parts: Vec<(u64, ObjectMeta)>,
    length: u64,
}

impl Joined {
    /// Of files in their order, each named by where it begins if there are several.
    fn new(store: Arc<dyn ObjectStore>, files: Vec<ObjectMeta>) -> Self {
        let (mut parts, mut length) = (Vec::new(), 0);
        for file in files {
            let begins = file.location.filename().and_then(|name| name.parse::<u64>().ok());
            // What follows a part that is missing is of no use before that is there.
            if begins.is_some_and(|begins| begins != length) {
                break;
            }
            let size = file.size;
            parts.push((length, file));
            length += size;
        }
        Self { store, parts, length }
    }

    /// Its length, bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// When it was changed last.
    pub fn modified(&self) -> SystemTime {
        let times = self.parts.iter().map(|(_, part)| SystemTime::from(part.last_modified));
        times.max().unwrap_or(SystemTime::UNIX_EPOCH)
    }

    /// What changes whenever its contents do.
    pub fn tag(&self) -> String {
        let mut digest = Sha256::new();
        for (start, part) in &self.parts {
            digest.update(format!("{} {start} {} {:?}\n", part.location, part.size, part.e_tag));
        }
        digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Bytes from the beginning of `range` on: as many as lie there in one part, and at most to its end. None where it
    /// begins at the end of the file.
    ///
    /// # Errors
    ///
    /// When they cannot be read.
    pub async fn read(&self, range: Range<u64>) -> io::Result<bytes::Bytes> {
        let index = self.parts.partition_point(|(start, part)| start + part.size <= range.start);
        let Some((start, part)) = self.parts.get(index) else { return Ok(bytes::Bytes::new()) };
        let end = range.end.min(start + part.size);
        if end <= range.start {
            return Ok(bytes::Bytes::new());
        }
        Ok(self.store.get_range(&part.location, range.start - start..end - start).await?)
    }
}
