//! `sim-node`: solves particles and constraints at a fixed rate, publishes every state in shared
//! memory and takes commands from any process.
#![forbid(unsafe_code)]

mod args;
mod check;
mod commands;
mod ctl;
mod exit;
mod import;
mod lesson;
mod node;
mod pace;
mod publish;
mod run;
mod scene_source;
mod statistics;
mod threads;
mod warnings;

use args::Verb;
use exit::Exit;

fn main() -> Exit {
    let args = args::parse();
    let result = match args.verb {
        None => run::run(&args.run),
        Some(Verb::Run(run)) => run::run(&run),
        Some(Verb::Scenes(list)) => check::scenes(&list),
        Some(Verb::Show(show)) => check::show(&show),
        Some(Verb::Check(check)) => check::check(&check),
        Some(Verb::Import(mesh)) => import::import(&mesh),
        Some(Verb::Ctl(ctl)) => ctl::ctl(&ctl),
        Some(Verb::Lesson(lesson)) => lesson::lesson(&lesson),
    };
    exit::of(result)
}
