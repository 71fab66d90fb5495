//! The tables of the page.

use super::grid::{DASH, Grid, hundredths, p_value, percent, plain, points};
use crate::analysis::Analysis;
use crate::analysis::contrast::Answer;
use crate::analysis::steps::Step;
use crate::cells::Cells;
use crate::plan::{Source, Study};
use crate::stats::a12;

/// The primary comparisons.
pub(super) fn headline(study: &Study, analysis: &Analysis) -> Grid {
    let note = "Interquartile means over training seeds, %, with intervals over new seeds and new worlds. p is of the exact \
                Mann-Whitney test over seeds, after Holm's correction over all primaries; a dash where a side has one policy only. \
                A12: chance that a seed of the method does better than one of the other. An interval without width: no row differs; \
                what happens in 3 worlds of N or fewer can be missed by N worlds.";
    let columns = [
        "metric",
        "gate",
        "family",
        "method",
        "against",
        "method, %",
        "against, %",
        "difference, points",
        "p",
        "p (Holm)",
        "A12",
        "seeds",
        "worlds",
        "rows",
    ];
    let mut grid = Grid::new("headline", "The primary comparisons", note, &columns);
    grid.rows = analysis.primaries.iter().map(|answer| headline_row(study, answer)).collect();
    grid
}

fn headline_row(study: &Study, answer: &Answer) -> Vec<String> {
    let contrast = &answer.contrast;
    let label = |method: usize| study.methods[method].label.clone();
    let mut row = vec![
        contrast.metric.words().to_owned(),
        contrast.gate.word().to_owned(),
        contrast.family.clone(),
        label(contrast.method),
        label(contrast.against),
    ];
    let Some(found) = &answer.found else {
        row.extend([DASH; 8].map(str::to_owned));
        row.push("none".to_owned());
        return row;
    };
    let [ours, theirs] = found.seeds;
    row.extend([
        percent(found.method),
        percent(found.against),
        points(found.difference),
        p_value(found.p),
        p_value(answer.holm),
        found.a12.map_or(DASH.to_owned(), |a12| format!("{}, {}", plain(a12, 2), a12::words(a12.value))),
        format!("{ours} / {theirs}"),
        found.worlds.to_string(),
        if answer.is_whole { "all" } else { "incomplete" }.to_owned(),
    ]);
    row
}

/// Each method over all families.
pub(super) fn methods(study: &Study, analysis: &Analysis) -> Grid {
    let subject = &study.methods[study.subject()].label;
    let note = format!(
        "Success: interquartile mean over every seed and family; collisions: mean. Improved on: chance that a seed of {subject} has \
         more success than one of the method, families weighing alike."
    );
    let columns = ["method", "how", "gate", "families", "success, %", "collision, %", "improved on"];
    let mut grid = Grid::new("methods", "Methods over all families", &note, &columns);
    for own in &analysis.overall {
        let entry = &study.methods[own.method];
        let how = match &entry.source {
            Source::Rival(_) => "classical".to_owned(),
            Source::Trained { .. } => "learned".to_owned(),
            Source::LowLevelOf(of) => format!("low level of {}", study.methods[*of].label),
        };
        grid.rows.push(vec![
            entry.label.clone(),
            how,
            own.gate.word().to_owned(),
            own.families.to_string(),
            percent(own.success),
            percent(own.collision),
            own.improved_on.map_or(DASH.to_owned(), |improved| plain(improved, 2)),
        ]);
    }
    grid
}

/// Where a method must not be worse.
pub(super) fn non_inferiority(study: &Study, analysis: &Analysis) -> Grid {
    let note = "Better: the interval of the difference lies on the good side of zero; not worse: of the margin; worse: on the bad \
                side of the margin; open: these rows do not tell.";
    let columns = [
        "metric",
        "gate",
        "family",
        "method",
        "against",
        "margin, points",
        "difference, points",
        "verdict",
        "rows",
    ];
    let mut grid = Grid::new("non-inferiority", "Not worse by more than a margin", note, &columns);
    for answer in &analysis.non_inferiority {
        let contrast = &answer.contrast;
        let found = answer.found.as_ref();
        let rows = match (found, answer.is_whole) {
            (None, _) => "none",
            (Some(_), true) => "all",
            (Some(_), false) => "incomplete",
        };
        grid.rows.push(vec![
            contrast.metric.words().to_owned(),
            contrast.gate.word().to_owned(),
            contrast.family.clone(),
            study.methods[contrast.method].label.clone(),
            study.methods[contrast.against].label.clone(),
            hundredths(contrast.margin),
            found.map_or(DASH.to_owned(), |found| points(found.difference)),
            found.map_or(DASH, |found| found.verdict.words()).to_owned(),
            rows.to_owned(),
        ]);
    }
    grid
}

