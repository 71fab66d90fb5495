//! A study as it is typed: TOML, every field known, nothing checked yet. [`crate::plan`] makes of it what will be judged.

use serde::Deserialize;
use std::path::PathBuf;

use crate::rows::Gate;

/// The file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Headline of the report.
    pub title: String,
    /// What the figures are to hold for, in a paragraph.
    pub inference: String,
    /// What each learned method is given.
    pub training: Training,
    /// Where all drive.
    pub evaluation: Evaluation,
    /// How intervals are drawn.
    #[serde(default)]
    pub interval: IntervalConfig,
    /// Who is compared, in the order of the report.
    #[serde(rename = "method")]
    pub methods: Vec<Method>,
    /// The questions that were asked first; their p-values are corrected together.
    #[serde(rename = "primary", default)]
    pub primaries: Vec<Comparison>,
    /// Where a method must not be worse.
    #[serde(default)]
    pub non_inferiority: Vec<Comparison>,
    /// Who is compared world by world.
    #[serde(default)]
    pub paired: Vec<Paired>,
    /// One cause of failure removed after the other.
    pub ladder: Option<Ladder>,
    /// One part taken away at a time.
    pub ablation: Option<Ablation>,
}

/// What each learned method is given.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// The training seeds.
    pub seeds: Vec<u64>,
    /// Environment steps of one run, all stages together; a run that took over a twentieth more or less is named.
    pub env_steps: u64,
    /// Updates of one run at least.
    pub updates_min: u64,
}

/// Where all drive.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// Which worlds, as `trainer evaluate --split`.
    pub split: String,
    /// As `trainer evaluate --disturbance`.
    #[serde(default = "usual")]
    pub disturbance: String,
    /// Families of worlds.
    pub families: Vec<String>,
    /// Worlds a family: seeds 0, 1, 2 and so on.
    pub worlds: u64,
    /// With and without the safety gate, or one of the two.
    pub gates: Vec<Gate>,
}

fn usual() -> String {
    "usual".to_owned()
}

/// How intervals are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IntervalConfig {
    /// Share of resamples inside.
    pub coverage: f64,
    /// How often seeds and worlds are drawn.
    pub resamples: usize,
    /// Of the generator.
    pub seed: u64,
}

impl Default for IntervalConfig {
    fn default() -> Self {
        Self { coverage: 0.95, resamples: 2_000, seed: 1 }
    }
}

/// Who is compared: exactly one of `train`, `low_level_of` and `rival`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    /// What rows call it (`policy`), and the folder of its runs.
    pub name: String,
    /// What figures call it.
    pub label: String,
    /// A learned one: what `trainer train` is told.
    pub train: Option<Train>,
    /// The low level of another method's runs, straight at the goal.
    pub low_level_of: Option<String>,
    /// A classical one, as `trainer evaluate --policy` names it.
    pub rival: Option<String>,
    /// Its training seeds, where they are not `training.seeds`.
    pub seeds: Option<Vec<u64>>,
}

/// What `trainer train` is told, beside seed and folder.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Train {
    /// A configuration, relative to the study's file.
    pub config: PathBuf,
    /// Further flags.
    #[serde(default)]
    pub flags: Vec<String>,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Share of worlds whose goal was reached in time; more is better.
    Success,
    /// Share of worlds with a collision, those while the robot stood among them; less is better.
    Collision,
    /// Share of worlds in which the robot was hit while it stood; less is better.
    HitWhileStanding,
    /// Mean share of steps that were spin; less is better.
    Spin,
    /// Mean success weighted by path length; more is better.
    Spl,
}

impl Metric {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Success => "success",
            Self::Collision => "collision",
            Self::HitWhileStanding => "hit while standing",
            Self::Spin => "spin",
            Self::Spl => "SPL",
        }
    }

    /// Whether more of it is better.
    pub const fn more_is_better(self) -> bool {
        matches!(self, Self::Success | Self::Spl)
    }
}

/// A method against others, each on each family with each gate.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// By how much the method may be worse, in the units of the metric: 0.02 is two points of a hundred. Of a non-inferiority,
    /// and of nothing else.
    pub margin: Option<f64>,
    /// What is compared.
    pub metric: Metric,
    /// Who.
    pub method: String,
    /// With whom.
    pub against: Vec<String>,
    /// On which families, each by itself.
    pub families: Vec<String>,
    /// With which gates [default: those of the evaluation].
    pub gates: Option<Vec<Gate>>,
}

/// A method against others, world by world.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paired {
    /// Who.
    pub method: String,
    /// With whom.
    pub against: Vec<String>,
    /// On which families [default: those of the evaluation].
    pub families: Option<Vec<String>>,
    /// With which gates [default: those of the evaluation].
    pub gates: Option<Vec<Gate>>,
}

/// Rungs, the first the worst; each removes one cause.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ladder {
    /// From the failure upwards.
    pub rungs: Vec<Rung>,
    /// On which families [default: those of the evaluation].
    pub families: Option<Vec<String>>,
}

/// A rung.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rung {
    /// A method.
    pub method: String,
    /// The suspected cause that it removes.
    pub removes: String,
}

/// A method, and what is left of it without a part.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ablation {
    /// The whole.
    pub base: String,
    /// Methods that lack one part each; their labels name it.
    pub without: Vec<String>,
    /// On which families [default: those of the evaluation].
    pub families: Option<Vec<String>>,
}
