//! What is refused before a marking, and what is warned of.

use crate::{Crs, Error, Result};
use meshmark_core::{
    embedding::Marked,
    ground::Ground,
    map::Map,
    message::{ADVISED_BITS, LEAST_IDENTIFYING_BITS, Message},
    options::{Options, Parameters, Spelling, composed},
    vertices::VertexTable,
    visible,
};

/// A map smaller than this many tolerances would be noise after its marking.
const LEAST_TOLERANCES: f64 = 10.0;

/// Fails for a map so small that its units must be wrong.
///
/// # Errors
/// [`Error::TooSmall`].
pub fn check_extent(map: &Map, parameters: &Parameters) -> Result<()> {
    let (min, max) = map.vertices.bounds();
    let [width_m, height_m] = map.ground.metres_between(min, max);
    let size_m = width_m.max(height_m);
    let tolerance_m = parameters.tolerance_m;
    match map.vertices.len() > 1 && size_m < LEAST_TOLERANCES * tolerance_m {
        true => Err(Error::TooSmall { size_m, tolerance_m }),
        false => Ok(()),
    }
}

/// Fails where the mark has one scale, and its error is so large that vertices would move further
/// than wanted.
///
/// # Errors
/// [`Error::UnevenScale`].
pub fn check_scale(map: &Map, crs: Option<&dyn Crs>) -> Result<()> {
    let uneven = match (map.ground, map.measure) {
        (Ground::Plane { .. }, Ground::Uneven(lattice)) => lattice.unevenness(map.vertices),
        _ => None,
    };
    match uneven {
        None => Ok(()),
        Some((off, ends)) => {
            let crs = crs.map_or_else(String::new, |crs| crs.brief_name());
            Err(Error::UnevenScale { ends, off_percent: 100.0 * off, crs })
        }
    }
}

/// Returns the warning about a name of a recipient that looks like another one.
pub fn spelling_warning(recipient: &str) -> Option<String> {
    let shown = visible(recipient);
    let how = if shown != recipient {
        "has characters that nobody sees, of which only the numbers are shown here"
    } else if composed(recipient) != recipient {
        "is written in the decomposed form of Unicode, with letters and accents as characters of their own"
    } else {
        return None;
    };
    let remedy = if shown != recipient { "remove them" } else { "give it composed (NFC)" };
    Some(format!("the recipient \"{shown}\" {how}: whoever types the name means another recipient; {remedy}"))
}

/// Up to this share of the vertices may carry no sign without a warning.
const MOST_SIGNLESS: f64 = 0.05;

/// Returns the warning about a copy of which a good part carries no sign, as parts of the map have too few
/// free vertices.
pub fn signless_warning(marked: &Marked, options: &Options, spelling: Spelling) -> Option<String> {
    let (signless, vertices) = (marked.signless, marked.coords.len());
    let remedy = match options.bases {
        Some(_) => format!("leave {} out, or lower {}", spelling.name("BASE"), spelling.name("PATCH_SIZE")),
        None => format!("raise {} or lower {}", spelling.name("PART_SIZE"), spelling.name("PATCH_SIZE")),
    };
    (signless as f64 > MOST_SIGNLESS * vertices as f64).then(|| {
        format!(
            "{signless} of {vertices} vertices ({:.0} %) stay unmarked, as their parts of the map have fewer than {} \
             vertices that are free to move, or have them on one line: a piece of these alone shows no mark; {remedy}",
            100.0 * signless as f64 / vertices as f64,
            options.parameters.patch_size
        )
    })
}

/// Returns warnings about what is legal and probably not intended. `message` is what the code carries;
/// a fingerprint has none.
pub fn warnings(
    options: &Options,
    message: Option<&Message>,
    (vertices, crs): (&VertexTable, Option<&dyn Crs>),
    patches: usize,
    spelling: Spelling,
) -> Vec<String> {
    let parameters = &options.parameters;
    let mut warnings = Vec::new();
    if crs.is_none() {
        let srs = spelling.value("SRS", "...");
        warnings
            .push(format!("the source has no CRS: its units are taken as metres; say {srs} if they are not"));
    }
    if let Some(message) = message.filter(|message| message.len() < LEAST_IDENTIFYING_BITS) {
        warnings.push(format!(
            "a message of {} bits identifies nobody, and verification will never call it a match: use {} \
             hexadecimal digits or more",
            message.len(),
            ADVISED_BITS / 4
        ));
    }
    let of_message = |message| {
        let coefficients = 2 * patches * parameters.code.encode(message).len() * parameters.chip_rate;
        parameters.amplitude_m * (coefficients as f64 / vertices.len() as f64).sqrt()
    };
    let wanted_rms_m = message.map_or(parameters.amplitude_m, of_message);
    if wanted_rms_m > parameters.tolerance_m {
        warnings.push(format!(
            "{} would move the vertices by {wanted_rms_m:.2} m RMS, more than {} m, where many of them are held: the map \
             is distorted and the mark gains little; lower {}",
            spelling.value("AMPLITUDE", parameters.amplitude_m),
            spelling.value("TOLERANCE", parameters.tolerance_m),
            spelling.name("AMPLITUDE")
        ));
    }
    warnings
}
