//! A marked dataset: options → survey → embedding → record, and then geometries one by one.

use crate::{
    error::{Error, Result},
    ffi_errors, output,
    progress::Bar,
    record_file,
    source_files::SourceFiles,
};
use gdal::Dataset;
use meshmark_core::{
    carrier::Carrier,
    demodulation,
    embedding::Embedding,
    fingerprint,
    fingerprint_embedding::{FingerprintEmbedding, Settlement},
    fingerprint_record::BaseEntry,
    key::{SecretKey, read_text},
    map::Map,
    options::{Options, Spelling, Subject},
    patches::Patches,
    recorded::Recorded,
};
use meshmark_dataset::{
    GeosOfGdal, LabelFields, MOST_VERTICES, ScratchFiles, Selection, Survey,
    decimals::Digits,
    read_bases, same_file, survey,
    traces::{self, ForeignMembers},
};
use meshmark_marking::{
    self as marking, Bases, Lineage, Moves, ThreadPool, Unmarked, damage_warning, exposure,
};
use std::{
    fs::File,
    path::{Path, PathBuf},
    slice,
};

/// The noise that the estimates from a file that was read back assume, metres.
const READ_BACK_NOISE_M: f64 = 0.01;

/// Options that GDAL adds to the open options of any driver.
const HINTS_OF_GDAL: [&str; 3] = ["NATIVE_DATA", "VALIDATE_OPEN_OPTIONS", "NOLOCK"];

/// Splits NAME=VALUE texts.
pub fn split_options(texts: &[String]) -> Result<Vec<(String, String)>> {
    let split = |text: &String| match text.split_once('=') {
        // The conversion to text replaces bytes that are not UTF-8 by this character.
        Some((name, value)) if value.contains(char::REPLACEMENT_CHARACTER) => {
            Err(Error::NotUtf8(format!("the value of option {name}")))
        }
        Some((name, value)) => Ok((name.to_string(), value.to_string())),
        None => Err(Error::NotAnOption(text.clone())),
    };
    texts.iter().map(split).collect()
}

/// The options of one marking, checked as far as possible without the map.
pub struct MarkingRequest {
    options: Options,
    subject: Subject,
    key: SecretKey,
    key_path: String,
    /// The warning about a key file that others can read.
    exposed: Option<String>,
    /// The progress of the marking.
    pub progress: Bar,
}

impl MarkingRequest {
    /// Parses the options and reads the key file, by default that of `default_key_path`.
    pub fn new(pairs: &[(String, String)], default_key_path: Option<String>) -> Result<Self> {
        let ours =
            pairs.iter().filter(|(name, _)| !HINTS_OF_GDAL.iter().any(|h| h.eq_ignore_ascii_case(name)));
        let options = Options::parse_for_marking(ours.map(|(name, value)| (name.as_str(), value.as_str())))?;
        let subject = options.subject.clone().ok_or(Error::NoSubject)?;
        let key_path = options.key_path.clone().or(default_key_path).ok_or(Error::NoKey)?;
        let (key, exposed) = read_key(&key_path)?;
        if let Some(record) = &options.record_path {
            output::check_is_not_record(record)?;
            record_file::check_folder(Path::new(record))?;
            if same_file(Path::new(record), Path::new(&key_path)) {
                return Err(Error::RecordIsOther { path: record.clone(), what: "key" });
            }
        }
        for (option, paths) in inputs(&options) {
            output::check_is_not_input(option, paths)?;
        }
        Ok(MarkingRequest { options, subject, key, key_path, exposed, progress: Bar::wanted() })
    }

