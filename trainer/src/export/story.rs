//! What the model card tells of how a model came about: everything that a reader of its figures would want to know.

use std::fmt::Write as _;

use crate::config::{Config, GateConfig};
use crate::train::past::{Past, Spent, Verdict};
use crate::train::policy::Policy;

/// What was spent, in words.
pub(super) fn words(Spent { env_steps, updates, seconds }: &Spent) -> String {
    format!("{env_steps} steps, {updates} updates, {seconds:.0} s")
}

/// The commands that it was made with.
pub(super) fn made_with(policy: &Policy, config: &Config) -> String {
    let algorithm = match (&policy.scorer, &policy.past.borrowed) {
        (None, _) => "td3",
        (Some(_), None) => "hybrid",
        (Some(_), Some(_)) => "dqn --low RUN",
    };
    let robot = config.robot.as_ref().map_or_else(String::new, |name| format!(" --robot {name}"));
    let mut text = format!(
        "`trainer train --profile {}{robot} --algorithm {algorithm} --seed {}`",
        config.profile, config.seed
    );
    for more in &policy.past.more {
        let _ = write!(text, ", `trainer train --resume RUN --more {}`", more.env_steps);
    }
    if policy.gate.thresholds != config.gate {
        text.push_str(", `trainer gate RUN --config FILE`");
    }
    text + ", then `trainer export`"
}

/// Rows of the table, for what not every model has.
pub(super) fn rows(policy: &Policy) -> String {
    let Past { borrowed, attempts, more, .. } = &policy.past;
    let mut text = String::new();
    if let Some(low) = borrowed {
        let _ = writeln!(
            text,
            "| low level | borrowed: from the run of seed {} at commit {} ({}){} |",
            low.seed,
            low.commit,
            words(&low.spent),
            if low.missed.is_empty() {
                String::new()
            } else {
                format!(", which missed its own gate: {}", low.missed)
            }
        );
    }
    if attempts.of > 1 {
        let _ = write!(text, "| attempt | {} of at most {}", attempts.number(), attempts.of);
        for tried in &attempts.earlier {
            let _ = write!(text, "; seed {} missed: {} ({})", tried.seed, tried.missed, words(&tried.spent));
        }
        text.push_str(" |\n");
    }
    if !more.is_empty() {
        let asked: Vec<_> = more.iter().map(|more| more.env_steps.to_string()).collect();
        let _ =
            writeln!(text, "| trained on | after it had finished, for {} steps more |", asked.join(" and "));
    }
    if policy.spent_in_all() != policy.spent() {
        let _ = writeln!(text, "| training in all | {} |", words(&policy.spent_in_all()));
    }
    text
}

/// By what it was judged, and what was said before.
pub(super) fn verdicts(policy: &Policy, config: &Config) -> String {
    let usual = Config::of_profile(config.profile).gate;
    let thresholds = |gate: &GateConfig| {
        let changes = gate.changes_from(&usual);
        if changes.is_empty() { "the profile's own thresholds".to_owned() } else { changes.join("; ") }
    };
    let mut text = format!("Judged by {}", thresholds(&policy.gate.thresholds));
    if policy.gate.thresholds != config.gate {
        text.push_str(
            " (**other thresholds than it was trained for**, set when it was known what it reached)",
        );
    }
    text.push_str(".\n");
    for Verdict { env_steps, report } in &policy.past.verdicts {
        let said =
            if report.is_passed() { "passed".to_owned() } else { format!("missed: {}", report.sentences()) };
        let _ = writeln!(
            text,
            "Before, after {env_steps} steps and by {}: {said}.",
            thresholds(&report.thresholds)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acting::Normaliser;
    use crate::nn::{Activation, Mlp, MlpShape, Rng};
    use crate::train::past::{Attempted, Attempts, Borrowed, More};
    use crate::train::policy::Weights;
    use crate::train::verdict::{GateReport, Miss};
    use rand::SeedableRng;

    fn plain(config: &Config) -> Policy {
        let shape = MlpShape::new(1, &[], 1, Activation::Tanh);
        Policy {
            config_toml: config.to_toml(),
            commit: "abc".to_owned(),
            task: config.task,
            normaliser: Normaliser::identity(),
            actor: Weights::of(&Mlp::new(shape, &mut Rng::seed_from_u64(0))),
            scorer: None,
            gate: GateReport { thresholds: config.gate.clone(), ..GateReport::default() },
            past: Past::default(),
            env_steps: 100,
            updates: 10,
            seconds: 1.0,
        }
    }

    #[test]
    fn a_card_tells_everything_that_lies_behind_a_model() {
        let config = Config { seed: 1_001, ..Config::default() };
        let mut policy = plain(&config);
        assert_eq!(rows(&policy), "", "nothing lies behind a plain one");
        assert_eq!(verdicts(&policy, &config), "Judged by the profile's own thresholds.\n");

        let spent = Spent { env_steps: 1_000, updates: 200, seconds: 30.0 };
        let missed = Miss { sentence: "reach is 7.0 %".to_owned(), by: 0.02, is_of_low: true };
        let report = GateReport { missed: vec![missed], ..policy.gate.clone() };
        policy.past = Past {
            borrowed: Some(Borrowed { seed: 5, commit: "def".to_owned(), spent, missed: "spin".to_owned() }),
            attempts: Attempts {
                of: 2,
                earlier: vec![Attempted { seed: 1, spent, missed: "traps".to_owned() }],
            },
            more: vec![More { env_steps: 700, low_steps: 0, high_decisions: 9 }],
            verdicts: vec![Verdict { env_steps: 60, report }],
        };
        policy.gate.thresholds.low_reach = 0.8;
        let text = [made_with(&policy, &config), rows(&policy), verdicts(&policy, &config)].concat();
        for part in [
            "--resume RUN --more 700`",
            "`trainer gate RUN --config FILE`",
            "borrowed: from the run of seed 5 at commit def (1000 steps, 200 updates, 30 s), which missed its own gate: spin |",
            "| attempt | 2 of at most 2; seed 1 missed: traps (1000 steps, 200 updates, 30 s) |",
            "for 700 steps more |",
            "| training in all | 2100 steps, 410 updates, 61 s |",
            "low_reach 0.8 instead of 0.9, looser (**other thresholds",
            "after 60 steps and by the profile's own thresholds: missed: reach is 7.0 %.",
        ] {
            assert!(text.contains(part), "{part}:\n{text}");
        }
    }
}
