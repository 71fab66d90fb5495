//! The folder of results: tables, rows, and of each robot a model card and a picture.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use super::FAMILIES;
use super::job::{Job, Setting};
use super::outcome::{Outcome, Score};
use crate::shell::{have, run_quiet};

/// What came of all runs of a robot: each seed with its outcome, and A*.
struct Robot<'a> {
    name: &'a str,
    runs: Vec<(&'a Job, u64, Outcome)>,
    astar: Outcome,
}

/// Writes everything.
///
/// # Errors
/// A run that has not ended, or files that cannot be written.
pub(super) fn write(setting: &Setting, robots: &[String], jobs: &[Job], out: &Path) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("could not create {}", out.display()))?;
    let mut all = Vec::new();
    for name in robots {
        let mut robot = Robot { name, runs: Vec::new(), astar: Outcome::default() };
        for job in jobs.iter().filter(|job| job.robot == *name) {
            let outcome = Outcome::of(&job.folder(setting))?;
            match job.seed {
                Some(seed) => robot.runs.push((job, seed, outcome)),
                None => robot.astar = outcome,
            }
        }
        robot.copy(setting, jobs, out)?;
        all.push(robot);
    }
    let write = |name: &str, text: String| {
        fs::write(out.join(name), text)
            .with_context(|| format!("could not write {name} in {}", out.display()))
    };
    write("runs.csv", rows(&all))?;
    write("README.md", page(&all, setting.worlds))
}

impl Robot<'_> {
    /// Its episodes, and the card and picture of the first seed that passed.
    fn copy(&self, setting: &Setting, jobs: &[Job], out: &Path) -> Result<()> {
        let mut rows = String::new();
        for job in jobs.iter().filter(|job| job.robot == self.name) {
            let path = job.folder(setting).join("evaluate/episodes.csv");
            // A run that was stopped for good drove nowhere.
            let Ok(text) = fs::read_to_string(&path) else { continue };
            let (head, body) = text.split_once('\n').unwrap_or_default();
            if rows.is_empty() {
                let _ = writeln!(rows, "{head}");
            }
            rows.push_str(body);
        }
        let path = out.join(format!("{}.csv", self.name));
        fs::write(&path, rows).with_context(|| format!("could not write {}", path.display()))?;
        if have("gzip", &["--version"]) {
            let mut gzip = Command::new("gzip");
            run_quiet(gzip.args(["-9", "-n", "-f"]).arg(&path), "gzip", |_| {})?;
        }
        let passed = self.runs.iter().find(|(_, _, outcome)| outcome.missed.is_none());
        let Some((job, _, _)) = passed else { return Ok(()) };
        let folder = job.folder(setting);
        for (from, to) in [("model/README.md", "md"), ("picture/hybrid.svg", "svg")] {
            let (from, to) = (folder.join(from), out.join(format!("{}.{to}", self.name)));
            fs::copy(&from, &to)
                .with_context(|| format!("could not copy {} to {}", from.display(), to.display()))?;
        }
        Ok(())
    }

    /// A rate of a policy in a family over all seeds that drove: the mean, and the worst where they differ. None if none
    /// drove.
    fn cell(
        &self,
        policy: &str,
        family: &str,
        rate: fn(&Score) -> f64,
        worst: fn(f64, f64) -> f64,
    ) -> String {
        let outcomes = self.runs.iter().map(|(_, _, outcome)| outcome).chain([&self.astar]);
        let rates: Vec<f64> = outcomes
            .filter_map(|outcome| outcome.score(policy, family))
            .map(|score| 100.0 * rate(score))
            .collect();
        let Some(first) = rates.first() else { return "-".to_owned() };
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        if rates.iter().all(|rate| (rate - first).abs() < 1e-9) {
            return format!("{mean:.1}");
        }
        format!("{mean:.1} ({:.1})", rates.iter().copied().fold(*first, worst))
    }

    fn passed(&self) -> usize {
        self.runs.iter().filter(|(_, _, outcome)| outcome.missed.is_none()).count()
    }

    fn longest_s(&self) -> Option<f64> {
        self.runs.iter().filter_map(|(_, _, outcome)| outcome.seconds).reduce(f64::max)
    }
}

