//! The last seconds of an episode, moment beside moment in the same window of the world: why did it end like that?

use super::canvas::{Canvas, Panel};
use super::episode::{self, CRASH, FAINT, PERSON, TEXT};
use super::moment::{
    self, COMMAND, TRACK, WISH, dashed, draw_velocity, person_fill, still_ring, stroke, track_ring,
};
use super::{EpisodeTrace, TraceStep};
use crate::world::Bounds;
use nav_core::geometry::Vector;
use nav_core::twist::Twist;
use nav_picture::lettering::{Anchor, Style, write_text};
use std::fmt::Write;

/// When the moments are, s before the end.
const MOMENTS_S: [f32; 6] = [3.0, 2.0, 1.2, 0.6, 0.3, 0.0];
/// Side of a window, m and px.
const WINDOW_M: f32 = 6.0;
const WINDOW_PX: f32 = 250.0;
/// Between windows, and around a strip, px.
const GAP_PX: f32 = 10.0;
/// Above and below the windows, px.
const HEAD_PX: f32 = 30.0;
const FOOT_PX: f32 = 62.0;
/// Width of every strip, px.
pub(super) const STRIP_PX: f32 = MOMENTS_S.len() as f32 * (WINDOW_PX + GAP_PX) + GAP_PX;

/// A strip of an episode's last seconds; `index` tells it from the others of a document.
pub(super) fn panel(trace: &EpisodeTrace, index: usize) -> Panel {
    let window = window(trace);
    let mut body = String::new();
    draw_title(&mut body, trace);
    for (column, before_s) in MOMENTS_S.into_iter().enumerate() {
        let left = GAP_PX + column as f32 * (WINDOW_PX + GAP_PX);
        let at = step_at(trace, before_s);
        draw_window(&mut body, trace, at, window, left, &format!("strip{index}-{column}"));
        draw_caption(&mut body, trace, at, left);
    }
    Panel { width: STRIP_PX, height: HEAD_PX + WINDOW_PX + FOOT_PX, body }
}

