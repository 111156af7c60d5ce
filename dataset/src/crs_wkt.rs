//! The horizontal part of a CRS, taken from its WKT, as the `gdal` crate has no function for it.

use gdal::spatial_ref::SpatialRef;

/// Returns the WKT of a CRS without heights, with the easting or longitude first.
pub(crate) fn horizontal(wkt: &str) -> Option<String> {
    let (keyword, mut parts) = split(wkt)?;
    if matches!(keyword, "COMPD_CS" | "COMPOUNDCRS") {
        return horizontal(parts.get(1)?);
    }
    let mut axes = (0..parts.len()).filter(|&i| parts[i].starts_with("AXIS["));
    match (axes.next(), axes.next(), axes.next()) {
        // Only WKT 2 has a third axis; the CRS without it is written as WKT 1 again.
        (Some(_), Some(_), Some(height)) => {
            parts.remove(height);
            let flat = join(keyword, &parts).replace("CS[ellipsoidal,3]", "CS[ellipsoidal,2]");
            let flat = SpatialRef::from_wkt(&flat.replace("CS[Cartesian,3]", "CS[Cartesian,2]")).ok()?;
            horizontal(&flat.to_wkt().ok()?)
        }
        (Some(first), Some(second), None) => {
            if parts[first].ends_with(",NORTH]") && parts[second].ends_with(",EAST]") {
                parts.swap(first, second);
            }
            Some(join(keyword, &parts))
        }
        _ => Some(wkt.into()),
    }
}

/// Splits a node into its keyword and the parts between its brackets.
fn split(wkt: &str) -> Option<(&str, Vec<&str>)> {
    let (keyword, rest) = wkt.split_once('[')?;
    let (mut depth, mut quoted) = (0, false);
    let ends_part = |c: char| {
        match c {
            '"' => quoted = !quoted,
            '[' if !quoted => depth += 1,
            ']' if !quoted => depth -= 1,
            _ => {}
        }
        c == ',' && !quoted && depth == 0
    };
    Some((keyword, rest.strip_suffix(']')?.split(ends_part).collect()))
}

fn join(keyword: &str, parts: &[&str]) -> String {
    format!("{keyword}[{}]", parts.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_hold_what_separates_parts() {
        let wkt = r#"COMPD_CS["a,[b]",PROJCS["c ""d"", e]",UNIT["m",1],AXIS["N",NORTH],AXIS["E",EAST]],VERT_CS["f"]]"#;
        let expected = r#"PROJCS["c ""d"", e]",UNIT["m",1],AXIS["E",EAST],AXIS["N",NORTH]]"#;
        assert_eq!(horizontal(wkt).as_deref(), Some(expected));
        assert_eq!(horizontal(expected).as_deref(), Some(expected));
        assert_eq!(horizontal("no text of a CRS"), None);
    }
}
