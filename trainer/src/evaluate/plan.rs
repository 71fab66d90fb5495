//! What will be driven, checked; kept beside the rows, so that `--resume` goes on with the same and nothing else.

use anyhow::{Context, Result, bail, ensure};
use nav_core::task::{ShieldMode, Task};
use nav_env::limits::Limits;
use nav_env::other_lidar::OtherLidar;
use nav_env::robot_profile::RobotProfile;
use nav_env::rows::{EpisodeRow, Labels, RowFile};
use nav_env::worlds::Scene;
use nav_host::files::check_writable;
use nav_sim::disturbance::{Disturbance, DisturbanceName};
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

use super::policies::{Learned, NamedPolicy, PolicyArg};
use super::scenes::{Scenes, USUAL};
use crate::cli::EvaluateArgs;

/// Name of the rows in the folder.
pub const ROWS: &str = "episodes.csv";
/// Name of the table.
pub const TABLE: &str = "table.txt";
/// Name of the figures.
pub const SUMMARY: &str = "summary.json";
const PLAN: &str = "plan.json";

/// What will be driven.
#[derive(Debug)]
pub struct Plan {
    /// What drives.
    pub policies: Vec<NamedPolicy>,
    /// Where.
    pub scenes: Scenes,
    /// The robot.
    pub task: Task,
    /// How it differs from a perfect one.
    pub disturbance: DisturbanceName,
    /// How its episodes end.
    pub limits: Limits,
    /// Its lidar, where it is not the trained one.
    pub lidar: Option<OtherLidar>,
    /// The safety gate, where it is not to be as each policy's task says.
    pub shield: Option<ShieldMode>,
    /// Episodes of each policy and family in the pictures.
    pub pictures: usize,
    /// Where everything goes.
    pub out: PathBuf,
}

/// The rows so far, and the file that takes more.
#[derive(Debug)]
pub struct Episodes {
    /// Those that are on the disk.
    pub rows: Vec<EpisodeRow>,
    /// Where they are.
    pub file: RowFile,
}

/// What the rows follow from; other figures than these come from another plan.
#[derive(Serialize)]
struct Kept<'a> {
    commit: String,
    policies: Vec<KeptPolicy<'a>>,
    scenes: &'a Scenes,
    task: &'a Task,
    disturbance: DisturbanceName,
    disturbance_ranges: Disturbance,
    limits: Limits,
    lidar: Option<OtherLidar>,
    shield: Option<ShieldMode>,
}

#[derive(Serialize)]
struct KeptPolicy<'a> {
    label: &'a str,
    run: &'a str,
    learned: Option<&'a Learned>,
}

impl Plan {
    /// Checks everything that can be wrong before anything is driven or written.
    ///
    /// # Errors
    /// The first thing that makes no sense.
    pub fn check(args: &EvaluateArgs) -> Result<Self> {
        let limits = Limits { time_limit_s: args.time_limit, goal_radius_m: args.goal_radius };
        limits.validate().map_err(anyhow::Error::msg)?;
        let no_families = args.families.is_empty() && args.world_files.is_none();
        let families = if no_families { USUAL.to_vec() } else { args.families.clone() };
        refuse_twice("--families", &families)?;
        let wanted =
            if args.policies.is_empty() { PolicyArg::usual(&args.model) } else { args.policies.clone() };
        let labels: Vec<_> = wanted.iter().map(|policy| &policy.label).collect();
        refuse_twice("--policy", &labels)?;
        let policies: Vec<NamedPolicy> = wanted
            .iter()
            .map(|arg| NamedPolicy::read(arg).with_context(|| format!("the policy {}", arg.label)))
            .collect::<Result<_>>()?;
        if let Some(told) = policies.iter().find(|policy| policy.is_informed()) {
            ensure!(
                args.shield != Some(ShieldMode::Off),
                "the policy {}: without the safety gate there is nobody to tell who moves: leave out --shield off",
                told.label
            );
        }
        let robot = args.robot.as_deref().map(RobotProfile::read).transpose()?;
        let task = shared_task(&policies, &limits, robot.as_ref())?;
        let folder = args.world_files.as_deref();
        let scenes = Scenes::read(&families, args.split, args.worlds, folder, &task.robot.footprint)?;
        Ok(Self {
            policies,
            scenes,
            task,
            disturbance: args.disturbance,
            limits,
            lidar: args.lidar,
            shield: args.shield,
            pictures: args.pictures.into(),
            out: args.out.clone(),
        })
    }

    /// How many rows it will have.
    pub fn row_count(&self) -> usize {
        self.scenes.len() * self.policies.len()
    }

    /// World and policy of a row.
    pub fn of_row(&self, row: usize) -> (usize, &NamedPolicy) {
        (row / self.policies.len(), &self.policies[row % self.policies.len()])
    }

    /// The labels of a policy's row in a scene.
    pub fn labels<'a>(&self, policy: &'a NamedPolicy, scene: &'a Scene, world_seed: u64) -> Labels<'a> {
        Labels {
            policy: &policy.label,
            training_seed: policy.learned.as_ref().map(|learned| learned.training_seed),
            run: &policy.run,
            scene,
            world_seed,
            disturbance: self.disturbance,
            lidar: self.lidar,
            shield: Some(self.shield_of(policy)),
        }
    }

