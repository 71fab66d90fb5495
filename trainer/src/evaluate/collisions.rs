//! Why did it collide? The last seconds of collisions, driven once more and drawn moment by moment.

use anyhow::{Context, Result};
use nav_core::metrics::EpisodeEnd;
use nav_env::batch::in_order;
use nav_env::rows::EpisodeRow;
use nav_sim::drawing::{EpisodeTrace, svg_strips, write_picture};
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::drive::Fleets;
use super::plan::Plan;

/// Name of the folder within `--out`.
const FOLDER: &str = "collisions";
/// So many strips of each policy and family are drawn for each of `--pictures`.
const STRIPS: usize = 10;

/// A policy, by its place in the plan, and where it drove.
type Group = (usize, String);

/// Draws the first collisions of each policy in each family, and of the files together, as far as there are any; older
/// pictures of them go.
///
/// # Errors
/// A policy whose files were changed, or a picture that cannot be written.
pub fn draw(plan: &Plan, rows: &[EpisodeRow], threads: usize) -> Result<()> {
    let groups = rows.iter().enumerate().map(|(row, of)| (row % plan.policies.len(), scene(of)));
    let mut traces: BTreeMap<Group, Vec<EpisodeTrace>> = groups.map(|group| (group, Vec::new())).collect();
    for path in traces.keys().flat_map(|group| files(plan, group)).filter(|path| path.exists()) {
        std::fs::remove_file(&path).with_context(|| format!("cannot replace {}", path.display()))?;
    }
    let collided = chosen(rows, plan.policies.len(), STRIPS * plan.pictures);
    if collided.is_empty() {
        return Ok(());
    }
    let fleets = Fleets::new(plan, threads)?;
    let worker = || {
        let mut fleet = fleets.take();
        let collided = &collided;
        move |index: usize| {
            let row = collided[index];
            let (world, policy) = (row / plan.policies.len(), row % plan.policies.len());
            let (robot, driver) = &mut fleet[policy];
            robot.drive(&mut **driver, &plan.scenes.place(world), true).trace
        }
    };
    in_order(
        0..collided.len(),
        threads,
        worker,
        || false,
        |index, trace| {
            let row = collided[index];
            let group = (row % plan.policies.len(), scene(&rows[row]));
            traces.entry(group).or_default().extend(trace);
            anyhow::Ok(())
        },
    )?;
    std::fs::create_dir_all(plan.out.join(FOLDER)).context("cannot make the folder of collisions")?;
    for (group, traces) in traces.iter().filter(|(_, traces)| !traces.is_empty()) {
        let strips = svg_strips(traces);
        for path in files(plan, group) {
            write_picture(&path, &strips).with_context(|| format!("cannot draw {}", path.display()))?;
        }
    }
    Ok(())
}

/// The rows of the first `most` collisions of each policy in each family.
fn chosen(rows: &[EpisodeRow], policies: usize, most: usize) -> Vec<usize> {
    let mut counts: BTreeMap<Group, usize> = BTreeMap::new();
    let collided = rows.iter().enumerate().filter(|(_, row)| row.end == EpisodeEnd::Collision);
    let first = collided.filter(|(index, row)| {
        let count = counts.entry((index % policies, scene(row))).or_default();
        *count += 1;
        *count <= most
    });
    first.map(|(index, _)| index).collect()
}

fn scene(row: &EpisodeRow) -> String {
    row.family.map_or_else(|| "world-files".to_owned(), |family| family.to_string())
}

fn files(plan: &Plan, (policy, scene): &Group) -> [PathBuf; 2] {
    let label = &plan.policies[*policy].label;
    ["svg", "png"].map(|extension| plan.out.join(FOLDER).join(format!("{label}-{scene}.{extension}")))
}
