//! What the two policies see. One encoder for training, evaluation and the robot.
//!
//! **Low level** ([`LOW_OBSERVATION`] = 82 numbers): for each of 36 sectors (counter-clockwise from straight
//! back) the compressed clearance in [0, 1]; for each its change over [`CHANGE_S`]; then the
//! target's distance (in 5 m, at most 1), exp(-distance), sine and cosine of its direction, forward speed (negative
//! backwards) and turning rate as shares of the fastest, and the same of what was commanded in each of the last
//! [`SENT_COMMANDS`] steps, newest first. A base obeys late: without the commands that are under way its next motion would not follow from what is seen.
//!
//! **High level** ([`HIGH_OBSERVATION`] = 108 numbers), in the goal-aligned frame: for each of 16 directions
//! [`DIRECTION_FEATURES`] numbers, then [`GLOBAL_FEATURES`] globals. The network scores one candidate at a
//! time and sees the scene *rolled* so that the candidate is at index 0: [`expand_candidates`] makes the
//! [`ACTION_COUNT`] x [`CANDIDATE_FEATURES`] matrix, which makes the scorer equivariant to rotation.
//!
//! Metres, seconds and metres a second are those of the reference robot ([`crate::scale`]); a step is 0.1 s of them,
//! whatever the control period.

mod directions;
mod mirror;

pub use self::mirror::{mirror_high, mirror_high_action, mirror_low, mirror_low_action};

use self::directions::DIRECTION_SIN_COS;
use crate::scale::Scale;
use crate::scan::SECTOR_COUNT;
use crate::task::{ACTION_COUNT, ACTION_GOAL, ACTION_WAIT, CORRIDOR_LIMIT_M, DIRECTION_COUNT, Task};
use crate::twist::Twist;

/// Length of the low-level observation.
pub const LOW_OBSERVATION: usize = 2 * SECTOR_COUNT + 6 + 2 * SENT_COMMANDS;
/// Length of the low-level action: forward speed and turning rate, each in [-1, 1].
pub const LOW_ACTION: usize = 2;
/// The commands of so many of the last steps are seen: as many as are under way at most with the default disturbances.
pub const SENT_COMMANDS: usize = 2;
/// The sector changes span this time, s of the reference robot.
pub const CHANGE_S: f32 = 0.3;
/// Ticks that it can be at most, and the present.
pub(crate) const CHANGE_TICKS: usize = 151;
/// Per direction: corridor, geodesic gain, visits at 1 m and 2.5 m, closing speed, legality.
pub const DIRECTION_FEATURES: usize = 6;
/// Globals of the high level; see [`Globals`].
pub const GLOBAL_FEATURES: usize = 12;
/// Length of the high-level observation, as stored and replayed.
pub const HIGH_OBSERVATION: usize = DIRECTION_COUNT * DIRECTION_FEATURES + GLOBAL_FEATURES;
/// Length of one candidate's row: rolled directions, candidate-relative globals, kind of candidate.
pub const CANDIDATE_FEATURES: usize = DIRECTION_COUNT * DIRECTION_FEATURES + GLOBAL_FEATURES + 4;
/// Names this layout; a manifest with another is refused.
pub const LAYOUT: &str = "low: 36 log-clearance from -pi ccw, 36 change over 3 steps, d/5, exp(-d), sin, cos, v, w, \
     2 x (v, w) sent; high: 16 x (corridor, geodesic gain, visits 1 m, visits 2.5 m, closing, legal), 12 globals; \
     candidate: 112; v4";

/// The fine end of [`Compression`], m of the reference robot.
const COMPRESS_M: f32 = 0.25;

/// Clearance on a logarithmic scale: 0 at contact, 1 at the longest range, fine where it is close. `inverse` is
/// that of its denominator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compression {
    fine_m: f32,
    inverse: f32,
}

impl Compression {
    pub(crate) fn new(range_max_m: f32, scale: &Scale) -> Self {
        let fine_m = scale.m(COMPRESS_M);
        Self { fine_m, inverse: 1.0 / libm::logf(1.0 + range_max_m / fine_m) }
    }

