//! The Delaunay mesh that joins all vertices of a map (paper, section 3.1).

use crate::{Error, Result, orientation::orientation};
use spade::{DelaunayTriangulation, Point2, Triangulation, mitigate_underflow};
use std::collections::HashMap;

/// The edges of a Delaunay triangulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    edges: Vec<[u32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Triangulates `points` (distinct, relative to a local origin). Magnitudes under 2⁻¹⁴², which
    /// spade refuses, count as zero.
    ///
    /// # Errors
    /// [`Error::Collinear`] when no triangle exists.
    ///
    /// # Panics
    /// Panics when a coordinate is not finite or there are 2³² points, which
    /// [`crate::vertices::VertexTable`] excludes.
    pub fn delaunay(points: &[[f64; 2]]) -> Result<Self> {
        let points: Vec<_> = points.iter().map(|&[x, y]| mitigate_underflow(Point2::new(x, y))).collect();
        if all_collinear(&points) {
            return Err(Error::Collinear { vertices: points.len() });
        }
        let triangulation: DelaunayTriangulation<Point2<f64>> =
            DelaunayTriangulation::bulk_load_stable(points.clone())
                .expect("coordinates are finite, not tiny and below 1e30");
        let numbering = Numbering::new(&points, &triangulation);
        let mut edges: Vec<[u32; 2]> = triangulation
            .undirected_edges()
            .map(|edge| {
                let [a, b] = edge.vertices().map(|v| numbering.vertex(v.fix().index(), v.position()));
                [a.min(b), a.max(b)]
            })
            .collect();
        edges.sort_unstable();
        let corners = |face: spade::handles::FaceHandle<'_, spade::handles::InnerTag, _, _, _, _>| {
            face.vertices().map(|v| numbering.vertex(v.fix().index(), v.position()))
        };
        let triangles = triangulation.inner_faces().map(corners).collect();
        Ok(Mesh { edges, triangles })
    }

    /// Returns the edges as sorted pairs of vertex indices `[i, j]`, i < j.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Returns the corners of the triangles, counter-clockwise; the order of the triangles is
    /// unspecified.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}

/// Maps the vertices of the triangulation to indices of points. These are the same unless two
/// distinct vertices became one when the local origin was subtracted; then the mesh holds the first
/// of them, and the bridging rule of [`crate::patches`] joins the other one to its patch.
enum Numbering {
    Same,
    ByPosition(HashMap<[u64; 2], u32>),
}

impl Numbering {
    fn new(points: &[Point2<f64>], triangulation: &DelaunayTriangulation<Point2<f64>>) -> Self {
        if triangulation.num_vertices() == points.len() {
            return Numbering::Same;
        }
        let mut first = HashMap::new();
        for (i, &point) in points.iter().enumerate() {
            first.entry(bits(point)).or_insert(i as u32);
        }
        Numbering::ByPosition(first)
    }

    fn vertex(&self, index: usize, position: Point2<f64>) -> u32 {
        match self {
            Numbering::Same => index as u32,
            Numbering::ByPosition(first) => first[&bits(position)],
        }
    }
}

fn bits(Point2 { x, y }: Point2<f64>) -> [u64; 2] {
    [(x + 0.0).to_bits(), (y + 0.0).to_bits()]
}

/// Returns whether no three points span a triangle, by an exact predicate. If all points lie on a
/// line, the first and the last one in canonical order are its ends.
fn all_collinear(points: &[Point2<f64>]) -> bool {
    let place = |p: &Point2<f64>| [p.x, p.y];
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return true };
    points.iter().all(|p| orientation(place(first), place(last), place(p)) == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_with_its_centre_has_eight_edges() {
        let points = [[0.0, 0.0], [0.0, 2.0], [1.0, 1.0], [2.0, 0.0], [2.0, 2.0]];
        assert_eq!(
            Mesh::delaunay(&points).unwrap().edges(),
            [[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]]
        );
    }

    #[test]
    fn a_straight_line_is_refused() {
        let line: Vec<_> = (0..20_000).map(|i| [i as f64, 2.0 * i as f64]).collect();
        assert!(matches!(Mesh::delaunay(&line), Err(Error::Collinear { vertices: 20_000 })));
        assert!(matches!(Mesh::delaunay(&[[1.0, 1.0]]), Err(Error::Collinear { vertices: 1 })));
    }

    #[test]
    fn magnitudes_that_spade_refuses_are_zero() {
        let square = |centre| [[-1.0, -1.0], [-1.0, 1.0], centre, [1.0, -1.0], [1.0, 1.0]];
        let expected = Mesh::delaunay(&square([0.0, 0.0])).unwrap();
        for tiny in [f64::MIN_POSITIVE, 1e-200, 1e-141, 1e-139, 1e-100, 1e-43] {
            for centre in [[tiny, 0.0], [0.0, -tiny], [-tiny, tiny]] {
                assert_eq!(Mesh::delaunay(&square(centre)).unwrap(), expected, "{centre:?}");
            }
            let strip = [[-tiny, 0.0], [0.0, 1.0], [tiny, 0.5]];
            assert!(matches!(Mesh::delaunay(&strip), Err(Error::Collinear { vertices: 3 })), "{tiny}");
        }
        for small in [1e-42, 1e-20] {
            let strip = [[-small, 0.0], [0.0, 1.0], [small, 0.5]];
            assert_eq!(Mesh::delaunay(&strip).unwrap().triangles().len(), 1, "{small}");
        }
    }

    #[test]
    fn vertices_that_collapse_on_the_local_origin_keep_their_numbers() {
        let points = [[0.0, 0.0], [0.0, 0.0], [0.0, 2.0], [2.0, 0.0]];
        assert_eq!(Mesh::delaunay(&points).unwrap().edges(), [[0, 2], [0, 3], [2, 3]]);
    }
}
