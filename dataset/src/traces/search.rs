//! The search for traces in a dataset.

use super::{
    numbers::{bytes_of_base64, bytes_of_digits, of_text, of_value, pairs_of_bytes},
    trace::{Kind, Trace},
    vertices::{Tally, Vertices},
};
use crate::{
    CoordinateSystem, Error, Result, Survey,
    geojson_text::{has_foreign_places, without_places},
    read_geometry::read_geometry,
    selection::chosen_layers,
    turns::turn,
};
use gdal::{
    Dataset,
    vector::{Feature, FieldValue, Layer, LayerAccess, OGRFieldType},
};
use meshmark_core::options::Options;
use meshmark_marking::{Chains, Extent, Faults, LeftOut, reproject};
use std::collections::{BTreeMap, BTreeSet, HashSet};

/// Values further apart in a text, or in a list, are no pair: `x1, 2.5, y1, 3.5` has a number between
/// the two of a place.
const FURTHEST_APART: usize = 2;

/// The way to read foreign members of GeoJSON, which GDAL holds beside the attributes.
pub struct ForeignMembers<'a> {
    /// Returns those of a feature as a JSON text.
    pub of: &'a dyn Fn(&Feature) -> Option<String>,
    /// The attribute that holds them instead.
    pub column: Option<&'a str>,
}

/// Returns the traces in a dataset whose marked layers are `map`; `last_failure` is as in
/// [`crate::Selection`].
///
/// # Errors
/// Fails for a layer that cannot be read to its end.
pub fn search(
    dataset: &Dataset,
    map: &Survey,
    options: &Options,
    foreign: &ForeignMembers,
    last_failure: &dyn Fn() -> Option<String>,
) -> Result<Vec<Trace>> {
    let vertices = Vertices::new(map, options.parameters.amplitude_m)?;
    let mut traces = Vec::new();
    for (index, name) in chosen_layers(dataset, None)? {
        let _turn = turn(dataset, &name)?;
        let mut layer = dataset.layer(index)?;
        let is_marked = options.layers.as_ref().is_none_or(|layers| layers.contains(&name));
        let mut attributes = Attributes::new(&vertices, &layer, foreign);
        let mut geometries = (!is_marked).then(|| Geometries::new(&layer));
        layer.reset_feature_reading();
        for feature in layer.features() {
            attributes.read(&feature);
            geometries.iter_mut().try_for_each(|geometries| geometries.read(&feature, &name))?;
        }
        layer.reset_feature_reading();
        if let Some(reason) = last_failure() {
            return Err(Error::Unreadable { layer: name, reason });
        }
        let geometries = geometries.map(|geometries| geometries.kind(&vertices, map, &name)).transpose()?;
        let kinds = attributes.kinds().into_iter().chain(geometries.flatten());
        traces.extend(kinds.map(|kind| Trace { layer: name.clone(), kind }));
    }
    Ok(traces)
}

/// The search in foreign members that are read elsewhere.
pub struct ForeignSearch<'a> {
    vertices: Vertices<'a>,
    found: InForeignMembers,
}

impl<'a> ForeignSearch<'a> {
    /// Begins the search for vertices of a map.
    ///
    /// # Errors
    /// Fails for a map without a metric.
    pub fn new(map: &'a Survey, options: &Options) -> Result<Self> {
        let vertices = Vertices::new(map, options.parameters.amplitude_m)?;
        Ok(ForeignSearch { vertices, found: InForeignMembers::default() })
    }

    /// Adds a feature of a GeoJSON file.
    pub fn add(&mut self, feature: &[u8]) {
        let foreign = without_places(feature, false).unwrap_or_default();
        self.found.add(&String::from_utf8_lossy(&foreign), &self.vertices);
    }

    /// Returns the traces as those of this layer.
    pub fn trace(&self, layer: &str) -> Option<Trace> {
        let kind = self.found.kind(&self.vertices)?;
        Some(Trace { layer: layer.into(), kind })
    }
}

/// Places in the foreign members of features.
#[derive(Default)]
struct InForeignMembers {
    has_places: bool,
    tally: Tally,
}

impl InForeignMembers {
    fn add(&mut self, text: &str, vertices: &Vertices) {
        self.has_places |= has_foreign_places(text.as_bytes());
        count_text(text, vertices, &mut self.tally);
    }

    fn kind(&self, vertices: &Vertices) -> Option<Kind> {
        (self.has_places || vertices.are_found_by(&self.tally, 1)).then_some(Kind::ForeignMembers)
    }
}

/// The search in the attributes of a layer.
struct Attributes<'a> {
    vertices: &'a Vertices<'a>,
    foreign: &'a ForeignMembers<'a>,
    fields: Vec<Field>,
    /// Places of two numbers, by the fields that hold them.
    of_two: BTreeMap<[usize; 2], Tally>,
    in_foreign: InForeignMembers,
}

/// A field of a layer.
struct Field {
    name: String,
    kind: OGRFieldType::Type,
    is_foreign: bool,
    /// The places that each of its values holds by itself.
    tally: Tally,
}

impl<'a> Attributes<'a> {
    fn new(vertices: &'a Vertices<'a>, layer: &Layer, foreign: &'a ForeignMembers<'a>) -> Self {
        let field = |field: gdal::vector::Field| {
            let name = field.name();
            let is_foreign = foreign.column == Some(&name);
            Field { name, kind: field.field_type(), is_foreign, tally: Tally::default() }
        };
        let fields = layer.defn().fields().map(field).collect();
        Attributes { vertices, foreign, fields, of_two: BTreeMap::new(), in_foreign: Default::default() }
    }

