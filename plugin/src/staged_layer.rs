//! A layer in the staging GeoPackage, with the values of its features that a GeoPackage would lose.
//!
//! Fields are renamed where names collide, and become text where GeoPackage has no such type. The
//! rest (unset fields, −0.0 and NaN, texts in other encodings, ids that are not ascending) is kept
//! in a separate column, which is created when it is first needed.

use crate::{
    error::{Error, Result},
    ffi_features::{Feature, FeatureRef, NULL_ID},
    ffi_output::{Field, LayerSpec, Output},
    ffi_source::View,
};
use meshmark_dataset::{formats::Format, geopackage::safe_layer_name};
use std::ffi::CString;

/// The column for the styles of features.
const STYLE_COLUMN: &str = "OGR_STYLE";
/// The column for the native data of features from a GeoJSON file.
pub const NATIVE_COLUMN: &str = "OGR_NATIVE";
/// The column for values that a GeoPackage would lose.
const LOST_COLUMN: &str = "OGR_VALUES";

/// A layer that a host writes.
pub struct StagedLayer {
    /// Its specification by the host.
    pub spec: LayerSpec,
    /// Its name in the staging GeoPackage.
    pub name: String,
    number: usize,
    /// Whether the target is a GeoPackage as well.
    is_geopackage: bool,
    /// Whether the target is GeoJSON.
    is_json: bool,
    fields: Vec<Field>,
    /// The field of the staging GeoPackage for every field of the layer.
    columns: Vec<Option<usize>>,
    /// Fields with several values each.
    lists: Vec<usize>,
    /// Names in the staging GeoPackage, lower case.
    taken: Vec<String>,
    style_column: Option<usize>,
    native_column: Option<usize>,
    lost_column: Option<usize>,
    /// How many features precede the first one that the host numbered.
    before_ids: Option<usize>,
    last_id: i64,
    /// The number of features.
    features: usize,
}

/// A value of a feature that a GeoPackage would lose.
#[derive(Debug, PartialEq)]
enum Lost {
    /// Its id, GDAL's null one when it has none.
    Id(i64),
    /// An unset field.
    Unset(usize),
    /// A number.
    Real(usize, f64),
    /// A text, or a list as text, that is not UTF-8.
    Text(usize, Vec<u8>),
}

impl StagedLayer {
    /// Creates the layer of this number in the staging GeoPackage.
    pub fn new(
        spec: LayerSpec,
        number: usize,
        schema: &Output,
        staged: &mut Output,
        format: &Format,
    ) -> Result<Self> {
        let [_, id, geometry] = schema.names(number);
        let or = |name: String, default: &str| if name.is_empty() { default.into() } else { name };
        let (id, geometry) = (or(id, "fid"), or(geometry, "geom"));
        let name = safe_layer_name(&spec.name).into_owned();
        let options = [("FID", &id), ("GEOMETRY_NAME", &geometry), ("SPATIAL_INDEX", &"NO".to_string())];
        let options = options.map(|(name, value)| (name.to_string(), value.clone()));
        staged.add_layer(&spec.renamed(name.clone(), options.into()), true)?;
        let taken = [&id, &geometry, STYLE_COLUMN, NATIVE_COLUMN, LOST_COLUMN].map(str::to_lowercase).into();
        let (fields, columns, lists) = (Vec::new(), Vec::new(), Vec::new());
        Ok(StagedLayer {
            spec,
            name,
            number,
            is_geopackage: format.driver == "GPKG",
            is_json: format.has_native_data(),
            fields,
            columns,
            lists,
            taken,
            style_column: None,
            native_column: None,
            lost_column: None,
            before_ids: None,
            last_id: 0,
            features: 0,
        })
    }

