//! The table of the options and their spelling.

use super::parameters::{Code, Laplacian, Rigidity};

/// The smallest and the largest PATCH_SIZE: fewer vertices carry no useful message, more need
/// minutes and gigabytes for each solution.
pub const PATCH_SIZE_RANGE: (usize, usize) = (16, 4096);

/// PART_SIZE where it is not given: the memory of a marking then grows with a part instead of the map.
pub const PART_SIZE: usize = 2_000_000;
/// The largest PART_SIZE.
const PART_SIZE_MOST: usize = 1_000_000_000;
/// A part has at least so many times PATCH_SIZE vertices: what stays in place at its borders must leave
/// room for patches.
pub(super) const LEAST_PATCHES_OF_PART: usize = 4;

/// The length of the message of a RECIPIENT.
pub const RECIPIENT_BITS: usize = 128;

/// The legal values of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Any text that is not empty.
    Text,
    /// A number, greater than the first bound, at most the second.
    Number(f64, f64),
    /// A whole number between two bounds, both legal.
    Integer(usize, usize),
    /// One of these words, in any case.
    Choice(&'static [&'static str]),
}

impl Kind {
    /// Describes a legal value, to complete "… is not".
    pub(crate) fn legal(&self) -> String {
        match self {
            Kind::Text => "a text".into(),
            Kind::Number(above, most) => format!("a number greater than {above} and at most {most}"),
            Kind::Integer(least, most) => format!("a whole number from {least} to {most}"),
            Kind::Choice(words) => words.join(" or "),
        }
    }
}

/// How a front end writes options, so that a message names what its user typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spelling {
    /// The driver: `PATCH_SIZE`, `PATCH_SIZE=480`.
    OpenOption,
    /// The command line: `--patch-size`, `--patch-size 480`.
    Flag,
    /// Python: `patch_size`, `patch_size=480`.
    Keyword,
}

impl Spelling {
    /// Returns an option of this name in the table.
    pub fn name(self, name: &str) -> String {
        match self {
            Spelling::OpenOption => name.into(),
            Spelling::Flag => format!("--{}", name.to_lowercase().replace('_', "-")),
            Spelling::Keyword => name.to_lowercase(),
        }
    }

