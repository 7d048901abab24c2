//! `demo`: the service and a job in it, as a newcomer meets them.

use std::io::{IsTerminal, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use gaitwright::jobs::{ServiceOptions, choose_cryptography};
use indicatif::{ProgressBar, ProgressStyle};
use reqwest::header::{AUTHORIZATION, HeaderMap, HeaderValue};
use reqwest::{Client, Response};
use serde_json::{Value, json};
use tokio::io::AsyncWriteExt;
use tokio::runtime::Runtime;
use uuid::Uuid;

use super::failure::CommandError;
use super::input::{check_budget, to_stdout};
use super::message::tell;
use super::serve::{Service, access, interrupted};
use super::settings::{CONNECTIONS, STREAMS, cores, tokens};
use gaitwright::http::{HttpOptions, Tokens, Unprotected};

/// The character of the demonstration.
pub(super) const QUADRUPED: &str = include_str!("../../examples/quadruped.urdf");

/// Starts the service, posts the bundled quadruped to it, shows the progress of its training, leaves the
/// recording and the motion in a folder, and goes on serving until it is interrupted.
#[derive(Debug, clap::Args)]
pub struct DemoCommand {
    /// Address and port to listen on [default: any free port of this machine]
    #[arg(long)]
    listen: Option<SocketAddr>,
    /// Folder of the service's data and of the results
    #[arg(long, default_value = "gaitwright-demo")]
    out: PathBuf,
    /// Greatest training time, s [default: as a job's]
    #[arg(long, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Greatest number of generations [default: as a job's]
    #[arg(long, allow_negative_numbers = true)]
    generations: Option<u32>,
    /// Leave as soon as the results are there
    #[arg(long)]
    exit: bool,
}

impl DemoCommand {
    pub fn run(self) -> Result<(), CommandError> {
        check_budget(self.generations, self.seconds)?;
        let listen = self.listen.unwrap_or_else(|| (Ipv4Addr::LOCALHOST, 0).into());
        let mut tokens = tokens()?;
        // Where it takes a token, the demonstration has one of its own: those of the others may be known by their digests only.
        let token = (!tokens.is_empty()).then(|| Uuid::new_v4().to_string());
        if let Some(token) = &token {
            tokens =
                tokens.extended(Tokens::one("demo", token.parse().context("the token is not accepted")?));
        }
        let offer = HttpOptions {
            access: access(listen, tokens, Unprotected::Refuse, Vec::new())?,
            request_rate: None,
            connections: CONNECTIONS.get(),
            streams: STREAMS.get(),
            caller_streams: STREAMS.get(),
            simulations: cores().get(),
            caller_simulations: cores().get(),
        };
        let client = client(token.as_deref())?;
        let runtime = Runtime::new().context("the runtime cannot be started")?;
        let done = runtime.block_on(async {
            let options = ServiceOptions::new(self.out.clone());
            let mut service = Service::start(listen, options, offer).await?;
            let base = format!("http://{}", service.address);
            tell(format_args!("the page: {base}/"));
            let shown = match self.post(&client, base.clone()).await {
                Ok(job) => tokio::select! {
                    shown = self.show(&client, &job) => shown,
                    interrupted = interrupted() => match interrupted {
                        // The next demonstration is not to wait for this one's job.
                        Ok(()) => job.cancel(&client).await.and(Err(anyhow!(
                            "interrupted before the results were there"
                        ))),
                        Err(error) => Err(error.into()),
                    },
                },
                Err(error) => Err(error),
            };
            if shown.is_ok() && !self.exit {
                tell(format_args!("serving at {base}/ until Ctrl-C"));
                service.until_interrupted().await?;
            }
            let stopped = service.stop().await;
            shown.and(stopped)
        });
        runtime.shutdown_timeout(std::time::Duration::from_millis(100));
        done.map_err(CommandError::from)
    }

    /// Posts the job.
    async fn post(&self, client: &Client, base: String) -> anyhow::Result<PostedJob> {
        let request = json!({
            "format": "gaitwright/job@1",
            "character": { "urdf": QUADRUPED },
            "learning": { "seconds": self.seconds, "generations": self.generations },
        });
        let posted = answer(client.post(format!("{base}/v1/jobs")).json(&request).send().await?).await?;
        let job: Value = posted.json().await?;
        let job = PostedJob { base, links: job["links"].clone() };
        tell(format_args!("the job:  {}", job.at("self")?));
        Ok(job)
    }

    /// Follows the events of a job, and downloads its recording and motion.
    async fn show(&self, client: &Client, posted: &PostedJob) -> anyhow::Result<()> {
        let job = watch(answer(client.get(posted.at("events")?).send().await?).await?).await?;
        ensure!(job["state"] == "succeeded", "the job {}: {}", job["state"], job["error"]);
        let recording = self.out.join("recording.rrd");
        let motion = self.out.join("motion.json");
        download(answer(client.get(posted.at("recording")?).send().await?).await?, &recording).await?;
        download(answer(client.get(posted.at("motion")?).send().await?).await?, &motion).await?;
        to_stdout(|out| writeln!(out, "{}\n{}", recording.display(), motion.display()))?;
        for learned in job["motions"].as_array().into_iter().flatten() {
            let number = |name: &str| learned[name].as_f64().unwrap_or_default();
            tell(format_args!(
                "{}: {:.2} m/s, cost of transport {:.2}{}",
                learned["name"].as_str().unwrap_or_default(),
                number("speed"),
                number("cost_of_transport"),
                if learned["natural"] == true { "" } else { ", not natural" },
            ));
        }
        tell(format_args!("to watch them: {} or the page {}/", posted.at("viewer")?, posted.base));
        Ok(())
    }
}

/// A job that the service has.
struct PostedJob {
    /// Where the service is.
    base: String,
    /// The job's links, by name.
    links: Value,
}

impl PostedJob {
    /// The address of one of its links.
    fn at(&self, link: &str) -> anyhow::Result<String> {
        match self.links[link].as_str() {
            Some(path) => Ok(format!("{}{path}", self.base)),
            None => bail!("the job has no link to its {link}"),
        }
    }

    /// Has the service cancel it.
    async fn cancel(&self, client: &Client) -> anyhow::Result<()> {
        answer(client.post(self.at("self")? + "/cancel").send().await?).await.map(drop)
    }
}

/// A client that brings the token with every request.
fn client(token: Option<&str>) -> anyhow::Result<Client> {
    choose_cryptography();
    let mut headers = HeaderMap::new();
    if let Some(token) = token {
        let value = HeaderValue::try_from(format!("Bearer {token}")).context("the token cannot be sent")?;
        headers.insert(AUTHORIZATION, value);
    }
    // The service is on this machine, whatever proxy leads out of it.
    Ok(Client::builder().default_headers(headers).no_proxy().build()?)
}

/// An answer that is no error; the detail of its problem document otherwise.
async fn answer(response: Response) -> anyhow::Result<Response> {
    let status = response.status();
    if status.is_success() {
        return Ok(response);
    }
    let problem: Value = response.json().await.unwrap_or_default();
    bail!("the service answered {status}: {}", problem["detail"].as_str().unwrap_or("no detail"))
}

/// Shows the events of a job as they come, and gives the job as it ended.
async fn watch(mut events: Response) -> anyhow::Result<Value> {
    let bar = std::io::stderr().is_terminal().then(ProgressBar::new_spinner);
    if let Some(bar) = &bar {
        bar.set_style(ProgressStyle::with_template("{spinner} {elapsed}  {msg}")?);
    }
    let say = |line: String| match &bar {
        Some(bar) => {
            bar.set_message(line);
            bar.tick();
        }
        None => tell(format_args!("{line}")),
    };
    let mut text = Vec::new();
    while let Some(chunk) = events.chunk().await? {
        text.extend_from_slice(&chunk);
        // An event ends with an empty line (HTML Living Standard, 9.2.5).
        while let Some(end) = text.windows(2).position(|pair| pair == b"\n\n") {
            let event: Vec<u8> = text.drain(..end + 2).collect();
            let event = String::from_utf8_lossy(&event);
            let field =
                |name: &str| event.lines().find_map(|line| line.strip_prefix(name)).map(str::trim_start);
            let data: Value = match field("data:") {
                Some(data) => serde_json::from_str(data)?,
                None => continue,
            };
            match field("event:") {
                Some("end") => {
                    if let Some(bar) = &bar {
                        bar.finish_and_clear();
                    }
                    return Ok(data);
                }
                Some("state") => say(format!("the job is {}", data["state"].as_str().unwrap_or_default())),
                Some("generation") => {
                    let number = |name: &str| data[name].as_f64().unwrap_or_default();
                    say(format!(
                        "{}, generation {}: fitness {:.3}, mean {:.3}",
                        data["gait"].as_str().unwrap_or("a motion"),
                        data["generation"],
                        number("best"),
                        number("mean"),
                    ));
                }
                _ => {}
            }
        }
    }
    bail!("the service ended before the job did")
}

async fn download(mut response: Response, path: &Path) -> anyhow::Result<()> {
    let mut file = tokio::fs::File::create(path)
        .await
        .with_context(|| format!("{} cannot be written", path.display()))?;
    while let Some(chunk) = response.chunk().await? {
        file.write_all(&chunk).await?;
    }
    file.flush().await?;
    Ok(())
}