/// World by world.
pub(super) fn paired(study: &Study, analysis: &Analysis) -> Grid {
    let note = "The same worlds for both; these p-values are not corrected, and hold for these trained policies and new worlds. \
                Success: mean difference, points; McNemar's exact test between two single policies, signed ranks of each world's success \
                over seeds otherwise. The others: worlds that both solved, medians of both, mean difference; exact signed ranks.";
    let columns = [
        "gate",
        "family",
        "method",
        "against",
        "what",
        "worlds",
        "its own",
        "the other's",
        "difference",
        "p",
    ];
    let mut grid = Grid::new("paired", "World by world", note, &columns);
    for pair in &analysis.paired {
        let contrast = &pair.contrast;
        let label = |method: usize| study.methods[method].label.clone();
        let head = [
            contrast.gate.word().to_owned(),
            contrast.family.clone(),
            label(contrast.method),
            label(contrast.against),
        ];
        let [wins, losses] = pair.wins;
        let success = [
            "success: worlds won".to_owned(),
            pair.worlds.to_string(),
            wins.to_string(),
            losses.to_string(),
            points(pair.success),
            p_value(Some(pair.success_p)),
        ];
        grid.rows.push(head.iter().cloned().chain(success).collect());
        for quantity in &pair.quantities {
            let [ours, theirs] = quantity.medians;
            let row = [
                quantity.name.to_owned(),
                quantity.worlds.to_string(),
                format!("{ours:.3}"),
                format!("{theirs:.3}"),
                plain(quantity.difference, 3),
                p_value(Some(quantity.p)),
            ];
            grid.rows.push(head.iter().cloned().chain(row).collect());
        }
    }
    grid
}

/// The ladder: what each rung removes, and what it brings.
pub(super) fn ladder(study: &Study, analysis: &Analysis) -> Grid {
    let note = "Each rung against the one below it: difference of success, points. Spin and the rank correlation of return and success \
                are those of training.";
    steps("ladder", "From the failure upwards", note, ["rung", "removes"], study, &analysis.ladder)
}

/// The ablations: what each part is worth.
pub(super) fn ablation(study: &Study, analysis: &Analysis) -> Grid {
    let note = "Each against the whole: difference of success, points. A part without which no interval excludes zero earns nothing.";
    steps("ablation", "One part taken away at a time", note, ["method", "without"], study, &analysis.ablation)
}

fn steps(
    name: &'static str,
    title: &'static str,
    note: &str,
    [who, about]: [&str; 2],
    study: &Study,
    steps: &[Step],
) -> Grid {
    let mut grid = Grid::new(name, title, note, &[who, about, "gate"]);
    let families = steps.iter().map(|step| &step.families).max_by_key(|families| families.len());
    let families: Vec<String> = families.into_iter().flatten().map(|(family, _)| family.clone()).collect();
    grid.columns.extend(families.iter().cloned());
    grid.columns.extend(["spin, %", "return follows success", "effect"].map(str::to_owned));
    for step in steps {
        let name = study.methods[step.method].name.clone();
        let mut row = vec![name, step.about.clone(), step.gate.word().to_owned()];
        for family in &families {
            let found = step.families.iter().find(|(name, _)| name == family);
            let found = found.and_then(|(_, found)| found.as_ref());
            row.push(found.map_or(DASH.to_owned(), |found| points(found.difference)));
        }
        row.push(step.spin.map_or(DASH.to_owned(), hundredths));
        row.push(step.return_follows_success.map_or(DASH.to_owned(), |rank| format!("{rank:+.2}")));
        row.push(effect(step).to_owned());
        grid.rows.push(row);
    }
    grid
}

fn effect(step: &Step) -> &'static str {
    if step.families.iter().all(|(_, found)| found.is_none()) {
        DASH
    } else if step.is_without_effect() {
        "none shown"
    } else {
        "yes"
    }
}

/// What training took, and what came of it.
pub(super) fn runs(study: &Study, analysis: &Analysis) -> Grid {
    let note = format!(
        "Medians over runs. The study gives each run {} environment steps and at least {} updates. Strays: by how much validation success \
         leaves its median over the last fifth of training, of the seed that does most.",
        study.env_steps, study.updates_min
    );
    let columns = [
        "method",
        "runs",
        "passed its gate",
        "environment steps",
        "updates",
        "time to train, s",
        "strays, points",
        "spin, %",
        "what is to be told",
    ];
    let mut grid = Grid::new("runs", "Training", &note, &columns);
    for (method, entry) in study.methods.iter().enumerate() {
        let spent = analysis.budget.iter().find(|spent| spent.method == method);
        let curves = analysis.curves.iter().find(|curves| curves.method == method);
        if spent.is_none() && curves.is_none() {
            continue;
        }
        let number = |value: Option<f64>| value.map_or(DASH.to_owned(), |value| format!("{value:.0}"));
        grid.rows.push(vec![
            entry.label.clone(),
            spent.map_or(DASH.to_owned(), |spent| spent.runs.len().to_string()),
            spent.map_or(DASH.to_owned(), |spent| spent.passed.to_string()),
            number(spent.and_then(|spent| spent.env_steps)),
            number(spent.and_then(|spent| spent.updates)),
            number(spent.and_then(|spent| spent.train_s)),
            curves.and_then(|curves| curves.strays).map_or(DASH.to_owned(), hundredths),
            curves.and_then(|curves| curves.spin).map_or(DASH.to_owned(), hundredths),
            spent.map_or(String::new(), |spent| spent.complaints.join("; ")),
        ]);
    }
    grid
}

/// What the study names and nobody drove: cells that lack the same are told together.
pub(super) fn missing(study: &Study, cells: &Cells) -> Grid {
    let note = "What the study names and these rows do not hold.";
    let mut grid = Grid::new("missing", "What is missing", note, &["method", "gate", "families", "what"]);
    for gap in &cells.gaps {
        let head = [study.methods[gap.method].label.clone(), gap.gate.word().to_owned()];
        let is_same = |row: &&mut Vec<String>| row[..2] == head && row[3] == gap.what;
        match grid.rows.iter_mut().find(is_same) {
            Some(row) => row[2] = format!("{}, {}", row[2], gap.family),
            None => grid
                .rows
                .push([head[0].clone(), head[1].clone(), gap.family.clone(), gap.what.clone()].into()),
        }
    }
    grid
}
