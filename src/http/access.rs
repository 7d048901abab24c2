//! Who may come in: by which name the service is called, and with which token.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, HOST, HeaderValue, WWW_AUTHENTICATE};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

use super::problem::ProblemDetails;

/// Longest request id that a client may choose, bytes.
const LONGEST_REQUEST_ID: usize = 128;

/// Calls that a supervisor makes without a token.
const OPEN: [&str; 2] = ["/healthz", "/readyz"];

/// Ways to give the token; a browser asks its user for the second.
const CHALLENGES: [&str; 2] =
    ["Bearer realm=\"gaitwright\"", "Basic realm=\"gaitwright\", charset=\"UTF-8\""];

/// Where the service listens, and who may come in there.
#[derive(Debug, Clone)]
pub struct AccessPolicy {
    /// Digest of the token that every request has to bring; of equal length whatever the token is.
    token: Option<[u8; 32]>,
    /// The address that is listened on.
    listen: IpAddr,
    /// Further names of the service, in lower case.
    hosts: Vec<String>,
}

/// Why a service would let in anybody.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AccessPolicyError {
    /// The token is empty.
    #[error("the token GAITWRIGHT_TOKEN is empty")]
    EmptyToken,
    /// Others reach the address, and nothing keeps them out.
    #[error(
        "others reach {0}: set a token in the environment variable GAITWRIGHT_TOKEN, \
         or pass --insecure to let in everybody"
    )]
    Unprotected(SocketAddr),
}

/// What a service does at an address that others reach, without a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unprotected {
    /// It does not start.
    Refuse,
    /// It lets in everybody.
    Allow,
}

impl AccessPolicy {
    /// The rules of a service at `listen` that is called by its address, by the names of this machine for itself, and
    /// by `hosts`.
    ///
    /// # Errors
    ///
    /// When the token is empty, or there is none where others reach the address.
    pub fn new(
        listen: SocketAddr,
        token: Option<&str>,
        unprotected: Unprotected,
        hosts: Vec<String>,
    ) -> Result<Self, AccessPolicyError> {
        match token {
            Some("") => return Err(AccessPolicyError::EmptyToken),
            None if !listen.ip().is_loopback() && unprotected == Unprotected::Refuse => {
                return Err(AccessPolicyError::Unprotected(listen));
            }
            _ => {}
        }
        let hosts = hosts.into_iter().map(|host| host.to_ascii_lowercase()).collect();
        Ok(Self { token: token.map(|token| digest(token.as_bytes())), listen: listen.ip(), hosts })
    }

    /// Whether the service is called by one of its names. A page of another site whose name was made to lead here
    /// (DNS rebinding) gives its own.
    fn knows(&self, host: &str) -> bool {
        let Ok(authority) = host.parse::<Authority>() else { return false };
        let name = authority.host().trim_matches(['[', ']']).to_ascii_lowercase();
        match name.parse::<IpAddr>() {
            // An address cannot be made to lead elsewhere.
            Ok(address) if self.listen.is_unspecified() || address == self.listen => true,
            Ok(address) if address.is_loopback() => true,
            _ => name == "localhost" || self.hosts.contains(&name),
        }
    }

    /// Whether the request brings the token, where there is one.
    fn admits(&self, headers: &HeaderMap) -> bool {
        let Some(token) = &self.token else { return true };
        let Some(given) = headers.get(AUTHORIZATION).and_then(given_token) else { return false };
        // Neither the place of the first difference nor the length shows in the time that this takes.
        digest(&given).ct_eq(token).into()
    }
}

/// The token in a header: as such (RFC 6750), or as the password of any user (RFC 7617).
fn given_token(header: &HeaderValue) -> Option<Vec<u8>> {
    let (scheme, rest) = header.to_str().ok()?.split_once(' ')?;
    let rest = rest.trim();
    if scheme.eq_ignore_ascii_case("bearer") {
        return Some(rest.as_bytes().to_vec());
    }
    if !scheme.eq_ignore_ascii_case("basic") {
        return None;
    }
    let pair = BASE64_STANDARD.decode(rest).ok()?;
    let colon = pair.iter().position(|byte| *byte == b':')?;
    Some(pair[colon + 1..].to_vec())
}

fn digest(token: &[u8]) -> [u8; 32] {
    Sha256::digest(token).into()
}

/// Turns away whoever calls the service by a name that is not its own, or comes without its token.
pub(super) async fn check(State(policy): State<Arc<AccessPolicy>>, request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(HOST).iter();
    let host = hosts.next().and_then(|host| host.to_str().ok());
    let known = host.is_some_and(|host| policy.knows(host)) && hosts.next().is_none();
    if !known {
        let host = host.unwrap_or_default();
        let detail = format!("this service is not called {host:?}; see its option --allow-host");
        return ProblemDetails::new(StatusCode::MISDIRECTED_REQUEST, detail).into_response();
    }
    if !OPEN.contains(&request.uri().path()) && !policy.admits(request.headers()) {
        let detail = "the request brings no token, or a wrong one";
        let mut response = ProblemDetails::new(StatusCode::UNAUTHORIZED, detail).into_response();
        for challenge in CHALLENGES {
            response.headers_mut().append(WWW_AUTHENTICATE, HeaderValue::from_static(challenge));
        }
        return response;
    }
    next.run(request).await
}

/// Takes away a request id that would make every line of the log as long as the client likes; the request gets
/// another.
pub(super) async fn bound_request_id(mut request: Request) -> Request {
    let usable = |id: &HeaderValue| {
        (1..=LONGEST_REQUEST_ID).contains(&id.len()) && id.as_bytes().iter().all(u8::is_ascii_graphic)
    };
    if request.headers().get("x-request-id").is_some_and(|id| !usable(id)) {
        request.headers_mut().remove("x-request-id");
    }
    request
}
