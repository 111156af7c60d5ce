//! The watermark options: one table defines the driver's option list, the parser, the flags of the
//! command line and the table in the docs.

mod creation;
mod list;
mod listing;
mod parameters;
mod recipient;
mod subject;
mod table;
mod values;

pub use crate::error::RecipientFault;
pub use creation::Creation;
pub use list::{join_list, split_list};
pub use listing::{creation_option_list_xml, open_option_list_xml, option_table_markdown};
pub use parameters::{AmplitudeOf, Code, Laplacian, Parameters, Rigidity};
pub(crate) use parameters::{LDPC_CHANNEL_BITS, LDPC_MESSAGE_BITS};
pub use recipient::{check_recipients, composed, recipient_fault};
pub use subject::Subject;
pub use table::{
    CREATION_OPTIONS, Kind, OPTIONS, OptionSpec, PART_SIZE, PATCH_SIZE_RANGE, RECIPIENT_BITS, Spelling, spec,
};

use crate::{Error, Result, message::Message, signs::COEFFICIENTS};
use table::LEAST_PATCHES_OF_PART;
use values::Values;

/// All options of one marking, parsed.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Path of the key file.
    pub key_path: Option<String>,
    /// Exactly one of RECIPIENT and MESSAGE, or none (an auditor may not know it).
    pub subject: Option<Subject>,
    /// The numbers.
    pub parameters: Parameters,
    /// Coefficients of a patch and axis that carry the fingerprint of a recipient; `None` where a
    /// message is carried.
    pub coefficients: Option<usize>,
    /// Layers to mark; all when `None`.
    pub layers: Option<Vec<String>>,
    /// Whether a map with unmarked coordinates of its vertices beside its marked geometries is
    /// refused.
    pub refuses_traces: bool,
    /// CRS of the source when it has none.
    pub srs: Option<String>,
    /// Path of the record to write.
    pub record_path: Option<String>,
    /// Paths of the records of earlier editions, or of folders of such records.
    pub bases: Option<Vec<String>>,
    /// Their references, and those of their own bases, in any order.
    pub base_references: Option<Vec<String>>,
    /// Path of the plan of the sheets of which the map is one.
    pub sheets: Option<String>,
    /// A map of more vertices is cut into parts of nearly so many; 0 leaves it in one part.
    pub part_size: usize,
}

