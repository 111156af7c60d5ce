//! The GDAL driver: `MESHMARK:<any vector dataset>` opens that dataset with marked geometry.
//!
//! ```text
//! GDAL ── RegisterOGRMESHMARK, MeshmarkFilter ──> ffi ──> cpp/ (GDALDataset and OGRLayer, subclassed)
//!                                                            │ open, move, reach, unchanged
//!              source_files, record_file <── marking <── ffi <┘
//!                                             │
//!                             dataset::survey, core::embedding
//! ```
//!
//! Writing stages the features of a host and marks them when the host closes the dataset:
//! `writer.rs` shows the data flow.
//!
//! Opening computes the mark; only the vertex table and its new coordinates stay in memory.
//! Features stream through the C++ layer, which passes each geometry to `marking.rs` as WKB.
#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

mod error;
mod ffi;
mod ffi_errors;
mod ffi_features;
#[cfg(test)]
mod ffi_memory;
mod ffi_native_data;
mod ffi_output;
mod ffi_progress;
mod ffi_source;
mod ffi_text;
mod ffi_writer;
mod marking;
mod output;
mod progress;
mod read_back;
mod record_file;
mod source_files;
mod staged_layer;
mod target;
mod writer;
