//! `doctor`: checks of a domain and of this host.

mod clocks;
mod config_files;
mod finding;
mod leftovers;
mod limits;
mod permissions;

use std::fs;
use std::path::Path;

use serde::Serialize;
use sim_contract::{ConfigFile, Domain, Endpoint};
use sim_solver::Solver;

use crate::args::DoctorArgs;
use crate::node::shared_memory_bytes;
use crate::output::Exit;
use crate::output::{Align, Table};
use crate::{output, scene_source};
use config_files::{Place, User};
use finding::{Finding, Level};
use limits::Capability;

/// Result of all checks in JSON.
#[derive(Serialize)]
struct Report {
    domain: Option<String>,
    prefix: String,
    root: String,
    problems: usize,
    findings: Vec<Finding>,
}

/// Prints the findings, or a configuration file. Fails if there is a problem.
pub(crate) fn doctor(args: &DoctorArgs) -> anyhow::Result<Exit> {
    let endpoint = args.domain.endpoint()?;
    let domain = Domain::new(&endpoint)?;
    if args.iox2_config {
        return print_config(&endpoint, &domain).map(|()| Exit::Done);
    }
    let scene = scene_source::load(&args.scene)?;
    let needed_bytes = shared_memory_bytes(&scene, &Solver::new(&scene));
    let mut findings = check_domain(args, &endpoint, &domain);
    findings.extend(check_limits(&scene.name, needed_bytes));
    findings.extend(check_clocks());
    let problem_count = findings.iter().filter(|one| one.level == Level::Problem).count();
    let report = Report {
        domain: endpoint.domain().map(ToOwned::to_owned),
        prefix: domain.prefix(),
        root: domain.root().display().to_string(),
        problems: problem_count,
        findings,
    };
    if args.json { output::json(&report) } else { output::text(&text(&report)) }?;
    Ok(if problem_count == 0 { Exit::Done } else { Exit::Failed })
}

fn print_config(endpoint: &Endpoint, domain: &Domain) -> anyhow::Result<()> {
    let name = endpoint
        .domain()
        .map_or("the default domain".to_owned(), |name| format!("the domain '{name}'"));
    let config = domain.iceoryx2_toml();
    output::file(&format!(
        "# Configuration of iceoryx2 for {name} of Catenary. As config/iceoryx2.toml in the current folder,\n\
         # or as ~/.config/iceoryx2/iceoryx2.toml, it shows the services of the domain to `iox2` and to other\n\
         # programs of iceoryx2.\n\n{config}"
    ))
}

fn check_domain(args: &DoctorArgs, endpoint: &Endpoint, domain: &Domain) -> Vec<Finding> {
    let mut findings = vec![
        permissions::root(&domain.root(), domain.check_root()),
        permissions::path_length(domain.path_excess()),
        permissions::shared_memory(Path::new("/dev/shm")),
    ];
    findings.extend(check_leftovers(args, endpoint, domain));
    let paths = ConfigFile { prefix: domain.prefix(), root: domain.root() };
    let place = Place { domain: endpoint.domain().map(ToOwned::to_owned), paths };
    let files = config_files::candidates(this_user().home.as_deref());
    findings.extend(config_files::check(&files, &place));
    findings
}

fn check_leftovers(args: &DoctorArgs, endpoint: &Endpoint, domain: &Domain) -> Vec<Finding> {
    let before = domain.leftovers();
    let option = endpoint.domain().map(|name| format!(" --domain {name}")).unwrap_or_default();
    let fix = format!("sim-node doctor{option} --fix");
    if !args.fix || before.is_empty() {
        return leftovers::check(&before, 0, &fix);
    }
    let removed = domain.remove_leftovers();
    let after = domain.leftovers();
    let mut findings = leftovers::check(&after, before.len().saturating_sub(after.len()), &fix);
    if let Err(error) = removed {
        findings.push(Finding::problem("leftovers", format!("they cannot be removed: {error}")));
    }
    findings
}

fn check_limits(scene: &str, needed_bytes: u64) -> [Finding; 4] {
    use rustix::process::{Resource, getrlimit};
    let limit = |resource| getrlimit(resource).current;
    let status = read("/proc/self/status");
    let has = |capability| limits::has_capability(&status, capability);
    let user = this_user().name;
    [
        limits::shared_memory(scene, needed_bytes, Domain::free_memory_bytes()),
        limits::open_files(limit(Resource::Nofile)),
        limits::real_time(limit(Resource::Rtprio), has(Capability::Prioritize), &user),
        limits::locked_memory(
            limit(Resource::Memlock),
            has(Capability::LockMemory),
            needed_bytes,
            &user,
        ),
    ]
}

fn check_clocks() -> [Finding; 3] {
    let clock_source = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    [
        clocks::clock_source(Path::new(clock_source)),
        clocks::governors(Path::new("/sys/devices/system/cpu")),
        clocks::timer_slack(Path::new("/proc/self/timerslack_ns")),
    ]
}

fn this_user() -> User {
    User::find(&read("/etc/passwd"), rustix::process::geteuid().as_raw())
}

/// Returns the text of a file of the system; an empty one if it cannot be read.
fn read(path: &str) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

fn text(report: &Report) -> String {
    let mut table = Table::new([("", Align::Left), ("check", Align::Left), ("", Align::Left)]);
    for finding in &report.findings {
        table.add([
            finding.level.name().to_owned(),
            finding.check.to_owned(),
            finding.text.clone(),
        ]);
        if let Some(cure) = &finding.cure {
            table.add([String::new(), String::new(), format!("cure: {cure}")]);
        }
    }
    let text = table.text();
    let count = report.problems;
    let plural = if count == 1 { "" } else { "s" };
    let summary =
        if count == 0 { "no problems".to_owned() } else { format!("{count} problem{plural}") };
    format!("{text}{summary}\n")
}
