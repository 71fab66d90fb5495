//! `trainer robot`: the robots that are known by name, and what a run for one will be about.

use anyhow::Result;
use nav_env::robot_profile::{RobotProfile, names};
use nav_host::exit::Exit;
use nav_host::terminal::say;
use std::fmt::Write as _;

use crate::cli::RobotCommand;
use crate::config::{Config, Profile};

/// Lists robots, or looks at one.
///
/// # Errors
/// A robot that cannot be trained for.
pub fn robot(command: &RobotCommand) -> Result<Exit> {
    let text = match command {
        RobotCommand::List | RobotCommand::Check { robot: None } => list()?,
        RobotCommand::Check { robot: Some(given) } => check(&RobotProfile::read(given)?)?,
    };
    say(text.trim_end());
    Ok(Exit::Done)
}

fn list() -> Result<String> {
    let mut text = String::new();
    for name in names() {
        let _ = writeln!(text, "{name:<20} {}", RobotProfile::read(name)?.line());
    }
    text.push_str("\n`trainer robot check NAME` says more, `trainer train --robot NAME` trains for it.");
    Ok(text)
}

/// What follows from it and what is odd.
fn check(profile: &RobotProfile) -> Result<String> {
    // What is refused here would be refused by `train`, too.
    Config::of_robot(Profile::Quick, profile).validate()?;
    let mut text = format!("{}: {}\n\n", profile.name, profile.line());
    for (what, said) in profile.facts() {
        let _ = writeln!(text, "{what:<23} {said}");
    }
    let odd = profile.oddities();
    if odd.is_empty() {
        text.push_str("\nNothing is odd about it.");
    } else {
        let _ = write!(
            text,
            "\n{} odd, which need not be wrong:",
            if odd.len() == 1 { "This is" } else { "These are" }
        );
        for said in odd {
            let _ = write!(text, "\n- {said}");
        }
    }
    Ok(text)
}
