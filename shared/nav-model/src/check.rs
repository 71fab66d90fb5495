//! `runtime check`: everything that is verified before a robot is driven, a line each.

use crate::load::{PARITY_CASES, PARITY_TOLERANCE};
use crate::model::{GOLDEN_TOLERANCE, Model};
use nav_core::geometry::Pose;
use nav_core::manifest::{Algorithm, FileEntry};
use nav_core::network::CpuLevel;

/// What was verified, for programs: `accepted`, then `checks` and the whole `manifest`, or the `reason` for which it was refused.
pub fn json(read: Result<&Model, &impl std::error::Error>) -> serde_json::Value {
    match read {
        Ok(model) => serde_json::json!({
            "accepted": true,
            "model": model.folder().display().to_string(),
            "checks": lines(model),
            "manifest": model.manifest(),
        }),
        Err(error) => {
            let mut reason = error.to_string();
            let mut source = error.source();
            while let Some(cause) = source {
                reason = format!("{reason}: {cause}");
                source = cause.source();
            }
            serde_json::json!({ "accepted": false, "reason": reason })
        }
    }
}

/// What a checked model is, in a line.
pub fn headline(model: &Model) -> String {
    let manifest = model.manifest();
    let algorithm = match manifest.algorithm {
        Algorithm::Hybrid => "hybrid (DQN over TD3)",
        Algorithm::Td3 => "flat TD3",
    };
    format!(
        "model {}: {algorithm}, {:.0} Hz, trained by version {} ({}), seed {}, profile {}",
        model.folder().display(),
        1.0 / manifest.task.control_period_s,
        manifest.trainer_version,
        manifest.trainer_commit,
        manifest.seed,
        manifest.profile
    )
}

/// What a model that was read has passed.
pub fn lines(model: &Model) -> Vec<String> {
    let manifest = model.manifest();
    let task = &manifest.task;
    let mut lines = vec![headline(model)];
    if model.is_signed() {
        lines.push("ok  signature: the manifest is signed with the required key".to_owned());
    }
    lines.push(format!("ok  manifest: format {}, every field known and said", manifest.format));
    lines.push(format!(
        "ok  observation layout: {} low-level and {} high-level numbers, {} a candidate, {} actions",
        manifest.observation_lengths[0],
        manifest.observation_lengths[1],
        manifest.observation_lengths[2],
        manifest.action_count
    ));
    lines.push(format!(
        "ok  task: {} beams over {:.0} degrees to {} m, {} m/s, {} m/s back, {} rad/s, {}, every field in range",
        task.lidar.beam_count,
        task.lidar.field_of_view_rad.to_degrees(),
        task.lidar.range_max_m,
        task.robot.linear_max_mps,
        task.robot.linear_min_mps.abs(),
        task.robot.angular_max_radps,
        task.robot.footprint
    ));
    let networks = [&manifest.td3].into_iter().chain(&manifest.dqn);
    lines.extend(networks.chain([&manifest.golden]).chain(&manifest.data).map(hash_line));
    for (name, network) in [("td3", Some(model.td3())), ("dqn", model.dqn())] {
        let Some(network) = network else { continue };
        lines.push(format!(
            "ok  {name}: {} to {}, lowered to the executor; {PARITY_CASES} random inputs agree with tract within \
             {:.1e} (allowed {PARITY_TOLERANCE:.0e})",
            network.contract().input,
            network.contract().output,
            network.parity()
        ));
    }
    let golden = model.golden();
    lines.push(format!(
        "ok  golden pairs: {} of td3 and {} of dqn reproduced within {:.1e} (allowed {GOLDEN_TOLERANCE:.0e})",
        golden.td3.len(),
        golden.dqn.len(),
        model.golden_difference()
    ));
    lines
}

/// What else helps to find a mistake, a line each: rates and limits, and what the networks consist of.
pub fn details(model: &Model) -> Vec<String> {
    let task = &model.manifest().task;
    let Pose { x_m, y_m, yaw_rad } = task.lidar.mount;
    let mut lines = vec![format!(
        "a tick every {:.0} ms; {} m/s² and {} rad/s² at most; scans over {:.0} degrees and {} m at least half as far, \
         by a lidar at {x_m}, {y_m} m of the robot, turned by {:.0} degrees",
        1e3 * task.control_period_s,
        task.robot.linear_acceleration_mps2,
        task.robot.angular_acceleration_radps2,
        task.lidar.field_of_view_rad.to_degrees(),
        task.lidar.range_max_m,
        yaw_rad.to_degrees()
    )];
    for (name, network) in [("td3", Some(model.td3())), ("dqn", model.dqn())] {
        let Some(network) = network else { continue };
        lines.push(format!(
            "{name}: {} bytes of ONNX, {}; runs with {}",
            network.onnx().len(),
            network.operators(),
            CpuLevel::detect()
        ));
    }
    lines
}

fn hash_line(entry: &FileEntry) -> String {
    format!("ok  {}: SHA-256 {}...", entry.file, entry.sha256.get(..12).unwrap_or(&entry.sha256))
}
