//! Man pages and shell completions, made from the command line as it is.

use clap::Command;
use clap_complete::{Shell, generate_to};
use std::{io, path::Path};

/// Writes `meshmark.1`, a page for every subcommand, and completions for bash, zsh and fish into a folder, which is made
/// when it is missing.
pub fn write(mut command: Command, folder: &Path) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    clap_mangen::generate_to(command.clone(), folder)?;
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        generate_to(shell, &mut command, "meshmark", folder)?;
    }
    Ok(())
}