    fn read(&mut self, feature: &Feature) {
        if let Some(text) = (self.foreign.of)(feature) {
            self.in_foreign.add(&text, self.vertices);
        }
        let mut numbers = Vec::new();
        for (index, field) in self.fields.iter_mut().enumerate() {
            let number = match field.kind {
                OGRFieldType::OFTInteger | OGRFieldType::OFTInteger64 | OGRFieldType::OFTReal => {
                    feature.field_as_double(index).ok().flatten()
                }
                _ => {
                    let text = feature.field_as_string(index).ok().flatten().unwrap_or_default();
                    match (text.is_empty(), field.is_foreign) {
                        (true, _) => continue,
                        (false, true) => self.in_foreign.add(&text, self.vertices),
                        (false, false) => field.count(&text, feature, index, self.vertices),
                    }
                    of_value(&text)
                }
            };
            numbers.extend(number.filter(|number| self.vertices.may_hold(*number)).map(|n| (index, n)));
        }
        for (index, (a, x)) in numbers.iter().enumerate() {
            for (b, y) in &numbers[index + 1..] {
                self.vertices.count([*x, *y], self.of_two.entry([*a, *b]).or_default());
            }
        }
    }

    fn kinds(self) -> Vec<Kind> {
        let of_one = self.fields.iter().enumerate().map(|(index, field)| ([index; 2], &field.tally));
        let all: Vec<_> = of_one.chain(self.of_two.iter().map(|(fields, tally)| (*fields, tally))).collect();
        let found = all.iter().filter(|(_, tally)| self.vertices.are_found_by(tally, all.len()));
        let (mut fields, mut vertices) = (BTreeSet::new(), HashSet::new());
        for (of, tally) in found {
            fields.extend(*of);
            vertices.extend(tally.near.iter().copied());
        }
        let names: Vec<String> = fields.into_iter().map(|field| self.fields[field].name.clone()).collect();
        let attributes = Kind::Attributes { names, vertices: vertices.len() };
        let attributes = (!vertices.is_empty()).then_some(attributes);
        attributes.into_iter().chain(self.in_foreign.kind(self.vertices)).collect()
    }
}

impl Field {
    /// Counts the places in one value, whose text GDAL may cut short if it is a list.
    fn count(&mut self, text: &str, feature: &Feature, index: usize, vertices: &Vertices) {
        let is_list = matches!(
            self.kind,
            OGRFieldType::OFTRealList
                | OGRFieldType::OFTIntegerList
                | OGRFieldType::OFTInteger64List
                | OGRFieldType::OFTStringList
        );
        match if is_list { feature.field(index) } else { Ok(None) } {
            Ok(Some(FieldValue::RealListValue(list))) => count_list(&list, vertices, &mut self.tally),
            Ok(Some(FieldValue::IntegerListValue(list))) => {
                count_list(&list.into_iter().map(f64::from).collect::<Vec<_>>(), vertices, &mut self.tally);
            }
            Ok(Some(FieldValue::Integer64ListValue(list))) => {
                count_list(
                    &list.into_iter().map(|n| n as f64).collect::<Vec<_>>(),
                    vertices,
                    &mut self.tally,
                );
            }
            Ok(Some(FieldValue::StringListValue(list))) => {
                count_text(&list.join(" "), vertices, &mut self.tally);
            }
            _ => count_text(text, vertices, &mut self.tally),
        }
    }
}

/// Counts the places in a text, also in one of hexadecimal digits or base64.
fn count_text(text: &str, vertices: &Vertices, tally: &mut Tally) {
    count_list(&of_text(text), vertices, tally);
    for bytes in bytes_of_digits(text).chain(bytes_of_base64(text)) {
        pairs_of_bytes(&bytes, |pair| {
            if vertices.may_hold(pair[0]) {
                vertices.count(pair, tally);
            }
        });
    }
}

fn count_list(numbers: &[f64], vertices: &Vertices, tally: &mut Tally) {
    for (index, number) in numbers.iter().enumerate().filter(|(_, number)| vertices.may_hold(**number)) {
        let after = numbers[index + 1..].iter().take(FURTHEST_APART);
        after.for_each(|other| vertices.count([*number, *other], tally));
    }
}

/// The geometries of a layer that is not marked.
struct Geometries {
    columns: Vec<(Option<CoordinateSystem>, Chains)>,
}

impl Geometries {
    fn new(layer: &Layer) -> Self {
        let srs = layer.defn().geom_fields().map(|field| field.spatial_ref().ok());
        let crs = srs.map(|srs| srs.and_then(CoordinateSystem::of_layer));
        Geometries { columns: crs.map(|crs| (crs, Chains::default())).collect() }
    }

    fn read(&mut self, feature: &Feature, layer: &str) -> Result<()> {
        let mut left_out = LeftOut::default(); // marking does not depend on them
        let how = (false, Extent::ANY);
        self.columns.iter_mut().enumerate().try_for_each(|(column, (_, chains))| {
            read_geometry(feature, column, layer, how, Faults::LeaveOut(&mut left_out), chains)
        })
    }

    fn kind(self, vertices: &Vertices, map: &Survey, layer: &str) -> Result<Option<Kind>> {
        let mut tally = Tally::default();
        for (crs, mut chains) in self.columns {
            if let Some(target) = &map.crs {
                reproject(&mut chains.coords, crs.as_ref(), target, layer)?;
            }
            chains.coords.iter().for_each(|place| vertices.count_in_map(*place, &mut tally, || true));
        }
        let found = vertices.are_found_by(&tally, 1);
        Ok(found.then_some(Kind::Geometries { vertices: tally.near.len() }))
    }
}