    /// The safety gate of a policy.
    pub fn shield_of(&self, policy: &NamedPolicy) -> ShieldMode {
        let learned = policy.learned.as_ref().filter(|learned| !learned.is_informed);
        self.shield.unwrap_or(learned.map_or(ShieldMode::On, |learned| learned.task.shield))
    }

    /// The picture files of a policy.
    pub fn pictures_of(&self, policy: &NamedPolicy) -> [PathBuf; 2] {
        ["svg", "png"].map(|extension| self.out.join(format!("{}.{extension}", policy.label)))
    }

    /// Makes sure that everything can be written, and opens the rows: those of an interrupted evaluation, or none.
    ///
    /// # Errors
    /// A folder that cannot be written, or that holds something else than what is asked for.
    pub fn open(&self, resume: bool) -> Result<Episodes> {
        let out = self.out.display();
        let reports = [PLAN, ROWS, TABLE, SUMMARY].map(|name| self.out.join(name));
        let pictures = self.policies.iter().flat_map(|policy| self.pictures_of(policy));
        for path in reports.iter().cloned().chain(pictures) {
            check_writable(&path).with_context(|| format!("--out: {} cannot be written", path.display()))?;
        }
        let [plan, rows, table, summary] = reports;
        let kept = self.kept()?;
        if resume {
            let text = std::fs::read_to_string(&plan)
                .with_context(|| format!("{out} holds no evaluation to go on with: leave out --resume"))?;
            same(&text, &kept, &self.out)?;
            let (file, rows) = RowFile::resume(&rows)?;
            self.check_rows(&rows)?;
            return Ok(Episodes { rows, file });
        }
        ensure!(
            !rows.exists() || summary.exists(),
            "{out} holds an evaluation that was interrupted: go on with --resume, remove it, or choose another --out"
        );
        let file = RowFile::create(&rows)?;
        for old in [&table, &summary] {
            if old.exists() {
                std::fs::remove_file(old).with_context(|| format!("cannot replace {}", old.display()))?;
            }
        }
        super::report::write_text(&plan, &kept)?;
        Ok(Episodes { rows: Vec::new(), file })
    }

    /// What the rows follow from, as JSON.
    fn kept(&self) -> Result<String> {
        let policies = self.policies.iter().map(|policy| KeptPolicy {
            label: &policy.label,
            run: &policy.run,
            learned: policy.learned.as_ref(),
        });
        let kept = Kept {
            commit: crate::commit::commit(),
            policies: policies.collect(),
            scenes: &self.scenes,
            task: &self.task,
            disturbance: self.disturbance,
            disturbance_ranges: self.disturbance.disturbance(&self.task.robot),
            limits: self.limits,
            lidar: self.lidar,
            shield: self.shield,
        };
        Ok(serde_json::to_string_pretty(&kept)? + "\n")
    }

    fn check_rows(&self, rows: &[EpisodeRow]) -> Result<()> {
        ensure!(rows.len() <= self.row_count(), "{}/{ROWS} has more rows than the plan", self.out.display());
        for (index, row) in rows.iter().enumerate() {
            let (world, policy) = self.of_row(index);
            let (scene, seed) = self.scenes.scene(world);
            ensure!(
                row.is_of(&self.labels(policy, &scene, seed)),
                "row {} of {}/{ROWS} is of another evaluation: choose another --out",
                index + 1,
                self.out.display()
            );
        }
        Ok(())
    }
}

/// An entry that counts twice would make intervals narrower than they are.
fn refuse_twice<T: PartialEq>(flag: &str, entries: &[T]) -> Result<()> {
    let is_twice = entries.iter().enumerate().any(|(index, entry)| entries[..index].contains(entry));
    ensure!(!is_twice, "{flag} names something twice");
    Ok(())
}

/// The robot that all policies drive: rivals drive any.
fn shared_task(policies: &[NamedPolicy], limits: &Limits, robot: Option<&RobotProfile>) -> Result<Task> {
    let mut tasks = policies.iter().filter_map(|policy| Some((policy, policy.learned.as_ref()?.task)));
    let Some((first, task)) = tasks.next() else {
        return Ok(robot.map_or_else(Task::default, RobotProfile::task));
    };
    if let Some(difference) = robot.and_then(|robot| robot.difference(&task)) {
        bail!(
            "{} was trained for another robot than --robot says ({difference}): leave out --robot, or name rivals only, as \
             in --policy astar",
            first.label
        );
    }
    // What a limit replaces, and what a policy decides by itself, need not be shared.
    let world = |of: Task| Task {
        decision: task.decision,
        shield: task.shield,
        episode_s: limits.time_limit_s.unwrap_or(of.episode_s),
        goal_radius_m: limits.goal_radius_m.unwrap_or(of.goal_radius_m),
        ..of
    };
    for (policy, other) in tasks {
        ensure!(
            world(other) == world(task),
            "{} was trained for another robot, lidar or episode than {}: they cannot share worlds",
            policy.label,
            first.label
        );
    }
    Ok(task)
}

/// Whether an interrupted evaluation is the one that is asked for; else the first thing that differs.
fn same(old: &str, new: &str, out: &Path) -> Result<()> {
    let parse = |text: &str| serde_json::from_str::<serde_json::Map<String, Value>>(text);
    let (old, new) = (parse(old).unwrap_or_default(), parse(new)?);
    if let Some(name) = new.keys().find(|name| old.get(*name) != new.get(*name)) {
        bail!(
            "{} holds an evaluation with other {name}: repeat its command with --resume, or choose another --out",
            out.display()
        );
    }
    Ok(())
}
