//! What in a scan could be a person: groups of beams that hit one small thing, and stand out from what is behind.
//!
//! Neighbouring beams are joined while they hit the same surface. A group that is as small as a person is one; a wider one is
//! looked at again with a finer measure, because somebody may stand close to a wall. Pairs of thin ones are two legs.

use super::fit::{Fit, Guess, POINTS_MAX, fitted};
use crate::geometry::{Point, Vector};
use crate::scan::beams::{Beam, Beams};
use heapless::Vec;
use nalgebra::Matrix2;

/// Things in a scan at most; what lies beyond is left out.
pub(super) const DETECTIONS_MAX: usize = 128;
/// Nothing farther away is looked for, m.
pub(super) const REACH_M: f32 = 8.0;
/// Radius that a person is given until more is known, m.
pub(super) const PERSON_RADIUS_M: f32 = 0.25;
/// Nobody is wider, m.
const WIDEST_M: f32 = 0.75;
/// So much farther away is the background, m.
const BACKGROUND_M: f32 = 0.25;
/// A person bulges towards the robot; hollow by more than this is a corner, m.
const HOLLOW_M: f32 = 0.1;
/// So many failed beams in a row do not part a thing...
const FAILED_MAX: usize = 2;
/// ...nor do as many as look at so much of it, m.
const FAILED_MAX_M: f32 = 0.1;
/// Ranges and points of one thing differ at most by so much, m (points: and by a share of the beams' spacing).
const COARSE: Joint = Joint { range_m: 0.45, point_m: 0.12, spacing: 1.4 };
/// The same, for a second look at what came out too wide.
const FINE: Joint = Joint { range_m: 0.2, point_m: 0.1, spacing: 1.2 };
/// Thinner than this, where it was measured well, is a leg, m.
const LEG_WIDTH_M: f32 = 0.24;
/// A leg's radius, m.
const LEG_RADIUS_M: f32 = 0.06;
/// The legs of a person are at most so far apart, centre to centre, m.
const STRIDE_M: f32 = 0.55;
/// The middle of two legs is the middle of a person but for this, m.
const GAIT_SD_M: f32 = 0.04;
/// A person's width must be so many beams wide for a leg to be told from a person.
const LEG_BEAMS: f32 = 5.0;

/// When two neighbouring hits belong together.
#[derive(Clone, Copy)]
struct Joint {
    range_m: f32,
    point_m: f32,
    spacing: f32,
}

/// A thing of a person's size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detection {
    /// Robot frame, m, with its covariance, m².
    pub(super) center: Point,
    pub(super) cov: Matrix2<f32>,
    pub(super) radius_m: f32,
    /// Its rightmost and its leftmost point.
    pub(super) ends: [Point; 2],
    /// Between neighbouring points of its surface, m.
    pub(super) gap_m: f32,
    /// Whether it stands out from its background: a track may begin with it.
    pub(super) stands_out: bool,
    pub(super) is_leg: bool,
    /// Its centre as a leg, seen whole or beside another one that hides a part of it.
    leg: Option<Point>,
}

/// The beams as a line that begins where a thing begins.
struct Line<'a> {
    beams: &'a [Beam],
    start: usize,
    step_rad: f32,
    is_circle: bool,
}

/// A group of joined hits: places on the line, and its size.
#[derive(Clone, Copy)]
struct Group {
    first: usize,
    last: usize,
    hits: usize,
    nearest_m: f32,
}

impl Line<'_> {
    fn len(&self) -> usize {
        self.beams.len()
    }

    fn index(&self, place: usize) -> usize {
        let index = self.start + place;
        if index >= self.beams.len() { index - self.beams.len() } else { index }
    }

    fn beam(&self, place: usize) -> &Beam {
        &self.beams[self.index(place)]
    }

    /// So many failed beams in a row may lie within a thing at a range.
    fn failed_max(&self, range_m: f32) -> usize {
        FAILED_MAX.max((FAILED_MAX_M / (range_m * self.step_rad)) as usize)
    }

    /// Whether the hits at two places belong together.
    fn joins(&self, from: usize, to: usize, joint: &Joint) -> bool {
        let (a, b) = (self.beam(from), self.beam(to));
        let spacing_m = a.range_m.min(b.range_m) * self.step_rad * (to - from) as f32;
        let apart_m = (point_of(a) - point_of(b)).norm();
        (a.range_m - b.range_m).abs() < joint.range_m && apart_m < joint.point_m + joint.spacing * spacing_m
    }

    /// The range that is seen next to a place, towards higher or lower places; `None` when nobody looks there.
    fn beside_m(&self, place: usize, upwards: bool) -> Option<f32> {
        let count = self.len();
        (1..=self.failed_max(self.beam(place).range_m) + 1).find_map(|step| {
            let next = if upwards { place + step } else { (place + count).checked_sub(step)? };
            let is_beyond = if upwards { next >= count } else { next < count };
            if is_beyond && !self.is_circle {
                return None;
            }
            let range_m = self.beam(next % count).range_m;
            (!range_m.is_nan()).then_some(range_m)
        })
    }
}

