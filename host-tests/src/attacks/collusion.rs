//! Collusion: recipients of differently marked copies of one map make a copy of their own from them.

use super::{Map, Random, random::PerVertex};
use crate::Result;

/// How colluders combine their copies. The rules of single coordinates are those of Wu, Trappe, Wang
/// and Liu, *Collusion-resistant fingerprinting for multimedia*, IEEE Signal Processing Magazine 21
/// (2), 2004.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mixture {
    /// The mean of every coordinate.
    Average,
    /// The least value of every coordinate.
    Minimum,
    /// The largest value of every coordinate.
    Maximum,
    /// The median of every coordinate.
    Median,
    /// Of the least and the largest value of every coordinate the one that is further from the
    /// median.
    MinorityExtreme,
    /// Every vertex from a copy drawn at random.
    OfVertices,
    /// Every feature from a copy drawn at random.
    OfFeatures,
}

impl Mixture {
    /// All of them, with their names.
    pub const ALL: [(Mixture, &'static str); 7] = [
        (Mixture::Average, "average"),
        (Mixture::Minimum, "minimum"),
        (Mixture::Maximum, "maximum"),
        (Mixture::Median, "median"),
        (Mixture::MinorityExtreme, "minority extreme"),
        (Mixture::OfVertices, "mosaic of vertices"),
        (Mixture::OfFeatures, "mosaic of features"),
    ];

    /// Mixes copies of one map.
    ///
    /// # Errors
    /// Fails without copies, and on copies of different maps.
    pub fn mix(self, copies: &[Map], seed: u64) -> Result<Map> {
        let (first, others) = copies.split_first().ok_or("there is nothing to mix")?;
        let count = first.coords().count();
        if others.iter().any(|copy| copy.coords().count() != count) {
            return Err("only copies of one map can be mixed".into());
        }
        let coords: Vec<Vec<[f64; 2]>> = copies.iter().map(|copy| copy.coords().collect()).collect();
        let owners = match self {
            Mixture::OfVertices => {
                let owners = PerVertex::draw(first, seed, |random| random.below(copies.len()))?;
                first.coords().map(|vertex| owners.at(vertex)).collect()
            }
            Mixture::OfFeatures => {
                let mut random = Random::new(seed);
                let owned =
                    first.geometries().map(|g| (random.below(copies.len()), super::map::coords(g).count()));
                owned.flat_map(|(owner, count)| vec![owner; count]).collect()
            }
            _ => Vec::new(),
        };
        let mut next = 0..;
        Ok(first.map_coords(|_| {
            let i = next.next().expect("without end");
            match owners.get(i) {
                Some(&owner) => coords[owner][i],
                None => [0, 1].map(|axis| self.of_values(coords.iter().map(|copy| copy[i][axis]).collect())),
            }
        }))
    }

    /// Combines the values of a coordinate in the copies.
    fn of_values(self, mut values: Vec<f64>) -> f64 {
        values.sort_by(f64::total_cmp);
        let (least, largest) = (values[0], values[values.len() - 1]);
        let median = 0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]);
        match self {
            Mixture::Minimum => least,
            Mixture::Maximum => largest,
            Mixture::Median => median,
            Mixture::MinorityExtreme if largest - median > median - least => largest,
            Mixture::MinorityExtreme => least,
            _ => values.iter().sum::<f64>() / values.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::{
        similarity::translate,
        tests::{fixture, in_memory, wkt},
    };

    #[test]
    fn coordinates_are_combined_by_their_rule() {
        let line = |y: f64| in_memory(&[&format!("LINESTRING (0 {y},10 {y})")]);
        let copies = [line(0.0), line(1.0), line(8.0)];
        for (mixture, y) in [
            (Mixture::Average, 3),
            (Mixture::Minimum, 0),
            (Mixture::Maximum, 8),
            (Mixture::Median, 1),
            (Mixture::MinorityExtreme, 8),
        ] {
            let mixed = mixture.mix(&copies, 1).unwrap();
            assert_eq!(wkt(&mixed), [format!("LINESTRING (0 {y},10 {y})")], "{mixture:?}");
        }
    }

    #[test]
    fn mosaics_have_every_vertex_or_feature_from_one_copy_and_equal_vertices_stay_equal() {
        let map = fixture("kotka.gpkg");
        let moved = translate(&map, [1.0, 0.0]);
        let shared = map.vertices().unwrap().len();
        for (mixture, _) in Mixture::ALL {
            let mixed = mixture.mix(&[map.clone(), moved.clone()], 1).unwrap();
            let shifts =
                mixed.coords().zip(map.coords()).map(|(a, b)| ((a[0] - b[0]) * 100.0).round() as u32);
            let own = shifts.filter(|shift| *shift == 0).count() as f64 / map.coords().count() as f64;
            match mixture {
                Mixture::OfVertices | Mixture::OfFeatures => assert!((0.3..0.7).contains(&own), "{own}"),
                _ => {}
            }
            if mixture != Mixture::OfFeatures {
                assert_eq!(mixed.vertices().unwrap().len(), shared, "{mixture:?}");
            }
        }
        let mosaic = Mixture::OfFeatures.mix(&[map.clone(), moved], 1).unwrap();
        let whole = mosaic.geometries().zip(map.geometries()).filter(|(a, b)| a == b).count() as f64;
        assert!((0.3..0.7).contains(&(whole / map.geometries().count() as f64)));
    }

    #[test]
    fn different_maps_are_refused() {
        assert!(Mixture::Average.mix(&[], 1).is_err());
        let others = [in_memory(&["POINT (1 1)"]), in_memory(&["LINESTRING (0 0,1 1)"])];
        assert!(Mixture::Average.mix(&others, 1).is_err());
    }
}
