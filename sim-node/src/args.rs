//! The command line. Help texts are the doc comments.

mod bench;
mod command;
mod ctl;
mod endpoint;
mod run;
mod scene;
mod value;

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::parser::ValueSource;
use clap::{ArgMatches, Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use sim_cli::DocumentVerb;
use sim_host::console;
use sim_solver::builtin;
use sim_solver::scene::is_path;

use crate::lesson::LessonArgs;

pub(crate) use bench::{BenchArgs, BenchClientArgs, ClientRole};
pub(crate) use command::CommandVerb;
pub(crate) use ctl::{CtlArgs, CtlVerb, QueryVerb, WatchArgs};
use endpoint::EndpointArgs;
pub(crate) use endpoint::{DoctorArgs, PsArgs};
pub(crate) use run::RunArgs;
pub(crate) use scene::{CheckArgs, ImportArgs, ScenesArgs, ShowArgs};

/// Simulate particles and constraints at a fixed rate, for any process on this host.
///
/// The node publishes every state in shared memory, where other processes read it without copying,
/// and accepts commands (grab, pin, pause, ...) from all of them. Without arguments, it runs the
/// built-in scene `drape` until Ctrl-C.
#[derive(Debug, Parser)]
#[command(
    name = "sim-node",
    version,
    override_usage = "sim-node [run] [OPTIONS] [SCENE]\n       \
        sim-node [--name NAME] [--domain DOMAIN] <COMMAND> ...",
    after_help = "Exit codes: 0 success, 1 failure, 2 usage error, 4 the node rejected a command of `ctl`.\n\n\
        Examples:\n  \
        sim-node                                    run the drape, a curtain with folds\n  \
        sim-node run rope --rate 1000               run the rope at 1 kHz\n  \
        sim-node run my.toml --duration 10s --json  run a file for 10 s, then print a summary\n  \
        sim-node ctl grab 90 0.5 0.2 0.3            drag particle 90 of the running node\n  \
        sim-node ctl set gravity 0 -1.6 0           set the gravity of the moon\n  \
        sim-node ps                                 list the running nodes\n  \
        sim-node doctor                             check this host, and find what killed nodes have left\n  \
        sim-node --domain lab ctl status            show a node of another domain\n  \
        sim-node scenes                             list the built-in scenes\n  \
        sim-node import shirt.obj -o shirt.toml     convert a mesh to a scene\n  \
        sim-node bench --rate 1000                  measure this machine with the curtain at 1 kHz\n  \
        sim-node lesson                             list the physics lessons"
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Run a scene until Ctrl-C, or for a given time
    Run(RunArgs),
    /// List the built-in scenes
    Scenes(ScenesArgs),
    /// Print a scene as complete TOML, with every default
    Show(ShowArgs),
    /// Check a scene without running it, and warn of likely mistakes
    Check(CheckArgs),
    /// Convert an OBJ mesh to a cloth scene
    Import(ImportArgs),
    /// Command a running node, or query its state
    Ctl(CtlArgs),
    /// List the nodes and replays of a domain
    Ps(PsArgs),
    /// Check this host and a domain: leftovers, memory, limits, permissions, clocks
    Doctor(DoctorArgs),
    /// Measure latencies and times of steps on this machine
    Bench(BenchArgs),
    #[command(hide = true)]
    BenchClient(BenchClientArgs),
    /// Print tables that teach the physics: Euler, iterations, stiffness, 32-bit numbers
    Lesson(LessonArgs),
    #[command(flatten)]
    Document(DocumentVerb),
}

/// Reads the command line. Exits with code 2 and the usage if it is invalid, and with 0 after a help
/// text, or 1 if that cannot be written.
#[allow(clippy::exit, reason = "clap ends the program in the same way")]
pub(crate) fn parse() -> Args {
    try_parse(std::env::args_os()).unwrap_or_else(|error| {
        let (printed, code) = (error.print(), error.exit_code());
        std::process::exit(console::usage_exit_code(printed, error.use_stderr(), code))
    })
}

/// Parses a command line, the program's name included.
pub(crate) fn try_parse(
    words: impl IntoIterator<Item = impl Into<OsString>>,
) -> Result<Args, clap::Error> {
    let mut command = Args::command();
    command.build();
    let words: Vec<_> = words.into_iter().map(|word| plain_negative(word.into())).collect();
    check_first_word(&mut command, &words)?;
    let matches = command
        .try_get_matches_from_mut(&words)
        .map_err(|error| sim_cli::explain(error, &command, &words))?;
    check_order(&mut command, &matches)?;
    let mut args = Args::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
    match &mut args.verb {
        Some(Verb::Run(run)) => run.endpoint.inherit(&args.run.endpoint),
        Some(Verb::Ctl(ctl)) => ctl.endpoint.inherit(&args.run.endpoint),
        Some(Verb::Ps(ps)) => ps.domain.inherit(&args.run.endpoint),
        Some(Verb::Doctor(doctor)) => doctor.domain.inherit(&args.run.endpoint),
        _ => {}
    }
    check_run(&mut command, &args)?;
    Ok(args)
}

