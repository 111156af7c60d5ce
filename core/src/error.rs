use crate::{
    counted,
    options::{Code, Kind, OPTIONS, PATCH_SIZE_RANGE, RECIPIENT_BITS, Spelling},
    visible,
};
use std::fmt;

/// The errors of the algorithm. Every message states what would have been legal.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    NotFinite { index: usize, x: f64, y: f64 },
    TooWide { span: f64 },
    NoVertices,
    TooFewVertices { vertices: usize, patch_size: usize, code: Code, chip_rate: usize },
    TooFewFree { free: usize, vertices: usize, patch_size: usize },
    TooFewInParts { vertices: usize, patch_size: usize },
    Collinear { vertices: usize },
    TooManyCoefficients { code: Code, bits: usize, chip_rate: usize, vertices: usize, of: usize },
    TooManySigns { coefficients: usize, vertices: usize, of: usize },
    CodeLength { bits: usize },
    PrecisionTooCoarse { precision: f64, metres: f64, tolerance_m: f64 },
    MessageLost { errors: usize, bits: usize },
    FingerprintLost { score: f64, least: f64 },
    NoConvergence { vertices: usize },
    Column { reason: String },
    Message(String),
    Key(KeyFault),
    Record(RecordFault),
    Plan(PlanFault),
    Anchors { vertices: usize },
    UnknownOption(String),
    RepeatedOption(&'static str),
    EmptyOption(&'static str),
    Recipient { name: String, fault: RecipientFault },
    AlikeRecipients { name: String },
    EmptyName { option: &'static str, value: String },
    Quotes { option: &'static str, value: String },
    IllegalValue { option: &'static str, value: String, kind: Kind },
    BothSubjects,
    OfMessage { option: &'static str },
    PartsBeside { option: &'static str },
    SmallParts { part_size: usize, least: usize },
    NoReference,
}

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text(Spelling::OpenOption))
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Record(RecordFault::Json(source)) | Error::Plan(PlanFault::Json(source)) => Some(source),
            Error::Record(RecordFault::Value(source)) => Some(source),
            _ => None,
        }
    }
}

/// The reason why a text is not a key. No reason quotes the text, which may hold the secret.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum KeyFault {
    Json,
    Protected,
    Version { found: u32, expected: u32 },
    Secret,
    Id,
}

impl fmt::Display for KeyFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            KeyFault::Json => {
                f.write_str("it is not JSON with exactly the fields meshmark_key, id and secret")
            }
            KeyFault::Protected => f.write_str(
                "a passphrase protects it, which cannot be given here: open it in a pipe, in bash KEY=<(age -d key.json)",
            ),
            KeyFault::Version { found, expected } => write!(f, "version {found} instead of {expected}"),
            KeyFault::Secret => f.write_str("the secret is not 64 hexadecimal digits"),
            KeyFault::Id => f.write_str("the id is not that of the secret, so one of them was changed"),
        }
    }
}

/// The reason why a text is not a record.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum RecordFault {
    Json(serde_json::Error),
    Version { found: u32, expected: u32 },
    UnknownVersion { found: u32 },
    Value(Box<Error>),
    WhitenedRecipient,
    Coefficients { found: usize, most: usize },
    Digest { text: String },
    Anchors,
    PartsBesideOthers,
    PartSize,
    NoPart,
    UnknownBase { digest: String },
    OwnBase,
    NoRecipient,
}

