//! `work`: a worker beside servers and other workers, on this machine or another.

use std::io::Write;
use std::net::SocketAddr;
use std::time::Duration;

use anyhow::Context;
use gaitwright::http;
use gaitwright::jobs::start_workers;
use gaitwright_physics::fault::{Fault, InputError};
use tokio::net::TcpListener;
use tokio::runtime::{Handle, Runtime};

use super::failure::CommandError;
use super::input::to_stdout;
use super::serve::{afforded, close, collect_figures, interrupted, offer, open, say_listening, start_log};
use super::settings::{STATUS, ServiceSettings, SettingsArguments};

/// Works at the jobs of a store that others share, until it is interrupted.
///
/// It has the settings of `serve`, so that one file serves both; those about requests are for --status alone.
#[derive(Debug, clap::Args)]
pub struct WorkCommand {
    #[command(flatten)]
    settings: SettingsArguments,
    /// Address and port at which to answer /healthz, /readyz and /metrics; nowhere unless it is given. One that others
    /// reach needs a token, as that of a server does
    #[arg(long, env = STATUS, value_name = "ADDRESS")]
    status: Option<SocketAddr>,
    /// Print the settings that the worker would have, as a settings file, and leave
    #[arg(long)]
    print_config: bool,
}

impl WorkCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let settings = self.settings.complete_at(self.status)?;
        let faults = faults(&settings);
        if !faults.is_empty() {
            return Err(CommandError::input("the settings")(InputError::Impossible(faults)));
        }
        let status = self.status.map(|at| Ok::<_, CommandError>((at, offer(&settings, at)?))).transpose()?;
        if self.print_config {
            let file = settings.to_file()?;
            return Ok(to_stdout(|out| out.write_all(file.as_bytes()))?);
        }
        start_log(&settings)?;
        let runtime = Runtime::new().context("the runtime cannot be started")?;
        let worked = runtime.block_on(async {
            let status = status.map(|status| Ok::<_, anyhow::Error>((status, collect_figures()?))).transpose()?;
            let jobs = open(settings.options()).await?;
            if let Some(((at, offer), figures)) = status {
                let listener = TcpListener::bind(at).await.with_context(|| format!("cannot listen on {at}"))?;
                say_listening(settings.log_format, listener.local_addr()?);
                let answering = http::serve_status(listener, jobs.clone(), figures, afforded(offer));
                tokio::spawn(async move {
                    // The work goes on all the same.
                    if let Err(error) = answering.await {
                        tracing::error!(%error, "how the worker is can no longer be asked");
                    }
                });
            }
            start_workers(&jobs, &Handle::current()).context("the workers cannot be started")?;
            tracing::info!(store = %settings.store, files = %settings.files, workers = settings.workers, "working");
            interrupted().await?;
            close(&jobs).await;
            Ok::<_, anyhow::Error>(())
        });
        runtime.shutdown_timeout(Duration::from_millis(100));
        worked.map_err(CommandError::from)
    }
}

/// Settings with which there is nothing to work at.
fn faults(settings: &ServiceSettings) -> Vec<Fault> {
    let mut faults = Vec::new();
    if !settings.store.is_shared() {
        let reason = "a worker shares the store of its servers: postgres://user@host/database";
        faults.push(Fault::new("store", reason));
    }
    if settings.workers == 0 {
        faults.push(Fault::new("workers", "must be at least 1"));
    }
    faults
}
