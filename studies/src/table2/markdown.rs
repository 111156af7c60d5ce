//! The report as Markdown.

use super::{
    paper,
    summary::{Cell, cell, distinct},
};
use meshmark_host_tests::{
    experiment::{
        Outcome, bit_error_percent,
        cases::{DEMODULATORS, Table},
        is_match,
    },
    product::Profile,
};
use std::fmt::Write;

/// Returns all tables.
pub fn report(all: &[Outcome], seed: u64, version: &str) -> String {
    let of_profile = |profile| all.iter().filter(|o| o.profile == profile).cloned().collect::<Vec<_>>();
    let (fingerprints, coded) = (of_profile(Profile::FINGERPRINT), of_profile(Profile::LDPC));
    let is_repeated = |o: &&Outcome| ![Profile::FINGERPRINT, Profile::LDPC].contains(&o.profile);
    let outcomes: Vec<Outcome> = all.iter().filter(is_repeated).cloned().collect();
    let outcomes = outcomes.as_slice();
    let mut text = head(all, seed, version);
    text += &recipients(&fingerprints);
    text += &averages(outcomes, Table::Paper);
    text += &averages(outcomes, Table::Extended);
    text += &whole_messages(outcomes, &coded);
    text += &special(outcomes);
    text += &unanswered(all);
    for table in [Table::Paper, Table::Extended] {
        for chip_rate in chip_rates(outcomes.iter()) {
            for demodulator in DEMODULATORS {
                text += &per_map(outcomes, table, chip_rate, demodulator);
            }
        }
    }
    text
}

fn head(outcomes: &[Outcome], seed: u64, version: &str) -> String {
    let maps = distinct(outcomes.iter().map(|o| o.map.as_str()));
    let seconds = outcomes.iter().map(|o| o.seconds).sum::<f64>() / outcomes.len().max(1) as f64;
    format!(
        "# Bit errors after attacks\n\n\
         Bit error rates in per cent of 128 message bits, averaged over {} maps ({}), each rounded to 0.1 m and \
         marked by the driver in ogr2ogr with PRECISION=0.1 and otherwise the defaults; verified by \
         `meshmark verify` ({version}). A suspect that was not registered counts as 50 % and is counted in its own \
         column. \"Published\" is Table 2 of Ohbuchi, Ueda and Endoh 2003, on their own maps. Seed {seed}; a \
         verification took {seconds:.1} s on one core on average.\n\n",
        maps.len(),
        maps.join(", ")
    )
}

/// Returns the evidence about the recipients of fingerprints, a row for every attack.
fn recipients(fingerprints: &[Outcome]) -> String {
    if fingerprints.is_empty() {
        return String::new();
    }
    let mut text =
        "## Fingerprints: the right recipient\n\n| | attack | match | median p | largest p | map of the \
                    largest p |\n|---|---|---|---|---|---|\n"
            .to_string();
    let guilty = |o: &&Outcome| o.guilty;
    for id in distinct(fingerprints.iter().filter(guilty).map(|o| o.case.as_str())) {
        let mut of_case: Vec<&Outcome> =
            fingerprints.iter().filter(guilty).filter(|o| o.case == id).collect();
        let p = |o: &Outcome| o.p_value_log10.unwrap_or(0.0);
        of_case.sort_by(|a, b| p(a).total_cmp(&p(b)));
        let (worst, median) = (of_case[of_case.len() - 1], of_case[of_case.len() / 2]);
        let matches = of_case.iter().filter(|o| is_match(o)).count();
        let _ = writeln!(
            text,
            "| {id} | {} | {matches} of {} | {} | {} | {} |",
            worst.title,
            of_case.len(),
            power_of_ten(p(median)),
            power_of_ten(p(worst)),
            worst.map
        );
    }
    let accused = fingerprints.iter().filter(|o| !o.guilty && is_match(o)).count();
    let innocents = fingerprints.iter().filter(|o| !o.guilty).count();
    text + &format!("\n{accused} of {innocents} recipients who had no part in the suspect were named.\n\n")
}

fn power_of_ten(log10: f64) -> String {
    format!("10^{log10:.0}")
}

