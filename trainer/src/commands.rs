//! `trainer train` and `trainer export`: from arguments to a checked plan, from one attempt to the next.

pub mod gate;
pub mod robot;
mod words;

use anyhow::{Context, Result, bail, ensure};
use nav_core::manifest::Algorithm;
use nav_core::task::Task;
use nav_env::robot_profile::RobotProfile;
use nav_host::exit::Exit;
use nav_host::stop::{Second, Stop};
use nav_host::terminal::{debug, note, say, tell};
use std::fs::File;
use std::path::Path;

use crate::cli::{AlgorithmArg, ExportArgs, TrainArgs};
use crate::config::{Config, Profile, bounds};
use crate::export;
use crate::train::past::Attempts;
use crate::train::policy::Policy;
use crate::train::run::{End, Run};
use crate::train::run_folder::RunFolder;

/// Trains.
///
/// # Errors
/// A configuration that makes no sense, a folder that cannot be used, a learner that diverged or collapsed, or a gate
/// that was missed.
pub fn train(args: &TrainArgs) -> Result<Exit> {
    if args.print_config {
        say(bounds::commented(&plan(args)?.to_toml()).trim_end());
        return Ok(Exit::Done);
    }
    let stop = Stop::listen(Second::EndsAtOnce).context("signals cannot be taken over")?;
    crate::nn::init_torch();
    // The lock of an attempt is held until the next one has its own.
    let (mut folder, mut lock) = begin(args)?;
    loop {
        match train_once(&folder, stop.clone())? {
            Some(exit) => {
                drop(lock);
                return Ok(exit);
            }
            None => folder = next_attempt(&folder)?.context("no attempt is due: this is a defect")?,
        }
        lock = folder.lock()?;
    }
}

/// The folder to train in, locked.
fn begin(args: &TrainArgs) -> Result<(RunFolder, File)> {
    let Some(resume) = &args.resume else {
        let config = plan(args)?;
        let low = args.low.as_deref().map(|low| borrowed_low(low, &config)).transpose()?;
        let path = args.out.clone().unwrap_or_else(|| RunFolder::next_path(&config));
        let folder = RunFolder::create(&path, &config, low.as_ref(), &Attempts::first(args.attempts))?;
        let lock = folder.lock()?;
        return Ok((folder, lock));
    };
    let named = resume.as_deref().map(RunFolder::open).transpose()?;
    if let Some(env_steps) = args.more {
        let newest = || RunFolder::newest(RunFolder::is_finished, "finished");
        let folder = named.map_or_else(newest, Ok)?;
        let lock = folder.lock()?;
        folder.begin_more(env_steps)?;
        return Ok((folder, lock));
    }
    let newest = || RunFolder::newest(RunFolder::is_unfinished, "unfinished");
    let folder = named.map_or_else(newest, Ok)?.last_attempt()?;
    let lock = folder.lock()?;
    if let Some(next) = next_attempt(&folder)? {
        let lock = next.lock()?;
        return Ok((next, lock));
    }
    refuse_to_go_on(&folder)?;
    Ok((folder, lock))
}

/// Makes the folder of another attempt, where one is due.
fn next_attempt(folder: &RunFolder) -> Result<Option<RunFolder>> {
    let Some((path, config, attempts)) = folder.due_attempt()? else { return Ok(None) };
    let missed = attempts.earlier.last().map_or("", |attempted| attempted.missed.as_str());
    tell(format_args!(
        "{} missed its gate narrowly: {missed}; attempt {} of {} tries seed {} in {}",
        folder.path().display(),
        attempts.number(),
        attempts.of,
        config.seed,
        path.display()
    ));
    RunFolder::create(&path, &config, folder.borrowed_low()?.as_ref(), &attempts).map(Some)
}

/// Trains one run to its end, or until somebody asks to stop; nothing if another attempt is due.
fn train_once(folder: &RunFolder, stop: Stop) -> Result<Option<Exit>> {
    let run = Run::open(folder.clone(), stop)?;
    let config = run.config();
    note(format_args!(
        "training {}{} (profile {}, seed {}) in {}{}; Ctrl-C saves and stops",
        format!("{:?}", config.algorithm).to_lowercase(),
        config.robot.as_ref().map_or_else(String::new, |name| format!(" for {name}")),
        config.profile,
        config.seed,
        folder.path().display(),
        if run.resumed_step() > 0 { format!(", from step {}", run.resumed_step()) } else { String::new() }
    ));
    debug(format_args!("configuration:\n{}", config.to_toml().trim_end()));
    match run.train()? {
        End::Stopped { signal, is_saved } => {
            let what =
                if is_saved { "stopped and saved" } else { "stopped; what came after the last save is lost" };
            tell(format_args!("{what}; continue with: trainer train --resume {}", folder.path().display()));
            Ok(Some(Exit::Stopped(signal)))
        }
        End::Failed(reason) => {
            if folder.take_more_back(&reason)? {
                bail!(
                    "{} was not trained on, its policy is the one before: {reason}",
                    folder.path().display()
                );
            }
            folder.save_failure(&reason)?;
            bail!("the run {} is stopped for good: {reason}", folder.path().display());
        }
        End::Finished(policy) => {
            say(words::reached(&policy, folder.path()));
            if policy.gate.is_passed() {
                return Ok(Some(Exit::Done));
            }
            ensure!(folder.due_attempt()?.is_some(), words::missed(&policy, folder.path()));
            Ok(None)
        }
    }
}