/// What the marks mean, for the foot of a sheet.
pub(super) fn legend() -> Panel {
    let mut body = String::new();
    let (height, mut left) = (34.0, GAP_PX);
    let disc = |color: &str, x: f32| format!(r#"<circle cx="{x:.0}" cy="15" r="7" {color}/>"#);
    let line = |stroke: &str, x: f32| format!(r#"<path d="M{x:.0} 15h26" {stroke}/>"#);
    let entries = [
        (disc(&person_fill(), 8.0), "a person"),
        (disc(&track_ring(), 8.0), "followed by the gate"),
        (disc(&still_ring(), 8.0), "followed, standing"),
        (line(&stroke(PERSON, 1.6), 0.0), "true velocity, 1 s"),
        (line(&stroke(TRACK, 1.6), 0.0), "believed velocity, 1 s"),
        (line(&dashed(WISH), 0.0), "what is wished, 1 s"),
        (line(&stroke(COMMAND, 2.6), 0.0), "what leaves, 1 s"),
        (line(&stroke(&episode::ramp(0.4), 1.6), 0.0), "the robot's way"),
        (format!(r#"<circle cx="8" cy="15" r="2" fill="{CRASH}"/>"#), "a hit of the lidar"),
    ];
    let count = entries.len() as f32;
    for (mark, words) in entries {
        writeln!(body, r#"<g transform="translate({left:.0} 0)">{mark}</g>"#)
            .expect("a string takes everything");
        let style = Style { height: 9.0, width_max: 128.0, color: TEXT, weight: 0.9 };
        write_text(&mut body, words, (left + 33.0, 19.5), Anchor::Start, &style);
        left += (STRIP_PX - GAP_PX) / count;
    }
    Panel { width: STRIP_PX, height, body }
}

/// The step that was so long before the end.
fn step_at(trace: &EpisodeTrace, before_s: f32) -> usize {
    let before = (before_s / trace.period_s).round() as usize;
    trace.steps.len().saturating_sub(1 + before)
}

/// Around the middle of the way that is shown.
fn window(trace: &EpisodeTrace) -> Bounds {
    let steps = &trace.steps[step_at(trace, MOMENTS_S[0])..];
    let positions = || steps.iter().map(|step| step.pose.position());
    let first = positions().next().unwrap_or(trace.world.start.position());
    let (min, max) = positions().fold((first, first), |(min, max), at| (min.inf(&at), max.sup(&at)));
    let middle = min + (max - min) * 0.5;
    let half = Vector::repeat(0.5 * WINDOW_M);
    Bounds { min: middle - half, max: middle + half }
}

fn draw_window(svg: &mut String, trace: &EpisodeTrace, at: usize, window: Bounds, left: f32, clip: &str) {
    let mut canvas = Canvas::new(window, WINDOW_PX, left, HEAD_PX);
    let frame = |attributes: &str| {
        format!(
            r#"<rect x="{left:.1}" y="{HEAD_PX:.1}" width="{WINDOW_PX:.1}" height="{WINDOW_PX:.1}" {attributes}/>"#
        )
    };
    episode::draw_ground(&mut canvas, trace, 1.6);
    if let Some(step) = trace.steps.get(at) {
        draw_moment(&mut canvas, trace, at, step);
    }
    let is_last = at + 1 == trace.steps.len();
    let (color, width) = if is_last { (CRASH, 1.6) } else { (FAINT, 0.8) };
    writeln!(
        svg,
        r#"<clipPath id="{clip}">{}</clipPath>
{}
<g clip-path="url(#{clip})">
{}</g>
{}"#,
        frame(""),
        frame(&format!(r#"fill="{}""#, episode::OUTSIDE)),
        canvas.svg,
        frame(&format!(r#"fill="none" stroke="{color}" stroke-width="{width}""#)),
    )
    .expect("a string takes everything");
}

fn draw_moment(canvas: &mut Canvas, trace: &EpisodeTrace, at: usize, step: &TraceStep) {
    let way = trace.steps[step_at(trace, MOMENTS_S[0])..=at].iter().map(|step| step.pose.position());
    canvas.line(way, &stroke(&episode::ramp(0.4), 1.6));
    for person in &step.people {
        canvas.circle(person.position, person.radius_m, &person_fill());
        draw_velocity(canvas, person, &stroke(PERSON, 1.6));
    }
    if let Some(seen) = &step.seen {
        for hit in &seen.hits {
            canvas.dot(*hit, 1.7, &format!(r#"fill="{CRASH}""#));
        }
        moment::draw_tracks(canvas, &seen.tracks);
    }
    let is_crash = at + 1 == trace.steps.len();
    let color = if is_crash { CRASH.to_owned() } else { episode::ramp(1.0) };
    let body = format!(r#"fill="{color}" fill-opacity="0.75" stroke="{color}" stroke-width="1.2""#);
    canvas.footprint(step.pose, &trace.footprint, &body);
    let tick_m = trace.footprint.reach_m(1.0, 0.0);
    canvas.heading(step.pose.position(), step.pose.yaw_rad, tick_m, &stroke("#ffffff", 1.6));
    if let Some(seen) = &step.seen {
        moment::draw_commands(canvas, step.pose, seen);
    }
}

fn draw_title(svg: &mut String, trace: &EpisodeTrace) {
    let style = |color| Style { height: 11.0, width_max: 0.5 * STRIP_PX, color, weight: 1.0 };
    write_text(svg, &trace.title, (GAP_PX, HEAD_PX - 10.0), Anchor::Start, &style(TEXT));
    let time_s = trace.steps.len().saturating_sub(1) as f32 * trace.period_s;
    let moving = if trace.hit_while_standing { "while it stood" } else { "while it moved" };
    let word = trace.end.map_or("", nav_core::metrics::EpisodeEnd::word);
    let end = format!("{word} {moving}, after {time_s:.1} s");
    write_text(svg, &end, (STRIP_PX - GAP_PX, HEAD_PX - 10.0), Anchor::End, &style(CRASH));
}

/// When it is, what is wished and what leaves, and what the gate says.
fn draw_caption(svg: &mut String, trace: &EpisodeTrace, at: usize, left: f32) {
    let mut line = |row: u8, text: &str, color: &'static str| {
        let style = Style { height: 9.0, width_max: WINDOW_PX, color, weight: 0.9 };
        write_text(
            svg,
            text,
            (left, HEAD_PX + WINDOW_PX + 15.0 + 15.0 * f32::from(row)),
            Anchor::Start,
            &style,
        );
    };
    let before_s = (trace.steps.len() - 1).saturating_sub(at) as f32 * trace.period_s;
    let Some(seen) = trace.steps.get(at).and_then(|step| step.seen.as_ref()) else {
        line(0, if at + 1 == trace.steps.len() { "the end" } else { "" }, TEXT);
        return;
    };
    let words = |twist: Twist| format!("{:.2} m/s {:+.2} rad/s", twist.linear_mps, twist.angular_radps);
    line(0, &format!("-{before_s:.1} s  leaves {}", words(seen.command)), COMMAND);
    line(1, &format!("wished {}", words(seen.wish)), WISH);
    if let Some(intervention) = seen.intervention {
        line(2, &intervention.to_string(), TRACK);
    }
}