    /// Adds a field; `name` is its name from the host.
    pub fn add_field(&mut self, staged: &Output, field: &Field, name: &str) -> Result<()> {
        let base = if name.is_empty() { "field" } else { name };
        let mut unique = base.to_string();
        let mut copy = 2;
        while self.taken.contains(&unique.to_lowercase()) {
            unique = format!("{base}_{copy}");
            copy += 1;
        }
        self.taken.push(unique.to_lowercase());
        let column = staged.field_count(self.number);
        staged.add_field(self.number, &field.staged(unique, self.is_geopackage), true, true)?;
        if field.is_list() {
            self.lists.push(self.columns.len());
        }
        self.columns.push(Some(column));
        self.fields.push(field.clone());
        Ok(())
    }

    /// Stages a feature and returns its id.
    pub fn write(&mut self, staged: &Output, feature: FeatureRef) -> Result<i64> {
        let style = feature.style();
        let native = feature.native_data().filter(|_| self.is_json);
        let id = feature.id();
        if id.is_some() {
            self.before_ids.get_or_insert(self.features);
        }
        let keeps_id = id.is_some_and(|id| self.is_geopackage || id > self.last_id);
        let mut lost = if self.is_geopackage { Vec::new() } else { self.lost(feature) };
        match id {
            Some(id) if !keeps_id => lost.push(Lost::Id(id)),
            None if self.before_ids.is_some() && !self.is_geopackage => lost.push(Lost::Id(NULL_ID)),
            _ => {}
        }
        let number = self.number;
        let own = [
            (style.is_some(), &mut self.style_column, STYLE_COLUMN),
            (native.is_some(), &mut self.native_column, NATIVE_COLUMN),
            (!lost.is_empty(), &mut self.lost_column, LOST_COLUMN),
        ];
        for (is_needed, column, name) in own {
            if is_needed && column.is_none() {
                *column = Some(staged.field_count(number));
                staged.add_field(number, &Field::text(name.into()), false, true)?;
            }
        }
        let copy = staged.feature(self.number);
        copy.copy_from(feature, &self.columns, &self.lists)?;
        if let Some((column, style)) = self.style_column.zip(style) {
            copy.set_text(column, &style);
        }
        if let Some((column, native)) = self.native_column.zip(native) {
            copy.set_c_text(column, &native);
        }
        for lost in &lost {
            if let Lost::Text(field, _) = *lost {
                copy.unset(self.columns[field].expect("every field has a column"));
            }
        }
        if let Some(column) = self.lost_column.filter(|_| !lost.is_empty()) {
            let texts: Vec<String> = lost.iter().map(Lost::to_text).collect();
            copy.set_text(column, &texts.join(" "));
        }
        if let Some(id) = id.filter(|_| keeps_id) {
            copy.set_id(id);
        }
        // Messages of GeoPackage do not apply to another format.
        let staged_id = staged.write(self.number, &copy, !self.is_geopackage)?;
        self.last_id = self.last_id.max(staged_id);
        self.features += 1;
        Ok(id.unwrap_or(staged_id))
    }

    /// Returns the values of the fields of a feature that a GeoPackage would lose.
    fn lost(&self, feature: FeatureRef) -> Vec<Lost> {
        let of_field = |(number, field): (usize, &Field)| {
            if feature.is_unset(number) {
                return Some(Lost::Unset(number));
            }
            if field.is_real() {
                let value = feature.real(number);
                let is_lost = value.is_nan() || value == 0.0 && value.is_sign_negative();
                return is_lost.then_some(Lost::Real(number, value));
            }
            let text = || if field.is_list() { feature.list(number) } else { feature.bytes(number) };
            let bytes = if field.is_list() || field.is_text() { text() } else { Vec::new() };
            std::str::from_utf8(&bytes).is_err().then_some(Lost::Text(number, bytes))
        };
        self.fields.iter().enumerate().filter_map(of_field).collect()
    }

