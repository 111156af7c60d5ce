//! Plans of sheets: what is read reads its own text, and anchors are vertices.
#![no_main]

use libfuzzer_sys::fuzz_target;
use meshmark_core::{key::read_text, sheet_plan::SheetPlan};

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = read_text(bytes) else { return };
    match SheetPlan::from_json(&text) {
        Ok(plan) => {
            let again = SheetPlan::from_json(&plan.to_json()).expect("a plan reads its own text");
            assert_eq!(plan, again);
            assert!(plan.sheets.iter().all(|sheet| sheet.anchors.fit(sheet.vertices)));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
