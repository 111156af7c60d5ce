//! A comparison as text and as JSON.

use super::Comparison;
use meshmark_core::counted;

impl Comparison {
    /// Returns one JSON object.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a comparison is JSON") + "\n"
    }

    /// Returns a few lines of text.
    pub fn to_text(&self) -> String {
        let Comparison {
            compared,
            displacement: d,
            hausdorff: h,
            angles,
            areas,
            validity,
            overlaps,
            crossings,
            ..
        } = self;
        let torn = match compared.torn_vertices {
            0 => String::new(),
            torn => format!(", {torn} of them torn apart"),
        };
        [
            format!(
                "compared:     {}, {}{torn}",
                counted(compared.features, "feature"),
                counted(compared.vertices, "vertex")
            ),
            format!(
                "displacement: {:.3} m RMS, 99 % up to {:.3} m, all up to {:.3} m",
                d.rms_m, d.p99_m, d.max_m
            ),
            format!("hausdorff:    99 % of features up to {:.3} m, all up to {:.3} m", h.p99_m, h.max_m),
            format!(
                "angles:       change {:.2}° on average, 99 % up to {:.2}°; {:.1} % of {} kept within 1°",
                angles.mean_change_deg,
                angles.p99_change_deg,
                100.0 * angles.right_angles_kept,
                counted(angles.right_angles, "right angle")
            ),
            format!(
                "areas:        change {:.3} % on average, 99 % up to {:.3} %, all up to {:.3} %",
                100.0 * areas.mean_change,
                100.0 * areas.p99_change,
                100.0 * areas.max_change
            ),
            format!(
                "validity:     {} invalid before, {} after, {} newly invalid",
                validity.invalid_before, validity.invalid_after, validity.newly_invalid
            ),
            format!(
                "overlaps:     {} before, {} after, {} new ({:.6} m²), {}",
                counted(overlaps.before, "pair"),
                overlaps.after,
                overlaps.new,
                overlaps.new_area_m2,
                counted(overlaps.new_slivers, "new sliver")
            ),
            format!(
                "crossings:    {} of segments before, {} after, {} new, {} lost",
                counted(crossings.before, "pair"),
                crossings.after,
                crossings.new,
                crossings.lost
            ),
        ]
        .join("\n")
            + "\n"
    }
}
