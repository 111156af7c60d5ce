//! The command `meshmark`.
#![forbid(unsafe_code)]

mod cli;
mod package_files;

fn main() -> std::process::ExitCode {
    std::process::ExitCode::from(cli::run())
}
