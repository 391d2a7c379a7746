//! Delivery: the order of messages, credits, and how far a slow page can fall behind.

use std::time::Duration;

use sim_contract::TornConstraint;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};
use viewer_bridge::limits::{FRAMES_UNACKNOWLEDGED_MAX, SILENCE_MAX};
use viewer_bridge::message::Node;
use viewer_bridge::pages::hub::Formats;
use viewer_bridge::request::{ClientId, Request, RequestKind};
use viewer_bridge::sink::Update;
use viewer_bridge::wire::Format::{F32, U16};
use viewer_bridge::wire::{Scene, frame_flag};

use crate::sockets::support::{Site, wait_for};
use crate::wire_decoder::{Message, decode};

/// Limit on the wait for a request of a page.
const REQUEST_TIMEOUT: Duration = Duration::from_mins(1);

/// The first page.
const PAGE: ClientId = ClientId::Page(1);

fn torn(constraints: &[u32]) -> Vec<TornConstraint> {
    let torn = constraints.iter();
    torn.map(|constraint| TornConstraint::new(*constraint, None)).collect()
}

fn ack(frame: u32) -> String {
    format!(r#"{{"type":"ack","frame":{frame}}}"#)
}

#[test]
fn a_late_page_receives_the_state_in_order() {
    let mut site = Site::start();
    site.publish(&Update::Node(&Node::default()));
    site.begin(2);
    site.shown.set_torn(&site.sinks, 5, &torn(&[3, 1]));
    site.shown.set_torn(&site.sinks, 6, &torn(&[3, 1, 2]));
    let mut page = site.page();
    assert_eq!(page.text()["type"], "node");
    let Message::Scene(scene) = page.binary() else { panic!("no scene") };
    assert_eq!((scene.stamp.epoch, scene.positions.len()), (1, 2));
    let Message::Tear(tear) = page.binary() else { panic!("no tear") };
    assert_eq!((tear.first, tear.constraints()), (0, vec![3, 1, 2]));
    assert_eq!(page.text_with_type("clients")["count"], 1);
}

#[test]
fn tears_come_as_changes_and_a_reset_empties_the_list() {
    let mut site = Site::start();
    let mut page = site.page();
    site.begin(2);
    site.shown.set_torn(&site.sinks, 5, &torn(&[3]));
    site.shown.set_torn(&site.sinks, 6, &torn(&[3, 1]));
    site.shown.set_torn(&site.sinks, 7, &torn(&[]));
    site.shown.set_torn(&site.sinks, 8, &torn(&[2]));
    let mut tears = Vec::new();
    while tears.len() < 4 {
        if let Message::Tear(tear) = page.binary() {
            tears.push((tear.stamp.step, tear.first, tear.constraints()));
        }
    }
    let expected = [(5, 0, vec![3]), (6, 1, vec![1]), (7, 0, vec![]), (8, 0, vec![2])];
    assert_eq!(tears, expected);
}

#[test]
fn a_page_on_a_slow_line_receives_a_scene_that_takes_longer_than_any_silence_may() {
    let mut site = Site::start();
    // Positions without a pattern, which hardly become smaller: two dozen pieces.
    let noise = |index: u32| f32::from_bits(0x3f80_0000 | (index.wrapping_mul(2_654_435_761) >> 9));
    let particle = |index: u32| [0, 1, 2].map(|axis| noise(3 * index + axis));
    let scene = Scene { positions: (0..150_000).map(particle).collect(), ..Scene::default() };
    site.shown.begin_load(&site.sinks, scene);
    let mut page = site.silent_page();
    page.send(r#"{"type":"hello","protocol":3,"parts":true}"#);
    let begin_ns = monotonic_ns();
    let mut bytes = Vec::new();
    loop {
        let Message::Part(part) = page.binary() else { continue };
        assert_eq!((part.kind, part.offset as usize), (1, bytes.len()));
        bytes.extend_from_slice(&part.bytes);
        if bytes.len() == part.size as usize {
            break;
        }
        sleep_until(monotonic_ns() + SECOND_NS * 6 / 10);
    }
    assert!(Duration::from_nanos(monotonic_ns() - begin_ns) > SILENCE_MAX);
    // The page is still connected, and receives frames.
    site.show(7, 1);
    assert_eq!(page.frame().0, 7);
}

#[test]
fn a_page_receives_two_frames_and_then_the_newest_after_an_acknowledgement() {
    let mut site = Site::start();
    let mut page = site.page();
    site.begin(1);
    site.show(1, 1);
    let first = page.frame();
    site.show(2, 1);
    assert_eq!((first.0, page.frame().0), (1, 2));
    // The credit is used up: of the following frames, only the last one waits.
    assert_eq!(site.awaited_formats(1), Formats::default());
    for step in 3..50 {
        site.show(step, 1);
    }
    page.send(&ack(first.1));
    // The page has credit again: the source learns of the demand, and shows its newest frame.
    wait_for("demand", || site.awaited_formats(1).is_any().then_some(()));
    site.show(50, 1);
    assert_eq!(page.frame().0, 50);
}

#[test]
fn a_page_with_the_newest_frame_does_not_request_another() {
    let mut site = Site::start();
    let mut page = site.page();
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::State })
    );
    site.begin(1);
    for step in 1..=FRAMES_UNACKNOWLEDGED_MAX {
        site.show(step.into(), 1);
        assert_eq!(page.frame().1, step);
    }
    page.send(&ack(FRAMES_UNACKNOWLEDGED_MAX));
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::Credit })
    );
    // It does not receive the same frame again when another page needs it.
    site.publish(&Update::SameState);
    site.show(9, 1);
    assert_eq!(page.frame().0, 9);
    assert_eq!(site.requests.next(Duration::ZERO), None);
}

