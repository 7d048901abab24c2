//! `serve`: the service.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use gaitwright::http;
use gaitwright::jobs::{Jobs, ServiceOptions, start};
use tokio::net::TcpListener;
use tokio::runtime::{Handle, Runtime};
use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

use super::failure::CommandError;

/// How long the workers may take to put their jobs back into the queue at the end.
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

/// Runs the service until it is interrupted.
#[derive(Debug, clap::Args)]
pub struct ServeCommand {
    /// Address and port to listen on
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// Folder of jobs and results
    #[arg(long, default_value = "gaitwright-data")]
    data: PathBuf,
    /// Jobs worked at side by side; they share the cores
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    workers: u16,
    /// Jobs that may wait
    #[arg(long, default_value_t = 64)]
    queue: u64,
}

impl ServeCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let options = ServiceOptions { data: self.data, workers: self.workers.into(), queue: self.queue };
        let runtime = Runtime::new().context("the runtime cannot be started")?;
        let served = runtime.block_on(async {
            let mut service = Service::start(self.listen, options).await?;
            eprintln!("listening on http://{}", service.address);
            service.until_interrupted().await?;
            service.stop().await
        });
        // Whatever still runs then is a computation that nobody waits for.
        runtime.shutdown_timeout(Duration::from_millis(100));
        served.map_err(CommandError::from)
    }
}

/// A service at work.
pub struct Service {
    /// Where it listens.
    pub address: SocketAddr,
    jobs: Jobs,
    workers: Vec<JoinHandle<()>>,
    server: tokio::task::JoinHandle<std::io::Result<()>>,
}

impl Service {
    /// Opens the data folder, starts the workers and listens.
    pub async fn start(listen: SocketAddr, options: ServiceOptions) -> anyhow::Result<Self> {
        let data = options.data.display().to_string();
        let jobs = Jobs::open(options, CancellationToken::new())
            .await
            .with_context(|| format!("the data folder {data} cannot be used"))?;
        let listener =
            TcpListener::bind(listen).await.with_context(|| format!("cannot listen on {listen}"))?;
        let address = listener.local_addr()?;
        let workers = start(&jobs, &Handle::current()).context("the workers cannot be started")?;
        let server = tokio::spawn(http::serve(listener, jobs.clone()));
        Ok(Self { address, jobs, workers, server })
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
        while self.workers.iter().any(|worker| !worker.is_finished()) && Instant::now() < until {
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
