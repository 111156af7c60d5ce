//! `deposit`: writes a deposit, or verifies one.

use super::{
    arguments::{DepositArgs, TrustFlags},
    printing::{print, warn},
};
use meshmark_core::counted;
use meshmark_verification::{report::Standing, words::printable};
use meshmark_verifier::{
    Error, Result,
    deposit::{self, Deposit, DepositFiles, Deposited, Opened, Predicate, SigningKey, signing_key_file},
    inputs::texts,
    outputs::NewFile,
    time_stamp::{self, TimeStamp},
    words::quoted,
};
use std::path::Path;

pub(super) fn run(args: &DepositArgs) -> Result<()> {
    match &args.verify {
        Some(path) => verify(args, path),
        None => make(args),
    }
}

fn make(args: &DepositArgs) -> Result<()> {
    let required = "clap requires it without --verify";
    let (key_path, output) = (args.key.as_ref().expect(required), args.output.as_ref().expect(required));
    let file = NewFile::new("deposit", output)?;
    let request_path = args.time_stamp_request.as_deref();
    let request_file = request_path.map(|path| NewFile::new("time-stamp request", path)).transpose()?;
    let passphrase = args.opening.passphrase();
    let key = texts::key(key_path, &passphrase, &mut warn)?;
    let signing_path = args.signing_key.clone().unwrap_or_else(|| signing_key_file(key_path));
    let signing = SigningKey::read(&signing_path, &passphrase, &mut warn)?;
    let deposited = Deposited {
        key: &key,
        references: &args.reference,
        records: args.records.as_ref().expect(required),
        public_key: signing.public().to_hex(),
    };
    let statement = deposit::make(&deposited, &mut warn)?;
    let bytes = Deposit::sign(&statement, &signing);
    let request = time_stamp::request(&bytes)?;
    let mut files = vec![(file, bytes.as_slice())];
    files.extend(request_file.map(|file| (file, request.as_slice())));
    NewFile::write_all(&files)?;
    let held = held(&statement.predicate);
    print(&format!("deposit of {held} written to {}\n", output.display()))?;
    request_path.map_or(Ok(()), |path| print(&sending(path)))
}

/// Returns how to send the request for a time stamp, which this program does not.
fn sending(request: &Path) -> String {
    let mut response = request.with_extension("tsr");
    if response == request {
        response.as_mut_os_string().push(".tsr"); // curl would write over the request
    }
    let [shown, request, response] = [request, request, &response].map(|path| path.display().to_string());
    format!(
        "request for a time stamp written to {shown}; an authority answers it:\n\
         curl -H 'Content-Type: application/timestamp-query' --data-binary {} -o {} ADDRESS\n",
        quoted(&format!("@{request}")),
        quoted(&response)
    )
}

fn verify(args: &DepositArgs, path: &Path) -> Result<()> {
    if args.time_stamp_request.is_some() && args.trust.time_stamp.is_none() {
        return Err(Error::NoAnswer);
    }
    let opened = Opened::read(&files(path, &args.trust, args.time_stamp_request.as_deref()))?;
    let passphrase = args.opening.passphrase();
    let key = args.key.as_deref().map(|path| texts::key(path, &passphrase, &mut warn)).transpose()?;
    let records = args.records.as_deref();
    let standing = deposit::check(&opened.deposit, key.as_ref(), &args.reference, records, &mut warn)?;
    print(&answer(&opened, &standing))
}

/// Returns the files of a deposit and of what vouches for it.
pub(super) fn files<'a>(
    deposit: &'a Path,
    trust: &'a TrustFlags,
    request: Option<&'a Path>,
) -> DepositFiles<'a> {
    let TrustFlags { public_key, time_stamp, authorities } = trust;
    DepositFiles {
        deposit,
        public_key: public_key.as_deref(),
        time_stamp: time_stamp.as_deref().zip(authorities.as_deref()),
        request,
    }
}

/// Returns what a deposit holds.
fn held(predicate: &Predicate) -> String {
    let Predicate { references, records, recipients, .. } = predicate;
    format!(
        "a key, {}, {} and {}",
        counted(references.len(), "reference"),
        counted(records.digests.len(), "record"),
        counted(recipients.digests.len(), "recipient")
    )
}

fn answer(opened: &Opened, Standing { fixed, not_fixed }: &Standing) -> String {
    let Opened { deposit, is_signer_known, stamp } = opened;
    let of_signer =
        if *is_signer_known { "the key that was given" } else { "a key that nothing here vouches for" };
    let mut lines = vec![
        format!("deposit:      SHA-256 {}", deposit.sha256()),
        format!("signed with:  {}, {of_signer}", deposit.signer().to_hex()),
        match stamp {
            Some(TimeStamp { time, authority }) => {
                format!("since:        {time}, by {}", printable(authority))
            }
            None => "since:        nobody vouches for a time, as no time stamp is given".into(),
        },
        format!("holds:        {}", held(&deposit.statement().predicate)),
    ];
    lines.extend(fixed.iter().map(|what| format!("fixed:        {what}")));
    lines.extend(not_fixed.iter().map(|what| format!("not fixed:    {what}")));
    lines.join("\n") + "\n"
}
