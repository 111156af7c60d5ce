//! A deposit with its time stamp, as an auditor opens both.

use super::{Deposit, PublicKey};
use crate::{
    Result,
    time_stamp::{self, Authorities, TimeStamp},
};
use std::path::Path;

/// The files of a deposit.
#[derive(Clone, Copy)]
pub struct DepositFiles<'a> {
    /// The deposit.
    pub deposit: &'a Path,
    /// The public key that it must be signed with.
    pub public_key: Option<&'a Path>,
    /// The response of a time-stamping authority, and the certificates that vouch for that.
    pub time_stamp: Option<(&'a Path, &'a Path)>,
    /// The request that the response must answer.
    pub request: Option<&'a Path>,
}

/// A deposit whose signature and time stamp are right.
pub struct Opened {
    /// The deposit.
    pub deposit: Deposit,
    /// Whether the public key was known beforehand.
    pub is_signer_known: bool,
    /// The time stamp.
    pub stamp: Option<TimeStamp>,
}

impl Opened {
    /// Reads and checks the files.
    ///
    /// # Errors
    /// Fails as [`Deposit::read`] and [`time_stamp::verify`] do.
    pub fn read(files: &DepositFiles) -> Result<Self> {
        let public = files.public_key.map(PublicKey::read).transpose()?;
        let deposit = Deposit::read(files.deposit, public.as_ref())?;
        let verified = |(response, authorities)| {
            time_stamp::verify(response, deposit.bytes(), files.request, &Authorities::read(authorities)?)
        };
        let stamp = files.time_stamp.map(verified).transpose()?;
        Ok(Opened { is_signer_known: public.is_some(), stamp, deposit })
    }
}
