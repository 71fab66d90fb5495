//! Two rooms joined by two or three passages; people stream through the shortest.

use super::Split;
use super::dice::Dice;
use super::people::{self, Manners};
use super::scene::{Turn, set_ends, square};
use crate::world::World;

const SIDE_M: f32 = 14.0;
/// From the middle of the shortest passage to the middle of any other, m.
const APART_M: f32 = 3.6;

/// From the middle of the shortest passage to the middle of the next, at most, m.
const DETOUR_MAX_M: f32 = 6.5;

/// A passage through the block between the rooms, along x.
#[derive(Clone, Copy)]
struct Passage {
    y_m: f32,
    width_m: f32,
}

pub(super) fn draft(dice: &mut Dice, split: Split) -> Option<World> {
    let mut world = square(SIDE_M);
    let (left_m, right_m) = (dice.within(3.8..=4.6), dice.within(9.4..=10.2));
    let passages = passages(dice)?;
    let turn = Turn::drawn(dice, SIDE_M);

    let mut sorted = passages.clone();
    sorted.sort_by(|a, b| a.y_m.total_cmp(&b.y_m));
    let tops = sorted.iter().map(|passage| passage.y_m - 0.5 * passage.width_m).chain([SIDE_M]);
    let bottoms = [0.0].into_iter().chain(sorted.iter().map(|passage| passage.y_m + 0.5 * passage.width_m));
    for (bottom_m, top_m) in bottoms.zip(tops).filter(|(bottom_m, top_m)| top_m - bottom_m > 0.05) {
        world.polygons.push(turn.block((left_m, bottom_m), (right_m, top_m)));
    }

    let busy = passages[0];
    let beside = |dice: &mut Dice| (busy.y_m + dice.within(-1.2..=1.2)).clamp(0.6, SIDE_M - 0.6);
    let start = turn.place(dice.within(0.6..=1.6), beside(dice));
    let goal = turn.place(SIDE_M - dice.within(0.6..=1.6), beside(dice));
    set_ends(dice, &mut world, start, goal);

    let manners = Manners::of(split);
    for _ in 0..dice.count(8..=16) {
        let mut person = manners.person(dice);
        people::add(dice, &mut world, &mut person, people::START_DISTANCE_M, |dice| {
            // There on one side of the passage, back on the other.
            let lane_m = busy.width_m * dice.within(0.12..=0.3) * if dice.chance(0.5) { 1.0 } else { -1.0 };
            let (near_m, far_m) = (left_m - dice.within(0.6..=1.4), right_m + dice.within(0.6..=1.4));
            [(near_m, -lane_m), (far_m, -lane_m), (far_m, lane_m), (near_m, lane_m)]
                .map(|(x, offset_m)| turn.place(x, busy.y_m + offset_m))
                .to_vec()
        })?;
    }
    Some(world)
}

/// The busy passage first, then one or two others that lie well beside it and each other.
fn passages(dice: &mut Dice) -> Option<Vec<Passage>> {
    let mut passages =
        vec![Passage { y_m: dice.within(2.0..=SIDE_M - 2.0), width_m: dice.within(1.8..=2.6) }];
    let count = dice.count(2..=3);
    for _ in 0..40 {
        if passages.len() == count {
            break;
        }
        let passage = Passage { y_m: dice.within(1.2..=SIDE_M - 1.2), width_m: dice.within(1.3..=2.0) };
        if passages.iter().all(|other| (other.y_m - passage.y_m).abs() >= APART_M) {
            passages.push(passage);
        }
    }
    // The nearest of the others must be worth its way.
    let detour_m =
        passages[1..].iter().map(|other| (other.y_m - passages[0].y_m).abs()).fold(f32::INFINITY, f32::min);
    (detour_m <= DETOUR_MAX_M).then_some(passages)
}
