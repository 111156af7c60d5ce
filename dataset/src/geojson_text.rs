//! The text of GeoJSON: this module finds positions and bounding boxes in it, so that they can be
//! replaced and the rest stays unchanged. GDAL keeps the text of a GeoJSON file as *native data*,
//! and writes from it what its own model of features does not hold: ids, foreign members, a fourth
//! ordinate (RFC 7946).
//!
//! The text may hold NaN, which a JSON parser refuses, so this module walks it; GDAL has parsed it
//! before.

use std::{borrow::Cow, ops::Range};

/// GDAL's media type of native data in GeoJSON.
pub const MEDIA_TYPE: &str = "application/vnd.geo+json";

/// Geometries and coordinates are nested at most this deep; those of GDAL are less.
const MOST_NESTED: usize = 64;

/// A part of a text, as a range of its bytes.
#[derive(Debug, PartialEq)]
pub enum Place {
    /// `[ x, y, … ]`.
    Position(Range<usize>),
    /// The bounding box of a geometry, a feature or a collection.
    BoundingBox(Range<usize>),
}

/// Returns the positions and bounding boxes of a feature or a collection in the order of the text;
/// `None` when it is not an object.
pub fn places(text: &[u8]) -> Option<Vec<Place>> {
    let mut places = Vec::new();
    for Member { key, value, .. } in Text(text).members(0..text.len())? {
        match &*key {
            b"bbox" => places.push(Place::BoundingBox(value)),
            b"geometry" => Text(text).places_of_geometry(value, 0, &mut places)?,
            _ => {}
        }
    }
    Some(places)
}

/// Returns the native data of a feature or a collection without the parts that change with the
/// marking or that its features hold themselves: attributes, bounding boxes, and positions except
/// for ordinates after the third. Where there was a bounding box, GDAL makes a new one. The result
/// is `None` when nothing is left that GDAL would write.
///
/// Numbers and booleans among the attributes stay where the layer `has_json_fields`: GDAL reads
/// an attribute that is a number in one feature and a string in another as JSON text, and writes
/// it as a number again where the native data has one (GDAL 3.9 and later).
///
/// ```
/// # use meshmark_dataset::geojson_text::without_places;
/// let feature = br#"{"type": "Feature", "id": 7, "bbox": [1, 2, 1, 2], "properties": {"a": 1},
///                    "geometry": {"type": "Point", "coordinates": [1, 2]}}"#;
/// assert_eq!(without_places(feature, false).unwrap(), br#"{"id":7,"bbox":null,"properties":{}}"#);
/// // What GDAL writes of itself needs no text.
/// assert_eq!(without_places(br#"{"type": "Feature", "properties": {"a": 1}}"#, false), None);
/// ```
pub fn without_places(text: &[u8], has_json_fields: bool) -> Option<Vec<u8>> {
    let all = Text(text);
    let members = all.members(0..text.len())?;
    let properties =
        members.iter().find(|member| &*member.key == b"properties").map(|member| member.value.clone());
    let attributes = match &properties {
        Some(properties) if has_json_fields => all.numbers_and_booleans(properties.clone()),
        _ => Vec::new(),
    };
    let mut kept = Vec::new();
    for Member { key, quoted, value } in members {
        let value = match &*key {
            b"type" | b"properties" => continue,
            b"bbox" => b"null".into(),
            b"geometry" if all.has_more(&value, 0)? => all.without_places_of_geometry(value)?,
            b"geometry" => continue,
            _ => text[value].to_vec(),
        };
        kept.push([quoted, b":", &value].concat());
    }
    match properties {
        Some(_) if kept.is_empty() && attributes.is_empty() => return None,
        Some(_) => kept.push([b"\"properties\":{".as_slice(), &attributes.join(&b','), b"}"].concat()),
        None => {} // GDAL writes none then
    }
    Some([b"{".as_slice(), &kept.join(&b','), b"}"].concat())
}

