//! Native data of GeoJSON, the only JSON that is walked by hand: nothing of a valid feature is lost
//! but what marking changes, no position remains, and no foreign member with places is overlooked.
#![no_main]

use libfuzzer_sys::fuzz_target;
use meshmark_dataset::geojson_text::{Place, has_foreign_places, ordinates, places, without_places};
use serde_json::{Map, Value};

fuzz_target!(|bytes: &[u8]| {
    let mut at = 0;
    for place in places(bytes).unwrap_or_default() {
        let (Place::Position(range) | Place::BoundingBox(range)) = place;
        assert!(at <= range.start && range.start < range.end && range.end <= bytes.len());
        at = range.end;
        ordinates(&bytes[range]).for_each(drop);
    }
    let kept = [false, true].map(|has_json_fields| without_places(bytes, has_json_fields));
    let has_foreign = has_foreign_places(bytes);
    let Ok(Value::Object(members)) = serde_json::from_slice(bytes) else { return };
    assert_eq!(has_foreign, holds_foreign_places(&members), "foreign places");
    for (kept, has_json_fields) in kept.into_iter().zip([false, true]) {
        let Some(kept) = kept else { continue };
        let Ok(Value::Object(kept)) = serde_json::from_slice(&kept) else {
            panic!("what is kept is no object")
        };
        check(&members, &kept, has_json_fields);
    }
});

/// Checks what is kept of the members of a feature.
fn check(members: &Map<String, Value>, kept: &Map<String, Value>, has_json_fields: bool) {
    for (key, value) in members {
        match key.as_str() {
            "type" => assert_eq!(kept.get(key), None),
            "properties" => {
                let kept = kept.get(key).and_then(Value::as_object).expect("properties are an object");
                let is_same = |(name, kept): (&String, &Value)| {
                    (kept.is_number() || kept.is_boolean()) && value.get(name) == Some(kept)
                };
                assert!(kept.is_empty() || has_json_fields && kept.iter().all(is_same), "attributes");
            }
            "bbox" => assert_eq!(kept.get(key), Some(&Value::Null)),
            "geometry" => kept.get(key).into_iter().for_each(check_geometry),
            _ => assert_eq!(kept.get(key), Some(value), "a foreign member changed"),
        }
    }
}

/// Checks that a geometry that is kept has no position.
fn check_geometry(geometry: &Value) {
    let Value::Object(members) = geometry else { return };
    assert!(members.get("bbox").is_none_or(Value::is_null));
    members.get("coordinates").into_iter().for_each(check_coordinates);
    if let Some(Value::Array(parts)) = members.get("geometries") {
        parts.iter().for_each(check_geometry);
    }
}

fn check_coordinates(coordinates: &Value) {
    let Value::Array(elements) = coordinates else { return };
    match elements.first() {
        Some(Value::Array(_)) | None => elements.iter().for_each(check_coordinates),
        Some(_) => elements.iter().take(3).for_each(|ordinate| assert_eq!(ordinate, &Value::from(0))),
    }
}

fn holds_foreign_places(members: &Map<String, Value>) -> bool {
    members.iter().any(|(key, value)| match key.as_str() {
        "type" | "id" | "bbox" | "properties" => false,
        "geometry" => {
            let foreign = |key: &str| !["type", "bbox", "coordinates", "geometries"].contains(&key);
            let of_geometry = value.as_object().into_iter().flatten();
            of_geometry.filter(|(key, _)| foreign(key)).any(|(_, value)| names_places(value))
        }
        _ => names_places(value),
    })
}

fn names_places(value: &Value) -> bool {
    match value {
        Value::Array(elements) => elements.iter().any(names_places),
        Value::Object(members) => members
            .iter()
            .any(|(key, value)| ["coordinates", "bbox"].contains(&key.as_str()) || names_places(value)),
        _ => false,
    }
}
