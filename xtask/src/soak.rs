//! The attacks that take long, again and again with other seeds, until the time is over; then a table.

use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::shell::{cargo, have, print_line, run_shown, say, tools};

/// An attack: what it is called, and the filter that names its tests.
const ATTACKS: [(&str, &str); 7] = [
    ("kills at start", "binary(killed_starts)"),
    ("kills while driving", "binary(faults)"),
    ("rogue writers", "package(nav-ipc) & (binary(rules) | binary(stock)) | binary(rogues)"),
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
/// Attacks that were not withstood, with their tests and what repeats them.
pub(crate) fn run(minutes: u32) -> Result<()> {
    if !have("cargo", &["nextest", "--version"]) {
        bail!("cargo-nextest is missing: `cargo install cargo-nextest --locked`");
    }
    // The attacks drive the programs as they are.
    run_shown(cargo().args(["build", "--release", "--workspace", "--all-targets"]), "the build")?;
    let ends = Instant::now() + Duration::from_secs(60 * u64::from(minutes));
    let mut tallies: BTreeMap<usize, Tally> = BTreeMap::new();
    std::fs::create_dir_all(tools()).context("the folder of tools cannot be made")?;
    let counts = tools().join(format!("soak-counts-{}", std::process::id()));
    let mut seed = 0_u32;
    while seed == 0 || Instant::now() < ends {
        seed += 1;
        for (index, (name, filter)) in ATTACKS.iter().enumerate() {
            if seed > 1 && Instant::now() >= ends {
                break;
            }
            let started = Instant::now();
            let variables = [
                ("NAV_SOAK_SEED", seed.to_string()),
                ("NAV_IPC_KILLS", KILLS.to_owned()),
                ("NAV_SOAK_MUTANTS", MUTANTS.to_owned()),
                ("NAV_SOAK_SECONDS", FLOOD_SECONDS.to_owned()),
                ("NAV_EXPORT_KILLS", EXPORT_KILLS.to_owned()),
                ("NAV_SOAK_COUNTS", counts.display().to_string()),
            ];
            let mut command = cargo();
            command.args(["nextest", "run", "--release", "--workspace", "-E", filter]).envs(variables);
            let missed = attack(&mut command, &format!("soak-missed-{seed}-{index}.log"))?;
            let tally = tallies.entry(index).or_default();
            tally.rounds += 1;
            tally.longest = tally.longest.max(started.elapsed());
            let seconds = started.elapsed().as_secs_f64();
            let word = if missed.is_some() { ", NOT WITHSTOOD" } else { "" };
            say(&format!("seed {seed}, {name}: {seconds:.0} s{word}"));
            tally.missed.extend(missed.map(|missed| format!("{name}, NAV_SOAK_SEED={seed}: {missed}")));
        }
    }
    let counted = std::fs::read_to_string(&counts).unwrap_or_default();
    // What is not removed is in the folder of tools, which git ignores.
    let _ = std::fs::remove_file(&counts);
    table(&tallies, &sums(&counted))
}

/// Runs the tests of an attack; which failed, if any, and where all that they said lies.
fn attack(command: &mut Command, log: &str) -> Result<Option<String>> {
    let output = command.stdin(Stdio::null()).output().context("cargo-nextest does not start")?;
    if output.status.success() {
        return Ok(None);
    }
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    let log = tools().join(log);
    std::fs::write(&log, &*said).with_context(|| format!("{} cannot be written", log.display()))?;
    let failed = failed_tests(&said);
    let failed = if failed.is_empty() { output.status.to_string() } else { failed.join(", ") };
    Ok(Some(format!("{failed}; all of it is in {}", log.display())))
}

/// The tests that failed, of what nextest says: `FAIL [   0.512s] (3/3) package::binary name`, twice each.
fn failed_tests(said: &str) -> Vec<&str> {
    let failed = said.lines().filter_map(|line| {
        let (how, test) = line.split_once('[')?;
        let is_failure = ["FAIL", "TIMEOUT", "SIG", "ABORT"].iter().any(|word| how.trim().starts_with(word));
        let test = test.split_once(']')?.1.trim();
        let test =
            test.strip_prefix('(').and_then(|test| test.split_once(") ")).map_or(test, |(_, test)| test);
        is_failure.then_some(test)
    });
    failed.collect::<BTreeSet<_>>().into_iter().collect()
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
    print_line(&format!("\n{:<26} {:>7} {:>7} {:>10}", "attack", "rounds", "missed", "longest s"));
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
    fn tests_that_failed_are_named_once() {
        let said = "        PASS [   0.010s] (1/3) nav-ipc::rules waiting\n        FAIL [   0.512s] (2/3) nav-ipc::stock a_test\n\
                    error: [1] is no test\n     SIGABRT [   0.2s] (3/3) nav-ipc::stock other\n     Summary [   0.6s] 3 tests run\n\
                    \x20       FAIL [   0.512s] (2/3) nav-ipc::stock a_test\n";
        assert_eq!(failed_tests(said), ["nav-ipc::stock a_test", "nav-ipc::stock other"]);
        assert!(failed_tests("error: could not compile `nav-ipc`\n").is_empty());
    }

    #[test]
    fn counts_of_all_rounds_are_added_up() {
        let counted = "300 mutants\n12 of them loaded\nhalf a line\n300 mutants\n1";
        assert_eq!(sums(counted), [("mutants", 600), ("of them loaded", 12)]);
    }
}
