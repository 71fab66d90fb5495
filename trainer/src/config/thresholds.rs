//! The thresholds of a gate, apart from the rest: those of another file for a run that has finished, and what is different
//! in them.

use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use toml::Value;

use super::{Config, GateConfig, bounds, read};

/// Thresholds that are easier to meet when they are lower; of the others, shares that may go wrong, when they are higher.
const AT_LEAST: [&str; 3] = ["low_reach", "clutter_success", "u_trap_success"];
/// No thresholds, but how much is driven.
const COUNTS: [&str; 2] = ["worlds", "choosing_worlds"];

impl Config {
    /// This configuration with the thresholds of a TOML file laid over it.
    ///
    /// # Errors
    /// A file that cannot be read, is nonsense, or would change anything else.
    pub fn judged_by(&self, path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the configuration {}: check --config", path.display()))?;
        self.judged_by_text(&text).with_context(|| format!("the configuration {}", path.display()))
    }

    fn judged_by_text(&self, text: &str) -> Result<Self> {
        let mut merged = toml::Table::try_from(self).context("cannot be merged")?;
        read::merge(&mut merged, text.parse().context("is not valid TOML")?, "")?;
        let config: Self = merged.try_into().context("has a value of the wrong kind")?;
        let (own, other) = (Value::try_from(self)?, Value::try_from(&config)?);
        if let Some((field, own, other)) = first_difference(&own, &other, "") {
            bail!(
                "says {field} = {other}, and the run was trained with {own}: of a run that has finished only [gate] can \
                 be changed"
            );
        }
        ensure!(
            self.gate.choosing_worlds == config.gate.choosing_worlds,
            "says gate.choosing_worlds = {}, and the run's deviation margin was chosen on {}: that was before it was judged, \
             and stays",
            config.gate.choosing_worlds,
            self.gate.choosing_worlds
        );
        bounds::check(&Value::try_from(&config.gate)?, "gate")?;
        Ok(config)
    }
}

/// The first field outside `gate` that two configurations differ in, and both values.
fn first_difference(own: &Value, other: &Value, path: &str) -> Option<(String, Value, Value)> {
    match (own, other) {
        _ if path == "gate" || own == other => None,
        (Value::Table(own), Value::Table(other)) => own.iter().find_map(|(key, value)| {
            let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            first_difference(value, other.get(key)?, &full)
        }),
        _ => Some((path.to_owned(), short(own), short(other))),
    }
}

/// A number as it was typed: 0.8, not the nearest `f32` in the digits of an `f64`.
fn short(value: &Value) -> Value {
    match value {
        Value::Float(number) => Value::Float((*number as f32).to_string().parse::<f64>().unwrap_or(*number)),
        Value::Array(values) => Value::Array(values.iter().map(short).collect()),
        other => other.clone(),
    }
}

impl GateConfig {
    /// What is different here from other thresholds, and whether it is looser.
    pub fn changes_from(&self, other: &Self) -> Vec<String> {
        let tables = [self, other].map(|gate| Value::try_from(gate).ok());
        let [Some(Value::Table(here)), Some(Value::Table(there))] = tables else { return Vec::new() };
        let differs = |(key, value): (&String, &Value)| {
            let before = there.get(key).filter(|before| *before != value)?;
            let number = |value: &Value| value.as_float().unwrap_or_default();
            let is_lower = number(value) < number(before);
            let how = match key.as_str() {
                key if COUNTS.contains(&key) => "",
                key if AT_LEAST.contains(&key) == is_lower => ", looser",
                _ => ", stricter",
            };
            Some(format!("{key} {} instead of {}{how}", short(value), short(before)))
        };
        here.iter().filter_map(differs).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_gate_of_a_finished_run_can_be_changed_and_the_rest_is_refused_by_name() {
        let mut own = Config { seed: 7, ..Config::default() };
        own.low.envs = 3;
        let judged = |text: &str| own.judged_by_text(text);
        let looser = judged("[gate]\nlow_reach = 0.8\npeople_collision_beyond_reactive = 0.7\nworlds = 30")
            .expect("the gate alone");
        assert_eq!(looser, Config { gate: looser.gate.clone(), ..own.clone() });
        assert_eq!(
            looser.gate.changes_from(&own.gate),
            [
                "low_reach 0.8 instead of 0.9, looser",
                "people_collision_beyond_reactive 0.7 instead of 0.05, looser",
                "worlds 30 instead of 120"
            ]
        );
        assert_eq!(own.gate.changes_from(&looser.gate)[0], "low_reach 0.9 instead of 0.8, stricter");
        assert_eq!(own.gate.changes_from(&own.gate), Vec::<String>::new());
        assert_eq!(judged(&own.to_toml()).expect("the same"), own, "a whole file that says the same");
        for (text, field) in [
            ("[low]\nenvs = 16\n[gate]\nlow_reach = 0.8", "low.envs = 16, and the run was trained with 3"),
            ("seed = 8", "seed = 8"),
            ("profile = 'full'", "profile"),
            (
                "[task.robot]\nlinear_max_mps = 0.3",
                "task.robot.linear_max_mps = 0.3, and the run was trained with 1.0",
            ),
            ("[gate]\nchoosing_worlds = 3", "gate.choosing_worlds"),
            ("[gate]\nlow_reach = 1.5", "gate.low_reach"),
            ("[gate]\nlow_reach = nan", "gate.low_reach"),
            ("[gate]\nlow_reech = 0.5", "unknown field `gate.low_reech`"),
        ] {
            let error = format!("{:#}", judged(text).expect_err(text));
            assert!(error.contains(field), "{error}");
        }
    }
}
