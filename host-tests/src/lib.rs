pub mod attacks;
pub mod cgal;
pub mod contents;
pub mod delaunay_check;
pub mod plugin;
pub mod table2;
pub mod vectors;
