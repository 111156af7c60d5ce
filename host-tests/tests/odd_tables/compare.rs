//! The differences between the file of plain `ogr2ogr` and a marked one, except for small moves of
//! coordinates.

use meshmark_host_tests::{
    contents::{self, LayerContents},
    plugin::Host,
};
use std::{fs, path::Path};

/// Metres on the ground.
const TOLERANCE_M: f64 = 0.75;
/// Metres per degree of latitude, which is longer than one of longitude.
const METRES_PER_DEGREE: f64 = 111_700.0;

/// Returns the differences.
pub fn files(host: &Host, format: &str, plain: &str, marked: &str) -> Option<String> {
    let attributes = match format {
        "ESRI Shapefile" => companions(&host.path(plain), &host.path(marked))
            .or_else(|| first_difference(&dump(host, format, plain), &dump(host, format, marked))),
        "GeoJSON" | "GeoJSONSeq" => {
            first_difference(&without_places(host, plain), &without_places(host, marked))
        }
        _ => first_difference(&dump(host, format, plain), &dump(host, format, marked)),
    };
    attributes.or_else(|| geometries(format, &host.path(plain), &host.path(marked)))
}

/// Compares the files beside the geometries of a Shapefile byte by byte.
fn companions(plain: &Path, marked: &Path) -> Option<String> {
    let read = |path: &Path, ending: &str| fs::read(path.with_extension(ending)).ok();
    let differs = |ending: &&&str| read(plain, ending) != read(marked, ending);
    let endings = if adapts_widths() { &["cpg", "prj"][..] } else { &["dbf", "cpg", "prj"] };
    let ending = endings.iter().find(differs)?;
    Some(format!("the .{ending} differs"))
}

/// Returns whether `ogr2ogr` adapts the widths of real numbers to the formats of source and target:
/// docs/driver.md says by how much they then differ.
fn adapts_widths() -> bool {
    gdal::version::VersionInfo::version_num().parse::<u32>().unwrap() >= 3_070_000
}

/// Returns a line of `ogrinfo` without the width of a field of real numbers.
fn without_real_width(line: &str) -> String {
    match line.split_once(": Real (") {
        Some((field, width)) if adapts_widths() && width.ends_with(')') => format!("{field}: Real"),
        _ => line.into(),
    }
}

/// Returns the text of a GeoJSON file with rounded numbers near the houses, which lie at longitude
/// 24.9 and latitude 60.2.
fn without_places(host: &Host, file: &str) -> Vec<String> {
    let bytes = fs::read(host.path(file)).unwrap();
    let rounded = |word: &str| match word.parse::<f64>() {
        Ok(number) if (24.899..24.91).contains(&number) => "24.9".to_string(),
        Ok(number) if (60.199..60.21).contains(&number) => "60.2".to_string(),
        _ => word.to_string(),
    };
    let line = |line: &str| {
        line.trim_end()
            .split_inclusive([' ', ','])
            .map(|word| {
                let number = word.trim_end_matches([' ', ',']);
                word.replace(number, &rounded(number))
            })
            .collect()
    };
    String::from_utf8_lossy(&bytes).lines().map(line).collect()
}

/// Returns what `ogrinfo` prints of a file and its features; FlatGeobuf orders and numbers them by
/// place.
fn dump(host: &Host, format: &str, file: &str) -> Vec<String> {
    let run = host.run("ogrinfo", &["-al", "-geom=NO", file]);
    let is_shapefile = format == "ESRI Shapefile"; // its layer has the name of the file
    let is_ours = |line: &&str| {
        let named = is_shapefile && line.starts_with("Layer name: ");
        !named && !["INFO: ", "Extent: ", "      using driver"].iter().any(|start| line.starts_with(start))
    };
    let without_name = |line: String| match line.rsplit_once("):") {
        Some((start, id)) if is_shapefile && start.starts_with("OGRFeature(") => format!("OGRFeature:{id}"),
        _ => line,
    };
    let lines = run.stdout.lines().filter(is_ours).map(without_real_width).map(without_name);
    let text = lines.collect::<Vec<_>>().join("\n");
    if format != "FlatGeobuf" {
        return text.lines().map(String::from).collect();
    }
    let mut parts: Vec<String> = text.split("OGRFeature(").map(String::from).collect();
    for feature in &mut parts[1..] {
        *feature = feature.split_once('\n').map_or(String::new(), |(_, values)| values.trim().to_string());
    }
    parts[1..].sort();
    parts
}

fn first_difference(plain: &[String], marked: &[String]) -> Option<String> {
    if plain == marked {
        return None;
    }
    let pair = plain.iter().zip(marked).find(|(a, b)| a != b);
    Some(match pair {
        Some((a, b)) => {
            let [a, b] = where_they_differ(a, b);
            format!("{a:?} is {b:?}")
        }
        None => format!("{} lines are {}", plain.len(), marked.len()),
    })
}

/// Returns the parts of two texts around their first difference.
fn where_they_differ(a: &str, b: &str) -> [String; 2] {
    let equal = a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count();
    [a, b].map(|text| text.chars().skip(equal.saturating_sub(60)).take(300).collect())
}

/// Compares values bit by bit, as far as the crate `gdal` reads them, and places.
fn geometries(format: &str, plain: &Path, marked: &Path) -> Option<String> {
    let [before, after] = [plain, marked].map(|path| layers(format, path));
    if before.len() != after.len() {
        return Some(format!("{} layers are {}", before.len(), after.len()));
    }
    for (before, after) in before.iter().zip(&after) {
        if before.features.len() != after.features.len() {
            return Some(format!("{} features are {}", before.features.len(), after.features.len()));
        }
        for (a, b) in before.features.iter().zip(&after.features) {
            if (a.fid, &a.attributes) != (b.fid, &b.attributes) {
                let [had, has] = where_they_differ(&a.attributes, &b.attributes);
                return Some(format!("{:?} {had} is {:?} {has}", a.fid, b.fid));
            }
            let [from, to] = [a, b].map(|feature| {
                feature
                    .geometries
                    .iter()
                    .map(|geometry| geometry.as_deref().map(contents::coords))
                    .collect::<Vec<_>>()
            });
            if !is_near(&from, &to) {
                return Some(format!("feature {:?}: {from:?} is at {to:?}", a.fid));
            }
        }
    }
    let coords = |layers: &[LayerContents]| layers.iter().flat_map(LayerContents::coords).collect::<Vec<_>>();
    (coords(&before) == coords(&after)).then(|| "nothing is marked".into())
}

/// Returns whether the same geometries are null, and every coordinate is near its old place.
fn is_near(from: &[Option<Vec<[f64; 2]>>], to: &[Option<Vec<[f64; 2]>>]) -> bool {
    let near = |a: &[f64; 2], b: &[f64; 2]| {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() * METRES_PER_DEGREE <= 2.0 * TOLERANCE_M)
    };
    from.len() == to.len()
        && from.iter().zip(to).all(|pair| match pair {
            (None, None) => true,
            (Some(from), Some(to)) => from.len() == to.len() && from.iter().zip(to).all(|(a, b)| near(a, b)),
            _ => false,
        })
}

fn layers(format: &str, path: &Path) -> Vec<LayerContents> {
    let mut layers = contents::read(path);
    if format == "FlatGeobuf" {
        for layer in &mut layers {
            layer.features.iter_mut().for_each(|feature| feature.fid = None);
            layer.features.sort_by(|a, b| a.attributes.cmp(&b.attributes));
        }
    }
    layers
}