impl fmt::Display for RecordFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            // serde appends the list of all fields.
            RecordFault::Json(source) => {
                f.write_str(source.to_string().split(", expected one of").next().unwrap_or_default())
            }
            RecordFault::Version { found, expected } => write!(f, "version {found} instead of {expected}"),
            RecordFault::UnknownVersion { found } => write!(f, "version {found} instead of 1 or 2"),
            RecordFault::Value(source) => source.fmt(f),
            RecordFault::WhitenedRecipient => {
                f.write_str("it has a recipient and a whitened message, of which only one can be")
            }
            RecordFault::Coefficients { found, most } => write!(f, "{found} coefficients, of 1 to {most}"),
            RecordFault::Digest { text } => {
                write!(f, "\"{text}\" is no digest: it has 64 hexadecimal digits")
            }
            RecordFault::UnknownBase { digest } => {
                write!(f, "a base has the base {digest}, which is not listed before it")
            }
            RecordFault::OwnBase => f.write_str("it names its own edition as a base"),
            RecordFault::Anchors => f.write_str("it names anchors that are no vertices of its reference"),
            RecordFault::PartsBesideOthers => {
                f.write_str("it cuts into parts a map that rests on others or fits them")
            }
            RecordFault::PartSize => f.write_str("it cuts a map into parts of no vertices"),
            RecordFault::NoPart => f.write_str("it names no part of the map"),
            RecordFault::NoRecipient => f.write_str("it has no recipient"),
        }
    }
}

/// Why no new mark may have a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecipientFault {
    /// It has a line break or another control character, which hardly anybody means.
    Control,
    /// It begins or ends with white space, which nobody sees.
    Blanks,
}

impl fmt::Display for RecipientFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            RecipientFault::Control => "has a line break or another control character",
            RecipientFault::Blanks => "begins or ends with a blank",
        })
    }
}

/// The reason why a text is not a plan.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum PlanFault {
    Json(serde_json::Error),
    Version { found: u32, expected: u32 },
    Anchors { file: String },
}

impl fmt::Display for PlanFault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            PlanFault::Json(source) => source.fmt(f),
            PlanFault::Version { found, expected } => write!(f, "version {found} instead of {expected}"),
            PlanFault::Anchors { file } => write!(f, "{file} has anchors that are none of its vertices"),
        }
    }
}

