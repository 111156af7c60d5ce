//! `repeat`: makes the bundle of a case again, and compares the two byte by byte.

use super::{arguments::RepeatArgs, command_line, printing::print};
use meshmark_core::counted;
use meshmark_verification::words::printable;
use meshmark_verifier::{Error, Result, bundle::Bundle};
use std::process::{Command, Stdio};

pub(super) fn run(args: &RepeatArgs) -> Result<()> {
    let (path, given) = (&args.bundle, Bundle::read(&args.bundle)?);
    let manifest = given.manifest();
    if command_line::repeatable(manifest.arguments.iter().cloned()) != manifest.arguments {
        let reason = "its command names an output, a passphrase or a limit".into();
        return Err(Error::NoBundle { path: path.clone(), reason });
    }
    let differ = |differences: Vec<String>| {
        Err(Error::NotRepeated { path: path.clone(), differences: differences.join("; ") })
    };
    let others = manifest.other_inputs();
    if !others.is_empty() {
        return differ(others);
    }
    let failed = |source| Error::NotConfined { source };
    let folder =
        tempfile::tempdir().map_err(|source| Error::unwritten("the bundle that is made again", source))?;
    let again = folder.path().join("again.zip");
    let mut verify = Command::new(std::env::current_exe().map_err(failed)?);
    verify.arg("verify").arg("--bundle").arg(&again);
    verify.args(
        args.opening.passphrase_file.iter().flat_map(|file| ["--passphrase-file".as_ref(), file.as_os_str()]),
    );
    let status = verify.args(&manifest.arguments).stdout(Stdio::null()).status().map_err(failed)?;
    if !again.exists() {
        return differ(vec![format!("the command of the bundle ends with {status}")]);
    }
    let again = Bundle::read(&again)?;
    let mut differences: Vec<String> = again
        .differing(&given)
        .into_iter()
        .map(|name| format!("{} is another one", printable(name)))
        .collect();
    if differences.is_empty() && !again.is_all_of(path)? {
        differences.push("the archive holds more than its files".into());
    }
    if differences.is_empty() {
        let count = counted(given.count(), "file");
        return print(&format!("{} is made again from its inputs: {count}, byte by byte\n", path.display()));
    }
    let versions = [&given, &again].map(|bundle| bundle.manifest().versions.join(", "));
    if versions[0] != versions[1] {
        differences.push(format!(
            "it was made with {}, and here is {}",
            printable(&versions[0]),
            versions[1]
        ));
    }
    differ(differences)
}
