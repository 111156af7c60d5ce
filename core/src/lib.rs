//! Mesh-spectral watermarking of 2D vector maps: the algorithm, without files and without GDAL.
//!
//! The method is that of R. Ohbuchi, H. Ueda and S. Endoh, *Watermarking 2D Vector Maps in the
//! Mesh-Spectral Domain*, Shape Modeling International 2003 ("the paper"). Each step has a module,
//! in the order of the data flow: [`vertices`] → [`mesh`] → [`patches`] → [`spectrum`] → [`code`] →
//! [`carrier`] → [`embedding`], and back through [`demodulation`]. What a recipient gets is a
//! [`fingerprint`]: [`fingerprint_embedding`] marks the parts of a map, which [`series`] finds, and
//! [`estimation`] and [`agreement`] read it.
//!
//! ```
//! use meshmark_core::{
//!     carrier::Carrier, deformation::Deformation, demodulation, embedding, ground::Ground, key::SecretKey,
//!     map::Map, message::Message, options::Parameters, patches::Patches, vertices::VertexTable,
//! };
//! # fn main() -> Result<(), meshmark_core::Error> {
//! // A map of 30 × 30 slightly uneven vertices, 10 m apart.
//! let jitter = |i: usize| (i * 7919 % 101) as f64 / 40.0;
//! let coords = (0..900).map(|i| [(i % 30 * 10) as f64 + jitter(i), (i / 30 * 10) as f64 + jitter(i + 1)]);
//! let table = VertexTable::new(coords.collect())?;
//! let map = Map::of_points(&table, &Ground::METRES);
//! let key = SecretKey::from_bytes([7; 32]);
//! let message = Message::from_hex("00112233445566778899aabbccddeeff")?;
//! let parameters = Parameters::default();
//!
//! let marked = embedding::embed(&map, &key, &message, &parameters)?;
//! assert!(marked.displacement.max_m < parameters.tolerance_m);
//!
//! // The auditor has the reference, the key and the marked map.
//! let patches = Patches::new(&map, &parameters)?;
//! let moved = table.coords().iter().zip(&marked.coords);
//! let observed: Vec<_> = moved.map(|(r, s)| Some([s[0] - r[0], s[1] - r[1]])).collect();
//! let disturbance = Deformation::none(0.01).predict(&patches, &observed, 256, parameters.amplitude_m);
//! let found = demodulation::joint(
//!     &patches, &Carrier::new(&key), &observed, message.len(), &parameters, &disturbance, &|_| ())?;
//! assert_eq!(found.message(), message);
//! # Ok(()) }
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod agreement;
pub mod anchors;
pub mod areas;
pub mod bodies;
pub mod borders;
mod box_plan;
mod boxes;
pub mod carrier;
mod changes;
pub mod code;
pub mod columns;
pub mod constraints;
mod covariance;
pub mod deformation;
pub mod demodulation;
pub mod derived;
pub mod disjoint_sets;
pub mod distortion;
pub mod embedding;
mod error;
pub mod estimation;
pub mod fingerprint;
pub mod fingerprint_embedding;
pub mod fingerprint_record;
pub mod ground;
pub mod hex;
pub mod junctions;
pub mod key;
pub mod map;
pub mod map_data;
pub mod mesh;
pub mod message;
pub mod modulation;
pub mod mosaic;
mod motion;
mod nearness;
pub mod noise_law;
pub mod options;
pub mod orientation;
pub mod part;
pub mod patches;
mod placement;
pub mod record;
pub mod recorded;
mod response;
pub mod scale;
pub mod series;
mod settled_boxes;
pub mod sheet_plan;
mod sides;
pub mod signs;
mod slicing;
mod sorted_runs;
pub mod spectrum;
pub mod stiffness;
mod submap;
mod topology;
mod tridiagonal;
pub mod vertices;
mod whitening;
mod words;

pub use error::{Error, Result};
pub use words::{counted, visible};
