//! Figures for a terminal and for programs.

use anyhow::{Context, Result};
use nav_env::summary::Summary;
use nav_host::files;
use nav_host::terminal::say;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

use super::plan::{Plan, SUMMARY, TABLE};

/// The figures, for programs.
#[derive(Debug, Serialize)]
struct Report<'a> {
    command: String,
    commit: String,
    summaries: &'a [Summary],
}

/// Writes table and figures.
///
/// # Errors
/// A file that cannot be written.
pub fn write(plan: &Plan, summaries: &[Summary]) -> Result<()> {
    let report = Report {
        command: std::env::args().collect::<Vec<_>>().join(" "),
        commit: crate::commit::commit(),
        summaries,
    };
    write_text(&plan.out.join(TABLE), &table(summaries))?;
    write_text(&plan.out.join(SUMMARY), &(serde_json::to_string_pretty(&report)? + "\n"))
}

/// Tells the table and where the rest is.
pub fn tell(plan: &Plan, summaries: &[Summary]) {
    say(table(summaries));
    say(format_args!("table, rows, figures and pictures are in {}", plan.out.display()));
}

/// The summaries as a table for a terminal.
pub fn table(summaries: &[Summary]) -> String {
    let policy_width = summaries.iter().map(|row| row.policy.len()).max().unwrap_or(0).max(10);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<policy_width$} {:<11} {:>6} {:>8} {:>11} {:>9} {:>8} {:>8} {:>6} {:>6} {:>7} {:>7} {:>6} {:>8}",
        "policy",
        "family",
        "worlds",
        "success",
        "95 %",
        "collision",
        "believed",
        "timeout",
        "time s",
        "SPL",
        "clear m",
        "smooth",
        "spin",
        "tick us"
    );
    for row in summaries {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let interval =
            format!("{:.1}-{:.1}", 100.0 * row.success_interval[0], 100.0 * row.success_interval[1]);
        let _ = writeln!(
            out,
            "{:<policy_width$} {:<11} {:>6} {:>8} {:>11} {:>9} {:>8} {:>8} {:>6} {:>6} {:>7} {:>7} {:>6} {:>8}",
            row.policy,
            row.family,
            row.worlds,
            percent(row.success),
            interval,
            percent(row.collision),
            percent(row.believed_arrived),
            percent(row.timeout),
            number(row.time_s, 1),
            number(row.spl, 3),
            number(row.clearance_min_m, 2),
            number(row.smoothness, 3),
            number(row.spin, 3),
            number(row.tick_us, 1)
        );
    }
    out.push_str("believed: stood at the end where odometry said the goal was, and it was not; timeout: without these\n");
    out
}

/// A number, or a dash for none; what rounds to zero has no sign.
fn number(value: Option<f64>, digits: usize) -> String {
    let Some(value) = value else { return "-".to_owned() };
    let text = format!("{value:.digits$}");
    let is_zero = text.chars().all(|letter| "-0.".contains(letter));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Writes a file whole or not at all.
///
/// # Errors
/// A file that cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    files::replace(path, text).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn what_rounds_to_zero_has_no_sign() {
        let texts =
            [Some(-1.7e-8), Some(-0.0), Some(-0.004), Some(-0.006), None].map(|value| number(value, 2));
        assert_eq!(texts, ["0.00", "0.00", "0.00", "-0.01", "-"]);
    }
}
