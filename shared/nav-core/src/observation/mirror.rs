//! A scene and its mirror image, left for right, are the same problem: what is learned of one holds for the other.
//!
//! The high level's directions lie evenly about the goal's, so that its mirror image is exact. A beam on the border of two
//! sectors counts to the one that begins there, so that a low level's mirror image is off by up to half a sector (5
//! degrees).

use super::{DIRECTION_FEATURES, HIGH_OBSERVATION, LOW_ACTION, LOW_OBSERVATION};
use crate::scan::SECTOR_COUNT;
use crate::task::DIRECTION_COUNT;

/// Behind the sectors, what turns about: the target's sine, and the turning rates.
const LOW_TURNING: [usize; 4] = [2, 5, 7, 9];
/// Among the globals: the sines of the heading and of the last direction.
const HIGH_SINES: [usize; 2] = [1, 3];

/// Turns a low-level observation into that of the mirror image.
///
/// # Panics
/// If `observation` is not [`LOW_OBSERVATION`] long.
pub fn mirror_low(observation: &mut [f32]) {
    assert_eq!(observation.len(), LOW_OBSERVATION, "a low-level observation");
    let (sectors, rest) = observation.split_at_mut(2 * SECTOR_COUNT);
    sectors.chunks_exact_mut(SECTOR_COUNT).for_each(<[f32]>::reverse);
    for feature in LOW_TURNING {
        rest[feature] = -rest[feature];
    }
}

/// Turns a low-level action into what does the same in the mirror image.
///
/// # Panics
/// If `action` is not [`LOW_ACTION`] long.
pub fn mirror_low_action(action: &mut [f32]) {
    assert_eq!(action.len(), LOW_ACTION, "a low-level action");
    action[1] = -action[1];
}

/// Turns a high-level observation into that of the mirror image.
///
/// # Panics
/// If `observation` is not [`HIGH_OBSERVATION`] long.
pub fn mirror_high(observation: &mut [f32]) {
    assert_eq!(observation.len(), HIGH_OBSERVATION, "a high-level observation");
    let (directions, globals) = observation.split_at_mut(DIRECTION_COUNT * DIRECTION_FEATURES);
    for direction in 1..DIRECTION_COUNT / 2 {
        for feature in 0..DIRECTION_FEATURES {
            let there = mirror_high_action(direction) * DIRECTION_FEATURES + feature;
            directions.swap(direction * DIRECTION_FEATURES + feature, there);
        }
    }
    for feature in HIGH_SINES {
        globals[feature] = -globals[feature];
    }
}

/// The high-level action that does the same in the mirror image.
pub const fn mirror_high_action(action: usize) -> usize {
    if action < DIRECTION_COUNT { (DIRECTION_COUNT - action) % DIRECTION_COUNT } else { action }
}

#[cfg(test)]
mod tests {
    use super::super::{Direction, Globals, Motion, Target, encode_high, encode_low};
    use super::*;
    use crate::scale::Scale;
    use crate::task::{ACTION_COUNT, ACTION_GOAL, ACTION_WAIT, Task};
    use crate::twist::Twist;

    #[test]
    fn what_the_low_level_sees_of_the_mirror_image_is_the_mirror_image_of_what_it_sees() {
        let mut now: [f32; SECTOR_COUNT] = core::array::from_fn(|sector| 0.01 * sector as f32);
        let mut before: [f32; SECTOR_COUNT] = core::array::from_fn(|sector| 0.02 * sector as f32);
        let encode = |now: &_, before: &_, side: f32| {
            let target = Target { distance_m: 1.5, bearing_rad: 0.7 * side };
            let turning = |linear_mps, angular_radps: f32| Twist::new(linear_mps, side * angular_radps);
            let motion =
                Motion { measured: turning(0.4, 0.3), sent: [turning(0.5, -0.6), turning(0.2, 0.9)] };
            let mut observation = [0.0; LOW_OBSERVATION];
            encode_low(&Task::default(), now, before, target, &motion, &mut observation);
            observation
        };
        let mut mirrored = encode(&now, &before, 1.0);
        mirror_low(&mut mirrored);
        now.reverse();
        before.reverse();
        assert!(mirrored.iter().eq(&encode(&now, &before, -1.0)), "{mirrored:?}");
        let mut action = [0.3, 0.8];
        mirror_low_action(&mut action);
        assert!(action.iter().eq(&[0.3, -0.8]), "{action:?}");
    }

    #[test]
    fn what_the_high_level_sees_of_the_mirror_image_is_the_mirror_image_of_what_it_sees() {
        let direction = |k: usize| Direction {
            corridor_m: 0.2 * k as f32,
            geodesic_gain: libm::sinf(k as f32),
            visits_near: k as f32,
            visits_far: 3.0,
            closing_mps: 0.05 * k as f32,
            is_legal: k.is_multiple_of(3),
        };
        let directions: [Direction; DIRECTION_COUNT] = core::array::from_fn(direction);
        let there = core::array::from_fn(|k| directions[mirror_high_action(k)]);
        let globals = |side: f32| Globals {
            heading_rad: 0.4 * side,
            last_direction_rad: Some(1.1 * side),
            detour_m: 2.0,
            ..Globals::default()
        };
        let encode = |directions: &_, side: f32| {
            let mut observation = [0.0; HIGH_OBSERVATION];
            encode_high(&Scale::REFERENCE, directions, &globals(side), &mut observation);
            observation
        };
        let mut mirrored = encode(&directions, 1.0);
        mirror_high(&mut mirrored);
        assert!(mirrored.iter().eq(&encode(&there, -1.0)), "{mirrored:?}");
    }

    #[test]
    fn the_mirror_image_of_the_mirror_image_is_the_scene() {
        let once: [usize; ACTION_COUNT] = core::array::from_fn(mirror_high_action);
        assert_eq!(once.map(mirror_high_action), core::array::from_fn(|action| action));
        assert_eq!((once[0], once[1], once[8]), (0, 15, 8));
        assert_eq!((once[ACTION_GOAL], once[ACTION_WAIT]), (ACTION_GOAL, ACTION_WAIT));
    }
}
