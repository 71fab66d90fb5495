//! The model card: what a model is, for people.

use anyhow::Result;
use nav_core::task::Task;
use nav_env::robot_profile::RobotProfile;
use nav_host::sha256::sha256_hex;
use std::fmt::Write as _;

use super::story;
use crate::config::Config;
use crate::train::policy::Policy;

/// The card as Markdown.
///
/// # Errors
/// A configuration of another version.
pub(super) fn card(policy: &Policy) -> Result<String> {
    let config = policy.config()?;
    let is_hybrid = policy.scorer.is_some();
    let mut text = String::new();
    let kind =
        if is_hybrid { "a DQN that chooses subgoals above a TD3 that drives to them" } else { "a flat TD3" };
    let families: Vec<_> =
        if is_hybrid { &config.high.families } else { &config.low.families }.iter().map(|f| f.id()).collect();
    let _ = write!(
        text,
        "# Model card\n\n\
         A navigation policy for a differential-drive robot with a planar lidar: {kind}.\n\n\
         | | |\n|---|---|\n\
         | made with | {} |\n\
         | configuration | SHA-256 {}{} |\n\
         | commit | {} |\n\
         | training | {} |\n{}\
         | families | {} |\n\
         | robot | {}{}, up to {} m/s, {} m/s back and {} rad/s |\n\
         | lidar | {} beams, {:.0} degrees, {} m |\n\
         | control period | {} s |\n\
         | deviation margin | {} |\n\n\
         ## Validation worlds (never trained on, and others chose the deviation margin)\n\n\
         | family | worlds | success | collision | spin | its TD3 straight at the goal |\n|---|---|---|---|---|---|\n",
        story::made_with(policy, &config),
        &sha256_hex(policy.config_toml.as_bytes())[..12],
        if is_plain(&config) { ", the profile's own" } else { ", with changes" },
        policy.commit,
        story::words(&policy.spent()),
        story::rows(policy),
        families.join(", "),
        config.robot.as_deref().map_or_else(String::new, |name| named(name, &policy.task)),
        policy.task.robot.footprint,
        policy.task.robot.linear_max_mps,
        policy.task.robot.linear_min_mps.abs(),
        policy.task.robot.angular_max_radps,
        policy.task.lidar.beam_count,
        policy.task.lidar.field_of_view_rad.to_degrees(),
        policy.task.lidar.range_max_m,
        policy.task.control_period_s,
        policy.task.decision.deviation_margin,
    );
    for (score, flat) in policy.gate.families.iter().zip(&policy.gate.flat) {
        let _ = writeln!(
            text,
            "| {} | {} | {:.1} % | {:.1} % | {:.1} % | {:.1} % |",
            score.family,
            score.worlds,
            100.0 * score.success(),
            100.0 * score.collision(),
            100.0 * score.spin,
            100.0 * flat.success()
        );
    }
    let _ = write!(
        text,
        "\nThe low level alone, behind the safety gate and with the disturbances of training, {}.\n\n{}\n\
         ## Limits\n\n\
         Trained and scored in simulation. It is not a certified safety function: detecting people and the \
         emergency stop stay in hardware. Crowds of people who do not look are its weak spot; see the collision \
         column.\n",
        policy.gate.low,
        story::verdicts(policy, &config),
    );
    Ok(text)
}

/// Whether a configuration is that of its profile for its robot and lidar, but for the seed and what `--algorithm` sets.
fn is_plain(config: &Config) -> bool {
    let Task { robot, lidar, control_period_s, .. } = config.task;
    let mut plain = Config::of(config.profile, Task { lidar, control_period_s, ..Task::of(robot) });
    (plain.seed, plain.algorithm, plain.low.goal_share) =
        (config.seed, config.algorithm, config.low.goal_share);
    plain.robot.clone_from(&config.robot);
    *config == plain
}

/// A robot's profile by its name, and in what the robot is another than the profile of that name.
fn named(name: &str, task: &Task) -> String {
    let known = RobotProfile::read(name).ok();
    match known.and_then(|profile| profile.difference(task)) {
        None => format!("{name}: "),
        Some(difference) => format!("{name}, changed ({difference}): "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Profile;

    #[test]
    fn a_card_names_the_robot_and_says_where_it_was_changed() {
        let agv = RobotProfile::read("agv").expect("built in");
        assert_eq!(named("agv", &agv.task()), "agv: ");
        let mut task = agv.task();
        task.robot.linear_max_mps = 0.4;
        assert_eq!(named("agv", &task), "agv, changed (robot.linear_max_mps is 0.4, and 0.5 of agv): ");
        assert_eq!(named("of_somebody", &task), "of_somebody: ");
        assert!(is_plain(&Config::of_robot(Profile::Quick, &agv)), "the defaults for it");
    }
}
