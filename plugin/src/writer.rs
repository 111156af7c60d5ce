//! The write side: the features of a host are staged; when the host closes the dataset, they are
//! marked and published.
//!
//! ```text
//! host ──layers, fields──> schema (an empty dataset of the real driver: the capabilities)
//!      ──features────────> staging GeoPackage, in the end the REFERENCE
//! close: staging ──marking──> the real driver ──read_back──> publication
//! ```
//!
//! After a failure no call of a host leads to publication: a writer that failed once only cleans
//! up.

use crate::{
    error::{Error, Result},
    ffi_features::FeatureRef,
    ffi_output::{Described, Field, LayerSpec, Output},
    ffi_source::{Borrowed, OwnedSource, View},
    marking::{Marking, MarkingRequest},
    read_back,
    staged_layer::StagedLayer,
    target::{Places, Target},
};
use meshmark_core::recorded::Recorded;
use meshmark_dataset::{
    Action, digest_of_only_file, file_digest, file_error,
    publication::{Move, Publication},
};
use std::{fs, path::Path};

/// The function that marks an open dataset; the border provides it.
pub type Mark<'a> = &'a dyn Fn(&MarkingRequest, &Borrowed) -> Result<Marking>;

/// A dataset under construction.
pub struct Writer {
    // Fields are dropped in this order: datasets before their folders.
    schema: Output,
    staged: Output,
    target: Target,
    request: MarkingRequest,
    layers: Vec<StagedLayer>,
    open_transactions: usize,
    /// The reason why nothing will be published.
    failed: Option<String>,
    places: Places,
}

impl Writer {
    /// Checks the places of the files and makes workplaces there.
    pub fn new(target: Target, request: MarkingRequest) -> Result<Self> {
        let places = target.places(&request)?;
        let driver = target.format.driver;
        let schema = Output::create(driver, &places.main.subfolder("schema")?.join(target.file_name()))?;
        let staged = Output::create("GPKG", &places.staged)?;
        staged.begin()?;
        let (layers, open_transactions, failed) = (Vec::new(), 0, None);
        Ok(Writer { schema, staged, target, request, layers, open_transactions, failed, places })
    }

    /// Returns the empty dataset of the real driver that hosts are shown.
    pub fn schema(&self) -> &Output {
        &self.schema
    }

    /// Returns the name of the target for messages.
    pub fn name(&self) -> &str {
        &self.target.name
    }

    /// Creates a layer and returns its number.
    pub fn add_layer(&mut self, spec: LayerSpec) -> Result<usize> {
        self.keep_failure(|writer| {
            let format = writer.target.format;
            if !writer.layers.is_empty() && !format.many_layers {
                return Err(meshmark_dataset::Error::OneLayer { driver: format.driver }.into());
            }
            if format.is_wgs84_only(&spec.options) && !spec.is_wgs84() {
                return Err(
                    meshmark_dataset::Error::NotWgs84 { driver: format.driver, layer: spec.name }.into()
                );
            }
            writer.schema.add_layer(&spec, false)?;
            let number = writer.layers.len();
            let layer = StagedLayer::new(spec, number, &writer.schema, &mut writer.staged, format)?;
            writer.layers.push(layer);
            let fields = writer.schema.fields(number);
            fields.iter().try_for_each(|field| writer.stage_field(number, field, &field.name))?;
            Ok(number)
        })
    }

    /// Creates a field. A format without such a field is reported to the host and is not a failure
    /// of the dataset.
    pub fn add_field(&mut self, layer: usize, field: &Field, approximate: bool) -> Result<()> {
        let before = self.schema.field_count(layer);
        self.schema.add_field(layer, field, approximate, false)?;
        let fields = self.schema.fields(layer);
        let added = &fields[before.min(fields.len())..];
        self.keep_failure(|writer| {
            added.iter().try_for_each(|added| writer.stage_field(layer, added, &field.name))
        })
    }

    fn stage_field(&mut self, layer: usize, field: &Field, name: &str) -> Result<()> {
        self.layers[layer].add_field(&self.staged, field, name)
    }

    /// Stages a feature and gives it its id.
    pub fn write(&mut self, layer: usize, feature: FeatureRef) -> Result<()> {
        self.keep_failure(|writer| {
            let id = writer.layers[layer].write(&writer.staged, feature)?;
            feature.set_id(id);
            Ok(())
        })
    }

    /// Begins a transaction of a host.
    pub fn begin(&mut self) {
        self.open_transactions += 1;
    }

    /// Commits a transaction of a host; returns false when there is none.
    pub fn commit(&mut self) -> bool {
        let open = self.open_transactions > 0;
        self.open_transactions -= usize::from(open);
        open
    }

    /// Rolls a transaction of a host back, after which the dataset is incomplete.
    pub fn roll_back(&mut self) {
        self.open_transactions = self.open_transactions.saturating_sub(1);
        self.failed.get_or_insert("a transaction was rolled back".into());
    }

    fn keep_failure<T>(&mut self, f: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if let Some(reason) = &self.failed {
            return Err(Error::Unfinished(reason.clone()));
        }
        let result = f(self);
        if let Err(error) = &result {
            self.failed = Some(error.to_string());
        }
        result
    }

