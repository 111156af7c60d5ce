//! The watermark options: one table defines the driver's option list, the parser, the flags of the command
//! line and the table in the docs.

mod list;
mod listing;
mod parameters;
mod table;

pub use list::{join_list, split_list};
pub use listing::{creation_option_list_xml, open_option_list_xml, option_table_markdown};
pub use parameters::{Code, Laplacian, Parameters, Rigidity};
pub(crate) use parameters::{LDPC_CHANNEL_BITS, LDPC_MESSAGE_BITS};
pub use table::{
    CREATION_OPTIONS, Kind, OPTIONS, OptionSpec, PATCH_SIZE_RANGE, RECIPIENT_BITS, Spelling, spec,
};

use crate::{Error, Result, key::SecretKey, message::Message, whitening::whiten};

/// The content of a mark: a name, or the bits themselves.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// The message is a keyed hash of this text.
    Recipient(String),
    /// The message, which the key whitens before it is coded.
    Message(Message),
    /// The message of a mark made before whitening existed: its own bits are coded.
    Unwhitened(Message),
}

impl Subject {
    /// Returns the bits that the code carries under a key.
    pub fn carried(&self, key: &SecretKey) -> Message {
        match self {
            Subject::Recipient(text) => key.recipient_message(text),
            Subject::Message(message) => whiten(key, message),
            Subject::Unwhitened(message) => message.clone(),
        }
    }

    /// Returns the message of records and reports for the bits that the code carries.
    pub fn message_of(&self, carried: &Message, key: &SecretKey) -> Message {
        match self {
            Subject::Message(_) => key.unwhitened(carried),
            Subject::Recipient(_) | Subject::Unwhitened(_) => carried.clone(),
        }
    }

    /// Returns the message of records and reports.
    pub fn message(&self, key: &SecretKey) -> Message {
        match self {
            Subject::Recipient(text) => key.recipient_message(text),
            Subject::Message(message) | Subject::Unwhitened(message) => message.clone(),
        }
    }

    /// Returns the recipient, when the message is made from one.
    pub fn recipient(&self) -> Option<&str> {
        match self {
            Subject::Recipient(text) => Some(text),
            Subject::Message(_) | Subject::Unwhitened(_) => None,
        }
    }
}

/// All options of one marking, parsed.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Path of the key file.
    pub key_path: Option<String>,
    /// Exactly one of RECIPIENT and MESSAGE, or none (an auditor may not know it).
    pub subject: Option<Subject>,
    /// The numbers.
    pub parameters: Parameters,
    /// Layers to mark; all when `None`.
    pub layers: Option<Vec<String>>,
    /// CRS of the source when it has none.
    pub srs: Option<String>,
    /// Path of the record to write.
    pub record_path: Option<String>,
}

impl Options {
    /// Parses name-value pairs; names may be in any case. A message that is not given counts as long as a
    /// recipient's.
    ///
    /// # Errors
    /// Fails on an unknown name, a name given twice, a value that its row excludes, both RECIPIENT
    /// and MESSAGE, and bad hexadecimal digits.
    pub fn parse<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let values = Values::collect(OPTIONS, pairs)?;
        let precision = values.number("PRECISION")?;
        let subject = values.subject()?;
        let bits = match &subject {
            Some(Subject::Message(message)) => message.len(),
            _ => RECIPIENT_BITS,
        };
        let code = values.choice("CODE", Code::from_name)?.unwrap_or(Code::default_for(bits));
        code.channel_bits(bits)?;
        Ok(Options {
            key_path: values.text("KEY")?,
            subject,
            parameters: Parameters {
                amplitude_m: values.number("AMPLITUDE")?.expect("has a default"),
                code,
                chip_rate: values.integer("CHIP_RATE")?.unwrap_or(code.default_chip_rate()),
                patch_size: values.integer("PATCH_SIZE")?.expect("has a default"),
                tolerance_m: values.number("TOLERANCE")?.expect("has a default"),
                shape: values.choice("SHAPE", Rigidity::from_name)?.expect("has a default"),
                laplacian: values.choice("BASIS", Laplacian::from_name)?.expect("has a default"),
                precision,
            },
            layers: values.list("LAYERS")?,
            srs: values.text("SRS")?,
            record_path: values.text("RECORD")?,
        })
    }
}

