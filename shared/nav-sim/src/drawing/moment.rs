//! A moment: how people walk, whom the safety gate follows, what was wished and what leaves.

use super::Seen;
use super::canvas::Canvas;
use super::episode::PERSON;
use crate::people::PersonState;
use nav_core::geometry::{Pose, Vector};
use nav_core::twist::Twist;

/// Velocities and commands are drawn as far as they lead in this time, s.
pub(super) const AHEAD_S: f32 = 1.0;
/// Of what the safety gate follows.
pub(super) const TRACK: &str = "#1f7a8c";
pub(super) const WISH: &str = "#8e44ad";
pub(super) const COMMAND: &str = "#103466";

/// Whom the gate follows, and how they walk as far as it knows.
pub(super) fn draw_tracks(canvas: &mut Canvas, tracks: &[PersonState]) {
    for track in tracks {
        let ring = if track.velocity.norm() > 0.0 { track_ring() } else { still_ring() };
        canvas.circle(track.position, track.radius_m, &ring);
        draw_velocity(canvas, track, &stroke(TRACK, 1.6));
    }
}

/// Where what was wished and what leaves lead from a pose.
pub(super) fn draw_commands(canvas: &mut Canvas, from: Pose, seen: &Seen) {
    draw_command(canvas, from, seen.command, &stroke(COMMAND, 2.6));
    draw_command(canvas, from, seen.wish, &dashed(WISH));
}

/// From the middle of somebody to where the velocity leads, with a head.
pub(super) fn draw_velocity(canvas: &mut Canvas, walker: &PersonState, attributes: &str) {
    let ahead = walker.velocity * AHEAD_S;
    // A stroke shorter than that would hide in the disc.
    if ahead.norm() < 0.1 {
        return;
    }
    let tip = walker.position + ahead;
    let back = ahead.normalize() * 0.13;
    let aside = Vector::new(-back.y, back.x) * 0.6;
    canvas.line([walker.position, tip], attributes);
    canvas.line([tip - back + aside, tip, tip - back - aside], attributes);
}

/// The arc that a command leads along, and the heading at its end: a turn on the spot shows, too.
pub(super) fn draw_command(canvas: &mut Canvas, from: Pose, command: Twist, attributes: &str) {
    const PIECES: u8 = 12;
    let along = (0..=PIECES)
        .map(|piece| from.advanced(command, AHEAD_S * f32::from(piece) / f32::from(PIECES)).position());
    if command.linear_mps.abs() > 0.02 {
        canvas.line(along, attributes);
    }
    let end = from.advanced(command, AHEAD_S);
    canvas.heading(end.position(), end.yaw_rad, 0.42, attributes);
}

pub(super) fn stroke(color: &str, width_px: f32) -> String {
    format!(
        r#"fill="none" stroke="{color}" stroke-width="{width_px}" stroke-linecap="round" stroke-linejoin="round""#
    )
}

pub(super) fn dashed(color: &str) -> String {
    format!(r#"{} stroke-dasharray="3 4""#, stroke(color, 1.6))
}

pub(super) fn person_fill() -> String {
    format!(r#"fill="{PERSON}" fill-opacity="0.45" stroke="{PERSON}" stroke-width="1""#)
}

pub(super) fn track_ring() -> String {
    format!(r#"fill="none" stroke="{TRACK}" stroke-width="1.6" stroke-dasharray="4 2.5""#)
}

/// Of somebody who does not move: as good as a wall.
pub(super) fn still_ring() -> String {
    format!(r#"fill="none" stroke="{TRACK}" stroke-opacity="0.45" stroke-width="0.8" stroke-dasharray="2 3""#)
}