/// Returns one row for every attack, averaged over maps.
fn averages(outcomes: &[Outcome], table: Table) -> String {
    let of_table: Vec<&Outcome> = outcomes.iter().filter(|o| o.table == table).collect();
    let rates = chip_rates(of_table.iter().copied());
    if of_table.is_empty() {
        return String::new();
    }
    let title = if table == Table::Paper { "Table 2" } else { "Other attacks" };
    let mut text = format!("## {title}\n\n| | attack |");
    for c in &rates {
        if table == Table::Paper {
            let _ = write!(text, " c={c} published |");
        }
        let _ = write!(text, " c={c} paper | c={c} joint | match | median p | not registered |");
    }
    let columns = 2 + rates.len() * if table == Table::Paper { 6 } else { 5 };
    let _ = writeln!(text, "\n|{}", "---|".repeat(columns));
    for id in distinct(of_table.iter().map(|o| o.case.as_str())) {
        let of_case: Vec<&Outcome> = of_table.iter().copied().filter(|o| o.case == id).collect();
        let _ = write!(text, "| {id} | {} |", of_case[0].title);
        for &c in &rates {
            if table == Table::Paper {
                let published = paper::bit_error_percent(id, c);
                let _ = write!(text, " {} |", published.map_or("–".into(), |p| format!("{p:.1}")));
            }
            let _ = write!(text, " {} |", of_chip_rate(&of_case, c));
        }
        text.push('\n');
    }
    text + "\n"
}

fn of_chip_rate(outcomes: &[&Outcome], chip_rate: usize) -> String {
    let of = |demodulator: &str| {
        cell(
            outcomes
                .iter()
                .copied()
                .filter(|o| o.profile.chip_rate == chip_rate && o.demodulator == demodulator),
        )
        .unwrap_or_default()
    };
    let [paper, joint] = DEMODULATORS.map(of);
    format!(
        "{:.1} | {:.1} | {} of {} | {} | {}",
        paper.bit_error_percent,
        joint.bit_error_percent,
        joint.matches,
        joint.count,
        p_value(&joint),
        joint.unregistered
    )
}

fn chip_rates<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Vec<usize> {
    distinct(outcomes.map(|o| o.profile.chip_rate))
}

/// Returns on how many maps the message was read without an error, coded and repeated with the same
/// displacement.
fn whole_messages(plain: &[Outcome], coded: &[Outcome]) -> String {
    if coded.is_empty() {
        return String::new();
    }
    let mut text = "## The whole message, repeated (c=2) and coded (LDPC)\n\n| | attack | raw bit errors, c=2 | repeated: \
                    whole message | LDPC: whole message | repeated: median p | LDPC: median p |\n\
                    |---|---|---|---|---|---|---|\n"
        .to_string();
    for id in distinct(coded.iter().filter(|o| o.guilty).map(|o| o.case.as_str())) {
        let of = |outcomes: &[Outcome], chip_rate: usize| -> Vec<Outcome> {
            let is = |o: &&Outcome| {
                o.case == id && o.demodulator == "joint" && o.profile.chip_rate == chip_rate && o.guilty
            };
            outcomes.iter().filter(is).cloned().collect()
        };
        let (plain, coded) = (of(plain, 2), of(coded, 1));
        let whole = |outcomes: &[Outcome]| {
            format!("{} of {}", outcomes.iter().filter(|o| o.bit_errors == Some(0)).count(), outcomes.len())
        };
        let [plain_cell, coded_cell] = [&plain, &coded].map(|outcomes| cell(outcomes).unwrap_or_default());
        let _ = writeln!(
            text,
            "| {id} | {} | {:.1} | {} | {} | {} | {} |",
            coded[0].title,
            plain_cell.bit_error_percent,
            whole(&plain),
            whole(&coded),
            p_value(&plain_cell),
            p_value(&coded_cell)
        );
    }
    text + "\n"
}

fn p_value(cell: &Cell) -> String {
    cell.p_value_log10.map_or("–".into(), power_of_ten)
}

/// Returns the table of suspects with several questions, or in which no recipient may be found.
fn special(outcomes: &[Outcome]) -> String {
    let of_table: Vec<&Outcome> = outcomes.iter().filter(|o| o.table == Table::Special).collect();
    if of_table.is_empty() {
        return String::new();
    }
    let mut text =
        "## Several marks, or none\n\n| | case | chip rate | demodulator | guilty found | innocent \
                    accused | lowest p of an innocent |\n|---|---|---|---|---|---|---|\n"
            .to_string();
    for id in distinct(of_table.iter().map(|o| o.case.as_str())) {
        for c in chip_rates(of_table.iter().copied()) {
            for demodulator in DEMODULATORS {
                let of = |guilty: bool| -> Vec<&Outcome> {
                    let is = |o: &&&Outcome| {
                        o.case == id
                            && o.profile.chip_rate == c
                            && o.demodulator == demodulator
                            && o.guilty == guilty
                    };
                    of_table.iter().filter(is).copied().collect()
                };
                let (guilty, innocent) = (of(true), of(false));
                if guilty.len() + innocent.len() == 0 {
                    continue;
                }
                let found = |outcomes: &[&Outcome]| {
                    format!("{} of {}", outcomes.iter().filter(|o| is_match(o)).count(), outcomes.len())
                };
                let lowest = innocent.iter().filter_map(|o| o.p_value_log10).reduce(f64::min);
                let title = of_table.iter().find(|o| o.case == id).map_or("", |o| o.title.as_str());
                let _ = writeln!(
                    text,
                    "| {id} | {title} | {c} | {demodulator} | {} | {} | {} |",
                    found(&guilty),
                    found(&innocent),
                    lowest.map_or("–".into(), |p| format!("10^{p:.1}"))
                );
            }
        }
    }
    text + "\n"
}

