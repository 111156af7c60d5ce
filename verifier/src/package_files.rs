//! Man pages and shell completions, generated from the command line.

use clap::{Command, builder::PossibleValuesParser};
use clap_complete::{Shell, generate_to};
use clap_mangen::{
    Man,
    roff::{Roff, bold, roman},
};
use meshmark_core::options::{Kind, OPTIONS};
use meshmark_verifier::ExitCode;
use std::{
    fs::{self, File},
    io,
    path::Path,
};

/// Writes `meshmark.1`, a page for every subcommand, and completions for bash, zsh and fish into a
/// folder, which is created if necessary.
pub fn write(command: Command, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut command = visible(command);
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        generate_to(shell, &mut command.clone(), "meshmark", folder)?;
    }
    command = command.disable_help_subcommand(true);
    command.build();
    let pages: Vec<&Command> = [&command].into_iter().chain(command.get_subcommands()).collect();
    pages.iter().try_for_each(|page| write_page(page, &pages, folder))
}

/// Returns the visible part of a command, with the legal values of its options.
fn visible(command: Command) -> Command {
    let subcommands = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    let subcommands: Vec<Command> = subcommands.cloned().map(with_words).collect();
    let shown = Command::new("meshmark").version(env!("CARGO_PKG_VERSION")).subcommands(subcommands);
    let examples = command.get_after_help().cloned().unwrap_or_default();
    shown.about(command.get_about().cloned().unwrap_or_default()).after_help(examples)
}

fn with_words(command: Command) -> Command {
    command.mut_args(|argument| {
        let option = OPTIONS.iter().find(|option| argument.get_id() == option.name);
        match option.map(|option| option.kind) {
            Some(Kind::Choice(words)) => argument.value_parser(PossibleValuesParser::new(words)),
            _ => argument,
        }
    })
}

fn name(page: &Command) -> &str {
    page.get_display_name().unwrap_or(page.get_name())
}

fn write_page(page: &Command, pages: &[&Command], folder: &Path) -> io::Result<()> {
    let source = concat!("meshmark ", env!("CARGO_PKG_VERSION"));
    let man = Man::new(page.clone()).title(name(page).to_uppercase()).source(source).manual("meshmark");
    let mut file = File::create(folder.join(format!("{}.1", name(page))))?;
    man.render_title(&mut file)?;
    man.render_name_section(&mut file)?;
    man.render_synopsis_section(&mut file)?;
    man.render_description_section(&mut file)?;
    man.render_options_section(&mut file)?;
    if page.has_subcommands() {
        man.render_subcommands_section(&mut file)?;
    }
    let mut more = Roff::new();
    if page.get_name() == "verify" {
        more.control("SH", ["EXIT STATUS"]);
        for code in ExitCode::ALL {
            more.control("TP", []).text([bold((code as u8).to_string())]).text([roman(code.meaning())]);
        }
    }
    if let Some(examples) = page.get_after_help() {
        more.control("SH", ["EXAMPLES"]).text([roman(examples.to_string())]);
    }
    let others = pages.iter().filter(|other| name(other) != name(page)).map(|other| name(other));
    let others: Vec<String> =
        others.chain(["ogr2ogr"]).flat_map(|other| [format!("{other}(1)"), ", ".into()]).collect();
    let (_, others) = others.split_last().expect("ogr2ogr is one");
    more.control("SH", ["SEE ALSO"]).text([roman(others.concat())]);
    more.to_writer(&mut file)
}
