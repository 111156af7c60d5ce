//! A marked dataset: options → survey → embedding → record, and then one geometry after the other.

use crate::{
    error::{Error, Result},
    output, record_file,
    source_files::{SourceFiles, same_file},
};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_core::{
    carrier::Carrier,
    demodulation,
    embedding::{self, Marked},
    key::SecretKey,
    map::Map,
    message::{LEAST_IDENTIFYING_BITS, Message},
    options::{Options, Parameters, Subject},
    patches::Patches,
    record::{self, Record, Reference, TopologyEntry},
};
use meshmark_dataset::{LabelFields, MOST_VERTICES, Selection, Survey, Target, survey, wkb};
use std::{fs::File, io::Read, path::Path};
use zeroize::Zeroizing;

/// What GDAL adds to the open options of any driver.
const HINTS_OF_GDAL: [&str; 3] = ["NATIVE_DATA", "VALIDATE_OPEN_OPTIONS", "NOLOCK"];

/// A key file has 150 bytes; a mistaken /dev/zero has no end.
const LONGEST_KEY_FILE: u64 = 65_536;

/// Splits NAME=VALUE texts.
pub fn split_options(texts: &[String]) -> Result<Vec<(String, String)>> {
    let split = |text: &String| match text.split_once('=') {
        // Bytes that are no text have become this character on their way here.
        Some((name, value)) if value.contains(char::REPLACEMENT_CHARACTER) => {
            Err(Error::NotUtf8(format!("the value of option {name}")))
        }
        Some((name, value)) => Ok((name.to_string(), value.to_string())),
        None => Err(Error::NotAnOption(text.clone())),
    };
    texts.iter().map(split).collect()
}

/// The options of one marking, checked as far as that is possible without the map.
pub struct Request {
    options: Options,
    subject: Subject,
    key: SecretKey,
    key_path: String,
}

impl Request {
    /// Parses the options and reads the key file. `default_key_path` serves when no KEY is given.
    pub fn new(pairs: &[(String, String)], default_key_path: Option<String>) -> Result<Self> {
        let ours =
            pairs.iter().filter(|(name, _)| !HINTS_OF_GDAL.iter().any(|h| h.eq_ignore_ascii_case(name)));
        let options = Options::parse(ours.map(|(name, value)| (name.as_str(), value.as_str())))?;
        let subject = options.subject.clone().ok_or(Error::NoSubject)?;
        let key_path = options.key_path.clone().or(default_key_path).ok_or(Error::NoKey)?;
        let key = read_key(&key_path)?;
        if let Some(record) = &options.record_path {
            output::check_is_not_record(record)?;
            record_file::check_folder(Path::new(record))?;
            if same_file(Path::new(record), Path::new(&key_path)) {
                return Err(Error::RecordIsOther { path: record.clone(), what: "key" });
            }
        }
        Ok(Request { options, subject, key, key_path })
    }

    /// Where the record shall go.
    pub fn record_path(&self) -> Option<&Path> {
        self.options.record_path.as_deref().map(Path::new)
    }

    /// Where the key came from.
    pub fn key_path(&self) -> &Path {
        Path::new(&self.key_path)
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| Error::Threads(error.to_string()))
}

fn read_key(path: &str) -> Result<SecretKey> {
    let unreadable = |e: std::io::Error| Error::KeyUnreadable { path: path.into(), reason: e.to_string() };
    let mut text = Zeroizing::new(String::with_capacity(1024));
    let file = File::open(path).map_err(unreadable)?;
    file.take(LONGEST_KEY_FILE).read_to_string(&mut text).map_err(unreadable)?;
    SecretKey::from_json(&text).map_err(|source| Error::KeyMalformed { path: path.into(), source })
}

/// The source's side of a marking.
pub struct Source<'a> {
    /// What to call it in messages.
    pub name: String,
    /// The dataset, without filters.
    pub dataset: &'a Dataset,
    /// The files it is made of, as they were before it was read.
    pub files: SourceFiles,
    /// What [`Selection::last_failure`] wants.
    pub last_failure: &'a dyn Fn() -> Option<String>,
}

