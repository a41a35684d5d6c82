//! Files for other programs: the schema of decks, completions of shells, man pages, job scripts.

use std::path::PathBuf;

use clap::{Args, CommandFactory, ValueEnum};
use clap_complete::Shell;
use fissure::deck;
use fissure::error::{Error, Result};

use super::{CommandLine, Verbosity, outln, print};

/// Print the JSON Schema of decks, which lets editors complete keys and mark errors.
#[derive(Args)]
#[command(after_help = "\
Example:
  fissure schema > fissure.schema.json

Editors with taplo (in VS Code: the extension Even Better TOML) use this schema for a deck whose first
line is `#:schema ./fissure.schema.json`.")]
pub struct SchemaArguments {}

/// Print the completion script of a shell.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure completions bash > ~/.local/share/bash-completion/completions/fissure
  fissure completions zsh > ~/.zfunc/_fissure
  fissure completions fish > ~/.config/fish/completions/fissure.fish")]
pub struct CompletionsArguments {
    /// Shell that runs the script.
    shell: Shell,
}

/// Write man pages, one for each command, into a folder.
#[derive(Args)]
#[command(after_help = "\
Example:
  fissure man ~/.local/share/man/man1 && man fissure-run")]
pub struct ManArguments {
    /// Folder of the man pages; created if missing.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Print a job script for Slurm.
///
/// Before use, edit the lines between the marks `>>> edit` and `<<<`: partition, account, modules.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure slurm hybrid > job.sbatch && sbatch --nodes=4 job.sbatch plate.toml
  fissure slurm chain > chain.sbatch && sbatch chain.sbatch plate.toml /scratch/plate
  fissure slurm array > array.sbatch && sbatch --array=1-12 array.sbatch plate.toml loads.txt /scratch/loads")]
pub struct SlurmArguments {
    /// Script to print.
    script: Script,
}

/// A job script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Script {
    /// One run on several nodes, with several ranks per node and several cores per rank.
    Hybrid,
    /// A run longer than the time limit: the job requeues itself and continues the run.
    Chain,
    /// Several runs of one deck: each task of a job array takes one row of a table of parameters.
    Array,
}

/// Print the JSON Schema of decks.
///
/// # Errors
/// If the output cannot be written.
pub fn schema() -> Result<()> {
    print(&format!("{:#}\n", deck::schema()))
}

/// Print the completion script of a shell.
///
/// # Errors
/// If the output cannot be written.
pub fn completions(arguments: &CompletionsArguments) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(
        arguments.shell,
        &mut CommandLine::command(),
        "fissure",
        &mut text,
    );
    print(&String::from_utf8_lossy(&text))
}

/// Write the man pages.
///
/// # Errors
/// If the folder or a page cannot be written.
pub fn man(arguments: &ManArguments, verbosity: Verbosity) -> Result<()> {
    let folder = &arguments.folder;
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(CommandLine::command(), folder));
    written.map_err(|error| Error::file(folder, "write the man pages to", &error))?;
    if verbosity > Verbosity::Quiet {
        outln!(
            "wrote fissure.1 and a page of each command to {}",
            folder.display()
        );
    }
    Ok(())
}

/// Print a job script.
///
/// # Errors
/// If the output cannot be written.
pub fn slurm(arguments: &SlurmArguments) -> Result<()> {
    print(&arguments.script.text())
}

impl Script {
    /// Return this job script of the folder `slurm/` as text. The text contains that of `slurm/launch`, so
    /// the script needs no other file.
    fn text(self) -> String {
        let (name, script) = match self {
            Self::Hybrid => ("hybrid", include_str!("../../slurm/hybrid.sbatch")),
            Self::Chain => ("chain", include_str!("../../slurm/chain.sbatch")),
            Self::Array => ("array", include_str!("../../slurm/array.sbatch")),
        };
        let launch = include_str!("../../slurm/launch");
        script
            .replace("# Submit from the repository's folder.\n", "")
            .replace("FISSURE:-$PWD/target/release/fissure", "FISSURE:-fissure")
            .replace("slurm/launch explains them", "explained below")
            .replace("# shellcheck source=slurm/launch\n. slurm/launch\n", launch)
            .replace(
                "# shellcheck shell=bash\n# Sourced by the job scripts: what",
                "# What",
            )
            .replace(&format!("slurm/{name}.sbatch"), &format!("{name}.sbatch"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn job_scripts_need_no_other_file() {
        for script in Script::value_variants() {
            let text = script.text();
            for words in ["slurm/", "target/", "repository", "Sourced"] {
                assert!(!text.contains(words), "{script:?}: {words}");
            }
            assert!(text.starts_with("#!/usr/bin/env bash\n#"), "{script:?}");
            assert!(
                text.contains("\nwords=$(launch \"$SLURM_NTASKS\" \"$cores\")\n"),
                "{script:?}"
            );
            assert!(text.contains("FISSURE=${FISSURE:-fissure}\n"), "{script:?}");
        }
    }
}
