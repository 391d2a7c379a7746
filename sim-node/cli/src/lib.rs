//! The common parts of every program's command line: completion scripts and man pages, generated from it,
//! and errors that suggest the nearest known word.
#![forbid(unsafe_code)]

mod explain;

use std::path::{Path, PathBuf};
use std::{fs, io};

use anyhow::Context;
use clap::{Command, Subcommand};
use clap_complete::Shell;
use clap_mangen::Man;
use sim_host::console;

pub use explain::{explain, subcommands};
pub use sim_types::{did_you_mean, nearest};

/// Subcommands that generate documents.
#[derive(Debug, Clone, Subcommand)]
pub enum DocumentVerb {
    /// Print a script that completes the arguments of this program in a shell
    Completions {
        /// Shell that runs the script
        shell: Shell,
    },
    /// Write man pages: one of this program, and one of each subcommand
    Man {
        /// Folder to write them to; it is created if it is missing. Pages of the same name are replaced
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
}

impl DocumentVerb {
    /// Generates the document from the command line of a program.
    ///
    /// # Errors
    /// The script or a page cannot be written.
    pub fn run(&self, program: Command) -> anyhow::Result<()> {
        match self {
            Self::Completions { shell } => {
                let script = completions(program, *shell);
                console::write_result(script.as_bytes()).context("cannot write to stdout")
            }
            Self::Man { folder } => write_pages(program, folder)
                .with_context(|| format!("writing man pages to {}", folder.display())),
        }
    }
}

fn completions(mut program: Command, shell: Shell) -> String {
    let name = program.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut program, &name, &mut script);
    // clap_complete 4.6 spells the hyphen of a program's name in two ways, so bash would complete nothing
    // after a subcommand.
    let wrong = format!("{}__subcmd__", name.replace('-', "__subcmd__"));
    let right = format!("{}__subcmd__", name.replace('-', "__"));
    String::from_utf8_lossy(&script).replace(&wrong, &right)
}

fn write_pages(program: Command, folder: &Path) -> io::Result<()> {
    let source = format!("{} {}", program.get_name(), program.get_version().unwrap_or_default());
    let mut program = program.disable_help_subcommand(true);
    // Gives each subcommand its full name, such as `recorder-export`.
    program.build();
    fs::create_dir_all(folder)?;
    write_page(&program, &source, folder)
}

/// Writes the page of a command and those of its subcommands. `source` names the program and its version.
fn write_page(command: &Command, source: &str, folder: &Path) -> io::Result<()> {
    for subcommand in command.get_subcommands().filter(|one| !one.is_hide_set()) {
        write_page(subcommand, source, folder)?;
    }
    Man::new(command.clone()).source(source).manual("Catenary").generate_to(folder).map(drop)
}
