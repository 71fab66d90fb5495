//! One episode: the world, the people, the robot's way, a line of text above and one below.

use super::canvas::{Canvas, Panel};
use super::{EpisodeTrace, TraceStep, moment};
use crate::people::PersonState;
use nav_core::metrics::EpisodeEnd;
use nav_core::task::{ACTION_GOAL, ACTION_WAIT};
use nav_picture::lettering::{Anchor, Style, write_text};

/// Beyond the world's edge.
pub(super) const OUTSIDE: &str = "#e4e2dd";
const FLOOR: &str = "#f8f7f4";
const WALL: &str = "#3b4048";
const SOLID: &str = "#cfccc5";
pub(super) const PERSON: &str = "#dd8452";
const SUBGOAL: &str = "#7b5ea7";
const GOAL: &str = "#2f8f5b";
pub(super) const CRASH: &str = "#c0392b";
pub(super) const TEXT: &str = "#2b2f36";
pub(super) const FAINT: &str = "#7a7f87";
/// The robot's way from its first step to its last.
const RAMP: [[f32; 3]; 3] = [[166.0, 206.0, 236.0], [66.0, 133.0, 190.0], [16.0, 52.0, 102.0]];
/// The way is drawn in at most this many pieces of one colour.
const PIECES: usize = 48;

/// A picture `width` px wide.
pub(super) fn panel(trace: &EpisodeTrace, width: f32) -> Panel {
    let unit = width / 100.0;
    let (margin, head, foot) = (3.0 * unit, 8.0 * unit, 8.0 * unit);
    let mut canvas = Canvas::new(trace.world.bounds, width - 2.0 * margin, margin, head);
    let edge_px = (0.45 * unit).max(1.6);
    draw_ground(&mut canvas, trace, edge_px);
    draw_people(&mut canvas, trace, unit);
    draw_way(&mut canvas, &trace.steps, 0.55 * unit);
    draw_decisions(&mut canvas, trace, unit);
    draw_robot(&mut canvas, trace, edge_px);
    draw_seen(&mut canvas, trace);

    let height = head + canvas.height() + foot;
    let mut body = std::mem::take(&mut canvas.svg);
    draw_text(&mut body, trace, width, unit, margin, height);
    draw_scale(&mut body, &canvas, margin, height - 2.8 * unit, unit);
    Panel { width, height, body }
}

/// What does not move: the floor, obstacles and the goal.
pub(super) fn draw_ground(canvas: &mut Canvas, trace: &EpisodeTrace, edge_px: f32) {
    canvas.floor(trace.world.bounds, FLOOR, WALL, edge_px);
    draw_obstacles(canvas, trace, edge_px);
    draw_goal(canvas, trace, edge_px);
}