    pub(crate) fn of(self, clearance_m: f32) -> f32 {
        libm::logf(1.0 + clearance_m.max(0.0) / self.fine_m) * self.inverse
    }
}

/// A target as the low level sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Distance, m.
    pub distance_m: f32,
    /// Direction in the robot frame, rad.
    pub bearing_rad: f32,
}

/// How the robot moves, and is about to move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// By odometry.
    pub measured: Twist,
    /// What was commanded in each of the last steps, newest first: [`Sent::seen`](crate::sent::Sent::seen).
    pub sent: [Twist; SENT_COMMANDS],
}

/// Writes the low-level observation from compressed clearances, `before` those of [`CHANGE_S`] ago.
pub fn encode_low(
    task: &Task,
    now: &[f32; SECTOR_COUNT],
    before: &[f32; SECTOR_COUNT],
    target: Target,
    motion: &Motion,
    observation: &mut [f32; LOW_OBSERVATION],
) {
    observation[..SECTOR_COUNT].copy_from_slice(now);
    for sector in 0..SECTOR_COUNT {
        observation[SECTOR_COUNT + sector] = now[sector] - before[sector];
    }
    let rest = &mut observation[2 * SECTOR_COUNT..];
    let distance = target.distance_m / task.scale().length;
    rest[0] = (distance / 5.0).min(1.0);
    rest[1] = libm::expf(-distance);
    rest[2] = libm::sinf(target.bearing_rad);
    rest[3] = libm::cosf(target.bearing_rad);
    let velocities = core::iter::once(&motion.measured).chain(&motion.sent);
    for (shares, velocity) in rest[4..].chunks_exact_mut(2).zip(velocities) {
        shares[0] = velocity.linear_mps / task.robot.linear_max_mps;
        shares[1] = velocity.angular_radps / task.robot.angular_max_radps;
    }
}

/// What the high level sees of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direction {
    /// Free corridor, m.
    pub corridor_m: f32,
    /// How much nearer to the goal its subgoal is along the optimistic geodesic, as a share of the full
    /// subgoal distance, in [-1, 1]; 0 in memory profile `lite`.
    pub geodesic_gain: f32,
    /// Steps (of 0.1 s) spent around the point 1 m away.
    pub visits_near: f32,
    /// Steps (of 0.1 s) spent around the point 2.5 m away.
    pub visits_far: f32,
    /// Speed at which something closes in from there beyond the robot's own motion, m/s.
    pub closing_mps: f32,
    /// Whether the direction may be chosen.
    pub is_legal: bool,
}

/// What the high level sees besides the directions. Angles are in the goal-aligned frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Globals {
    /// Straight distance to the goal, m.
    pub goal_distance_m: f32,
    /// The robot's heading, rad.
    pub heading_rad: f32,
    /// Direction of the last subgoal chosen, rad, if it was a direction.
    pub last_direction_rad: Option<f32>,
    /// The last choice was GOAL.
    pub last_was_goal: bool,
    /// The last choice was WAIT.
    pub last_was_wait: bool,
    /// Share of the policy's horizon ([`crate::task::Decision::horizon_s`]) that is over, 0 to 1.
    pub elapsed: f32,
    /// For how long the robot has stood, s.
    pub standing_s: f32,
    /// How much farther the goal is than it has been at best, m.
    pub setback_m: f32,
    /// How much longer the geodesic is than the straight line, m; 0 in memory profile `lite`.
    pub detour_m: f32,
    /// Forward speed as a share of its limit.
    pub speed: f32,
}

