//! The settings of the service: what each is, its default, and where it may come from.
//!
//! A setting that is a flag can come from an environment variable and from a file as well; the first that gives it
//! counts. What nobody gives has its default.

mod source;

use std::net::SocketAddr;
use std::num::{NonZeroU16, NonZeroUsize};
use std::path::PathBuf;

use gaitwright::http::Tokens;
use gaitwright::jobs::Retention;
use gaitwright_physics::fault::Fault;
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use super::log::LogFormat;
pub use source::{SettingsArguments, token, tokens};

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
    /// Folder of jobs and results
    data: PathBuf, (long, env = "GAITWRIGHT_DATA") = "gaitwright-data".into();
    /// Jobs worked at side by side; they share the cores
    workers: NonZeroU16, (long, env = "GAITWRIGHT_WORKERS") = NonZeroU16::MIN;
    /// Jobs that may wait
    queue: u64, (long, env = "GAITWRIGHT_QUEUE") = 64;
    /// How many of them may be of one caller; half where there may be several callers, otherwise all
    caller_queue: u64, (long, env = "GAITWRIGHT_CALLER_QUEUE")
        = if several_callers(listen, &tokens) { queue.div_ceil(2) } else { queue };
    /// Memory that a job may come to need, MiB; a job that asks for more is refused
    job_memory: u64, (long, env = "GAITWRIGHT_JOB_MEMORY", value_name = "MIB") = 1024;
    /// Time after which a job is taken from a worker that shows no sign of life, s
    lease: f64, (long, env = "GAITWRIGHT_LEASE", value_name = "SECONDS") = 60.0;
    /// Jobs that have ended are kept within these limits, such as `30d,1000,20GB`: age, number, size of all together
    keep_jobs: Retention, (long, env = "GAITWRIGHT_KEEP_JOBS", value_name = "LIMITS") = Retention::default();
    /// Recordings of jobs that have ended are kept within these limits
    keep_recordings: Retention, (long, env = "GAITWRIGHT_KEEP_RECORDINGS", value_name = "LIMITS")
        = Retention::default();
    /// Characters are kept within these limits; their age counts from their last use
    keep_characters: Retention, (long, env = "GAITWRIGHT_KEEP_CHARACTERS", value_name = "LIMITS")
        = Retention::default();
    /// Time before it goes for which each thing says so at least, s
    keep_notice: u64, (long, env = "GAITWRIGHT_KEEP_NOTICE", value_name = "SECONDS") = 3600;
    /// How the log is written to standard error
    log_format: LogFormat, (long, env = "GAITWRIGHT_LOG_FORMAT") = LogFormat::Text;
    /// What is logged: levels by module, as the crate tracing-subscriber reads them
    log: String, (long, env = "RUST_LOG", value_name = "FILTER") = "warn,gaitwright=info".to_owned();
}

/// Whether requests may come from more than one caller.
fn several_callers(listen: SocketAddr, tokens: &Tokens) -> bool {
    if tokens.is_empty() { !listen.ip().is_loopback() } else { tokens.len() > 1 }
}

fn half(number: NonZeroUsize) -> NonZeroUsize {
    NonZeroUsize::new(number.get().div_ceil(2)).unwrap_or(number)
}

impl ServiceSettings {
    /// Values that none may have.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.workers.get() > MOST_WORKERS {
            faults.push(Fault::new("workers", format!("must be at most {MOST_WORKERS}")));
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

    /// The settings as a file that gives them all; of tokens it has the digests.
    ///
    /// # Errors
    ///
    /// When a path is not of Unicode characters.
    pub fn to_file(&self) -> anyhow::Result<String> {
        Ok(toml::to_string(self)?)
    }
}
