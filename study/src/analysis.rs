//! From cells to every number of the report.
//!
//! | file | holds |
//! |---|---|
//! | [`estimate`] | a value with its interval; each method on each family |
//! | [`contrast`] | a method against another: difference, exact test, effect size; Holm over the primaries |
//! | [`paired`] | a method against another world by world |
//! | [`overall`] | each method over all families: interquartile mean, performance profile, probability of improvement |
//! | [`curves`] | learning curves: the seeds' spread, stability, return against success |
//! | [`steps`] | the ladder and the ablations |
//! | [`pathbench`] | the figures of the paper's chosen tool |
//! | [`budget`] | what the runs took, and whether they were given the same |

pub mod estimate;
pub mod contrast;
pub mod paired;
pub mod overall;
pub mod curves;
pub mod steps;
pub mod pathbench;
pub mod budget;

use crate::cells::Cells;
use crate::description::Metric;
use crate::plan::Study;
use crate::rows::Tables;

/// Every number of the report.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Success of each method on each family.
    pub success: Vec<estimate::CellEstimate>,
    /// The same of collisions.
    pub collision: Vec<estimate::CellEstimate>,
    /// The primary comparisons, corrected together.
    pub primaries: Vec<contrast::Answer>,
    /// Where a method must not be worse.
    pub non_inferiority: Vec<contrast::Answer>,
    /// World by world.
    pub paired: Vec<paired::Pair>,
    /// Each method over all families.
    pub overall: Vec<overall::Overall>,
    /// The figures of PathBench.
    pub pathbench: Vec<pathbench::MethodFigures>,
    /// Learning curves by method.
    pub curves: Vec<curves::MethodCurves>,
    /// The ladder.
    pub ladder: Vec<steps::Step>,
    /// The ablations.
    pub ablation: Vec<steps::Step>,
    /// What the runs took.
    pub budget: Vec<budget::Spent>,
}

impl Analysis {
    /// Analyses cells, curves and runs.
    pub fn of(study: &Study, cells: &Cells, tables: &Tables) -> Self {
        let curves = curves::by_method(study, &tables.curves);
        let steps = |steps: &Option<crate::plan::Steps>| {
            steps.as_ref().map_or_else(Vec::new, |steps| steps::steps(study, cells, &curves, steps))
        };
        Self {
            success: estimate::each(study, cells, Metric::Success),
            collision: estimate::each(study, cells, Metric::Collision),
            primaries: contrast::primaries(study, cells),
            non_inferiority: contrast::answers(study, cells, &study.non_inferiority),
            paired: paired::pairs(study, cells),
            overall: overall::overall(study, cells),
            pathbench: pathbench::methods(study, cells),
            ladder: steps(&study.ladder),
            ablation: steps(&study.ablation),
            budget: budget::spent(study, &tables.runs),
            curves,
        }
    }
}
