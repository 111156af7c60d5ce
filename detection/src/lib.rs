//! Detection compares two maps as numbers and returns a verdict. It uses no files and no GDAL.
//!
//! ```text
//! reference ─► patches ───────────────────────┐
//!                                             ▼
//! suspect ─► registration ─► matching ─► tracking, demodulation ─► decision
//!                 no key is used              │ the key                │ the message
//! ```
//!
//! | question | where it is answered |
//! |---|---|
//! | Where does the suspect lie on the reference? | [`registration`] |
//! | Which vertex is which, and within which radius? | [`matching`] |
//! | What moved the vertices besides the mark? | `tracking.rs`, `meshmark-core`'s `deformation` |
//! | What evidence do the displacements give under a key? | [`Matched::demodulate`] |
//! | Would a mark show on this suspect? | [`power`] |
//! | Match, no match, or inconclusive, at what p-value? | [`decision`] |
//!
//! The example marks a synthetic town for a recipient, shifts it, and recognises the copy of that
//! recipient:
//!
//! ```
//! use meshmark_core::{embedding, ground::Ground, key::SecretKey, map_data::{ChainKind, MapData}, options::*};
//! use meshmark_detection::{*, decision::*, matching::RadiusChoice, power::Power, registration::*};
//! # fn main() -> Result<(), meshmark_core::Error> {
//! // 400 houses of four corners, 20 m apart; the last corner of a ring is the first one.
//! let corner = |i: usize| [[0, 0], [9, 0], [9, 7], [0, 7], [0, 0]][i % 5].map(|metres| metres as f64);
//! let house = |i: usize| [(i / 5 % 20 * 20 + i / 5 % 7) as f64, (i / 100 * 20 + i / 5 % 3) as f64];
//! let coords = (0..2000).map(|i| [corner(i)[0] + house(i)[0], corner(i)[1] + house(i)[1]]).collect();
//! let starts: Vec<u32> = (0..2000).step_by(5).collect();
//! let (town, _) = MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 400])?;
//! let map = town.on(&Ground::METRES, &Ground::METRES);
//!
//! let (key, parameters) = (SecretKey::from_bytes([7; 32]), Parameters::default());
//! let recipient = Subject::Recipient("ACME GmbH".into());
//! let copy = embedding::embed(&map, &key, &recipient.carried(&key), &parameters)?;
//! let suspect = town.moved::<meshmark_core::Error>(|_| Ok(copy.coords.iter().map(|p| [p[0] + 0.4, p[1]]).collect()))?;
//!
//! let reference = Reference::new(&town, &map, 128, &parameters)?;
//! let registration = Registrar::new(&town, &reference.ground, 1.0).register(&suspect, Start::Auto);
//! let matched = Matched::new(&reference, &suspect, &registration, RadiusChoice::FromData);
//! let mark = Mark { key: &key, bits: 128, parameters: &parameters };
//! let found = matched.demodulate(mark, Demodulator::Joint, &|_| ())?;
//! let power = Power::measure(&matched, &found, mark, Demodulator::Joint, &|_| ())?;
//! let decision = decide_among(&found.found, power, &Expected::new(&recipient, &key), 1, 1e-6);
//! assert_eq!(decision.verdict, Verdict::Match);
//! # Ok(()) }
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs)]

mod coalitions;
mod corners;
pub mod decision;
mod edges;
mod estimated;
mod examination;
mod features;
mod groups;
mod growth;
mod histogram;
mod linework;
mod matched;
pub mod matching;
mod observations;
mod observed_on;
pub mod power;
mod progress;
pub mod registration;
mod tracking;

pub use estimated::Estimated;
pub use examination::{Demodulated, Demodulator, Mark};
pub use features::maps_of_features;
pub use histogram::{Histogram, round_up};
pub use matched::{Matched, Reference};
pub use observed_on::Observations;
pub use progress::{Listener, Progress};
