//! `sim-node`: simulates particles and constraints at a fixed rate, publishes every state in shared
//! memory and accepts commands from any process.
#![forbid(unsafe_code)]

mod args;
mod bench;
mod ctl;
mod domain;
mod exit;
mod lesson;
mod node;
mod output;
mod run;
mod scene_source;
mod scenes;
mod table;

use args::{Args, Verb};
use clap::CommandFactory;
use exit::Exit;

fn main() -> Exit {
    let args = args::parse();
    if let Err(error) = sim_contract::report_file_size_limit() {
        return exit::from_result(Err(error.into()));
    }
    let result = match args.verb {
        None => run::run(&args.run),
        Some(Verb::Run(run)) => run::run(&run),
        Some(Verb::Scenes(list)) => scenes::list(&list),
        Some(Verb::Show(show)) => scenes::show(&show),
        Some(Verb::Check(check)) => return exit::from_result(scenes::check(&check)),
        Some(Verb::Import(mesh)) => scenes::import::import(&mesh),
        Some(Verb::Ctl(ctl)) => return exit::from_result(ctl::ctl(&ctl)),
        Some(Verb::Ps(list)) => domain::ps::ps(&list),
        Some(Verb::Doctor(checks)) => return exit::from_result(domain::doctor::doctor(&checks)),
        Some(Verb::Bench(options)) => bench::bench(&options),
        Some(Verb::BenchClient(client)) => bench::client::run(&client),
        Some(Verb::Lesson(lesson)) => lesson::lesson(&lesson),
        Some(Verb::Document(document)) => document.run(Args::command()),
    };
    exit::from_result(result.map(|()| Exit::Done))
}
