//! Comparisons spelt out.

use std::path::Path;

use super::{Contrast, Description, Entry, Steps, Study, twice};
use crate::description::{Comparison, Metric};
use crate::rows::Gate;
use crate::stats::bootstrap::Bootstrap;

/// A study of these methods.
pub(super) fn study(
    path: &Path,
    text: String,
    description: Description,
    methods: Vec<Entry>,
) -> Result<Study, String> {
    let names = Names { methods: &methods, description: &description };
    let primaries = names.comparisons("primary", &description.primaries)?;
    let non_inferiority = names.comparisons("non_inferiority", &description.non_inferiority)?;
    let mut paired = Vec::new();
    for (index, asked) in description.paired.iter().enumerate() {
        let of = Asked {
            what: format!("paired {}", index + 1),
            metric: Metric::Success,
            method: &asked.method,
            against: &asked.against,
            families: asked.families.as_deref(),
            gates: asked.gates.as_deref(),
            margin: 0.0,
        };
        paired.extend(names.contrasts(&of)?);
    }
    refuse_twice(&primaries, "primary", &methods)?;
    let ladder = names.ladder()?;
    let ablation = names.ablation()?;
    let interval = description.interval;
    let evaluation = description.evaluation;
    Ok(Study {
        path: path.to_owned(),
        text,
        title: description.title,
        inference: description.inference.trim().to_owned(),
        env_steps: description.training.env_steps,
        updates_min: description.training.updates_min,
        split: evaluation.split,
        disturbance: evaluation.disturbance,
        families: evaluation.families,
        worlds: evaluation.worlds,
        gates: evaluation.gates,
        bootstrap: Bootstrap {
            resamples: interval.resamples,
            seed: interval.seed,
            coverage: interval.coverage,
        },
        methods,
        primaries,
        non_inferiority,
        paired,
        ladder,
        ablation,
    })
}

/// A question asked twice would be corrected for twice.
fn refuse_twice(contrasts: &[Contrast], what: &str, methods: &[Entry]) -> Result<(), String> {
    let key = |contrast: &Contrast| {
        (contrast.metric, contrast.method, contrast.against, contrast.family.clone(), contrast.gate)
    };
    let keys: Vec<_> = contrasts.iter().map(key).collect();
    let Some((metric, method, against, family, _)) = twice(&keys) else { return Ok(()) };
    let (method, against) = (&methods[*method].name, &methods[*against].name);
    Err(format!("{what}: {method} against {against} in {} on {family} is asked twice", metric.words()))
}

struct Asked<'a> {
    what: String,
    metric: Metric,
    method: &'a str,
    against: &'a [String],
    families: Option<&'a [String]>,
    gates: Option<&'a [Gate]>,
    margin: f64,
}

struct Names<'a> {
    methods: &'a [Entry],
    description: &'a Description,
}

impl Names<'_> {
    fn method(&self, what: &str, name: &str) -> Result<usize, String> {
        self.methods.iter().position(|method| method.name == name).ok_or_else(|| {
            let known: Vec<&str> = self.methods.iter().map(|method| method.name.as_str()).collect();
            format!("{what} names {name}, which is no method of this study: there are {}", known.join(", "))
        })
    }

    fn families(&self, what: &str, wanted: Option<&[String]>) -> Result<Vec<String>, String> {
        let all = &self.description.evaluation.families;
        let wanted = wanted.unwrap_or(all);
        if wanted.is_empty() {
            return Err(format!("{what} names no family: leave `families` out or name some"));
        }
        match wanted.iter().find(|family| !all.contains(family)) {
            Some(family) => {
                Err(format!("{what} names {family}, which nobody drives: add it to evaluation.families"))
            }
            None => Ok(wanted.to_vec()),
        }
    }

    fn comparisons(&self, what: &str, comparisons: &[Comparison]) -> Result<Vec<Contrast>, String> {
        let mut contrasts = Vec::new();
        for (index, asked) in comparisons.iter().enumerate() {
            contrasts.extend(self.contrasts(&Asked {
                what: format!("{what} {}", index + 1),
                metric: asked.metric,
                method: &asked.method,
                against: &asked.against,
                families: Some(&asked.families),
                gates: asked.gates.as_deref(),
                margin: asked.margin.unwrap_or(0.0),
            })?);
        }
        Ok(contrasts)
    }

    fn contrasts(&self, asked: &Asked<'_>) -> Result<Vec<Contrast>, String> {
        let what = &asked.what;
        let method = self.method(what, asked.method)?;
        let families = self.families(what, asked.families)?;
        let all = &self.description.evaluation.gates;
        let gates = asked.gates.unwrap_or(all);
        if let Some(gate) = gates.iter().find(|gate| !all.contains(gate)) {
            return Err(format!(
                "{what}: nobody drives with the gate {}: add it to evaluation.gates",
                gate.word()
            ));
        }
        let mut contrasts = Vec::new();
        for against in asked.against {
            let against = self.method(what, against)?;
            if against == method {
                return Err(format!("{what} compares {} with itself", asked.method));
            }
            for &gate in gates {
                contrasts.extend(families.iter().map(|family| Contrast {
                    metric: asked.metric,
                    method,
                    against,
                    family: family.clone(),
                    gate,
                    margin: asked.margin,
                }));
            }
        }
        if contrasts.is_empty() {
            return Err(format!("{what} compares nothing: name somebody in `against`"));
        }
        Ok(contrasts)
    }

    fn ladder(&self) -> Result<Option<Steps>, String> {
        let Some(ladder) = &self.description.ladder else { return Ok(None) };
        let mut steps = Vec::new();
        let mut below = None;
        for rung in &ladder.rungs {
            let method = self.method("ladder", &rung.method)?;
            steps.push((method, below, rung.removes.clone()));
            below = Some(method);
        }
        Ok(Some(Steps { steps, families: self.families("ladder", ladder.families.as_deref())? }))
    }

    fn ablation(&self) -> Result<Option<Steps>, String> {
        let Some(ablation) = &self.description.ablation else { return Ok(None) };
        let base = self.method("ablation", &ablation.base)?;
        let mut steps = vec![(base, None, "the whole".to_owned())];
        for name in &ablation.without {
            let method = self.method("ablation", name)?;
            steps.push((method, Some(base), self.methods[method].label.clone()));
        }
        Ok(Some(Steps { steps, families: self.families("ablation", ablation.families.as_deref())? }))
    }
}
