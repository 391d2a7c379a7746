//! `sim-node`: simulates particles and constraints at a fixed rate, publishes every state in shared
//! memory and accepts commands from any process.
#![forbid(unsafe_code)]

mod args;
mod bench;
mod ctl;
mod doctor;
mod lesson;
mod node;
mod output;
mod ps;
mod run;
mod scene_source;
mod scenes;

use args::{Args, Verb};
use clap::CommandFactory;
use output::Exit;

fn main() -> Exit {
    let args = args::parse();
    if let Err(error) = sim_host::report_file_size_limit() {
        return output::from_result(Err(error.into()));
    }
    let result = match args.verb {
        None => run::run(&args.run),
        Some(Verb::Run(run)) => run::run(&run),
        Some(Verb::Scenes(list)) => scenes::list(&list),
        Some(Verb::Show(show)) => scenes::show(&show),
        Some(Verb::Check(check)) => return output::from_result(scenes::check(&check)),
        Some(Verb::Import(mesh)) => scenes::import::import(&mesh),
        Some(Verb::Ctl(ctl)) => return output::from_result(ctl::ctl(&ctl)),
        Some(Verb::Ps(list)) => ps::ps(&list),
        Some(Verb::Doctor(checks)) => return output::from_result(doctor::doctor(&checks)),
        Some(Verb::Bench(options)) => bench::bench(&options),
        Some(Verb::BenchClient(client)) => bench::client::run(&client),
        Some(Verb::Lesson(lesson)) => lesson::lesson(&lesson),
        Some(Verb::Document(document)) => document.run(Args::command()),
    };
    output::from_result(result.map(|()| Exit::Done))
}