#[test]
fn a_page_that_missed_the_newest_frame_requests_it() {
    let mut site = Site::start();
    let mut slow = site.silent_page();
    slow.send(r#"{"type":"hello","protocol":3,"format":"u16"}"#);
    slow.text_with_type("hello");
    site.begin(1);
    for step in 1..=2 {
        site.show(step, 1);
        assert_eq!(slow.frame().0, step);
    }
    let _quick = site.page();
    site.wait_for_clients(2);
    // No page waits for u16 frames.
    site.show(3, 1);
    while site.requests.next(Duration::ZERO).is_some() {}
    slow.send(&ack(2));
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::Credit })
    );
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::State })
    );
    site.show(3, 1);
    assert_eq!(slow.frame().0, 3);
}

#[test]
fn a_slow_page_is_never_more_than_three_frames_behind() {
    let mut site = Site::start();
    let mut page = site.page();
    site.begin(1);
    let mut step = 0;
    for _ in 0..20 {
        // Five steps pass while the page draws one frame.
        for _ in 0..5 {
            step += 1;
            site.show(step, 1);
        }
        let (shown, number) = page.frame();
        assert!(step - shown <= 15, "step {shown} is shown at step {step}");
        page.send(&ack(number));
        // A frame that was encoded just before the page ran out of credit uses the new credit at once.
        wait_for("credit, or the frame that uses it", || {
            (site.awaited_formats(1).is_any() || page.has_arrivals()).then_some(())
        });
    }
}

#[test]
fn a_frame_never_precedes_its_scene() {
    let mut site = Site::start();
    let mut page = site.page();
    let mut epoch = 0;
    for step in 0..200 {
        site.begin(1);
        site.show(step, 1);
        site.publish(&Update::Reset { step });
        let mut is_over = false;
        while !is_over {
            match page.next().unwrap() {
                tungstenite::Message::Binary(bytes) => match decode(&bytes) {
                    Ok(Message::Scene(scene)) => epoch = scene.stamp.epoch,
                    Ok(Message::Frame(frame)) => {
                        assert!(frame.head.stamp.epoch <= epoch, "frame before scene");
                        page.send(&ack(frame.head.number));
                    }
                    _ => {}
                },
                tungstenite::Message::Text(text) => is_over = text.contains("\"reset\""),
                _ => {}
            }
        }
    }
}

#[test]
fn each_page_receives_its_requested_format() {
    let mut site = Site::start();
    let mut kinds = Vec::new();
    let mut pages = Vec::new();
    for format in ["auto", "f32", "u16"] {
        let mut page = site.silent_page();
        page.send(&format!(r#"{{"type":"hello","protocol":3,"format":"{format}"}}"#));
        assert_eq!(page.text()["format"], format);
        pages.push(page);
    }
    site.begin(1);
    // Exact positions are worth their size while nothing moves.
    let paused = frame_flag::PAUSED;
    for (step, count, flags) in [(1, 10, 0), (2, 5000, 0), (2, 5000, paused), (3, 5000, 0)] {
        site.show_with(step, count, flags);
        for page in &mut pages {
            loop {
                if let Message::Frame(frame) = page.binary() {
                    kinds.push(frame.format);
                    page.send(&ack(frame.head.number));
                    break;
                }
            }
        }
    }
    assert_eq!(kinds, [F32, F32, U16, U16, F32, U16, F32, F32, U16, U16, F32, U16]);
}

#[test]
fn there_is_no_demand_without_pages() {
    let mut site = Site::start();
    assert_eq!(site.awaited_formats(10), Formats::default());
    let page = site.page();
    assert_eq!(site.awaited_formats(10), Formats { f32: true, ..Formats::default() });
    assert_eq!(site.awaited_formats(100_000), Formats { u16: true, ..Formats::default() });
    site.begin(1);
    drop(page);
    site.wait_for_clients(0);
    assert_eq!(site.awaited_formats(10), Formats::default());
}

#[test]
fn the_source_learns_of_pages_that_connect_and_disconnect() {
    let site = Site::start();
    let page = site.page();
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::State })
    );
    // The connection breaks without a close message.
    drop(page);
    assert_eq!(
        site.requests.next(REQUEST_TIMEOUT),
        Some(Request { client: PAGE, kind: RequestKind::Left })
    );
}

#[test]
fn a_page_receives_the_end_of_the_server_as_a_close_code() {
    let site = Site::start();
    let mut page = site.page();
    site.shutdown.begin();
    assert_eq!(page.close_code(), Some(1001));
}