    /// Marks, writes, reads back and publishes; `host_failure` is the failure that the host
    /// reported before it closed the dataset. Returns warnings for the user.
    pub fn finish(
        self,
        described: &Described,
        host_failure: Option<String>,
        mark: Mark,
        threads: usize,
    ) -> Result<Vec<String>> {
        if let Some(reason) = self.why_not(host_failure) {
            return Err(Error::Unfinished(reason));
        }
        // Variables are dropped in reverse order: datasets before their folders.
        let Writer { places, target, mut request, layers, schema, staged, .. } = self;
        request.rename_layers(|name| {
            layers.iter().find(|layer| layer.spec.name == name).map(|layer| &*layer.name)
        });
        staged.describe(described);
        (0..layers.len()).for_each(|layer| staged.describe_layer(layer, described));
        staged.commit()?;
        staged.close()?;
        let source = OwnedSource::open(&places.staged.display().to_string(), false)?;
        let marking = mark(&request, &source.dataset())?;
        let view = View::new(source, marking)?;
        let folder = places.main.subfolder("out")?;
        let file = folder.join(target.file_name());
        let names = write_marked(&file, &target, &schema, &layers, &view, described)?;
        let written = read_back::Written { path: &file, format: target.format, layers: names };
        read_back::check(&written, &view, &request, threads)?;
        let warnings = view.marking().warnings.clone();
        let record = view.marking().record.clone();
        drop((view, schema));
        let record = record.map(|record| with_digests(record, &places, &folder)).transpose()?;
        publish(&target, &places, &folder, record.map(|record| record.to_json()).as_deref())?;
        request.progress.end();
        Ok(warnings)
    }

    fn why_not(&self, host_failure: Option<String>) -> Option<String> {
        let open = (self.open_transactions > 0).then(|| "a transaction is still open".to_string());
        let reported =
            host_failure.map(|reason| format!("a failure was reported before it was closed ({reason})"));
        self.failed.clone().or(open).or(reported)
    }
}

/// Writes all marked layers by the real driver, one after the other, and returns their names in it.
fn write_marked(
    path: &Path,
    target: &Target,
    schema: &Output,
    layers: &[StagedLayer],
    view: &View,
    described: &Described,
) -> Result<Vec<read_back::WrittenLayer>> {
    let mut output = Output::create(target.format.driver, path)?;
    output.describe(described);
    output.copy_domains(schema);
    if target.format.many_layers {
        output.begin()?;
    }
    let mut written = Vec::new();
    for (number, layer) in layers.iter().enumerate() {
        output.add_layer(&layer.spec, true)?;
        output.describe_layer(number, described);
        for field in schema.fields(number).iter().skip(output.field_count(number)) {
            output.add_field(number, field, true, true)?;
        }
        layer.write_marked(view, &output)?;
        let [name, ..] = output.names(number);
        let options = layer.spec.options.clone();
        written.push(read_back::WrittenLayer { staged: layer.name.clone(), name, options });
    }
    if target.format.many_layers {
        output.commit()?;
    }
    output.close()?;
    Ok(written)
}

/// Returns the record with the digests of the reference and, where it is one file, of the copy in
/// `folder`.
fn with_digests(record: Recorded, places: &Places, folder: &Path) -> Result<Recorded> {
    let Recorded::Fingerprint(mut record) = record else { return Ok(record) };
    let reference = file_digest(&places.staged);
    record.reference.file_sha256 =
        Some(reference.map_err(|e| file_error(Action::Reading, &places.staged, e))?);
    record.copy.file_sha256 =
        digest_of_only_file(folder).map_err(|e| file_error(Action::Reading, folder, e))?;
    Ok(Recorded::Fingerprint(record))
}

/// Puts record, reference and the files in `folder` into their places.
fn publish(target: &Target, places: &Places, folder: &Path, record: Option<&str>) -> Result<()> {
    let mut publication = Publication { overwrite: target.replaces, ..Publication::default() };
    if let Some(((staged, to), record)) = places.record.as_ref().zip(record) {
        fs::write(staged, record).map_err(|e| file_error(Action::Writing, staged, e))?;
        let is_there = fs::read(to).is_ok_and(|bytes| bytes == record.as_bytes());
        if !is_there {
            publication.companions.push(Move { from: staged.clone(), to: to.clone() });
        }
    }
    publication.companions.push(Move { from: places.staged.clone(), to: target.reference.clone() });
    let retired_folder = places.main.subfolder("old")?;
    for path in target.side_files(folder)? {
        publication
            .retired
            .push(Move { to: retired_folder.join(path.file_name().unwrap_or_default()), from: path });
    }
    let entries = fs::read_dir(folder).map_err(|e| file_error(Action::Reading, folder, e))?;
    for entry in entries.flatten() {
        if entry.path().is_dir() {
            return Err(meshmark_dataset::Error::Folder { driver: target.format.driver }.into());
        }
        let part = Move { to: target.path.with_file_name(entry.file_name()), from: entry.path() };
        match part.to == target.path {
            true => publication.main = part,
            false => publication.companions.push(part),
        }
    }
    Ok(publication.run(places.main.folder())?)
}
