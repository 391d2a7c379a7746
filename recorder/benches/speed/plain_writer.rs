//! An ordinary subscriber that writes the bytes of each snapshot into a file.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::time::Duration;

use sim_contract::{Client, Endpoint, NAME_DEFAULT};

/// Longest wait for a snapshot before the writer asks whether its publisher is alive.
const WAIT_MAX: Duration = Duration::from_millis(500);

/// Writes the particles of all snapshots, until their publisher ends.
pub(crate) fn run(domain: &str, path: &str) {
    let endpoint = Endpoint::new(Some(domain), NAME_DEFAULT).unwrap();
    let mut client = Client::attach(&endpoint).unwrap();
    let mut file = BufWriter::new(File::create(path).unwrap());
    let mut count = 0;
    loop {
        match client.next_snapshot(WAIT_MAX).unwrap() {
            Some(snapshot) => {
                file.write_all(bytemuck::cast_slice(snapshot.particles())).unwrap();
                count += 1;
            }
            None if client.is_owner_alive() => {}
            None => break,
        }
    }
    // The recorder ends so too.
    file.into_inner().unwrap().sync_all().unwrap();
    assert!(count > 0, "no snapshot has arrived");
}
