//! The energy of the newest state, for `ctl status --energy`.

use std::str;
use std::time::Duration;

use anyhow::{Context, bail};
use bytemuck::cast_slice;
use serde::Serialize;
use sim_contract::clock::monotonic_ns;
use sim_contract::{State, Tap};
use sim_solver::{Energy, EnergyMeter, Scene};

use crate::args::CtlArgs;

/// The energy of a state in JSON.
#[derive(Debug, Serialize)]
pub(super) struct EnergyRow {
    /// The step of the state.
    step: u64,
    #[serde(flatten)]
    energy: Energy,
    /// Unit of the energies: "J", or another one such as "kg cm²/s²".
    unit: String,
}

impl EnergyRow {
    /// Measures the newest state of the node.
    pub(super) fn read(args: &CtlArgs) -> anyhow::Result<Self> {
        let mut tap = Tap::attach(&args.endpoint.endpoint()?)?;
        let begin_ns = monotonic_ns();
        loop {
            if let Some(state) = tap.next_state(|_| {}) {
                return Self::of(&state);
            }
            let passed = Duration::from_nanos(monotonic_ns() - begin_ns);
            let left = args.timeout().saturating_sub(passed);
            if left.is_zero() {
                bail!("the node published no state within {:?}; is it stopped?", args.timeout());
            }
            tap.wait(left);
        }
    }

    fn of(state: &State<'_>) -> anyhow::Result<Self> {
        let text = str::from_utf8(&state.load.scene).context("the scene of the node is no text")?;
        let scene = Scene::from_toml(text, "scene").context("the scene of the node")?;
        let (particles, values) = (cast_slice(state.particles), &state.parameters.values);
        let energy = EnergyMeter::new(&scene).measure(particles, state.torn.indices(), values);
        let energy = energy.context("the newest state is not one of the scene of the node")?;
        Ok(Self { step: state.header.step, energy, unit: scene.energy_unit() })
    }

    /// Text for people.
    pub(super) fn text(&self) -> String {
        let Self { step, energy, unit } = self;
        let Energy { kinetic, potential, elastic } = energy;
        let total = energy.total();
        format!(
            "{total:.6} {unit} in step {step}: {kinetic:.6} kinetic, {potential:.6} potential, {elastic:.6} elastic"
        )
    }
}
