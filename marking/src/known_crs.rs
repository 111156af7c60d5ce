//! The CRS of a map: its own, or the one that an option or a record states.

use crate::{Error, Result, TransformableCrs};

/// Where the CRS of a map comes from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum CrsSource {
    /// The map has it, or has none, and nobody states one.
    #[default]
    Map,
    /// The option SRS, as the map has none.
    Option,
    /// The record of its marking, as the map has none or this other one.
    Record {
        /// The name of the other one.
        other: Option<String>,
    },
}

/// What is known of the CRS of a map beside the map.
pub struct KnownCrs<C> {
    given: Option<C>,
    /// The text in the record, and the CRS that it means.
    recorded: Option<(String, C)>,
}

impl<C: TransformableCrs> KnownCrs<C> {
    /// Parses the CRS of a map that has none, and the one in which the map was marked, from its record.
    /// A CRS of a record that the library of the front end does not know states nothing.
    ///
    /// # Errors
    /// [`Error::UnknownSrs`].
    pub fn parse(srs: Option<&str>, recorded: Option<&str>) -> Result<Self> {
        let given = srs.map(C::parse).transpose()?;
        let recorded = recorded.and_then(|text| Some((text.to_string(), C::parse(text).ok()?)));
        Ok(KnownCrs { given, recorded })
    }

    /// Returns whether the option SRS is another CRS than the record has.
    pub fn is_contradiction(&self) -> bool {
        match (&self.given, &self.recorded) {
            (Some(given), Some((_, recorded))) => !given.is_same(recorded),
            _ => false,
        }
    }

    /// Returns the CRS of a layer, and where it comes from. The mark was made in the CRS of the record,
    /// so that it takes precedence.
    ///
    /// # Errors
    /// [`Error::ContradictingSrs`].
    pub fn of_layer(&self, own: Option<C>) -> Result<(Option<C>, CrsSource)> {
        match (own, &self.recorded, &self.given) {
            (Some(own), Some((text, recorded)), _) if own.label() == *text || own.is_same(recorded) => {
                Ok((Some(own), CrsSource::Map))
            }
            (own, Some((_, recorded)), _) => {
                let other = own.map(|own| own.brief_name());
                Ok((Some(recorded.clone()), CrsSource::Record { other }))
            }
            (Some(own), None, Some(given)) if !own.is_same(given) => {
                let [crs, srs] = own.names_apart(given);
                Err(Error::ContradictingSrs { crs, srs })
            }
            (Some(own), None, _) => Ok((Some(own), CrsSource::Map)),
            (None, None, Some(given)) => Ok((Some(given.clone()), CrsSource::Option)),
            (None, None, None) => Ok((None, CrsSource::Map)),
        }
    }
}
