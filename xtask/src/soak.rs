//! The attacks that take long, again and again with other seeds, until the time is over; then a table.

use anyhow::{Result, bail};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::shell::{cargo, print_line, run_quiet, run_shown, say, tools};

/// An attack: what it is called, and the filter that names its tests.
const ATTACKS: [(&str, &str); 7] = [
    ("kills at start", "binary(killed_starts)"),
    ("kills while driving", "binary(faults)"),
    ("rogue writers", "package(nav-ipc) & (binary(rules) | binary(stock))"),
    ("mutated models", "binary(mutants) | test(truncated_and_flipped)"),
    ("killed exports", "binary(killed_exports)"),
    ("floods", "test(flood)"),
    ("full memory, other users", "binary(trust) | binary(shm_full) | binary(other_users)"),
];
/// Starts and exports that are killed, and mutants, in each round.
const KILLS: &str = "100";
const EXPORT_KILLS: &str = "60";
const MUTANTS: &str = "3000";
const FLOOD_SECONDS: &str = "5";

/// What became of an attack.
#[derive(Default)]
struct Tally {
    rounds: u32,
    missed: Vec<String>,
    longest: Duration,
}

/// Repeats every attack until `minutes` are over, at least once each.
///
/// # Errors
/// Attacks that were not withstood, with the seed that repeats them.
pub(crate) fn run(minutes: u32) -> Result<()> {
    // The attacks drive the programs as they are.
    run_shown(cargo().args(["build", "--release", "--workspace", "--all-targets"]), "the build")?;
    let ends = Instant::now() + Duration::from_secs(60 * u64::from(minutes));
    let mut tallies: BTreeMap<usize, Tally> = BTreeMap::new();
    let counts = tools().join(format!("soak-counts-{}", std::process::id()));
    let mut seed = 0_u32;
    while seed == 0 || Instant::now() < ends {
        seed += 1;
        for (index, (name, filter)) in ATTACKS.iter().enumerate() {
            if seed > 1 && Instant::now() >= ends {
                break;
            }
            let started = Instant::now();
            let mut command = cargo();
            command.args(["nextest", "run", "--release", "--workspace", "-E", filter]);
            command.env("NAV_SOAK_SEED", seed.to_string());
            command.env("NAV_IPC_KILLS", KILLS).env("NAV_SOAK_MUTANTS", MUTANTS);
            command.env("NAV_SOAK_SECONDS", FLOOD_SECONDS).env("NAV_EXPORT_KILLS", EXPORT_KILLS);
            command.env("NAV_SOAK_COUNTS", &counts);
            let outcome = run_quiet(&mut command, name, |_| ());
            let tally = tallies.entry(index).or_default();
            tally.rounds += 1;
            tally.longest = tally.longest.max(started.elapsed());
            if let Err(error) = outcome {
                tally.missed.push(format!("seed {seed}: {error:#}"));
            }
            say(&format!("seed {seed}, {name}: {:.0} s", started.elapsed().as_secs_f64()));
        }
    }
    let counted = std::fs::read_to_string(&counts).unwrap_or_default();
    // What is not removed is in the folder of tools, which git ignores.
    let _ = std::fs::remove_file(&counts);
    table(&tallies, &sums(&counted))
}

/// What the tests counted, added up over all rounds: lines of a number and what it is of, in their order.
fn sums(counted: &str) -> Vec<(&str, u64)> {
    let mut sums: Vec<(&str, u64)> = Vec::new();
    for line in counted.lines() {
        let Some((number, name)) = line.split_once(' ') else { continue };
        let Ok(number) = number.parse::<u64>() else { continue };
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += number,
            None => sums.push((name, number)),
        }
    }
    sums
}

fn table(tallies: &BTreeMap<usize, Tally>, counted: &[(&str, u64)]) -> Result<()> {
    print_line(&format!(
        "\nof each round: {KILLS} killed starts, {MUTANTS} mutants, {EXPORT_KILLS} killed exports, {FLOOD_SECONDS} s of flood\n\n{:<26} {:>7} {:>7} {:>10}",
        "attack", "rounds", "missed", "longest s"
    ));
    for (index, tally) in tallies {
        let Tally { rounds, missed, longest } = tally;
        let (name, count) = (ATTACKS[*index].0, missed.len());
        print_line(&format!("{name:<26} {rounds:>7} {count:>7} {:>10.0}", longest.as_secs_f64()));
    }
    print_line("");
    for (name, sum) in counted {
        print_line(&format!("{sum:>10} {name}"));
    }
    let missed: Vec<_> = tallies.values().flat_map(|tally| &tally.missed).collect();
    missed.iter().for_each(|words| print_line(words));
    if missed.is_empty() { Ok(()) } else { bail!("{} attacks were not withstood", missed.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_all_rounds_are_added_up() {
        let counted = "300 mutants\n12 of them loaded\nhalf a line\n300 mutants\n1";
        assert_eq!(sums(counted), [("mutants", 600), ("of them loaded", 12)]);
    }
}
