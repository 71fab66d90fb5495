//! What is done by one lane without a break: a training run with everything that is driven with what it left, or a classical
//! method.
//!
//! | in a folder `METHOD/seed-N` of `--work` | |
//! |---|---|
//! | `begun.json` | recipe, commit and machine that the run began with |
//! | what `trainer train` leaves | among it `curve.csv` and `scalars.csv` |
//! | `trained.json` | what came of it, once it has ended |
//! | `off/`, `on/` | what `trainer evaluate` leaves with this gate |
//! | `off.json`, `on.json` | what was driven there, by which commit |
//! | `*.log` | what programs said |

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use study::jobs::TrainingRun;
use study::plan::{Source, Study};
use study::provenance::Provenance;
use study::rows::{Gate, Outcome, RunRow};

use super::board::{Board, Cell};
use super::results::Results;
use crate::runs::{Programs, said, write_whole};
use crate::shell::remove_folder;
use crate::training::short;

/// What all units share.
pub(super) struct Setting<'a> {
    /// What is studied.
    pub study: &'a Study,
    /// Folder of the built programs.
    pub programs: &'a Path,
    /// Where runs are kept.
    pub work: &'a Path,
    /// Where rows go.
    pub results: &'a Results<'a>,
    /// Where it is told.
    pub board: &'a Board,
    /// Of this process.
    pub provenance: &'a Provenance,
}

/// What one lane does without a break.
pub(super) struct Unit {
    /// The run, where something is trained.
    pub training: Option<TrainingRun>,
    /// The methods (indices) that are driven with it: itself, its low level alone; or a classical one.
    pub driven: Vec<usize>,
}

/// Every unit of the methods that are wanted: whole seeds first, classical methods last.
pub(super) fn units(study: &Study, is_wanted: impl Fn(usize) -> bool) -> Vec<Unit> {
    let methods = || 0..study.methods.len();
    let learned = study.training_runs().into_iter().map(|run| {
        let is_of_run = |method: &usize| {
            let entry = &study.methods[*method];
            let is_low = entry.source == Source::LowLevelOf(run.method) && entry.seeds.contains(&run.seed);
            (*method == run.method || is_low) && is_wanted(*method)
        };
        let driven = methods().filter(is_of_run).collect();
        Unit { training: Some(run), driven }
    });
    let rivals = methods().filter(|&method| !study.methods[method].is_learned() && is_wanted(method));
    let rivals = rivals.map(|method| Unit { training: None, driven: vec![method] });
    learned.chain(rivals).filter(|unit| !unit.driven.is_empty()).collect()
}

impl Unit {
    /// The training seed; none of a classical method.
    pub(super) fn seed(&self) -> Option<u64> {
        self.training.as_ref().map(|run| run.seed)
    }

    /// Trains and drives what is not done yet.
    ///
    /// # Errors
    /// A program that fails, or a run that was begun with another recipe.
    pub(super) fn run(&self, setting: &Setting<'_>) -> Result<()> {
        let trained = self.training.as_ref().map(|run| self.train(setting, run)).transpose()?;
        for &method in &self.driven {
            for &gate in &setting.study.gates {
                self.drive(setting, method, gate, trained.as_ref())?;
            }
            let cell = match &trained {
                Some(run) if run.outcome == Outcome::Failed => Cell::Failed,
                Some(run) => Cell::Done { train_s: run.train_s, is_missed: run.outcome == Outcome::Missed },
                None => Cell::Done { train_s: None, is_missed: false },
            };
            self.tell(setting, method, cell);
        }
        Ok(())
    }

    /// Tells how far a method is.
    pub(super) fn tell(&self, setting: &Setting<'_>, method: usize, cell: Cell) {
        setting.board.set(&setting.study.methods[method].name, self.seed(), cell);
    }

    fn train(&self, setting: &Setting<'_>, run: &TrainingRun) -> Result<RunRow> {
        let folder = setting.work.join(&run.folder);
        fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
        let begun = begun(setting, run, &folder)?;
        let kept = folder.join("trained.json");
        if let Ok(text) = fs::read_to_string(&kept) {
            let row = serde_json::from_str(&text);
            let row = row.with_context(|| format!("{}: remove it, and it is made anew", kept.display()))?;
            setting.results.keep_run(run, &folder)?;
            return Ok(row);
        }
        let programs = Programs { folder: setting.programs, logs: &folder };
        let alive = || {
            let percent = percent(last_step(&folder), setting.study.env_steps);
            self.driven
                .iter()
                .take(1)
                .for_each(|&method| self.tell(setting, method, Cell::Training(percent)));
        };
        alive();
        let begin = |train: &mut Command| {
            train.args(run.arguments.iter().skip(1));
        };
        programs.train(&folder, begin, alive)?;
        let row = outcome(setting, run, &folder, &begun)?;
        write_whole(&kept, &serde_json::to_string_pretty(&row)?)?;
        setting.results.keep_run(run, &folder)?;
        Ok(row)
    }