pub(super) fn point_of(beam: &Beam) -> Point {
    Point::new(beam.range_m * beam.cos, beam.range_m * beam.sin)
}

/// Finds what could be people.
pub(super) fn detect(beams: &Beams, found: &mut Vec<Detection, DETECTIONS_MAX>) {
    found.clear();
    let all = beams.as_slice();
    let mut line = Line { beams: all, start: 0, step_rad: beams.step_rad(), is_circle: beams.is_circle() };
    if line.is_circle {
        // A circle begins behind a beam that hits nothing, or behind an edge.
        let count = all.len();
        let edge = (0..count).find(|&index| {
            let before = if index == 0 { count - 1 } else { index - 1 };
            let (a, b) = (&all[before], &all[index]);
            !a.range_m.is_nan() && !b.range_m.is_nan() && (a.range_m - b.range_m).abs() > COARSE.range_m
        });
        line.start = edge.unwrap_or(0);
    }
    groups(&line, 0, line.len(), &COARSE, &mut |group| {
        if is_small(&line, &group) {
            add(&line, &group, found);
        } else {
            groups(&line, group.first, group.last + 1, &FINE, &mut |part| {
                if is_small(&line, &part) {
                    add(&line, &part, found);
                }
            });
        }
    });
    pair_legs(found);
}

/// Calls `each` with every group of joined hits among the places `from..to`.
fn groups(line: &Line<'_>, from: usize, to: usize, joint: &Joint, each: &mut dyn FnMut(Group)) {
    let mut open: Option<Group> = None;
    for place in from..to {
        let range_m = line.beam(place).range_m;
        if range_m.is_nan() || range_m <= 0.0 {
            continue;
        }
        let is_near = range_m <= REACH_M;
        match &mut open {
            Some(group)
                if is_near
                    && place - group.last <= line.failed_max(range_m) + 1
                    && line.joins(group.last, place, joint) =>
            {
                group.last = place;
                group.hits += 1;
                group.nearest_m = group.nearest_m.min(range_m);
            }
            _ => {
                if let Some(group) = open.take() {
                    each(group);
                }
                open = is_near.then_some(Group { first: place, last: place, hits: 1, nearest_m: range_m });
            }
        }
    }
    if let Some(group) = open {
        each(group);
    }
}

/// Whether a group is as small as a person, and not hollow: what lies behind the line between its ends is the corner of a
/// room.
fn is_small(line: &Line<'_>, group: &Group) -> bool {
    let (right, left) = (point_of(line.beam(group.first)), point_of(line.beam(group.last)));
    let chord = left - right;
    let width_m = chord.norm();
    if width_m >= WIDEST_M {
        return false;
    }
    let stride = group.hits.div_ceil(2 * POINTS_MAX);
    let inner = (group.first + 1..group.last).step_by(stride).map(|place| line.beam(place));
    // Counter-clockwise from its right end the robot lies to the left of the chord.
    let behind_m = |beam: &Beam| (point_of(beam) - right).perp(&chord) / width_m.max(1e-3);
    let deepest_m = inner.filter(|beam| beam.is_hit()).map(behind_m).fold(0.0, f32::max);
    deepest_m < HOLLOW_M
}

/// What lies beside an end of a group.
#[derive(Clone, Copy, PartialEq)]
enum Edge {
    /// Background: the thing itself ends here.
    Free,
    /// Something nearer, which may hide a part of it, or nobody looks there.
    Hidden,
    /// Something as far away.
    Touching,
}

fn edge(line: &Line<'_>, place: usize, upwards: bool) -> Edge {
    let here_m = line.beam(place).range_m;
    match line.beside_m(place, upwards) {
        Some(beside_m) if beside_m > here_m + BACKGROUND_M => Edge::Free,
        Some(beside_m) if beside_m >= here_m - BACKGROUND_M => Edge::Touching,
        _ => Edge::Hidden,
    }
}