/// Returns whether a foreign member of a feature or its geometry holds a geometry or a bounding
/// box, which stays unmarked.
pub fn has_foreign_places(text: &[u8]) -> bool {
    let all = Text(text);
    let Some(members) = all.members(0..text.len()) else { return false };
    members.into_iter().any(|Member { key, value, .. }| match &*key {
        b"type" | b"id" | b"bbox" | b"properties" => false,
        b"geometry" => {
            all.members(value).unwrap_or_default().into_iter().any(|Member { key, value, .. }| {
                !matches!(&*key, b"type" | b"bbox" | b"coordinates" | b"geometries")
                    && names_places(&text[value])
            })
        }
        _ => names_places(&text[value]),
    })
}

/// Returns whether a text contains a key of places.
fn names_places(value: &[u8]) -> bool {
    let (text, mut at) = (Text(value), 0);
    while let Some(before) = value[at..].iter().position(|byte| *byte == b'"') {
        let start = at + before;
        let Some(end) = text.end_of(start) else { return false };
        let is_key = value.get(text.skip_blanks(end)) == Some(&b':');
        if is_key && matches!(&*unescaped(&value[start..end]), b"coordinates" | b"bbox") {
            return true;
        }
        at = end;
    }
    false
}

/// Returns a quoted text without quotes and escapes; without quotes alone when it is not UTF-8.
fn unescaped(quoted: &[u8]) -> Cow<'_, [u8]> {
    let plain = &quoted[1..quoted.len() - 1];
    let text = || serde_json::from_slice::<String>(quoted).ok();
    let decoded = plain.contains(&b'\\').then(text).flatten();
    decoded.map_or(plain.into(), |text| text.into_bytes().into())
}

/// Returns the ordinates of a position or a bounding box, as written: numbers, where it is valid.
pub fn ordinates(list: &[u8]) -> impl Iterator<Item = &[u8]> {
    let elements = if list.is_empty() { None } else { Text(list).elements(0..list.len()) };
    elements.unwrap_or_default().into_iter().map(|ordinate| &list[ordinate])
}

/// A JSON text; ranges are those of values without surrounding blanks.
struct Text<'a>(&'a [u8]);

/// A member of an object.
struct Member<'a> {
    key: Cow<'a, [u8]>,
    /// The key as written, with quotes and escapes.
    quoted: &'a [u8],
    value: Range<usize>,
}