    /// Returns the option with a value.
    pub fn value(self, name: &str, value: impl std::fmt::Display) -> String {
        let between = match self {
            Spelling::OpenOption | Spelling::Keyword => "=",
            Spelling::Flag => " ",
        };
        format!("{}{between}{value}", self.name(name))
    }
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct OptionSpec {
    /// Its name in the driver, upper case; `--lower-case` on the command line.
    pub name: &'static str,
    /// Its legal values.
    pub kind: Kind,
    /// Its value when it is not given.
    pub default: Option<&'static str>,
    /// One sentence for the docs and for the driver's option list.
    pub help: &'static str,
    /// Whether it shapes the mark, so that `meshmark verify` needs it when there is no record.
    pub shapes_mark: bool,
}

const fn row(
    name: &'static str,
    kind: Kind,
    default: Option<&'static str>,
    shapes_mark: bool,
    help: &'static str,
) -> OptionSpec {
    OptionSpec { name, kind, default, help, shapes_mark }
}

/// All options, in the order of the docs.
pub const OPTIONS: &[OptionSpec] = &[
    row(
        "KEY",
        Kind::Text,
        None,
        false,
        "Key file made by `meshmark keygen`; or configuration option MESHMARK_KEY",
    ),
    row(
        "RECIPIENT",
        Kind::Text,
        None,
        true,
        "Who receives this copy: a fingerprint of its own; with CODE or CHIP_RATE a message, 128 bits of a keyed hash",
    ),
    row(
        "MESSAGE",
        Kind::Text,
        None,
        true,
        "The message itself, 2 to 256 hexadecimal digits, instead of a recipient",
    ),
    row(
        "AMPLITUDE",
        Kind::Number(0.0, 1e6),
        Some("0.10"),
        true,
        "Displacement of the vertices by a fingerprint, root mean square, or amplitude of every coefficient of a message; metres on the ground",
    ),
    row(
        "CODE",
        Kind::Choice(&Code::NAMES),
        None,
        true,
        "LDPC turns 128 message bits into 256 that correct errors, REPETITION repeats any number of bits; by \
         default LDPC for 128 bits, otherwise REPETITION",
    ),
    row(
        "CHIP_RATE",
        Kind::Integer(1, 2048),
        None,
        true,
        "Coefficients that carry each of those bits, per patch and axis; by default 1 with LDPC, 2 with REPETITION",
    ),
    row(
        "PATCH_SIZE",
        Kind::Integer(PATCH_SIZE_RANGE.0, PATCH_SIZE_RANGE.1),
        Some("480"),
        true,
        "Smallest number of vertices in a patch",
    ),
    row(
        "PART_SIZE",
        Kind::Integer(0, PART_SIZE_MOST),
        None,
        true,
        "A map of more vertices is cut into parts of nearly so many, each with a mesh of its own, solved one after the \
         other; 0 for one part; for fingerprints alone; by default 2000000, and 0 with BASE or SHEETS",
    ),
    row(
        "TOLERANCE",
        Kind::Number(0.0, 1e6),
        Some("0.75"),
        true,
        "No vertex moves further than this, metres on the ground",
    ),
    row(
        "PRECISION",
        Kind::Number(0.0, 1e6),
        None,
        true,
        "Grid of the marked coordinates, CRS units; none by default",
    ),
    row(
        "LAYERS",
        Kind::Text,
        None,
        true,
        "Comma-separated layers to mark together, those with a comma in double quotes; the others pass unchanged; all by default",
    ),
    row(
        "SHAPE",
        Kind::Choice(&Rigidity::NAMES),
        None,
        true,
        "FREE moves every vertex by itself; RIGID shifts and turns buildings as a whole, without bending them; STIFF \
         does so too and keeps angles and lengths elsewhere; by default STIFF for a fingerprint, FREE for a message",
    ),
    row(
        "BASIS",
        Kind::Choice(&Laplacian::NAMES),
        Some("BIGGS"),
        true,
        "Mesh Laplacian: BIGGS is that of the paper; COTANGENT bends angles less and needs the very same reference",
    ),
    row(
        "ATTRIBUTES",
        Kind::Choice(&["WARN", "REFUSE"]),
        Some("WARN"),
        false,
        "WARN of unmarked coordinates of vertices in attributes, foreign members and layers left out, or REFUSE to mark",
    ),
    row("SRS", Kind::Text, None, true, "CRS of the source when it has none, for example EPSG:3067"),
    row(
        "RECORD",
        Kind::Text,
        None,
        false,
        "Record file to write, which verification needs with the key and the reference",
    ),
    row(
        "BASE",
        Kind::Text,
        None,
        false,
        "Comma-separated records of earlier editions, or folders of them: vertices that these had move as there; a \
         fingerprint alone can rest on them",
    ),
    row(
        "BASE_REFERENCE",
        Kind::Text,
        None,
        false,
        "Comma-separated references of those editions and of the editions that they rest on, in any order",
    ),
    row(
        "SHEETS",
        Kind::Text,
        None,
        false,
        "Plan of the sheets of which this map is one, made by `meshmark plan`: they are marked apart and fit together; \
         for fingerprints alone",
    ),
];

/// The further options of a driver that writes, in the order of the docs.
pub const CREATION_OPTIONS: &[OptionSpec] = &[
    row(
        "REFERENCE",
        Kind::Text,
        None,
        false,
        "GeoPackage to write with the unmarked map as it arrived, which verification needs; required",
    ),
    row(
        "FORMAT",
        Kind::Text,
        None,
        false,
        "Short name of the GDAL driver that writes the marked map; by default the one of the file name extension",
    ),
    row("OVERWRITE", Kind::Choice(&["NO", "YES"]), Some("NO"), false, "Replace the file when it exists"),
];

/// Looks a row up by its name, in any case.
pub fn spec(name: &str) -> Option<&'static OptionSpec> {
    OPTIONS.iter().find(|o| o.name.eq_ignore_ascii_case(name))
}
