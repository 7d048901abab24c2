//! `serve`: the service.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use gaitwright::http::{self, AccessPolicy, HttpOptions, Unprotected};
use gaitwright::jobs::{Jobs, Retention, RetentionOptions, ServiceOptions, start};
use gaitwright_physics::fault::InputError;
use tokio::net::TcpListener;
use tokio::runtime::{Handle, Runtime};
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use super::failure::CommandError;

/// How long the workers may take to put their jobs back into the queue at the end.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

/// The environment variable with the token that every request has to bring.
const TOKEN: &str = "GAITWRIGHT_TOKEN";

/// Connections that may be open at once, unless told otherwise: most systems give a process 1024 open files.
pub const CONNECTIONS: usize = 896;

/// Streams that may be followed at once, unless told otherwise.
pub const STREAMS: usize = 640;

/// Runs the service until it is interrupted.
#[derive(Debug, clap::Args)]
pub struct ServeCommand {
    /// Address and port to listen on; one that others reach needs a token in the environment variable
    /// GAITWRIGHT_TOKEN
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Let in everybody at an address that others reach
    #[arg(long)]
    insecure: bool,
    /// Further name by which the service is called, such as behind a proxy; may be given more than once
    #[arg(long, value_name = "NAME")]
    allow_host: Vec<String>,
    /// Connections that may be open at once; others wait
    #[arg(long, default_value_t = CONNECTIONS, value_parser = at_least_one)]
    connections: usize,
    /// Streams of events and growing recordings that may be followed at once
    #[arg(long, default_value_t = STREAMS, value_parser = at_least_one)]
    streams: usize,
    /// Folder of jobs and results
    #[arg(long, default_value = "gaitwright-data")]
    data: PathBuf,
    /// Jobs worked at side by side; they share the cores
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: u16,
    /// Jobs that may wait
    #[arg(long, default_value_t = 64)]
    queue: u64,
    /// Jobs of one caller that may wait [default: as many as of all]
    #[arg(long)]
    caller_queue: Option<u64>,
    /// Time after which a job is taken from a worker that shows no sign of life, s
    #[arg(long, default_value_t = 60.0, value_parser = lease)]
    lease: f64,
    /// Memory that a job may come to need, MiB; a job that asks for more is refused
    #[arg(long, value_name = "MIB", default_value_t = 1024)]
    job_memory: u64,
    /// Jobs that have ended are kept within these limits, such as `30d,1000,20GB`: age, number, size of all together
    #[arg(long, value_name = "LIMITS", default_value = "forever")]
    keep_jobs: Retention,
    /// Recordings of jobs that have ended are kept within these limits
    #[arg(long, value_name = "LIMITS", default_value = "forever")]
    keep_recordings: Retention,
    /// Characters are kept within these limits; their age counts from their last use
    #[arg(long, value_name = "LIMITS", default_value = "forever")]
    keep_characters: Retention,
    /// Time before it goes for which each thing says so at least, s
    #[arg(long, value_name = "SECONDS", default_value_t = 3600)]
    keep_notice: u64,
}

impl ServeCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let options = ServiceOptions {
            workers: self.workers.into(),
            queue: self.queue,
            caller_queue: self.caller_queue,
            lease: Duration::from_secs_f64(self.lease),
            job_memory: self.job_memory.saturating_mul(1 << 20),
            retention: RetentionOptions {
                jobs: self.keep_jobs,
                recordings: self.keep_recordings,
                characters: self.keep_characters,
                notice: Duration::from_secs(self.keep_notice),
            },
            ..ServiceOptions::new(self.data)
        };
        let unprotected = if self.insecure { Unprotected::Allow } else { Unprotected::Refuse };
        let access = access(self.listen, token()?.as_deref(), unprotected, self.allow_host)?;
        let offer = HttpOptions { access, connections: self.connections, streams: self.streams };
        let runtime = Runtime::new().context("the runtime cannot be started")?;
        let served = runtime.block_on(async {
            let mut service = Service::start(self.listen, options, offer).await?;
            eprintln!("listening on http://{}", service.address);
            service.until_interrupted().await?;
            service.stop().await
        });
        // Whatever still runs then is a computation that nobody waits for.
        runtime.shutdown_timeout(Duration::from_millis(100));
        served.map_err(CommandError::from)
    }
}

/// Seconds, not so few that a worker could not show itself in time.
fn lease(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.1..=86_400.0).contains(&seconds) => Ok(seconds),
        Ok(_) => Err("must lie between 0.1 and 86400".to_owned()),
        Err(_) => Err("is not a number of seconds".to_owned()),
    }
}

/// A number of things of which there has to be one.
fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("must be at least 1".to_owned()),
        Ok(number) if number > tokio::sync::Semaphore::MAX_PERMITS => Err("is too many".to_owned()),
        Ok(number) => Ok(number),
        Err(error) => Err(error.to_string()),
    }
}

/// The token of the environment, where there is one.
pub fn token() -> Result<Option<String>, CommandError> {
    match std::env::var(TOKEN) {
        Ok(token) => Ok(Some(token)),
        Err(std::env::VarError::NotPresent) => Ok(None),
        Err(error) => Err(CommandError::input(TOKEN)(InputError::impossible("", error.to_string()))),
    }
}

/// Who may come in at `listen`.
pub fn access(
    listen: SocketAddr,
    token: Option<&str>,
    unprotected: Unprotected,
    hosts: Vec<String>,
) -> Result<AccessPolicy, CommandError> {
    AccessPolicy::new(listen, token, unprotected, hosts).map_err(|error| {
        CommandError::input("the command line")(InputError::impossible("", error.to_string()))
    })
}

/// A service at work.
pub struct Service {
    /// Where it listens.
    pub address: SocketAddr,
    jobs: Jobs,
    server: tokio::task::JoinHandle<std::io::Result<()>>,
}

impl Service {
    /// Opens the data folder, starts the workers and listens.
    pub async fn start(
        listen: SocketAddr,
        options: ServiceOptions,
        offer: HttpOptions,
    ) -> anyhow::Result<Self> {
        let data = options.data.display().to_string();
        let jobs = Jobs::open(options, CancellationToken::new())
            .await
            .with_context(|| format!("the data folder {data} cannot be used"))?;
        let listener =
            TcpListener::bind(listen).await.with_context(|| format!("cannot listen on {listen}"))?;
        let address = listener.local_addr()?;
        start(&jobs, &Handle::current()).context("the workers cannot be started")?;
        let server = tokio::spawn(http::serve(listener, jobs.clone(), offer));
        Ok(Self { address, jobs, server })
    }

    /// Serves until the first SIGINT or SIGTERM.
    pub async fn until_interrupted(&mut self) -> anyhow::Result<()> {
        tokio::select! {
            interrupted = interrupted() => Ok(interrupted?),
            ended = &mut self.server => {
                ended??;
                bail!("the service has ended by itself")
            }
        }
    }

    /// Takes no more requests, puts running jobs back into the queue with a checkpoint, and waits
    /// for all of it, but not for long.
    pub async fn stop(self) -> anyhow::Result<()> {
        self.jobs.shutdown().cancel();
        self.server.await??;
        let until = Instant::now() + STOP_TIMEOUT;
        while self.jobs.workers() > 0 && Instant::now() < until {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        self.jobs.close().await;
        Ok(())
    }
}

/// Returns at the first SIGINT or SIGTERM.
pub async fn interrupted() -> std::io::Result<()> {
    let (mut interrupt, mut terminate) = (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?);
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
    }
    Ok(())
}
