//! The plan of sheets that are marked apart and fit together.

use crate::{Error, Result, anchors::Anchors, error::PlanFault};
use serde::{Deserialize, Serialize};

/// The version of this format.
pub const VERSION: u32 = 1;

/// A plan: the sheets of a map, and the vertices of each that stay in place. It holds neither key nor
/// time: equal sheets make an equal plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheetPlan {
    /// Version of this format.
    pub meshmark_plan: u32,
    /// Version of the program that made it.
    pub software: String,
    /// No vertex moves further than this, metres on the ground.
    pub tolerance_m: f64,
    /// CRS of all sheets as authority and code, or as WKT; null when unknown.
    pub crs: Option<String>,
    /// The sheets.
    pub sheets: Vec<PlannedSheet>,
}

/// A sheet of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedSheet {
    /// The name of its file, for the reader.
    pub file: String,
    /// Its distinct vertices.
    pub vertices: usize,
    /// Digest of these, see [`crate::vertices::VertexTable::digest`].
    pub vertices_sha256: String,
    /// Those that stay in place.
    pub anchors: Anchors,
}

impl SheetPlan {
    /// Reads the text of a plan.
    ///
    /// # Errors
    /// [`Error::Plan`] describes the fault.
    pub fn from_json(text: &str) -> Result<Self> {
        /// The field that tells versions apart.
        #[derive(Deserialize)]
        struct Version {
            meshmark_plan: u32,
        }
        let fault = |fault| Error::Plan(fault);
        let json = |error| fault(PlanFault::Json(error));
        let found = serde_json::from_str::<Version>(text).map_err(json)?.meshmark_plan;
        if found != VERSION {
            return Err(fault(PlanFault::Version { found, expected: VERSION }));
        }
        let plan: SheetPlan = serde_json::from_str(text).map_err(json)?;
        match plan.sheets.iter().find(|sheet| !sheet.anchors.fit(sheet.vertices)) {
            Some(sheet) => Err(fault(PlanFault::Anchors { file: sheet.file.clone() })),
            None => Ok(plan),
        }
    }

    /// Returns the text of the plan.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a plan is JSON") + "\n"
    }

    /// Returns the sheet whose vertices have this digest.
    pub fn sheet(&self, vertices_sha256: &str) -> Option<&PlannedSheet> {
        self.sheets.iter().find(|sheet| sheet.vertices_sha256 == vertices_sha256)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn plan() -> SheetPlan {
        SheetPlan {
            meshmark_plan: VERSION,
            software: "meshmark 0.1.0".into(),
            tolerance_m: 0.75,
            crs: Some("EPSG:3067".into()),
            sheets: vec![PlannedSheet {
                file: "a.gpkg".into(),
                vertices: 9,
                vertices_sha256: "0f".repeat(32),
                anchors: Anchors::new(vec![2, 8]),
            }],
        }
    }

    #[test]
    fn a_plan_reads_back_and_has_its_sheets_by_their_digests() {
        let read = SheetPlan::from_json(&plan().to_json()).unwrap();
        assert_eq!(read, plan());
        assert_eq!(read.sheet(&"0f".repeat(32)), Some(&plan().sheets[0]));
        assert_eq!(read.sheet(&"0e".repeat(32)), None);
    }

    #[test]
    fn a_plan_that_nobody_made_is_refused() {
        for (pointer, value, words) in [
            ("/meshmark_plan", json!(2), "version 2 instead of 1"),
            ("/meshmark_plan", json!(null), "invalid type: null"),
            ("/sheets/0/vertices", json!(8), "a.gpkg has anchors that are none of its vertices"),
            ("/sheets/0/anchors", json!("2 ?"), "anchors are numbers"),
            ("/sheets/0/colour", json!("red"), "unknown field"),
        ] {
            let mut json: Value = serde_json::from_str(&plan().to_json()).unwrap();
            let (object, field) = pointer.rsplit_once('/').unwrap();
            json.pointer_mut(object).unwrap()[field] = value;
            let error = SheetPlan::from_json(&json.to_string()).unwrap_err().to_string();
            assert!(error.contains("malformed plan") && error.contains(words), "{pointer}: {error}");
        }
    }
}