    /// Writes all features of the marked layer with the attributes that the host gave them.
    pub fn write_marked(&self, view: &View, output: &Output) -> Result<()> {
        let fields = self.fields_of_columns();
        let mut written = 0;
        view.for_each(&self.name, |marked| {
            let feature = output.feature(self.number);
            feature.copy_from(marked.borrow(), &fields, &[])?;
            if let Some(column) = self.style_column {
                feature.set_style(&marked.borrow().text(column));
            }
            let native = self.native_column.map(|column| marked.borrow().bytes(column)).unwrap_or_default();
            if let Some(native) = CString::new(native).ok().filter(|native| !native.is_empty()) {
                feature.set_native_data(&native);
            }
            let has_id = self.before_ids.is_some_and(|before| self.is_geopackage || written >= before);
            if let Some(id) = marked.borrow().id().filter(|_| has_id) {
                feature.set_id(id);
            }
            let lost = self.lost_column.map(|column| marked.borrow().text(column)).unwrap_or_default();
            lost.split_whitespace().filter_map(Lost::from_text).for_each(|lost| lost.restore(&feature));
            written += 1;
            output.write(self.number, &feature, true).map(drop)
        })?;
        match written == self.features {
            true => Ok(()),
            false => Err(Error::Writing {
                what: format!("reading layer \"{}\" again", self.spec.name),
                reason: format!("it has {written} features, and {} were written to it", self.features),
            }),
        }
    }

    /// Returns the field of the layer for every column of the staging GeoPackage.
    fn fields_of_columns(&self) -> Vec<Option<usize>> {
        let own = [self.style_column, self.native_column, self.lost_column];
        let last = self.columns.iter().chain(&own).flatten().max();
        let mut fields = vec![None; last.map_or(0, |last| last + 1)];
        for (field, column) in self.columns.iter().enumerate() {
            if let Some(column) = *column {
                fields[column] = Some(field);
            }
        }
        fields
    }
}

impl Lost {
    fn to_text(&self) -> String {
        match self {
            Lost::Id(id) => format!("id:{id}"),
            Lost::Unset(field) => format!("unset:{field}"),
            Lost::Real(field, value) => format!("real:{field}:{:x}", value.to_bits()),
            Lost::Text(field, bytes) => {
                format!("text:{field}:{}", meshmark_core::hex::encode(bytes))
            }
        }
    }

    fn from_text(text: &str) -> Option<Self> {
        let (kind, rest) = text.split_once(':')?;
        let (field, value) = rest.split_once(':').unwrap_or((rest, ""));
        let byte = |at| u8::from_str_radix(value.get(2 * at..2 * at + 2)?, 16).ok();
        match kind {
            "id" => rest.parse().ok().map(Lost::Id),
            "unset" => field.parse().ok().map(Lost::Unset),
            "real" => {
                let bits = u64::from_str_radix(value, 16).ok()?;
                Some(Lost::Real(field.parse().ok()?, f64::from_bits(bits)))
            }
            "text" => {
                let bytes: Option<Vec<u8>> = (0..value.len() / 2).map(byte).collect();
                Some(Lost::Text(field.parse().ok()?, bytes?))
            }
            _ => None,
        }
    }

    fn restore(&self, feature: &Feature) {
        match self {
            Lost::Id(id) => feature.set_id(*id),
            Lost::Unset(field) => feature.unset(*field),
            Lost::Real(field, value) => feature.set_real(*field, *value),
            Lost::Text(field, bytes) => {
                feature.set_c_text(*field, &CString::new(bytes.clone()).unwrap_or_default());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_can_be_written_down() {
        let cases = [
            Lost::Id(-7),
            Lost::Unset(3),
            Lost::Real(0, -0.0),
            Lost::Text(12, vec![0xe9, b' ']),
            Lost::Text(1, Vec::new()),
        ];
        for lost in cases {
            assert_eq!(Lost::from_text(&lost.to_text()), Some(lost));
        }
        let Some(Lost::Real(1, nan)) = Lost::from_text(&Lost::Real(1, f64::NAN).to_text()) else { panic!() };
        assert_eq!(nan.to_bits(), f64::NAN.to_bits());
    }
}
