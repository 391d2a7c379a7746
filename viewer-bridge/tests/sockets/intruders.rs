//! Access control: Host and Origin of every request, the token, and the limit on pages.

use tungstenite::Message;
use tungstenite::http::{HeaderValue, header};
use viewer_bridge::TokenDemand;
use viewer_bridge::limits::VISITORS_MAX;
use viewer_bridge::sink::Update;

use crate::sockets::support::{Site, wait_for};

#[test]
fn a_socket_of_a_foreign_page_is_refused() {
    let site = Site::start();
    for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://127.0.0.1:1"] {
        let refused = site.open(site.request(Some(origin))).err();
        assert_eq!(refused, Some(403), "{origin}");
    }
    let own = format!("http://{}", site.address);
    let localhost = format!("http://localhost:{}", site.address.port());
    for origin in [None, Some(own.as_str()), Some(localhost.as_str())] {
        assert!(site.open(site.request(origin)).is_ok(), "{origin:?}");
    }
}

#[test]
fn a_foreign_host_is_refused_on_every_path() {
    let site = Site::start();
    let mut request = site.request(None);
    let foreign = HeaderValue::from_static("evil.example");
    request.headers_mut().insert(header::HOST, foreign);
    assert_eq!(site.open(request).err(), Some(403));
    for path in ["/", "/index.html", "/socket", "/nothing", "/../secret"] {
        let request =
            format!("GET {path} HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n");
        assert!(site.answer(&request).starts_with("http/1.1 403"), "{path}");
        let without = format!("GET {path} HTTP/1.1\r\nConnection: close\r\n\r\n");
        let answer = site.answer(&without);
        assert!(answer.starts_with("http/1.1 40"), "{path}: {answer}");
    }
}

#[test]
fn every_answer_has_the_security_headers() {
    let site = Site::start();
    for (path, status) in [("/", "200"), ("/nothing", "404"), ("/%2e%2e/Cargo.toml", "404")] {
        let host = site.address;
        let answer = site
            .answer(&format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"));
        assert!(answer.starts_with(&format!("http/1.1 {status}")), "{path}: {answer}");
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "frame-ancestors 'none'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cross-origin-opener-policy: same-origin",
            "cross-origin-resource-policy: same-origin",
            "cache-control: no-cache",
        ] {
            assert!(answer.contains(line), "{path} lacks {line}: {answer}");
        }
    }
}

/// Checks that a server accepts only pages with the token in its address.
fn check_token(site: &Site) {
    let token = site.url.split_once("#token=").unwrap().1.to_owned();
    for hello in [
        r#"{"type":"hello","protocol":3}"#.to_owned(),
        r#"{"type":"hello","protocol":3,"token":"0123456789abcdef0123456789abcdef"}"#.to_owned(),
        format!(r#"{{"type":"hello","protocol":3,"token":"{}"}}"#, &token[..31]),
    ] {
        let mut page = site.silent_page();
        page.send(&hello);
        assert_eq!(page.close_code(), Some(4401), "{hello}");
    }
    let mut page = site.silent_page();
    page.send(&format!(r#"{{"type":"hello","protocol":3,"token":"{token}"}}"#));
    assert_eq!(page.text()["type"], "hello");
}

#[test]
fn the_token_is_required_on_other_addresses_than_loopback() {
    let site = Site::listen("0.0.0.0:0");
    check_token(&site);
    // A browser on another machine cannot open the address that the server listens at.
    assert!(!site.url.contains("//0.0.0.0") || !has_network(), "{}", site.url);
}

/// Returns whether this host has an address besides loopback on the way to other networks.
fn has_network() -> bool {
    let socket = std::net::UdpSocket::bind("0.0.0.0:0").unwrap();
    socket.connect("203.0.113.1:9").is_ok()
}

#[test]
fn on_loopback_the_token_is_required_only_on_demand() {
    assert!(!Site::start().url.contains('#'));
    let site = Site::with_token("127.0.0.1:0", TokenDemand::Always);
    assert!(site.url.starts_with("http://127.0.0.1:"), "{}", site.url);
    check_token(&site);
}

#[test]
fn the_seventeenth_page_is_refused_until_another_page_disconnects() {
    let site = Site::start();
    let mut pages: Vec<_> = (0..16).map(|_| site.page()).collect();
    assert_eq!(site.greeting_page().close_code(), Some(1013));
    drop(pages.pop());
    site.wait_for_clients(15);
    wait_for("a free slot", || match site.greeting_page().next() {
        Ok(Message::Text(_)) => Some(()),
        _ => None,
    });
}

#[test]
fn silent_sockets_do_not_count_against_the_limit_on_pages() {
    let site = Site::start();
    let silent: Vec<_> = (0..40).map(|_| site.silent_page()).collect();
    let pages: Vec<_> = (0..16).map(|_| site.page()).collect();
    assert_eq!(site.greeting_page().close_code(), Some(1013));
    assert_eq!((silent.len(), pages.len()), (40, 16));
}

#[test]
fn the_oldest_silent_sockets_make_room_and_pages_stay() {
    let site = Site::start();
    let mut page = site.page();
    let mut silent: Vec<_> = (0..3 * VISITORS_MAX).map(|_| site.silent_page()).collect();
    let mut newcomer = site.page();
    site.publish(&Update::Reset { step: 3 });
    for page in [&mut page, &mut newcomer] {
        assert_eq!(page.text_with_type("reset")["step"], 3);
    }
    assert_eq!(silent[0].close_code(), Some(1013));
}
