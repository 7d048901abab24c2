//! Who sends a request: what limits count by.

use std::convert::Infallible;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

/// Whoever limits are counted for: a token, or an address where nobody brings one.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Caller {
    /// The token of this name.
    Token(String),
    /// This address, or the network of an IPv6 address: it is one subscriber that has all of its 2⁶⁴ addresses.
    Address(IpAddr),
}

/// The other end of a connection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Peer(pub(super) IpAddr);

impl Caller {
    /// Whoever sends from `address`.
    pub(super) fn at(address: IpAddr) -> Self {
        Self::Address(match address.to_canonical() {
            IpAddr::V6(address) if !address.is_loopback() => {
                let [a, b, c, d, ..] = address.segments();
                Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0).into()
            }
            address => address,
        })
    }

    /// The name of the caller's token; empty for one that is known by an address, which may change between a request and
    /// its repetition.
    pub(super) fn token(&self) -> &str {
        match self {
            Self::Token(name) => name,
            Self::Address(_) => "",
        }
    }
}

/// As it stands in the log and with a job.
impl fmt::Display for Caller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Token(name) => write!(f, "token {name}"),
            Self::Address(address) => write!(f, "address {address}"),
        }
    }
}

/// The caller that was told from the request when it came in.
impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let unknown = || Self::at(Ipv4Addr::UNSPECIFIED.into());
        Ok(parts.extensions.get().cloned().unwrap_or_else(unknown))
    }
}
