//! Table 2 of the paper rerun with the real driver and the real verifier, and attacks the paper does not have.
//!
//! The data flows one way: [`cases`] → [`experiment`] (with [`product`]) → [`summary`] → [`markdown`] and
//! [`figures`].

pub mod cases;
pub mod experiment;
pub mod figures;
pub mod markdown;
pub mod paper;
pub mod product;
pub mod summary;

/// Errors are sentences for the person who runs the experiment.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
