//! `trainer train` and `trainer export`: from arguments to a checked plan, and what is said at the end.

use anyhow::{Context, Result, bail, ensure};
use nav_core::manifest::Algorithm;
use nav_core::task::Task;
use nav_host::exit::Exit;
use nav_host::stop::{Second, Stop};
use nav_host::terminal::{debug, note, say, tell};
use std::path::Path;

use crate::cli::{AlgorithmArg, ExportArgs, TrainArgs};
use crate::config::{Config, Profile, bounds};
use crate::export;
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
    let folder = match &args.resume {
        Some(Some(path)) => RunFolder::open(path)?,
        Some(None) => RunFolder::newest(RunFolder::is_unfinished, "unfinished")?,
        None => {
            let config = plan(args)?;
            let low = args.low.as_deref().map(|low| borrowed_low(low, &config)).transpose()?;
            let path = args.out.clone().unwrap_or_else(|| RunFolder::next_path(&config));
            RunFolder::create(&path, &config, low.as_ref())?
        }
    };
    refuse_to_go_on(&folder)?;
    let _lock = folder.lock()?;
    let run = Run::open(folder.clone(), stop)?;
    let config = run.config();
    note(format_args!(
        "training {} (profile {}, seed {}) in {}{}; Ctrl-C saves and stops",
        format!("{:?}", config.algorithm).to_lowercase(),
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
            Ok(Exit::Stopped(signal))
        }
        End::Failed(reason) => {
            folder.save_failure(&reason)?;
            bail!("the run {} is stopped for good: {reason}", folder.path().display());
        }
        End::Finished(policy) => {
            say(reached(&policy, folder.path()));
            ensure!(policy.gate.missed.is_empty(), missed(&policy));
            Ok(Exit::Done)
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
        ensure!(policy.gate.missed.is_empty(), "{path} has finished, but {}", missed(&policy));
        bail!("{path} has already finished: `trainer export --run {path}` exports it");
    }
    Ok(())
}

/// That a finished run cannot be used, and what to do.
fn missed(policy: &Policy) -> String {
    format!(
        "the gate was not passed, so that it cannot be exported: {}; train with another --seed, or change the \
         configuration (--config)",
        policy.gate.missed.join("; ")
    )
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
    let mut config = match &args.config {
        Some(path) => Config::read(path, default_profile)?,
        None => Config::of_profile(default_profile),
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

/// What was reached, and what comes next.
fn reached(policy: &Policy, folder: &Path) -> String {
    use std::fmt::Write as _;
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
    if policy.gate.missed.is_empty() {
        let _ = writeln!(text, "\ngate passed; export it with: trainer export --run {}", folder.display());
    }
    text.trim_end().to_owned()
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
    let policy = folder.policy()?;
    let written = export::export(&policy, &args.out)
        .with_context(|| format!("the run {} was not exported", folder.path().display()))?;
    say(written.trim_end());
    Ok(Exit::Done)
}