impl Default for Parameters {
    /// Returns the parameters of a message as long as a recipient's.
    fn default() -> Self {
        Options::parse([]).expect("the defaults are legal").parameters
    }
}

/// The given pairs, each name known and given once.
struct Values<'a>(Vec<(&'static OptionSpec, &'a str)>);

impl<'a> Values<'a> {
    fn collect(
        options: &'static [OptionSpec],
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self> {
        let mut values: Vec<(&OptionSpec, &str)> = Vec::new();
        for (name, value) in pairs {
            let Some(spec) = options.iter().find(|o| o.name.eq_ignore_ascii_case(name)) else {
                return Err(Error::UnknownOption(name.into()));
            };
            if values.iter().any(|(s, _)| s.name == spec.name) {
                return Err(Error::RepeatedOption(spec.name));
            }
            values.push((spec, value));
        }
        Ok(Values(values))
    }

    fn given(&self, name: &str) -> Option<&'a str> {
        self.0.iter().find(|(spec, _)| spec.name == name).map(|(_, value)| *value)
    }

    fn text(&self, name: &'static str) -> Result<Option<String>> {
        match self.given(name) {
            Some(value) if value.trim().is_empty() => Err(Error::EmptyOption(name)),
            value => Ok(value.map(String::from)),
        }
    }

    fn subject(&self) -> Result<Option<Subject>> {
        match (self.text("RECIPIENT")?, self.text("MESSAGE")?) {
            (Some(_), Some(_)) => Err(Error::BothSubjects),
            (Some(text), None) => Ok(Some(Subject::Recipient(text))),
            (None, Some(hex)) => Ok(Some(Subject::Message(Message::from_hex(&hex)?))),
            (None, None) => Ok(None),
        }
    }

    fn list(&self, option: &'static str) -> Result<Option<Vec<String>>> {
        let Some(value) = self.text(option)? else { return Ok(None) };
        let Some(names) = split_list(&value) else { return Err(Error::Quotes { option, value }) };
        if names.iter().any(String::is_empty) {
            return Err(Error::EmptyName { option, value });
        }
        Ok(Some(names))
    }

    fn number(&self, name: &str) -> Result<Option<f64>> {
        self.parsed(name, |kind, text| {
            let Kind::Number(above, most) = kind else { unreachable!("{name} is a number") };
            text.parse().ok().filter(|number| *number > above && *number <= most)
        })
    }

    fn integer(&self, name: &str) -> Result<Option<usize>> {
        self.parsed(name, |kind, text| {
            let Kind::Integer(least, most) = kind else { unreachable!("{name} is an integer") };
            text.parse().ok().filter(|number| (least..=most).contains(number))
        })
    }

    fn choice<T>(&self, name: &str, from_name: impl Fn(&str) -> Option<T>) -> Result<Option<T>> {
        self.parsed(name, |_, text| from_name(text))
    }

    /// Returns the value given, or the default, as `parse` understands it.
    fn parsed<T>(&self, name: &str, parse: impl Fn(Kind, &str) -> Option<T>) -> Result<Option<T>> {
        let spec = spec(name).expect("a row of the table");
        let Some(value) = self.given(name).or(spec.default) else { return Ok(None) };
        let illegal = || Error::IllegalValue { option: spec.name, value: value.into(), kind: spec.kind };
        parse(spec.kind, value.trim()).ok_or_else(illegal).map(Some)
    }
}

/// Where and how the marked map is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Creation {
    /// Path of the unmarked map to write.
    pub reference_path: String,
    /// GDAL's short name of the format, when it is not to follow from the file name.
    pub format: Option<String>,
    /// Whether a file that exists is replaced.
    pub overwrite: bool,
}