impl Error {
    /// Returns the message, with options spelled as in the user's front end.
    pub fn text(&self, spelling: Spelling) -> String {
        let name = |option| spelling.name(option);
        match self {
            Error::NotFinite { index, x, y } => {
                format!(
                    "vertex {index} has the coordinates ({x}, {y}): every coordinate must be a finite number"
                )
            }
            Error::TooWide { span } => {
                format!("the coordinates span {span:e} units: more than the 1e30 a mesh can be built on")
            }
            Error::NoVertices => "the map has no vertices: give one with geometry".into(),
            Error::TooFewVertices { vertices, patch_size, code, chip_rate } => {
                too_few(*vertices, *patch_size, *code, *chip_rate, spelling)
            }
            Error::TooFewFree { free, vertices, patch_size } => format!(
                "only {free} of the {vertices} vertices of the sheet are away from other sheets, too few for {} of a mark: \
                 use a smaller {}, or plan larger sheets, or sheets that overlap less",
                spelling.value("PATCH_SIZE", patch_size),
                name("PATCH_SIZE")
            ),
            Error::TooFewInParts { vertices, patch_size } => format!(
                "of the parts into which the {vertices} vertices are cut, none has enough away from its borders for {}: use \
                 a larger {}, or 0 for one part",
                spelling.value("PATCH_SIZE", patch_size),
                name("PART_SIZE")
            ),
            Error::Collinear { vertices } => format!(
                "all {vertices} distinct vertices lie on one straight line, so they have no mesh: mark a map whose \
                 vertices spread over an area"
            ),
            Error::TooManyCoefficients { code, bits, chip_rate, vertices, of } => {
                too_many(*code, *bits, *chip_rate, (*vertices, *of), spelling)
            }
            Error::TooManySigns { coefficients, vertices, of } => format!(
                "a recipient needs {coefficients} coefficients in every patch, but the smallest patch ({vertices} vertices) \
                 has {}: use {}",
                vertices - 1,
                match of > coefficients {
                    true => format!("a larger {}", name("PATCH_SIZE")),
                    false =>
                        format!("a map of more than {coefficients} vertices, or mark more layers together"),
                }
            ),
            Error::CodeLength { bits } => format!(
                "{} carries a message of exactly 128 bits, not {bits}: use 32 hexadecimal digits, a {}, or {}",
                spelling.value("CODE", "LDPC"),
                name("RECIPIENT"),
                spelling.value("CODE", "REPETITION")
            ),
            Error::PrecisionTooCoarse { precision, metres, tolerance_m } => format!(
                "{} is {metres} m on the ground here, more than {} m: use a finer {} or a larger {}",
                spelling.value("PRECISION", precision),
                spelling.value("TOLERANCE", tolerance_m),
                name("PRECISION"),
                name("TOLERANCE")
            ),
            Error::MessageLost { errors, bits } => format!(
                "after marking, {errors} of the {bits} message bits cannot be read back: raise {} or {}, lower {}, or \
                 use a finer {} or a larger {}",
                name("AMPLITUDE"),
                name("CHIP_RATE"),
                name("PATCH_SIZE"),
                name("PRECISION"),
                name("TOLERANCE")
            ),
            Error::FingerprintLost { score, least } => format!(
                "after marking, the signs of the recipient agree by {score:.1} standard deviations, and {least} are \
                 needed: raise {}, use a finer {} or a larger {}, or mark more layers together",
                name("AMPLITUDE"),
                name("PRECISION"),
                name("TOLERANCE")
            ),
            Error::NoConvergence { vertices } => format!(
                "the eigenvalues of a patch of {vertices} vertices did not converge: change {} slightly",
                name("PATCH_SIZE")
            ),
            Error::Column { reason } => reason.clone(),
            Error::Message(text) => {
                format!("message \"{text}\" is not 2 to 256 hexadecimal digits (0-9, a-f)")
            }
            Error::Key(reason) => {
                format!("malformed key: {reason}; a key file is what `meshmark keygen` writes")
            }
            Error::Record(reason) => {
                format!("malformed record: {reason}; a record is what the driver writes to RECORD=")
            }
            Error::Plan(reason) => {
                format!("malformed plan: {reason}; a plan is what `meshmark plan` writes")
            }
            Error::Anchors { vertices } => format!(
                "the record names anchors that are none of the {vertices} vertices of its reference: give the record as it \
                 was written"
            ),
            Error::UnknownOption(option) => {
                let known: Vec<_> = OPTIONS.iter().map(|o| name(o.name)).collect();
                format!("unknown option {option}: use {}", known.join(", "))
            }
            Error::RepeatedOption(option) => format!("{} is given twice: give it once", name(option)),
            Error::EmptyOption(option) => {
                format!("{} is empty: give it a value or leave it out", name(option))
            }
            Error::Recipient { name, fault } => {
                format!("{} {fault}: remove it", spelling.value("RECIPIENT", visible(name)))
            }
            Error::AlikeRecipients { name } => format!(
                "the recipient \"{}\" is there in two spellings of Unicode, composed and decomposed, which would be two \
                 recipients: write both alike",
                visible(name)
            ),
            Error::EmptyName { option, value } => {
                format!("{} has an empty name between its commas", spelling.value(option, value))
            }
            Error::Quotes { option, value } => format!(
                "{} has a double quote that is not closed, or text after one: write a name with a comma as \"a,b\", and \
                 a quote inside it twice",
                spelling.value(option, value)
            ),
            Error::IllegalValue { option, value, kind } => {
                format!("{} is not {}", spelling.value(option, value), kind.legal())
            }
            Error::NoReference => format!(
                "there is no {}: name a GeoPackage for the unmarked map, which nobody else will have",
                name("REFERENCE")
            ),
            Error::OfMessage { option } => format!(
                "{} is for fingerprints: give a {}, and neither {} nor {}",
                name(option),
                name("RECIPIENT"),
                name("CODE"),
                name("CHIP_RATE")
            ),
            Error::PartsBeside { option } => format!(
                "{} and {} are both given, and a map that rests on others or fits them is not cut: leave out {}",
                name("PART_SIZE"),
                name(option),
                name("PART_SIZE")
            ),
            Error::SmallParts { part_size, least } => format!(
                "{} is too small for a part of several patches: use at least {least}, or 0 for one part",
                spelling.value("PART_SIZE", part_size)
            ),
            Error::BothSubjects => {
                format!("both {} and {} are given: give exactly one", name("RECIPIENT"), name("MESSAGE"))
            }
        }
    }
}

