//! Calls of `ctl` and commands of clients, with random numbers.

use fastrand::Rng;

/// Calls of `ctl`, right and wrong. A word in capitals stands for a random number.
pub(super) const CTL_LINES: &[&str] = &[
    "pin PARTICLE",
    "unpin PARTICLE",
    "grab PARTICLE POINT POINT POINT --over 0.1",
    "move PARTICLE POINT POINT POINT",
    "release PARTICLE",
    "push POINT POINT POINT --radius POINT --delta 0 0 0.01",
    "cut CONSTRAINT",
    "cut-radius POINT POINT POINT --radius 0.1",
    "set gravity 0 POINT 0",
    "set tear_force off",
    "set tear_force CONSTRAINT",
    "set time_scale 2",
    "set damping POINT",
    "pause",
    "pause",
    "resume",
    "resume",
    "resume",
    "step PARTICLE",
    "reset",
    "rewind POINTs",
    "rewind --to-step CONSTRAINT",
    "rewind --to-step 4000000000",
    "load curtain",
    "load spider-web",
    "load tearable-cloth",
    "load ./missing.toml",
    "load nothing",
    "status",
    "hash",
    "get",
    "particles PARTICLE",
    "nearest POINT POINT POINT",
    "pin 4000000000",
    "pin x",
    "grab PARTICLE nan 0 0",
    "set gravity 1",
    "fly",
];

/// Commands of a client, in their JSON form.
pub(super) const COMMANDS: &[&str] = &[
    r#"{"kind":"pin","particle":PARTICLE}"#,
    r#"{"kind":"unpin","particle":PARTICLE}"#,
    r#"{"kind":"grab","particle":PARTICLE,"target":[POINT,POINT,POINT]}"#,
    r#"{"kind":"move","particle":PARTICLE,"target":[POINT,POINT,POINT]}"#,
    r#"{"kind":"release","particle":PARTICLE}"#,
    r#"{"kind":"push","center":[POINT,POINT,POINT],"radius":1,"delta":[0,0,POINT],"limit":0.01}"#,
    r#"{"kind":"cut","constraint":CONSTRAINT}"#,
    r#"{"kind":"cut_radius","center":[POINT,POINT,POINT],"radius":0.1}"#,
    r#"{"kind":"set","parameter":"wind.drag","value":POINT}"#,
    r#"{"kind":"set","parameter":"substeps","value":0}"#,
    r#"{"kind":"pause"}"#,
    r#"{"kind":"resume"}"#,
    r#"{"kind":"resume"}"#,
    r#"{"kind":"step","count":3}"#,
    r#"{"kind":"reset"}"#,
    r#"{"kind":"rewind","to_step":CONSTRAINT}"#,
    r#"{"kind":"rewind","back_steps":PARTICLE}"#,
    r#"{"kind":"restore","contents":"state","state_hash":"0123456789abcdef"}"#,
    r#"{"kind":"load","scene":"rope-bridge"}"#,
    r#"{"kind":"load","scene":"tearable-cloth"}"#,
    r#"{"kind":"load","scene":"./missing.toml"}"#,
    r#"{"kind":"grab","particle":PARTICLE,"target":["nan",0,"inf"]}"#,
    r#"{"kind":"unknown","number":77}"#,
];

/// Commands of a flood: those that many programs send in a row.
pub(super) const FLOODS: &[&str] = &[
    r#"{"kind":"move","particle":PARTICLE,"target":[POINT,POINT,POINT]}"#,
    r#"{"kind":"push","center":[POINT,POINT,POINT],"radius":1,"delta":[0,0,POINT],"limit":0.01}"#,
    r#"{"kind":"pin","particle":PARTICLE}"#,
    r#"{"kind":"cut","constraint":CONSTRAINT}"#,
    r#"{"kind":"reset"}"#,
    r#"{"kind":"rewind","back_steps":PARTICLE}"#,
];

/// Chooses a line and replaces its words in capitals.
pub(super) fn fill(rng: &mut Rng, lines: &[&str]) -> String {
    let mut line = lines[rng.usize(..lines.len())].to_owned();
    while let Some(at) = line.find("PARTICLE") {
        // Most scenes have this many.
        line.replace_range(at..at + "PARTICLE".len(), &rng.u32(1..60).to_string());
    }
    while let Some(at) = line.find("CONSTRAINT") {
        line.replace_range(at..at + "CONSTRAINT".len(), &rng.u32(1..130).to_string());
    }
    while let Some(at) = line.find("POINT") {
        let tenths = rng.u32(0..11);
        line.replace_range(at..at + "POINT".len(), &format!("{:.1}", f64::from(tenths) / 10.0));
    }
    line
}