impl Options {
    /// Parses name-value pairs; names may be in any case. RECIPIENT makes a fingerprint, and with
    /// CODE or CHIP_RATE a message. A message that is not given counts as long as a recipient's.
    ///
    /// # Errors
    /// Fails on an unknown name, a name given twice, a value that its row excludes, both RECIPIENT
    /// and MESSAGE, and bad hexadecimal digits.
    pub fn parse<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let values = Values::collect(OPTIONS, pairs)?;
        let subject = values.subject()?;
        let bits = match &subject {
            Some(Subject::Message(message)) => message.len(),
            _ => RECIPIENT_BITS,
        };
        let of_message = ["CODE", "CHIP_RATE"].iter().any(|name| values.given(name).is_some());
        let is_fingerprint = matches!(subject, Some(Subject::Recipient(_))) && !of_message;
        let (amplitude_of, shape) = match is_fingerprint {
            true => (AmplitudeOf::Displacement, Rigidity::Stiff),
            false => (AmplitudeOf::Coefficient, Rigidity::Free),
        };
        let code = values.choice("CODE", Code::from_name)?.unwrap_or(Code::default_for(bits));
        code.channel_bits(bits)?;
        let is_message = subject.is_some() && !is_fingerprint;
        let of_fingerprint = ["BASE", "SHEETS"].into_iter().find(|name| values.given(name).is_some());
        if let Some(option) = of_fingerprint.filter(|_| is_message) {
            return Err(Error::OfMessage { option });
        }
        let part_size = part_size(&values, is_message)?;
        Ok(Options {
            key_path: values.text("KEY")?,
            subject,
            parameters: Parameters {
                amplitude_m: values.number("AMPLITUDE")?.expect("has a default"),
                amplitude_of,
                code,
                chip_rate: values.integer("CHIP_RATE")?.unwrap_or(code.default_chip_rate()),
                patch_size: values.integer("PATCH_SIZE")?.expect("has a default"),
                tolerance_m: values.number("TOLERANCE")?.expect("has a default"),
                shape: values.choice("SHAPE", Rigidity::from_name)?.unwrap_or(shape),
                basis: values.choice("BASIS", Laplacian::from_name)?.expect("has a default"),
                precision_crs_units: values.number("PRECISION")?,
            },
            coefficients: is_fingerprint.then_some(COEFFICIENTS),
            layers: values.list("LAYERS")?,
            refuses_traces: values.choice("ATTRIBUTES", refuses)?.expect("has a default"),
            srs: values.text("SRS")?,
            record_path: values.text("RECORD")?,
            bases: values.list("BASE")?,
            base_references: values.list("BASE_REFERENCE")?,
            sheets: values.text("SHEETS")?,
            part_size,
        })
    }

    /// Parses name-value pairs as [`Options::parse`] does, for a new mark.
    ///
    /// # Errors
    /// Returns the errors of [`Options::parse`] and [`check_recipients`].
    pub fn parse_for_marking<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let options = Options::parse(pairs)?;
        check_recipients(options.subject.as_ref().and_then(Subject::recipient).as_slice())?;
        Ok(options)
    }

    /// Parses name-value pairs as [`Options::parse`] does, for marks of recipients that are named
    /// elsewhere.
    ///
    /// # Errors
    /// Returns the errors of [`Options::parse`].
    pub fn parse_for_recipients<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let anybody = ("RECIPIENT", "-");
        Ok(Options { subject: None, ..Options::parse(pairs.into_iter().chain([anybody]))? })
    }

    /// Returns the value of an option in its one canonical spelling, which parses to it: equal
    /// texts are equal values. `None` where the option is not given.
    ///
    /// # Panics
    /// Panics when `option` is no row of [`OPTIONS`].
    pub fn text_of(&self, option: &str) -> Option<String> {
        let (p, is_message) = (&self.parameters, self.coefficients.is_none());
        match option {
            "KEY" => self.key_path.clone(),
            "RECIPIENT" => self.subject.as_ref()?.recipient().map(String::from),
            "MESSAGE" => self.subject.as_ref()?.given_message().map(Message::to_hex),
            "AMPLITUDE" => Some(p.amplitude_m.to_string()),
            "CODE" => is_message.then(|| p.code.name()),
            "CHIP_RATE" => is_message.then(|| p.chip_rate.to_string()),
            "PATCH_SIZE" => Some(p.patch_size.to_string()),
            "PART_SIZE" => Some(self.part_size.to_string()),
            "TOLERANCE" => Some(p.tolerance_m.to_string()),
            "PRECISION" => p.precision_crs_units.map(|precision| precision.to_string()),
            "LAYERS" => self.layers.as_ref().map(join_list),
            "SHAPE" => Some(p.shape.name().into()),
            "BASIS" => Some(p.basis.name().into()),
            "ATTRIBUTES" => Some(if self.refuses_traces { "REFUSE" } else { "WARN" }.into()),
            "SRS" => self.srs.clone(),
            "RECORD" => self.record_path.clone(),
            "BASE" => self.bases.as_ref().map(join_list),
            "BASE_REFERENCE" => self.base_references.as_ref().map(join_list),
            "SHEETS" => self.sheets.clone(),
            _ => panic!("{option} is no option"),
        }
    }

    /// Returns the size of the parts into which a map of so many vertices is cut; `None` where it is one
    /// part.
    pub fn parts_of(&self, vertices: usize) -> Option<usize> {
        (1..vertices).contains(&self.part_size).then_some(self.part_size)
    }

    /// Checks values that do not come from [`Options::parse`].
    ///
    /// # Errors
    /// Returns the errors of [`Options::parse`].
    pub fn check(&self) -> Result<()> {
        let texts: Vec<_> = OPTIONS.iter().filter_map(|o| Some((o.name, self.text_of(o.name)?))).collect();
        Options::parse(texts.iter().map(|(name, text)| (*name, text.as_str()))).map(|_| ())
    }
}

impl Parameters {
    /// Returns the parameters of a fingerprint.
    pub fn of_fingerprint() -> Self {
        Options::parse_for_recipients([]).expect("the defaults are legal").parameters
    }
}