/// Writes the high-level observation.
pub fn encode_high(
    scale: &Scale,
    directions: &[Direction; DIRECTION_COUNT],
    globals: &Globals,
    observation: &mut [f32; HIGH_OBSERVATION],
) {
    let saturate = |value: f32, half: f32| value / (value + half);
    let (limit_m, fast_mps) = (scale.m(CORRIDOR_LIMIT_M), scale.mps(1.5));
    for (direction, features) in directions.iter().zip(observation.chunks_exact_mut(DIRECTION_FEATURES)) {
        features[0] = direction.corridor_m / limit_m;
        features[1] = direction.geodesic_gain;
        features[2] = saturate(direction.visits_near, 5.0);
        features[3] = saturate(direction.visits_far, 5.0);
        features[4] = (direction.closing_mps / fast_mps).clamp(0.0, 1.0);
        features[5] = f32::from(u8::from(direction.is_legal));
    }
    let (last_sin, last_cos) = globals.last_direction_rad.map_or((0.0, 0.0), libm::sincosf);
    let flag = |value: bool| f32::from(u8::from(value));
    observation[DIRECTION_COUNT * DIRECTION_FEATURES..].copy_from_slice(&[
        saturate(globals.goal_distance_m, scale.m(3.0)),
        libm::sinf(globals.heading_rad),
        libm::cosf(globals.heading_rad),
        last_sin,
        last_cos,
        flag(globals.last_was_goal),
        flag(globals.last_was_wait),
        globals.elapsed.clamp(0.0, 1.0),
        (globals.setback_m / scale.m(5.0)).clamp(0.0, 1.0),
        (globals.detour_m / scale.m(10.0)).clamp(0.0, 1.0),
        globals.speed,
        (globals.standing_s / scale.s(5.0)).clamp(0.0, 1.0),
    ]);
}

/// Writes the candidate matrix, row-major `[ACTION_COUNT][CANDIDATE_FEATURES]`, of one observation.
///
/// A row holds the directions counter-clockwise from the candidate's (GOAL and WAIT look along the goal's),
/// then the globals with every angle taken relative to the candidate, then the candidate's own angle to the
/// goal (sine, cosine) and whether it is GOAL or WAIT.
///
/// # Panics
/// If `observation` is not [`HIGH_OBSERVATION`] long, or `rows` not `ACTION_COUNT * CANDIDATE_FEATURES`.
pub fn expand_candidates(observation: &[f32], rows: &mut [f32]) {
    assert_eq!(rows.len(), ACTION_COUNT * CANDIDATE_FEATURES, "one row a candidate");
    for (action, row) in rows.chunks_exact_mut(CANDIDATE_FEATURES).enumerate() {
        expand_candidate(observation, action, row);
    }
}

