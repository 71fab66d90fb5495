//! The ladder, rung against the one below, and the ablations, each against the whole.

use super::contrast::{Found, find};
use super::curves::MethodCurves;
use crate::cells::Cells;
use crate::description::Metric;
use crate::plan::{Contrast, Steps, Study};
use crate::rows::Gate;

/// A method beside the one that it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Index of the method.
    pub method: usize,
    /// What the step is about.
    pub about: String,
    /// With which gate.
    pub gate: Gate,
    /// Against the one that it is compared with, family by family; empty without one.
    pub families: Vec<(String, Option<Found>)>,
    /// Mean spin at the end of training.
    pub spin: Option<f64>,
    /// Rank correlation of return and success over training.
    pub return_follows_success: Option<f64>,
}

impl Step {
    /// Whether no family shows that the step makes a difference: no interval excludes zero.
    pub fn is_without_effect(&self) -> bool {
        let found: Vec<&Found> = self.families.iter().filter_map(|(_, found)| found.as_ref()).collect();
        !found.is_empty() && found.iter().all(|found| !found.difference.interval.excludes(0.0))
    }
}

/// The steps, each with every gate of the study.
pub fn steps(study: &Study, cells: &Cells, curves: &[MethodCurves], steps: &Steps) -> Vec<Step> {
    let mut found = Vec::new();
    for &gate in &study.gates {
        for (method, against, about) in &steps.steps {
            let of_family = |family: &String| {
                let against = (*against)?;
                let contrast = Contrast {
                    metric: Metric::Success,
                    method: *method,
                    against,
                    family: family.clone(),
                    gate,
                    margin: 0.0,
                };
                Some((family.clone(), find(study, cells, &contrast)))
            };
            let own = curves.iter().find(|curves| curves.method == *method);
            found.push(Step {
                method: *method,
                about: about.clone(),
                gate,
                families: steps.families.iter().filter_map(of_family).collect(),
                spin: own.and_then(|curves| curves.spin),
                return_follows_success: own.and_then(|curves| curves.return_follows_success),
            });
        }
    }
    found
}
