//! Who is let in: tokens and their roles, names of this host, and how many requests a second.

use super::{
    error::ApiError,
    roles::{Access, access},
};
use crate::{
    farm::{Farm, error::FarmError, live::held},
    store::row::Role,
};
use axum::{
    extract::{Request, State},
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    middleware::Next,
    response::{IntoResponse as _, Response},
};
use ovtigre_proto::id::BlobId;
use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

/// A token that was looked up is believed for so long.
const BELIEVED: Duration = Duration::from_secs(1);
/// Tokens that are remembered, at most.
const REMEMBERED: usize = 10_000;

/// How callers are told apart.
#[derive(Clone, Debug)]
pub struct Guarding {
    /// Whether calls without a token are let in where there are no tokens.
    pub without_tokens: WithoutTokens,
    /// Names of this host that callers may use where they need no token; any where it is empty.
    pub hosts: Vec<String>,
    /// Requests a second of one token, workers' apart.
    pub requests_per_second: f64,
    /// The hash of a token of role `work` that this process has made for workers of its own.
    pub own_work: Option<BlobId>,
}

/// Whether calls are let in while the farm has no tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WithoutTokens {
    /// All of them: only this machine can call.
    LetIn,
    /// None.
    Refuse,
}

impl Default for Guarding {
    fn default() -> Self {
        Self {
            without_tokens: WithoutTokens::LetIn,
            hosts: Vec::new(),
            requests_per_second: 100.0,
            own_work: None,
        }
    }
}

/// A caller that was let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// The id of its token; `None` where none is needed.
    pub token: Option<String>,
    /// What it may do.
    pub role: Role,
}

impl Caller {
    /// Of a farm that asks for no token.
    const ANYBODY: Self = Self { token: None, role: Role::Admin };
}

/// Lets callers in.
#[derive(Debug)]
pub struct Guard {
    farm: Arc<Farm>,
    rules: Guarding,
    /// Whether there are tokens, and when that was looked up.
    needed: Mutex<Option<(bool, Instant)>>,
    known: Mutex<HashMap<BlobId, Known>>,
}

/// A token that was looked up.
#[derive(Clone, Debug)]
struct Known {
    /// Its id and role; `None` where there is no such token.
    token: Option<(String, Role)>,
    at: Instant,
    /// Requests that it may still make now, and since when.
    left: f64,
    since: Instant,
}

impl Guard {
    /// Of a farm.
    pub fn new(farm: Arc<Farm>, rules: Guarding) -> Self {
        Self { farm, rules, needed: Mutex::default(), known: Mutex::default() }
    }

    async fn check(&self, access: Access, headers: &HeaderMap) -> Result<Caller, ApiError> {
        if !self.needs_tokens().await? {
            self.host(headers)?;
            return Ok(Caller::ANYBODY);
        }
        if access == Access::Open {
            return Ok(Caller::ANYBODY);
        }
        let Some(hash) = bearer(headers) else {
            return Err(unauthorized("a token is needed: send 'Authorization: Bearer TOKEN'"));
        };
        let Some((id, role)) = self.find(&hash).await? else {
            return Err(unauthorized("this token is not known here, or was revoked"));
        };
        if !access.allows(role) {
            let detail = format!("a token of role '{}' may not do this", role.name());
            return Err(ApiError::new(StatusCode::FORBIDDEN, "forbidden", "Forbidden", detail));
        }
        if !access.is_work() {
            self.pace(&hash)?;
        }
        Ok(Caller { token: Some(id), role })
    }

    async fn needs_tokens(&self) -> Result<bool, ApiError> {
        if self.rules.without_tokens == WithoutTokens::Refuse {
            return Ok(true);
        }
        if let Some((needed, at)) = *held(&self.needed)
            && at.elapsed() < BELIEVED
        {
            return Ok(needed);
        }
        let needed = !self.farm.store.tokens().await.map_err(FarmError::from)?.is_empty();
        *held(&self.needed) = Some((needed, Instant::now()));
        Ok(needed)
    }

    async fn find(&self, hash: &BlobId) -> Result<Option<(String, Role)>, ApiError> {
        if self.rules.own_work.as_ref() == Some(hash) {
            return Ok(Some(("own".to_owned(), Role::Work)));
        }
        let known = held(&self.known).get(hash).cloned();
        if let Some(known) = known.as_ref().filter(|known| known.at.elapsed() < BELIEVED) {
            return Ok(known.token.clone());
        }
        let row = self.farm.store.token(hash).await.map_err(FarmError::from)?;
        let token = row.map(|row| (row.id, row.role));
        let now = Instant::now();
        let fresh = || (self.rules.requests_per_second, now);
        let (left, since) = known.map_or_else(fresh, |known| (known.left, known.since));
        let mut all = held(&self.known);
        if all.len() >= REMEMBERED {
            all.clear();
        }
        all.insert(hash.clone(), Known { token: token.clone(), at: now, left, since });
        Ok(token)
    }

