//! Who may talk to the server: the check of Host and Origin on every request, and the token.
//!
//! A browser lets any page open a WebSocket to any host and tells only its Origin: this check is all
//! that keeps other pages out. The check of Host keeps out names that were made to point here.

use std::hint::black_box;
use std::net::{IpAddr, SocketAddr};

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

/// What every answer carries.
pub(crate) const HEADERS: [(HeaderName, HeaderValue); 7] = [
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

/// The rules of one server.
#[derive(Debug, Clone)]
pub(crate) struct Guard {
    address: SocketAddr,
    /// Names by which it may be called beside its addresses.
    names: Vec<String>,
    /// What a page has to know where anybody could reach the server.
    token: Option<String>,
    /// Origins that are let in; none: those of this server's own pages.
    origins: Option<Vec<String>>,
}

/// Whether a request is let in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It is.
    Granted,
    /// It is meant for a host of another name.
    ForeignHost,
    /// It comes from a page that has no business here.
    ForeignOrigin,
}

impl Guard {
    /// The rules of a server at that address. Elsewhere than on loopback it has a token.
    ///
    /// # Errors
    /// The system gives no random number.
    pub(crate) fn new(address: SocketAddr, names: Vec<String>) -> Result<Self, getrandom::Error> {
        let token = if address.ip().is_loopback() {
            None
        } else {
            Some(format!("{:016x}{:016x}", getrandom::u64()?, getrandom::u64()?))
        };
        Ok(Self { address, names, token, origins: None })
    }

    /// The rules of a server on loopback that has no pages: only those of these origins, and programs,
    /// which have none, are let in.
    pub(crate) fn for_origins(address: SocketAddr, origins: Vec<String>) -> Self {
        Self { address, names: Vec::new(), token: None, origins: Some(origins) }
    }

    /// The token, where there has to be one.
    pub(crate) fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Whether a first message with that token is let in.
    pub(crate) fn accepts(&self, token: Option<&str>) -> bool {
        match &self.token {
            None => true,
            Some(own) => token.is_some_and(|token| is_same(own.as_bytes(), token.as_bytes())),
        }
    }

    /// Whether a request with these headers is let in.
    pub(crate) fn admits(&self, headers: &HeaderMap) -> bool {
        self.admission(headers) == Admission::Granted
    }

    /// The same, with what is wrong.
    pub(crate) fn admission(&self, headers: &HeaderMap) -> Admission {
        let Some(host) = single(headers, &header::HOST).filter(|host| self.is_own(host)) else {
            return Admission::ForeignHost;
        };
        if !headers.contains_key(header::ORIGIN) {
            // No browser, or a plain request for a file.
            return Admission::Granted;
        }
        let is_allowed = single(headers, &header::ORIGIN).is_some_and(|origin| {
            match (&self.origins, origin.strip_prefix("http://")) {
                (Some(allowed), _) => allowed.iter().any(|one| one == origin),
                (None, Some(origin)) if self.token.is_none() => self.is_own(origin),
                (None, Some(origin)) => origin.eq_ignore_ascii_case(host),
                (None, None) => false,
            }
        });
        if is_allowed { Admission::Granted } else { Admission::ForeignOrigin }
    }

    /// Whether that is this server: a name or address, and the port unless it is the usual one.
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
            // A page cannot make an address point elsewhere; so elsewhere than on loopback, where
            // the server may have several, every one is allowed.
            return self.token.is_some() || address.is_loopback();
        }
        name.eq_ignore_ascii_case("localhost")
            || self.names.iter().any(|own| name.eq_ignore_ascii_case(own))
    }
}

/// The value of a header that stands exactly once.
fn single<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (Some(value), None) => value.to_str().ok(),
        _ => None,
    }
}

/// Compares without telling by its duration how much is right; the length is no secret.
fn is_same(own: &[u8], other: &[u8]) -> bool {
    own.len() == other.len()
        && black_box(own.iter().zip(other).fold(0, |all, (a, b)| black_box(all | (a ^ b)))) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str) -> Guard {
        Guard::new(address.parse().unwrap(), vec!["lab".to_owned()]).unwrap()
    }

    fn admits(guard: &Guard, host: &str, origin: Option<&str>) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        guard.admits(&headers)
    }

    #[test]
    fn on_loopback_only_names_of_loopback_are_let_in() {
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
    fn two_hosts_or_none_are_refused() {
        let guard = guard("127.0.0.1:80");
        let mut headers = HeaderMap::new();
        assert!(!guard.admits(&headers));
        headers.append(header::HOST, HeaderValue::from_static("localhost"));
        assert!(guard.admits(&headers));
        headers.append(header::HOST, HeaderValue::from_static("localhost"));
        assert!(!guard.admits(&headers));
    }

    #[test]
    fn elsewhere_a_token_is_demanded_and_the_origin_is_the_host() {
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
}
