//! Studies of what marks survive and what they cost a map; each program of `src/bin` makes a table
//! of the documents.

pub mod false_alarms;
pub mod misses;
pub mod plot;
pub mod table2;
