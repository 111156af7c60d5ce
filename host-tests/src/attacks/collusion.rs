//! Collusion: recipients of differently marked copies of one map average them.

use super::Map;
use crate::Result;

/// Returns the mean of every coordinate over copies of one map.
///
/// # Errors
/// Fails without copies, and on copies of different maps.
pub fn average(copies: &[Map]) -> Result<Map> {
    let (first, others) = copies.split_first().ok_or("there is nothing to average")?;
    let others: Vec<Vec<[f64; 2]>> = others.iter().map(|copy| copy.coords().collect()).collect();
    if others.iter().any(|coords| coords.len() != first.coords().count()) {
        return Err("only copies of one map can be averaged".into());
    }
    let mut i = 0;
    Ok(first.map_coords(|own| {
        let sum = others.iter().fold(own, |sum, coords| [sum[0] + coords[i][0], sum[1] + coords[i][1]]);
        i += 1;
        sum.map(|s| s / copies.len() as f64)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::{
        similarity::translate,
        tests::{fixture, in_memory, wkt},
    };

    #[test]
    fn the_average_is_the_mean_of_every_coordinate() {
        let line = |y: f64| in_memory(&[&format!("LINESTRING (0 {y},10 {y})")]);
        assert_eq!(wkt(&average(&[line(0.0), line(1.0), line(5.0)]).unwrap()), ["LINESTRING (0 2,10 2)"]);
        let map = fixture("kotka.gpkg");
        let moved = translate(&map, [1.0, 0.0]);
        let shared = map.vertices().unwrap().len();
        assert_eq!(average(&[map, moved]).unwrap().vertices().unwrap().len(), shared);
    }

    #[test]
    fn different_maps_are_refused() {
        assert!(average(&[]).is_err());
        assert!(average(&[in_memory(&["POINT (1 1)"]), in_memory(&["LINESTRING (0 0,1 1)"])]).is_err());
    }
}
