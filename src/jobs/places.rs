//! Where jobs and their files are kept, as it is told on a command line or in a file.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use url::Url;

use super::text::as_text;

/// Where the store of jobs is.
#[derive(Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum StorePlace {
    /// A file in the data folder, for one process.
    #[default]
    Folder,
    /// A PostgreSQL database, for any number of processes.
    Server(Url),
}

/// Where the files of jobs are.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum FilesPlace {
    /// In the data folder, for one process.
    #[default]
    Folder,
    /// In an object store, or a folder that is used as one, for any number of processes.
    Objects(Url),
}

/// A place that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// Of a store.
    #[error("`{0}` is neither `sqlite` nor a URL such as postgres://user@host/database")]
    Store(String),
    /// Of files.
    #[error("`{0}` is neither `folder` nor a URL such as s3://bucket/prefix or file:///folder")]
    Files(String),
}

/// The word for the store in the data folder.
const SQLITE: &str = "sqlite";

/// The word for files in the data folder.
const FOLDER: &str = "folder";

/// The parameter of a database's URL that can hold its password.
const PASSWORD: &str = "password";

impl StorePlace {
    /// Whether several processes can use it at once.
    pub fn is_shared(&self) -> bool {
        matches!(self, Self::Server(_))
    }
}

impl FilesPlace {
    /// Whether several processes can use it at once.
    pub fn is_shared(&self) -> bool {
        matches!(self, Self::Objects(_))
    }
}

/// The URL in `text` if it is of one of the schemes and complete.
fn url(text: &str, schemes: &[&str]) -> Option<Url> {
    let url = Url::parse(text).ok()?;
    let whole = url.has_host() || (url.scheme() == "file" && url.path().len() > 1);
    (whole && schemes.contains(&url.scheme())).then_some(url)
}

impl FromStr for StorePlace {
    type Err = PlaceError;

    fn from_str(text: &str) -> Result<Self, PlaceError> {
        if text == SQLITE {
            return Ok(Self::Folder);
        }
        let known = url(text, &["postgres", "postgresql"]);
        known.map(Self::Server).ok_or_else(|| PlaceError::Store(without_password(text)))
    }
}

impl FromStr for FilesPlace {
    type Err = PlaceError;

    fn from_str(text: &str) -> Result<Self, PlaceError> {
        if text == FOLDER {
            return Ok(Self::Folder);
        }
        // Credentials come from the environment, and are not to be anywhere else.
        let known =
            url(text, &["s3", "file"]).filter(|url| url.username().is_empty() && url.password().is_none());
        known.map(Self::Objects).ok_or_else(|| PlaceError::Files(without_password(text)))
    }
}

/// `text`, without the password if it is a URL that has one, or would be one if it were not faulty.
pub fn without_password(text: &str) -> String {
    let Ok(mut url) = Url::parse(text) else {
        // Whatever stands where a password would.
        let hidden = text.split_once("://").and_then(|(scheme, rest)| {
            let (who, place) = rest.rsplit_once('@')?;
            let user = who.split(':').next().unwrap_or_default();
            Some(format!("{scheme}://{user}@{place}"))
        });
        return hidden.unwrap_or_else(|| text.to_owned());
    };
    // One without a host has none.
    let _ = url.set_password(None);
    if url.query_pairs().any(|(name, _)| name == PASSWORD) {
        let others: Vec<_> = url.query_pairs().into_owned().filter(|(name, _)| name != PASSWORD).collect();
        url.set_query(None);
        if !others.is_empty() {
            url.query_pairs_mut().extend_pairs(others);
        }
    }
    url.into()
}

impl fmt::Display for StorePlace {
    /// As it is read, but for a password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder => f.write_str(SQLITE),
            Self::Server(url) => f.write_str(&without_password(url.as_str())),
        }
    }
}

impl fmt::Debug for StorePlace {
    /// As it is shown: no log is to have a password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for FilesPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder => f.write_str(FOLDER),
            Self::Objects(url) => url.fmt(f),
        }
    }
}

as_text!(StorePlace, PlaceError);
as_text!(FilesPlace, PlaceError);
