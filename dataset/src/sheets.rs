//! The plan of the sheets of which a map is one.

use crate::{Error, Result, Survey};
use meshmark_core::{anchors::Anchors, key::read_text, options::Options, sheet_plan::SheetPlan};
use std::{fs::File, path::Path};

/// Returns the anchors of a map by the plan that options name; none without a plan.
///
/// # Errors
/// Fails on a plan that is unreadable, of another TOLERANCE or CRS, or without this map, and where PRECISION
/// would move the anchors.
pub(crate) fn anchors(options: &Options, map: &Survey) -> Result<Anchors> {
    let Some(path) = &options.sheets else { return Ok(Anchors::default()) };
    let plan = || path.clone();
    let text = File::open(Path::new(path)).and_then(read_text);
    let text = text.map_err(|source| Error::SheetsUnread { plan: plan(), source })?;
    let found =
        SheetPlan::from_json(&text).map_err(|source| Error::SheetsMalformed { plan: plan(), source })?;
    if options.parameters.precision_crs_units.is_some() {
        return Err(Error::SheetsWithPrecision { plan: plan() });
    }
    let tolerance_m = options.parameters.tolerance_m;
    if found.tolerance_m != tolerance_m {
        return Err(Error::SheetsOfOtherTolerance {
            plan: plan(),
            made_with: found.tolerance_m,
            given: tolerance_m,
        });
    }
    let crs = map.crs().map(|crs| crs.label());
    if found.crs != crs {
        let [planned, own] = [found.crs, crs].map(|crs| crs.unwrap_or_else(|| "no CRS".into()));
        return Err(Error::SheetsInOtherCrs { plan: plan(), planned, own });
    }
    match found.sheet(&map.data.vertices.digest()) {
        Some(sheet) => Ok(sheet.anchors.clone()),
        None => Err(Error::SheetNotPlanned { plan: plan() }),
    }
}