/// A finished or failed run says so, and what can be done instead.
fn refuse_to_go_on(folder: &RunFolder) -> Result<()> {
    let path = folder.path().display();
    if let Some(reason) = folder.failure() {
        bail!("{path} was stopped for good: {reason}");
    }
    if folder.is_finished() {
        let policy = folder.policy()?;
        ensure!(
            policy.gate.is_passed(),
            "{path} has finished, but {}",
            words::missed(&policy, folder.path())
        );
        bail!(
            "{path} has already finished: `trainer export --run {path}` exports it, and --more trains it further"
        );
    }
    Ok(())
}

/// The policy of a finished run, whose low level a run of `config` can use.
fn borrowed_low(folder: &Path, config: &Config) -> Result<Policy> {
    let policy = RunFolder::open(folder)?.policy()?;
    let same = Task { decision: config.task.decision, ..policy.task } == config.task;
    ensure!(
        same,
        "the low level of {} was trained for another task (robot, lidar or episode) than this run's",
        folder.display()
    );
    Ok(policy)
}

/// From arguments to the configuration that will run.
fn plan(args: &TrainArgs) -> Result<Config> {
    let default_profile = args.profile.unwrap_or(Profile::Quick);
    let robot = args.robot.as_deref().map(RobotProfile::read).transpose()?;
    let mut config = match &args.config {
        Some(path) => Config::read(path, default_profile, robot.as_ref())?,
        None => robot.as_ref().map_or_else(
            || Config::of_profile(default_profile),
            |robot| Config::of_robot(default_profile, robot),
        ),
    };
    if let Some(profile) = args.profile
        && profile != config.profile
    {
        bail!(
            "--profile {profile} contradicts the profile in --config ({}): drop one of them",
            config.profile
        );
    }
    if let Some(algorithm) = args.algorithm {
        config.algorithm = algorithm.policy();
    }
    if config.algorithm == Algorithm::Td3 {
        // A flat policy only ever drives at the goal.
        config.low.goal_share = 1.0;
    }
    if (args.algorithm == Some(AlgorithmArg::Dqn)) != args.low.is_some() {
        bail!(
            "--algorithm dqn and --low FOLDER go together: the folder of the finished run whose low level to use"
        );
    }
    if let Some(seed) = args.seed {
        config.seed = seed;
    }
    config.validate()?;
    Ok(config)
}

/// Exports.
///
/// # Errors
/// No finished run, a run that missed its gate, or networks on which the engines disagree.
pub fn export(args: &ExportArgs) -> Result<Exit> {
    crate::nn::init_torch();
    let folder = match &args.run {
        Some(path) => RunFolder::open(path)?,
        None => RunFolder::newest(RunFolder::is_finished, "finished")?,
    };
    let (folder, policy) = passed_attempt(folder)?;
    ensure!(
        policy.gate.is_passed(),
        "the run {} was not exported: {}",
        folder.path().display(),
        words::missed(&policy, folder.path())
    );
    let written = export::export(&policy, &args.out)
        .with_context(|| format!("the run {} was not exported", folder.path().display()))?;
    say(written.trim_end());
    Ok(Exit::Done)
}

/// The run itself, or the attempt after it that passed where it missed.
fn passed_attempt(folder: RunFolder) -> Result<(RunFolder, Policy)> {
    let policy = folder.policy()?;
    if !policy.gate.is_passed() {
        let last = folder.clone().last_attempt()?;
        if last.is_finished() && last.path() != folder.path() {
            let passed = last.policy()?;
            if passed.gate.is_passed() {
                note(format_args!(
                    "{} missed its gate; {}, the attempt after it, passed and is exported",
                    folder.path().display(),
                    last.path().display()
                ));
                return Ok((last, passed));
            }
        }
    }
    Ok((folder, policy))
}