    fn drive(
        &self,
        setting: &Setting<'_>,
        method: usize,
        gate: Gate,
        trained: Option<&RunRow>,
    ) -> Result<()> {
        let own = setting.study.folder(method, self.seed());
        if let (Some(run), Some(Outcome::Failed)) = (&self.training, trained.map(|run| run.outcome)) {
            return setting.results.keep_no_policy(method, run.seed, gate);
        }
        let folder = setting.work.join(own);
        fs::create_dir_all(&folder).with_context(|| format!("could not create {}", folder.display()))?;
        let out = folder.join(gate.word());
        let arguments = setting.study.evaluate_arguments(method, self.seed(), gate, setting.work);
        let policy = self.training.as_ref().map(|run| setting.work.join(&run.folder).join("policy.bin"));
        prepare(setting, &folder.join(format!("{}.json", gate.word())), &out, &arguments, policy.as_deref())?;
        let gates = &setting.study.gates;
        let (before, all) = (gates.iter().position(|other| *other == gate).unwrap_or(0), gates.len());
        let worlds = setting.study.worlds * setting.study.families.len() as u64;
        let alive = || {
            let driven = rows(&out.join("episodes.csv")) + before as u64 * worlds;
            self.tell(setting, method, Cell::Evaluating(percent(driven, worlds * all as u64)));
        };
        alive();
        let told = |evaluate: &mut Command| {
            evaluate.args(&arguments).args(["--threads", "1"]);
        };
        Programs { folder: setting.programs, logs: &folder }.evaluate(&out, told, gate.word(), alive)?;
        setting.results.keep_rows(method, self.seed(), gate, &out.join("episodes.csv"))
    }
}

/// What a run began with; kept before it begins, and the same ever after.
fn begun(setting: &Setting<'_>, run: &TrainingRun, folder: &Path) -> Result<Value> {
    let path = folder.join("begun.json");
    let recipe = run.recipe().context("the configuration of a method")?;
    if let Ok(text) = fs::read_to_string(&path) {
        let begun: Value = serde_json::from_str(&text).unwrap_or_default();
        ensure!(
            begun["recipe"] == recipe.as_str(),
            "{} was begun with another configuration than the study names now: remove that folder, or name another --work",
            short(folder)
        );
        return Ok(begun);
    }
    let Provenance { commit, machine, .. } = setting.provenance;
    let begun = json!({ "recipe": recipe, "commit": commit, "machine": machine });
    write_whole(&path, &format!("{begun:#}"))?;
    Ok(begun)
}

/// What came of a run that has ended.
fn outcome(setting: &Setting<'_>, run: &TrainingRun, folder: &Path, begun: &Value) -> Result<RunRow> {
    let text = |name: &str| begun[name].as_str().map(str::to_owned);
    let words = run.arguments.iter().map(|word| short(Path::new(word)));
    let mut row = RunRow {
        method: setting.study.methods[run.method].name.clone(),
        training_seed: run.seed,
        outcome: Outcome::Passed,
        train_s: None,
        env_steps: None,
        updates: None,
        commit: text("commit"),
        machine: text("machine"),
        command: Some(format!("trainer {}", words.collect::<Vec<_>>().join(" "))),
        note: None,
    };
    if let Ok(reason) = fs::read_to_string(folder.join("failed.txt")) {
        row.outcome = Outcome::Failed;
        row.env_steps = Some(last_step(folder));
        row.note = Some(reason.trim().to_owned());
        return Ok(row);
    }
    let programs = Programs { folder: setting.programs, logs: folder };
    let mut log = fs::read_to_string(programs.log("train")).unwrap_or_default();
    if !log.contains("trained in ") {
        // It was brought to its end by hand. To judge it again gives the same verdict.
        let mut gate = programs.program("trainer");
        gate.arg("gate").arg(folder);
        programs.end_of(gate, "gate", || {})?;
        log = fs::read_to_string(programs.log("gate")).unwrap_or_default();
    }
    let between = |before: &str, after: &str| said(&log, before, after);
    row.train_s = between("trained in ", " s").and_then(|text| text.parse().ok());
    row.env_steps = between(" s: ", " steps").and_then(|text| text.parse().ok());
    row.updates = between(" steps, ", " updates").and_then(|text| text.parse().ok());
    if let Some(missed) = between("so that it cannot be exported: ", "; `trainer train") {
        row.outcome = Outcome::Missed;
        row.note = Some(missed.to_owned());
    } else if !log.contains("gate passed") {
        bail!("{} says nothing of the gate: how the run ended is not known", short(&programs.log("train")));
    }
    Ok(row)
}

/// Makes sure that a folder holds nothing but what is asked for: worlds and policy are the same, and an evaluation goes on only
/// with the program that began it.
fn prepare(
    setting: &Setting<'_>,
    kept: &Path,
    out: &Path,
    arguments: &[OsString],
    policy: Option<&Path>,
) -> Result<()> {
    let bytes = policy.map(fs::read).transpose().context("the policy that a run left cannot be read")?;
    let sha256 =
        bytes.map(|bytes| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>());
    let arguments: Vec<_> = arguments.iter().map(|word| word.to_string_lossy()).collect();
    let asked =
        json!({ "arguments": arguments, "policy_sha256": sha256, "commit": setting.provenance.commit });
    let before = fs::read_to_string(kept).ok().and_then(|text| serde_json::from_str::<Value>(&text).ok());
    let is_over = out.join("summary.json").is_file();
    let is_same = before.is_some_and(|before| {
        let same = |name: &str| before[name] == asked[name];
        same("arguments") && same("policy_sha256") && (is_over || same("commit"))
    });
    if !is_same {
        remove_folder(out)?;
        write_whole(kept, &format!("{asked:#}"))?;
    }
    Ok(())
}

/// The newest step that a run has logged.
fn last_step(folder: &Path) -> u64 {
    let text = fs::read_to_string(folder.join("scalars.csv")).unwrap_or_default();
    text.lines().last().and_then(|line| line.split(',').next()?.parse().ok()).unwrap_or(0)
}

/// How many rows a table has.
fn rows(path: &PathBuf) -> u64 {
    let bytes = fs::read(path).unwrap_or_default();
    (bytes.iter().filter(|byte| **byte == b'\n').count() as u64).saturating_sub(1)
}

fn percent(done: u64, all: u64) -> u8 {
    u8::try_from(100 * done / all.max(1)).unwrap_or(u8::MAX).min(99)
}
