//! Where a person is on its round: the waypoint, stops, and what it does when it is stuck.

use super::scripted;
use crate::world::Person;
use nav_core::geometry::Vector;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Who comes no nearer to its waypoint for so long turns round, s.
const PATIENCE_S: f32 = 6.0;
/// What counts as nearer, m.
const NEARER_M: f32 = 0.1;
/// Least and largest angle by which those who avoid others walk to one side of straight ahead, rad; the side
/// is drawn. It breaks the symmetry of two who meet head-on.
const BIAS_RAD: [f32; 2] = [0.04, 0.1];
/// Those beside somebody who turns by more than this change sides: cosine of 120 degrees.
const TURNED_ROUND_COS: f32 = -0.5;

/// Where a person is on its round.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker {
    pub(super) waypoint: usize,
    forwards: bool,
    /// Closest that it came to the waypoint, m, and how long ago, s.
    closest_m: f32,
    stalled_s: f32,
    pub(super) patience: scripted::Patience,
    pub(super) bias_rad: f32,
    /// The direction of the waypoint, of length 1.
    pub(super) course: Vector,
    /// Whether those beside it have changed sides.
    pub(super) is_mirrored: bool,
    /// How far the last of those beside it is from its place, m.
    pub(super) lag_m: f32,
    /// How long it still stands at its stop, s; `None` on the way.
    pub(super) stands_s: Option<f32>,
    /// Decides its stops.
    luck: u64,
}

impl Walker {
    /// At the start, before everything.
    pub(super) fn new(rng: &mut impl Rng) -> Self {
        Self {
            waypoint: 0,
            forwards: true,
            closest_m: f32::INFINITY,
            stalled_s: 0.0,
            patience: scripted::Patience::default(),
            bias_rad: drawn_bias_rad(rng),
            course: Vector::zeros(),
            is_mirrored: false,
            lag_m: 0.0,
            stands_s: None,
            luck: 0,
        }
    }

    /// With a seed for its stops.
    pub(super) fn with_luck(&mut self, luck: u64) {
        self.luck = luck;
    }

    /// Goes back where it came from.
    pub(super) fn turn_round(&mut self, count: usize) {
        self.forwards = !self.forwards;
        self.turn_to_next(count);
    }

    /// Takes a new course. Who turns round has those on its left on its right: they change sides instead.
    pub(super) fn head_for(&mut self, course: Vector) {
        self.is_mirrored ^= self.course.dot(&course) < TURNED_ROUND_COS;
        self.course = course;
    }

    /// Whether it stands at its stop for the next `dt_s`, at the waypoint that it has reached.
    pub(super) fn stands_on(&mut self, person: &Person, dt_s: f32) -> bool {
        let Some(stop) = person.stop.filter(|stop| stop.waypoint == self.waypoint) else { return false };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.luck);
        let [least_s, most_s] = stop.seconds;
        let drawn_s = least_s + (most_s - least_s) * rng.random::<f32>();
        let left_s = self.stands_s.unwrap_or(drawn_s) - dt_s;
        if left_s > 0.0 {
            self.stands_s = Some(left_s);
            return true;
        }
        self.stands_s = None;
        self.forwards ^= rng.random::<f32>() < stop.turns_round;
        self.luck = rng.random();
        false
    }

    pub(super) fn turn_to_next(&mut self, count: usize) {
        let step = if self.forwards { 1 } else { count - 1 };
        self.waypoint = (self.waypoint + step) % count;
        self.closest_m = f32::INFINITY;
        self.stalled_s = 0.0;
    }

    pub(super) fn is_stuck(&mut self, distance_m: f32, dt_s: f32) -> bool {
        if distance_m < self.closest_m - NEARER_M {
            self.closest_m = distance_m;
            self.stalled_s = 0.0;
        } else {
            self.stalled_s += dt_s;
        }
        self.stalled_s > PATIENCE_S
    }
}

fn drawn_bias_rad(rng: &mut impl Rng) -> f32 {
    let size_rad = BIAS_RAD[0] + (BIAS_RAD[1] - BIAS_RAD[0]) * rng.random::<f32>();
    if rng.random_bool(0.5) { size_rad } else { -size_rad }
}
