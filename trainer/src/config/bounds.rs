//! The range of every number of a configuration, in one list: checked before anything is allocated, and what a search
//! over settings may choose from. Task and disturbance bound their own (`nav_core::task`, `nav_sim::disturbance`).

use anyhow::{Result, ensure};
use toml::Value;

/// The range of one number; of a list, of each of its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The field, as in the TOML file.
    pub field: &'static str,
    /// Its unit; empty for a pure number.
    pub unit: &'static str,
    /// The least that makes sense.
    pub least: f64,
    /// The most that makes sense.
    pub most: f64,
}

const fn bound(field: &'static str, unit: &'static str, least: f64, most: f64) -> Bound {
    Bound { field, unit, least, most }
}

/// The largest seed: TOML knows no larger number, and the configuration is kept as TOML.
const SEED_MAX: f64 = i64::MAX as f64;
/// So many transitions need 7 GB of the low level, 9 GB of the high level.
const REPLAY_MAX: f64 = 1e7;
/// Worlds are kept with the ways to their goals, about 0.1 MB each: of seven families so many need about 7 GB.
const WORLDS_MAX: f64 = 1e4;

/// Every number outside `task` and `disturbance`.
pub const BOUNDS: &[Bound] = &[
    bound("seed", "", 0.0, SEED_MAX),
    bound("worlds_per_family", "worlds", 1.0, WORLDS_MAX),
    bound("low.envs", "robots", 1.0, 1024.0),
    bound("low.env_steps", "steps", 2.0, 1e10),
    bound("low.warmup_steps", "steps", 1.0, 1e7),
    bound("low.env_steps_per_update", "steps", 1.0, 1e6),
    bound("low.batch", "transitions", 1.0, 65_536.0),
    bound("low.replay_capacity", "transitions", 1.0, REPLAY_MAX),
    bound("low.discount", "", 0.0, 0.99999),
    bound("low.n_step", "steps", 1.0, 200.0),
    bound("low.noise", "", 0.0, 2.0),
    bound("low.goal_share", "", 0.0, 1.0),
    bound("low.subgoal_m", "m", 0.01, 100.0),
    bound("low.subgoal_s", "s", 0.001, 1e5),
    bound("low.final_learning_rate_share", "", 0.0, 1.0),
    bound("low.decomposed.progress", "", -1e4, 1e4),
    bound("low.decomposed.time", "", 0.0, 1e4),
    bound("low.decomposed.turning", "", 0.0, 1e4),
    bound("low.decomposed.change", "", 0.0, 1e4),
    bound("low.decomposed.proximity", "", 0.0, 1e4),
    bound("low.decomposed.proximity_m", "m", 0.001, 10.0),
    bound("low.decomposed.reached", "", -1e4, 1e4),
    bound("low.decomposed.collided", "", 0.0, 1e4),
    bound("low.paper.reached", "", -1e4, 1e4),
    bound("low.paper.collided", "", -1e4, 1e4),
    bound("low.paper.guidance", "", -1e4, 1e4),
    bound("low.paper.collision", "", -1e4, 1e4),
    bound("low.paper.collision_penalty", "", -1e4, 1e4),
    bound("low.collapse.from_share", "", 0.0, 1.0),
    bound("low.collapse.reach_min", "", 0.0, 1.0),
    bound("low.collapse.saturation_max", "", 0.0, 1.0),
    bound("low.td3.hidden", "units", 1.0, 4096.0),
    bound("low.td3.actor_learning_rate", "", 1e-8, 1.0),
    bound("low.td3.critic_learning_rate", "", 1e-8, 1.0),
    bound("low.td3.tau", "", 1e-6, 1.0),
    bound("low.td3.policy_delay", "updates", 1.0, 1000.0),
    bound("low.td3.target_noise", "", 0.0, 2.0),
    bound("low.td3.target_noise_clip", "", 0.0, 2.0),
    bound("low.td3.actor_output_gain", "", 0.0, 1000.0),
    bound("low.td3.tanh_slope_min", "", 0.0, 1.0),
    bound("low.td3.gradient_norm_max", "", 0.0, 1e6),
    bound("low.td3.smooth_temporal", "", 0.0, 1e4),
    bound("low.td3.smooth_spatial", "", 0.0, 1e4),
    bound("low.td3.smooth_spatial_noise", "", 0.0, 10.0),
    bound("high.envs", "robots", 1.0, 1024.0),
    bound("high.decisions", "decisions", 2.0, 1e10),
    bound("high.warmup_decisions", "decisions", 1.0, 1e7),
    bound("high.decisions_per_update", "decisions", 1.0, 1e6),
    bound("high.batch", "decisions", 1.0, 65_536.0),
    bound("high.replay_capacity", "decisions", 1.0, REPLAY_MAX),
    bound("high.discount", "", 0.0, 0.99999),
    bound("high.n_step", "decisions", 1.0, 10.0),
    bound("high.epsilon", "", 0.0, 1.0),
    bound("high.epsilon_share", "", 0.0, 1.0),
    bound("high.random_goal_share", "", 0.0, 1.0),
    bound("high.final_learning_rate", "", 0.0, 1.0),
    bound("high.decomposed.reached", "", -1e4, 1e4),
    bound("high.decomposed.collided", "", 0.0, 1e4),
    bound("high.decomposed.time", "", 0.0, 1e4),
    bound("high.decomposed.progress", "", -1e4, 1e4),
    bound("high.paper.direction", "", -1e4, 1e4),
    bound("high.paper.distance", "", -1e4, 1e4),
    bound("high.paper.avoidance", "", -1e4, 1e4),
    bound("high.paper.smoothness", "", -1e4, 1e4),
    bound("high.paper.no_obstacle", "", -1e4, 1e4),
    bound("high.paper.collision", "", -1e4, 1e4),
    bound("high.paper.time", "", -1e4, 1e4),
    bound("high.deviation_margins", "", -1e4, 1e4),
    bound("high.dqn.hidden", "units", 1.0, 4096.0),
    bound("high.dqn.learning_rate", "", 1e-8, 1.0),
    bound("high.dqn.tau", "", 1e-6, 1.0),
    bound("high.dqn.huber_delta", "", 1e-6, 1e6),
    bound("high.dqn.gradient_norm_max", "", 0.0, 1e6),
    bound("gate.low_reach", "", 0.0, 1.0),
    bound("gate.low_collision", "", 0.0, 1.0),
    bound("gate.spin", "", 0.0, 1.0),
    bound("gate.worlds", "worlds a family", 1.0, WORLDS_MAX),
    bound("gate.choosing_worlds", "worlds a family", 1.0, WORLDS_MAX),
    bound("gate.static_collision", "", 0.0, 1.0),
    bound("gate.people_collision_beyond_reactive", "", 0.0, 1.0),
    bound("gate.clutter_success", "", 0.0, 1.0),
    bound("gate.u_trap_success", "", 0.0, 1.0),
    bound("curve.points", "points a stage", 0.0, 1000.0),
    bound("curve.worlds", "worlds a family", 1.0, WORLDS_MAX),
];

