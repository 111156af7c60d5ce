//! Layers one after the other, also of a format that hands out the features of all of them in turn.

use crate::Result;
use gdal::{
    Dataset,
    vector::sql::{Dialect, ResultSet},
};

/// The driver of OpenStreetMap files. It meets the features of all layers in one pass over the file, keeps those whose
/// turn has not come, and gives up when it has to keep many.
const IN_TURN: &str = "OSM";

/// While the result lives, the layer of this name can be read from its start to its end.
pub(crate) fn turn<'a>(dataset: &'a Dataset, layer: &str) -> Result<Option<ResultSet<'a>>> {
    if dataset.driver().short_name() != IN_TURN {
        return Ok(None);
    }
    // For as long as a query is open, that driver starts anew and makes features of the query's layers only.
    Ok(dataset.execute_sql(format!("SELECT * FROM \"{layer}\""), None, Dialect::DEFAULT)?)
}
