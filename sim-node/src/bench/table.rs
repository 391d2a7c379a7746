//! The report as text for people.

use super::report::Machine;
use super::report::{LatencyRow, LoopRow, PhaseRow, Report, Wait};
use super::times::Percentiles;
use crate::output::{Align, Table};

/// Header of the columns of [`cells`].
const TIMES: [(&str, Align); 4] =
    [("p50", Align::Right), ("p99", Align::Right), ("p99.9", Align::Right), ("max", Align::Right)];

/// The report as titled tables. Percentiles are in microseconds.
pub(super) fn text(report: &Report) -> String {
    let sections = [
        head(report),
        titled("wake-up lateness of the loop, in µs", &lateness(report)),
        titled("times of a step, in µs", &phases(report)),
        titled("from publication to reception, in µs", &latencies(&report.latencies)),
        titled("from a command to its outcome, in µs", &commands(report)),
        titled("lockstep with one member, as fast as possible, in µs", &lockstep(report)),
    ];
    sections.join("\n")
}

fn titled(title: &str, table: &str) -> String {
    format!("{title}\n{table}")
}

fn head(report: &Report) -> String {
    let Machine { cpu_model, core_count, kernel, clock_source, governor, load_average } =
        &report.machine;
    let known = |text: &Option<String>| text.clone().unwrap_or_else(|| "unknown".to_owned());
    let load = load_average.map_or_else(
        || "unknown".to_owned(),
        |loads| loads.map(|load| format!("{load:.2}")).join(" "),
    );
    let governor = governor.iter().map(|governor| format!(", governor {governor}"));
    let mut text = format!(
        "scene {}, {} particles, {} Hz, {} solver thread(s), {} s for each measurement\n\
         {}, {core_count} cores, Linux {}, clock {}, load average {load}{}\n",
        report.scene,
        report.particle_count,
        report.rate_hz,
        report.thread_count,
        report.duration_s,
        known(cpu_model),
        known(kernel),
        known(clock_source),
        governor.collect::<String>(),
    );
    if report.build == super::report::Build::Debug {
        text.push_str(
            "This is a debug build, which is slower: measure with `cargo run --release`.\n",
        );
    }
    text
}

fn lateness(report: &Report) -> String {
    let [p50, p99, p999, max] = TIMES;
    let ratio = |title| (title, Align::Right);
    let loop_title = ("loop", Align::Left);
    let mut table =
        Table::new([loop_title, p50, p99, p999, max, ratio("p50 / bare"), ratio("p99 / bare")]);
    let mut add = |name: String, times, ratios: [Option<f64>; 2]| {
        let [p50, p99, p999, max] = cells(times);
        let ratios = ratios.map(|ratio| ratio.map_or_else(String::new, |one| format!("{one:.2}")));
        let [ratio_p50, ratio_p99] = ratios;
        table.add([name, p50, p99, p999, max, ratio_p50, ratio_p99]);
    };
    add("bare".to_owned(), report.bare_loop, [None, None]);
    for row in &report.loops {
        let LoopRow { reader_count, wake_late_ratio_p50, wake_late_ratio_p99, .. } = row;
        let ratios = [*wake_late_ratio_p50, *wake_late_ratio_p99];
        add(format!("node, {}", readers(*reader_count)), row.wake_late, ratios);
    }
    table.text()
}

fn phases(report: &Report) -> String {
    let [p50, p99, p999, max] = TIMES;
    let mut table =
        Table::new([("readers", Align::Right), ("phase", Align::Left), p50, p99, p999, max]);
    for row in &report.loops {
        let PhaseRow { drain, solve, publish, wake, keep, observe, outside_solver } = row.phases;
        let named = [
            ("drain", drain),
            ("solve", solve),
            ("publish", publish),
            ("wake", wake),
            ("keep", keep),
            ("observe", observe),
            ("outside solver", outside_solver),
        ];
        for (name, times) in named {
            let [p50, p99, p999, max] = cells(times);
            table.add([row.reader_count.to_string(), name.to_owned(), p50, p99, p999, max]);
        }
    }
    table.text()
}

fn latencies(rows: &[LatencyRow]) -> String {
    let [p50, p99, p999, max] = TIMES;
    let mut table = Table::new([
        ("readers", Align::Right),
        ("wait", Align::Left),
        p50,
        p99,
        p999,
        max,
        ("received", Align::Right),
        ("missed", Align::Right),
    ]);
    for row in rows {
        let [p50, p99, p999, max] = cells(row.latency);
        let wait = match row.wait {
            Wait::Event => "event",
            Wait::Poll => "poll",
        };
        table.add([
            row.reader_count.to_string(),
            wait.to_owned(),
            p50,
            p99,
            p999,
            max,
            row.latency.count.to_string(),
            row.missed_count.to_string(),
        ]);
    }
    table.text()
}

fn commands(report: &Report) -> String {
    let [p50, p99, p999, max] = TIMES;
    let mut table =
        Table::new([("node", Align::Left), p50, p99, p999, max, ("commands", Align::Right)]);
    for row in &report.commands {
        let [p50, p99, p999, max] = cells(row.round_trip);
        let count = row.round_trip.count.to_string();
        table.add([row.node.text().to_owned(), p50, p99, p999, max, count]);
    }
    table.text()
}

fn lockstep(report: &Report) -> String {
    let [p50, p99, p999, max] = TIMES;
    let mut table = Table::new([("steps per second", Align::Left), p50, p99, p999, max]);
    let [p50, p99, p999, max] = cells(report.lockstep.round_trip);
    table.add([format!("{:.0}", report.lockstep.steps_per_s), p50, p99, p999, max]);
    table.text()
}

/// Number of readers as text.
pub(super) fn readers(count: usize) -> String {
    format!("{count} reader{}", if count == 1 { "" } else { "s" })
}

/// Percentiles in microseconds.
fn cells(times: Percentiles) -> [String; 4] {
    let Percentiles { p50_ns, p99_ns, p999_ns, max_ns, .. } = times;
    [p50_ns, p99_ns, p999_ns, max_ns].map(|time_ns| format!("{:.1}", time_ns as f64 / 1000.0))
}