impl Bound {
    fn check(&self, value: f64, is_float: bool) -> Result<()> {
        let Self { field, unit, least, most } = *self;
        let space = if unit.is_empty() { "" } else { " " };
        // A configuration holds `f32`: 1e-8 is a little less there.
        let kept = |number: f64| if is_float { f64::from(number as f32) } else { number };
        ensure!(
            (kept(least)..=kept(most)).contains(&value),
            "{field} is {value}, and must lie in [{least}, {most}]{space}{unit}"
        );
        Ok(())
    }
}

/// A configuration's TOML with the range of each number beside it, for people who look for what to change.
pub fn commented(toml: &str) -> String {
    let (mut table, mut text) = (String::new(), String::new());
    for line in toml.lines() {
        text.push_str(line);
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            table = format!("{name}.");
        } else if let Some((key, _)) = line.split_once(" = ") {
            let field = format!("{table}{key}");
            if let Some(Bound { unit, least, most, .. }) = BOUNDS.iter().find(|bound| bound.field == field) {
                let space = if unit.is_empty() { "" } else { " " };
                text.push_str(&format!("  # {least} to {most}{space}{unit}"));
            }
        }
        text.push('\n');
    }
    text
}

/// Refuses every number outside its range, by the name of its field.
///
/// # Errors
/// The first of them.
pub(super) fn check(value: &Value, path: &str) -> Result<()> {
    if path == "task" || path == "disturbance" {
        return Ok(());
    }
    let (number, is_float) = match value {
        Value::Float(number) => (*number, true),
        Value::Integer(number) => (*number as f64, false),
        Value::Table(table) => {
            return table.iter().try_for_each(|(key, value)| {
                check(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") })
            });
        }
        Value::Array(values) => return values.iter().try_for_each(|value| check(value, path)),
        _ => return Ok(()),
    };
    let bound = BOUNDS.iter().find(|bound| bound.field == path);
    let bound = bound.ok_or_else(|| anyhow::anyhow!("{path} has no range: this is a defect"))?;
    bound.check(number, is_float)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Config, Profile};

    /// The TOML of a configuration with one field (each number of a list) replaced.
    fn with(field: &str, value: f64) -> Config {
        let mut table = toml::Table::try_from(Config::default()).expect("plain numbers");
        let (mut slot, mut keys) = (&mut table, field.split('.').peekable());
        while let Some(key) = keys.next() {
            if keys.peek().is_some() {
                slot = slot.get_mut(key).and_then(Value::as_table_mut).expect("a table");
                continue;
            }
            let replaced = |old: &Value| match old {
                Value::Integer(_) => Value::Integer(value as i64),
                _ => Value::Float(value),
            };
            let old = slot.get(key).unwrap_or_else(|| panic!("{field} is no field")).clone();
            let new = match &old {
                Value::Array(values) => Value::Array(values.iter().map(replaced).collect()),
                single => replaced(single),
            };
            slot.insert(key.to_owned(), new);
        }
        table.try_into().unwrap_or_else(|error| panic!("{field} = {value}: {error}"))
    }

    fn refusal(field: &str, value: f64) -> Option<String> {
        let toml = Value::try_from(with(field, value)).expect("plain numbers");
        check(&toml, "").err().map(|error| error.to_string())
    }

    #[test]
    fn every_number_has_a_range_that_holds_its_defaults() {
        for profile in [Profile::Quick, Profile::Full] {
            check(&Value::try_from(Config::of_profile(profile)).expect("plain numbers"), "").expect("inside");
        }
    }

    #[test]
    fn comments_name_every_range_and_change_nothing() {
        let config = Config::default();
        let text = commented(&config.to_toml());
        assert_eq!(text.matches("  # ").count(), BOUNDS.len(), "{text}");
        assert!(text.contains("envs = 16  # 1 to 1024 robots"), "{text}");
        assert_eq!(Config::parse(&text, Profile::Quick).expect("still TOML"), config);
    }

    #[test]
    fn both_ends_of_every_range_pass_and_what_lies_outside_is_named() {
        for bound in BOUNDS {
            for inside in [bound.least, bound.most] {
                let refused = refusal(bound.field, inside);
                assert!(refused.is_none_or(|sentence| !sentence.contains(bound.field)), "{bound:?} {inside}");
            }
            let step = |end: f64| (end.abs() * 0.01).max(if bound.unit.is_empty() { 1e-3 } else { 1.0 });
            let mut outside = vec![bound.least - step(bound.least), bound.most + step(bound.most)];
            // Counts cannot be negative, and no seed is above the largest.
            outside.retain(|value| (bound.least < 0.0 || *value >= 0.0) && *value <= SEED_MAX);
            for value in outside {
                let sentence = refusal(bound.field, value).unwrap_or_default();
                assert!(
                    sentence.contains(bound.field) && sentence.contains(bound.unit),
                    "{bound:?} {value}: {sentence}"
                );
            }
        }
    }
}