/// Lists suspects that were not registered or that the command refused.
fn unanswered(outcomes: &[Outcome]) -> String {
    let is = |o: &&Outcome| o.demodulator == "joint" && o.bit_errors.is_none();
    let rows: String = outcomes
        .iter()
        .filter(is)
        .map(|o| format!("| {} | {} | {} | {} | {} |\n", o.map, o.profile.name(), o.case, o.title, o.reason))
        .collect();
    if rows.is_empty() {
        return "Every suspect was registered.\n\n".into();
    }
    format!(
        "## Not registered\n\n| map | profile | | attack | what the verifier said |\n|---|---|---|---|---|\n{rows}\n"
    )
}

fn per_map(outcomes: &[Outcome], table: Table, chip_rate: usize, demodulator: &str) -> String {
    let is =
        |o: &&Outcome| o.table == table && o.profile.chip_rate == chip_rate && o.demodulator == demodulator;
    let rows: Vec<&Outcome> = outcomes.iter().filter(is).collect();
    let maps = distinct(rows.iter().map(|o| o.map.as_str()));
    if rows.is_empty() {
        return String::new();
    }
    let title = if table == Table::Paper { "Table 2" } else { "Other attacks" };
    let mut text = format!("## {title} by map, chip rate {chip_rate}, demodulator {demodulator}\n\n");
    let _ = writeln!(text, "| | attack | {} |\n|{}", maps.join(" | "), "---|".repeat(2 + maps.len()));
    for id in distinct(rows.iter().map(|o| o.case.as_str())) {
        let of_case: Vec<&&Outcome> = rows.iter().filter(|o| o.case == id).collect();
        let _ = write!(text, "| {id} | {} |", of_case[0].title);
        for map in &maps {
            let rate = of_case.iter().find(|o| o.map == *map).map(|o| match bit_error_percent(o) {
                Some(percent) => format!("{percent:.1}"),
                None => "n. r.".into(),
            });
            let _ = write!(text, " {} |", rate.unwrap_or_default());
        }
        text.push('\n');
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table2::summary::tests::outcome;

    #[test]
    fn the_published_rate_stands_beside_ours() {
        let outcomes = [outcome("9c", 2, "paper", Some(8)), outcome("9c", 2, "joint", Some(4))];
        let text = report(&outcomes, 7, "meshmark 1");
        assert!(text.contains("| 9c | attack 9c | 5.9 | 6.2 | 3.1 | 1 of 1 | 10^-26 | 0 |"), "{text}");
        assert!(text.contains("Seed 7") && text.contains("Every suspect was registered."));
    }

    #[test]
    fn a_suspect_that_was_not_registered_is_named() {
        let text = report(&[outcome("4a", 3, "paper", None), outcome("4a", 3, "joint", None)], 7, "");
        assert!(text.contains("| 4a | attack 4a | 0.0 | 50.0 | 50.0 | 0 of 1 | – | 1 |"), "{text}");
        assert!(text.contains("| town | c=3 | 4a | attack 4a | so it is |"), "{text}");
        assert!(text.contains("| 4a | attack 4a | n. r. |"), "{text}");
    }

    #[test]
    fn every_row_of_a_table_has_as_many_columns_as_its_head() {
        let outcomes: Vec<_> = [2, 3]
            .iter()
            .flat_map(|c| DEMODULATORS.map(|demodulator| outcome("6", *c, demodulator, Some(9))))
            .collect();
        for block in report(&outcomes, 7, "").split("\n\n").filter(|block| block.starts_with('|')) {
            let columns: Vec<usize> = block.lines().map(|line| line.matches('|').count()).collect();
            assert!(columns.windows(2).all(|pair| pair[0] == pair[1]), "{block}");
        }
    }
}