    /// Renames the chosen layers to the names under which they are staged; layers without such a
    /// name stay and are later reported as missing.
    pub fn rename_layers<'a>(&mut self, staged: impl Fn(&str) -> Option<&'a str>) {
        for name in self.options.layers.iter_mut().flatten() {
            if let Some(staged) = staged(name) {
                *name = staged.into();
            }
        }
    }

    /// Marks a map on its bases; returns the lineage of a fingerprint, too.
    fn embed(&self, map: Map, bases: &Bases) -> meshmark_core::Result<(Settlement, Lineage)> {
        let MarkingRequest { options, subject, key, progress, .. } = self;
        let Options { parameters, coefficients, .. } = options;
        if let (Some(coefficients), Subject::Recipient(recipient)) = (coefficients, subject) {
            let series = bases.series(map, parameters)?;
            let embedding =
                FingerprintEmbedding::new(&series, key, *coefficients)?.with_columns(&ScratchFiles);
            let fingerprint = embedding.fingerprint(recipient);
            progress.begin(embedding.patches());
            let wanted = embedding.wanted(slice::from_ref(&fingerprint), &|_| progress.step())?;
            let wanted = wanted.into_iter().next().expect("one for each fingerprint");
            let divided = embedding.divided(&wanted);
            return Ok((embedding.settle_stored(&fingerprint, wanted)?, bases.lineage(divided)));
        }
        let message = subject.carried(key);
        let embedding = Embedding::new(&map, key, message.len(), parameters)?;
        progress.begin(embedding.patches());
        let wanted = embedding.wanted(slice::from_ref(&message), &|_| progress.step())?;
        Ok((embedding.settle(&message, &wanted[0])?.into(), Lineage::default()))
    }

    /// Returns the path of the record.
    pub fn record_path(&self) -> Option<&Path> {
        self.options.record_path.as_deref().map(Path::new)
    }

    /// Returns the option that names this file as an input of the marking beside its source.
    pub fn input_at(&self, path: &Path) -> Option<&'static str> {
        let names = |paths: &[String]| paths.iter().any(|named| same_file(Path::new(named), path));
        inputs(&self.options).into_iter().find(|(_, paths)| names(paths)).map(|(option, _)| option)
    }

    /// Returns the path of the key file.
    pub fn key_path(&self) -> &Path {
        Path::new(&self.key_path)
    }
}

/// Returns the files of a series that options name, by their option.
fn inputs(options: &Options) -> [(&'static str, &[String]); 3] {
    let Options { bases, base_references, sheets, .. } = options;
    [
        ("BASE", bases.as_deref().unwrap_or_default()),
        ("BASE_REFERENCE", base_references.as_deref().unwrap_or_default()),
        ("SHEETS", sheets.as_slice()),
    ]
}

fn pool(threads: usize) -> Result<ThreadPool> {
    // GEOS reports the faults of invalid geometries on the calling thread.
    let pool = ThreadPool::new(threads, ffi_errors::hush, ffi_errors::unhush);
    pool.map_err(Error::Threads)
}

/// Reads a key file; returns a warning too if others can read it.
fn read_key(path: &str) -> Result<(SecretKey, Option<String>)> {
    let unreadable = |source| Error::KeyUnreadable { path: path.into(), source };
    let file = File::open(path).map_err(unreadable)?;
    let exposed = exposure(Path::new(path), &file);
    let text = read_text(file).map_err(unreadable)?;
    let key = SecretKey::from_json(&text);
    Ok((key.map_err(|source| Error::KeyMalformed { path: path.into(), source })?, exposed))
}

/// The source of a marking.
pub struct Source<'a> {
    /// Its name for messages.
    pub name: String,
    /// The dataset, without filters.
    pub dataset: &'a Dataset,
    /// Its files in their state before it was read.
    pub files: SourceFiles,
    /// Whether it is staged, so that the mark is read back from the file that is made of it.
    pub is_staged: bool,
    /// The function for [`Selection::last_failure`].
    pub last_failure: &'a dyn Fn() -> Option<String>,
    /// Reads the reference of an earlier edition.
    pub read_base: &'a mut dyn FnMut(&Path, &Selection) -> meshmark_dataset::Result<Survey>,
}

