//! Where settings come from: command line, environment and file.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::{Args, Command};
use gaitwright::http::{TokenError, Tokens};
use gaitwright_physics::fault::{Fault, InputError};

use super::{GivenSettings, ServiceSettings};
use crate::cli::failure::CommandError;
use crate::cli::input;

/// What the names of all environment variables with settings begin with.
const PREFIX: &str = "GAITWRIGHT_";

/// The environment variable with the one token that requests have to bring.
const TOKEN: &str = "GAITWRIGHT_TOKEN";

/// The environment variable with several tokens.
const TOKENS: &str = "GAITWRIGHT_TOKENS";

/// The environment variable with the address at which a worker tells how it is: of each process its own, and so in no file.
pub const STATUS: &str = "GAITWRIGHT_STATUS";

/// The name of the caller whose token has none.
const NAMELESS: &str = "default";

/// Settings, from wherever they come.
#[derive(Debug, clap::Args)]
pub struct SettingsArguments {
    /// File with settings (TOML), by the names of the flags with _ in place of -. Flags and the environment come before it
    #[arg(long, value_name = "FILE", env = "GAITWRIGHT_CONFIG")]
    config: Option<PathBuf>,
    #[command(flatten)]
    given: GivenSettings,
}

impl SettingsArguments {
    /// The settings of the command line and the environment; what they leave open from the file; and what that leaves
    /// open by default.
    ///
    /// # Errors
    ///
    /// Everything that names no setting, and values that none may have.
    pub fn complete(self) -> Result<ServiceSettings, CommandError> {
        self.complete_at(None)
    }

    /// The same for a process that listens at the address `at`, if any, in place of the one in the settings: the defaults of
    /// what depends on that are decided by it.
    ///
    /// # Errors
    ///
    /// As of [`complete`](Self::complete).
    pub fn complete_at(self, at: Option<SocketAddr>) -> Result<ServiceSettings, CommandError> {
        check_environment()?;
        let mut filed = self.config.as_deref().map(read).transpose()?.unwrap_or_default();
        // The tokens of the environment open beside those of the file.
        let tokens = filed.tokens.take().unwrap_or_default().extended(tokens()?);
        let given = GivenSettings { tokens: Some(tokens), ..self.given }.or(filed);
        let listen = given.clone().decided().listen;
        let there = GivenSettings { listen: at.or(given.listen), ..given }.decided();
        let settings = ServiceSettings { listen, ..there };
        let faults = settings.faults();
        if faults.is_empty() {
            Ok(settings)
        } else {
            Err(CommandError::input("the settings")(InputError::Impossible(faults)))
        }
    }
}

/// The settings in the file at `path` (TOML).
fn read(path: &Path) -> Result<GivenSettings, CommandError> {
    let faulty = |place: String, reason: &str| {
        CommandError::input(input::name(path))(InputError::impossible(place, reason))
    };
    let bytes = input::read(path)?;
    let text = std::str::from_utf8(&bytes).map_err(|error| faulty(String::new(), &error.to_string()))?;
    toml::from_str(text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start));
        let line = before.map(|before| format!("line {}", before.matches('\n').count() + 1));
        faulty(line.unwrap_or_default(), error.message())
    })
}

/// The token of the environment as it is sent, where there is one.
fn token() -> Result<Option<String>, CommandError> {
    let Some(text) = std::env::var_os(TOKEN) else { return Ok(None) };
    text.into_string().map(Some).map_err(|_| faulty(TOKEN)("is not of Unicode characters".to_owned()))
}

/// The tokens of the environment.
pub fn tokens() -> Result<Tokens, CommandError> {
    let refused = |name| move |error: TokenError| faulty(name)(error.to_string());
    let one = match token()? {
        Some(token) => Tokens::one(NAMELESS, token.parse().map_err(refused(TOKEN))?),
        None => Tokens::default(),
    };
    let several = match std::env::var_os(TOKENS) {
        Some(list) => list.to_string_lossy().parse().map_err(refused(TOKENS))?,
        None => Tokens::default(),
    };
    Ok(one.extended(several))
}

/// A variable of the environment that cannot be used.
fn faulty(name: &str) -> impl Fn(String) -> CommandError {
    move |reason| CommandError::input(name)(InputError::impossible("", reason))
}

/// Refuses variables that look like settings and are none.
fn check_environment() -> Result<(), CommandError> {
    let flags = SettingsArguments::augment_args(Command::new(""));
    let known: BTreeSet<OsString> = flags
        .get_arguments()
        .filter_map(|flag| flag.get_env().map(OsString::from))
        .chain([TOKEN, TOKENS, STATUS].map(OsString::from))
        .collect();
    let looks = |name: &OsString| name.to_string_lossy().starts_with(PREFIX);
    let unknown =
        std::env::vars_os().map(|(name, _)| name).filter(|name| looks(name) && !known.contains(name));
    let faults: Vec<Fault> = unknown
        .map(|name| Fault::new(name.to_string_lossy(), "no setting of the service is called so"))
        .collect();
    if faults.is_empty() {
        Ok(())
    } else {
        Err(CommandError::input("the environment")(InputError::Impossible(faults)))
    }
}