/// A row a run.
fn rows(robots: &[Robot<'_>]) -> String {
    let mut text = "robot,seed,passed,seconds,policy,family,success,collision,missed\n".to_owned();
    for robot in robots {
        let astar = (!robot.astar.scores.is_empty()).then_some((None, &robot.astar));
        let runs = robot.runs.iter().map(|(_, seed, outcome)| (Some(*seed), outcome)).chain(astar);
        for (seed, outcome) in runs {
            let seed = seed.map_or_else(String::new, |seed| seed.to_string());
            let seconds = outcome.seconds.map_or_else(String::new, |seconds| format!("{seconds:.0}"));
            let missed = outcome.missed.as_deref().unwrap_or_default().replace('"', "'");
            let passed = if seed.is_empty() { String::new() } else { outcome.missed.is_none().to_string() };
            let lead = format!("{},{seed},{passed},{seconds}", robot.name);
            for Score { policy, family, success, collision } in &outcome.scores {
                let _ = writeln!(text, "{lead},{policy},{family},{success:.4},{collision:.4},\"{missed}\"");
            }
            if outcome.scores.is_empty() {
                let _ = writeln!(text, "{lead},,,,,\"{missed}\"");
            }
        }
    }
    text
}

/// The page.
fn page(robots: &[Robot<'_>], worlds: u32) -> String {
    let mut text = format!(
        "# Every robot with a profile\n\n\
         Written by `cargo xtask robots`: each robot of [robots](../../robots) trained with `trainer train --robot NAME --seed N \
         --attempts 1`, two runs side by side, one a core; then {worlds} test worlds a family in the size of the robot, which \
         training never saw, with the usual disturbances, the localiser and the safety gate. A* knows the map. Mean over the \
         seeds, and the worst of them in brackets. Rows of all runs are in `runs.csv`, of all episodes in `NAME.csv.gz`; card \
         and picture (`NAME.md`, `NAME.svg`) are those of the first seed that passed its gate.\n\n\
         | robot | gate passed | longest run |\n|---|---|---|\n"
    );
    for robot in robots {
        let longest = robot.longest_s().map_or_else(|| "-".to_owned(), |seconds| format!("{seconds:.0} s"));
        let _ = writeln!(text, "| {} | {} of {} | {longest} |", robot.name, robot.passed(), robot.runs.len());
    }
    type Rate = (&'static str, fn(&Score) -> f64, fn(f64, f64) -> f64);
    let rates: [Rate; 2] =
        [("Success", |score| score.success, f64::min), ("Collisions", |score| score.collision, f64::max)];
    for (title, rate, worst) in rates {
        let _ = write!(text, "\n## {title}, %\n\n| robot | policy | {} |\n", FAMILIES.join(" | "));
        let _ = writeln!(text, "|---|---|{}", "---|".repeat(FAMILIES.len()));
        for robot in robots {
            for (policy, called) in
                [("hybrid", "hybrid"), ("td3", "its TD3 straight at the goal"), ("astar", "A*")]
            {
                let cells = FAMILIES.map(|family| robot.cell(policy, family, rate, worst));
                let _ = writeln!(text, "| {} | {called} | {} |", robot.name, cells.join(" | "));
            }
        }
    }
    let missed: Vec<_> = robots
        .iter()
        .flat_map(|robot| robot.runs.iter().map(move |run| (robot.name, run)))
        .filter_map(|(name, (_, seed, outcome))| Some((name, seed, outcome.missed.as_ref()?)))
        .collect();
    if !missed.is_empty() {
        text.push_str("\n## Runs that did not pass\n\n");
        for (name, seed, missed) in missed {
            let _ = writeln!(text, "- {name}, seed {seed}: {missed}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_hold_means_and_the_worst_seed_and_say_what_was_missed() {
        let score = |policy: &str, success, collision| Score {
            policy: policy.to_owned(),
            family: "maze".to_owned(),
            success,
            collision,
        };
        let job = Job { robot: "agv".to_owned(), seed: None };
        let run = |missed: Option<&str>, seconds, success| Outcome {
            missed: missed.map(str::to_owned),
            seconds: Some(seconds),
            scores: vec![score("hybrid", success, 0.02), score("td3", 0.5, 0.1)],
        };
        let robot = Robot {
            name: "agv",
            runs: vec![
                (&job, 1, run(None, 301.0, 0.98)),
                (&job, 2, run(Some("spin is \"8 %\""), 340.0, 0.9)),
                (&job, 3, Outcome { missed: Some("collapsed".to_owned()), ..Outcome::default() }),
            ],
            astar: Outcome { scores: vec![score("astar", 1.0, 0.0)], ..Outcome::default() },
        };
        let page = page(&[robot], 7);
        for part in [
            "then 7 test worlds",
            "| agv | 1 of 3 | 340 s |",
            "| agv | hybrid | - | - | - | 94.0 (90.0) |",
            "| agv | its TD3 straight at the goal | - | - | - | 50.0 |",
            "| agv | A* | - | - | - | 100.0 |",
            "| agv | hybrid | - | - | - | 2.0 |",
            "- agv, seed 2: spin is \"8 %\"\n- agv, seed 3: collapsed\n",
        ] {
            assert!(page.contains(part), "{part}:\n{page}");
        }
    }

    #[test]
    fn a_row_a_run_policy_and_family() {
        let job = Job { robot: "agv".to_owned(), seed: Some(3) };
        let score =
            Score { policy: "hybrid".to_owned(), family: "maze".to_owned(), success: 0.98, collision: 0.02 };
        let done = Outcome { missed: None, seconds: Some(301.4), scores: vec![score.clone()] };
        let failed = Outcome { missed: Some("a \"b\", c".to_owned()), ..Outcome::default() };
        let astar =
            Outcome { scores: vec![Score { policy: "astar".to_owned(), ..score }], ..Outcome::default() };
        let robot = Robot { name: "agv", runs: vec![(&job, 3, done), (&job, 4, failed)], astar };
        assert_eq!(
            rows(&[robot]),
            "robot,seed,passed,seconds,policy,family,success,collision,missed\n\
             agv,3,true,301,hybrid,maze,0.9800,0.0200,\"\"\n\
             agv,4,false,,,,,,\"a 'b', c\"\n\
             agv,,,,astar,maze,0.9800,0.0200,\"\"\n"
        );
    }
}
