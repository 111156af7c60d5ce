//! Table 2 of the paper, measured with the driver and the verifier, and attacks that the paper does
//! not have: tables and figures of the outcomes of an
//! [experiment](meshmark_host_tests::experiment).

pub mod figures;
pub mod markdown;
mod paper;
mod summary;
