//! What the process of an examination may do, where the kernel can enforce it: it may read files,
//! and write to one folder. It has no network, starts no programs and looks into no other process.

use super::Limits;
use crate::{Error, Result};
use landlock::{
    ABI, Access, AccessFs, AccessNet, Ruleset, RulesetAttr, RulesetCreatedAttr, RulesetError, Scope,
    path_beneath_rules,
};
use rustix::process::{Signal, set_parent_process_death_signal};
use seccompiler::{SeccompAction, SeccompFilter, SeccompRule};
use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

/// The newest version of Landlock that this uses; an older kernel enforces what it has.
const LANDLOCK: ABI = ABI::V6;

/// Calls that no reader of files needs.
const FORBIDDEN: &[libc::c_long] = &[
    libc::SYS_execve,
    libc::SYS_execveat,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_fork,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_vfork,
    libc::SYS_ptrace,
    libc::SYS_process_vm_readv,
    libc::SYS_process_vm_writev,
    libc::SYS_bpf,
    libc::SYS_io_uring_setup,
    libc::SYS_userfaultfd,
    libc::SYS_mount,
    libc::SYS_unshare,
    libc::SYS_keyctl,
];

/// Calls that reach other machines or processes.
const NETWORK: &[libc::c_long] = &[libc::SYS_socket, libc::SYS_socketpair];

/// Confines this process, before it has any threads. It ends with its parent, has the limits, and
/// writes to `folder` alone. A reference that is no file here may be a database on the network.
///
/// # Errors
/// Fails when the operating system does not accept a limit. A kernel without Landlock or seccomp is no
/// error.
pub fn enter(folder: &Path, limits: &Limits, references: &[PathBuf]) -> Result<()> {
    let failed = |source: io::Error| Error::NotConfined { source };
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|error| failed(error.into()))?;
    limits.impose().map_err(failed)?;
    let network = !references.iter().all(|reference| reference.exists());
    drop(restrict_files(folder, network));
    drop(restrict_calls(network));
    Ok(())
}

fn restrict_files(folder: &Path, network: bool) -> std::result::Result<(), RulesetError> {
    let mut ruleset = Ruleset::default().handle_access(AccessFs::from_write(LANDLOCK) | AccessFs::Execute)?;
    if !network {
        ruleset = ruleset.handle_access(AccessNet::from_all(LANDLOCK))?.scope(Scope::from_all(LANDLOCK))?;
    }
    let writable = path_beneath_rules([folder, Path::new("/dev/null")], AccessFs::from_write(LANDLOCK));
    ruleset.create()?.add_rules(writable)?.restrict_self()?;
    Ok(())
}

fn restrict_calls(network: bool) -> seccompiler::Result<()> {
    let network = if network { &[] } else { NETWORK };
    let rules: BTreeMap<i64, Vec<SeccompRule>> =
        FORBIDDEN.iter().chain(network).map(|&call| (call, Vec::new())).collect();
    let refuse = SeccompAction::Errno(libc::EPERM as u32);
    let architecture = std::env::consts::ARCH.try_into()?;
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, refuse, architecture)?;
    let program: seccompiler::BpfProgram = filter.try_into()?;
    seccompiler::apply_filter(&program)
}