/// Refuses a first word that is neither a scene nor a subcommand, if it resembles a subcommand or a second word follows.
/// Otherwise, clap would take it for the scene of `run` and refuse the second word.
fn check_first_word(command: &mut Command, words: &[OsString]) -> Result<(), clap::Error> {
    let Some(word) = words.get(1).and_then(|word| word.to_str()) else { return Ok(()) };
    if word.starts_with('-')
        || is_path(word)
        || builtin::text(word).is_some()
        || command.find_subcommand(word).is_some()
    {
        return Ok(());
    }
    let mut known = sim_cli::subcommands(command);
    known.extend(builtin::names().map(str::to_owned));
    let is_followed =
        words.get(2).and_then(|next| next.to_str()).is_some_and(|next| !next.starts_with('-'));
    let nearest = sim_cli::nearest(word, known.iter().map(String::as_str));
    let nearest_verb = nearest.filter(|name| builtin::text(name).is_none()).map(str::to_owned);
    if nearest_verb.is_none() && !is_followed {
        return Ok(());
    }
    let mut error = clap::Error::new(ErrorKind::InvalidSubcommand).with_cmd(command);
    error.insert(ContextKind::InvalidSubcommand, ContextValue::String(word.to_owned()));
    if let Some(verb) = nearest_verb {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::String(verb));
    }
    Err(error)
}

/// Subcommands that look at a whole domain, so that a name has no meaning for them.
const DOMAIN_VERBS: [&str; 2] = ["ps", "doctor"];

/// Refuses arguments of `run` before another subcommand, where nothing would read them.
fn check_order(command: &mut Command, matches: &ArgMatches) -> Result<(), clap::Error> {
    let Some((verb, behind)) = matches.subcommand() else { return Ok(()) };
    let is_given = |matches: &ArgMatches, id: &str| {
        matches.try_contains_id(id).is_ok_and(|is_present| is_present)
            && matches.value_source(id) == Some(ValueSource::CommandLine)
    };
    let allowed = if DOMAIN_VERBS.contains(&verb) { &["domain"][..] } else { &EndpointArgs::IDS };
    // Clap shows options of `ctl` on both sides of it.
    let is_misplaced =
        |id: &str| is_given(matches, id) && !is_given(behind, id) && !allowed.contains(&id);
    let Some(argument) = command.get_arguments().find(|one| is_misplaced(one.get_id().as_str()))
    else {
        return Ok(());
    };
    let name = argument.get_long().map_or_else(|| "SCENE".to_owned(), |long| format!("--{long}"));
    let allowed = allowed.iter().map(|id| format!("--{id}")).collect::<Vec<_>>().join(", ");
    let text = format!("{name} cannot precede the subcommand '{verb}' (allowed there: {allowed})");
    Err(command.error(ErrorKind::ArgumentConflict, text))
}

/// Refuses options of `run` that contradict each other, with the reason.
fn check_run(command: &mut Command, args: &Args) -> Result<(), clap::Error> {
    let run = match &args.verb {
        None => &args.run,
        Some(Verb::Run(run)) => run,
        Some(_) => return Ok(()),
    };
    match run.real_time.conflict() {
        Some(text) if run.as_fast_as_possible => {
            Err(command.error(ErrorKind::ArgumentConflict, text))
        }
        _ => Ok(()),
    }
}