/// Returns the value of PART_SIZE, or its default.
fn part_size(values: &Values, is_message: bool) -> Result<usize> {
    let others = ["BASE", "SHEETS"].into_iter().find(|name| values.given(name).is_some());
    let part_size = match values.integer("PART_SIZE")? {
        Some(part_size) => part_size,
        None if is_message || others.is_some() => 0,
        None => PART_SIZE,
    };
    let patch_size = values.integer("PATCH_SIZE")?.expect("has a default");
    let least = LEAST_PATCHES_OF_PART * patch_size;
    match others {
        _ if part_size == 0 => Ok(0),
        _ if is_message => Err(Error::OfMessage { option: "PART_SIZE" }),
        Some(option) => Err(Error::PartsBeside { option }),
        None if part_size < least => Err(Error::SmallParts { part_size, least }),
        None => Ok(part_size),
    }
}

/// Reads the value of ATTRIBUTES.
fn refuses(word: &str) -> Option<bool> {
    let is = |known: &str| word.eq_ignore_ascii_case(known);
    (is("WARN") || is("REFUSE")).then(|| is("REFUSE"))
}

impl Default for Parameters {
    /// Returns the parameters of a message as long as a recipient's.
    fn default() -> Self {
        Options::parse([]).expect("the defaults are legal").parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(pairs: &[(&str, &str)]) -> String {
        Options::parse(pairs.iter().copied()).unwrap_err().to_string()
    }

    #[test]
    fn defaults_are_those_of_the_table() {
        let p = Parameters::default();
        assert_eq!((p.amplitude_m, p.patch_size), (0.10, 480));
        assert_eq!((p.tolerance_m, p.precision_crs_units), (0.75, None));
        assert_eq!((p.shape, p.basis), (Rigidity::Free, Laplacian::Biggs));
        let of_fingerprint = Parameters::of_fingerprint();
        let differences = (of_fingerprint.shape, of_fingerprint.amplitude_of);
        assert_eq!(differences, (Rigidity::Stiff, AmplitudeOf::Displacement));
        assert!(
            spec("SHAPE").unwrap().help.ends_with("by default STIFF for a fingerprint, FREE for a message")
        );
        assert_eq!(Parameters { shape: p.shape, amplitude_of: p.amplitude_of, ..of_fingerprint }, p);
    }

    #[test]
    fn code_and_chip_rate_follow_the_length_of_the_message_unless_they_are_given() {
        let parsed = |pairs: &[_]| {
            let p = Options::parse(pairs.iter().copied()).unwrap().parameters;
            (p.code, p.chip_rate)
        };
        assert!(spec("CODE").unwrap().help.ends_with("by default LDPC for 128 bits, otherwise REPETITION"));
        assert!(spec("CHIP_RATE").unwrap().help.ends_with("by default 1 with LDPC, 2 with REPETITION"));
        let of_128_bits = ("MESSAGE", "00112233445566778899aabbccddeeff");
        for subject in [&[][..], &[("RECIPIENT", "ACME")], &[of_128_bits]] {
            let and = |more: &[_]| parsed(&[subject, more].concat());
            assert_eq!(and(&[]), (Code::Ldpc, 1));
            assert_eq!(and(&[("CODE", "repetition")]), (Code::Repetition, 2));
            assert_eq!(and(&[("CHIP_RATE", "3")]), (Code::Ldpc, 3));
            assert_eq!(and(&[("CODE", "REPETITION"), ("CHIP_RATE", "1")]), (Code::Repetition, 1));
        }
        for hex in ["00", "0123456789abcdef", &"0".repeat(31), &"0".repeat(33), &"0".repeat(64)] {
            assert_eq!(parsed(&[("MESSAGE", hex)]), (Code::Repetition, 2), "{hex}");
            assert_eq!(parsed(&[("MESSAGE", hex), ("CHIP_RATE", "3")]), (Code::Repetition, 3));
        }
        let of_message = Options::parse([("RECIPIENT", "ACME"), ("CODE", "LDPC")]).unwrap();
        assert_eq!(Parameters::default(), of_message.parameters);
    }

    #[test]
    fn a_recipient_has_a_fingerprint_unless_options_of_a_message_are_given() {
        let coefficients = |pairs: &[_]| Options::parse(pairs.iter().copied()).unwrap().coefficients;
        let recipient = ("RECIPIENT", "ACME");
        assert_eq!(coefficients(&[recipient]), Some(COEFFICIENTS));
        for of_message in [("CODE", "LDPC"), ("CODE", "REPETITION"), ("CHIP_RATE", "1")] {
            assert_eq!(coefficients(&[recipient, of_message]), None, "{of_message:?}");
        }
        let elsewhere = |pairs: &[_]| Options::parse_for_recipients(pairs.iter().copied()).unwrap();
        assert_eq!((elsewhere(&[]).coefficients, elsewhere(&[]).subject), (Some(COEFFICIENTS), None));
        assert_eq!(elsewhere(&[("CODE", "LDPC")]).coefficients, None);
        assert_eq!([coefficients(&[]), coefficients(&[("MESSAGE", "00")])], [None; 2]);
    }

    #[test]
    fn a_printed_option_parses_to_its_value() {
        let marking = |pairs: &[(&str, &str)]| Options::parse(pairs.iter().copied()).unwrap();
        let all = [
            ("KEY", "a key.json"),
            ("AMPLITUDE", "0.30000000000000004"),
            ("CODE", "Repetition"),
            ("CHIP_RATE", "+7"),
            ("PATCH_SIZE", "0016"),
            ("PART_SIZE", "0"),
            ("TOLERANCE", "1e-7"),
            ("PRECISION", "5e-324"),
            ("LAYERS", r#" "a ""b"", c" ,d"#),
            ("SHAPE", "rigid"),
            ("BASIS", "Cotangent"),
            ("ATTRIBUTES", "refuse"),
            ("SRS", "EPSG:3067"),
            ("RECORD", "acme.json"),
        ];
        let of_base = [
            ("BASE", r#"may.json,"June, July""#),
            ("BASE_REFERENCE", "may.gpkg"),
            ("SHEETS", "plan, \"A\".json"),
        ];
        let of_message = ["CODE", "CHIP_RATE"];
        for subject in [("RECIPIENT", " ACME, \"GmbH\""), ("MESSAGE", "C0ffee")] {
            let mut given = [&all[..], &of_base, &[subject]].concat();
            match subject.0 {
                "RECIPIENT" => given.retain(|(name, _)| !of_message.contains(name)),
                _ => given.retain(|(name, _)| !["BASE", "SHEETS"].contains(name)),
            }
            for options in [marking(&given), marking(&[]), marking(&[subject])] {
                let texts = OPTIONS.iter().filter_map(|o| Some((o.name, options.text_of(o.name)?)));
                let texts: Vec<_> = texts.collect();
                let pairs = texts.iter().map(|(name, text)| (*name, text.as_str()));
                assert_eq!(Options::parse(pairs).unwrap(), options, "{texts:?}");
            }
            let printed = OPTIONS.iter().filter(|o| marking(&given).text_of(o.name).is_some()).count();
            assert_eq!(printed, given.len(), "all that were given");
        }
    }

    #[test]
    fn large_maps_of_fingerprints_are_cut_unless_they_rest_on_others_or_fit_them() {
        let parts = |pairs: &[_], vertices| Options::parse(pairs.iter().copied()).unwrap().parts_of(vertices);
        let (recipient, of_part) = (("RECIPIENT", "ACME"), ("PART_SIZE", "90000"));
        assert!(spec("PART_SIZE").unwrap().help.contains(&format!("by default {PART_SIZE},")));
        assert_eq!(parts(&[recipient], PART_SIZE), None);
        assert_eq!(parts(&[recipient], PART_SIZE + 1), Some(PART_SIZE));
        assert_eq!(parts(&[recipient, of_part], 90_000), None);
        assert_eq!(parts(&[recipient, of_part], 90_001), Some(90_000));
        assert_eq!(parts(&[recipient, ("PART_SIZE", "0")], usize::MAX), None);
        for other in [("BASE", "a.json"), ("SHEETS", "plan.json")] {
            assert_eq!(parts(&[recipient, other], usize::MAX), None);
            let both = error(&[recipient, other, of_part]);
            assert!(both.contains(&format!("PART_SIZE and {} are both given", other.0)), "{both}");
        }
        assert_eq!(parts(&[("MESSAGE", "00")], usize::MAX), None);
        assert!(error(&[("MESSAGE", "00"), of_part]).contains("PART_SIZE is for fingerprints"));
        let small = error(&[recipient, ("PART_SIZE", "1919")]);
        assert!(small.contains("use at least 1920, or 0 for one part"), "{small}");
    }

    #[test]
    fn bad_values_name_the_option_and_what_is_legal() {
        assert!(error(&[("AMPLITUDE", "wide")]).contains("AMPLITUDE=wide is not a number"));
        assert!(error(&[("AMPLITUDE", "0")]).contains("greater than 0"));
        assert!(error(&[("AMPLITUDE", "NaN")]).contains("greater than 0"));
        assert!(error(&[("TOLERANCE", "inf")]).contains("at most 1000000"));
        assert!(error(&[("CHIP_RATE", "2.5")]).contains("whole number from 1"));
        assert!(error(&[("PATCH_SIZE", "3")]).contains("from 16 to 4096"));
        assert!(error(&[("CODE", "morse")]).contains("CODE=morse is not REPETITION or LDPC"));
        assert!(error(&[("SHAPE", "round")]).contains("SHAPE=round is not FREE or RIGID or STIFF"));
        assert!(error(&[("BASIS", "sines")]).contains("BASIS=sines is not BIGGS or COTANGENT"));
        assert!(error(&[("ATTRIBUTES", "DROP")]).contains("ATTRIBUTES=DROP is not WARN or REFUSE"));
        let short = error(&[("CODE", "LDPC"), ("MESSAGE", "0123456789abcdef")]);
        assert!(short.contains("exactly 128 bits, not 64: use 32 hexadecimal digits"), "{short}");
        assert!(error(&[("COLOUR", "red")]).contains("unknown option COLOUR: use KEY, "));
        assert!(error(&[("KEY", "a"), ("key", "b")]).contains("given twice"));
        assert!(error(&[("RECIPIENT", " ")]).contains("RECIPIENT is empty"));
        assert!(error(&[("RECIPIENT", "a"), ("MESSAGE", "00")]).contains("exactly one"));
        assert!(error(&[("MESSAGE", "xyz")]).contains("hexadecimal"));
        assert!(error(&[("LAYERS", "a,,b")]).contains("empty name"));
        for option in ["BASE", "SHEETS"] {
            let of_message = error(&[(option, "a.json"), ("MESSAGE", "00")]);
            assert!(of_message.contains(&format!("{option} is for fingerprints")), "{of_message}");
        }
        assert!(
            error(&[("LAYERS", r#""a,b"#)]).contains(r#"LAYERS="a,b has a double quote that is not closed"#)
        );
    }

    #[test]
    fn a_message_names_options_as_its_reader_writes_them() {
        let flags = |pairs: &[_]| Options::parse(pairs.iter().copied()).unwrap_err().text(Spelling::Flag);
        assert_eq!(flags(&[("PATCH_SIZE", "3")]), "--patch-size 3 is not a whole number from 16 to 4096");
        assert!(
            flags(&[("RECIPIENT", "a"), ("MESSAGE", "00")]).starts_with("both --recipient and --message")
        );
        let few = Error::TooFewVertices { vertices: 300, patch_size: 480, code: Code::Ldpc, chip_rate: 1 };
        assert!(few.text(Spelling::Flag).contains("fewer than --patch-size 480: use --patch-size 300"));
        assert!(few.to_string().contains("fewer than PATCH_SIZE=480: use PATCH_SIZE=300"));
        let fewer = Error::TooFewVertices { vertices: 3, patch_size: 480, code: Code::Ldpc, chip_rate: 1 };
        let fewer = fewer.to_string();
        assert!(fewer.contains("at least 16") && !fewer.contains("480"), "{fewer}");
    }

    #[test]
    fn creation_needs_a_reference_and_knows_yes_from_no() {
        let creation = |pairs: &[(&'static str, &'static str)]| Creation::parse(pairs.iter().copied());
        let parsed = creation(&[("reference", "ref.gpkg"), ("OVERWRITE", "yes"), ("FORMAT", "GML")]).unwrap();
        assert_eq!((parsed.reference_path.as_str(), parsed.overwrite), ("ref.gpkg", true));
        assert_eq!(parsed.format.as_deref(), Some("GML"));
        assert!(!creation(&[("REFERENCE", "r")]).unwrap().overwrite);
        let error = |pairs| creation(pairs).unwrap_err().to_string();
        assert!(error(&[]).contains("there is no REFERENCE"));
        assert!(error(&[("REFERENCE", "r"), ("OVERWRITE", "maybe")]).contains("OVERWRITE=maybe is not"));
    }
}
