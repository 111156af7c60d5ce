//! Table 2 of the paper rerun with the real driver and the real verifier, and attacks the paper
//! does not have: what becomes of the outcomes of an [experiment](meshmark_host_tests::experiment).

pub mod figures;
pub mod markdown;
mod paper;
mod summary;