/// Rewrites a negative number for clap, which takes `-.5` and `-1e-3` for options.
fn plain_negative(word: OsString) -> OsString {
    let text = word.to_str().filter(|text| text.starts_with('-'));
    match text.and_then(|text| text.parse::<f64>().ok()) {
        // Without an exponent, in the fewest digits that read back as the same number.
        Some(number) if number.is_finite() => number.to_string().into(),
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(line: &str) -> String {
        let error = try_parse(line.split(' ')).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{line}");
        error.to_string()
    }

    #[test]
    fn negative_numbers_are_rewritten_without_an_exponent() {
        for (word, plain) in [
            ("-.5", "-0.5"),
            ("-1e-3", "-0.001"),
            ("-2.5E2", "-250"),
            ("-3", "-3"),
            ("--delta", "--delta"),
            ("-o", "-o"),
            ("-inf", "-inf"),
            ("1e-3", "1e-3"),
        ] {
            assert_eq!(plain_negative(word.into()), plain, "{word}");
        }
    }

    #[test]
    fn name_and_domain_are_accepted_before_and_behind_a_subcommand() {
        for line in [
            "sim-node --domain lab --name left ctl status",
            "sim-node --domain lab ctl --name left status",
            "sim-node ctl status --domain lab --name left",
            "sim-node --name right --domain lab ctl status --name left",
        ] {
            let args = try_parse(line.split(' ')).unwrap();
            let Some(Verb::Ctl(ctl)) = args.verb else { panic!("{line}: not ctl") };
            let endpoint = ctl.endpoint.endpoint().unwrap();
            assert_eq!((endpoint.domain(), endpoint.name()), (Some("lab"), "left"), "{line}");
        }
        let args = try_parse("sim-node --domain lab ps".split(' ')).unwrap();
        let Some(Verb::Ps(ps)) = args.verb else { panic!("not ps") };
        assert_eq!(ps.domain.endpoint().unwrap().domain(), Some("lab"));
        let args = try_parse("sim-node --domain lab run rope".split(' ')).unwrap();
        let Some(Verb::Run(run)) = args.verb else { panic!("not run") };
        assert_eq!(run.endpoint.endpoint().unwrap().domain(), Some("lab"));
    }

    #[test]
    fn options_of_run_are_refused_before_another_subcommand() {
        let text = refused("sim-node --rate 100 ctl status");
        assert!(text.contains("--rate cannot precede the subcommand 'ctl'"), "{text}");
        let text = refused("sim-node --name left ps");
        assert!(
            text.contains("--name cannot precede the subcommand 'ps' (allowed there: --domain)")
        );
        let text = refused("sim-node rope scenes");
        assert!(text.contains("SCENE cannot precede the subcommand 'scenes'"), "{text}");
    }

    #[test]
    fn real_time_scheduling_is_refused_for_a_run_that_never_waits() {
        for line in [
            "sim-node --realtime --as-fast-as-possible",
            "sim-node run rope --as-fast-as-possible --realtime=require",
        ] {
            let text = refused(line);
            assert!(text.contains("a loop that never waits would keep"), "{text}");
        }
        assert!(try_parse("sim-node run --cpu 0 --as-fast-as-possible".split(' ')).is_ok());
        assert!(try_parse("sim-node run --realtime rope".split(' ')).is_ok());
    }

    #[test]
    fn unknown_options_and_stray_numbers_are_refused_without_advice_to_escape_them() {
        for (line, problem) in [
            ("sim-node ctl pin -1", "unexpected argument '-1' found"),
            ("sim-node ctl status -3", "unexpected argument '-3' found"),
            ("sim-node ctl grab 3 -1 -2 0 --fast", "unexpected argument '--fast' found"),
            ("sim-node run --spee 3", "unexpected argument '--spee' found"),
            ("sim-node ctl pin 1 2", "unexpected argument '2' found"),
            ("sim-node foo bar", "unrecognized subcommand 'foo'"),
        ] {
            let text = refused(line);
            assert!(text.starts_with(&format!("error: {problem}")), "{line}: {text}");
            assert!(text.contains("--help") && !text.contains("tip:"), "{line}: {text}");
        }
    }

    #[test]
    fn a_misspelt_word_is_refused_with_the_nearest_one() {
        for (line, tip) in [
            ("sim-node rnu curtain", "a similar subcommand exists: 'run'"),
            ("sim-node rnu", "a similar subcommand exists: 'run'"),
            ("sim-node scene", "a similar subcommand exists: 'scenes'"),
            ("sim-node ctl paus", "a similar subcommand exists: 'pause'"),
            ("sim-node ctl grab 3 -1 -2 0 --ove 1", "a similar argument exists: '--over'"),
            ("sim-node run --thraeds 2", "a similar argument exists: '--threads'"),
            ("sim-node lesson eluer", "a similar value exists: 'euler'"),
            ("sim-node ctl get gravty", "did you mean 'gravity'?"),
            ("sim-node ctl get wind", "did you mean 'wind.velocity'?"),
        ] {
            let text = refused(line);
            assert!(text.contains(tip), "{line}: {text}");
        }
        // A scene: the error of its loader names the nearest one.
        assert!(try_parse(["sim-node", "curtian"]).is_ok());
    }

    #[test]
    fn a_grab_takes_negative_coordinates_and_a_time_of_at_most_an_hour() {
        for over in ["0.25", "250ms", "1h", "0"] {
            let line = format!("sim-node ctl grab 3 -1 -2e-3 -.5 --over {over}");
            assert!(try_parse(line.split(' ')).is_ok(), "{over}");
        }
        for over in ["-1", "3601", "61min", "nan", "soon"] {
            let text = refused(&format!("sim-node ctl grab 3 -1 -2 0 --over {over}"));
            assert!(text.contains("a number of seconds from 0 to 3600"), "{text}");
        }
    }
}