impl<'a> Text<'a> {
    /// Returns the keys and values of an object.
    fn members(&self, object: Range<usize>) -> Option<Vec<Member<'a>>> {
        let mut members = Vec::new();
        let mut at = self.enter(object, b'{')?;
        while self.0.get(at)? != &b'}' {
            let quoted = &self.0[at..self.end_of(at)?];
            let colon = self.skip_blanks(at + quoted.len());
            if !quoted.starts_with(b"\"") || self.0.get(colon)? != &b':' {
                return None;
            }
            let value = self.skip_blanks(colon + 1);
            let value = value..self.end_of(value)?;
            at = self.next(value.end);
            members.push(Member { key: unescaped(quoted), quoted, value });
        }
        Some(members)
    }

    /// Returns the members of an object that are numbers or booleans.
    fn numbers_and_booleans(&self, object: Range<usize>) -> Vec<Vec<u8>> {
        let is_kept = |value: &Range<usize>| !matches!(self.0[value.start], b'"' | b'{' | b'[' | b'n');
        let members = self.members(object).unwrap_or_default().into_iter();
        let kept = members.filter(|member| is_kept(&member.value));
        kept.map(|member| [member.quoted, b":", &self.0[member.value]].concat()).collect()
    }

    /// Returns the values of an array.
    fn elements(&self, array: Range<usize>) -> Option<Vec<Range<usize>>> {
        let mut elements = Vec::new();
        let mut at = self.enter(array, b'[')?;
        while self.0.get(at)? != &b']' {
            let element = at..self.end_of(at)?;
            at = self.next(element.end);
            elements.push(element);
        }
        Some(elements)
    }

    /// Returns where the first value inside begins.
    fn enter(&self, value: Range<usize>, bracket: u8) -> Option<usize> {
        let start = self.skip_blanks(value.start);
        (*self.0.get(start)? == bracket).then(|| self.skip_blanks(start + 1))
    }

    fn skip_blanks(&self, at: usize) -> usize {
        at + self.0[at.min(self.0.len())..].iter().take_while(|byte| byte.is_ascii_whitespace()).count()
    }

    /// Returns where the next value of an object or an array begins, or where it ends.
    fn next(&self, at: usize) -> usize {
        let at = self.skip_blanks(at);
        if self.0.get(at) == Some(&b',') { self.skip_blanks(at + 1) } else { at }
    }

    /// Returns the end of the value that begins at `start`.
    fn end_of(&self, start: usize) -> Option<usize> {
        let (mut at, mut depth, mut in_text) = (start, 0_usize, false);
        loop {
            let byte = *self.0.get(at)?;
            match byte {
                b'\\' if in_text => at += 1,
                b'"' => in_text = !in_text,
                _ if in_text => {}
                b'{' | b'[' => depth += 1,
                b'}' | b']' if depth > 0 => depth -= 1,
                b'}' | b']' | b',' | b':' if depth == 0 => return (at > start).then_some(at),
                _ if depth == 0 && byte.is_ascii_whitespace() => return Some(at),
                _ => {}
            }
            at += 1;
            if depth == 0 && !in_text && matches!(byte, b'"' | b'}' | b']') {
                return Some(at);
            }
        }
    }

    fn is(&self, value: &Range<usize>, bracket: u8) -> bool {
        self.0[value.start] == bracket
    }

    /// Appends the places of a geometry that is in `depth` others; `None` where it is nested too deep.
    fn places_of_geometry(
        &self,
        geometry: Range<usize>,
        depth: usize,
        places: &mut Vec<Place>,
    ) -> Option<()> {
        if !self.is(&geometry, b'{') {
            return Some(());
        }
        if depth > MOST_NESTED {
            return None;
        }
        for Member { key, value, .. } in self.members(geometry)? {
            match &*key {
                b"bbox" => places.push(Place::BoundingBox(value)),
                b"coordinates" => self.positions(value, 0, places)?,
                b"geometries" if self.is(&value, b'[') => {
                    for geometry in self.elements(value)? {
                        self.places_of_geometry(geometry, depth + 1, places)?;
                    }
                }
                _ => {}
            }
        }
        Some(())
    }

    fn positions(&self, coordinates: Range<usize>, depth: usize, places: &mut Vec<Place>) -> Option<()> {
        if !self.is(&coordinates, b'[') {
            return Some(());
        }
        if depth > MOST_NESTED {
            return None;
        }
        let elements = self.elements(coordinates.clone())?;
        match elements.first() {
            Some(first) if !self.is(first, b'[') => places.push(Place::Position(coordinates)),
            _ => elements.into_iter().try_for_each(|element| self.positions(element, depth + 1, places))?,
        }
        Some(())
    }

    /// Returns whether a geometry has parts that GDAL's model does not hold.
    fn has_more(&self, geometry: &Range<usize>, depth: usize) -> Option<bool> {
        if !self.is(geometry, b'{') {
            return Some(false);
        }
        if depth > MOST_NESTED {
            return None;
        }
        for Member { key, value, .. } in self.members(geometry.clone())? {
            let has_more = match &*key {
                b"type" | b"bbox" => false,
                b"coordinates" => self.has_fourth_ordinate(value)?,
                b"geometries" if self.is(&value, b'[') => {
                    let each =
                        self.elements(value)?.into_iter().map(|geometry| self.has_more(&geometry, depth + 1));
                    each.collect::<Option<Vec<bool>>>()?.contains(&true)
                }
                _ => true,
            };
            if has_more {
                return Some(true);
            }
        }
        Some(false)
    }

    fn has_fourth_ordinate(&self, coordinates: Range<usize>) -> Option<bool> {
        let mut places = Vec::new();
        self.positions(coordinates, 0, &mut places)?;
        let has = |place: &Place| matches!(place, Place::Position(at) if ordinates(&self.0[at.clone()]).count() > 3);
        Some(places.iter().any(has))
    }

    fn without_places_of_geometry(&self, geometry: Range<usize>) -> Option<Vec<u8>> {
        let (mut places, mut text, mut at) = (Vec::new(), Vec::new(), geometry.start);
        self.places_of_geometry(geometry.clone(), 0, &mut places)?;
        for place in places {
            let (Place::Position(range) | Place::BoundingBox(range)) = &place;
            text.extend(&self.0[at..range.start]);
            at = range.end;
            match place {
                Place::BoundingBox(_) => text.extend(b"null"),
                Place::Position(range) => {
                    let zeroed = |(i, number)| if i < 3 { b"0".as_slice() } else { number };
                    let ordinates: Vec<&[u8]> = ordinates(&self.0[range]).enumerate().map(zeroed).collect();
                    text.extend([b"[".as_slice(), &ordinates.join(&b','), b"]"].concat());
                }
            }
        }
        text.extend(&self.0[at..geometry.end]);
        Some(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(text: &str) -> Option<String> {
        without_places(text.as_bytes(), false).map(|text| String::from_utf8(text).unwrap())
    }

    #[test]
    fn what_features_hold_themselves_is_left_out_and_all_else_stays() {
        let cases = [
            (r#"{ "id": "a\"]}, b", "n": NaN }"#, Some(r#"{"id":"a\"]}, b","n":NaN}"#)),
            (
                r#"{ "name": "x", "bbox": [ 1, 2 ], "more": { "bbox": [ 3, 4 ] } }"#,
                Some(r#"{"name":"x","bbox":null,"more":{ "bbox": [ 3, 4 ] }}"#),
            ),
            (
                r#"{"properties":{"a":NaN},"geometry":{"type":"LineString","bbox":[1,2,3,4],"coordinates":[[1,2,3],[4,5]]}}"#,
                None,
            ),
            (
                r#"{"geometry":{"type":"MultiPoint","coordinates":[[1.5,2,3,4e5,-6],[7,8,9,1]]},"properties":{}}"#,
                Some(
                    r#"{"geometry":{"type":"MultiPoint","coordinates":[[0,0,0,4e5,-6],[0,0,0,1]]},"properties":{}}"#,
                ),
            ),
            (
                r#"{"geometry":{"geometries":[{"coordinates":[1,2],"bbox":[1,2,1,2],"a":[1,2]},{"coordinates":[]}]}}"#,
                Some(
                    r#"{"geometry":{"geometries":[{"coordinates":[0,0],"bbox":null,"a":[1,2]},{"coordinates":[]}]}}"#,
                ),
            ),
            (r#"{"geometry":{"coordinates":[{"a":[1,2],"b":[3,4],"c":[]}]}}"#, Some("{}")),
            (
                r#"{"geometry":{"coordinates":[1,2,3,{"a":[4,5]}]}}"#,
                Some(r#"{"geometry":{"coordinates":[0,0,0,{"a":[4,5]}]}}"#),
            ),
            (r#"{"geometry":null}"#, Some("{}")),
            (r#"{"properties":null,"x":1}"#, Some(r#"{"x":1,"properties":{}}"#)),
            (r#"{"properties":null}"#, None),
            ("{}", Some("{}")),
            (" { } ", Some("{}")),
        ];
        for (text, expected) in cases {
            assert_eq!(kept(text).as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn numbers_and_booleans_stay_for_fields_of_json() {
        for (text, expected) in [
            (
                r#"{"properties":{"a\"": 1.50,"b":"x","c":true,"d":null,"e":[1],"f":{"g":2},"h":-0}}"#,
                Some(r#"{"properties":{"a\"":1.50,"c":true,"h":-0}}"#),
            ),
            (r#"{"id":1,"properties":{"b":"x"}}"#, Some(r#"{"id":1,"properties":{}}"#)),
            (r#"{"properties":{"b":"x"}}"#, None),
            (r#"{"properties":null}"#, None),
        ] {
            let kept = without_places(text.as_bytes(), true);
            assert_eq!(kept.map(|text| String::from_utf8(text).unwrap()).as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn foreign_members_that_hold_places_are_found() {
        for (text, expected) in [
            (
                r#"{"bbox":[1],"geometry":{"coordinates":[1,2]},"properties":{"coordinates":[1]},"x":[1,2]}"#,
                false,
            ),
            (r#"{"x":"\"coordinates\": [1, 2]","y":"coordinates"}"#, false),
            (r#"{"place":{"type":"Point","coordinates": [1, 2]}}"#, true),
            (r#"{"tile":{"a":{"bbox" :[1,2,3,4]}}}"#, true),
            (r#"{"geometry":{"coordinates":[1,2],"meta":{"coordinates":[1,2]}}}"#, true),
            (r#"{"tile":{"shows":"bbox","bbox":[1,2,3,4]}}"#, true),
            (r#"{"tile":["coordinates",{"coordinates":[1,2]}]}"#, true),
            (r#"{"tile":{"b\u0062ox":[1,2,3,4]}}"#, true),
            ("null", false),
        ] {
            assert_eq!(has_foreign_places(text.as_bytes()), expected, "{text}");
        }
    }

    #[test]
    fn escapes_in_a_key_do_not_hide_it() {
        let text = r#"{"id":7,"\u0062box":[1,2,1,2],"geom\u0065try":{"coordinate\u0073":[1,2,3,4]}}"#;
        assert_eq!(places(text.as_bytes()).unwrap().len(), 2);
        let expected = r#"{"id":7,"\u0062box":null,"geom\u0065try":{"coordinate\u0073":[0,0,0,4]}}"#;
        assert_eq!(kept(text).as_deref(), Some(expected));
    }

    #[test]
    fn what_is_no_object_is_refused_before_a_character_is_cut() {
        for text in ["{é:1}", r#"{"a"é1}"#, r#"{"a" 1}"#, "{1:2}", "{'a':1}"] {
            assert_eq!((kept(text), places(text.as_bytes())), (None, None), "{text}");
        }
    }

    #[test]
    fn geometries_without_an_end_are_refused() {
        let nested = |before: &str, after: &str, depth: usize| {
            format!(r#"{{"geometry":{}{}}}"#, before.repeat(depth), after.repeat(depth))
        };
        let collections = |depth| nested(r#"{"geometries":["#, "]}", depth);
        let coordinates = |depth| nested("[", "]", depth).replace(":[", r#":{"coordinates":["#) + "}";
        for text in [&collections as &dyn Fn(usize) -> String, &coordinates] {
            assert_eq!(places(text(30).as_bytes()), Some(Vec::new()));
            let deep = text(100_000);
            assert_eq!((kept(&deep), places(deep.as_bytes())), (None, None));
        }
    }

    #[test]
    fn what_is_cut_short_has_no_places() {
        let text =
            r#"{"id":1,"bbox":[1,2,3,4],"geometry":{"type":"Point","coordinates":[1,2,3,4],"a":"\\"}}"#;
        assert!(kept(text).is_some());
        for end in 0..text.len() {
            assert_eq!(
                (kept(&text[..end]), places(&text.as_bytes()[..end])),
                (None, None),
                "{}",
                &text[..end]
            );
        }
    }
}
