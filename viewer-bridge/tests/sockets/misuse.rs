//! Misuse: a page that violates the protocol is disconnected with a reason, and other pages are not
//! affected.

use std::io::Read;
use std::net::TcpStream;
use std::time::Duration;

use serde_json::json;
use tungstenite::Message;
use viewer_bridge::message::{Command, Level};
use viewer_bridge::request::RequestKind;
use viewer_bridge::sink::Update;

use crate::sockets::support::{Site, wait_for};

#[test]
fn a_first_message_other_than_hello_ends_the_connection() {
    let site = Site::start();
    for (text, code) in [
        ("", 4400),
        ("hello", 4400),
        (r#"{"kind":"pause"}"#, 4400),
        (r#"{"type":"hello"}"#, 4400),
        (r#"{"type":"hello","protocol":1}"#, 4426),
    ] {
        let mut page = site.silent_page();
        page.send(text);
        assert_eq!(page.close_code(), Some(code), "{text}");
    }
    assert_eq!(site.hub.client_count(), 0);
}

#[test]
fn a_malformed_message_ends_the_connection() {
    let site = Site::start();
    for text in [
        "{",
        "[]",
        r#"{"type":"dance"}"#,
        r#"{"kind":"dance"}"#,
        r#"{"kind":"release","particle":1,"force":true}"#,
        r#"{"kind":"pin","particle":1,"colour":2}"#,
        r#"{"kind":"move","particle":1,"target":["much",0,0]}"#,
        r#"{"type":"hello","protocol":3}"#,
    ] {
        let mut page = site.page();
        page.send(text);
        assert_eq!(page.close_code(), Some(4400), "{text}");
    }
    let mut page = site.page();
    page.socket.send(Message::binary(vec![1, 2, 3])).unwrap();
    assert_eq!(page.close_code(), Some(4400));
    site.wait_for_clients(0);
}

#[test]
fn a_message_that_is_too_long_ends_the_connection() {
    let site = Site::start();
    let mut other = site.page();
    let mut page = site.page();
    let text = format!(r#"{{"kind":"load","scene":"{}"}}"#, "x".repeat(64 << 10));
    // The server may close the connection before all of it is sent.
    let _sent = page.socket.send(Message::text(text));
    let code = page.close_code();
    assert!(code.is_none_or(|code| code == 1009), "{code:?}");
    site.wait_for_clients(1);
    site.publish(&Update::Reset { step: 1 });
    assert_eq!(other.text_with_type("reset")["step"], 1);
}

#[test]
fn a_flood_ends_the_connection() {
    let site = Site::start();
    let mut page = site.page();
    for _ in 0..1000 {
        // The server may have closed the connection already.
        if page.socket.send(Message::text(r#"{"kind":"pause"}"#)).is_err() {
            break;
        }
    }
    assert_eq!(page.close_code(), Some(4429));
    site.wait_for_clients(0);
}

#[test]
fn a_value_out_of_range_is_rejected_and_the_page_stays_connected() {
    let site = Site::start();
    let mut page = site.page();
    page.send(r#"{"kind":"grab","particle":1,"target":[0,1e8,0],"id":5}"#);
    let outcome = page.text_with_type("outcome");
    assert_eq!(
        outcome,
        json!({
            "type": "outcome", "id": 5, "kind": "grab", "status": "rejected", "step": null,
            "applied": 0, "rejected": 1, "reason": "out_of_range",
            "text": "a value is out of its range",
        })
    );
    page.send(r#"{"kind":"move","particle":1,"target":["nan",0,0],"id":7}"#);
    assert_eq!(page.text_with_type("outcome")["reason"], "non_finite");
    page.send(r#"{"kind":"pin","particle":1,"id":6}"#);
    wait_for("the command", || {
        let request = site.requests.next(Duration::ZERO)?;
        matches!(request.kind, RequestKind::Command(Command { id: Some(6), .. })).then_some(())
    });
}

#[test]
fn silent_connections_are_closed() {
    let site = Site::start();
    // A connection without a request, a socket without a message, and a page that answers no pings.
    let mut head = TcpStream::connect(site.address).unwrap();
    let mut silent = site.silent_page();
    let half_open = site.page();
    assert_eq!(silent.close_code(), Some(4408));
    head.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    let mut rest = Vec::new();
    head.read_to_end(&mut rest).unwrap();
    site.wait_for_clients(0);
    drop(half_open);
}

#[test]
fn a_page_that_leaves_reliable_messages_unread_is_disconnected_and_others_receive_all() {
    let site = Site::start();
    let mut reader = site.page();
    let _stalled = site.page();
    // More than the socket buffers and the queue can hold.
    let text = "x".repeat(64 << 10);
    for _ in 0..1000 {
        site.publish(&Update::Notice { level: Level::Info, text: &text });
        assert_eq!(reader.text_with_type("notice")["text"], text);
    }
    assert_eq!(site.hub.client_count(), 1);
}
