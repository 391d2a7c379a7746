//! `recorder scene`: extracts the scene from a recording.

use std::io::{self, IsTerminal};
use std::path::PathBuf;

use anyhow::{Context, bail};
use recording::{LogReader, PartFile};
use sim_contract::printable;

use crate::cli::args::OverwriteArgs;
use crate::cli::output::{self, Exit, path_text};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    recorder scene run.mcap > scene.toml\n  \
    recorder scene run.mcap -o scene.toml\n  \
    sim-node run ./scene.toml")]
pub(crate) struct SceneArgs {
    /// Recording to read. Only its header needs to be intact
    file: PathBuf,
    /// File to write [default: print the scene]
    #[arg(short, long, value_name = "OUT.toml")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &SceneArgs) -> anyhow::Result<Exit> {
    let log = LogReader::open(&args.file).with_context(|| path_text(&args.file))?;
    if log.scene().is_empty() {
        bail!("{}: has no scene (attachment scene.toml)", path_text(&args.file));
    }
    match &args.output {
        Some(path) => PartFile::write_whole(path, args.overwrite.existing(), log.scene())?,
        None => print(log.scene())?,
    }
    Ok(Exit::Done)
}

/// Prints the scene. It is unchanged, unless it goes to a terminal.
fn print(scene: &[u8]) -> anyhow::Result<()> {
    if io::stdout().is_terminal() {
        return output::bytes(printable(&String::from_utf8_lossy(scene)).as_bytes());
    }
    output::bytes(scene)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use clap::Parser;
    use recording::{LogOptions, LogWriter, RunDescription};

    use super::*;

    const SCENE: &[u8] = b"version = 1\nname = \"point\"\n";

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        args: SceneArgs,
    }

    /// Runs the subcommand on a recording without an end, as a killed recorder leaves it.
    fn extract(folder: &Path, scene: &[u8], options: &[&str]) -> anyhow::Result<Exit> {
        let description = RunDescription { rate_hz: 240, ..RunDescription::default() };
        let mut bytes = Vec::new();
        let log = LogWriter::create(&mut bytes, LogOptions::default(), &description, scene, 0);
        log.unwrap().flush().unwrap();
        let path = folder.join("run.mcap");
        fs::write(&path, bytes).unwrap();
        let path = path.display().to_string();
        let words = ["scene", &path].into_iter().chain(options.iter().copied());
        run(&Line::try_parse_from(words).unwrap().args)
    }

    #[test]
    fn the_scene_is_written_and_an_existing_file_is_replaced_only_with_overwrite() {
        let folder = std::env::temp_dir().join(format!("recorder-scene-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let output = folder.join("scene.toml");
        let name = output.display().to_string();
        assert_eq!(extract(&folder, SCENE, &["-o", &name]).unwrap(), Exit::Done);
        assert_eq!(fs::read(&output).unwrap(), SCENE);
        let error = extract(&folder, b"version = 1", &["-o", &name]).unwrap_err().to_string();
        assert!(error.contains("exists (use --overwrite"), "{error}");
        assert_eq!(fs::read(&output).unwrap(), SCENE);
        extract(&folder, b"version = 1", &["-o", &name, "--overwrite"]).unwrap();
        assert_eq!(fs::read(&output).unwrap(), b"version = 1");
        let error = extract(&folder, b"", &[]).unwrap_err().to_string();
        assert!(error.ends_with("run.mcap: has no scene (attachment scene.toml)"), "{error}");
        fs::remove_dir_all(&folder).unwrap();
    }
}