/// A marked dataset.
pub struct Marking {
    /// What to call the source in messages.
    pub name: String,
    map: Survey,
    moved: Vec<[f64; 2]>,
    layers: Option<Vec<String>>,
    files: SourceFiles,
    /// The text of its record.
    pub record: String,
    /// Sentences the user should read though nothing failed.
    pub warnings: Vec<String>,
}

impl Marking {
    /// Surveys the source, and computes every vertex's new place on `threads` threads.
    pub fn new(request: &Request, source: Source, threads: usize) -> Result<Self> {
        let options = &request.options;
        check_record_is_no_source(options, &source.files)?;
        output::check_is_not_source(&source.files)?;
        let map = survey(source.dataset, &selection(options, source.last_failure))?;
        source.files.check()?; // what was surveyed is what was opened
        let on_ground = map.map()?;
        check_extent(&on_ground, &options.parameters)?;
        let message = request.subject.message(&request.key);
        let marked = pool(threads)?
            .install(|| embedding::embed(&on_ground, &request.key, &message, &options.parameters))?;
        let record = record(request, &map, &marked).to_json();
        let mut warnings = warnings(&options.parameters, &message, &map, &marked);
        warnings.extend(coordinates_as_text(source.dataset));
        Ok(Marking {
            name: source.name,
            map,
            moved: marked.coords,
            record,
            layers: options.layers.clone(),
            files: source.files,
            warnings,
        })
    }

    /// Writes the record where the request wants it.
    pub fn write_record(&self, request: &Request) -> Result<()> {
        let path = request.record_path();
        path.map_or(Ok(()), |path| record_file::write(path, &self.record))
    }

    /// Fails unless the message can be demodulated from where the vertices were found: their new places as
    /// somebody read them, in canonical order.
    pub fn check_message(&self, request: &Request, found: &[[f64; 2]], threads: usize) -> Result<()> {
        let parameters = &request.options.parameters;
        let message = request.subject.message(&request.key);
        let map = self.map.map()?;
        let pairs = map.vertices.coords().iter().zip(found);
        let observed: Vec<_> = pairs.map(|(a, b)| Some(map.ground.metres_between(*a, *b))).collect();
        let demodulated = pool(threads)?.install(|| {
            let patches = Patches::new(&map, parameters)?;
            let carrier = Carrier::new(&request.key);
            demodulation::paper(&patches, &carrier, &observed, message.len(), parameters, &|_| ())
        })?;
        match demodulated.message().errors(&message) {
            0 => Ok(()),
            errors => Err(Error::MessageUnreadable { errors, bits: message.len() }),
        }
    }

    /// The new places of the vertices, in canonical order, CRS units.
    pub fn moved(&self) -> &[[f64; 2]] {
        &self.moved
    }

    /// Whether the vertices of this layer move.
    pub fn marks_layer(&self, name: &str) -> bool {
        self.layers.as_ref().is_none_or(|layers| layers.iter().any(|layer| layer == name))
    }

    /// Moves every coordinate of a WKB geometry; how many there are.
    pub fn move_geometry(&self, bytes: &mut [u8]) -> std::result::Result<usize, NotMoved> {
        let mut count = 0;
        wkb::map_coordinates::<NotMoved>(bytes, &mut |_, point| {
            count += 1;
            let index = self.map.vertices.index_of(point).ok_or(NotMoved::UnknownVertex(point))?;
            Ok(self.moved[index])
        })?;
        Ok(count)
    }

    /// The furthest any vertex moved along x and y, CRS units.
    pub fn reach(&self) -> [f64; 2] {
        let moves = self.map.vertices.coords().iter().zip(&self.moved);
        moves.fold([0.0; 2], |reach: [f64; 2], (from, to)| {
            [0, 1].map(|axis| reach[axis].max((to[axis] - from[axis]).abs()))
        })
    }

    /// Fails when the source's files are not those that were marked.
    pub fn check_source(&self) -> Result<()> {
        self.files.check()
    }
}

/// Why a geometry was not moved.
pub enum NotMoved {
    /// Its coordinate is not in the table.
    UnknownVertex([f64; 2]),
    /// Its bytes make no sense.
    Wkb(wkb::WkbError),
}

impl From<wkb::WkbError> for NotMoved {
    fn from(error: wkb::WkbError) -> Self {
        NotMoved::Wkb(error)
    }
}

