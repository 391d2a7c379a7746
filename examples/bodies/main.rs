//! Rigid bodies of rapier3d that touch the cloths of a node.
//!
//! The engine and the node take turns: the node makes a step with the bodies as the engine has sent them, and
//! answers with the impulses that its particles gave them; the engine adds these, and makes its own step.
//!
//! `cargo run --release -- examples/bodies/bodies.toml` starts the node, and
//! `cargo run --release -p integration-tests --example bodies` these bodies. Ctrl-C ends them with a report on stdout:
//! the balance of both processes. `--steps 2400` ends them after as many steps.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, clippy::print_stdout, reason = "this is a program")]

mod balance;
mod world;

use std::time::Duration;

use anyhow::{Context, bail};
use sim_contract::{Client, ConstraintState, Endpoint, Parameter, RequestError, SnapshotHeader};
use sim_host::Stop;
use sim_solver::Scene;

use balance::Balance;
use world::World;

/// Limit on each wait for what the node publishes with a step.
const TIMEOUT: Duration = Duration::from_secs(10);
/// Limit on each wait for a turn, so that Ctrl-C ends the program soon.
const POLL: Duration = Duration::from_millis(100);

fn main() -> anyhow::Result<()> {
    let stop = Stop::install()?;
    let (endpoint, arguments) = Endpoint::from_env_and_args()?;
    let steps = match &arguments[..] {
        [] => u64::MAX,
        [option, steps] if option == "--steps" => steps.parse().context("--steps")?,
        _ => bail!("usage: bodies [--steps N] [--domain DOMAIN] [--name NAME]"),
    };
    let mut client = Client::attach(&endpoint)?;
    // From now on, the node computes forces.
    client.forces(Duration::ZERO)?;
    client.join_lockstep(TIMEOUT)?;
    eprintln!("ready");
    let mut coupling: Option<Coupling> = None;
    while !stop.is_requested() && coupling.as_ref().is_none_or(|one| one.balance.steps() < steps) {
        let Some(snapshot) = client.next_turn(POLL)? else { continue };
        let header = *snapshot.header();
        let mut now = match coupling.take().filter(|coupling| coupling.is_continued_by(&header)) {
            Some(coupling) => coupling.advance(&mut client, &header)?,
            None => Coupling::new(&mut client, &header)?,
        };
        now.balance.observe(snapshot.particles(), &now.constraints, &now.world);
        drop(snapshot);
        now.send(&mut client)?;
        client.ready()?;
        coupling = Some(now);
    }
    if let Some(Coupling { last, balance, world, .. }) = coupling {
        println!("{}", balance.report(&last, &world));
    }
    Ok(())
}

/// The bodies of the scene that a node runs, and what both have done since the last load, reset or rewind.
struct Coupling {
    world: World,
    balance: Balance,
    constraints: Vec<ConstraintState>,
    /// The newest step.
    last: SnapshotHeader,
}

impl Coupling {
    /// Places the bodies where the node has them.
    fn new(client: &mut Client, header: &SnapshotHeader) -> anyhow::Result<Self> {
        let text = client.scene(TIMEOUT)?.context("the node published no scene")?;
        let scene = Scene::from_toml(&text, "scene")?;
        let colliders = client.colliders(TIMEOUT)?;
        let constraints = match client.topology(TIMEOUT)? {
            Some(topology) => topology.constraints,
            None => Vec::new(),
        };
        let world = World::new(&scene, &colliders.colliders)?;
        Ok(Self { world, balance: Balance::default(), constraints, last: *header })
    }

    /// Returns `true` if the step follows the last one, without a load, reset or rewind between them.
    fn is_continued_by(&self, header: &SnapshotHeader) -> bool {
        header.run_id == self.last.run_id
            && header.step == self.last.step + 1
            && header.scene_step == self.last.scene_step + 1
    }

    /// Makes the step of the bodies that the node has made with their copies.
    fn advance(mut self, client: &mut Client, header: &SnapshotHeader) -> anyhow::Result<Self> {
        let forces = client.forces_of(header, TIMEOUT)?;
        let forces = forces.with_context(|| format!("no forces of step {}", header.step))?;
        let parameters = client.parameters(TIMEOUT)?.context("the node published no parameters")?;
        self.balance.expect(&forces, &parameters.values);
        self.world.advance(&forces, parameters.values.vector(Parameter::Gravity));
        self.last = *header;
        Ok(self)
    }

    /// Sends the bodies for the next step. A node that has ended needs none.
    fn send(&self, client: &mut Client) -> Result<(), RequestError> {
        for action in self.world.commands() {
            match client.send(action) {
                Ok(_) | Err(RequestError::NoReceiver { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}
