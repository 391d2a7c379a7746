//! A client that grabs particles and never releases them: `grabber CLIENT_ID PARTICLE...`. It ends only
//! by a signal.
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "only tests run it, and read its output"
)]

use integration_tests::DEADLINE;
use sim_contract::{Action, Client, Endpoint, GRAB_OVER_S_DEFAULT};

fn main() {
    let (endpoint, arguments) = Endpoint::from_env_and_args().unwrap();
    let mut numbers = arguments.iter().map(|number| number.parse::<u32>().unwrap());
    let client_id = numbers.next().unwrap();
    let mut client = Client::attach_as(&endpoint, client_id.into()).unwrap();
    for particle in numbers {
        let over_s = GRAB_OVER_S_DEFAULT;
        let grab = Action::Grab { particle, target: [0.5, 0.2, 0.3], over_s };
        assert!(client.request(grab, DEADLINE).unwrap().is_applied());
    }
    eprintln!("ready");
    // Loops forever: no status has step u64::MAX.
    while client.status(DEADLINE).unwrap().is_none_or(|status| status.step < u64::MAX) {}
}