/// A marked dataset.
pub struct Marking {
    /// The name of the source for messages.
    pub name: String,
    map: Survey,
    bases: Bases,
    moved: Vec<[f64; 2]>,
    layers: Option<Vec<String>>,
    files: SourceFiles,
    /// Its record, if one is wanted.
    pub record: Option<Recorded>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

impl Marking {
    /// Surveys the source and computes the new place of every vertex on `threads` threads.
    pub fn new(request: &MarkingRequest, source: Source, threads: usize) -> Result<Self> {
        let options = &request.options;
        check_record_is_no_source(options, &source.files)?;
        output::check_is_not_source(&source.files)?;
        let mut map = survey(source.dataset, &selection(options, source.last_failure))?;
        source.files.check()?; // what was surveyed is what was opened
        let on_ground = map.map(&options.parameters)?;
        marking::check_extent(&on_ground, &options.parameters)?;
        marking::check_scale(&on_ground, map.crs())?;
        let mut read = |path: &PathBuf, entry: &BaseEntry| {
            let selection = Selection { geometries: false, ..selection(options, source.last_failure) };
            let (layers, srs) = (entry.layers.as_deref(), entry.srs.as_deref());
            match (source.read_base)(path, &Selection { layers, srs, ..selection }) {
                Err(error) if error.is_of_other_layers() => Ok(None),
                read => read.map(Some),
            }
        };
        let bases = read_bases(options, &request.key, &map, &mut read)?;
        let pool = pool(threads)?;
        let (settlement, lineage) = pool.install(|| request.embed(on_ground, &bases))?;
        if !source.is_staged {
            map.data.release_mesh();
        }
        let marked = settlement.marked(&map.data.vertices)?;
        let parameters = &options.parameters;
        let on_ground = map.map(parameters)?;
        let distortion = map.geometries.as_ref().map(|geometries| {
            pool.install(|| {
                Unmarked::new(geometries, &on_ground, &GeosOfGdal).distortion(&marked, parameters)
            })
        });
        let areas = distortion.as_ref().map(|distortion| &distortion.areas);
        let spelling = Spelling::OpenOption;
        let damage = damage_warning(parameters, &marked.angles, areas, spelling);
        let record = distortion.map(|distortion| {
            let reference = marking::reference(&map.data.vertices, map.crs(), marked.patches);
            marking::recorded(options, &request.subject, &request.key, (reference, lineage), distortion)
        });
        map.geometries = None;
        let message = options.coefficients.is_none().then(|| request.subject.carried(&request.key));
        let of_mark = marking::warnings(
            options,
            message.as_ref(),
            (&map.data.vertices, map.crs()),
            marked.patches,
            spelling,
        );
        let signless = marking::signless_warning(&marked, options, spelling);
        let of_name = request.subject.recipient().and_then(marking::spelling_warning);
        let of_request = request.exposed.iter().cloned().chain(of_name);
        let warnings = of_request.chain(of_mark).chain(signless).chain(damage).collect();
        Ok(Marking {
            name: source.name,
            map,
            bases,
            moved: marked.coords,
            record,
            layers: options.layers.clone(),
            files: source.files,
            warnings,
        })
    }

    /// Adds warnings about the traces in the source.
    pub fn search_traces(
        &mut self,
        request: &MarkingRequest,
        source: &Dataset,
        foreign: &ForeignMembers,
        last_failure: &dyn Fn() -> Option<String>,
    ) -> Result<()> {
        let found = traces::search(source, &self.map, &request.options, foreign, last_failure)?;
        self.warnings.extend(traces::warnings(&found, &request.options, Spelling::OpenOption)?);
        Ok(())
    }

    /// Writes the record to the path of the request.
    pub fn write_record(&self, request: &MarkingRequest) -> Result<()> {
        let wanted = request.record_path().zip(self.record.as_ref());
        wanted.map_or(Ok(()), |(path, record)| record_file::write(path, &record.to_json()))
    }

