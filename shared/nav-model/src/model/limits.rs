//! What the robot's owner allows, whatever a model asks for.

use nav_core::footprint::Footprint;
use nav_core::task::Robot;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The largest file of limits that is read, bytes.
const MAX_BYTES: u64 = 64 << 10;
/// The one limit that a model goes beyond downwards.
const LINEAR_MIN: &str = "linear_min_mps";

/// Limits of a robot, from a TOML file; what is left out is not limited.
///
/// ```toml
/// [robot]
/// footprint = { circle = { radius_m = 0.2 } }  # the real one: a policy trained for one that does not cover it is refused
/// linear_max_mps = 0.5                # also backwards, if linear_min_mps says nothing
/// linear_min_mps = 0.0                # backwards, as a negative number; 0 forbids it
/// angular_max_radps = 1.0
/// linear_acceleration_mps2 = 1.0
/// angular_acceleration_radps2 = 2.0
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnerLimits {
    robot: RobotLimits,
    #[serde(skip)]
    path: PathBuf,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RobotLimits {
    footprint: Option<Footprint>,
    linear_max_mps: Option<f32>,
    linear_min_mps: Option<f32>,
    angular_max_radps: Option<f32>,
    linear_acceleration_mps2: Option<f32>,
    angular_acceleration_radps2: Option<f32>,
}

/// Why a model may not drive this robot.
#[derive(Debug, thiserror::Error)]
pub enum LimitsError {
    /// The file of limits cannot be read.
    #[error("the limits in {} cannot be read: {problem}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// The model asks for more.
    #[error(
        "the model asks for {field} = {asked}, {} allows {allowed} at {}: train for this robot, or change the limit",
        path.display(),
        if *field == LINEAR_MIN { "least" } else { "most" }
    )]
    Beyond {
        /// Which limit.
        field: &'static str,
        /// Of the model.
        asked: f32,
        /// Of the owner.
        allowed: f32,
        /// The file.
        path: PathBuf,
    },
    /// The model was trained for a smaller robot.
    #[error(
        "the model was trained for a footprint of {trained}, {} says {real}: it would drive into what it \
         believes to pass",
        path.display()
    )]
    Larger {
        /// Of the model.
        trained: Footprint,
        /// Of the owner.
        real: Footprint,
        /// The file.
        path: PathBuf,
    },
}

impl OwnerLimits {
    /// Reads a file of limits; a link is followed where it stays within its folder, as in the volumes of container
    /// orchestrators.
    ///
    /// # Errors
    /// A file that cannot be read, unknown fields, or numbers of the wrong sign.
    pub fn read(path: &Path) -> Result<Self, LimitsError> {
        let unreadable = |problem| LimitsError::Unreadable { path: path.to_path_buf(), problem };
        let file =
            crate::load::read_named_file(path, MAX_BYTES).map_err(|error| unreadable(error.to_string()))?;
        let text = String::from_utf8(file.bytes).map_err(|error| unreadable(error.to_string()))?;
        let limits: Self = toml::from_str(&text).map_err(|error| unreadable(error.message().to_owned()))?;
        let given: Vec<_> =
            limits.robot.fields().into_iter().filter_map(|(name, value)| Some((name, value?))).collect();
        if let Some(footprint) = limits.robot.footprint.filter(|footprint| !footprint.is_sound()) {
            return Err(unreadable(format!("robot.footprint is {footprint}, which no robot has")));
        }
        if given.is_empty() && limits.robot.footprint.is_none() {
            return Err(unreadable("it limits nothing".to_owned()));
        }
        for (name, value) in given {
            let (is_fine, wanted) = if name == LINEAR_MIN {
                (value <= 0.0, "0 or a negative number")
            } else {
                (value > 0.0, "a positive number")
            };
            if !(is_fine && value.is_finite()) {
                return Err(unreadable(format!("robot.{name} is {value}, it must be {wanted}")));
            }
        }
        Ok(Self { path: path.to_path_buf(), ..limits })
    }

    /// Whether a robot as the model sees it stays within.
    ///
    /// # Errors
    /// The first limit that it goes beyond.
    pub(super) fn check(&self, asked: &Robot) -> Result<(), LimitsError> {
        if let Some(real) = self.robot.footprint.filter(|real| !asked.footprint.contains(real)) {
            return Err(LimitsError::Larger { trained: asked.footprint, real, path: self.path.clone() });
        }
        let of_model = [
            asked.linear_max_mps,
            asked.linear_min_mps,
            asked.angular_max_radps,
            asked.linear_acceleration_mps2,
            asked.angular_acceleration_radps2,
        ];
        for ((field, allowed), asked) in self.robot.fields().into_iter().zip(of_model) {
            let is_beyond =
                |allowed: &f32| if field == LINEAR_MIN { asked < *allowed } else { asked > *allowed };
            if let Some(allowed) = allowed.filter(is_beyond) {
                return Err(LimitsError::Beyond { field, asked, allowed, path: self.path.clone() });
            }
        }
        Ok(())
    }
}