fn selection<'a>(options: &'a Options, last_failure: &'a dyn Fn() -> Option<String>) -> Selection<'a> {
    Selection {
        layers: options.layers.as_deref(),
        srs: options.srs.as_deref(),
        labels: LabelFields::None,
        target: Target::Own,
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

/// Smaller than so many tolerances a map would be noise after its marking.
const LEAST_TOLERANCES: f64 = 10.0;

fn check_extent(map: &Map, parameters: &Parameters) -> Result<()> {
    let (min, max) = map.vertices.bounds();
    let [width_m, height_m] = map.ground.metres_between(min, max);
    let size_m = width_m.max(height_m);
    let tolerance_m = parameters.tolerance_m;
    match map.vertices.len() > 1 && size_m < LEAST_TOLERANCES * tolerance_m {
        true => Err(Error::TooSmall { size_m, tolerance_m }),
        false => Ok(()),
    }
}

/// What is legal and probably not meant.
fn warnings(parameters: &Parameters, message: &Message, map: &Survey, marked: &Marked) -> Vec<String> {
    let mut warnings = Vec::new();
    if map.crs.is_none() {
        let text = "the source has no CRS: its units are taken as metres; say SRS=... if they are not";
        warnings.push(text.into());
    }
    if message.len() < LEAST_IDENTIFYING_BITS {
        warnings.push(format!(
            "a message of {} bits identifies nobody, and verification will never call it a match: use {} \
             hexadecimal digits or more",
            message.len(),
            LEAST_IDENTIFYING_BITS / 4
        ));
    }
    let channel_bits = parameters.code.encode(message).len();
    let coefficients = 2 * marked.patches * channel_bits * parameters.chip_rate; // on two axes
    let wanted_rms_m = parameters.amplitude_m * (coefficients as f64 / map.vertices.len() as f64).sqrt();
    if wanted_rms_m > parameters.tolerance_m {
        warnings.push(format!(
            "AMPLITUDE={} would move the vertices by {wanted_rms_m:.2} m RMS, more than TOLERANCE={} m, where many of \
             them are held: the map is distorted and the mark gains little; lower AMPLITUDE",
            parameters.amplitude_m, parameters.tolerance_m
        ));
    }
    warnings
}

/// What was read from a CSV file may have its coordinates among the attributes too, and those stay unmarked.
fn coordinates_as_text(dataset: &Dataset) -> Option<String> {
    let mut layers = dataset.layers();
    let layer =
        layers.find(|layer| layer.defn().fields().any(|field| field.name().eq_ignore_ascii_case("WKT")))?;
    Some(format!(
        "layer \"{}\" has an attribute \"WKT\", which stays as it is: if it holds the coordinates, anybody can undo the \
         mark; leave it out, for example with -select, or open a CSV file with KEEP_GEOM_COLUMNS=NO",
        layer.name()
    ))
}

fn record(request: &Request, map: &Survey, marked: &Marked) -> Record {
    let Request { options, subject, key, .. } = request;
    let parameters = &options.parameters;
    Record {
        meshmark_record: record::VERSION,
        software: concat!("meshmark ", env!("CARGO_PKG_VERSION")).into(),
        key_id: key.id(),
        recipient: match subject {
            Subject::Recipient(text) => Some(text.clone()),
            Subject::Message(_) => None,
        },
        message: subject.message(key).to_hex(),
        amplitude_m: parameters.amplitude_m,
        code: parameters.code,
        chip_rate: parameters.chip_rate,
        patch_size: parameters.patch_size,
        tolerance_m: parameters.tolerance_m,
        shape: parameters.shape,
        basis: parameters.laplacian,
        precision_crs_units: parameters.precision,
        layers: options.layers.clone(),
        srs: options.srs.clone(),
        reference: Reference {
            vertices: map.vertices.len(),
            patches: marked.patches,
            vertices_sha256: map.vertices.digest(),
            crs: map.crs.as_ref().map(|crs| crs.label()),
        },
        displacement: marked.displacement,
        angles: marked.angles,
        topology: TopologyEntry { t_junctions: marked.junctions, attenuated_vertices: marked.attenuated },
    }
}