fn add(line: &Line<'_>, group: &Group, found: &mut Vec<Detection, DETECTIONS_MAX>) {
    let (right, left) = (line.beam(group.first), line.beam(group.last));
    let edges = (edge(line, group.first, false), edge(line, group.last, true));
    let spacing_m = group.nearest_m * line.step_rad;
    let width_m = (point_of(left) - point_of(right)).norm() + spacing_m;
    let is_whole = edges == (Edge::Free, Edge::Free);
    let is_resolved = 2.0 * PERSON_RADIUS_M > LEG_BEAMS * spacing_m;
    let is_leg = is_whole && is_resolved && width_m < LEG_WIDTH_M;
    // One radius for everybody: what is measured of it changes from scan to scan, and would look like a velocity.
    let radius_m = if is_leg { 0.5 * width_m } else { PERSON_RADIUS_M };
    let distance_m = group.nearest_m + radius_m;
    // The thing's ends lie half a beam beyond the outermost hits; from one end its centre is a radius away.
    let to_left = Vector::new(left.cos, left.sin);
    let to_right = Vector::new(right.cos, right.sin);
    let half_m = 0.5 * spacing_m;
    let from_right = to_right * distance_m + turned_left(to_right) * (radius_m - half_m);
    let from_left = to_left * distance_m - turned_left(to_left) * (radius_m - half_m);
    let middle = (from_right + from_left) * 0.5;
    let one_edge_m = 0.3 * spacing_m + 0.04;
    let (center, across_sd_m) = match edges {
        (Edge::Free, Edge::Free) => (middle, 0.2 * spacing_m + 0.02),
        (Edge::Free, _) => (from_right, one_edge_m),
        (_, Edge::Free) => (from_left, one_edge_m),
        _ => (middle, 0.15),
    };
    let guess = Guess { center: Point::from(center), radius_m, along_sd_m: 0.1, across_sd_m };
    let stride = group.hits.div_ceil(POINTS_MAX);
    let hits = (group.first..=group.last).map(|place| line.beam(place)).filter(|beam| beam.is_hit());
    let points: Vec<Point, POINTS_MAX> = hits.step_by(stride).take(POINTS_MAX).map(point_of).collect();
    let Fit { center, cov } = fitted(&guess, &points);
    let stands_out = edges.0 == Edge::Free || edges.1 == Edge::Free;
    let _ = found.push(Detection {
        center,
        cov,
        radius_m: if is_whole && is_resolved { (0.5 * width_m).clamp(0.05, 0.4) } else { PERSON_RADIUS_M },
        ends: [point_of(right), point_of(left)],
        gap_m: (point_of(left) - point_of(right)).norm() / group.hits.max(2).saturating_sub(1) as f32,
        stands_out,
        is_leg,
        leg: (is_resolved && stands_out && width_m < LEG_WIDTH_M).then(|| {
            let middle = nalgebra::center(&point_of(right), &point_of(left));
            middle + middle.coords * (LEG_RADIUS_M / middle.coords.norm().max(LEG_RADIUS_M))
        }),
    });
}

fn turned_left(unit: Vector) -> Vector {
    Vector::new(-unit.y, unit.x)
}

/// Two legs become one person, who stands in their middle.
fn pair_legs(found: &mut Vec<Detection, DETECTIONS_MAX>) {
    let mut is_paired = [false; DETECTIONS_MAX];
    for first in 0..found.len() {
        let Some(here) = found[first].leg.filter(|_| !is_paired[first]) else { continue };
        let legs = found.iter().enumerate().filter(|(other, _)| *other != first && !is_paired[*other]);
        let apart =
            legs.filter_map(|(other, leg)| leg.leg.map(|there| ((there - here).norm(), other, there)));
        let Some((apart_m, other, there)) = apart.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if apart_m < STRIDE_M {
            is_paired[other] = true;
            let person = &mut found[first];
            person.center = nalgebra::center(&here, &there);
            person.cov = Matrix2::from_diagonal_element(GAIT_SD_M * GAIT_SD_M);
            person.radius_m = 0.5 * apart_m + LEG_RADIUS_M;
            (person.is_leg, person.leg) = (false, None);
        }
    }
    let mut index = 0;
    found.retain(|_| {
        index += 1;
        !is_paired[index - 1]
    });
}
