//! The admission of requests: the check of Host and Origin on every request, and the token.
//!
//! A browser lets any page open a WebSocket to any host and sends only its Origin along. This check is
//! all that keeps foreign pages out. The check of Host stops foreign names that resolve to this host
//! (DNS rebinding).

use std::hint::black_box;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use thiserror::Error;

/// The headers of every response.
const HEADERS: [(HeaderName, HeaderValue); 7] = [
    (
        header::CONTENT_SECURITY_POLICY,
        HeaderValue::from_static(
            "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
             img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; \
             frame-ancestors 'none'",
        ),
    ),
    (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (
        HeaderName::from_static("cross-origin-opener-policy"),
        HeaderValue::from_static("same-origin"),
    ),
    (
        HeaderName::from_static("cross-origin-resource-policy"),
        HeaderValue::from_static("same-origin"),
    ),
    (header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
    (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
];

/// The admission rules of one server.
#[derive(Debug, Clone)]
pub(crate) struct Guard {
    address: SocketAddr,
    /// Names of this host besides its addresses.
    names: Vec<String>,
    /// Secret that a page must know.
    token: Option<String>,
    /// Admitted origins; `None` admits the origins of this server's own pages.
    origins: Option<Vec<String>>,
}

/// The servers whose pages must know a token.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TokenDemand {
    /// Those that other machines can reach.
    #[default]
    BeyondLoopback,
    /// Those on loopback as well.
    Always,
}

/// The reason for which a request is denied.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum Denied {
    /// The request is meant for a host of another name.
    #[error("this host is not allowed here")]
    ForeignHost,
    /// The request comes from a page of another origin.
    #[error("the origin {origin} is not allowed here")]
    ForeignOrigin {
        /// The origin.
        origin: String,
    },
    /// The request comes from a page, and only the named origins are admitted.
    #[error("the origin {origin} is not allowed here; see --foxglove-origin")]
    UnnamedOrigin {
        /// The origin.
        origin: String,
    },
}

impl Guard {
    /// Creates the rules of a server with pages. A server that does not listen on loopback always
    /// demands a token.
    ///
    /// # Errors
    /// The system provides no random numbers.
    pub(crate) fn new(
        address: SocketAddr,
        names: Vec<String>,
        demand: TokenDemand,
    ) -> Result<Self, getrandom::Error> {
        let is_demanded = demand == TokenDemand::Always || !address.ip().is_loopback();
        let token = if is_demanded {
            Some(format!("{:016x}{:016x}", getrandom::u64()?, getrandom::u64()?))
        } else {
            None
        };
        Ok(Self { address, names, token, origins: None })
    }

    /// Creates the rules of a server on loopback without pages. It admits programs, which send no
    /// origin, and pages of these origins.
    pub(crate) fn for_origins(address: SocketAddr, origins: Vec<String>) -> Self {
        Self { address, names: Vec::new(), token: None, origins: Some(origins) }
    }

    /// Address by which a browser reaches the server: a name of the host if it has one, otherwise an
    /// address that other machines can reach where the server listens at all of them.
    pub(crate) fn reachable_authority(&self) -> String {
        let port = self.address.port();
        if !self.address.ip().is_unspecified() {
            return self.address.to_string();
        }
        match (self.names.first(), local_address(self.address.ip())) {
            (Some(name), _) => format!("{name}:{port}"),
            (None, Some(address)) => SocketAddr::new(address, port).to_string(),
            (None, None) => self.address.to_string(),
        }
    }

    /// The token, where one is demanded.
    pub(crate) fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Returns whether a first message with this token is accepted.
    pub(crate) fn accepts(&self, token: Option<&str>) -> bool {
        match &self.token {
            None => true,
            Some(own) => token.is_some_and(|token| is_same(own.as_bytes(), token.as_bytes())),
        }
    }

    /// Checks the headers of a request.
    pub(crate) fn admit(&self, headers: &HeaderMap) -> Result<(), Denied> {
        let host = single(headers, &header::HOST).filter(|host| self.is_own(host));
        let host = host.ok_or(Denied::ForeignHost)?;
        if !headers.contains_key(header::ORIGIN) {
            // A program, or a plain request for a file.
            return Ok(());
        }
        let origin = single(headers, &header::ORIGIN).unwrap_or("?");
        let own_origin = origin.strip_prefix("http://");
        match &self.origins {
            Some(allowed) if allowed.iter().any(|one| one == origin) => Ok(()),
            Some(_) => Err(Denied::UnnamedOrigin { origin: origin.to_owned() }),
            None if own_origin.is_some_and(|own| self.is_same_origin(own, host)) => Ok(()),
            None => Err(Denied::ForeignOrigin { origin: origin.to_owned() }),
        }
    }

    /// Returns whether only programs of this host can connect.
    pub(crate) fn is_local(&self) -> bool {
        self.address.ip().is_loopback()
    }

    /// Returns whether a page at `origin` is one of this server's, when its browser calls the server
    /// `host`.
    fn is_same_origin(&self, origin: &str, host: &str) -> bool {
        if self.is_local() { self.is_own(origin) } else { origin.eq_ignore_ascii_case(host) }
    }

    /// Returns whether `authority` is this server: a name or address, and the port unless it is 80.
    fn is_own(&self, authority: &str) -> bool {
        let (name, port) = match authority.rsplit_once(':') {
            Some((name, port)) if !port.contains(']') => (name, port.parse().ok()),
            _ => (authority, Some(80)),
        };
        if port != Some(self.address.port()) {
            return false;
        }
        let address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        if let Ok(address) = address {
            // A page cannot redirect an address, so every address is allowed where the server can
            // have several.
            return !self.is_local() || address.is_loopback();
        }
        name.eq_ignore_ascii_case("localhost")
            || self.names.iter().any(|own| name.eq_ignore_ascii_case(own))
    }
}

/// Puts a guard in front of every route, known path or not, and adds the headers to every response.
pub(crate) fn guarded(router: Router, guard: Arc<Guard>) -> Router {
    router.layer(middleware::from_fn_with_state(guard, check))
}

async fn check(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    let mut response = match guard.admit(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(denied) => (StatusCode::FORBIDDEN, format!("{denied}\n")).into_response(),
    };
    response.headers_mut().extend(HEADERS);
    response
}

/// Returns the value of a header that occurs exactly once.
fn single<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (Some(value), None) => value.to_str().ok(),
        _ => None,
    }
}

