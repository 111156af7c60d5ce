//! Counts whom the verifier names when recipients mix their copies of a map.

use meshmark_host_tests::{
    Result,
    attacks::{Map, collusion::Mixture},
    product::{Product, write_key},
};
use serde::Serialize;
use serde_json::Value;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// A verdict counts by the significance that the command has by default.
const SIGNIFICANCE_LOG10: f64 = -6.0;

/// Whom the verifier names of the recipients of one mixed copy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coalition {
    pub map: String,
    pub mixture: &'static str,
    /// Number of recipients who mixed their copies.
    pub members: usize,
    /// Number of members who are named.
    pub named: usize,
    /// Number of recipients who are named and are not members.
    pub accused: usize,
}

/// Marks a map for as many recipients as the largest coalition has, mixes the copies of the first
/// ones in every way, and verifies each mixture for all records.
///
/// # Errors
/// Fails on a map that cannot be read or marked.
pub fn study(product: &Product, map: &Path, sizes: &[usize], seed: u64) -> Result<Vec<Coalition>> {
    let folder = tempfile::tempdir()?;
    let path = |name: &str| folder.path().join(name);
    let most = sizes.iter().copied().max().ok_or("there is no size of a coalition")?;
    let (key, folder_of_copies) = (path("key.json"), path("copies"));
    write_key(&key, seed)?;
    std::fs::write(path("list.csv"), list(most))?;
    let mut distribute = product.meshmark();
    distribute.args(["distribute", "--key"]).arg(&key).arg("--recipients").arg(path("list.csv"));
    run(distribute.arg("--output-dir").arg(&folder_of_copies).arg(map), &[0])?;
    let copies = by_recipient(&folder_of_copies)?;
    let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut coalitions = Vec::new();
    for &members in sizes {
        let mixed: Vec<Map> =
            (0..members).map(|n| Map::read(&copies[&recipient(n)])).collect::<Result<_>>()?;
        for (mixture, mixture_name) in Mixture::ALL {
            let suspect = path("suspect.gpkg");
            mixture.mix(&mixed, seed)?.write(&suspect)?;
            let mut verify = product.meshmark();
            verify.args(["verify", "--json", "--key"]).arg(&key).arg("--reference").arg(map);
            verify.arg("--records").arg(&folder_of_copies);
            let report = serde_json::from_slice(&run(verify.arg(&suspect), &[0, 1, 3])?)?;
            let named = named(&report);
            let guilty: Vec<String> = (0..members).map(recipient).collect();
            let of_members = named.iter().filter(|name| guilty.contains(name)).count();
            coalitions.push(Coalition {
                map: name.clone(),
                mixture: mixture_name,
                members,
                named: of_members,
                accused: named.len() - of_members,
            });
            std::fs::remove_file(&suspect)?;
        }
    }
    Ok(coalitions)
}

fn recipient(number: usize) -> String {
    format!("recipient {number:04}")
}

fn list(most: usize) -> String {
    let rows: String = (0..most).map(|number| recipient(number) + "\n").collect();
    format!("recipient\n{rows}")
}

/// Returns the copy of every recipient in a folder of `meshmark distribute`.
fn by_recipient(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder)? {
        let record = entry?.path();
        if record.extension().is_none_or(|ending| ending != "json") {
            continue;
        }
        let json: Value = serde_json::from_slice(&std::fs::read(&record)?)?;
        let Some(recipient) = json["recipient"].as_str() else { continue };
        found.insert(recipient.to_string(), record.with_extension("gpkg"));
    }
    Ok(found)
}

fn run(command: &mut std::process::Command, codes: &[i32]) -> Result<Vec<u8>> {
    let output = command.output()?;
    match output.status.code().is_some_and(|code| codes.contains(&code)) {
        true => Ok(output.stdout),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned().into()),
    }
}

/// Returns the recipients whom a report names.
fn named(report: &Value) -> Vec<String> {
    let is_named = |entry: &&Value| entry["p_value_log10"].as_f64().is_some_and(|p| p < SIGNIFICANCE_LOG10);
    let list = report["candidates"]["list"].as_array().into_iter().flatten();
    list.filter(is_named).filter_map(|entry| Some(entry["recipient"].as_str()?.to_string())).collect()
}

/// Returns the result as Markdown: for every way and size the named members on all maps, and the
/// maps on which one is missing.
pub fn markdown(coalitions: &[Coalition], seed: u64) -> String {
    let sizes: std::collections::BTreeSet<usize> = coalitions.iter().map(|c| c.members).collect();
    let head: String = sizes.iter().map(|size| format!(" {size} |")).collect();
    let mut text = format!(
        "Seed {seed}. Members who are named, of all members on all maps, by the number of members; in \
         brackets the maps on which one is missing, and how many.\n\n| mixture |{head}\n|---|{}\n",
        "---|".repeat(sizes.len())
    );
    for (_, mixture) in Mixture::ALL {
        let cell = |size: &usize| {
            let of_cell = || coalitions.iter().filter(|c| c.mixture == mixture && c.members == *size);
            let (named, all) = of_cell().fold((0, 0), |(n, m), c| (n + c.named, m + c.members));
            let missing = of_cell().filter(|c| c.named < c.members);
            let missing: Vec<String> =
                missing.map(|c| format!("{} {}", c.map, c.members - c.named)).collect();
            match missing.is_empty() {
                true => format!(" {named} of {all} |"),
                false => format!(" {named} of {all} ({}) |", missing.join(", ")),
            }
        };
        text += &format!("| {mixture} |{}\n", sizes.iter().map(cell).collect::<String>());
    }
    let accused: usize = coalitions.iter().map(|c| c.accused).sum();
    text + &format!("\nNamed without being a member, in {} mixtures: {accused}.\n", coalitions.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_members_and_accused_recipients_are_counted() {
        let of = |map: &str, named, accused| Coalition {
            map: map.into(),
            mixture: "average",
            members: 4,
            named,
            accused,
        };
        let text = markdown(&[of("town", 4, 0), of("village", 3, 1)], 7);
        assert!(text.contains("| average | 7 of 8 (village 1) |"), "{text}");
        assert!(text.contains("in 2 mixtures: 1."), "{text}");
    }

    #[test]
    fn only_who_is_significant_is_named() {
        let entry =
            |recipient: &str, p: Value| serde_json::json!({ "recipient": recipient, "p_value_log10": p });
        let list = [entry("a", (-9.0).into()), entry("b", (-5.9).into()), entry("c", Value::Null)];
        assert_eq!(named(&serde_json::json!({ "candidates": { "list": list } })), ["a"]);
    }
}
