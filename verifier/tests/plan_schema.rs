//! docs/plan.schema.json describes what `meshmark plan` writes, and nothing else.

use meshmark_core::{
    anchors::Anchors,
    sheet_plan::{PlannedSheet, SheetPlan, VERSION},
};
use serde_json::{Value, json};
use std::fs;

fn is_valid(plan: &Value) -> bool {
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/plan.schema.json")).unwrap();
    let schema = serde_json::from_str(&text).unwrap();
    jsonschema::meta::validate(&schema).expect("the schema is one");
    jsonschema::draft202012::new(&schema).unwrap().is_valid(plan)
}

fn plan() -> Value {
    let sheet = |file: &str, anchors: Vec<u32>| PlannedSheet {
        file: file.into(),
        vertices: 9,
        vertices_sha256: "0f".repeat(32),
        anchors: Anchors::new(anchors),
    };
    let plan = SheetPlan {
        meshmark_plan: VERSION,
        software: "meshmark 0.1.0".into(),
        tolerance_m: 0.75,
        crs: None,
        sheets: vec![sheet("a.gpkg", vec![0, 1, 8]), sheet("b.gpkg", Vec::new())],
    };
    serde_json::from_str(&plan.to_json()).unwrap()
}

#[test]
fn a_plan_is_valid_and_its_schema_says_what_is_read() {
    assert!(is_valid(&plan()));
    for object in ["", "/sheets/0"] {
        for field in plan().pointer(object).unwrap().as_object().unwrap().keys() {
            let mut missing = plan();
            missing.pointer_mut(object).unwrap().as_object_mut().unwrap().remove(field);
            assert!(!is_valid(&missing), "{object}/{field} may be missing");
            let text = missing.to_string();
            assert_eq!(SheetPlan::from_json(&text).is_err(), field != "crs", "{object}/{field}");
        }
        let mut more = plan();
        more.pointer_mut(object).unwrap()["colour"] = json!("red");
        assert!(!is_valid(&more) && SheetPlan::from_json(&more.to_string()).is_err(), "{object}");
    }
    for (pointer, value) in
        [("/meshmark_plan", json!(2)), ("/sheets/0/vertices", json!(-1)), ("/sheets/0/anchors", json!("1,2"))]
    {
        let mut changed = plan();
        *changed.pointer_mut(pointer).unwrap() = value;
        assert!(!is_valid(&changed) && SheetPlan::from_json(&changed.to_string()).is_err(), "{pointer}");
    }
}
