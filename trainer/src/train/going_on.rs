//! What may come after the end of a run: another attempt with another seed, in a folder beside it, or more steps.
//!
//! Both follow from the files of the folder alone, so that whoever resumes a run that was killed at any moment goes on
//! with the same. An attempt is due where the gate was missed narrowly and fewer were made than there may be; its folder
//! is named after the first's, `-attempt2` and so on. More steps are under way while `policy.bin` is moved away.

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::PathBuf;

use super::past::{Attempted, Attempts, Borrowed, More};
use super::policy::Policy;
use super::run_folder::RunFolder;
use crate::config::Config;

const ATTEMPTS: &str = "attempts.toml";
const MORE: &str = "more.toml";
const MORE_FAILED: &str = "more-failed.txt";
/// From the seed of an attempt to that of the next: far enough that nobody who tries seeds in a row tries one twice.
const SEEDS_AN_ATTEMPT: u64 = 1_000;

/// What `more.toml` holds.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MoreFile {
    more: Vec<More>,
}

/// Where a borrowed low level comes from.
///
/// # Errors
/// A configuration of another version.
pub(super) fn borrowed(policy: &Policy) -> Result<Borrowed> {
    // A low level that was borrowed there, too, comes from farther back.
    if let Some(borrowed) = &policy.past.borrowed {
        return Ok(borrowed.clone());
    }
    Ok(Borrowed {
        seed: policy.config()?.seed,
        commit: policy.commit.clone(),
        spent: policy.spent_in_all(),
        missed: policy.gate.sentences(),
    })
}

/// The configuration of the next attempt.
fn with_next_seed(config: &Config) -> Config {
    let next = config.seed.checked_add(SEEDS_AN_ATTEMPT).filter(|seed| i64::try_from(*seed).is_ok());
    Config { seed: next.unwrap_or(config.seed % SEEDS_AN_ATTEMPT), ..config.clone() }
}

impl RunFolder {
    pub(super) fn write_attempts(&self, attempts: &Attempts) -> Result<()> {
        if *attempts == Attempts::default() {
            return Ok(());
        }
        self.write_text(ATTEMPTS, &toml::to_string_pretty(attempts)?)
    }

    /// Which attempt of how many the run is.
    ///
    /// # Errors
    /// A file that was edited into nonsense.
    pub fn attempts(&self) -> Result<Attempts> {
        let path = self.path().join(ATTEMPTS);
        if !path.exists() {
            return Ok(Attempts::default());
        }
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        toml::from_str(&text).with_context(|| format!("{} is none of ours", path.display()))
    }

    /// The folder of the attempt after this one, whether or not it is there.
    fn next_attempt_path(&self) -> Result<PathBuf> {
        let number = self.attempts()?.number();
        let name = self.path().file_name().unwrap_or_default().to_string_lossy();
        let first = name.strip_suffix(&format!("-attempt{number}")).unwrap_or(&name);
        Ok(self.path().with_file_name(format!("{first}-attempt{}", number + 1)))
    }

    /// The last attempt that was begun: this one, or one after it.
    ///
    /// # Errors
    /// Files that were edited into nonsense.
    pub fn last_attempt(self) -> Result<Self> {
        let mut last = self;
        while last.attempts()?.number() < last.attempts()?.of {
            match Self::open(&last.next_attempt_path()?) {
                Ok(next) if next.attempts()?.number() == last.attempts()?.number() + 1 => last = next,
                _ => break,
            }
        }
        Ok(last)
    }