    /// Fails unless the mark can be read from the places `found` of the vertices, which are their
    /// new places as read back, in canonical order.
    ///
    /// For a message [`demodulation::paper`] suffices: every vertex is found and none is deformed, so there are
    /// no erasures for [`demodulation::joint`] to leave out, and the noise that it would weigh, the
    /// rounding to the digits of the format, has no estimate here. [`Embedding`] has an estimate of
    /// its own noise and uses `joint`. The two checks stay different, as a change of the
    /// demodulator would change which outputs are refused.
    pub fn check_mark(
        &self,
        request: &MarkingRequest,
        found: &[[f64; 2]],
        digits: Digits,
        threads: usize,
    ) -> Result<()> {
        let MarkingRequest { options: Options { parameters, coefficients, .. }, subject, key, .. } = request;
        let map = self.map.map(parameters)?;
        let pool = pool(threads)?;
        if let (Some(coefficients), Subject::Recipient(recipient)) = (*coefficients, subject) {
            let bases = &self.bases;
            let score = pool.install(|| {
                let series = bases.series(map, parameters)?;
                let embedding = FingerprintEmbedding::new(&series, key, coefficients)?;
                embedding.score(&embedding.fingerprint(recipient), found, READ_BACK_NOISE_M)
            })?;
            return fingerprint::check_score(score)
                .map_err(|_| Error::FingerprintUnreadable { score, digits });
        }
        let pairs = map.vertices.coords().iter().zip(found);
        let observed: Vec<_> = pairs.map(|(a, b)| Some(map.ground.metres_between(*a, *b))).collect();
        let message = subject.carried(key);
        let demodulated = pool.install(|| {
            let (patches, carrier) = (Patches::new(&map, parameters)?, Carrier::new(key));
            demodulation::paper(&patches, &carrier, &observed, message.len(), parameters, &|_| ())
        })?;
        match demodulated.message().errors(&message) {
            0 => Ok(()),
            errors => Err(Error::MessageUnreadable { errors, bits: message.len(), digits }),
        }
    }

    /// Returns the new places of the vertices, in canonical order, CRS units.
    pub fn moved(&self) -> &[[f64; 2]] {
        &self.moved
    }

    /// Returns whether the vertices of this layer move.
    pub fn marks_layer(&self, name: &str) -> bool {
        self.layers.as_ref().is_none_or(|layers| layers.iter().any(|layer| layer == name))
    }

    /// Returns the movement of the vertices.
    pub fn moves(&self) -> Moves<'_> {
        Moves { from: &self.map.data.vertices, to: &self.moved }
    }

    /// Returns the furthest movement of any vertex along x and y, CRS units.
    pub fn reach(&self) -> [f64; 2] {
        let moves = self.map.data.vertices.coords().iter().zip(&self.moved);
        moves.fold([0.0; 2], |reach: [f64; 2], (from, to)| {
            [0, 1].map(|axis| reach[axis].max((to[axis] - from[axis]).abs()))
        })
    }

    /// Fails when a layer that was read to its end yielded another number of features than were
    /// marked.
    pub fn check_count(&self, layer: String, number: usize, came: u64) -> Result<()> {
        match self.map.features.get(&number) {
            Some(&marked) if marked != came => Err(Error::OtherCount { layer, marked, came }),
            _ => Ok(()),
        }
    }

    /// Fails when the source's files are not those that were marked.
    pub fn check_source(&self) -> Result<()> {
        self.files.check()
    }
}

fn selection<'a>(options: &'a Options, last_failure: &'a dyn Fn() -> Option<String>) -> Selection<'a> {
    Selection {
        layers: options.layers.as_deref(),
        srs: options.srs.as_deref(),
        recorded_crs: None,
        labels: LabelFields::None,
        geometries: options.record_path.is_some(),
        most_vertices: MOST_VERTICES,
        last_failure,
    }
}

fn check_record_is_no_source(options: &Options, files: &SourceFiles) -> Result<()> {
    match &options.record_path {
        Some(path) if files.contain(Path::new(path)) => {
            Err(Error::RecordIsOther { path: path.clone(), what: "source" })
        }
        _ => Ok(()),
    }
}