fn draw_obstacles(canvas: &mut Canvas, trace: &EpisodeTrace, edge_px: f32) {
    let world = &trace.world;
    let solid = format!(r#"fill="{SOLID}" stroke="{WALL}" stroke-width="{:.1}""#, 0.6 * edge_px);
    for polygon in &world.polygons {
        canvas.polygon(polygon.vertices.iter().copied(), &solid);
    }
    for disc in &world.discs {
        canvas.circle(disc.center, disc.radius_m, &solid);
    }
    let wall = format!(r#"fill="none" stroke="{WALL}" stroke-width="{edge_px:.1}" stroke-linecap="round""#);
    for segment in &world.segments {
        canvas.line([segment.a, segment.b], &wall);
    }
}

fn draw_goal(canvas: &mut Canvas, trace: &EpisodeTrace, edge_px: f32) {
    let goal = trace.world.goal;
    let ring = format!(r#"fill="{GOAL}" fill-opacity="0.18" stroke="{GOAL}" stroke-width="{edge_px:.1}""#);
    canvas.circle(goal, trace.goal_radius_m, &ring);
    canvas.circle(goal, 0.25 * trace.goal_radius_m, &format!(r#"fill="{GOAL}""#));
}

fn draw_people(canvas: &mut Canvas, trace: &EpisodeTrace, unit: f32) {
    let trail = format!(
        r#"fill="none" stroke="{PERSON}" stroke-opacity="0.35" stroke-width="{:.1}" stroke-linejoin="round""#,
        0.3 * unit
    );
    let disc = format!(
        r#"fill="{PERSON}" fill-opacity="0.55" stroke="{PERSON}" stroke-width="{:.1}""#,
        (0.15 * unit).max(0.8)
    );
    for (index, person) in trace.world.people.iter().enumerate() {
        let way = trace.steps.iter().filter_map(|step| step.people.get(index).map(|person| person.position));
        let last = way.clone().next_back().unwrap_or(person.start);
        canvas.line(way, &trail);
        canvas.circle(last, person.radius_m, &disc);
    }
    for person in trace.steps.last().iter().flat_map(|step| &step.people) {
        moment::draw_velocity(canvas, person, &moment::stroke(PERSON, 1.4));
    }
}

fn draw_decisions(canvas: &mut Canvas, trace: &EpisodeTrace, unit: f32) {
    let link = format!(
        r#"stroke="{SUBGOAL}" stroke-opacity="0.35" stroke-width="{:.1}" stroke-dasharray="{:.1} {:.1}""#,
        0.15 * unit,
        0.4 * unit,
        0.5 * unit
    );
    let mark = format!(r#"fill="{SUBGOAL}" fill-opacity="0.85""#);
    for decision in &trace.decisions {
        let Some(from) = trace.steps.get(decision.step).map(|step| step.pose.position()) else { continue };
        match decision.action as usize {
            // The goal has its own mark.
            ACTION_GOAL => {}
            ACTION_WAIT => canvas.square(from, 0.45 * unit, &mark),
            _ => {
                canvas.line([from, decision.subgoal], &link);
                canvas.dot(decision.subgoal, 0.45 * unit, &mark);
            }
        }
    }
}

fn draw_way(canvas: &mut Canvas, steps: &[TraceStep], width_px: f32) {
    let pieces = steps.len().saturating_sub(1).min(PIECES);
    for piece in 0..pieces {
        let bound = |piece: usize| piece * (steps.len() - 1) / pieces;
        let share = (piece as f32 + 0.5) / pieces as f32;
        let attributes = format!(
            r#"fill="none" stroke="{}" stroke-width="{width_px:.1}" stroke-linecap="round" stroke-linejoin="round""#,
            ramp(share)
        );
        canvas.line(
            steps[bound(piece)..=bound(piece + 1)].iter().map(|step| step.pose.position()),
            &attributes,
        );
    }
}

fn draw_robot(canvas: &mut Canvas, trace: &EpisodeTrace, edge_px: f32) {
    let start = trace.world.start;
    let tick = |color: &str| {
        format!(r#"fill="none" stroke="{color}" stroke-width="{edge_px:.1}" stroke-linecap="round""#)
    };
    let pale = ramp(0.35);
    let ring = format!(r##"fill="#ffffff" fill-opacity="0.8" stroke="{pale}" stroke-width="{edge_px:.1}""##);
    canvas.footprint(start, &trace.footprint, &ring);
    let tick_m = 1.6 * trace.footprint.reach_m(1.0, 0.0);
    canvas.heading(start.position(), start.yaw_rad, tick_m, &tick(&pale));
    if let Some(last) = trace.steps.last().map(|step| step.pose) {
        let color = if trace.end == Some(EpisodeEnd::Collision) { CRASH.to_owned() } else { ramp(1.0) };
        let body =
            format!(r#"fill="{color}" fill-opacity="0.85" stroke="{color}" stroke-width="{edge_px:.1}""#);
        canvas.footprint(last, &trace.footprint, &body);
        canvas.heading(last.position(), last.yaw_rad, tick_m, &tick(&color));
    }
}

/// What the robot saw and did last.
fn draw_seen(canvas: &mut Canvas, trace: &EpisodeTrace) {
    let newest = trace.steps.iter().rev().take(2).find_map(|step| Some((step.pose, step.seen.as_ref()?)));
    if let Some((pose, seen)) = newest {
        let moving = |track: &&PersonState| track.velocity.norm() > 0.0;
        let tracks: Vec<PersonState> = seen.tracks.iter().filter(moving).copied().collect();
        moment::draw_tracks(canvas, &tracks);
        moment::draw_commands(canvas, pose, seen);
    }
}

fn draw_text(svg: &mut String, trace: &EpisodeTrace, width: f32, unit: f32, margin: f32, height: f32) {
    let end_color = match trace.end {
        Some(EpisodeEnd::Success) => GOAL,
        Some(EpisodeEnd::Collision) => CRASH,
        Some(EpisodeEnd::Timeout | EpisodeEnd::BelievedArrived) | None => FAINT,
    };
    let style = |height: f32, share: f32, color, weight| Style {
        height,
        width_max: share * (width - 2.0 * margin),
        color,
        weight,
    };
    let title = style(2.5 * unit, 0.68, TEXT, 0.95);
    write_text(svg, &trace.title, (margin, 5.4 * unit), Anchor::Start, &title);
    let end = style(2.2 * unit, 0.28, end_color, 1.0);
    write_text(svg, trace.end.map_or("", EpisodeEnd::word), (width - margin, 5.4 * unit), Anchor::End, &end);
    if trace.steps.len() > 1 {
        let label = format!("{} steps", trace.steps.len() - 1);
        let at = (width - margin, height - 2.8 * unit);
        write_text(svg, &label, at, Anchor::End, &style(1.7 * unit, 0.4, FAINT, 0.9));
    }
}

/// A bar of a round length.
fn draw_scale(svg: &mut String, canvas: &Canvas, left: f32, baseline: f32, unit: f32) {
    let longest_m = 18.0 * unit / canvas.scale;
    let decade = libm::powf(10.0, libm::log10f(longest_m).floor());
    let length_m = [5.0, 2.0, 1.0].map(|step| step * decade).into_iter().find(|length| *length <= longest_m);
    let length_m = length_m.unwrap_or(decade);
    let (right, y) = (left + length_m * canvas.scale, baseline - 0.85 * unit);
    let stroke = 0.3 * unit;
    let bar = format!(
        r#"<path d="M{left:.1} {:.1}V{:.1}M{left:.1} {y:.1}H{right:.1}M{right:.1} {:.1}V{:.1}" fill="none" stroke="{FAINT}" stroke-width="{stroke:.1}"/>"#,
        y - 0.7 * unit,
        y + 0.7 * unit,
        y - 0.7 * unit,
        y + 0.7 * unit
    );
    svg.push_str(&bar);
    svg.push('\n');
    let style = Style { height: 1.7 * unit, width_max: 40.0 * unit, color: FAINT, weight: 0.9 };
    write_text(svg, &format!("{length_m} m"), (right + 1.4 * unit, baseline), Anchor::Start, &style);
}

/// The colour of the way at a share of its time.
pub(super) fn ramp(share: f32) -> String {
    let at = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let index = (at as usize).min(RAMP.len() - 2);
    let blend = |channel: usize| {
        let (from, to) = (RAMP[index][channel], RAMP[index + 1][channel]);
        (from + (to - from) * (at - index as f32)).round() as u8
    };
    format!("#{:02x}{:02x}{:02x}", blend(0), blend(1), blend(2))
}
