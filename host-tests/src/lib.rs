pub mod attacks;
pub mod cgal;
pub mod delaunay_check;
pub mod table2;
pub mod vectors;
