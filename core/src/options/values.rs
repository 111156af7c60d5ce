//! The values of options as a user gives them, checked against the table.

use super::{
    list::split_list,
    subject::Subject,
    table::{Kind, OptionSpec, spec},
};
use crate::{Error, Result, message::Message};

/// The given pairs, each name known and given once.
pub(super) struct Values<'a>(Vec<(&'static OptionSpec, &'a str)>);

impl<'a> Values<'a> {
    pub(super) fn collect(
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

    pub(super) fn given(&self, name: &str) -> Option<&'a str> {
        self.0.iter().find(|(spec, _)| spec.name == name).map(|(_, value)| *value)
    }

    pub(super) fn text(&self, name: &'static str) -> Result<Option<String>> {
        match self.given(name) {
            Some(value) if value.trim().is_empty() => Err(Error::EmptyOption(name)),
            value => Ok(value.map(String::from)),
        }
    }

    pub(super) fn subject(&self) -> Result<Option<Subject>> {
        match (self.text("RECIPIENT")?, self.text("MESSAGE")?) {
            (Some(_), Some(_)) => Err(Error::BothSubjects),
            (Some(text), None) => Ok(Some(Subject::Recipient(text))),
            (None, Some(hex)) => Ok(Some(Subject::Message(Message::from_hex(&hex)?))),
            (None, None) => Ok(None),
        }
    }

    pub(super) fn list(&self, option: &'static str) -> Result<Option<Vec<String>>> {
        let Some(value) = self.text(option)? else { return Ok(None) };
        let Some(names) = split_list(&value) else { return Err(Error::Quotes { option, value }) };
        if names.iter().any(String::is_empty) {
            return Err(Error::EmptyName { option, value });
        }
        Ok(Some(names))
    }

    pub(super) fn number(&self, name: &str) -> Result<Option<f64>> {
        self.parsed(name, |kind, text| {
            let Kind::Number(above, most) = kind else { unreachable!("{name} is a number") };
            text.parse().ok().filter(|number| *number > above && *number <= most)
        })
    }

    pub(super) fn integer(&self, name: &str) -> Result<Option<usize>> {
        self.parsed(name, |kind, text| {
            let Kind::Integer(least, most) = kind else { unreachable!("{name} is an integer") };
            text.parse().ok().filter(|number| (least..=most).contains(number))
        })
    }

    pub(super) fn choice<T>(&self, name: &str, from_name: impl Fn(&str) -> Option<T>) -> Result<Option<T>> {
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
