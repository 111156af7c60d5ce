//! Rollback journals: an interrupted transaction left one beside its database. Only the database
//! and the journal together are what its last user saw.

use super::private_copy::PrivateCopy;
use crate::{Error, Result};
use rusqlite::{Connection, OpenFlags};
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::Path,
};

/// The last bytes of a journal that names the super-journal of a transaction over several databases
/// (SQLite's file format, "The Rollback Journal"). SQLite deletes that file, wherever it is.
const END_OF_NAME: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// Rolls back the transaction that a journal beside a copied database holds. GDAL only reads, and
/// therefore cannot open such a database.
///
/// # Errors
/// Fails for a journal that names another file, and one that SQLite cannot roll back.
pub(super) fn roll_back(what: &'static str, map: &PrivateCopy) -> Result<()> {
    let journal = map.copy_of_log("-journal");
    let path = || map.original().into();
    match names_another_file(&journal) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(Error::Undigested { path: path(), source }),
        Ok(true) => return Err(Error::SuperJournal { what, path: path() }),
        Ok(false) => {}
    }
    let read =
        |database: Connection| database.query_row("SELECT count(*) FROM sqlite_master", (), |_| Ok(()));
    let opened = Connection::open_with_flags(map.copy(), OpenFlags::SQLITE_OPEN_READ_WRITE);
    opened.and_then(read).map_err(|source| Error::Journal { what, path: path(), source })
}

fn names_another_file(journal: &Path) -> io::Result<bool> {
    let mut file = File::open(journal)?;
    let mut end = Vec::new();
    let start = file.metadata()?.len().saturating_sub(END_OF_NAME.len() as u64);
    file.seek(SeekFrom::Start(start))?;
    file.read_to_end(&mut end)?;
    Ok(end == END_OF_NAME)
}