/// Compares in a time that depends only on the lengths, which are not secret.
fn is_same(own: &[u8], other: &[u8]) -> bool {
    own.len() == other.len()
        && black_box(own.iter().zip(other).fold(0, |all, (a, b)| black_box(all | (a ^ b)))) == 0
}

/// Addresses in the networks that are reserved for documents. The system chooses the own address for a
/// way there, as for any address far away.
const FAR_V4: IpAddr = IpAddr::V4(Ipv4Addr::new(198, 51, 100, 1));
const FAR_V6: IpAddr = IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1));
/// Any port: nothing is sent.
const PORT: u16 = 9;

/// Returns the own address on the way to other networks, for a server that listens at all addresses of
/// the family of `listen`. Returns `None` without a way there.
pub(super) fn local_address(listen: IpAddr) -> Option<IpAddr> {
    // A server at all addresses of IPv6 also accepts IPv4, which more people can type.
    let families: &[IpAddr] = if listen.is_ipv4() { &[FAR_V4] } else { &[FAR_V4, FAR_V6] };
    families.iter().find_map(|far| address_towards(*far))
}

/// The system chooses the own address of a socket when it is connected. A datagram socket sends nothing
/// for that.
fn address_towards(far: IpAddr) -> Option<IpAddr> {
    let any = match far {
        IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::UNSPECIFIED),
        IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::UNSPECIFIED),
    };
    let socket = UdpSocket::bind((any, 0)).ok()?;
    socket.connect((far, PORT)).ok()?;
    let own = socket.local_addr().ok()?.ip();
    (!own.is_unspecified() && !own.is_loopback()).then_some(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str) -> Guard {
        let names = vec!["lab".to_owned()];
        Guard::new(address.parse().unwrap(), names, TokenDemand::BeyondLoopback).unwrap()
    }

    fn admits(guard: &Guard, host: &str, origin: Option<&str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        guard.admit(&headers).is_ok()
    }

    #[test]
    fn on_loopback_only_names_of_loopback_are_admitted() {
        let guard = guard("127.0.0.1:8080");
        for host in ["127.0.0.1:8080", "localhost:8080", "[::1]:8080", "LOCALHOST:8080", "lab:8080"]
        {
            assert!(admits(&guard, host, None), "{host}");
            assert!(admits(&guard, host, Some("http://127.0.0.1:8080")), "{host}");
        }
        for host in ["evil.example:8080", "127.0.0.1:8081", "127.0.0.1", "10.0.0.1:8080", ""] {
            assert!(!admits(&guard, host, None), "{host}");
        }
        for origin in
            ["null", "http://evil.example", "http://127.0.0.1:1", "https://127.0.0.1:8080", ""]
        {
            assert!(!admits(&guard, "127.0.0.1:8080", Some(origin)), "{origin}");
        }
    }

    #[test]
    fn a_request_with_two_hosts_or_none_is_refused() {
        let guard = guard("127.0.0.1:80");
        let mut headers = HeaderMap::new();
        assert!(guard.admit(&headers).is_err());
        headers.append(header::HOST, HeaderValue::from_static("localhost"));
        assert!(guard.admit(&headers).is_ok());
        headers.append(header::HOST, HeaderValue::from_static("localhost"));
        assert!(guard.admit(&headers).is_err());
    }

    #[test]
    fn beyond_loopback_a_token_is_demanded_and_the_origin_must_be_the_host() {
        let guard = guard("0.0.0.0:8080");
        assert!(admits(&guard, "10.0.0.7:8080", Some("http://10.0.0.7:8080")));
        assert!(!admits(&guard, "10.0.0.7:8080", Some("http://10.0.0.8:8080")));
        assert!(!admits(&guard, "evil.example:8080", None));
        let token = guard.token().unwrap().to_owned();
        assert_eq!(token.len(), 32);
        assert!(guard.accepts(Some(&token)));
        assert!(
            !guard.accepts(None) && !guard.accepts(Some("")) && !guard.accepts(Some(&token[1..]))
        );
        assert!(!guard.accepts(Some(&token.replace(&token[..1], "g"))));
        assert!(self::guard("[::1]:8080").accepts(None));
    }

    #[test]
    fn on_loopback_a_token_can_be_demanded_and_foreign_hosts_stay_out() {
        let address = "127.0.0.1:8080".parse().unwrap();
        let guard = Guard::new(address, Vec::new(), TokenDemand::Always).unwrap();
        let token = guard.token().unwrap().to_owned();
        assert!(guard.accepts(Some(&token)) && !guard.accepts(None));
        assert!(guard.is_local());
        assert!(admits(&guard, "localhost:8080", Some("http://127.0.0.1:8080")));
        assert!(!admits(&guard, "10.0.0.7:8080", None));
        assert!(!admits(&guard, "127.0.0.1:8080", Some("http://evil.example")));
    }

    #[test]
    fn the_printed_address_can_be_reached() {
        assert_eq!(guard("127.0.0.1:8080").reachable_authority(), "127.0.0.1:8080");
        assert_eq!(guard("10.0.0.7:8080").reachable_authority(), "10.0.0.7:8080");
        // A name is best where one is given.
        assert_eq!(guard("0.0.0.0:8080").reachable_authority(), "lab:8080");
        let address = "0.0.0.0:8080".parse().unwrap();
        let unnamed = Guard::new(address, Vec::new(), TokenDemand::BeyondLoopback).unwrap();
        let printed: SocketAddr = unnamed.reachable_authority().parse().unwrap();
        // Only a host without a network has no address to offer.
        let own = local_address(address.ip());
        assert_eq!(printed.ip().is_unspecified(), own.is_none());
        assert!(own.is_none_or(|own| printed == SocketAddr::new(own, 8080)));
        assert!(admits(&unnamed, &printed.to_string(), Some(&format!("http://{printed}"))));
    }

    #[test]
    fn with_named_origins_only_these_and_programs_are_admitted() {
        let address = "127.0.0.1:8765".parse().unwrap();
        let guard = Guard::for_origins(address, vec!["https://viewer.example".to_owned()]);
        assert!(admits(&guard, "127.0.0.1:8765", None));
        assert!(admits(&guard, "localhost:8765", Some("https://viewer.example")));
        for origin in
            ["null", "http://evil.example", "http://127.0.0.1:8765", "http://viewer.example"]
        {
            assert!(!admits(&guard, "127.0.0.1:8765", Some(origin)), "{origin}");
        }
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_static("127.0.0.1:8765"));
        headers.insert(header::ORIGIN, HeaderValue::from_static("http://evil.example"));
        let denied = guard.admit(&headers).unwrap_err().to_string();
        assert!(denied.contains("http://evil.example"), "{denied}");
        assert!(denied.contains("--foxglove-origin"), "{denied}");
    }
}
