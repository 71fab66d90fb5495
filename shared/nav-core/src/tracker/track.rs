//! One followed thing.

use super::filter::Filter;
use super::memory::Chord;
use crate::geometry::{Point, Vector};
use heapless::Vec;
use nalgebra::{Matrix2, Matrix4};

/// Slower than this is standing, m/s.
pub const STANDING_MPS: f32 = 0.12;
/// Nobody walks faster, m/s.
const FASTEST_MPS: f32 = 2.5;
/// Places of its surface that are remembered...
const TRAIL: usize = 5;
/// ...and the time between them, ns.
const TRAIL_APART_NS: u64 = 150_000_000;
/// A scan without evidence takes so much of it away.
const DOUBT: f32 = 0.25;
/// What is known to move is looked at for evidence in one of so many scans.
const ASKED_EVERY: u32 = 3;
/// So much evidence shows that it moves...
const EVIDENCE_ENOUGH: f32 = 2.0;
/// ...which is doubted again when less is left than this...
const EVIDENCE_LEAST: f32 = 0.5;
/// ...and no more than this is kept.
const EVIDENCE_MAX: f32 = 4.0;

/// A person, or what could be one, in the `odom` frame.
#[derive(Clone, Debug)]
pub struct Track {
    /// Its own for as long as it is followed.
    pub id: u32,
    /// Centre, m.
    pub position: Point,
    /// m/s; 0 for what has never been seen to move.
    pub velocity: Vector,
    /// m.
    pub radius_m: f32,
    /// Standard deviation of the position along its most uncertain direction, m.
    pub position_sd_m: f32,
    /// The same of the velocity, m/s.
    pub velocity_sd_mps: f32,
    /// Time since it was first seen, s.
    pub age_s: f32,
    /// Time since it was last seen, s.
    pub unseen_s: f32,
    pub(super) filter: Filter,
    pub(super) hits: u32,
    pub(super) evidence: f32,
    pub(super) has_moved: bool,
    trail: Vec<Chord, TRAIL>,
    trail_ns: u64,
}

impl Track {
    pub(super) fn new(id: u32, position: Point, cov: Matrix2<f32>, radius_m: f32) -> Self {
        let mut track = Self {
            id,
            position,
            velocity: Vector::zeros(),
            radius_m,
            position_sd_m: 0.0,
            velocity_sd_mps: 0.0,
            age_s: 0.0,
            unseen_s: 0.0,
            filter: Filter::new(position, cov),
            hits: 1,
            evidence: 0.0,
            has_moved: false,
            trail: Vec::new(),
            trail_ns: 0,
        };
        track.publish();
        track
    }

    /// Whether it moves now. What has never taken a place that was free before does not, however its visible part slides.
    pub fn is_moving(&self) -> bool {
        self.has_moved && self.velocity.norm_squared() > STANDING_MPS * STANDING_MPS
    }

    /// Whether it was seen to move at some time: a person, though it may stand now. Anything else may be a pillar.
    pub fn has_moved(&self) -> bool {
        self.has_moved
    }

    /// Covariance of x, y (m) and their velocities (m/s).
    pub fn covariance(&self) -> Matrix4<f32> {
        let mut cov = Matrix4::zeros();
        cov.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.filter.position_cov);
        cov.fixed_view_mut::<2, 2>(0, 2).copy_from(&self.filter.cross_cov);
        cov.fixed_view_mut::<2, 2>(2, 0).copy_from(&self.filter.cross_cov.transpose());
        cov.fixed_view_mut::<2, 2>(2, 2).copy_from(&self.filter.velocity_cov);
        cov
    }

    pub(super) fn predict(&mut self, dt_s: f32) {
        self.filter.predict(dt_s);
        self.age_s += dt_s;
        self.unseen_s += dt_s;
    }

    /// Whether it seems to move, so that evidence is asked for; of what is known to move less often.
    pub(super) fn is_due_for_evidence(&self) -> bool {
        let seems_moving = self.filter.velocity.norm_squared() > STANDING_MPS * STANDING_MPS;
        seems_moving && (!self.has_moved || self.hits.wrapping_add(self.id).is_multiple_of(ASKED_EVERY))
    }

    /// Takes in how much speaks for it having moved: nothing speaks against it a little.
    pub(super) fn weigh(&mut self, evidence: f32) {
        let doubt = if self.has_moved { ASKED_EVERY as f32 * DOUBT } else { DOUBT };
        let change = if evidence > 0.0 { evidence } else { -doubt };
        self.evidence = (self.evidence + change).clamp(0.0, EVIDENCE_MAX);
        self.has_moved = self.evidence >= if self.has_moved { EVIDENCE_LEAST } else { EVIDENCE_ENOUGH };
    }

    /// Remembers where its visible side lay.
    pub(super) fn leave_trail(&mut self, side: Chord, stamp_ns: u64) {
        if self.trail.is_empty() || stamp_ns.saturating_sub(self.trail_ns) >= TRAIL_APART_NS {
            if self.trail.is_full() {
                self.trail.remove(0);
            }
            let _ = self.trail.push(side);
            self.trail_ns = stamp_ns;
        }
    }

    pub(super) fn trail(&self) -> &[Chord] {
        &self.trail
    }

    /// Shows what the filter knows.
    pub(super) fn publish(&mut self) {
        self.filter.limit_speed(FASTEST_MPS);
        self.position = self.filter.position;
        self.velocity = if self.has_moved { self.filter.velocity } else { Vector::zeros() };
        self.position_sd_m = largest_sd(&self.filter.position_cov);
        self.velocity_sd_mps = largest_sd(&self.filter.velocity_cov);
    }
}

fn largest_sd(cov: &Matrix2<f32>) -> f32 {
    let (mean, half) = (0.5 * (cov.m11 + cov.m22), 0.5 * (cov.m11 - cov.m22));
    libm::sqrtf((mean + libm::sqrtf(half * half + cov.m12 * cov.m12)).max(0.0))
}