fn too_few(vertices: usize, patch_size: usize, code: Code, chip_rate: usize, spelling: Spelling) -> String {
    let least = PATCH_SIZE_RANGE.0;
    if vertices < least {
        return format!(
            "the map has {}, and needs at least {least} to carry a mark",
            counted(vertices, "distinct vertex")
        );
    }
    // One patch of all vertices has one coefficient less than it has vertices.
    let room = vertices - 1;
    let value = |option, value: usize| spelling.value(option, value);
    let (size, repetition) = (value("PATCH_SIZE", vertices), spelling.value("CODE", "REPETITION"));
    let rate = |code: Code| (room / (code.expansion() * RECIPIENT_BITS)).min(chip_rate);
    let digits =
        |rate: usize| format!("a message of at most {} hexadecimal digits fits", (room / rate / 4).min(256));
    let needed = |code: Code| code.expansion() * RECIPIENT_BITS + 1;
    let advice = match (code, rate(code), rate(Code::Repetition)) {
        (Code::Ldpc, rate, _) if rate == chip_rate => format!("use {size}"),
        (Code::Ldpc, 1.., _) => format!("use {size} and {}", value("CHIP_RATE", rate(code))),
        (_, _, 0) => format!(
            "a recipient needs {} vertices, {} with {repetition}: mark more layers together, or use {size}, {repetition} \
             and {}, with which {}",
            needed(Code::Ldpc),
            needed(Code::Repetition),
            value("CHIP_RATE", 1),
            digits(1)
        ),
        (Code::Ldpc, _, rate) => format!(
            "a recipient needs {} vertices but with {repetition}: mark more layers together, or use {size}, {repetition} \
             and {}",
            needed(code),
            value("CHIP_RATE", rate)
        ),
        (Code::Repetition, _, rate) => {
            format!("use {size} and {}, with which {}", value("CHIP_RATE", rate), digits(rate))
        }
    };
    let wanted = spelling.value("PATCH_SIZE", patch_size);
    format!("the map has {vertices} distinct vertices, fewer than {wanted}: {advice}")
}

/// `vertices` are those of the smallest patch and of the map.
fn too_many(
    code: Code,
    bits: usize,
    chip_rate: usize,
    vertices: (usize, usize),
    spelling: Spelling,
) -> String {
    let (vertices, of) = vertices;
    let needed = code.expansion() * bits * chip_rate;
    let (room, repetition) = (vertices - 1, spelling.value("CODE", "REPETITION"));
    let fits = |code: Code| match room / (code.expansion() * bits) {
        0 => None,
        1 => Some(spelling.value("CHIP_RATE", 1)),
        most => Some(spelling.value("CHIP_RATE", most) + " or less"),
    };
    let (with, uncoded) = match code {
        Code::Ldpc => (
            spelling.value("CODE", "LDPC") + " and ",
            fits(Code::Repetition).map(|c| format!("{repetition} and {c}")),
        ),
        Code::Repetition => (String::new(), None),
    };
    let remedies = [fits(code), uncoded.or_else(|| Some("a shorter message".into()))];
    let remedies: String = remedies.into_iter().flatten().map(|remedy| remedy + ", ").collect();
    let more = match of > needed {
        true => format!("a larger {}", spelling.name("PATCH_SIZE")),
        false => "mark more layers together".into(),
    };
    format!(
        "a message of {bits} bits with {with}{} needs {needed} coefficients, but the smallest patch ({vertices} vertices) has \
         {room}: use {remedies}or {more}",
        spelling.value("CHIP_RATE", chip_rate),
    )
}
