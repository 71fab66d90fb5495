//! From episodes to a table: raw rows, and per policy and family a summary.

use anyhow::{Context, Result};
use nav_core::metrics::{EpisodeEnd, EpisodeMetrics};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// One episode, as a raw row.
#[derive(Clone, Debug, Serialize)]
pub struct EpisodeRow {
    /// Policy.
    pub policy: String,
    /// Family.
    pub family: String,
    /// World seed within family and split.
    pub seed: u64,
    /// What it came to.
    #[serde(flatten)]
    pub metrics: EpisodeMetrics,
    /// Mean time of a tick, ns.
    pub tick_mean_ns: f64,
    /// Longest tick, ns.
    pub tick_max_ns: u64,
}

/// A policy on a family.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Policy.
    pub policy: String,
    /// Family.
    pub family: String,
    /// Worlds driven.
    pub worlds: usize,
    /// Share that reached the goal in time.
    pub success: f64,
    /// 95 % Wilson interval of the success rate.
    pub success_interval: [f64; 2],
    /// Share that collided.
    pub collision: f64,
    /// Share in which the robot was hit while standing (part of the collisions).
    pub hit_while_standing: f64,
    /// Share that ran out of time.
    pub timeout: f64,
    /// Mean time to the goal of successes, s.
    pub time_s: Option<f64>,
    /// Mean success weighted by path length, all worlds.
    pub spl: f64,
    /// Mean geodesic path efficiency of successes.
    pub path_efficiency: Option<f64>,
    /// Mean Euclidean path efficiency of successes (the paper's).
    pub path_efficiency_euclidean: Option<f64>,
    /// Mean smoothness (the paper's).
    pub smoothness: f64,
    /// Mean log-dimensionless jerk.
    pub log_jerk: Option<f64>,
    /// Mean of the smallest clearance, m.
    pub clearance_min_m: f64,
    /// Mean of the smallest time to collision, s.
    pub time_to_collision_min_s: Option<f64>,
    /// Mean share of spin.
    pub spin: f64,
    /// Mean time of a tick, us.
    pub tick_us: f64,
}

/// 95 % Wilson score interval of `hits` out of `total`.
pub fn wilson(hits: usize, total: usize) -> [f64; 2] {
    const Z: f64 = 1.959_964;
    if total == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (total as f64, hits as f64 / total as f64);
    let center = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    [(center - half).max(0.0), (center + half).min(1.0)]
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Summarises rows by policy and family, in the order in which they first appear.
pub fn summarise(rows: &[EpisodeRow]) -> Vec<Summary> {
    let mut keys: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        let key = (row.policy.as_str(), row.family.as_str());
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let of = |(policy, family): (&str, &str)| {
        let group: Vec<&EpisodeRow> =
            rows.iter().filter(|row| row.policy == policy && row.family == family).collect();
        summarise_group(policy, family, &group)
    };
    keys.into_iter().map(of).collect()
}

fn summarise_group(policy: &str, family: &str, rows: &[&EpisodeRow]) -> Summary {
    let total = rows.len();
    let count = |end: EpisodeEnd| rows.iter().filter(|row| row.metrics.end == end).count();
    let share = |hits: usize| hits as f64 / total.max(1) as f64;
    let average = |value: fn(&EpisodeMetrics) -> Option<f32>| {
        mean(rows.iter().filter_map(|row| value(&row.metrics)).map(f64::from))
    };
    let successes = count(EpisodeEnd::Success);
    Summary {
        policy: policy.to_owned(),
        family: family.to_owned(),
        worlds: total,
        success: share(successes),
        success_interval: wilson(successes, total),
        collision: share(count(EpisodeEnd::Collision)),
        hit_while_standing: share(rows.iter().filter(|row| row.metrics.hit_while_standing).count()),
        timeout: share(count(EpisodeEnd::Timeout)),
        time_s: average(|m| (m.end == EpisodeEnd::Success).then_some(m.time_s)),
        spl: average(|m| Some(m.spl)).unwrap_or(0.0),
        path_efficiency: average(|m| m.path_efficiency),
        path_efficiency_euclidean: average(|m| m.path_efficiency_euclidean),
        smoothness: average(|m| Some(m.smoothness)).unwrap_or(0.0),
        log_jerk: average(|m| m.log_jerk),
        clearance_min_m: average(|m| Some(m.clearance_min_m)).unwrap_or(0.0),
        time_to_collision_min_s: average(|m| m.time_to_collision_min_s),
        spin: average(|m| Some(m.spin)).unwrap_or(0.0),
        tick_us: mean(rows.iter().map(|row| row.tick_mean_ns / 1e3)).unwrap_or(0.0),
    }
}

/// The summaries as a table for a terminal.
pub fn table(summaries: &[Summary]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<10} {:<10} {:>6} {:>8} {:>13} {:>9} {:>7} {:>7} {:>6} {:>7} {:>7} {:>6} {:>8}",
        "policy",
        "family",
        "worlds",
        "success",
        "95 %",
        "collision",
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
        let time = row.time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{time_s:.1}"));
        let _ = writeln!(
            out,
            "{:<10} {:<10} {:>6} {:>8} {:>13} {:>9} {:>7} {:>7} {:>6.3} {:>7.2} {:>7.3} {:>6.3} {:>8.1}",
            row.policy,
            row.family,
            row.worlds,
            percent(row.success),
            interval,
            percent(row.collision),
            percent(row.timeout),
            time,
            row.spl,
            row.clearance_min_m,
            row.smoothness,
            row.spin,
            row.tick_us
        );
    }
    out
}

/// The raw rows as CSV.
pub fn csv(rows: &[EpisodeRow]) -> String {
    let mut out = String::from(
        "policy,family,seed,end,hit_while_standing,steps,time_s,path_m,geodesic_m,euclidean_m,spl,smoothness,\
         log_jerk,clearance_min_m,clearance_mean_m,time_to_collision_min_s,spin,tick_mean_ns,tick_max_ns\n",
    );
    let optional = |value: Option<f32>| value.map_or_else(String::new, |value| value.to_string());
    for row in rows {
        let m = &row.metrics;
        let end = match m.end {
            EpisodeEnd::Success => "success",
            EpisodeEnd::Collision => "collision",
            EpisodeEnd::Timeout => "timeout",
        };
        let _ = writeln!(
            out,
            "{},{},{},{end},{},{},{},{},{},{},{},{},{},{},{},{},{},{:.0},{}",
            row.policy,
            row.family,
            row.seed,
            m.hit_while_standing,
            m.steps,
            m.time_s,
            m.path_m,
            m.geodesic_m,
            m.euclidean_m,
            m.spl,
            m.smoothness,
            optional(m.log_jerk),
            m.clearance_min_m,
            m.clearance_mean_m,
            optional(m.time_to_collision_min_s),
            m.spin,
            row.tick_mean_ns,
            row.tick_max_ns
        );
    }
    out
}

/// Writes a text file, making its folder.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn write(path: &Path, text: &str) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the closed form for 8 of 10 (Wilson 1927): 0.490 to 0.943.
    #[test]
    fn wilson_interval_of_eight_in_ten() {
        let [low, high] = wilson(8, 10);
        assert!((low - 0.490).abs() < 1e-3 && (high - 0.943).abs() < 1e-3, "{low} {high}");
        assert!(wilson(0, 50)[0] < 1e-9 && wilson(50, 50)[1] > 1.0 - 1e-9);
    }
}