    /// A bucket that holds the requests of a second, and fills at their rate.
    fn pace(&self, hash: &BlobId) -> Result<(), ApiError> {
        let rate = self.rules.requests_per_second;
        let mut all = held(&self.known);
        let Some(known) = all.get_mut(hash) else { return Ok(()) };
        let now = Instant::now();
        known.left = (known.left + rate * (now - known.since).as_secs_f64()).min(rate.max(1.0));
        known.since = now;
        if known.left < 1.0 {
            let detail = format!("more than {rate} requests a second with this token: send fewer");
            let title = "Too many requests";
            return Err(ApiError::new(StatusCode::TOO_MANY_REQUESTS, "too-many-requests", title, detail));
        }
        known.left -= 1.0;
        Ok(())
    }

    /// A page of somebody else whose name leads to this machine is not this machine's.
    fn host(&self, headers: &HeaderMap) -> Result<(), ApiError> {
        let Some(host) = headers.get(header::HOST) else { return Ok(()) };
        let name = host_name(host.to_str().unwrap_or(""));
        let here = name == "localhost" || name.parse::<IpAddr>().is_ok();
        if self.rules.hosts.is_empty()
            || here
            || self.rules.hosts.iter().any(|h| h.eq_ignore_ascii_case(name))
        {
            return Ok(());
        }
        let detail =
            "this farm is not known under that name: call it by its address, or start it with --host";
        Err(ApiError::new(StatusCode::MISDIRECTED_REQUEST, "wrong-host", "Wrong host", detail))
    }
}

/// The middleware.
pub async fn guard(State(guard): State<Arc<Guard>>, mut request: Request, next: Next) -> Response {
    let access = access(request.method(), request.uri().path());
    // Of their own: a request that is still read cannot be shared while something is looked up.
    let headers = request.headers().clone();
    let checked = match same_origin(request.method(), &headers) {
        Ok(()) => guard.check(access, &headers).await,
        Err(error) => Err(error),
    };
    match checked {
        Ok(caller) => {
            request.extensions_mut().insert(caller);
            next.run(request).await
        }
        Err(error) => {
            let mut response = error.into_response();
            if response.status() == StatusCode::UNAUTHORIZED {
                let bearer = HeaderValue::from_static("Bearer realm=\"ovtigre\"");
                response.headers_mut().insert(header::WWW_AUTHENTICATE, bearer);
            }
            response
        }
    }
}

/// What changes something is not taken from pages of other origins: a browser would send it unasked.
fn same_origin(method: &Method, headers: &HeaderMap) -> Result<(), ApiError> {
    let Some(origin) = headers.get(header::ORIGIN).filter(|_| !method.is_safe()) else { return Ok(()) };
    let origin = origin.to_str().unwrap_or("");
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
    let its = origin.split_once("://").map(|(_, rest)| rest);
    if its.is_some_and(|its| its.eq_ignore_ascii_case(host)) {
        return Ok(());
    }
    let detail = "this call comes from a page of another origin";
    Err(ApiError::new(StatusCode::FORBIDDEN, "other-origin", "Other origin", detail))
}

/// A host without its port.
fn host_name(host: &str) -> &str {
    match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or(""),
        None => host.rsplit_once(':').map_or(host, |(name, _)| name),
    }
}

/// The hash of the token that was sent.
fn bearer(headers: &HeaderMap) -> Option<BlobId> {
    let text = headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let (scheme, token) = text.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| hash(token.trim()))
}

/// What is kept of a token. Tokens are random, so that a plain hash of them tells nothing.
pub fn hash(token: &str) -> BlobId {
    BlobId::of(*blake3::hash(token.as_bytes()).as_bytes())
}

fn unauthorized(detail: &str) -> ApiError {
    ApiError::new(StatusCode::UNAUTHORIZED, "unauthorized", "Unauthorized", detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_read_with_and_without_ports() {
        for (host, name) in [
            ("localhost:7700", "localhost"),
            ("127.0.0.1", "127.0.0.1"),
            ("[::1]:7700", "::1"),
            ("evil.example:80", "evil.example"),
        ] {
            assert_eq!(host_name(host), name);
        }
    }
}