impl RobotLimits {
    /// Names and values of all that is a number.
    fn fields(&self) -> [(&'static str, Option<f32>); 5] {
        [
            ("linear_max_mps", self.linear_max_mps),
            (LINEAR_MIN, self.linear_min_mps),
            ("angular_max_radps", self.angular_max_radps),
            ("linear_acceleration_mps2", self.linear_acceleration_mps2),
            ("angular_acceleration_radps2", self.angular_acceleration_radps2),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<OwnerLimits, LimitsError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("robot.toml");
        std::fs::write(&path, text).expect("written");
        OwnerLimits::read(&path)
    }

    #[test]
    fn a_model_that_asks_for_more_is_refused_with_both_numbers() {
        let robot = Robot::default();
        let check = |text: &str| read(text).expect("fine limits").check(&robot);
        assert!(
            check("[robot]\nlinear_max_mps = 1.0\nfootprint.circle.radius_m = 0.2").is_ok(),
            "exactly what is allowed"
        );
        for (text, parts) in [
            ("[robot]\nlinear_max_mps = 0.5", ["linear_max_mps = 1", "allows 0.5"]),
            ("[robot]\nangular_max_radps = 0.5", ["angular_max_radps = 1", "allows 0.5"]),
            ("[robot]\nlinear_acceleration_mps2 = 1.5", ["linear_acceleration_mps2 = 2", "allows 1.5"]),
            ("[robot]\nangular_acceleration_radps2 = 1", ["angular_acceleration_radps2 = 4", "allows 1"]),
            ("[robot]\nfootprint.circle.radius_m = 0.3", ["radius 0.2 m", "says radius 0.3 m"]),
            (
                "[robot]\nfootprint.rectangle = { front_m = 0.2, rear_m = 0.1, half_width_m = 0.1 }",
                ["radius 0.2 m", "says 0.2 m ahead"],
            ),
        ] {
            let error = check(text).expect_err(text).to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{parts:?} in {error}");
        }
    }

    #[test]
    fn a_model_that_reverses_faster_than_allowed_is_refused() {
        let robot = Robot { linear_min_mps: -0.5, ..Robot::default() };
        let check = |text: &str| read(text).expect("fine limits").check(&robot);
        assert!(check("[robot]\nlinear_min_mps = -0.5").is_ok(), "exactly what is allowed");
        for (text, parts) in [
            ("[robot]\nlinear_min_mps = -0.2", ["linear_min_mps = -0.5", "allows -0.2 at least"]),
            ("[robot]\nlinear_min_mps = 0", ["linear_min_mps = -0.5", "allows 0 at least"]),
        ] {
            let error = check(text).expect_err(text).to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{parts:?} in {error}");
        }
    }

    /// As a ConfigMap is mounted, and as the files of a model are read.
    #[test]
    fn limits_may_be_a_link_within_their_folder_and_none_to_elsewhere() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (elsewhere, volume) = (folder.path().join("robot.toml"), folder.path().join("volume"));
        std::fs::create_dir_all(volume.join("..2026")).expect("made");
        for path in [&elsewhere, &volume.join("..2026/robot.toml")] {
            std::fs::write(path, "[robot]\nlinear_max_mps = 0.5").expect("written");
        }
        let link = |target: &str, name: &str| {
            std::os::unix::fs::symlink(target, volume.join(name)).expect("linked");
        };
        link("..2026", "..data");
        link("..data/robot.toml", "robot.toml");
        link("../robot.toml", "stolen.toml");
        let limits = OwnerLimits::read(&volume.join("robot.toml")).expect("as of a model");
        assert_eq!(limits.robot.linear_max_mps, Some(0.5));
        let error = OwnerLimits::read(&volume.join("stolen.toml")).expect_err("elsewhere").to_string();
        assert!(error.contains("symbolic link to elsewhere"), "{error}");
    }

    #[test]
    fn limits_that_are_none_are_refused() {
        for (text, part) in [
            ("[robot]", "limits nothing"),
            ("[robot]\nlinear_max_mps = -1", "positive"),
            ("[robot]\nlinear_max_mps = nan", "positive"),
            ("[robot]\nlinear_min_mps = 0.1", "0 or a negative number"),
            ("[robot]\nlinear_min_mps = nan", "0 or a negative number"),
            ("[robot]\nfootprint.circle.radius_m = -1", "which no robot has"),
            ("[robot]\nspeed = 1", "unknown field"),
            ("robot", "cannot be read"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains(part), "{part} in {error}");
        }
    }
}