    /// The folder and the configuration of another attempt, if this one has finished and missed its gate narrowly, none
    /// was begun after it, and there may be one more. One that was judged anew or trained on needs none.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn due_attempt(&self) -> Result<Option<(PathBuf, Config, Attempts)>> {
        let mut attempts = self.attempts()?;
        if attempts.number() >= attempts.of || !self.is_finished() || self.failure().is_some() {
            return Ok(None);
        }
        let (path, policy) = (self.next_attempt_path()?, self.policy()?);
        let is_as_it_ended = policy.past.verdicts.is_empty() && policy.past.more.is_empty();
        if !policy.gate.is_missed_narrowly() || !is_as_it_ended || Self::open(&path).is_ok() {
            return Ok(None);
        }
        // What a borrowed low level missed, the same one misses above any seed.
        if policy.past.borrowed.is_some() && policy.gate.missed.iter().any(|miss| miss.is_of_low) {
            return Ok(None);
        }
        let (config, _) = self.config()?;
        let missed = policy.gate.sentences();
        attempts.earlier.push(Attempted { seed: config.seed, spent: policy.spent(), missed });
        Ok(Some((path, with_next_seed(&config), attempts)))
    }

    fn before_more_path(&self, number: usize) -> PathBuf {
        self.path().join(format!("policy-before-more-{number}.bin"))
    }

    /// How far the run was asked to go on, each time. What was written down before the policy was moved away, so that it
    /// never began, does not count.
    ///
    /// # Errors
    /// A file that was edited into nonsense.
    pub fn more(&self) -> Result<Vec<More>> {
        let path = self.path().join(MORE);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let MoreFile { mut more } =
            toml::from_str(&text).with_context(|| format!("{} is none of ours", path.display()))?;
        more.truncate((1..).take_while(|number| self.before_more_path(*number).exists()).count());
        Ok(more)
    }

    /// The policy that the run had before it went on the last time, if it did.
    ///
    /// # Errors
    /// A damaged file.
    pub(super) fn policy_before_more(&self) -> Result<Option<Policy>> {
        self.kept_policy(&self.before_more_path(self.more()?.len()))
    }

    /// Makes a finished run one that is to go on for so many environment steps, shared by its stages as those before.
    ///
    /// # Errors
    /// A run that has not finished or cannot go on, or too few steps.
    pub fn begin_more(&self, env_steps: u64) -> Result<()> {
        let path = self.path().display();
        ensure!(
            self.is_finished() || self.failure().is_some(),
            "{path} has not finished yet: `trainer train --resume {path}` goes on, and --more then trains it further"
        );
        let policy = self.policy()?;
        if let Some(reason) = self.reason(MORE_FAILED) {
            bail!("{path} was trained on before, and was stopped for good: {reason}");
        }
        let has_checkpoints =
            fs::read_dir(self.checkpoints()).is_ok_and(|mut entries| entries.next().is_some());
        ensure!(
            has_checkpoints,
            "{path} cannot go on: there is nothing in {}, where its learners were kept",
            self.checkpoints().display()
        );
        let (config, _) = self.config()?;
        let mut more = self.more()?;
        // Shares of the first end, so that each time is shared in the same way.
        let first = self.kept_policy(&self.before_more_path(1))?.unwrap_or_else(|| policy.clone());
        let share = env_steps as f64 / first.env_steps.max(1) as f64;
        let of = |budget: u64| (share * budget as f64).round() as u64;
        let asked = More {
            env_steps,
            low_steps: of(config.low.env_steps),
            high_decisions: of(config.high.decisions),
        };
        let trains_low = self.borrowed_low()?.is_none();
        // What refills the buffer, and as much again to learn from.
        let least =
            (2 * config.low.warmup_steps) as f64 * first.env_steps as f64 / config.low.env_steps as f64;
        ensure!(
            !trains_low || asked.low_steps >= 2 * config.low.warmup_steps,
            "--more {env_steps} is too little: the low level first fills its replay buffer again; at least {} are needed",
            least.ceil()
        );
        ensure!(asked.high_decisions > 0, "--more {env_steps} is too little: not one decision comes of it");
        more.push(asked);
        let number = more.len();
        self.write_text(MORE, &toml::to_string_pretty(&MoreFile { more })?)?;
        let to = self.before_more_path(number);
        fs::rename(self.policy_path(), &to)
            .and_then(|()| fs::File::open(self.path())?.sync_all())
            .with_context(|| format!("cannot move the policy to {}", to.display()))
    }

    /// Gives a run that cannot go on the policy back that it had; whether it was going on.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn take_more_back(&self, reason: &str) -> Result<bool> {
        let number = self.more()?.len();
        if number == 0 {
            return Ok(false);
        }
        self.write_text(MORE_FAILED, &format!("{reason}\n"))?;
        let from = self.before_more_path(number);
        fs::rename(&from, self.policy_path())
            .with_context(|| format!("cannot move the policy back from {}", from.display()))?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(attempts: &Attempts, name: &str, at: &std::path::Path) -> RunFolder {
        RunFolder::create(&at.join(name), &Config::default(), None, attempts).expect("a new run")
    }

    #[test]
    fn an_attempt_lies_beside_the_first_and_is_found_from_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        let first = run(&Attempts::first(3), "mine", at);
        assert_eq!(first.next_attempt_path().expect("a name"), at.join("mine-attempt2"));
        assert_eq!(first.clone().last_attempt().expect("itself").path(), first.path());
        let tried = Attempted { seed: 1, spent: Default::default(), missed: "reach".to_owned() };
        let second = run(&Attempts { of: 3, earlier: vec![tried.clone()] }, "mine-attempt2", at);
        assert_eq!(second.attempts().expect("written").earlier, std::slice::from_ref(&tried), "read back");
        assert_eq!(second.next_attempt_path().expect("a name"), at.join("mine-attempt3"));
        run(&Attempts { of: 3, earlier: vec![tried.clone(), tried] }, "mine-attempt3", at);
        assert_eq!(first.last_attempt().expect("found").path(), at.join("mine-attempt3"));
        let alone = run(&Attempts::default(), "alone", at);
        run(&Attempts::default(), "alone-attempt2", at);
        assert_eq!(alone.last_attempt().expect("itself").path(), at.join("alone"), "somebody's own name");
    }

    #[test]
    fn the_next_seed_is_another_and_within_what_toml_holds() {
        for (seed, next) in [(1, 1_001), (i64::MAX as u64, i64::MAX as u64 % 1_000)] {
            assert_eq!(with_next_seed(&Config { seed, ..Config::default() }).seed, next);
        }
    }

    /// Killed between the two steps: what was written down never began.
    #[test]
    fn more_counts_once_the_policy_is_moved_away() {
        let folder = tempfile::tempdir().expect("a folder");
        let run = run(&Attempts::default(), "run", folder.path());
        let asked = More { env_steps: 3, low_steps: 2, high_decisions: 1 };
        let text = toml::to_string_pretty(&MoreFile { more: vec![asked; 2] }).expect("plain numbers");
        run.write_text(MORE, &text).expect("written");
        for moved in 0..=2 {
            if moved > 0 {
                fs::write(run.before_more_path(moved), "a policy").expect("written");
            }
            assert_eq!(run.more().expect("ours"), vec![asked; moved]);
        }
    }
}
