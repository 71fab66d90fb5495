//! What is said when a run has been judged.

use std::fmt::Write as _;
use std::path::Path;

use crate::train::policy::Policy;

/// Suggested steps of `--more` are a multiple of this.
const ROUND_STEPS: u64 = 10_000;

/// That a finished run cannot be used, and every way on.
pub(super) fn missed(policy: &Policy, folder: &Path) -> String {
    let (run, more) = (folder.display(), (policy.env_steps / 2).max(1).next_multiple_of(ROUND_STEPS));
    format!(
        "the gate was not passed, so that it cannot be exported: {}; `trainer train --resume {run} --more {more}` trains it \
         further, `trainer train --seed N` tries another seed, --config changes what is trained, and `trainer gate {run} \
         --config looser.toml` judges it by the thresholds under [gate] there",
        policy.gate.sentences()
    )
}

/// What was reached, and what comes next.
pub(super) fn reached(policy: &Policy, folder: &Path) -> String {
    let mut text = format!(
        "\ntrained in {:.0} s: {} steps, {} updates\n{:<10} {:>8} {:>10} {:>7}   (td3 straight at the goal)\n",
        policy.seconds, policy.env_steps, policy.updates, "family", "success", "collision", "spin"
    );
    for (score, flat) in policy.gate.families.iter().zip(&policy.gate.flat) {
        let _ = writeln!(
            text,
            "{:<10} {:>6.1} % {:>8.1} % {:>5.1} %   {:.1} %",
            score.family.to_string(),
            100.0 * score.success(),
            100.0 * score.collision(),
            100.0 * score.spin,
            100.0 * flat.success()
        );
    }
    if policy.gate.is_passed() {
        let _ = writeln!(text, "\ngate passed; export it with: trainer export --run {}", folder.display());
    }
    text.trim_end().to_owned()
}
