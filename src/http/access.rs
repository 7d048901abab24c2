//! Who may come in: by which name the service is called, with which token, and how often.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{AUTHORIZATION, HOST, HeaderValue, WWW_AUTHENTICATE};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::caller::{Caller, Peer};
use super::limits::RequestRate;
use super::problem::ProblemDetails;
use super::token::{TokenDigest, Tokens};

/// Longest request id that a client may choose, bytes.
const LONGEST_REQUEST_ID: usize = 128;

/// Calls that a supervisor makes without a token.
pub(super) const OPEN: [&str; 2] = ["/healthz", "/readyz"];

/// Ways to give the token; a browser asks its user for the second.
const CHALLENGES: [&str; 2] =
    ["Bearer realm=\"gaitwright\"", "Basic realm=\"gaitwright\", charset=\"UTF-8\""];

/// Where the service listens, and who may come in there.
#[derive(Debug, Clone)]
pub struct AccessPolicy {
    /// Of which every request has to bring one, unless there are none.
    tokens: Tokens,
    /// The address that is listened on.
    listen: IpAddr,
    /// Further names of the service, in lower case.
    hosts: Vec<String>,
}

/// Why a service would let in anybody.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AccessPolicyError {
    /// Others reach the address, and nothing keeps them out.
    #[error(
        "others reach {0}: set a token in the environment variable GAITWRIGHT_TOKEN, or several in the settings, \
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
    /// When there is no token where others reach the address.
    pub fn new(
        listen: SocketAddr,
        tokens: Tokens,
        unprotected: Unprotected,
        hosts: Vec<String>,
    ) -> Result<Self, AccessPolicyError> {
        if tokens.is_empty() && !listen.ip().is_loopback() && unprotected == Unprotected::Refuse {
            return Err(AccessPolicyError::Unprotected(listen));
        }
        let hosts = hosts.into_iter().map(|host| host.to_ascii_lowercase()).collect();
        Ok(Self { tokens, listen: listen.ip(), hosts })
    }

    /// Whether a request has to bring a token.
    pub(super) fn asks_for_token(&self) -> bool {
        !self.tokens.is_empty()
    }

    /// Whether the service is called by one of its names. A page of another site whose name was made to lead here
    /// (DNS rebinding) gives its own.
    fn knows(&self, authority: &Authority) -> bool {
        let name = authority.host().trim_matches(['[', ']']).to_ascii_lowercase();
        match name.parse::<IpAddr>() {
            // An address cannot be made to lead elsewhere.
            Ok(address) if self.listen.is_unspecified() || address == self.listen => true,
            Ok(address) if address.is_loopback() => true,
            _ => name == "localhost" || self.hosts.contains(&name),
        }
    }

    /// Who sends a request from `peer`; `None` where it has to bring a token and does not.
    fn caller(&self, headers: &HeaderMap, peer: IpAddr) -> Option<Caller> {
        if self.tokens.is_empty() {
            return Some(Caller::at(peer));
        }
        let given = TokenDigest::of(&headers.get(AUTHORIZATION).and_then(given_token)?);
        self.tokens.name(&given).map(Caller::Token)
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

/// What a request is checked against.
#[derive(Debug)]
pub(super) struct Gate {
    /// Who may come in.
    pub(super) policy: AccessPolicy,
    /// How often; as often as they like where there is none.
    pub(super) rate: Option<RequestRate>,
}

impl Gate {
    /// Counts a request.
    ///
    /// # Errors
    ///
    /// The answer, when it is one too many.
    fn count(&self, caller: &Caller) -> Result<(), ProblemDetails> {
        let Some(Err(wait)) = self.rate.as_ref().map(|rate| rate.count(caller)) else { return Ok(()) };
        let seconds = u32::try_from(wait.as_secs()).unwrap_or(u32::MAX).saturating_add(1);
        let detail = "too many requests from this caller; see the setting request_rate";
        Err(ProblemDetails::new(StatusCode::TOO_MANY_REQUESTS, detail).retry_after(seconds))
    }
}

/// Turns away whoever calls the service by a name that is not its own, comes without its token, or comes too often.
pub(super) async fn check(State(gate): State<Arc<Gate>>, mut request: Request, next: Next) -> Response {
    let mut hosts = request.headers().get_all(HOST).iter();
    let host = hosts.next().and_then(|host| host.to_str().ok()?.parse::<Authority>().ok());
    let Some(host) = host.filter(|_| hosts.next().is_none()) else {
        let detail = "the request does not say in one `host` header whom it is for";
        return ProblemDetails::new(StatusCode::BAD_REQUEST, detail).into_response();
    };
    if !gate.policy.knows(&host) {
        let detail = format!("this service is not called {:?}; see its setting allow_host", host.as_str());
        return ProblemDetails::new(StatusCode::MISDIRECTED_REQUEST, detail).into_response();
    }
    if OPEN.contains(&request.uri().path()) {
        return next.run(request).await;
    }
    let peer = request.extensions().get::<Peer>().map_or(Ipv4Addr::UNSPECIFIED.into(), |peer| peer.0);
    let caller = gate.policy.caller(request.headers(), peer);
    // Whoever tries tokens is counted as well, by the address.
    if let Err(problem) = gate.count(caller.as_ref().unwrap_or(&Caller::at(peer))) {
        return problem.into_response();
    }
    let Some(caller) = caller else {
        let detail = "the request brings no token, or a wrong one";
        let mut response = ProblemDetails::new(StatusCode::UNAUTHORIZED, detail).into_response();
        for challenge in CHALLENGES {
            response.headers_mut().append(WWW_AUTHENTICATE, HeaderValue::from_static(challenge));
        }
        return response;
    };
    tracing::Span::current().record("caller", tracing::field::display(&caller));
    request.extensions_mut().insert(caller);
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
