//! One run: a robot with a seed through trainer, export, check and evaluation; or, without a seed, what A* on the known map
//! makes of its worlds.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};

use super::FAMILIES;
use super::outcome::{DONE, Outcome, scores};
use crate::runs::{Programs, said, write_whole};
use crate::shell::{remove_folder, say};
use crate::training::short;

/// What all runs share.
pub(super) struct Setting {
    /// Folder of the built programs.
    pub programs: PathBuf,
    /// A configuration on top of each robot's.
    pub config: Option<PathBuf>,
    /// Where runs are kept.
    pub work: PathBuf,
    /// Test worlds a family.
    pub worlds: u32,
}

/// A robot and a training seed; none for A*.
#[derive(Clone)]
pub(super) struct Job {
    /// Its profile.
    pub robot: String,
    /// The seed.
    pub seed: Option<u64>,
}

impl Job {
    /// Where all of it lies.
    pub(super) fn folder(&self, setting: &Setting) -> PathBuf {
        setting.work.join(match self.seed {
            Some(seed) => format!("{}-seed{seed}", self.robot),
            None => format!("{}-astar", self.robot),
        })
    }

    /// Does what is not done yet.
    ///
    /// # Errors
    /// A program that fails otherwise than by missing the gate.
    pub(super) fn run(&self, setting: &Setting) -> Result<()> {
        let folder = self.folder(setting);
        let name = short(&folder);
        if Outcome::read(&folder)?.is_some() {
            say(&format!("{name}: done before"));
            return Ok(());
        }
        fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
        let started = Instant::now();
        let steps = Steps { robot: &self.robot, setting, folder: &folder };
        let outcome = match self.seed {
            Some(seed) => steps.learned(seed),
            None => steps.astar(),
        };
        let outcome = outcome.with_context(|| format!("the run {name}"))?;
        outcome.write(&folder)?;
        let seconds = started.elapsed().as_secs();
        let how =
            outcome.missed.as_ref().map_or_else(String::new, |missed| format!("; not passed: {missed}"));
        say(&format!("{name}: done in {} min {:02} s{how}", seconds / 60, seconds % 60));
        Ok(())
    }
}

/// The steps of a run, each of which is skipped if its result is there.
struct Steps<'a> {
    robot: &'a str,
    setting: &'a Setting,
    folder: &'a Path,
}

impl Steps<'_> {
    fn learned(&self, seed: u64) -> Result<Outcome> {
        let (run, model) = (self.folder.join("run"), self.folder.join("model"));
        self.train(seed, &run)?;
        if let Ok(reason) = fs::read_to_string(run.join("failed.txt")) {
            return Ok(Outcome { missed: Some(reason.trim().to_owned()), ..Outcome::default() });
        }
        let missed = self.export(&run, &model)?;
        let policy = if missed.is_none() { &model } else { &run };
        if missed.is_none() {
            let mut check = self.programs().program("runtime");
            check.arg("check").arg("--model").arg(&model);
            self.programs().must(check, "check", || {})?;
        }
        let policy = short(policy);
        let hybrid = format!("hybrid={policy}");
        let td3 = format!("td3=flat:{policy}");
        let scores = self.evaluate(&["--policy", &hybrid, "--policy", &td3])?;
        let picture = self.folder.join("picture");
        let mut draw = self.programs().program("trainer");
        draw.args(["evaluate", "--policy", &hybrid, "--families", "maze", "--worlds", "1"])
            .args(["--threads", "1", "--pictures", "1", "--out"])
            .arg(&picture);
        remove_folder(&picture)?;
        self.programs().must(draw, "picture", || {})?;
        let log = fs::read_to_string(self.programs().log("train")).unwrap_or_default();
        let seconds = said(&log, "trained in ", " s").and_then(|seconds| seconds.parse().ok());
        Ok(Outcome { missed, seconds, scores })
    }

    fn astar(&self) -> Result<Outcome> {
        let scores = self.evaluate(&["--robot", self.robot, "--policy", "astar"])?;
        Ok(Outcome { scores, ..Outcome::default() })
    }

    /// Trains, or goes on where it was.
    fn train(&self, seed: u64, run: &Path) -> Result<()> {
        let begin = |train: &mut Command| {
            train.args(["--robot", self.robot, "--seed", &seed.to_string(), "--attempts", "1"]);
            train.args(self.setting.config.iter().flat_map(|file| ["--config".as_ref(), file.as_os_str()]));
        };
        say(&format!("{}: training", short(self.folder)));
        self.programs().train(run, begin, || {})
    }

    /// What was missed, if the gate was.
    fn export(&self, run: &Path, model: &Path) -> Result<Option<String>> {
        let mut export = self.programs().program("trainer");
        export.arg("export").arg("--run").arg(run).arg("--out").arg(model);
        let (process, status) = self.programs().end_of(export, "export", || {})?;
        let log = fs::read_to_string(self.programs().log("export")).unwrap_or_default();
        match said(&log, "the gate was not passed, so that it cannot be exported: ", "; `trainer train") {
            Some(missed) if !status.success() => Ok(Some(missed.to_owned())),
            _ => process.require_success(status).map(|()| None),
        }
    }

    fn evaluate(&self, policies: &[&str]) -> Result<Vec<super::outcome::Score>> {
        let out = self.folder.join("evaluate");
        let arguments = |evaluate: &mut Command| {
            evaluate
                .arg("evaluate")
                .args(policies)
                .args(["--split", "test", "--families", &FAMILIES.join(",")])
                .args(["--worlds", &self.setting.worlds.to_string(), "--disturbance", "usual"])
                .args(["--threads", "1", "--pictures", "0"]);
        };
        self.programs().evaluate(&out, arguments, "evaluate", || {})?;
        scores(&out.join("summary.json"))
    }

    fn programs(&self) -> Programs<'_> {
        Programs { folder: &self.setting.programs, logs: self.folder }
    }
}

impl Outcome {
    /// That of a run that has ended before.
    fn read(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(DONE);
        if !path.is_file() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).with_context(|| format!("could not read {}", path.display()))?;
        Self::parse(&text)
            .map(Some)
            .with_context(|| format!("{}: remove it to do the run again", path.display()))
    }

    /// That of a run that has ended.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn of(folder: &Path) -> Result<Self> {
        Self::read(folder)?.with_context(|| format!("{} has not ended", folder.display()))
    }

    /// Whole, or not at all.
    fn write(&self, folder: &Path) -> Result<()> {
        write_whole(&folder.join(DONE), &self.to_json())
    }
}
