//! Reading layers one after the other, also from a format that interleaves the features of all
//! layers.

use crate::Result;
use gdal::{
    Dataset,
    vector::sql::{Dialect, ResultSet},
};

/// The driver of OpenStreetMap files. It reads the features of all layers in one pass over the
/// file, keeps those of other layers in memory, and fails when these become many.
const IN_TURN: &str = "OSM";

/// Makes the layer of this name readable from its start to its end while the result lives.
pub(crate) fn turn<'a>(dataset: &'a Dataset, layer: &str) -> Result<Option<ResultSet<'a>>> {
    if dataset.driver().short_name() != IN_TURN {
        return Ok(None);
    }
    // While a query is open, that driver starts from the beginning and creates features of the
    // query's layers only.
    Ok(dataset.execute_sql(format!("SELECT * FROM \"{layer}\""), None, Dialect::DEFAULT)?)
}
