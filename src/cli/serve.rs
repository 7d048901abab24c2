//! `serve`: the service.

use std::io::Write;
use std::net::SocketAddr;
use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use gaitwright::http::{self, AccessPolicy, HttpOptions, ProcessFigures, Tokens, Unprotected};
use gaitwright::jobs::{Jobs, ServiceOptions, start};
use gaitwright_physics::fault::InputError;
use tokio::net::TcpListener;
use tokio::runtime::{Handle, Runtime};
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use super::failure::CommandError;
use super::input::to_stdout;
use super::log::{self, LogFormat};
use super::message::tell;
use super::settings::{ServiceSettings, SettingsArguments};

/// How long the workers may take to put their jobs back into the queue at the end.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

/// Open files that are not connections: of the store, of jobs, of what is being answered.
const OTHER_FILES: u64 = 128;

/// Runs the service until it is interrupted.
///
/// Every flag can be given as an environment variable and in a settings file as well; --print-config shows what comes of
/// all of them, defaults included.
#[derive(Debug, clap::Args)]
pub struct ServeCommand {
    #[command(flatten)]
    settings: SettingsArguments,
    /// Print the settings that the service would have, as a settings file, and exit
    #[arg(long)]
    print_config: bool,
}

impl ServeCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let settings = self.settings.complete()?;
        let offer = offer(&settings, settings.listen)?;
        if self.print_config {
            let file = settings.to_file()?;
            return Ok(to_stdout(|out| out.write_all(file.as_bytes()))?);
        }
        start_log(&settings)?;
        let offer = afforded(offer);
        let runtime = Runtime::new().context("the runtime cannot be started")?;
        let served = runtime.block_on(async {
            let mut service = Service::start(settings.listen, settings.options(), offer).await?;
            say_listening(settings.log_format, service.address);
            service.until_interrupted().await?;
            service.stop().await
        });
        // Whatever still runs then is a computation that nobody waits for.
        runtime.shutdown_timeout(Duration::from_millis(100));
        served.map_err(CommandError::from)
    }
}

/// Has the log be written as the settings say.
pub fn start_log(settings: &ServiceSettings) -> Result<(), CommandError> {
    log::start(&settings.log, settings.log_format).map_err(|error| {
        CommandError::input("the settings")(InputError::impossible("log", error.to_string()))
    })
}

/// Counts from here on what the process does; called before there are jobs.
pub fn collect_figures() -> anyhow::Result<ProcessFigures> {
    ProcessFigures::collect().context("the figures of the process cannot be collected")
}

/// Opens the jobs.
pub async fn open(options: ServiceOptions) -> anyhow::Result<Jobs> {
    let (data, store, files) =
        (options.data.display().to_string(), options.store.to_string(), options.files.to_string());
    let opened = Jobs::open(options, CancellationToken::new()).await;
    opened.with_context(|| format!("the data folder {data} (store: {store}, files: {files}) cannot be used"))
}

/// Puts running jobs back into the queue with a checkpoint, and waits for all of it, but not for long.
pub async fn close(jobs: &Jobs) {
    jobs.shutdown().cancel();
    let until = Instant::now() + STOP_TIMEOUT;
    while jobs.workers() > 0 && Instant::now() < until {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    jobs.close().await;
}

/// Says where requests are listened for.
pub fn say_listening(format: LogFormat, address: SocketAddr) {
    match format {
        LogFormat::Text => tell(format_args!("listening on http://{address}")),
        LogFormat::Json => tracing::info!(%address, "listening"),
    }
}

/// How a process with these settings is offered at `listen`.
pub fn offer(settings: &ServiceSettings, listen: SocketAddr) -> Result<HttpOptions, CommandError> {
    let unprotected = if settings.insecure { Unprotected::Allow } else { Unprotected::Refuse };
    let access = access(listen, settings.tokens.clone(), unprotected, settings.allow_host.clone())?;
    Ok(HttpOptions {
        access,
        request_rate: NonZeroU32::new(settings.request_rate),
        connections: settings.connections.get(),
        streams: settings.streams.get(),
        caller_streams: settings.caller_streams.get(),
        simulations: settings.simulations.get(),
        caller_simulations: settings.caller_simulations.get(),
    })
}

/// The same with as many connections as the process may have open files for.
pub fn afforded(offer: HttpOptions) -> HttpOptions {
    HttpOptions { connections: affordable(offer.connections), ..offer }
}

/// As many connections as were asked for, or as the process may have open files for.
fn affordable(connections: usize) -> usize {
    let wanted = u64::try_from(connections).unwrap_or(u64::MAX).saturating_add(OTHER_FILES);
    match rlimit::increase_nofile_limit(wanted) {
        Ok(files) if files < wanted => {
            let fewer = usize::try_from(files.saturating_sub(OTHER_FILES).max(1)).unwrap_or(connections);
            tracing::warn!(
                files,
                connections = fewer,
                "fewer open files are allowed than there may be connections"
            );
            fewer
        }
        Ok(_) => connections,
        Err(error) => {
            tracing::warn!(%error, "the number of open files is not known");
            connections
        }
    }
}

/// Who may come in at `listen`.
pub fn access(
    listen: SocketAddr,
    tokens: Tokens,
    unprotected: Unprotected,
    hosts: Vec<String>,
) -> Result<AccessPolicy, CommandError> {
    AccessPolicy::new(listen, tokens, unprotected, hosts).map_err(|error| {
        CommandError::input("the settings")(InputError::impossible("listen", error.to_string()))
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
        let figures = collect_figures()?;
        let jobs = open(options).await?;
        let listener =
            TcpListener::bind(listen).await.with_context(|| format!("cannot listen on {listen}"))?;
        let address = listener.local_addr()?;
        start(&jobs, &Handle::current()).context("the workers cannot be started")?;
        let server = tokio::spawn(http::serve(listener, jobs.clone(), figures, offer));
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
        close(&self.jobs).await;
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
