//! The settings of the service: what each is, its default, and where it may come from.
//!
//! A setting that is a flag can come from an environment variable and from a file as well; the first that gives it
//! counts. What nobody gives has its default.

mod source;

use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use gaitwright::http::Tokens;
use gaitwright::jobs::{
    FilesPlace, JOB_MEMORY, LEASE, NOTICE, QUEUE, Retention, RetentionOptions, ServiceOptions, StorePlace,
    WORKERS,
};
use gaitwright_physics::fault::Fault;
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use super::log::LogFormat;
pub use source::{STATUS, SettingsArguments, tokens};

/// Connections that may be open at once, unless told otherwise.
pub const CONNECTIONS: NonZeroUsize = NonZeroUsize::new(2048).unwrap();

/// Streams that may be followed at once, unless told otherwise.
pub const STREAMS: NonZeroUsize = NonZeroUsize::new(640).unwrap();

/// Most jobs worked at side by side.
const MOST_WORKERS: u16 = 256;

/// Declares the settings as they are given, where all may be left open, and as they are used, each written once:
/// documentation, name, type, what the command line needs to know beside them, and default. A default may refer to
/// settings before it.
macro_rules! settings {
    ($($(#[doc = $about:literal])* $name:ident: $type:ty, ($($arg:tt)*) = $default:expr;)*) => {
        /// Settings as one source gives them.
        #[derive(Debug, Clone, Default, clap::Args, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct GivenSettings {
            $($(#[doc = $about])* #[arg($($arg)*)] pub(super) $name: Option<$type>,)*
        }

        /// Settings as they are used.
        #[derive(Debug, Clone, Serialize)]
        pub struct ServiceSettings {
            $($(#[doc = $about])* pub $name: $type,)*
        }

        impl GivenSettings {
            /// These, and where they are left open `others`.
            pub fn or(self, others: Self) -> Self {
                Self { $($name: self.$name.or(others.$name),)* }
            }

            /// These, and where they are left open the defaults.
            pub fn decided(self) -> ServiceSettings {
                $(let $name = self.$name.unwrap_or_else(|| $default);)*
                ServiceSettings { $($name,)* }
            }
        }
    };
}

settings! {
    /// Address and port to listen on; one that others reach needs a token in the environment variable
    /// GAITWRIGHT_TOKEN, or several in GAITWRIGHT_TOKENS (name=token,name=token) or in the settings file
    listen: SocketAddr, (long, env = "GAITWRIGHT_LISTEN") = ([127, 0, 0, 1], 8080).into();
    /// Tokens by the name of their caller, as such or as `sha256:` and the digest.
    tokens: Tokens, (skip) = Tokens::default();
    /// Let in everybody at an address that others reach
    insecure: bool, (long, env = "GAITWRIGHT_INSECURE", num_args = 0..=1, require_equals = true,
        default_missing_value = "true") = false;
    /// Further name by which the service is called, such as behind a proxy; may be given more than once
    allow_host: Vec<String>, (long, env = "GAITWRIGHT_ALLOW_HOST", value_name = "NAME", value_delimiter = ',')
        = Vec::new();
    /// Requests a second that one caller may send over time, and ten times as many at once; 0 for as many as they
    /// like. Callers are told apart by their tokens, without tokens by their addresses
    request_rate: u32, (long, env = "GAITWRIGHT_REQUEST_RATE")
        = if listen.ip().is_loopback() { 0 } else { 100 };
    /// Connections that may be open at once; others wait, and those on which nothing is being answered give way
    connections: NonZeroUsize, (long, env = "GAITWRIGHT_CONNECTIONS") = CONNECTIONS;
    /// Streams of events and growing recordings that may be followed at once
    streams: NonZeroUsize, (long, env = "GAITWRIGHT_STREAMS") = STREAMS;
    /// How many of them one caller may follow; half where there may be several callers, otherwise all
    caller_streams: NonZeroUsize, (long, env = "GAITWRIGHT_CALLER_STREAMS")
        = if several_callers(listen, &tokens) { half(streams) } else { streams };
    /// Simulations that may run at once; as many as there are cores
    simulations: NonZeroUsize, (long, env = "GAITWRIGHT_SIMULATIONS") = cores();
    /// How many of them one caller may run; half where there may be several callers, otherwise all
    caller_simulations: NonZeroUsize, (long, env = "GAITWRIGHT_CALLER_SIMULATIONS")
        = if several_callers(listen, &tokens) { half(simulations) } else { simulations };
    /// Folder of jobs and results, as far as they are not elsewhere, and of files on their way
    data: PathBuf, (long, env = "GAITWRIGHT_DATA") = "gaitwright-data".into();
    /// Where jobs are kept: `sqlite` in the data folder, or the URL of a PostgreSQL database that any number of servers
    /// and workers share, such as postgres://user@host/database; a password can be in PGPASSWORD or PGPASSFILE
    store: StorePlace, (long, env = "GAITWRIGHT_STORE", value_name = "URL") = StorePlace::default();
    /// Where the files of jobs are kept: `folder` in the data folder, or a place that all processes share: s3://bucket/prefix
    /// (with AWS's environment variables, such as AWS_ACCESS_KEY_ID, AWS_REGION, AWS_ENDPOINT) or file:///folder
    files: FilesPlace, (long, env = "GAITWRIGHT_FILES", value_name = "URL") = FilesPlace::default();
    /// Jobs worked at side by side; they share the cores. 0 for a server that leaves the work to others
    workers: u16, (long, env = "GAITWRIGHT_WORKERS") = WORKERS;
    /// Jobs that may wait
    queue: u64, (long, env = "GAITWRIGHT_QUEUE") = QUEUE;
    /// How many of them may be of one caller; half where there may be several callers, otherwise all
    caller_queue: u64, (long, env = "GAITWRIGHT_CALLER_QUEUE")
        = if several_callers(listen, &tokens) { queue.div_ceil(2) } else { queue };
    /// Memory that a job may come to need, MiB; a job that asks for more is refused
    job_memory: u64, (long, env = "GAITWRIGHT_JOB_MEMORY", value_name = "MIB") = JOB_MEMORY >> 20;
    /// Time after which a job is taken from a worker that shows no sign of life, s
    lease: f64, (long, env = "GAITWRIGHT_LEASE", value_name = "SECONDS")
        = if store.is_shared() { 20.0 } else { LEASE.as_secs_f64() };
    /// Jobs that have ended are kept within these limits, such as `30d,1000,20GB`: age, number, size of all together
    keep_jobs: Retention, (long, env = "GAITWRIGHT_KEEP_JOBS", value_name = "LIMITS") = Retention::default();
    /// Recordings of jobs that have ended are kept within these limits
    keep_recordings: Retention, (long, env = "GAITWRIGHT_KEEP_RECORDINGS", value_name = "LIMITS")
        = Retention::default();
    /// Characters are kept within these limits; their age counts from their last use
    keep_characters: Retention, (long, env = "GAITWRIGHT_KEEP_CHARACTERS", value_name = "LIMITS")
        = Retention::default();
    /// Time before it goes for which each thing says so at least, s
    keep_notice: u64, (long, env = "GAITWRIGHT_KEEP_NOTICE", value_name = "SECONDS") = NOTICE.as_secs();
    /// How the log is written to standard error
    log_format: LogFormat, (long, env = "GAITWRIGHT_LOG_FORMAT") = LogFormat::Text;
    /// What is logged: levels by module, as the crate tracing-subscriber reads them
    log: String, (long, env = "RUST_LOG", value_name = "FILTER") = "warn,gaitwright=info".to_owned();
}

/// Whether requests may come from more than one caller.
fn several_callers(listen: SocketAddr, tokens: &Tokens) -> bool {
    if tokens.is_empty() { !listen.ip().is_loopback() } else { tokens.len() > 1 }
}

/// Cores that the process may use.
pub fn cores() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

fn half(number: NonZeroUsize) -> NonZeroUsize {
    NonZeroUsize::new(number.get().div_ceil(2)).unwrap_or(number)
}

impl ServiceSettings {
    /// Values that none may have.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.workers > MOST_WORKERS {
            faults.push(Fault::new("workers", format!("must be at most {MOST_WORKERS}")));
        }
        if self.workers == 0 && !self.store.is_shared() {
            let reason = "nobody else can work at the jobs of a store in the data folder";
            faults.push(Fault::new("workers", reason));
        }
        if self.store.is_shared() && !self.files.is_shared() {
            let reason =
                "whoever shares a store has to share the files: s3://bucket/prefix or file:///folder";
            faults.push(Fault::new("files", reason));
        }
        for (name, number) in [("connections", self.connections), ("streams", self.streams)] {
            if number.get() > Semaphore::MAX_PERMITS {
                faults.push(Fault::new(name, format!("must be at most {}", Semaphore::MAX_PERMITS)));
            }
        }
        // A worker must be able to show itself in time.
        if !(0.1..=86_400.0).contains(&self.lease) {
            faults.push(Fault::new("lease", "must lie between 0.1 and 86400"));
        }
        faults
    }

    /// How the jobs are set up.
    pub fn options(&self) -> ServiceOptions {
        ServiceOptions {
            data: self.data.clone(),
            store: self.store.clone(),
            files: self.files.clone(),
            workers: self.workers.into(),
            queue: self.queue,
            caller_queue: Some(self.caller_queue),
            lease: Duration::from_secs_f64(self.lease),
            job_memory: self.job_memory.saturating_mul(1 << 20),
            retention: RetentionOptions {
                jobs: self.keep_jobs,
                recordings: self.keep_recordings,
                characters: self.keep_characters,
                notice: Duration::from_secs(self.keep_notice),
            },
        }
    }

    /// The settings as a file that gives them all; of tokens it has the digests, and no password of the store.
    ///
    /// # Errors
    ///
    /// When a path is not of Unicode characters.
    pub fn to_file(&self) -> anyhow::Result<String> {
        Ok(toml::to_string(self)?)
    }
}
