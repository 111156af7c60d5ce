//! The library that tests, studies and benchmarks share: the hosts that use the product, the
//! product as its users have it, and what happens to maps.
//!
//! - [`plugin`]: GDAL's programs with the driver, in a folder of their own; [`contents`]: what a
//!   dataset holds
//! - [`product`]: a build of driver and command; [`process`]: a program with its time and memory,
//!   and the C compiler
//! - [`attacks`]: from a map to a map; [`tiling`]: larger maps
//! - [`experiment`]: maps are marked, copies attacked, suspects verified
//! - [`faults`]: killed writers and full disks; [`vectors`], [`fingerprint_vectors`]: the test
//!   vectors of the two versions of the mark

pub mod attacks;
mod built;
pub mod contents;
pub mod editions;
pub mod experiment;
pub mod faults;
pub mod fingerprint_vectors;
pub mod plugin;
pub mod process;
pub mod product;
pub mod tiling;
pub mod vectors;

/// The result of an attack or an experiment; errors are sentences for the person who runs it.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error + Send + Sync>>;