/// Writes one candidate's row; see [`expand_candidates`].
///
/// # Panics
/// If `observation` is not [`HIGH_OBSERVATION`] long, or `row` not [`CANDIDATE_FEATURES`].
pub fn expand_candidate(observation: &[f32], action: usize, row: &mut [f32]) {
    assert_eq!(observation.len(), HIGH_OBSERVATION, "a high-level observation");
    assert_eq!(row.len(), CANDIDATE_FEATURES, "a candidate's row");
    const SECTORS: usize = DIRECTION_COUNT * DIRECTION_FEATURES;
    let direction = if action < DIRECTION_COUNT { action } else { 0 };
    let split = direction * DIRECTION_FEATURES;
    row[..SECTORS - split].copy_from_slice(&observation[split..SECTORS]);
    row[SECTORS - split..SECTORS].copy_from_slice(&observation[..split]);
    let (sin, cos) = DIRECTION_SIN_COS[direction];
    let globals = &observation[SECTORS..];
    // (sine, cosine) of an angle, less the candidate's angle.
    let relative = |s: f32, c: f32| (s * cos - c * sin, c * cos + s * sin);
    let (heading_sin, heading_cos) = relative(globals[1], globals[2]);
    let (last_sin, last_cos) = relative(globals[3], globals[4]);
    let is = |kind: usize| f32::from(u8::from(action == kind));
    let out = &mut row[SECTORS..];
    out[0] = globals[0];
    (out[1], out[2]) = (heading_sin, heading_cos);
    (out[3], out[4]) = (last_sin, last_cos);
    out[5..GLOBAL_FEATURES].copy_from_slice(&globals[5..]);
    out[GLOBAL_FEATURES..].copy_from_slice(&[sin, cos, is(ACTION_GOAL), is(ACTION_WAIT)]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subgoal::direction_angle_rad;

    /// Turning the whole scene by a sector moves the rows by one place and changes nothing in them but
    /// the candidate's angle to the goal.
    #[test]
    fn the_candidate_matrix_is_equivariant_to_rotation() {
        let mut directions = [Direction::default(); DIRECTION_COUNT];
        for (k, direction) in directions.iter_mut().enumerate() {
            direction.corridor_m = 0.2 * k as f32;
            direction.geodesic_gain = libm::sinf(k as f32);
        }
        let turn = direction_angle_rad(1);
        let globals = Globals { heading_rad: 0.4, last_direction_rad: Some(1.1), ..Globals::default() };
        let turned_globals =
            Globals { heading_rad: 0.4 + turn, last_direction_rad: Some(1.1 + turn), ..globals };
        let mut turned = directions;
        turned.rotate_right(1);
        let expand = |directions: &_, globals: &_| {
            let mut observation = [0.0; HIGH_OBSERVATION];
            encode_high(&Scale::REFERENCE, directions, globals, &mut observation);
            let mut rows = [0.0; ACTION_COUNT * CANDIDATE_FEATURES];
            expand_candidates(&observation, &mut rows);
            rows
        };
        let (rows, turned_rows) = (expand(&directions, &globals), expand(&turned, &turned_globals));
        const SCENE: usize = CANDIDATE_FEATURES - 4;
        for k in 0..DIRECTION_COUNT {
            let next = (k + 1) % DIRECTION_COUNT;
            for feature in 0..SCENE {
                let a = rows[k * CANDIDATE_FEATURES + feature];
                let b = turned_rows[next * CANDIDATE_FEATURES + feature];
                assert!((a - b).abs() < 1e-5, "direction {k}, feature {feature}: {a} {b}");
            }
        }
    }

    #[test]
    fn the_low_level_sees_its_speed_and_the_commands_under_way_as_shares() {
        let mut task = Task::default();
        (task.robot.linear_max_mps, task.robot.angular_max_radps) = (2.0, 4.0);
        let (now, before) = ([0.5; SECTOR_COUNT], [0.25; SECTOR_COUNT]);
        let target = Target { distance_m: 1.0, bearing_rad: 0.0 };
        let sent = [Twist::new(1.5, 2.0), Twist::new(0.5, 4.0)];
        let motion = Motion { measured: Twist::new(1.0, -1.0), sent };
        let mut observation = [f32::NAN; LOW_OBSERVATION];
        encode_low(&task, &now, &before, target, &motion, &mut observation);
        let expected = [0.2, libm::expf(-1.0), 0.0, 1.0, 0.5, -0.25, 0.75, 0.5, 0.25, 1.0];
        let rest = &observation[2 * SECTOR_COUNT..];
        assert_eq!(rest.len(), expected.len());
        for (found, expected) in rest.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{rest:?}");
        }
        assert!(
            observation[SECTOR_COUNT..2 * SECTOR_COUNT].iter().all(|change| (change - 0.25).abs() < 1e-6)
        );
    }

    #[test]
    fn the_table_holds_sines_and_cosines() {
        for (k, (sin, cos)) in DIRECTION_SIN_COS.iter().enumerate() {
            assert!((sin - libm::sinf(direction_angle_rad(k))).abs() < 1e-6);
            assert!((cos - libm::cosf(direction_angle_rad(k))).abs() < 1e-6);
        }
    }

    #[test]
    fn compression_is_monotone_from_zero_to_one() {
        let compress = |clearance_m| Compression::new(5.0, &Scale::REFERENCE).of(clearance_m);
        assert!(compress(-0.1) == 0.0 && (compress(5.0) - 1.0).abs() < 1e-6);
        assert!(compress(0.3) - compress(0.1) > 3.0 * (compress(4.3) - compress(4.1)));
    }
}
