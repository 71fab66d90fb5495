//! From rows to figures: each policy on each family, counted and then divided.

use nav_core::metrics::EpisodeEnd;
use serde::Serialize;

use crate::rows::EpisodeRow;

/// What worlds that were read are called together.
const WORLD_FILES: &str = "world files";

/// A policy on a family, or on all worlds that were read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Policy.
    pub policy: String,
    /// Family, or `world files`.
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
    /// Share that stood where it wrongly believed to have arrived until time was over.
    pub believed_arrived: f64,
    /// Share that ran out of time on the way.
    pub timeout: f64,
    /// Mean time to the goal of successes, s.
    pub time_s: Option<f64>,
    /// Mean success weighted by path length, of all worlds with a known shortest way.
    pub spl: Option<f64>,
    /// Mean geodesic path efficiency of successes.
    pub path_efficiency: Option<f64>,
    /// Mean Euclidean path efficiency of successes (the paper's).
    pub path_efficiency_euclidean: Option<f64>,
    /// Mean smoothness (the paper's).
    pub smoothness: Option<f64>,
    /// Mean log-dimensionless jerk.
    pub log_jerk: Option<f64>,
    /// Mean of the smallest clearance, m.
    pub clearance_min_m: Option<f64>,
    /// Mean of the smallest time to collision, s.
    pub time_to_collision_min_s: Option<f64>,
    /// Mean share of spin.
    pub spin: Option<f64>,
    /// Mean time of a tick, us.
    pub tick_us: Option<f64>,
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

/// Summarises rows by policy and family, policies first, in the order in which they first appear.
pub fn summarise(rows: &[EpisodeRow]) -> Vec<Summary> {
    let mut policies: Vec<&str> = Vec::new();
    let mut families: Vec<&str> = Vec::new();
    for row in rows {
        if !policies.contains(&row.policy.as_str()) {
            policies.push(&row.policy);
        }
        if !families.contains(&family(row)) {
            families.push(family(row));
        }
    }
    let mut summaries = Vec::new();
    for policy in policies {
        for &name in &families {
            let of_both = |row: &&EpisodeRow| row.policy == policy && family(row) == name;
            let group: Vec<&EpisodeRow> = rows.iter().filter(of_both).collect();
            if !group.is_empty() {
                summaries.push(Summary::of(policy, name, &group));
            }
        }
    }
    summaries
}

fn family(row: &EpisodeRow) -> &'static str {
    row.family.map_or(WORLD_FILES, nav_sim::families::Family::id)
}

impl Summary {
    fn of(policy: &str, family: &str, rows: &[&EpisodeRow]) -> Self {
        let total = rows.len();
        let count = |end: EpisodeEnd| rows.iter().filter(|row| row.end == end).count();
        let share = |hits: usize| hits as f64 / total.max(1) as f64;
        let average = |value: fn(&EpisodeRow) -> Option<f32>| {
            mean(rows.iter().filter_map(|row| value(row)).map(f64::from))
        };
        let successes = count(EpisodeEnd::Success);
        Self {
            policy: policy.to_owned(),
            family: family.to_owned(),
            worlds: total,
            success: share(successes),
            success_interval: wilson(successes, total),
            collision: share(count(EpisodeEnd::Collision)),
            hit_while_standing: share(rows.iter().filter(|row| row.hit_while_standing).count()),
            believed_arrived: share(count(EpisodeEnd::BelievedArrived)),
            timeout: share(count(EpisodeEnd::Timeout)),
            time_s: average(|row| (row.end == EpisodeEnd::Success).then_some(row.time_s)),
            spl: average(|row| row.spl),
            path_efficiency: average(|row| row.path_efficiency),
            path_efficiency_euclidean: average(|row| row.path_efficiency_euclidean),
            smoothness: average(|row| Some(row.smoothness)),
            log_jerk: average(|row| row.log_jerk),
            clearance_min_m: average(|row| Some(row.clearance_min_m)),
            time_to_collision_min_s: average(|row| row.time_to_collision_min_s),
            spin: average(|row| Some(row.spin)),
            tick_us: mean(rows.iter().map(|row| row.tick_mean_ns as f64 / 1e3)),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
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
