//! The GDAL driver: `MESHMARK:<any vector dataset>` is that dataset with marked geometry.
//!
//! ```text
//! GDAL ── RegisterOGRMESHMARK, MeshmarkFilter ──> ffi ──> cpp/ (GDALDataset and OGRLayer, subclassed)
//!                                                            │ open, move, reach, unchanged
//!              source_files, record_file <── marking <── ffi <┘
//!                                             │
//!                             dataset::survey, core::embedding
//! ```
//!
//! Writing stages what a host writes, and marks it when the host closes the dataset: [`writer`] has the picture.
//!
//! Opening computes the mark: the vertex table and its new coordinates are all that is held in
//! memory. Features stream through the C++ layer, which hands each geometry to [`marking`] as WKB.
#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

mod error;
mod ffi;
mod ffi_errors;
mod ffi_features;
mod ffi_native_data;
mod ffi_output;
mod ffi_source;
mod ffi_text;
mod ffi_writer;
mod marking;
mod output;
mod read_back;
mod record_file;
mod source_files;
mod staged_layer;
mod target;
mod writer;
