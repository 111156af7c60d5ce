//! Studies of the robustness of marks and of their effect on maps; each program of `src/bin` makes
//! a table of the documents.

pub mod calibration;
pub mod coalitions;
pub mod false_alarms;
pub mod misses;
pub mod plot;
pub mod table2;