impl Creation {
    /// Parses the rows of [`CREATION_OPTIONS`].
    ///
    /// # Errors
    /// Fails on an unknown name, a name given twice, an illegal value, and a missing REFERENCE.
    pub fn parse<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self> {
        let values = Values::collect(CREATION_OPTIONS, pairs)?;
        let reference_path = values.text("REFERENCE")?.ok_or(Error::NoReference)?;
        let overwrite = match values.given("OVERWRITE") {
            None => false,
            Some(word) if word.eq_ignore_ascii_case("YES") => true,
            Some(word) if word.eq_ignore_ascii_case("NO") => false,
            Some(word) => {
                let kind = Kind::Choice(&["NO", "YES"]);
                return Err(Error::IllegalValue { option: "OVERWRITE", value: word.into(), kind });
            }
        };
        Ok(Creation { reference_path, format: values.text("FORMAT")?, overwrite })
    }

    /// Returns whether an option is one of [`CREATION_OPTIONS`].
    pub fn has(name: &str) -> bool {
        CREATION_OPTIONS.iter().any(|o| o.name.eq_ignore_ascii_case(name))
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
        assert_eq!((p.tolerance_m, p.precision), (0.75, None));
        assert_eq!((p.shape, p.laplacian), (Rigidity::Free, Laplacian::Biggs));
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
            assert_eq!(parsed(subject), (Code::Ldpc, 1));
            let and = |more: &[_]| parsed(&[subject, more].concat());
            assert_eq!(and(&[("CODE", "repetition")]), (Code::Repetition, 2));
            assert_eq!(and(&[("CHIP_RATE", "3")]), (Code::Ldpc, 3));
            assert_eq!(and(&[("CODE", "REPETITION"), ("CHIP_RATE", "1")]), (Code::Repetition, 1));
        }
        for hex in ["00", "0123456789abcdef", &"0".repeat(31), &"0".repeat(33), &"0".repeat(64)] {
            assert_eq!(parsed(&[("MESSAGE", hex)]), (Code::Repetition, 2), "{hex}");
            assert_eq!(parsed(&[("MESSAGE", hex), ("CHIP_RATE", "3")]), (Code::Repetition, 3));
        }
        assert_eq!(Parameters::default(), Options::parse([("RECIPIENT", "ACME")]).unwrap().parameters);
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
            ("TOLERANCE", "1e-7"),
            ("PRECISION", "5e-324"),
            ("LAYERS", r#" "a ""b"", c" ,d"#),
            ("SHAPE", "rigid"),
            ("BASIS", "Cotangent"),
            ("SRS", "EPSG:3067"),
            ("RECORD", "acme.json"),
        ];
        for subject in [("RECIPIENT", " ACME, \"GmbH\""), ("MESSAGE", "C0ffee")] {
            let given = [&all[..], &[subject]].concat();
            for options in [marking(&given), marking(&[]), marking(&[subject])] {
                let texts = OPTIONS.iter().filter_map(|o| Some((o.name, o.text_of(&options)?)));
                let texts: Vec<_> = texts.collect();
                let pairs = texts.iter().map(|(name, text)| (*name, text.as_str()));
                assert_eq!(Options::parse(pairs).unwrap(), options, "{texts:?}");
            }
            let printed = OPTIONS.iter().filter(|o| o.text_of(&marking(&given)).is_some()).count();
            assert_eq!(printed, OPTIONS.len() - 1, "all but the other subject");
        }
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
        assert!(error(&[("SHAPE", "round")]).contains("SHAPE=round is not FREE or RIGID"));
        assert!(error(&[("BASIS", "sines")]).contains("BASIS=sines is not BIGGS or COTANGENT"));
        let short = error(&[("CODE", "LDPC"), ("MESSAGE", "0123456789abcdef")]);
        assert!(short.contains("exactly 128 bits, not 64: use 32 hexadecimal digits"), "{short}");
        assert!(error(&[("COLOUR", "red")]).contains("unknown option COLOUR: use KEY, "));
        assert!(error(&[("KEY", "a"), ("key", "b")]).contains("given twice"));
        assert!(error(&[("RECIPIENT", " ")]).contains("RECIPIENT is empty"));
        assert!(error(&[("RECIPIENT", "a"), ("MESSAGE", "00")]).contains("exactly one"));
        assert!(error(&[("MESSAGE", "xyz")]).contains("hexadecimal"));
        assert!(error(&[("LAYERS", "a,,b")]).contains("empty name"));
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
